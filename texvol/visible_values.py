"""Which values of a volume may show anything: one look into a table per sample, where a search takes ten times as long.

The range of the values is cut into bins. Of each the table holds between which values, all of them included, something
may show; what shows nothing in between is among them.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.transfer import TransferFunction
from texvol.volume import Volume

_BINS = 1 << 12
_HALVINGS = 110  # of a bin: until the next number is float64's next one
_LARGEST = float(np.finfo(np.float64).max)
_TABLES: WeakKeyDictionary[TransferFunction, WeakKeyDictionary[Volume, VisibleValues]] = WeakKeyDictionary()


class VisibleValues:
    """What may show of one volume with one transfer function, whatever the gradient."""

    def __init__(self, volume: Volume, transfer_function: TransferFunction) -> None:
        self._transfer_function = transfer_function
        self._low, high = volume.finite_range or (0.0, 0.0)
        self._width = high / _BINS - self._low / _BINS
        if self._width > 0:
            # Half a bin wider than they are, whatever rounding says; the outer two for all that is beyond.
            edges = self._low + self._width * np.arange(_BINS + 1)
            lowest, highest = np.array(edges[:-1] - self._width / 2), np.array(edges[1:] + self._width / 2)
            lowest[0], highest[-1] = volume.value_range or (0.0, 0.0)
            self._has_infinite = bool(np.isinf([lowest[0], highest[-1]]).any())
            self._above, self._below = _visible_parts(transfer_function, lowest, highest)

    @classmethod
    def of(cls, volume: Volume, transfer_function: TransferFunction) -> VisibleValues:
        """The same one as long as there are the two."""
        known = _TABLES.setdefault(transfer_function, WeakKeyDictionary())
        if volume not in known:
            known[volume] = cls(volume, transfer_function)
        return known[volume]

    def among(self, values: NDArray) -> NDArray[np.bool_]:
        """Which of some values may show anything; False where they are NaN."""
        if not self._width > 0:
            return self._transfer_function.shows_between(values, values)
        wide = values.astype(np.float64)
        if self._has_infinite:
            np.clip(wide, -_LARGEST, _LARGEST, out=wide)
        with np.errstate(invalid="ignore", over="ignore"):  # NaN is any integer
            place = (wide - self._low) * (1 / self._width)
            number = np.clip(place, 0, _BINS - 1, out=place).astype(np.intp)
        # Any place that is none counts as the first or the last.
        above, below = self._above.take(number, mode="clip"), self._below.take(number, mode="clip")
        return np.asarray((wide > above) & (wide < below))


def _visible_parts(
    transfer_function: TransferFunction, lowest: NDArray[np.float64], highest: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Above which and below which value of each interval something may show."""
    shows = transfer_function.shows_between(lowest, highest)
    above, below = np.where(shows, -np.inf, np.inf), np.where(shows, np.inf, -np.inf)
    low, high = lowest[shows], highest[shows]
    # What shows nothing at one end shows something from somewhere on: from its end to there is nothing.
    dark = np.flatnonzero(~transfer_function.shows_between(low, low) & np.isfinite(low))
    nothing, something = low[dark], high[dark]
    for _ in range(_HALVINGS):
        middle = nothing / 2 + something / 2
        is_dark = ~transfer_function.shows_between(low[dark], middle)
        nothing, something = np.where(is_dark, middle, nothing), np.where(is_dark, something, middle)
    above[np.flatnonzero(shows)[dark]] = nothing
    dark = np.flatnonzero(~transfer_function.shows_between(high, high) & np.isfinite(high))
    something, nothing = low[dark], high[dark]
    for _ in range(_HALVINGS):
        middle = nothing / 2 + something / 2
        is_dark = ~transfer_function.shows_between(middle, high[dark])
        nothing, something = np.where(is_dark, middle, nothing), np.where(is_dark, something, middle)
    below[np.flatnonzero(shows)[dark]] = nothing
    return above, below
