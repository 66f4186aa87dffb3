"""Least squares of one number, and of factors, over the pixels of a sample."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

_GOLDEN = (np.sqrt(5) - 1) / 2
_BRACKET = 0.01


def least(cost: Callable[[float], float], low: float, high: float, tries: int = 17) -> float:
    """Where `cost` of a positive number is least between `low` and `high`.

    Looked for on `tries` numbers of even ratios, then by golden sections about the best, and by a parabola at last:
    near its minimum a sum of squares is one, so that a bracket of 1 % finds the number to some 1e-5.
    """
    logarithms = np.linspace(np.log(low), np.log(high), tries)
    costs = [_number(cost(float(np.exp(each)))) for each in logarithms]
    best = int(np.argmin(costs))
    a, b = float(logarithms[max(best - 1, 0)]), float(logarithms[min(best + 1, tries - 1)])
    known = {float(at): value for at, value in zip(logarithms, costs, strict=True) if a <= at <= b}

    def value(at: float) -> float:
        if at not in known:
            known[at] = _number(cost(float(np.exp(at))))
        return known[at]

    while b - a > _BRACKET:
        left, right = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        a, b = (a, right) if value(left) < value(right) else (left, b)
    middle = (a + b) / 2
    rise, bend = value(b) - value(a), value(a) + value(b) - 2 * value(middle)
    step = -0.25 * (b - a) * rise / bend if np.isfinite(bend) and bend > 0 else 0.0
    at = middle + float(np.clip(step, a - middle, b - middle))
    return float(np.exp(min((at, middle), key=value)))


def ratio(of: NDArray, to: NDArray, weights: NDArray) -> float:
    """The factor k for which k · `to` is nearest to `of`; 1 where `to` is 0 everywhere."""
    of, to = of.astype(np.float64), to.astype(np.float64)
    below = float((weights * to * to).sum())
    return float((weights * of * to).sum()) / below if below > 0 else 1.0


def _number(cost: float) -> float:
    return cost if np.isfinite(cost) else np.inf
