"""Samples of a volume for the slices of a page: 8 bits, few enough for its room, compressed."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.slice_axes import NAMES, slices_of, typical_window
from texvol.scene.volume import Volume

ROOM = 3_500_000  # bytes of a page, as text
_MOST = 4_500_000  # samples to begin with
_FEWER = 1.25  # times the spacing if the samples are too large
_FAR = 0.1  # per cent of the values outside of the 8 bits, on each side


def slice_data(volume: Volume, room: int = ROOM) -> dict[str, Any]:
    """Return the samples and the orientation of three slices for the script of a page.

    Samples are means of blocks; those of labels are samples.
    """
    volume = volume.overview
    low, high = _ends(volume)
    most = float(_MOST)
    while True:
        steps = _steps(volume, most)
        levels = _levels(_coarse(volume, steps), low, high)
        text = base64.b64encode(zlib.compress(levels.tobytes(), 9)).decode()
        if len(text) <= room or levels.size <= 8:
            break
        most = levels.size / _FEWER**3
    centre, width = ((low + high) / 2, high - low) if volume.labels else typical_window(volume)
    return {
        "samples": text,
        "counts": levels.shape[::-1],
        "low": low,
        "high": high,
        "window": [centre, width],
        "unit": volume.value_unit or "",
        "planes": [_plane(volume, name) for name in NAMES],
    }


def _plane(volume: Volume, name: str) -> dict[str, Any]:
    plane = slices_of(volume)[name]
    width, height = plane.extent(volume)
    return {
        **{"name": name, "axis": plane.axis, "across": plane.across, "down": plane.down},
        "aspect": width / height,
    }


def _ends(volume: Volume) -> tuple[float, float]:
    """Return the values of the lowest and the highest of 8 bits."""
    ends = volume.finite_range or (0.0, 1.0)
    if not volume.labels:
        step = max(1, round((volume.size / 1e6) ** (1 / 3)))
        few = volume.values[::step, ::step, ::step].astype(np.float64)
        few = few[np.isfinite(few)]
        if few.size:
            low, high = (float(each) for each in np.percentile(few, (_FAR, 100 - _FAR)))
            ends = (low, high) if low < high else ends
    return (float(ends[0]), float(ends[1])) if ends[0] < ends[1] else (ends[0] - 0.5, ends[0] + 0.5)


def _steps(volume: Volume, most: float) -> list[int]:
    """Return the samples of a block along x, y and z, so that at most `most` blocks of about equal edges remain."""
    counts, spacing = np.array(volume.dimensions), np.array(volume.spacing)
    edge = float(spacing.min())
    while True:
        steps = np.clip(np.rint(edge / spacing), 1, counts).astype(int)
        if np.prod(np.ceil(counts / steps)) <= most or (steps == counts).all():
            return [int(each) for each in steps]
        edge *= 1.1


def _coarse(volume: Volume, steps: list[int]) -> NDArray[np.float32]:
    """Return the means of blocks, (nz, ny, nx), without missing samples; NaN where all are missing.

    A few planes are taken at a time, since a volume may fill half of the memory.
    """
    x, y, z = steps
    if volume.labels:
        return np.asarray(volume.values[::z, ::y, ::x], np.float32)
    planes = []
    for first in range(0, volume.shape[0], z):
        values = np.asarray(volume.values[first : first + z], np.float32)
        missing = np.isnan(values)
        sums, counts = np.where(missing, 0, values).sum(axis=0), (~missing).sum(axis=0)
        for axis, step in ((0, y), (1, x)):
            starts = np.arange(0, sums.shape[axis], step)
            sums, counts = np.add.reduceat(sums, starts, axis=axis), np.add.reduceat(counts, starts, axis=axis)
        planes.append(np.divide(sums, counts, out=np.full(sums.shape, np.nan, np.float32), where=counts > 0))
    return np.asarray(planes, np.float32)


def _levels(values: NDArray[np.float32], low: float, high: float) -> NDArray[np.uint8]:
    """Return 8 bits; the lowest level where a sample is missing."""
    fractions = np.nan_to_num((values - np.float32(low)) / np.float32(high - low), copy=False, nan=0.0)
    return np.rint(np.clip(fractions, 0, 1) * 255).astype(np.uint8)
