"""Geometry: a picture that is shifted, also by parts of a pixel, or turned or mirrored."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds import registration
from texvol.comparison.kinds.isolated import isolated
from texvol.comparison.kinds.kind import Finding, Kind, goes_with
from texvol.comparison.kinds.noise import noise
from texvol.comparison.kinds.pair import GREY, Pair, Pixels

_LEAST_SHIFT = 0.002  # pixels; smaller shifts look like other small differences
# Hard outlines jump by whole pixels, which no interpolation undoes; means over 8×8 pixels average the jumps to the
# shift. So undoing the shift must remove most of the difference of the means, and some of the difference.
_MEANS_OVER = 8
_LEAST_OF_MEANS, _LEAST_OF_ALL = 0.8, 0.1
_MOST = 0.8
# A large shift may hide the differing pixels: the overlap that is left has to be equal.
_FAR, _MOST_FAR = 0.1, 0.95
_IN_HUNDREDTHS = 0.02  # pixels; smaller shifts are given in thousandths
_LEAST_SEEN = 0.5  # of the difference that the overlap would have if the difference were even
_ALONE, _SURELY, _LEAST_OF_WINDOW = 0.5, 0.9999, 0.02

_FLIPS: dict[str, tuple[str, Callable[[NDArray], NDArray]]] = {
    "up-down": ("upside down (rows in reverse order)", lambda p: p[::-1]),
    "left-right": ("mirrored left to right", lambda p: p[:, ::-1]),
    "turned 180°": ("turned by half a turn", lambda p: p[::-1, ::-1]),
    "transposed": ("transposed (rows and columns exchanged)", lambda p: p.swapaxes(0, 1)),
    "turned 90°": ("turned by a quarter to the left", lambda p: p.swapaxes(0, 1)[::-1]),
    "turned 270°": ("turned by a quarter to the right", lambda p: p.swapaxes(0, 1)[:, ::-1]),
    "transposed, turned 180°": ("transposed along the other diagonal", lambda p: p[::-1, ::-1].swapaxes(0, 1)),
}


def flips(pair: Pair) -> Iterator[Finding]:
    """Yield a finding for each turned or mirrored reference that explains most of the difference."""
    width, height = pair.size
    for name, (words, turn) in _FLIPS.items():
        if width != height and name.startswith(("transposed", "turned 90", "turned 270")):
            continue
        turned = turn(pair.reference)
        if not _may_match(pair, turned):
            continue
        rounding = pair.rounding_of("reference")
        left = pair.with_side("reference", np.ascontiguousarray(turned), None if rounding is None else turn(rounding))
        explained = pair.explained_by(left)
        if explained > 0:
            yield Finding(Kind("flipped", explained, f"the candidate is {words}", {"how": name}), left)


def shift(pair: Pair) -> Finding | None:
    """Find a shift of the candidate against the reference that explains most of the difference."""
    if min(pair.size) < 4:
        return None
    grey = pair.candidate @ GREY, pair.reference @ GREY
    if not all(float(np.ptp(each)) > 0 for each in grey):
        return None
    dx, dy = registration.estimate(*grey)
    of_size = max(abs(dx) / pair.size[0], abs(dy) / pair.size[1])
    if max(abs(dx), abs(dy)) < _LEAST_SHIFT or of_size > 0.5:
        return None
    seen = _without_shift(pair, dx, dy)
    if seen is None:
        return None
    before, left = seen
    is_far = of_size > _FAR
    # A shift that only leaves out the differing pixels explains nothing.
    if is_far and _seen_of_difference(pair, before, dx, dy) < _LEAST_SEEN * before.energy.size / pair.energy.size:
        return None
    explained = before.explained_by(left)
    of_means = 1 - _tiled(left.difference) / max(_tiled(before.difference), 1e-300)
    jumps = max(abs(dx), abs(dy)) <= 1 and explained >= _LEAST_OF_ALL and of_means >= _LEAST_OF_MEANS
    fits = explained >= (_MOST_FAR if is_far else _MOST) or jumps
    # Undoing the shift of a correlated difference may leave noise.
    if not fits and (is_far or not goes_with(before, left) or noise(before) is not None or noise(left) is None):
        return None
    parameters = {"dx": dx, "dy": dy, "explained_of_means": of_means}
    return Finding(Kind("shifted", explained, _words(dx, dy), parameters), left)


def _seen_of_difference(pair: Pair, before: Pair, dx: float, dy: float) -> float:
    """Return the smallest fraction of the squared difference that lies in the compared pixels of either picture."""
    left, top = before.corner[0] - pair.corner[0], before.corner[1] - pair.corner[1]
    width, height = before.size
    fractions = []
    for sign in (0, 1, -1):  # in place, and at the sources of the moved picture's pixels, for either sign
        x, y = left + sign * round(dx), top + sign * round(dy)
        if x >= 0 and x + width <= pair.size[0] and y >= 0 and y + height <= pair.size[1]:
            energy = pair.energy[y : y + height, x : x + width].sum(dtype=np.float64)
            fractions.append(float(energy / pair.energy.sum(dtype=np.float64)))
    return min(fractions)


def _words(dx: float, dy: float) -> str:
    digits = 2 if max(abs(dx), abs(dy)) >= _IN_HUNDREDTHS else 3
    pixels = f"({round(dx, digits) + 0.0:+.{digits}f}, {round(dy, digits) + 0.0:+.{digits}f})"  # + 0: no -0
    ways = ("right" if dx > 0 else "left", dx), ("down" if dy > 0 else "up", dy)
    said = [word for word, by in ways if round(abs(by), digits) > 0]
    return f"the candidate is shifted by {pixels} pixels, {' and '.join(said) or 'hardly'} (x to the right, y down)"


def _without_shift(pair: Pair, dx: float, dy: float) -> tuple[Pair, Pair] | None:
    """Return the overlap of both pictures as it is, and with the shift undone by the interpolation that undoes most.

    Interpolation softens, so the picture that was softened already stays, and the other picture is moved. Interpolation
    also smears a wrong pixel: if one picture has an isolated pixel, that picture was not moved.
    """
    directions = [
        (taps, side) for taps in {registration.taps_for(pair.size): 0, 2: 0} for side in ("reference", "candidate")
    ]
    best, best_explained = directions[0], -np.inf
    for direction in directions:
        moved = _moved(pair.window, dx, dy, *direction)
        if moved is None:
            continue
        explained = moved[0].explained_by(moved[1])
        alone = isolated(moved[1])
        if alone is not None and alone.kind.explained > _ALONE:
            explained = 1.0
        if explained > best_explained:
            best, best_explained = direction, explained
        if explained > _SURELY:
            break
    return _moved(pair, dx, dy, *best) if best_explained > _LEAST_OF_WINDOW else None


def _moved(pair: Pair, dx: float, dy: float, taps: int, side: str) -> tuple[Pair, Pair] | None:
    """Return the overlap as it is, and with one side moved onto the other."""
    sign = 1 if side == "reference" else -1
    moved, (rows, columns) = registration.shifted(pair.of(side), sign * dx, sign * dy, taps)
    if min(moved.shape[:2]) < 2:
        return None
    before = pair.part(rows, columns)
    return before, before.with_side(side, moved)


def _tiled(difference: Pixels) -> float:
    """Return the squared difference of the means of tiles."""
    height, width = difference.shape[:2]
    side = min(_MEANS_OVER, height, width)
    rows, columns = height // side, width // side
    tiles = difference[: rows * side, : columns * side].reshape(rows, side, columns, side, -1)
    return float(np.square(tiles.mean(axis=(1, 3), dtype=np.float64)).sum())


def _may_match(pair: Pair, turned: NDArray) -> bool:
    """True if a coarse grid of pixels fits better with the turn than without: a cheap first test."""
    step = max(1, min(pair.size) // 64)
    candidate, before, after = (each[::step, ::step] for each in (pair.candidate, pair.reference, turned))
    return bool(np.square(candidate - after).sum() < 0.7 * np.square(candidate - before).sum())
