"""Extreme values far from all others, as fill values and hot pixels are: what `--missing` is for.

The values at an end of the range are *lone* where the gap between them and the others is many times as wide as the
whole range of the others, or wider where they are known for what they are. Up to a few distinct values at each end may
be so, each in any number of samples.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume
from texvol.util.statistics import chunks, finite

TIMES = 10.0  # the others' range, that a gap has to exceed
TIMES_OF_MARKS = 1.0  # the same for values that programs mark missing samples by
MOST = 4  # distinct values at each end of the range that may be lone

# Values at the lower and the upper end that are left out at a time. With more of them, a few distinct ones that happen
# to lie close together would have all others for lone.
_RAYS = ((0, 1), (1, 0), (0, 2), (1, 1), (2, 0))
# Nodata values of GDAL's and ArcGIS' files, fill values of netCDF, GRIB and others; beside the ends of wider types.
_MARKS = (-999, -9999, -99999, -999999, -32767, -2147483647, 1e15, 1e20, 1e30, 1e35, 1e36, 9.96921e36, 9.999e20)

_SPREAD = 2**16  # samples, evenly spread, that tell in most volumes that there is none


class LoneExtreme(NamedTuple):
    """A value at an end of the range that is far from the others."""

    value: int | float
    samples: int  # number of samples that have it
    others: tuple[float, float]  # finite range of the values that are not lone
    times: float  # distance to the nearest of the others, as a multiple of their range
    text: str  # the value in as many digits as `--missing` needs to find it


def lone_extremes(volume: Volume) -> tuple[LoneExtreme, ...]:
    """Return the finite values of a volume that lie far from all others, smallest first; none of labels and colours."""
    if volume.nearest or volume.colors is not None or _spread_over_range(volume):
        return ()
    values = volume.values
    lowest, highest = _ends(values, lowest=True), _ends(values, lowest=False)[::-1]
    below, above = _split(lowest, highest)
    if not below + above:
        return ()
    others = float(lowest[below]), float(highest[len(highest) - 1 - above])
    alone = np.concatenate([lowest[:below], highest[len(highest) - above :]])
    if not any(((chunk > others[0]) & (chunk < others[1])).any() for chunk in chunks(values)):
        return ()  # of two labels neither is far from the other
    return tuple(_described(values, value, others) for value in alone)


def _described(values: NDArray, value: np.generic, others: tuple[float, float]) -> LoneExtreme:
    low, high = others
    number = float(value)
    distance = _between(number, low) if number < low else _between(high, number)
    samples = sum(int(np.count_nonzero(chunk == value)) for chunk in chunks(values))
    return LoneExtreme(value.item(), samples, others, distance / _between(low, high), str(value))


def _between(low: float, high: float) -> float:
    """Half of the distance: that from -1e308 to 1e308 is no number."""
    return high / 2 - low / 2


def _spread_over_range(volume: Volume) -> bool:
    """True if evenly spread samples show that no value is lone, or if there are none to be."""
    if volume.finite_range is None:
        return True
    low, high = volume.finite_range
    step = max(volume.size // _SPREAD, 1) | 1  # odd, so that it is no multiple of most rows
    known = np.unique(finite(volume.values.reshape(-1)[::step]))
    if len(known) <= 2 * MOST:
        return False
    # All values but `MOST` at each end are among the others, whose range is then this or more.
    of_others = _between(float(known[MOST]), float(known[-1 - MOST]))
    return not _between(low, high) > TIMES_OF_MARKS * of_others


def _split(lowest: NDArray, highest: NDArray) -> tuple[int, int]:
    """Count the lone values at each end.

    Both arrays are ascending: the smallest distinct values, and the largest. Those that are lone beside all others are
    left out first, and then those that are among what is left: -9999 beside 1e20 is only seen to be so without it.
    """
    below = above = 0
    while (more := _first_split(lowest[below:], highest[: len(highest) - above])) is not None:
        below, above = below + more[0], above + more[1]
    return below, above


def _first_split(lowest: NDArray, highest: NDArray) -> tuple[int, int] | None:
    """One or two values, as few as can be, that are far from those left, and how many at each end; None if none are."""
    for below, above in _RAYS:
        if below >= len(lowest) or above >= len(highest):
            continue
        first, last = float(lowest[below]), float(highest[len(highest) - 1 - above])
        are_marks = all(map(_is_mark, (*lowest[:below], *highest[len(highest) - above :])))
        least = (TIMES_OF_MARKS if are_marks else TIMES) * _between(first, last)
        is_far_below = not below or _between(float(lowest[below - 1]), first) > least
        is_far_above = not above or _between(last, float(highest[len(highest) - above])) > least
        if first < last and is_far_below and is_far_above:
            return below, above
    return None


def _is_mark(value: Any) -> bool:
    """True if programs commonly mark missing samples by this value."""
    if value.dtype.itemsize == 1:
        return False
    limits = np.iinfo(value.dtype) if value.dtype.kind in "iu" else np.finfo(value.dtype)
    known = (float(limits.min), float(limits.max), *_MARKS)
    number = float(value)
    # To the digits of single precision, in which many were written.
    return any(number == mark or abs(number / mark - 1) < 1e-6 for mark in known if mark)


def _ends(values: NDArray, *, lowest: bool) -> NDArray:
    """The `MOST` + 1 smallest distinct finite values ascending, or as many largest ones descending."""
    found = values.reshape(-1)[:0]
    for chunk in chunks(values):
        known = finite(chunk)
        # One value at a time: a fill value may be most of the samples, and sorting these takes long.
        for _ in range(MOST + 1):
            if len(found) == MOST + 1:
                known = known[known < found[-1]] if lowest else known[known > found[-1]]
            if not known.size:
                break
            extreme = known.min() if lowest else known.max()
            found = np.unique(np.append(found, extreme))[:: 1 if lowest else -1][: MOST + 1]
            known = known[known != extreme]
    return found
