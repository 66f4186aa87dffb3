"""A Mask says how much of the medium at each sample is there: 0 hides it, 1 leaves it as it is.

Emission and extinction are multiplied with the weight: of the samples, before they are interpolated, where the scene is
classified before (`slab`, `extinction`), or else with the weight that is interpolated in the same way as the value.
Where values themselves are seen (xray, mip and so on, isosurface) nothing can fade: samples of weight 0 are missing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.kept_arrays import KeepsArrays, Unchanged, read_only

_OF_THE_VALUES = ("value_range", "has_missing", "finite_range")


@dataclass(frozen=True, eq=False)
class Mask(KeepsArrays):
    """Weights of a volume's samples.

    Parameters
    ----------
    weights : array of shape (nz, ny, nx)
        Booleans, or numbers from 0 to 1; read-only, as the values of a volume are.
    name : str
        What messages call it, usually its file.
    source : mapping
        How it can be had again: that of the volume whose values it is made of, with `fade` where there is one; empty
        for an array.

    Raises
    ------
    InputError
        If they are no such numbers.
    """

    weights: ArrayLike
    name: str = "mask"
    source: Mapping[str, Any] = field(default_factory=dict)
    _unchanged: Unchanged = field(default_factory=Unchanged, init=False, repr=False)

    def __post_init__(self) -> None:
        weights = np.asarray(self.weights)
        if weights.ndim != 3 or weights.dtype.kind not in "buif":
            raise InputError(
                f"{self.name}: a mask must have numbers along 3 axes (z, y, x), got {weights.dtype} of "
                f"shape {weights.shape}"
            )
        if weights.dtype != np.bool_:
            weights = weights.astype(np.float32)
            if not (weights.size and weights.min() >= 0 and weights.max() <= 1):  # NaN is neither
                span = f"they go from {weights.min():g} to {weights.max():g}" if weights.size else "there are none"
                raise InputError(
                    f"{self.name}: weights must be from 0 to 1, but {span}; fade=(low, high) turns other "
                    "numbers into weights"
                )
        kept = read_only(np.ascontiguousarray(weights))
        if not self.source:
            object.__setattr__(self, "_unchanged", Unchanged((kept, self.weights)))
        object.__setattr__(self, "weights", kept)
        object.__setattr__(self, "source", dict(self.source))

    @classmethod
    def of(cls, volume: Volume, fade: Sequence[float] | None = None) -> Mask:
        """A mask out of a volume's values: by `fade` (low, high) weights rise from 0 at low to 1 at high.

        They fall where low is more than high. Without it integers hide where they are 0, as segmentations do, and
        others are weights. Missing values hide.
        """
        values = volume.values
        if fade is None:
            weights = np.nan_to_num(values, nan=0.0)
            return cls(weights != 0 if _were_integers(volume) else weights, volume.name, volume.source)
        low, high = (float(end) for end in fade)
        if not (np.isfinite(low) and np.isfinite(high) and low != high):
            raise InputError(f"{volume.name}: fade must be two different finite numbers, got {low:g} and {high:g}")
        fractions = np.clip((values.astype(np.float64) - low) / (high - low), 0, 1)
        source = {**volume.source, "fade": [low, high]} if volume.source else {}
        return cls(np.nan_to_num(fractions, nan=0.0), volume.name, source)

    def check_unchanged(self) -> None:
        """Raise InputError if the array that it was made of has been changed since something was made of it."""
        self._unchanged.check(self.name, "weights")

    @property
    def array(self) -> NDArray[np.bool_] | NDArray[np.float32]:
        """The weights: booleans, or single precision."""
        assert isinstance(self.weights, np.ndarray)
        return self.weights

    @cached_property
    def hidden(self) -> NDArray[np.bool_]:
        """Mask of the samples whose weight is 0."""
        self.check_unchanged()
        return self.array == 0

    def check_fits(self, volume: Volume) -> None:
        """Raise InputError unless it has a weight for each sample of the volume."""
        if self.array.shape != volume.shape:
            mine, wanted = (" x ".join(map(str, each.shape[::-1])) for each in (self.array, volume.values))
            raise InputError(
                f"{self.name}: a mask must have as many samples as its volume, got {mine} samples where {volume.name} "
                f"has {wanted}"
            )


def _were_integers(volume: Volume) -> bool:
    """True if the values are integers, or were integers before missing samples made them floats."""
    if volume.dtype.kind in "iu":
        return True
    if not volume.has_missing or volume.finite_range is None or volume.finite_range[1] <= 1:
        return False
    known = volume.values[np.isfinite(volume.values)]
    return bool((known == np.rint(known)).all())


_WITHOUT: WeakKeyDictionary[Volume, tuple[Mask, Volume]] = WeakKeyDictionary()


def without_hidden(volume: Volume, mask: Mask) -> Volume:
    """Return the volume with NaN at the samples that the mask hides.

    The same volume and mask give the same object for as long as `volume` exists.
    """
    known = _WITHOUT.get(volume)
    if known is None or known[0] is not mask:
        known = _WITHOUT[volume] = mask, _without(volume, mask)
    return known[1]


def _without(volume: Volume, mask: Mask) -> Volume:
    # float32 holds every integer of 16 bits.
    wide = volume.dtype.itemsize > 2 and volume.dtype != np.float32
    values = volume.values.astype(np.float64 if wide else np.float32)
    values[mask.hidden] = np.nan
    left = copy(volume)
    for derived in _OF_THE_VALUES:
        left.__dict__.pop(derived, None)
    left.values = values
    return left
