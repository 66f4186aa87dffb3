"""Differences of no known kind: their position, channel and sign."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.kind import CHANNELS, Finding, Kind, number
from texvol.comparison.kinds.pair import Pair

_BOX_FRACTION = 0.9


def unexplained(pair: Pair) -> Finding:
    """Return the finding of a difference of no known kind."""
    left, top, right, bottom = _box(pair.energy)
    of_channels = np.square(pair.difference / max(pair.largest, 1e-30), dtype=np.float64).sum(axis=(0, 1))
    channel = int(of_channels.argmax())
    part = float(of_channels[channel] / max(of_channels.sum(), 1e-300))
    mean = float(pair.difference[..., channel].mean(dtype=np.float64))
    corner = pair.corner
    box = (left + corner[0], top + corner[1], right + corner[0], bottom + corner[1])
    which = f"mostly in {CHANNELS[channel]}" if part > 0.5 else "in several channels"
    more = ("brighter" if mean > 0 else "darker") if channel < 3 else ("more" if mean > 0 else "less")
    words = (
        f"of no known kind: 90 % of it lies in columns {box[0]} to {box[2]}, rows {box[1]} to {box[3]}, {which}; "
        f"on average the candidate's {CHANNELS[channel]} is {more}, by {number(abs(mean))}"
    )
    parameters = {"box": list(box), "channel": CHANNELS[channel], "share_of_channel": part, "mean": mean}
    return Finding(Kind("unexplained", 0.0, words, parameters), pair)


def _box(energy: NDArray) -> tuple[int, int, int, int]:
    """Return (left, top, right, bottom), inclusive, of the middle 90 % along each axis."""
    ends = []
    for axis in (0, 1):
        along = energy.sum(axis=axis, dtype=np.float64)
        fraction = np.cumsum(along) / max(along.sum(), 1e-300)
        # Four tails, which together hold the rest.
        tail = (1 - _BOX_FRACTION) / 4
        ends.append((int(np.searchsorted(fraction, tail)), int(np.searchsorted(fraction, 1 - tail))))
    (left, right), (top, bottom) = ends
    return left, top, min(right, energy.shape[1] - 1), min(bottom, energy.shape[0] - 1)
