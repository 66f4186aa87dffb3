"""Levels: a picture with few values, because it was stored in 8 bits or half floats.

A picture is *quantised* if all its values are (k + o) / n, o = 0 or 1/2, in linear light or encoded as sRGB,
premultiplied or straight. Rounding the other picture in the same way then explains the difference.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import is_partial, srgb_decoded, srgb_encoded, straight
from texvol.comparison.kinds.kind import Change, Finding, Kind, number
from texvol.comparison.kinds.pair import SIDES, Pair, other

# Steps of number formats: 2^bits - 1, and 2^bits of fixed point.
_STEPS = sorted({2**bits - 1 for bits in range(1, 17)} | {2**bits for bits in range(2, 11)})
# Largest distance of a value from a level, in steps. Encoding and multiplying in float32 moves values by about 2^-22.
_TOLERANCE, _ROUNDING = 1e-3, 2.0**-21
# Largest probability of chance: m different values all lie within t of a level with probability (2 t)^m.
_CHANCE = 1e-5
_VALUES = 4096
_LEAST_OPACITY = 0.1  # straight colour of smaller opacity has few digits
_MOST_DISTINCT = 300  # a picture of 8 bits has fewer values, one of more bits has more
# A dozen slabs, each rounded to half a step, are a few steps off.
_MOST_OFF, _FEWEST_STEPS = 3.0, 31
_AS_COARSE = 0.1  # of the other picture's rounding; a finer lattice makes no difference
_MOST_OF_HALF = 1023  # steps; a finer lattice near 1 is that of half floats


@dataclass(frozen=True)
class Lattice:
    """Values of a quantised picture: (k + offset) / steps of its colour, and k / opacity_steps of its opacity.

    Steps of 0: that part is not quantised. Half floats are no lattice; they have 11 significant bits.
    """

    steps: int
    offset: float = 0.0
    is_srgb: bool = False
    is_straight: bool = False
    opacity_steps: int = 0
    is_half: bool = False

    @property
    def words(self) -> str:
        """Parts of the picture that are quantised, and their levels."""
        if self.is_half:
            return "half floats (11 bits)"
        bits = np.log2(self.steps + 1) if self.steps else 0
        known = f" ({bits:.0f} bits)" if bits and bits == int(bits) else ""
        encoding = " of the sRGB encoding" if self.is_srgb else ", linear"
        colour = f"{self.steps} steps{known}{encoding}{', straight' * self.is_straight}" if self.steps else ""
        opacity = f"{self.opacity_steps} steps of opacity" if self.opacity_steps not in (0, self.steps) else ""
        return " and ".join(filter(None, (colour, opacity)))

    def in_steps(self, pixels: NDArray) -> NDArray:
        """Return the colour (…, 3) of premultiplied pixels, in the numbers that were rounded."""
        color = straight(pixels) if self.is_straight else pixels[..., :3]
        return (srgb_encoded(color) if self.is_srgb else color) * self.steps

    def rounded(self, pixels: NDArray, mode: str) -> NDArray:
        """Round premultiplied pixels (…, 4) to this lattice."""
        if self.is_half:
            return _to_half(pixels)
        done = np.array(pixels, copy=True)
        if self.opacity_steps:
            done[..., 3] = np.rint(pixels[..., 3] * self.opacity_steps) / self.opacity_steps
        if self.steps:
            step: np.ufunc = getattr(np, mode)
            color = (step(self.in_steps(pixels) - self.offset) + self.offset) / self.steps
            color = np.clip(color, 0, 1) if self.is_straight else color  # largest value of a file of straight colour
            color = srgb_decoded(color) if self.is_srgb else color
            done[..., :3] = color * done[..., 3:] if self.is_straight else color
        return done

    def distance(self, pair: Pair) -> NDArray:
        """Return the distance of the two pictures in steps, (height, width)."""
        if self.is_half:
            largest = np.maximum(np.abs(pair.candidate), np.abs(pair.reference))
            # Half floats below 2^-14 have even steps.
            spacing = np.exp2(np.floor(np.log2(np.maximum(largest, 2.0**-14)))) * 2.0**-10
            return (np.abs(pair.difference) / spacing).max(axis=2)
        parts = []
        if self.steps:
            apart = np.abs(self.in_steps(pair.candidate) - self.in_steps(pair.reference)).max(axis=2)
            opacity = np.maximum(pair.candidate[..., 3], pair.reference[..., 3])
            parts.append(apart * opacity if self.is_straight else apart)
        if self.opacity_steps:
            parts.append(np.abs(pair.difference[..., 3]) * self.opacity_steps)
        return np.maximum.reduce(parts)


def lattice_of(pixels: NDArray, has_opacity: bool) -> Lattice | None:
    """Return the coarsest lattice that holds all pixels; None if there is none."""
    found = _even_lattice(pixels, has_opacity)
    if (found is None or max(found.steps, found.opacity_steps) > _MOST_OF_HALF) and _is_half(pixels):
        return Lattice(0, is_half=True)
    return found


def _even_lattice(pixels: NDArray, has_opacity: bool) -> Lattice | None:
    rows = pixels.reshape(-1, 4)
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), _VALUES)).astype(int)]
    opacity = _steps_of(rows[:, 3])[0] if has_opacity else 0
    seen = rows[rows[:, 3] > _LEAST_OPACITY]
    has_straight = has_opacity and is_partial(rows[:, 3])
    # Ratios of few levels are few, too: so straight colour is tried only if premultiplied colour has no lattice.
    for is_straight in (False, True) if has_straight else (False,):
        color = straight(seen) if is_straight else rows[:, :3]
        found = []
        for is_srgb in (False, True):
            steps, offset = _steps_of(srgb_encoded(color) if is_srgb else color)
            if steps:
                found.append(Lattice(steps, offset, is_srgb, is_straight, opacity))
        if found:
            return min(found, key=lambda each: each.steps)
    return Lattice(0, opacity_steps=opacity) if opacity else None


def _lattices(pair: Pair) -> dict[str, Lattice]:
    """Return the lattice of each side that has one."""
    found = {side: lattice_of(pair.of(side), pair.has_opacity) for side in SIDES}
    return {side: lattice for side, lattice in found.items() if lattice is not None}


def changes(pair: Pair) -> Iterator[Change]:
    """Yield the roundings of either picture that may explain the difference."""
    lattices = _lattices(pair)
    for side, lattice in lattices.items():
        if lattice != lattices.get(other(side)):
            for mode in ("rint",) if lattice.is_half else ("rint", "floor"):
                yield _change(side, lattice, mode)


def _is_half(pixels: NDArray) -> bool:
    """True if all values are half floats, and some of them use most bits."""
    part = pixels.reshape(-1)[:: max(pixels.size // _VALUES, 1)]
    return bool((_to_half(part) == part).all()) and len(np.unique(part)) > 2


def parameters(lattice: Lattice, side: str) -> dict[str, object]:
    """Return the lattice's parameters for a Kind."""
    if lattice.is_half:
        return {"quantised": side, "format": "half"}
    encoding = ("sRGB" if lattice.is_srgb else "linear") if lattice.steps else None
    color = "straight" if lattice.is_straight else "premultiplied"
    steps = lattice.steps or lattice.opacity_steps
    numbers = {"steps": steps, "levels": steps + 1, "opacity_steps": lattice.opacity_steps}
    return {"quantised": side, **numbers, "encoding": encoding, "color": color}


def _change(side: str, lattice: Lattice, mode: str) -> Change:
    down = ", downwards" if mode == "floor" else ""
    words = f"the {side} is quantised to {lattice.words}{down}"
    said = {**parameters(lattice, side), "rounding": "down" if mode == "floor" else "nearest"}
    return Change("banding", other(side), lambda pixels: lattice.rounded(pixels, mode), words, said, is_idempotent=True)


def _to_half(pixels: NDArray) -> NDArray:
    with np.errstate(over="ignore"):
        return pixels.astype(np.float16).astype(pixels.dtype)


def _steps_of(values: NDArray) -> tuple[int, float]:
    """Return the fewest steps, and the offset, of a lattice that holds all values; (0, 0) if there is none."""
    distinct = np.unique(values)
    distinct = distinct[(distinct > 1e-6) & (np.abs(distinct - 1) > 1e-6)].astype(np.float64)
    if len(distinct) < 2:
        return 0, 0.0
    # A few values exclude most lattices.
    few = distinct[np.linspace(0, len(distinct) - 1, min(len(distinct), 48)).astype(int)]
    steps = np.array(sorted({*_STEPS, *_from_gaps(distinct)}), np.float64)
    tolerance = _TOLERANCE + _ROUNDING * steps * max(1.0, float(distinct[-1]))
    likely = (2 * tolerance < 0.5) & (len(distinct) * -np.log(2 * tolerance) > -np.log(_CHANCE))
    offsets = np.array([0.0, 0.5])
    fits = _on_levels(few, steps, tolerance, offsets) & likely[:, np.newaxis]
    for i, j in np.argwhere(fits):
        if _on_levels(distinct, steps[[i]], tolerance[[i]], offsets[[j]])[0, 0]:
            return int(steps[i]), float(offsets[j])
    return 0, 0.0


def _on_levels(values: NDArray, steps: NDArray, tolerance: NDArray, offsets: NDArray) -> NDArray:
    """True for each number of steps and each offset if all but 2 % of the values lie on its levels."""
    numbers = values * steps[:, np.newaxis, np.newaxis] - offsets[:, np.newaxis]
    off = np.abs(numbers - np.rint(numbers))
    return (off < tolerance[:, np.newaxis, np.newaxis]).mean(axis=2) >= 0.98


def _from_gaps(distinct: NDArray) -> list[int]:
    """Numbers of steps that the gaps between neighbouring values suggest, for pictures of few values."""
    if len(distinct) > _MOST_DISTINCT:
        return []
    # Values that differ by rounding count once.
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-4]
    steps = round(1 / float(gaps.min())) if len(gaps) else 0
    return [steps] if steps >= 1 else []


def off_by_steps(pair: Pair, at_most: float) -> Finding | None:
    """Find a quantised picture that is a few steps off, as a sum of rounded terms is."""
    for side, lattice in _lattices(pair).items():
        if not (lattice.is_half or max(lattice.steps, lattice.opacity_steps) >= _FEWEST_STEPS):
            continue
        steps = lattice.distance(pair)
        most = float(steps.max())
        if float(np.sqrt(np.square(steps).mean())) <= _MOST_OFF and most <= at_most:
            steps_off = "a step" if f"{most:.2g}" == "1" else f"{most:.2g} steps"
            words = f"the {side} is quantised to {lattice.words}, and off by {steps_off} at most"
            said = {**parameters(lattice, side), "most_steps": most}
            return Finding(Kind("banding", 1.0, words, said), pair.with_side("candidate", pair.reference))
    return None


def within_formats(pair: Pair) -> Kind:
    """Return the kind of a difference within the number formats' rounding, named after the coarser format."""
    found = [
        (2**11 if lattice.is_half else lattice.steps or lattice.opacity_steps, side, lattice)
        for side, lattice in _lattices(pair).items()
    ]
    if not found:
        words = f"rounding: the number formats explain the difference, at most {number(pair.largest)}"
        return Kind("rounding", 1.0, words, {"largest": pair.largest})
    if pair.roundings is not None:  # only a picture that was rounded, not one that has few values anyway
        means = {side: float(np.mean(rounding)) for side, rounding in zip(SIDES, pair.roundings, strict=True)}
        found = [each for each in found if means[each[1]] >= _AS_COARSE * max(means.values())] or found
    steps, side, lattice = min(found, key=lambda each: each[:2])
    bits = "half floats" if lattice.is_half else f"{int(np.ceil(np.log2(steps + 0.5)))} bits"
    said = {**parameters(lattice, side), "largest": pair.largest}
    return Kind("banding", 1.0, f"within the rounding of {bits}", said)
