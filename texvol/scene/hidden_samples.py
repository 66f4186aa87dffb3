"""What a mask hides where the values themselves are seen: its samples are missing."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

_WITHOUT: WeakKeyDictionary[Volume, tuple[Mask, Volume]] = WeakKeyDictionary()
_OF_THE_VALUES = ("value_range", "has_missing", "finite_range")


def without_hidden(scene: Scene) -> Scene:
    """The scene itself in mode composite or without a mask; else that of what is left of the volume.

    The same volume comes for the same mask, for as long as there is the one that it was made of.
    """
    mask, volume = scene.mask, scene.volume
    if mask is None or scene.mode == "composite":
        return scene
    known = _WITHOUT.get(volume)
    if known is None or known[0] is not mask:
        known = _WITHOUT[volume] = mask, _with_missing(volume, mask)
    return replace(scene, volume=known[1], mask=None)


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
