"""Tone curve: colour that is any function of the other picture's colour."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import Curve, is_partial, on_premultiplied, on_straight
from texvol.comparison.kinds.finding import Change
from texvol.comparison.kinds.pair import Pair

# Points of a curve, which follows an encoding to 1 %; and the fewest values for each point, or the curve follows noise.
_POINTS, _LEAST_EACH = 40, 25
_LEAST_OPACITY = 0.02  # straight colour of smaller opacity is mostly rounding


def changes(sample: Pair) -> Iterator[Change]:
    """Yield a curve from the reference's colour to the candidate's, without a formula."""
    hows: dict[str, tuple[str, bool]] = {"premultiplied": ("colour", False)}
    if sample.has_opacity and is_partial(sample.reference[..., 3]):
        hows["straight"] = ("straight colour", True)
    for how, (said, is_straight) in hows.items():
        reference, candidate = (sample.of(side)[..., :3].astype(np.float64) for side in ("reference", "candidate"))
        weights = np.broadcast_to(sample.pixel_weights[..., np.newaxis], reference.shape)
        if is_straight:
            seen = sample.reference[..., 3:] > _LEAST_OPACITY
            opacity = np.where(seen, sample.reference[..., 3:], 1)
            reference, candidate, weights = reference / opacity, candidate / opacity, weights * seen * opacity**2
        points = _curve_through(reference.ravel(), candidate.ravel(), weights.ravel())
        if points is None:
            continue
        applier = on_straight if is_straight else on_premultiplied
        words = f"the candidate's {said} is a function of the reference's, a curve that is no common encoding"
        shown = {"on": how, "from": points[0][::4].tolist(), "to": points[1][::4].tolist()}
        yield Change("tone curve", "reference", applier(_interpolated(*points)), words, shown, fitted=_POINTS)


def _curve_through(at: NDArray, value: NDArray, weights: NDArray) -> tuple[NDArray, NDArray] | None:
    """Means of `value` over bins of equal counts of `at`; None if there are too few pixels."""
    used = (weights > 0) & (at != 0)
    at, value, weights = at[used], value[used], weights[used]
    if len(at) < _LEAST_EACH * _POINTS:
        return None
    order = np.argsort(at, kind="stable")
    starts = np.linspace(0, len(at), _POINTS + 1).astype(int)[:-1]
    sums = [np.add.reduceat((weights * each)[order], starts) for each in (np.ones_like(at), at, value)]
    return (np.append(0, sums[1] / sums[0]), np.append(0, sums[2] / sums[0]))


def _interpolated(at: NDArray, value: NDArray) -> Curve:
    return lambda pixels: np.interp(pixels, at, value).astype(pixels.dtype)
