"""Missing samples: NaN in place of the values with which a file or the user marks them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault

Mark = int | float

_EXACT = 2**24  # largest integer up to which float32 holds all integers


def marks_of(told: Any) -> tuple[Mark, ...]:
    """Return the argument `missing` of `texvol.load` as a tuple of Python numbers.

    Raises
    ------
    FileFault
        If it is not a number, or is NaN, which is missing anyway.
    """
    if told is None:
        return ()
    several = [told] if np.ndim(told) == 0 else list(told)
    marks = []
    for each in several:
        if isinstance(each, bool | np.bool_) or not isinstance(each, int | float | np.integer | np.floating):
            raise FileFault(f"missing must be a number or several numbers, got {each!r}")
        if each != each:
            raise FileFault("missing must be a number, got NaN; samples that are NaN are missing without it")
        marks.append(int(each) if isinstance(each, int | np.integer) else float(each))
    return tuple(dict.fromkeys(marks))


def without_chosen(values: NDArray, choice: Choice) -> tuple[NDArray, tuple[str, ...]]:
    """Return values without those of --missing, and notes."""
    listed = ", ".join(map(str, choice.missing))
    return without_marked(values, choice.missing, f"--missing {listed}", choice, always=True)


def without_marked(
    values: NDArray, marks: Sequence[Mark], what: str, choice: Choice, *, always: bool = False
) -> tuple[NDArray, tuple[str, ...]]:
    """Return values with NaN for each that equals one of `marks`, and notes; labels are never missing.

    Floats are compared in their own type, so that -3.4028235e+38 finds its float32 neighbour.
    """
    if choice.labels or not marks:
        return values, ()
    wanted = [mark for mark in (_in_type(mark, values.dtype) for mark in marks) if mark is not None]
    count = 0
    if wanted:
        values, count = without_where(values, lambda _, part: np.logical_or.reduce([part == mark for mark in wanted]))
    return values, noted(count, what, always=always)


def without_where(values: NDArray, is_missing: Callable[[int, NDArray], NDArray]) -> tuple[NDArray, int]:
    """Return values with NaN where `is_missing`, called with a slice's number and values, is True, and their number.

    Integers become float32 if it holds all remaining values, else float64; without a missing value they stay.
    """
    count, largest = 0, 0
    for number, part in enumerate(values):
        hits = is_missing(number, part)
        count += int(np.count_nonzero(hits))
        if values.dtype.kind != "f" and values.dtype.itemsize > 2:
            kept = part[~hits]
            largest = max(largest, -int(kept.min()), int(kept.max())) if kept.size else largest
    if not count:
        return values, 0
    if values.dtype.kind == "f":
        made = values if values.flags.writeable else values.copy()
    else:
        made = np.empty(values.shape, np.float32 if largest <= _EXACT else np.float64)
    # Slice by slice, so that intermediates never have the size of the volume.
    for number, part in enumerate(values):
        hits = is_missing(number, part)
        if made is not values:
            made[number] = part
        made[number][hits] = np.nan
    return made, count


def noted(count: int, what: str, *, always: bool = False) -> tuple[str, ...]:
    """Return a note on missing samples."""
    return (f"missing: {count} sample{'' if count == 1 else 's'}, by {what}",) if count or always else ()


def parsed(texts: Iterable[str]) -> tuple[Mark, ...]:
    """Return marks that a file writes as text; words that are not numbers, and NaN, are ignored."""
    found: list[Mark] = []
    for word in " ".join(texts).split():
        for kind in (int, float):
            with suppress(ValueError):
                found.append(kind(word))
                break
    return tuple(each for each in found if each == each)


def _in_type(mark: Mark, dtype: np.dtype) -> Any | None:
    """Return the number in a sample type, or None if the type can't hold it."""
    if dtype.kind == "f":
        with np.errstate(over="ignore"), suppress(OverflowError):
            number = dtype.type(float(mark))
            return None if np.isinf(number) and mark not in (np.inf, -np.inf) else number
        return None
    if isinstance(mark, float) and not mark.is_integer():
        return None
    limits = np.iinfo(dtype)
    return dtype.type(int(mark)) if limits.min <= int(mark) <= limits.max else None
