"""Functions that are piecewise linear in the value; at a step the right side holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.errors import InputError

Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]
LARGEST_VALUE = 8e307
ROUNDING = 2.0**-20  # of a value, more than interpolation loses


def check_ascending(numbers: Numbers, what: str, *, steps: bool) -> None:
    """Raise InputError if a number is less than the one before it, or equal to it where no `steps` are allowed."""
    gained = np.diff(numbers)
    fallen = np.flatnonzero(gained < 0 if steps else gained <= 0)
    if fallen.size:
        before, after = numbers[fallen[0] : fallen[0] + 2]
        raise InputError(f"{what} must ascend, got {after:g} after {before:g}")


def slopes(values: Numbers, numbers: Numbers) -> Numbers:
    """Slopes of `numbers`, shape (n, k), after each point, shape (n - 1, k); 0 on a step."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        gained: Numbers = np.diff(numbers, axis=0) / np.diff(values)[:, np.newaxis]
    gained[~np.isfinite(gained)] = 0.0
    return gained


def sides(values: Numbers, numbers: Numbers, positions: Numbers, right: bool = True) -> Numbers:
    """`numbers` just right (or left) of `positions`, shape (…, k); clamped beyond the outer points."""
    segment = np.searchsorted(values, positions, side="right" if right else "left")
    # A position on a point takes that point's numbers themselves: on its left side those of the end, with no rounding.
    at_start = np.clip(segment - 1, 0, values.size - 1)
    at_end = np.clip(segment, 0, values.size - 1)
    gained = np.vstack([slopes(values, numbers), np.zeros((1, numbers.shape[1]))])
    on_line = (
        numbers[at_start] + gained[at_start] * (np.clip(positions, values[0], values[-1]) - values[at_start])[..., None]
    )
    on_line = np.where((segment == 0)[..., None], numbers[0], on_line)
    return np.where((~np.bool_(right) & (positions == values[at_end]))[..., None], numbers[at_end], on_line)


def shows_between(values: Numbers, is_more: Flags, opaque: Flags, lowest: Numbers, highest: Numbers) -> Flags:
    """True where any value from `lowest` to `highest` may show; False where either is NaN.

    `is_more` says of each point whether it is more than nothing, `opaque` whether its extinction is infinite. Both ends
    are widened by what rounding may do to a value on its way, where a step is that near.
    """
    # On a line from 0 a rounding is nothing; beside an infinite point the values up to its neighbours are opaque.
    point_shows = is_more.copy()
    point_shows[:-1] |= opaque[1:]
    point_shows[1:] |= opaque[:-1]
    with np.errstate(invalid="ignore", over="ignore"):
        below = np.where(np.isfinite(lowest), lowest - ROUNDING * np.abs(lowest), lowest)
        above = np.where(np.isfinite(highest), highest + ROUNDING * np.abs(highest), highest)
    first = np.searchsorted(values, below, side="left")
    last = np.searchsorted(values, above, side="right")
    before = np.concatenate([[0], np.cumsum(point_shows)])
    shows: Flags = np.asarray(before[np.maximum(first, last)] > before[first])
    # Without a point between them, both ends lie on one line, which is 0 throughout or but for its end.
    left = np.searchsorted(values, lowest, side="right")
    line_shows = np.concatenate([is_more[:1], is_more[:-1] | is_more[1:], is_more[-1:]])
    at_start = np.maximum(left - 1, 0)
    shows |= line_shows[left] & ((highest > values[at_start]) | is_more[at_start] | (left == 0))
    # Or the last of the points ends in a line that the higher end is on.
    left = np.searchsorted(values, highest, side="right")
    at_start = np.maximum(left - 1, 0)
    shows |= line_shows[left] & ((highest > values[at_start]) | is_more[at_start])
    return shows & ~(np.isnan(lowest) | np.isnan(highest))


def modulation(pairs: ArrayLike, name: str) -> Numbers:
    """Return pairs of gradient magnitude and factor as an array; InputError unless sorted and not negative."""
    found = np.array(pairs, np.float64)
    if found.ndim != 2 or found.shape[1] != 2 or not len(found):
        raise InputError(f"{name}: gradient must be a list of pairs [magnitude, factor], got shape {found.shape}")
    if not ((found >= 0) & np.isfinite(found)).all():
        raise InputError(f"{name}: gradient magnitudes and factors must be finite and not negative")
    check_ascending(found[:, 0], f"{name}: gradient magnitudes", steps=False)
    return found
