"""Functions of colour: one picture is encoded, or raised to a power, and the other is linear; or any tone curve.

    candidate = f(reference)          premultiplied, c → f(c)
    candidate = A · f(reference / A)  straight, c → A f(c / A)

and both with candidate and reference exchanged. f is the sRGB encoding, once or twice, a power c^p, or a curve
of means.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import (
    Curve,
    is_partial,
    on_premultiplied,
    on_straight,
    srgb_decoded,
    srgb_encoded,
    straight,
    to_the_power,
)
from texvol.comparison.kinds.fitting import least
from texvol.comparison.kinds.kind import Change, number
from texvol.comparison.kinds.pair import SIDES, Pair, other

_LEAST_POWER = 1 / 7  # encoded twice with gamma 2.6, the largest in use
_AROUND = 1.5  # factor around the first guess of a power
_ROUND_GAMMA = 2.2  # power law that is mistaken for sRGB
_ONE_POWER = 0.01  # smallest distance of a power from 1
# Points of a curve, which follows an encoding to 1 %; and the fewest values for each point, or the curve follows noise.
_POINTS, _LEAST_EACH = 40, 25
_LEAST_OPACITY = 0.02  # straight colour of smaller opacity is mostly rounding
_APPLIED: dict[str, tuple[str, Callable[[Curve], Curve]]] = {
    "premultiplied": ("on premultiplied colour", on_premultiplied),
    "straight": ("on straight colour", on_straight),
    "all channels": ("opacity included", lambda curve: curve),
}


def changes(sample: Pair) -> Iterator[Change]:
    """Yield the changes of encoding that may explain a sample's difference."""
    hows = ["premultiplied"]
    if sample.has_opacity:
        partial = is_partial(sample.reference[..., 3]) or is_partial(sample.candidate[..., 3])
        hows += ["straight", "all channels"] if partial else ["all channels"]
    for how in hows:
        for side in SIDES:
            yield from _srgb(sample, side, how)
        if how != "all channels":
            yield from _srgb_for_power(how)
        yield from _power(sample, how)


def _srgb(sample: Pair, encoded: str, how: str) -> Iterator[Change]:
    """Picture `encoded` is encoded as sRGB, and the other picture is linear."""
    linear, (on, applier) = other(encoded), _APPLIED[how]
    top = float(sample.of(encoded)[..., :3].max(initial=0))
    cuts = (False, True) if top <= 1 < sample.of(linear)[..., :3].max(initial=0) else (False,)
    for times in (1, 2):
        for cut in cuts:
            curve = _repeated(srgb_encoded, times, cut)
            parameters = {"function": "sRGB", "times": times, "encoded": encoded, "on": how, "cut": cut}
            words = f"the {encoded} is encoded as sRGB{' twice' * (times == 2)}, {on}, and the {linear} is linear"
            words += ", and what is over 1 is cut" * cut
            yield Change("gamma", linear, applier(curve), words, parameters)


def _srgb_for_power(how: str) -> Iterator[Change]:
    """One picture was encoded with gamma 2.2 and decoded as sRGB."""
    on, applier = _APPLIED[how]

    def curve(values: NDArray) -> NDArray:
        return srgb_decoded(to_the_power(1 / _ROUND_GAMMA)(values))

    for side in SIDES:
        words = f"the {side} is encoded with gamma {_ROUND_GAMMA}, {on}, where the {other(side)} is sRGB"
        parameters = {"function": "power for sRGB", "gamma": _ROUND_GAMMA, "encoded": side, "on": how}
        yield Change("gamma", other(side), applier(curve), words, parameters)


def _power(sample: Pair, how: str) -> Iterator[Change]:
    """The candidate is a power of the reference; the encoded picture is compared with the other one encoded."""
    start = _first_power(sample, how)
    if start is None:
        return
    encoded, linear = ("candidate", "reference") if start < 1 else ("reference", "candidate")
    start = min(start, 1 / start)
    on, applier = _APPLIED[how]

    def cost(exponent: float) -> float:
        return sample.with_side(linear, applier(to_the_power(exponent))(sample.of(linear))).total

    power = least(cost, max(start / _AROUND, _LEAST_POWER), min(start * _AROUND, 1.0), tries=5)
    if abs(np.log(power)) < _ONE_POWER:
        return
    exponent = power if encoded == "candidate" else 1 / power
    words = f"the {encoded} is encoded with gamma {number(1 / power)}, {on}, and the {linear} is linear"
    words += f" (the candidate is the reference to the power {number(exponent)})"
    parameters = {"function": "power", "exponent": exponent, "gamma": 1 / power, "encoded": encoded, "on": how}
    yield Change("gamma", linear, applier(to_the_power(power)), words, parameters, fitted=1)


def _first_power(sample: Pair, how: str) -> float | None:
    """Median of log(candidate) / log(reference) over values that are not near 0 or 1."""
    one, two = (straight(each) if how == "straight" else each[..., :3] for each in (sample.candidate, sample.reference))
    used = (np.minimum(one, two) > 0.01) & (np.maximum(one, two) < 0.95)
    if not used.any():
        return None
    return float(np.clip(np.median(np.log(one[used]) / np.log(two[used])), _LEAST_POWER, 1 / _LEAST_POWER))


def _repeated(curve: Curve, times: int, cut: bool) -> Curve:
    def repeated(values: NDArray) -> NDArray:
        values = np.clip(values, 0, 1) if cut else values
        for _ in range(times):
            values = curve(values)
        return values

    return repeated


def tone_curves(sample: Pair) -> Iterator[Change]:
    """Yield a curve from the reference's colour to the candidate's, without a formula."""
    hows = {"premultiplied": "colour"}
    if sample.has_opacity and is_partial(sample.reference[..., 3]):
        hows["straight"] = "straight colour"
    for how, said in hows.items():
        reference, candidate = (sample.of(side)[..., :3].astype(np.float64) for side in ("reference", "candidate"))
        weights = np.broadcast_to(sample.pixel_weights[..., np.newaxis], reference.shape)
        if how == "straight":
            seen = sample.reference[..., 3:] > _LEAST_OPACITY
            opacity = np.where(seen, sample.reference[..., 3:], 1)
            reference, candidate, weights = reference / opacity, candidate / opacity, weights * seen * opacity**2
        points = _curve_through(reference.ravel(), candidate.ravel(), weights.ravel())
        if points is None:
            continue
        curve = _APPLIED[how][1](_interpolated(*points))
        words = f"the candidate's {said} is a function of the reference's, a curve that is no common encoding"
        shown = {"on": how, "from": points[0][::4].tolist(), "to": points[1][::4].tolist()}
        yield Change("tone curve", "reference", curve, words, shown, fitted=_POINTS)


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
