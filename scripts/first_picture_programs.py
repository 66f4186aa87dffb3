"""First pictures by other programs, each in a process of its own.

    python first_picture_programs.py prepare VALUES.npy GRID.json VOLUME.vti
    python first_picture_programs.py pyvista|f3d|vtk VOLUME.vti PICTURE.png SIZE KIND

It runs in the environment that `sh scripts/setup.sh "" side-by-side` makes, where texvol is not installed. Every
program draws what it draws when nothing is said but the file: PyVista `Plotter.add_volume(grid)`, F3D a volume (its
option `--volume`). VTK has no first picture; it draws a shaded volume by a transfer function for the kind of data.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

# Value, colour (sRGB), opacity per unit distance. Hounsfield units: those of "CT_Bone" in VTK's example
# FixedPointVolumeRayCastMapperCT. Fractions of the range: a shaded surface, for what is dense and bright.
_CT_BONE = [
    (-3024, (0.00, 0.00, 0.00), 0.0),
    (-16, (0.73, 0.25, 0.30), 0.0),
    (641, (0.90, 0.82, 0.56), 0.72),
    (3071, (1.00, 1.00, 1.00), 0.71),
]
_FRACTIONS = [
    (0.0, (0.00, 0.00, 0.00), 0.0),
    (0.2, (0.55, 0.25, 0.15), 0.0),
    (0.5, (0.88, 0.60, 0.29), 0.15),
    (1.0, (1.00, 1.00, 1.00), 0.85),
]


def prepare(values: str, grid: str, target: str) -> None:
    """Write a VTK image of an array, z first, and its grid."""
    import numpy as np
    import pyvista

    array, told = np.load(values), json.loads(Path(grid).read_text(encoding="utf-8"))
    image = pyvista.ImageData(dimensions=array.shape[::-1], spacing=told["spacing"], origin=told["origin"])
    image.direction_matrix = np.array(told["direction"])
    image.point_data["values"] = array.reshape(-1)
    image.save(target)


def with_pyvista(volume: str, picture: str, side: int) -> None:
    """Draw what PyVista shows of a volume of which nothing is said."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=[side, side])
    plotter.add_volume(pyvista.read(volume))
    plotter.screenshot(picture)


def with_f3d(volume: str, picture: str, side: int) -> None:
    """Draw what F3D shows with `--volume`."""
    import f3d

    engine = f3d.Engine.create(True)
    engine.window.size = side, side
    engine.options["model.volume.enable"] = True
    engine.options["model.coloring"] = "scivis"  # as its window colours arrays
    engine.scene.add(volume)
    engine.window.render_to_image().save(picture)


def with_vtk(volume: str, picture: str, side: int, kind: str) -> None:
    """Draw a shaded volume with VTK's mapper, by a transfer function that fits the kind of data."""
    import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers the OpenGL classes)
    from vtkmodules.vtkIOImage import vtkPNGWriter
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader
    from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkVolume, vtkWindowToImageFilter
    from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkSmartVolumeMapper

    reader = vtkXMLImageDataReader()
    reader.SetFileName(volume)
    reader.Update()
    mapper, drawn, renderer, window = vtkSmartVolumeMapper(), vtkVolume(), vtkRenderer(), vtkRenderWindow()
    mapper.SetInputConnection(reader.GetOutputPort())
    drawn.SetMapper(mapper)
    drawn.SetProperty(_shaded(reader.GetOutput(), kind))
    renderer.AddVolume(drawn)
    window.SetOffScreenRendering(1)
    window.SetSize(side, side)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()  # from the front, z up, as a body stands
    camera.SetPosition(0, -1, 0)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(0, 0, 1)
    camera.Azimuth(30)
    camera.Elevation(20)
    renderer.ResetCamera()
    window.Render()
    taken, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    taken.SetInput(window)
    writer.SetInputConnection(taken.GetOutputPort())
    writer.SetFileName(picture)
    writer.Write()


def _shaded(image: Any, kind: str) -> Any:
    """Return the volume property: shaded, by points in Hounsfield units for CT, in fractions of the range otherwise."""
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolumeProperty

    low, high = image.GetScalarRange()
    shown, color, opacity = vtkVolumeProperty(), vtkColorTransferFunction(), vtkPiecewiseFunction()
    for value, rgb, alpha in _CT_BONE if kind == "CT" else _FRACTIONS:
        at = value if kind == "CT" else low + value * (high - low)
        color.AddRGBPoint(at, *rgb)
        opacity.AddPoint(at, alpha)
    shown.SetColor(color)
    shown.SetScalarOpacity(opacity)
    shown.SetScalarOpacityUnitDistance(min(image.GetSpacing()))
    shown.SetInterpolationTypeToLinear()
    shown.ShadeOn()
    return shown


def main(program: str, *words: str) -> None:
    """Run one program; see the module."""
    if program == "prepare":
        prepare(*words)
        return
    volume, picture, side, kind = words
    if program == "vtk":
        with_vtk(volume, picture, int(side), kind)
    else:
        {"pyvista": with_pyvista, "f3d": with_f3d}[program](volume, picture, int(side))


if __name__ == "__main__":
    main(*sys.argv[1:])
