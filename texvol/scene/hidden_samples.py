"""Volume whose hidden samples are missing, for pictures of the values themselves."""

from __future__ import annotations

from copy import copy
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.mask import Mask
from texvol.scene.volume import Volume

_WITHOUT: WeakKeyDictionary[Volume, tuple[Mask, Volume]] = WeakKeyDictionary()
_OF_THE_VALUES = ("value_range", "has_missing", "finite_range")


def without_hidden(volume: Volume, mask: Mask) -> Volume:
    """Return the volume with NaN at the samples that the mask hides.

    The same volume and mask give the same object for as long as `volume` exists.
    """
    known = _WITHOUT.get(volume)
    if known is None or known[0] is not mask:
        known = _WITHOUT[volume] = mask, _with_missing(volume, mask)
    return known[1]


def _with_missing(volume: Volume, mask: Mask) -> Volume:
    # float32 holds every integer of 16 bits.
    wide = volume.values.dtype.itemsize > 2 and volume.values.dtype != np.float32
    values = volume.values.astype(np.float64 if wide else np.float32)
    values[mask.hidden] = np.nan
    left = copy(volume)
    for derived in _OF_THE_VALUES:
        left.__dict__.pop(derived, None)
    left.values = values
    return left
