"""Run-length encoding of a classified volume for one principal axis: what shows, scanline by scanline.

A position i of a scanline stands for the samples i and i + 1, between which a picture of its slice is interpolated;
positions -1 and n - 1 stand for the edge samples alone, which are repeated there. A run is a row of positions of which
each has a sample that shows. Between two runs nothing is stored.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.compiling import compiled_and_cached


class Encoded(NamedTuple):
    """Scanlines of all slices along one principal axis."""

    first: NDArray[np.int64]  # first run of each scanline, (slices rows + 1)
    runs: NDArray[np.int64]  # first position, one past the last, and place of the first sample in `media`, (runs, 3)
    media: NDArray[np.float32]  # emission and extinction, (samples, 4)


def in_slice(axis: int) -> list[int]:
    """Return the axes along and across the scanlines of slices along `axis`."""
    return [each for each in range(3) if each != axis]


def encoded(samples: NDArray[np.float32], seen: NDArray[np.bool_], axis: int) -> Encoded:
    """Return the encoding for a principal axis, of media (z, y, x, 4) and which samples show (z, y, x)."""
    along, across = in_slice(axis)
    order = [2 - each for each in (axis, across, along)]
    shape = tuple(seen.shape[each] for each in order)
    strides = tuple(seen.strides[each] for each in order)  # of one byte each
    flat, shows = samples.reshape(-1, 4), seen.reshape(-1)
    first = np.zeros(shape[0] * shape[1] + 1, np.int64)
    none = Encoded(first, np.empty((0, 3), np.int64), np.empty((0, 4), np.float32))
    runs, voxels = _encode(flat, shows, shape, strides, none, False)
    filled = Encoded(first, np.empty((runs, 3), np.int64), np.empty((voxels, 4), np.float32))
    _encode(flat, shows, shape, strides, filled, True)
    return filled


@compiled_and_cached
def _encode(samples, shows, shape, strides, encoded, fill):  # type: ignore[no-untyped-def]
    """Count runs and stored samples, and fill the encoding if asked to."""
    runs = voxels = 0
    last = shape[2] - 1
    for line in range(shape[0] * shape[1]):
        encoded.first[line] = runs
        start = line // shape[1] * strides[0] + line % shape[1] * strides[1]
        inside = False
        for i in range(-1, last + 2):  # position last + 1 ends the last run
            place = start + max(i, 0) * strides[2]
            showing = i <= last and (shows[place] or shows[start + min(i + 1, last) * strides[2]])
            if showing and not inside:
                if fill:
                    encoded.runs[runs, 0], encoded.runs[runs, 2] = i, voxels
                runs += 1
            if inside and not showing and fill:
                encoded.runs[runs - 1, 1] = i
            if showing or inside:  # the sample after the last position belongs to the run
                if fill:
                    encoded.media[voxels] = samples[start + min(max(i, 0), last) * strides[2]]
                voxels += 1
            inside = showing
    encoded.first[-1] = runs
    return runs, voxels
