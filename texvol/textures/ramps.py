"""A transfer function as a sum of ramps: for a few points the fastest way to look it up, and exact to rounding.

    numbers(v) = base + Σ rises[i] clamp((v - starts[i]) / widths[i], 0, 1)

Between two points lies a ramp, at a step one that is all but upright. Extinctions that are infinite, or so far apart
that the sum would lose a small one beside a large one, have no such sum.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# What shaders/each_ramp.glsl has; each ramp costs a thirtieth of a texture fetch in Mesa's software driver.
NUMBERS_OF_RAMPS = (2, 3, 4, 6, 8, 12, 16, 24)
_UPRIGHT, _LEAST = 1e38, 1e-36  # the slope of a step, and how far below its position it begins at least
# How much lower a step is put, in fractions of its position: interpolation may round equal texels down by half an ulp
# or two, and a flat region that lies exactly on a step would fall to its left side.
STEP_MARGIN = 2.0**-22
_LOST = 1e-6  # largest rounding of a number, relative to itself


def ramp_uniforms(
    positions: NDArray[np.float64], numbers: NDArray[np.float64], emissive: bool, *, contiguous: bool = False
) -> dict[str, Any] | None:
    """The shader's `ramp_base`, `ramp_rises`, `ramp_places` (start, 1 / width, end); None where there is no such sum.

    Parameters
    ----------
    positions : array of shape (n,)
        The control points' values, as the texture holds them, never descending.
    numbers : array of shape (n, 4)
        Colour or emission and extinction of each.
    emissive : bool
        True if what glows is a number of its own, and shows where there is no extinction.
    contiguous : bool
        True if each ramp is to end where the next one starts, so that there are ramps that add nothing.
    """
    if emissive or not numbers[:, 3].any():
        first, last = 0, len(positions) - 1
    else:
        # Colours show nothing before the extinction rises from 0, and after it has fallen to that.
        shows = np.flatnonzero(numbers[:, 3])
        first, last = max(shows[0] - 1, 0), min(shows[-1] + 1, len(positions) - 1)
    positions, wanted = positions[first : last + 1], numbers[first : last + 1].astype(np.float32)
    starts, ends = positions[:-1].astype(np.float32), positions[1:].astype(np.float32)
    is_step = ends <= starts
    with np.errstate(divide="ignore"):
        # A little steeper, so that the ramp has ended at its end whatever rounding says.
        per_width = np.where(is_step, _UPRIGHT, (1 + 2.0**-22) / (ends.astype(np.float64) - starts))
    starts = np.where(is_step, starts - np.maximum(STEP_MARGIN * np.abs(starts), _LEAST), starts).astype(np.float32)
    # Each rise goes to the next point from where float32's sum of those before it has come.
    sums, rises = wanted[0], []
    for number in wanted[1:]:
        rises.append(number - sums)
        sums = sums + rises[-1]
        if (np.abs(sums - number) > _LOST * number).any():
            return None
    rising = [index for index, rise in enumerate(rises) if rise.any()]
    kept = list(range(rising[0], rising[-1] + 1)) if contiguous and rising else rising
    number_of_ramps = next((number for number in NUMBERS_OF_RAMPS if number >= len(kept)), 0)
    if not number_of_ramps:
        return None
    per_width = np.minimum(per_width, _UPRIGHT)
    ramps = [(rises[index], (starts[index], per_width[index], ends[index])) for index in kept]
    last_position = ends[kept[-1]] if kept else np.float32(positions[-1])
    flat = (np.zeros(4, np.float32), (last_position, 1.0, last_position))
    rise, position = zip(*ramps, *[flat] * (number_of_ramps - len(ramps)), strict=True)
    return {
        "ramp_base": tuple(map(float, wanted[0])),
        "ramp_rises": [tuple(map(float, each)) for each in rise],
        "ramp_positions": [tuple(map(float, each)) for each in position],
    }
