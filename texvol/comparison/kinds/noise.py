"""Noise: differences that are not correlated between neighbours."""

from __future__ import annotations

import numpy as np

from texvol.comparison.kinds.kind import Finding, Kind, number
from texvol.comparison.kinds.pair import Pair, Pixels

MOST_GAUSSIAN = 4.5  # fourth moment; that of a Gaussian is 3
_FEW = 0.02  # of the pixels
_FEWEST = 48  # differing pixels; fewer allow no estimate of a correlation
# A correlation over n pixels scatters by 1/√n; a cut at 0, or a factor of opacity, adds a little.
_CORRELATION, _MEAN, _SCATTER, _SURELY = 0.06, 0.1, 4.0, 0.2
_NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2))  # (down, right)


def noise(pair: Pair) -> Finding | None:
    """Find a difference of mean zero that is not correlated between neighbours."""
    if pair.window is not pair and _is_correlated(pair.window):
        return None
    difference = pair.difference[..., : pair.channels] / np.float32(pair.largest)
    differing = pair.energy > 0
    count = int(differing.sum())
    if count < _FEWEST or min(pair.size) < 3:
        return None
    square = float(np.square(difference, dtype=np.float64).sum())
    limit = max(_CORRELATION, _SCATTER / np.sqrt(count))
    alike = [_correlation(difference, *step) / square for step in _NEIGHBOURS]
    values = difference[differing]
    mean = np.abs(values.mean(axis=0, dtype=np.float64)).max()
    rms = float(np.sqrt(np.square(values, dtype=np.float64).mean()))
    fraction = count / pair.energy.size
    # A few single pixels may all be white, or black; many brighter pixels are no noise.
    has_mean = mean > (_MEAN + _SCATTER / np.sqrt(count)) * rms
    if max(map(abs, alike)) > limit or (has_mean and fraction > _FEW):
        return None
    everywhere = float(np.sqrt(square / difference.size)) * pair.largest
    tails = float(np.power(values, 4, dtype=np.float64).mean()) / rms**4
    form = _noise_form(tails, fraction)
    words = f"noise of rms {number(everywhere)}, {form}, not correlated between neighbours"
    words += ", brighter or darker on the whole" if has_mean else ", of mean zero"
    parameters = {"rms": everywhere, "share": fraction, "kurtosis": tails}
    explained = 1 - max(map(abs, alike))
    return Finding(Kind("noise", explained, words, parameters), pair.with_side("candidate", pair.reference))


def _noise_form(tails: float, fraction: float) -> str:
    # The fourth moment is 3 for a Gaussian, 1.8 for a uniform distribution.
    if fraction < 0.2:
        return f"in {number(100 * fraction, 2)} % of the pixels"
    if tails > MOST_GAUSSIAN:
        form, everywhere = "more in some places than in others", ""
    else:
        form, everywhere = "like a Gaussian" if tails >= 2.3 else "of even odds", " everywhere"
    return form + (everywhere if fraction > 0.95 else f" in {number(100 * fraction, 2)} % of the pixels")


def _is_correlated(window: Pair) -> bool:
    """True if neighbouring differences are correlated far beyond chance."""
    difference = window.difference / np.float32(window.largest)
    square = float(np.square(difference, dtype=np.float64).sum())
    return max(abs(_correlation(difference, *step)) for step in ((1, 0), (0, 1))) > _SURELY * square


def _correlation(difference: Pixels, down: int, right: int) -> float:
    """Sum of products of pixels and the pixels `down` rows and `right` columns away."""
    if right < 0:
        difference, right = difference[:, ::-1], -right
    height, width = difference.shape[:2]
    one, two = difference[: height - down, : width - right], difference[down:, right:]
    return float(np.einsum("hwc,hwc->", one, two, dtype=np.float64))
