"""Lookup of the values that may show: one table entry per sample, ten times as fast as a search.

The range of the values is cut into bins. Of each the table holds between which values, all of them included, something
may show; what shows nothing in between is among them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

_BINS = 1 << 12
_HALVINGS = 110  # of a bin: until the next number is float64's next one
_TABLES: WeakKeyDictionary[TransferFunction, WeakKeyDictionary[Volume, _Table]] = WeakKeyDictionary()


def visible(volume: Volume, transfer_function: TransferFunction, values: NDArray) -> NDArray[np.bool_]:
    """True for the values of a volume that may show at any gradient; False where they are NaN."""
    known = _TABLES.setdefault(transfer_function, WeakKeyDictionary())
    if volume not in known:
        known[volume] = _Table.of(volume, transfer_function)
    table = known[volume]
    if not table.width > 0:
        return transfer_function.shows_between(values, values)
    wide = values.astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):  # NaN is any integer
        position = (wide - table.low) * (1 / table.width)
        number = np.clip(position, 0, _BINS - 1, out=position).astype(np.intp)
    # Any position that is none counts as the first or the last.
    above, below = table.above.take(number, mode="clip"), table.below.take(number, mode="clip")
    shows = np.asarray((wide > above) & (wide < below))
    if volume.value_range != volume.finite_range:
        infinite = np.isinf(wide)
        shows[infinite] = transfer_function.shows_between(wide[infinite], wide[infinite])
    return shows


class _Table(NamedTuple):
    """Bins from `low` on, each `width` wide, and above and below which value something of each may show."""

    low: float
    width: float
    above: NDArray[np.float64]
    below: NDArray[np.float64]

    @classmethod
    def of(cls, volume: Volume, transfer_function: TransferFunction) -> _Table:
        low, high = volume.finite_range or (0.0, 0.0)
        width = high / _BINS - low / _BINS
        if not width > 0:
            return cls(low, 0.0, np.zeros(0), np.zeros(0))
        # Half a bin wider than they are, whatever rounding says.
        edges = low + width * np.arange(_BINS + 1)
        lowest, highest = np.array(edges[:-1] - width / 2), np.array(edges[1:] + width / 2)
        return cls(low, width, *_visible_parts(transfer_function, lowest, highest))


def _visible_parts(
    transfer_function: TransferFunction, lowest: NDArray[np.float64], highest: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return for each interval the values above which and below which something may show."""
    shows = transfer_function.shows_between(lowest, highest)
    above, below = np.where(shows, -np.inf, np.inf), np.where(shows, np.inf, -np.inf)
    low, high = lowest[shows], highest[shows]
    above[shows] = _last_dark(low, high, lambda some, position: transfer_function.shows_between(low[some], position))
    below[shows] = _last_dark(high, low, lambda some, position: transfer_function.shows_between(position, high[some]))
    return above, below


def _last_dark(
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    shows_until: Callable[[NDArray[np.intp], NDArray[np.float64]], NDArray[np.bool_]],
) -> NDArray[np.float64]:
    """Return for each start the last value towards the end up to which nothing shows; infinite if the start shows.

    `shows_until` says of some of the starts whether anything shows between them and a position each.
    """
    found = np.where(start < end, -np.inf, np.inf)
    dark = np.flatnonzero(~shows_until(np.arange(start.size), start))
    nothing, something = start[dark], end[dark]
    for _ in range(_HALVINGS):
        middle = nothing / 2 + something / 2
        shows = shows_until(dark, middle)
        nothing, something = np.where(shows, nothing, middle), np.where(shows, middle, something)
    # Halving would come to 0 after a thousand times, and 0 is what most volumes have most of.
    is_beside = (np.minimum(nothing, something) <= 0) & (np.maximum(nothing, something) >= 0)
    zero = np.zeros(dark.size)
    found[dark] = np.where(is_beside & ~shows_until(dark, zero), zero, nothing)
    return found
