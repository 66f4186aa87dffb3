"""Signed distances: fields whose gradient has one length everywhere, as that of the distance to a surface has.

What such a field shows is the solid inside of the surface. The samples at the ends of the box are outside. A level
set may be told in a narrow band about the surface only, beyond which all samples have its least or greatest value.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

_ENOUGH = 0.8  # fraction of the samples whose gradient is about as long as is typical
_ABOUT = 0.15  # of the typical length; ridges, where two parts of the surface are equally far, are beyond it
_LOOKED_AT = 1 << 18  # samples
_FEWEST = 32  # samples whose gradients are known
_REACHES = 2.0  # spacings, on both sides of zero, at least
_AT_THE_ENDS = 0.9  # least fraction of the samples of the box's sides that have one sign


def depth_inside(volume: Volume) -> float | None:
    """Return the value one sample inside of the surface of a signed distance; None if a volume is no such field."""
    ends = volume.finite_range
    seen = volume.overview
    if ends is None or not ends[0] < 0 < ends[1] or seen.values.ndim != 3 or min(seen.shape) < 4:
        return None
    lengths = _gradients(seen, ends)
    if not (lengths.size >= _FEWEST and np.isfinite(lengths).all()):
        return None
    typical = float(np.partition(lengths, lengths.size // 2)[lengths.size // 2])
    if not typical > 0 or float((np.abs(lengths / typical - 1) <= _ABOUT).mean()) < _ENOUGH:
        return None
    step = typical * volume.smallest_spacing
    if min(-ends[0], ends[1]) < _REACHES * step:
        return None
    outside = _sign_at_the_ends(seen.values)
    return -outside * step if outside else None


def samples_of_sides(values: NDArray) -> NDArray:
    """Return the samples of the box's six sides, those of its edges more than once."""
    return np.concatenate([np.take(values, end, axis=axis).reshape(-1) for axis in range(3) for end in (0, -1)])


def _gradients(volume: Volume, ends: tuple[float, float]) -> NDArray[np.float64]:
    """Return the lengths of gradients at some samples inside of the box, data units per world unit.

    Samples that have a neighbour of the least or the greatest value are left out: there a band may end.
    """
    values = volume.values
    step = max(-(-values.size // _LOOKED_AT), 1)
    every = max(int(np.ceil(step ** (1 / 3))), 1)
    squares: NDArray[np.float64] | None = None
    is_within: NDArray[np.bool_] | None = None
    for axis, spacing in zip((2, 1, 0), volume.spacing, strict=True):
        behind, before = (
            tuple(
                slice(1 + (by if each == axis else 0), count - 1 + (by if each == axis else 0), every)
                for each, count in enumerate(values.shape)
            )
            for by in (1, -1)
        )
        slope = (values[behind].astype(np.float64) - values[before]) / (2 * spacing)
        squares = slope**2 if squares is None else squares + slope**2
        for side in (values[behind], values[before]):
            is_here = (side > ends[0]) & (side < ends[1])
            is_within = is_here if is_within is None else is_within & is_here
    assert squares is not None and is_within is not None, "there are three axes"
    return np.sqrt(squares[is_within])


def _sign_at_the_ends(values: NDArray) -> int:
    """Return the sign of nearly all samples of the box's six sides, 0 if there is none."""
    positive = float((samples_of_sides(values) > 0).mean())
    return 1 if positive >= _AT_THE_ENDS else -1 if positive <= 1 - _AT_THE_ENDS else 0
