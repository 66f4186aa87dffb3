"""VTK's volume mappers drawing a texvol scene, for comparison: same volume, transfer function, camera and sizes.

VTK works in a process of its own (`vtk_process`), which separates its OpenGL context and its crashes from texvol.
Before the measurements, both draw a soft version of the scene; if the two pictures differ, VTK can't draw the scene, or
was given wrong parameters, and nothing is measured.

Differences of the conventions:

- VTK's box ends at the outermost points. The GPU mapper is given the samples as cells, which fill the true box; the
  fixed-point mapper draws no cells, so the samples are padded by a repeated voxel and cropped to the true box.
- VTK interpolates opacity, not extinction: 1 - e^-τ per unit distance is given on a dense grid of values.
- VTK draws the volume in the frame of the grid's own axes, with the smallest spacing as unit, without a matrix.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison import compare
from texvol.rendering.render import over_background
from texvol.rendering.renderer import Renderer, Size
from texvol.report.convergence import Limits, Measurement, Outcome, Setting, Truths, with_errors
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import TexvolError
from texvol.util.installation import install_command
from texvol.util.package import environment_of_child

MAPPERS = {"VTK GPU": "gpu", "VTK fixed-point": "fixed-point"}
MOST_DIFFERENT = 2e-2  # rms of a soft scene; 8 bits and blurred edges give less, a wrong axis or length more
_POINTS = 1024  # of the opacity table, over the range of the values
_CHECK_RATE = 2.0
_SAME_TYPES = ("uint8", "int8", "uint16", "int16", "float32")


class VtkError(TexvolError):
    """VTK is missing, can't draw the scene, or draws another picture; the message gives the reason."""


def sweep(
    renderer: Renderer, scene: Scene, size: Size, mapper: str, rates: Iterable[float], truths: Truths, limits: Limits
) -> Iterator[Outcome]:
    """Yield the measurement and the picture of each rate, drawn by one of `MAPPERS`.

    Raises
    ------
    VtkError
        If nothing can be measured.
    """
    thickness = scene.volume.smallest_spacing
    with tempfile.TemporaryDirectory(prefix="texvol-vtk-") as folder:
        soft = soft_scene(scene)
        request = _request(scene, soft, size, MAPPERS[mapper], list(rates), limits)
        _save(Path(folder), scene, request)
        ours = renderer.render(replace(soft, classification="post"), size, sampling_rate=_CHECK_RATE)
        for answer in _answers(Path(folder), limits.sweep_seconds):
            if answer["what"] == "check":
                rms = compare(np.load(answer["picture"]), ours).rms_error
                if not rms <= MOST_DIFFERENT:
                    raise VtkError(f"{mapper} and texvol draw a soft version of this scene differently (rms {rms:.2g})")
                continue
            setting = Setting("post", answer["rate"], renderer=mapper)
            measurement = Measurement(setting, thickness / answer["rate"], skipped=answer.get("skipped", ""))
            if measurement.skipped:
                yield measurement, None
                continue
            picture = over_background(np.load(answer["picture"]), scene.background)
            os.unlink(answer["picture"])
            measurement = replace(
                measurement,
                target_format="rgba8",
                frames=answer["frames"],
                seconds=answer["seconds"],
                processor_seconds=answer["processor_seconds"],
            )
            yield with_errors(measurement, picture, truths), picture


def soft_scene(scene: Scene) -> Scene:
    """Return the same volume and camera with a thin medium whose extinction grows with the value, on black."""
    low, high = scene.volume.finite_range or (0.0, 1.0)
    if not high > low:
        high = low + max(1.0, abs(low))
    colors = np.array([(0.2, 0.4, 1.0), (1.0, 0.8, 0.4)])
    extinctions = np.array([0.2, 2.0]) / (2 * scene.volume.radius)
    return replace(
        scene,
        transfer_function=TransferFunction(np.array([low, high]), colors, extinctions),
        background=(0.0, 0.0, 0.0),
    )


def _check_drawable(scene: Scene, medium: TransferFunction) -> None:
    """Raise VtkError if VTK would draw another picture."""
    if scene.added or scene.mask is not None:
        raise VtkError("VTK draws scenes of several volumes, and masks, differently")
    if scene.volume.nearest or scene.volume.colors is not None:
        raise VtkError("VTK interpolates labels, and has no samples with colours")
    if medium.emissive:
        raise VtkError("VTK has no emission apart from extinction")
    if scene.lighting is not None or scene.depth_cue is not None:
        raise VtkError("VTK has another light model")
    if medium.premultiplied or medium.needs_gradient:
        raise VtkError("VTK classifies by straight colours of the value alone")
    gram = scene.volume.direction.T @ scene.volume.direction
    if not np.allclose(gram, np.eye(3), atol=1e-6):
        raise VtkError("VTK's mappers draw no sheared grids")


def _request(scene: Scene, soft: Scene, size: Size, mapper: str, rates: list[float], limits: Limits) -> dict[str, Any]:
    """Return all parameters but the samples, in the grid's frame, with the smallest spacing as unit; JSON-able."""
    volume, unit = scene.volume, scene.volume.smallest_spacing
    assert scene.transfer_function is not None and soft.transfer_function is not None
    _check_drawable(scene, scene.transfer_function)
    return {
        "mapper": mapper,
        "rates": rates,
        **view_in_grid(scene, size),
        "points": _vtk_points(scene.transfer_function, volume, unit),
        "check": {"rate": _CHECK_RATE, "points": _vtk_points(soft.transfer_function, volume, unit)},
        "limits": asdict(replace(limits, sweep_seconds=float("inf"))),  # the end of the sweep kills the process
    }


def view_in_grid(scene: Scene, size: Size) -> dict[str, Any]:
    """Return size, spacing and camera in the frame of `right_handed` axes, smallest spacing 1, corner 0; JSON-able."""
    volume, unit, camera = scene.volume, scene.volume.smallest_spacing, scene.completed(size).camera
    axes, corner = right_handed(volume)

    def seen(point: Any) -> list[float]:
        return (axes.T @ (np.asarray(point) - corner) / unit).tolist()

    depths = camera.in_eye_space(volume.corners_from_centre, volume.centre)[:, 2] / unit
    far = max(float(depths.max()) * 1.01, 1e-3)
    return {
        "size": list(size),
        "spacing": (volume.spacing / unit).tolist(),
        "camera": {
            "projection": camera.projection,
            "eye": seen(camera.eye),
            "target": seen(camera.target),
            "up": (axes.T @ np.asarray(camera.up)).tolist(),
            "fov": camera.fov,
            "height": camera.height / unit,
            "range": [max(float(depths.min()) * 0.99, 1e-4 * far), far],
        },
    }


def right_handed(volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the grid's axes, with the x axis reversed if they are left-handed, and the box's corner in world units."""
    axes = volume.direction.copy()
    corner = volume.box_corner.copy()
    if np.linalg.det(axes) < 0:
        corner += volume.box_edges[:, 0]
        axes[:, 0] *= -1
    return axes, corner


def in_right_handed_order(volume: Volume, values: NDArray) -> NDArray:
    """Return a volume's values with the x axis reversed where `right_handed` reverses it."""
    return values[..., ::-1] if np.linalg.det(volume.direction) < 0 else values


def _middle(volume: Volume) -> float:
    """Offset that is subtracted from the values, so that VTK's float32 keeps different values different."""
    low, high = volume.finite_range or (0.0, 0.0)
    return 0.0 if volume.dtype.name in _SAME_TYPES else low / 2 + high / 2


def _vtk_points(transfer_function: TransferFunction, volume: Volume, unit: float) -> list[list[float]]:
    """Rows of value, straight colour, opacity of one smallest spacing: a grid, and both sides of control points."""
    points = transfer_function.values
    low, high = volume.finite_range or (points[0], points[-1])
    low, high = min(low, points[0]), max(high, points[-1])
    beside = (high - low) * 1e-7
    grid = np.unique(np.concatenate([np.linspace(low, high, _POINTS), points, points - beside]))
    emission, extinction = transfer_function.classify(grid)
    bare = extinction == 0
    colors = emission / np.where(np.isinf(extinction) | bare, 1, extinction)[:, np.newaxis]
    # VTK interpolates colour also where extinction is 0: the transfer function's own colour.
    colors[bare] = np.stack([np.interp(grid[bare], points, transfer_function.colors[:, c]) for c in range(3)], axis=1)
    opacity = -np.expm1(-extinction * unit)
    return np.column_stack([grid - _middle(volume), colors, opacity]).tolist()


def _save(folder: Path, scene: Scene, request: dict[str, Any]) -> None:
    volume = scene.volume
    values = volume.values
    if values.dtype.name not in _SAME_TYPES:
        values = (values - np.float64(_middle(volume))).astype(np.float32)
    np.save(folder / "values.npy", in_right_handed_order(volume, values))
    (folder / "request.json").write_text(json.dumps(request))


def _answers(folder: Path, timeout: float) -> Iterator[dict[str, Any]]:
    """Yield the lines that the other process prints; the process ends with this one."""
    if importlib.util.find_spec("vtkmodules") is None:
        raise VtkError(f"VTK is not installed: {install_command('bench')}")
    with (folder / "errors").open("w+") as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "texvol.report.vtk_process", str(folder)],
            stdout=subprocess.PIPE,
            stderr=errors,
            stdin=subprocess.DEVNULL,
            text=True,
            env=environment_of_child(VTK_DEFAULT_OPENGL_WINDOW="vtkEGLRenderWindow"),
        )
        watch = threading.Timer(timeout, process.kill)
        watch.start()
        try:
            assert process.stdout is not None
            for line in process.stdout:
                if line.startswith("{"):  # VTK prints messages, too
                    yield json.loads(line)
            status = process.wait()
        finally:
            watch.cancel()
            process.kill()
            with contextlib.suppress(OSError):
                process.wait()
        if status:
            errors.seek(0)
            last = (errors.read().strip().splitlines() or ["no reason given"])[-1]
            raise VtkError(f"VTK's process ended with status {status}: {last[:200]}")
