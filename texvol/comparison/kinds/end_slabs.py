"""End slabs that are not clipped at the box's faces: stripes like wood grain, in which the medium is thicker.

If a ray's first and last slab count whole instead of for the part inside the box, the optical depth -log(1 - A) grows
by at most one slab's at either end. The excess is never negative, and jumps where the next slab begins, while the
medium's own optical depth is smooth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import is_partial
from texvol.comparison.kinds.kind import Finding, Kind, number
from texvol.comparison.kinds.pair import Pair, other

_MOST_OPACITY = 0.98  # the optical depth of a larger opacity has few digits
_OTHER_SIGN = 0.03  # of the sum of absolute differences
# A sawtooth of p pixels has jumps J² / p a pixel, and variance J² / 12: 12 / p. So stripes are up to 100 pixels wide.
_JAGGED = 0.12
_THAN_SHOWN = 4.0  # times as jagged as what is shown
# A change of opacity has the second differences of the opacity (correlation 0.4 and more); stripes 0.02 and less.
_ALIKE = 0.2


def unclipped(pair: Pair) -> Finding | None:
    """Find a picture whose end slabs are not clipped."""
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
        f"the medium is thicker in the {side}, by an optical depth of up to {number(most, 2)}, in stripes, and nowhere "
        f"thinner, as if its end slabs were not clipped at the volume's faces (those of the {other(side)} are)"
    )
    parameters = {"end_slabs": side, "optical_depth": most, "jaggedness": jagged}
    return Finding(Kind("edges only", 1.0, words, parameters), pair.with_side("candidate", pair.reference))


def _thicker(pair: Pair) -> tuple[NDArray, NDArray, NDArray]:
    """Return the candidate's excess of optical depth, the reference's depth, and a mask of usable pixels."""
    candidate, reference = pair.candidate[..., 3].astype(np.float64), pair.reference[..., 3].astype(np.float64)
    known = np.maximum(candidate, reference) < _MOST_OPACITY
    depth = -np.log1p(-np.where(known, reference, 0))
    return np.where(known, -np.log1p(-np.where(known, candidate, 0)) - depth, 0), np.where(known, depth, 0), known


def _jaggedness(values: NDArray, known: NDArray) -> float:
    """Mean square of the steps between neighbours over the variance, along the axis where the steps are larger."""
    used = values[known]
    variance = float(used.var()) if used.size else 0.0
    if not variance > 0:
        return 0.0
    both = known[:, 1:] & known[:, :-1], known[1:] & known[:-1]
    steps = (np.diff(values, axis=1)[both[0]], np.diff(values, axis=0)[both[1]])
    return max(float(np.square(each).mean()) if each.size else 0.0 for each in steps) / variance


def _bends_alike(values: NDArray, shown: NDArray, known: NDArray) -> float:
    """Correlation of the second differences of `values` and `shown` along both axes, over known pixels."""
    products = np.zeros(3)
    for axis in (0, 1):
        v, w, k = (each.swapaxes(0, axis) for each in (values, shown, known))
        inner = k[2:] & k[1:-1] & k[:-2]
        one, two = ((each[2:] - 2 * each[1:-1] + each[:-2])[inner] for each in (v, w))
        products += [one @ two, one @ one, two @ two]
    return float(products[0] / max(np.sqrt(products[1] * products[2]), 1e-300))
