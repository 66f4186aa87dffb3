"""Search for the parameter of a hypothesis that leaves least."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

_GOLDEN = (np.sqrt(5) - 1) / 2
_BRACKET = 0.01


def least(cost: Callable[[float], float], low: float, high: float, tries: int = 17) -> float:
    """Return the positive number between `low` and `high` at which `cost` is least.

    The search samples `tries` numbers of equal ratios, then takes golden sections about the best, and last a parabola:
    near its minimum a sum of squares is parabolic, so that a bracket of 1 % gives the number to about 1e-5.
    """

    @cache
    def value(at: float) -> float:
        found = cost(float(np.exp(at)))
        return found if np.isfinite(found) else np.inf

    logarithms = np.linspace(np.log(low), np.log(high), tries).tolist()
    best = int(np.argmin([value(each) for each in logarithms]))
    a, b = logarithms[max(best - 1, 0)], logarithms[min(best + 1, tries - 1)]
    while b - a > _BRACKET:
        left, right = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        a, b = (a, right) if value(left) < value(right) else (left, b)
    middle = (a + b) / 2
    rise, bend = value(b) - value(a), value(a) + value(b) - 2 * value(middle)
    step = -0.25 * (b - a) * rise / bend if np.isfinite(bend) and bend > 0 else 0.0
    at = middle + float(np.clip(step, a - middle, b - middle))
    return float(np.exp(min((at, middle), key=value)))
