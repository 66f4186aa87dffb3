"""Proportions of volumes whose axes have different units, such as degrees and pascals.

Their box is as long as its numbers are large: 360 by 100,000 is a line. For the first picture such an axis is scaled so
that its edge is half of the longest other one. A file that names directions of the body, or no units, stays as it is.
"""

from __future__ import annotations

import re
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.volume import Volume

_FAR_APART = 20.0  # ratio of edges, from which on the box is a line or a sheet
_PART = 0.5  # of the longest other edge

_KNOWN: WeakKeyDictionary[Volume, Volume] = WeakKeyDictionary()


def in_proportion(volume: Volume) -> Volume:
    """Return the volume with axes of other units than the first scaled, if need be; the same object each time."""
    if volume not in _KNOWN:
        factors = _factors(volume)
        if factors is None:
            return volume
        _KNOWN[volume] = volume.moved(np.diag([*factors, 1.0]))
    return _KNOWN[volume]


def _factors(volume: Volume) -> np.ndarray | None:
    """Return the factors of the world axes x, y, z, or None if the volume is to stay as it is."""
    units = [re.sub(r"_.*", "", unit) for unit in re.findall(r"\(([^()]*)\)", volume.space)]
    straight = np.array_equal(np.abs(volume.direction), np.eye(3))
    if len(units) != 3 or not straight or len(set(units)) == 1:
        return None
    edges = np.abs(np.diag(volume.box_edges))
    if edges.max() < _FAR_APART * edges.min():
        return None
    alike = np.array([unit == units[0] for unit in units])
    return np.where(alike, 1.0, _PART * edges[alike].max() / edges)
