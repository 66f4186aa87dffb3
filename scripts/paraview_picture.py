"""A picture by ParaView: pvbatch runs this with ParaView's Python, which has nothing of texvol.

    mpiexec -n RANKS pvbatch paraview_picture.py REQUEST.json

The request holds `values` (a file of raw bytes, x fastest), `samples` along an axis, `points` (value, colour, opacity
of one sample), `eye`, `target`, `up`, `height` (world units), `size`, `warm` (frames that are timed), `picture` (a .png
that is written) and `answer` (a .json that is written).
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from paraview.simple import (
    ColorBy,
    CreateView,
    GetColorTransferFunction,
    GetOpacityTransferFunction,
    ImageReader,
    Render,
    SaveScreenshot,
    Show,
    _DisableFirstRenderCameraReset,
)
from paraview.vtk import vtkUnsignedCharArray
from processor_time import of_descendants


def main(path: str) -> None:
    """Read, draw, write the picture, and time further frames."""
    request = json.loads(Path(path).read_text())
    _DisableFirstRenderCameraReset()
    view = view_of(request)
    show_volume(view, request)
    SaveScreenshot(request["picture"], view)
    if not request["warm"]:
        return
    frames = [frame(view) for _ in range(request["warm"] + 1)][1:]
    answer = {"wall": [wall for wall, _ in frames], "processor": [processor for _, processor in frames]}
    Path(request["answer"]).write_text(json.dumps(answer))


def view_of(request: dict[str, Any]) -> Any:
    """Return a view on black with the camera that is asked for."""
    view = CreateView("RenderView")
    view.ViewSize = request["size"]
    view.UseColorPaletteForBackground = 0
    view.BackgroundColorMode = "Single Color"
    view.Background = [0, 0, 0]
    view.OrientationAxesVisibility = 0
    view.UseFXAA = 0  # it smooths the picture of several ranks, and does nothing to that of one
    view.CameraParallelProjection = 1
    view.CameraPosition = request["eye"]
    view.CameraFocalPoint = request["target"]
    view.CameraViewUp = request["up"]
    view.CameraParallelScale = request["height"] / 2
    return view


def show_volume(view: Any, request: dict[str, Any]) -> None:
    """Show the samples as an unlit volume; each rank reads its part."""
    ends = [0, request["samples"] - 1] * 3
    source = ImageReader(
        FileNames=[request["values"]],
        DataExtent=ends,
        DataScalarType="unsigned char",
        DataByteOrder="LittleEndian",
        FileDimensionality=3,
    )
    shown = Show(source, view)
    name = source.PointData[0].GetName()
    ColorBy(shown, ("POINTS", name))
    shown.SetRepresentationType("Volume")
    shown.VolumeRenderingMode = "GPU Based"
    shown.InterpolationType = "Linear"
    shown.BlendMode = "Composite"
    shown.Shade = 0
    shown.ScalarOpacityUnitDistance = 1.0
    color, opacity = GetColorTransferFunction(name), GetOpacityTransferFunction(name)
    color.ColorSpace = "RGB"
    color.RGBPoints = [number for value, rgb, _ in request["points"] for number in (value, *rgb)]
    opacity.Points = [number for value, _, alpha in request["points"] for number in (value, alpha, 0.5, 0.0)]


def frame(view: Any) -> tuple[float, float]:
    """Return wall seconds of a frame, drawn and read back, and processor seconds of all ranks."""
    mpiexec = os.getppid()
    before, start = of_descendants(mpiexec), time.perf_counter()
    Render(view)
    width, height = view.ViewSize
    view.GetRenderWindow().GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, vtkUnsignedCharArray())
    wall = time.perf_counter() - start
    return wall, of_descendants(mpiexec) - before


if __name__ == "__main__":
    main(sys.argv[1])
