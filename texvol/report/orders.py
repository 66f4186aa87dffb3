"""Orders of convergence (after Etiene et al. 2014): the change of a picture as one step gets finer.

Slabs: the slope of log rms discretisation error over log thickness, by least squares, in the report's scene. Grids, in
scenes of this module: a trilinear field sampled on a finer grid is the same field, so its picture must not change
(order 0); a smooth field is approximated better by a finer grid, and the changes of its picture fall with order 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.renderer import Renderer
from texvol.report.convergence import Measurement, Setting
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

_SIZE = (96, 96)
_EDGE = 24.0  # of the box of this module's scenes, world units
_MEDIUM = TransferFunction(np.array([0.0, 1.0]), np.array([(0.2, 0.4, 0.9), (1.0, 0.8, 0.4)]), np.array([0.0, 0.1]))


def slope(steps: Sequence[float], changes: Sequence[float]) -> float | None:
    """Least-squares slope of log change over log step; None for fewer than two changes, or a change of 0."""
    if len(changes) < 2 or not min(changes) > 0:
        return None
    return float(np.polyfit(np.log(steps), np.log(changes), 1)[0])


def slab_orders(measurements: Sequence[Measurement]) -> dict[str, float | None]:
    """Order in the slab thickness of each classification, from the settings with automatic formats."""
    orders = {}
    for classification in CLASSIFICATIONS:
        measured = [
            (each.slab_thickness, each.discretisation.rms_error)
            for each in measurements
            if each.setting == Setting(classification, each.setting.sampling_rate) and each.discretisation is not None
        ]
        orders[classification] = slope(*zip(*measured, strict=True)) if measured else None
    return orders


def trilinear_change(renderer: Renderer) -> float:
    """Largest change of a picture when a random trilinear field is sampled three times as finely: rounding."""
    coarse = np.random.default_rng(8).random((8, 8, 8))
    fine = coarse
    for axis in range(3):
        fine = np.apply_along_axis(_three_times, axis, fine)
    one, other = (_picture(renderer, values) for values in (coarse, fine))
    return float(np.abs(one - other).max())


def smooth_order(renderer: Renderer) -> float | None:
    """Order in the grid spacing of the changes between pictures of a smooth field on 12, 24, 48 and 96 samples."""
    samples = (12, 24, 48, 96)
    pictures = [_picture(renderer, _smooth(count)) for count in samples]
    changes = [float(np.sqrt(np.square(b - a).mean())) for a, b in pairwise(pictures)]
    return slope([_EDGE / count for count in samples[:-1]], changes)


def _picture(renderer: Renderer, values: NDArray[np.float64]) -> NDArray[np.float64]:
    spacing = _EDGE / values.shape[0]
    volume = Volume(values.astype(np.float32), (spacing,) * 3, (spacing / 2,) * 3)
    scene = Scene(volume, _MEDIUM, Camera.framing(volume), classification="post")
    options = {"texture_format": "rgba32f", "target_format": "rgba32f"}
    return renderer.render(scene, _SIZE, slab_thickness=_EDGE / 96, **options).astype(np.float64)  # type: ignore[arg-type]


def _three_times(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Piecewise linear interpolant of `values` at three times as many positions, which include the samples."""
    positions = (np.arange(3 * values.size) + 0.5) / 3 - 0.5
    return np.interp(positions, np.arange(values.size), values)


def _smooth(samples: int) -> NDArray[np.float64]:
    axis = (np.arange(samples) + 0.5) / samples * 2 - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    return 0.5 + 0.5 * np.sin(3 * x + y) * np.cos(4 * y - z) * np.sin(3 * z + 1)
