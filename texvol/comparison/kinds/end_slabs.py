"""End slabs: slabs that are not clipped where the volume ends make matter thicker there, in stripes: wood grain.

A ray's first and last slab count whole, and not for the part that lies in the volume. So the optical depth -log(1 - A)
is larger by up to a slab's at either end, never smaller, and jumps where the next slab begins, while the matter shown
is as smooth as it was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import is_partial
from texvol.comparison.kinds.finding import Finding
from texvol.comparison.kinds.kind import Kind, number, other
from texvol.comparison.kinds.pair import Pair

_MOST_OPACITY = 0.98  # of more, an optical depth has lost its digits
_OTHER_SIGN = 0.03  # of the sum of absolute differences
# A sawtooth of p pixels has jumps J² / p a pixel, and variance J² / 12: 12 / p. So stripes are up to 100 pixels wide.
_JAGGED = 0.12
_THAN_SHOWN = 4.0  # times as jagged as what is shown
# A change of opacity bends where the opacity does; stripes bend anywhere. Measured: 0.4 and more, 0.02 and less.
_ALIKE = 0.2


def unclipped(pair: Pair) -> Finding | None:
    """Whether the end slabs of one picture are not clipped."""
    if not pair.has_opacity or min(pair.size) < 8 or not is_partial(pair.reference[..., 3]):
        return None
    thicker, depth, known = _thicker(pair)
    size = float(np.abs(thicker).sum())
    if not size > 0:
        return None
    excess = float(thicker.sum())
    if 0.5 * (size - abs(excess)) > _OTHER_SIGN * size:
        return None
    jagged, usual = _jaggedness(thicker, known), _jaggedness(depth, known)
    if jagged < _JAGGED or jagged < _THAN_SHOWN * usual:
        return None
    side = "candidate" if excess > 0 else "reference"
    shown = depth if excess > 0 else depth + thicker
    if abs(_bends_alike(thicker, shown, known)) > _ALIKE:
        return None
    most = float(np.quantile(np.abs(thicker[known & (thicker != 0)]), 0.99))
    words = (
        f"matter is thicker in the {side}, by an optical depth of up to {number(most, 2)}, in stripes, and nowhere "
        f"thinner: as slabs are that are not clipped at the edges of the volume (in the {other(side)} they are)"
    )
    parameters = {"end_slabs": side, "optical_depth": most, "jaggedness": jagged}
    return Finding(Kind("edges only", 1.0, words, parameters), pair.with_side("candidate", pair.reference))


def _thicker(pair: Pair) -> tuple[NDArray, NDArray, NDArray]:
    """By how much optical depth the candidate is thicker, the reference's depth, and where both are known."""
    candidate, reference = pair.candidate[..., 3].astype(np.float64), pair.reference[..., 3].astype(np.float64)
    known = np.maximum(candidate, reference) < _MOST_OPACITY
    depth = -np.log1p(-np.where(known, reference, 0))
    return np.where(known, -np.log1p(-np.where(known, candidate, 0)) - depth, 0), np.where(known, depth, 0), known


def _jaggedness(values: NDArray, known: NDArray) -> float:
    """Mean square of steps between neighbours, along the axis where it is more, over the variance."""
    used = values[known]
    variance = float(used.var()) if used.size else 0.0
    if not variance > 0:
        return 0.0
    both = known[:, 1:] & known[:, :-1], known[1:] & known[:-1]
    steps = (np.diff(values, axis=1)[both[0]], np.diff(values, axis=0)[both[1]])
    return max(float(np.square(each).mean()) if each.size else 0.0 for each in steps) / variance


def _bends_alike(values: NDArray, shown: NDArray, known: NDArray) -> float:
    """Correlation of second differences along both axes, of where they are known."""
    products = np.zeros(3)
    for axis in (0, 1):
        v, w, k = (each.swapaxes(0, axis) for each in (values, shown, known))
        inner = k[2:] & k[1:-1] & k[:-2]
        one, two = ((each[2:] - 2 * each[1:-1] + each[:-2])[inner] for each in (v, w))
        products += [one @ two, one @ one, two @ two]
    return float(products[0] / max(np.sqrt(products[1] * products[2]), 1e-300))
