"""A picture by VTK's Python in one process, for comparison.

    python benchmark_vtk_picture.py VALUES.npy SCENE.json PICTURE.png

The scene holds `points` (value, colour, opacity of one voxel), `eye`, `target`, `up`, `height`, `size`, `distance`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers the OpenGL classes)
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkColorTransferFunction,
    vtkRenderer,
    vtkRenderWindow,
    vtkVolume,
    vtkVolumeProperty,
    vtkWindowToImageFilter,
)
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper


def main(values_path: str, scene_path: str, picture_path: str) -> None:
    """Load, draw, write."""
    values, scene = np.load(values_path), json.loads(Path(scene_path).read_text())
    image = vtkImageData()
    image.SetDimensions(*values.shape[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(values.reshape(-1)))
    color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for value, red, green, blue, alpha in scene["points"]:
        color.AddRGBPoint(value, red, green, blue)
        opacity.AddPoint(value, alpha)
    appearance = vtkVolumeProperty()
    appearance.SetColor(color)
    appearance.SetScalarOpacity(opacity)
    appearance.SetInterpolationTypeToLinear()
    mapper = vtkOpenGLGPUVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetSampleDistance(scene["distance"])
    volume = vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(appearance)
    renderer, window = vtkRenderer(), vtkRenderWindow()
    renderer.AddVolume(volume)
    window.SetOffScreenRendering(1)
    window.SetSize(*scene["size"])
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(scene["eye"])
    camera.SetFocalPoint(scene["target"])
    camera.SetViewUp(scene["up"])
    camera.ParallelProjectionOn()
    camera.SetParallelScale(scene["height"] / 2)
    renderer.ResetCameraClippingRange()
    window.Render()
    grabbed = vtkWindowToImageFilter()
    grabbed.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetFileName(picture_path)
    writer.SetInputConnection(grabbed.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    main(*sys.argv[1:])
