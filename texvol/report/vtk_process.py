"""Process in which VTK draws for `vtk_mappers`; prints one JSON line for each picture.

    python -m texvol.report.vtk_process FOLDER

FOLDER holds `values.npy` and `request.json`; the pictures are written there, too.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.report.convergence import Limits


class Scene:
    """A VTK window with one volume."""

    def __init__(self, folder: Path, request: dict[str, Any]) -> None:
        import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers the OpenGL classes)
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkVolume, vtkVolumeProperty

        self._size = request["size"]
        self._property = vtkVolumeProperty()
        self._property.ShadeOff()
        self._property.SetInterpolationTypeToLinear()
        self._property.SetScalarOpacityUnitDistance(1.0)  # lengths are in smallest spacings
        self._mapper = _mapper(request["mapper"], np.load(folder / "values.npy"), request["spacing"])
        volume = vtkVolume()
        volume.SetMapper(self._mapper)
        volume.SetProperty(self._property)
        self._renderer = vtkRenderer()
        self._renderer.SetBackground(0, 0, 0)
        self._renderer.SetBackgroundAlpha(0)
        self._renderer.AddVolume(volume)
        self._window = vtkRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetAlphaBitPlanes(1)
        self._window.SetSize(*self._size)
        self._window.AddRenderer(self._renderer)
        self._set_camera(request["camera"])

    def classify(self, points: list[list[float]]) -> None:
        """Set the transfer function: rows of value, red, green, blue, opacity."""
        from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
        from vtkmodules.vtkRenderingCore import vtkColorTransferFunction

        color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
        for value, red, green, blue, alpha in points:
            color.AddRGBPoint(value, red, green, blue)
            opacity.AddPoint(value, alpha)
        self._property.SetColor(color)
        self._property.SetScalarOpacity(opacity)

    def draw(self, sample_distance: float) -> NDArray[np.float32]:
        """Return the picture (h, w, 4), premultiplied, 8 bits as float, top row first."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        self._mapper.SetSampleDistance(sample_distance)
        if hasattr(self._mapper, "SetInteractiveSampleDistance"):
            self._mapper.SetInteractiveSampleDistance(sample_distance)
        self._renderer.GetActiveCamera().Modified()
        self._window.Render()
        pixels: Any = vtkUnsignedCharArray()
        width, height = self._size
        self._window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
        return vtk_to_numpy(pixels).reshape(height, width, 4)[::-1].astype(np.float32) / np.float32(255)

    def _set_camera(self, told: dict[str, Any]) -> None:
        camera = self._renderer.GetActiveCamera()
        camera.SetPosition(told["eye"])
        camera.SetFocalPoint(told["target"])
        camera.SetViewUp(told["up"])
        if told["projection"] == "orthographic":
            camera.ParallelProjectionOn()
            camera.SetParallelScale(told["height"] / 2)
        else:
            camera.SetViewAngle(told["fov"])
        camera.SetClippingRange(told["range"])


def _mapper(name: str, values: NDArray, spacing: list[float]) -> Any:
    """Return one of VTK's mappers, with automatic changes of quality off; the corner of the box is at 0."""
    from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper
    from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper

    mapper: Any = vtkOpenGLGPUVolumeRayCastMapper() if name == "gpu" else vtkFixedPointVolumeRayCastMapper()
    mapper.SetBlendModeToComposite()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.SetImageSampleDistance(1)
    if name == "gpu":
        mapper.SetInputData(_image(values, spacing, as_cells=True))
        mapper.UseJitteringOff()
        mapper.SetMaxMemoryInBytes(1 << 33)
        mapper.SetMaxMemoryFraction(1.0)
    else:
        mapper.SetInputData(_image(values, spacing, as_cells=False))
        mapper.CroppingOn()
        mapper.SetCroppingRegionFlagsToSubVolume()
        far = [count * each for count, each in zip(values.shape[::-1], spacing, strict=True)]
        mapper.SetCroppingRegionPlanes(0, far[0], 0, far[1], 0, far[2])
    return mapper


def _image(values: NDArray, spacing: list[float], *, as_cells: bool) -> Any:
    """Return the samples as cells, which end at the box, or as points, padded by one repeated sample.

    The GPU mapper would crop points half a voxel too late, and the fixed-point mapper draws no cells.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    samples = values if as_cells else np.pad(values, 1, mode="edge")
    image = vtkImageData()
    image.SetDimensions([count + as_cells for count in samples.shape[::-1]])
    image.SetSpacing(spacing)
    image.SetOrigin([0.0 if as_cells else -0.5 * each for each in spacing])
    data = image.GetCellData() if as_cells else image.GetPointData()
    data.SetScalars(numpy_to_vtk(np.ascontiguousarray(samples).reshape(-1), deep=True))
    return image


def timed(scene: Scene, sample_distance: float, frames: int) -> tuple[NDArray[np.float32], float, float]:
    """Return the picture, and the medians of the seconds of so many frames, wall and processor."""
    times, processor_times = [], []
    for _ in range(frames):
        start, processor_start = time.perf_counter(), time.process_time()
        picture = scene.draw(sample_distance)
        times.append(time.perf_counter() - start)
        processor_times.append(time.process_time() - processor_start)
    return picture, statistics.median(times), statistics.median(processor_times)


def answer(**metadata: Any) -> None:
    """Print one line for the other process."""
    print(json.dumps(metadata), flush=True)


def main(folder: Path) -> None:
    """Draw the check, then every rate, coarse to fine."""
    request = json.loads((folder / "request.json").read_text())
    scene = Scene(folder, request)

    def save(name: str, picture: NDArray) -> str:
        path = folder / f"{name}.npy"
        np.save(path, picture)
        return str(path)

    scene.classify(request["check"]["points"])
    answer(what="check", picture=save("check", scene.draw(1 / request["check"]["rate"])))
    scene.classify(request["points"])
    limits, predicted, last_rate = Limits(**request["limits"]), 0.0, 1.0
    for rate in request["rates"]:
        predicted, last_rate = predicted * rate / last_rate, rate
        reason = limits.reason_to_skip(predicted)
        if reason:
            answer(what="picture", rate=rate, skipped=reason)
            continue
        scene.draw(1 / rate)
        frames = limits.frames(predicted)
        picture, predicted, of_processor = timed(scene, 1 / rate, frames)
        path = save(f"rate-{rate:g}", picture)
        answer(
            what="picture", rate=rate, seconds=predicted, processor_seconds=of_processor, frames=frames, picture=path
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
