"""Levels: a picture that holds few values, because it went through 8 bits, half floats, or was posterised.

A picture is *quantised* where all its values are (k + o) / n, o = 0 or 1/2, in linear light or encoded as sRGB,
premultiplied or straight. Rounding the other picture in the same way explains the difference.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import is_partial, srgb_decoded, srgb_encoded, straight
from texvol.comparison.kinds.finding import Change, Finding
from texvol.comparison.kinds.kind import Kind, number, other
from texvol.comparison.kinds.pair import Pair

# Steps that number formats have: 2^bits - 1, and 2^bits of fixed point.
_STEPS = sorted({2**bits - 1 for bits in range(1, 17)} | {2**bits for bits in range(2, 11)})
# How far from a level a value may be, in steps. Encoding and multiplying in float32 moves it by some 2^-22 of itself.
_TOLERANCE, _ROUNDING = 1e-3, 2.0**-21
# Chance is held below this: m different values all lie within t of a level with probability (2 t)^m.
_CHANCE = 1e-5
_VALUES = 4096
_LEAST_OPACITY = 0.1  # straight colour of less has lost digits
_MOST_DISTINCT = 300  # values of a picture of 8 bits, and not of one of more
# Some dozen slabs, each rounded to half a step, are off by a few.
_MOST_OFF, _FEWEST_STEPS = 3.0, 31
_AS_COARSE = 0.1  # of the other picture's rounding: less made no difference
_MOST_OF_HALF = 1023  # steps; more of them near 1 are those of half floats


@dataclass(frozen=True)
class Lattice:
    """Which values a picture holds: (k + offset) / steps of its colour, and k / opacity_steps of its opacity.

    0 steps: that part is not quantised. Half floats are no lattice, and have 11 bits of their own size.
    """

    steps: int
    offset: float = 0.0
    is_srgb: bool = False
    is_straight: bool = False
    opacity_steps: int = 0
    is_half: bool = False

    @property
    def words(self) -> str:
        """What lies on which levels."""
        if self.is_half:
            return "half floats (11 bits)"
        bits = np.log2(self.steps + 1) if self.steps else 0
        known = f" ({bits:.0f} bits)" if bits and bits == int(bits) else ""
        encoding = " of the sRGB encoding" if self.is_srgb else ", linear"
        colour = f"{self.steps} steps{known}{encoding}{', straight' * self.is_straight}" if self.steps else ""
        opacity = f"{self.opacity_steps} steps of opacity" if self.opacity_steps not in (0, self.steps) else ""
        return " and ".join(filter(None, (colour, opacity)))

    def in_steps(self, pixels: NDArray) -> NDArray:
        """Colour (…, 3) of premultiplied pixels as the numbers that were rounded."""
        color = straight(pixels) if self.is_straight else pixels[..., :3]
        return (srgb_encoded(color) if self.is_srgb else color) * self.steps

    def rounded(self, pixels: NDArray, mode: str = "rint") -> NDArray:
        """Premultiplied pixels (…, 4) whose numbers are this lattice's."""
        if self.is_half:
            return _to_half(pixels)
        done = np.array(pixels, copy=True)
        if self.opacity_steps:
            done[..., 3] = np.rint(pixels[..., 3] * self.opacity_steps) / self.opacity_steps
        if self.steps:
            step: np.ufunc = getattr(np, mode)
            color = (step(self.in_steps(pixels) - self.offset) + self.offset) / self.steps
            color = np.clip(color, 0, 1) if self.is_straight else color  # files of straight colour can't hold more
            color = srgb_decoded(color) if self.is_srgb else color
            done[..., :3] = color * done[..., 3:] if self.is_straight else color
        return done

    def distance(self, pair: Pair) -> NDArray:
        """How many steps apart the pixels are, (height, width)."""
        if self.is_half:
            largest = np.maximum(np.abs(pair.candidate), np.abs(pair.reference))
            # Below 2^-14 the steps of half floats are even.
            spacing = np.exp2(np.floor(np.log2(np.maximum(largest, 2.0**-14)))) * 2.0**-10
            return (np.abs(pair.difference) / spacing).max(axis=2)
        parts = []
        if self.steps:
            apart = np.abs(self.in_steps(pair.candidate) - self.in_steps(pair.reference)).max(axis=2)
            parts.append(
                apart * np.maximum(pair.candidate[..., 3], pair.reference[..., 3]) if self.is_straight else apart
            )
        if self.opacity_steps:
            parts.append(np.abs(pair.difference[..., 3]) * self.opacity_steps)
        return np.maximum.reduce(parts)


def lattice_of(pixels: NDArray, has_opacity: bool) -> Lattice | None:
    """The lattice that all pixels lie on, the coarsest one; None where there is none."""
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
    # Ratios of few levels are few as well: straight colour is looked at where colour as it stands is on no levels.
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


def changes(pair: Pair) -> Iterator[Change]:
    """Roundings that could have happened to one of the two pictures."""
    for side in ("candidate", "reference"):
        lattice = lattice_of(pair.of(side), pair.has_opacity)
        if lattice is not None and lattice != lattice_of(pair.of(other(side)), pair.has_opacity):
            for mode in ("rint",) if lattice.is_half else ("rint", "floor"):
                yield _change(side, lattice, mode)


def _is_half(pixels: NDArray) -> bool:
    """Whether all values are half floats, and not all of them those of few bits."""
    part = pixels.reshape(-1)[:: max(pixels.size // _VALUES, 1)]
    return bool((_to_half(part) == part).all()) and len(np.unique(part)) > 2


def parameters(lattice: Lattice, side: str) -> dict[str, object]:
    """The lattice's numbers."""
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
    """The fewest steps, and the offset, on which all the values lie; (0, 0) where there are none."""
    distinct = np.unique(values)
    distinct = distinct[(distinct > 1e-6) & (np.abs(distinct - 1) > 1e-6)].astype(np.float64)
    if len(distinct) < 2:
        return 0, 0.0
    # A few values rule most lattices out.
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
    """Whether the values lie on the levels, for each number of steps and each offset; one in fifty is let off."""
    numbers = values * steps[:, np.newaxis, np.newaxis] - offsets[:, np.newaxis]
    off = np.abs(numbers - np.rint(numbers))
    return (off < tolerance[:, np.newaxis, np.newaxis]).mean(axis=2) >= 0.98


def _from_gaps(distinct: NDArray) -> list[int]:
    """Steps that the distance of neighbouring values suggests, for pictures of few values."""
    if len(distinct) > _MOST_DISTINCT:
        return []
    # Values that differ by rounding are one.
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-4]
    steps = round(1 / float(gaps.min())) if len(gaps) else 0
    return [steps] if steps >= 1 else []


def off_by_steps(pair: Pair, at_most: float) -> Finding | None:
    """A quantised picture that is a few steps off, as a sum is whose parts were rounded one by one."""
    for side in ("candidate", "reference"):
        lattice = lattice_of(pair.of(side), pair.has_opacity)
        if lattice is None or not (lattice.is_half or max(lattice.steps, lattice.opacity_steps) >= _FEWEST_STEPS):
            continue
        steps = lattice.distance(pair)
        most = float(steps.max())
        if float(np.sqrt(np.square(steps).mean())) <= _MOST_OFF and most <= at_most:
            steps_off = "a step" if f"{most:.2g}" == "1" else f"{most:.2g} steps"
            words = f"the {side} is quantised to {lattice.words}, and off by {steps_off} at most"
            said = {**parameters(lattice, side), "most_steps": most}
            return Finding(Kind("banding", 1.0, words, said), pair.with_side("candidate", pair.reference), 1)
    return None


def within_formats(pair: Pair) -> Kind:
    """A difference that the number formats explain, named after the coarser of them."""
    found: list[tuple[int, str, Lattice]] = []
    for side in ("candidate", "reference"):
        lattice = lattice_of(pair.of(side), pair.has_opacity)
        if lattice is not None:
            found.append((2**11 if lattice.is_half else lattice.steps or lattice.opacity_steps, side, lattice))
    if not found:
        words = f"rounding: within what the number formats explain, {number(pair.largest)} at most"
        return Kind("rounding", 1.0, words, {"largest": pair.largest})
    if pair.roundings is not None:  # what was rounded, and not what held few values before
        means = {side: float(np.mean(pair.roundings[side == "reference"])) for side in ("candidate", "reference")}
        found = [each for each in found if means[each[1]] >= _AS_COARSE * max(means.values())] or found
    steps, side, lattice = min(found, key=lambda each: each[:2])
    bits = "half floats" if lattice.is_half else f"{int(np.ceil(np.log2(steps + 0.5)))} bits"
    said = {**parameters(lattice, side), "largest": pair.largest}
    return Kind("banding", 1.0, f"within the rounding of {bits}", said)
