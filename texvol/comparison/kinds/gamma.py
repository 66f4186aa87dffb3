"""Gamma: one picture is encoded, or raised to a power, and the other is linear.

    candidate = encode(reference)          premultiplied, c → f(c)
    candidate = A · encode(reference / A)  straight, c → A f(c / A)

and both with candidate and reference exchanged. f is the sRGB encoding, once or twice, or a power c^p.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from texvol.comparison.kinds.encodings import (
    Curve,
    is_partial,
    on_all,
    on_premultiplied,
    on_straight,
    srgb_decoded,
    srgb_encoded,
    straight,
    to_the_power,
)
from texvol.comparison.kinds.finding import Change
from texvol.comparison.kinds.fitting import least
from texvol.comparison.kinds.kind import number, other
from texvol.comparison.kinds.pair import Pair

_LEAST_POWER = 1 / 7  # encoded twice with gamma 2.6, the largest in use
_AROUND = 1.5  # factor around the first guess of a power
_ROUND_GAMMA = 2.2  # power law that is mistaken for sRGB
_ONE_POWER = 0.01  # smallest distance of a power from 1


def changes(sample: Pair) -> Iterator[Change]:
    """Yield the changes of encoding that may explain a sample's difference."""
    applied = {"premultiplied": on_premultiplied}
    if sample.has_opacity:
        if is_partial(sample.reference[..., 3]) or is_partial(sample.candidate[..., 3]):
            applied["straight"] = on_straight
        applied["all channels"] = on_all
    for how, applier in applied.items():
        for side in ("candidate", "reference"):
            yield from _srgb(sample, side, how, applier)
        if how != "all channels":
            yield from _srgb_for_power(sample, how, applier)
        yield from _power(sample, how, applier)


def _srgb(sample: Pair, encoded: str, how: str, applier: Any) -> Iterator[Change]:
    """Picture `encoded` is encoded as sRGB, and the other picture is linear."""
    linear = other(encoded)
    top = float(sample.of(encoded)[..., :3].max(initial=0))
    cuts = (False, True) if top <= 1 < sample.of(linear)[..., :3].max(initial=0) else (False,)
    for times in (1, 2):
        for cut in cuts:
            curve = _repeated(srgb_encoded, times, cut)
            parameters = {"function": "sRGB", "times": times, "encoded": encoded, "on": how, "cut": cut}
            words = f"the {encoded} is encoded as sRGB{' twice' * (times == 2)}, {_ON[how]}, and the {linear} is linear"
            words += ", and what is over 1 is cut" * cut
            yield Change("gamma", linear, applier(curve), words, parameters)


def _srgb_for_power(sample: Pair, how: str, applier: Any) -> Iterator[Change]:
    """One picture was encoded with gamma 2.2 and decoded as sRGB."""
    for side in ("candidate", "reference"):

        def curve(values: Any) -> Any:
            return srgb_decoded(to_the_power(1 / _ROUND_GAMMA)(values))

        words = f"the {side} is encoded with gamma {_ROUND_GAMMA}, {_ON[how]}, where the {other(side)} is sRGB"
        parameters = {"function": "power for sRGB", "gamma": _ROUND_GAMMA, "encoded": side, "on": how}
        yield Change("gamma", other(side), applier(curve), words, parameters)


def _power(sample: Pair, how: str, applier: Any) -> Iterator[Change]:
    """The candidate is a power of the reference; the encoded picture is compared with the other one encoded."""
    start = _first_power(sample, how)
    if start is None:
        return
    encoded, linear = ("candidate", "reference") if start < 1 else ("reference", "candidate")
    start = min(start, 1 / start)

    def cost(exponent: float) -> float:
        return sample.with_side(linear, applier(to_the_power(exponent))(sample.of(linear))).total

    power = least(cost, max(start / _AROUND, _LEAST_POWER), min(start * _AROUND, 1.0), tries=5)
    if abs(np.log(power)) < _ONE_POWER:
        return
    exponent = power if encoded == "candidate" else 1 / power
    words = f"the {encoded} is encoded with gamma {number(1 / power)}, {_ON[how]}, and the {linear} is linear"
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


_ON = {
    "premultiplied": "on premultiplied colour",
    "straight": "on straight colour",
    "all channels": "opacity included",
}


def _repeated(curve: Curve, times: int, cut: bool) -> Curve:
    def repeated(values: Any) -> Any:
        values = np.clip(values, 0, 1) if cut else values
        for _ in range(times):
            values = curve(values)
        return values

    return repeated
