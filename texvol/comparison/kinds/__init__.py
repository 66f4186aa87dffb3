"""Kinds of difference between two pictures, found from the pictures alone.

Each kind is a hypothesis; a hypothesis explains a difference if undoing the hypothesis removes most of the squared
difference. `selection` tries the hypotheses, cheap ones first; each other module holds one family.

    levels, posterised      banding: 8 bits, half floats, few levels
    gamma                   encoded colour where the other picture is linear, any tone curve
    opacity                 other slab thickness, straight colour, other background
    light                   brightness, exchanged channels, cut values
    geometry                shifted (by `registration`), turned or mirrored
    order                   front and back exchanged
    isolated, noise, edges, end_slabs    recognised by their traits
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.comparison.kinds import levels, posterised, selection
from texvol.comparison.kinds.kind import NAMES, Kind, number
from texvol.comparison.kinds.pair import Pair
from texvol.util.errors import InputError

__all__ = ["NAMES", "Kind", "kinds_of"]

# Sums of squared roundings scatter. Of two rounded pictures that differ by a twentieth of a step, a twentieth of the
# pixels differs.
_OF_FLOOR, _OF_STEP = 1.05, 0.05


def kinds_of(
    candidate: NDArray,
    reference: NDArray,
    *,
    has_opacity: bool = True,
    roundings: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
) -> tuple[Kind, ...]:
    """Return the kinds of difference, best explanation first, at most three; empty for equal pictures.

    Each kind after the first explains the difference that the kinds before it leave; a kind whose words begin with "or"
    explains as much as the kind before it. Differences of a millionth of the largest value, as sums in float32 leave
    them, are of kind "rounding".

    Parameters
    ----------
    candidate, reference : arrays of shape (height, width, 4)
        Premultiplied, linear.
    has_opacity : bool
        True if both have an opacity; otherwise the fourth channel is ignored.
    roundings : pair of float or array that broadcasts to the pictures
        Half a step of the candidate's and of the reference's number format. A difference that is nowhere larger than
        both together is banding or rounding, unless the difference follows the content, as that of a shift does.

    Raises
    ------
    InputError
        If the arrays are not two pictures of one size.
    """
    candidate, reference = np.asarray(candidate), np.asarray(reference)
    if candidate.shape != reference.shape or candidate.ndim != 3 or candidate.shape[2] != 4 or candidate.size == 0:
        raise InputError(
            f"candidate and reference must have one shape (height, width, 4), got {candidate.shape}, {reference.shape}"
        )
    pair, broken = _finite_pair(candidate, reference, has_opacity)
    found = [broken] if broken is not None else []
    if pair.largest == 0:
        return tuple(found)
    if pair.is_rounding:
        words = f"rounding: differences of at most {number(pair.largest)}, as in sums of float32"
        return (*found, Kind("rounding", 1.0, words, {"largest": pair.largest}))
    if any(map(np.any, roundings)):
        shape = pair.candidate.shape
        one, two = (np.broadcast_to(np.asarray(each, np.float32), shape) for each in roundings)
        pair = replace(pair, roundings=(np.nan_to_num(one, posinf=0.0), np.nan_to_num(two, posinf=0.0)))
    if pair.is_within_allowance:
        return (*found, *(_systematic(pair) or [levels.within_formats(pair)]))[: selection.MOST_KINDS]
    return (*found, *selection.explain(pair))[: selection.MOST_KINDS]


def _systematic(pair: Pair) -> list[Kind]:
    """Return the kinds that explain a difference which rounding alone could, but probably did not, make."""
    if pair.total <= _OF_FLOOR * pair.floor or _mean_difference(pair) < _OF_STEP:
        return []
    few = posterised.posterised(pair)
    if few is not None:
        return [few.kind]
    lattices = [change for change in levels.changes(pair) if pair.all_explained_by(change.undone(pair)) > 1 - _OF_STEP]
    return [] if lattices else selection.explain_systematic(pair)


def _mean_difference(pair: Pair) -> float:
    """Return the difference δ before rounding, in steps of 2q; infinite if only one picture was rounded.

    If both were rounded, a fraction δ / 2q of the pixels differs by a step: mean d² = 2qδ.
    """
    assert pair.roundings is not None
    if not all(each.any() for each in pair.roundings):
        return np.inf
    allowance = pair.roundings[0] + pair.roundings[1]
    step = np.square(allowance, dtype=np.float64)
    counted = allowance > 0
    return float(np.square(pair.difference[counted], dtype=np.float64).sum() / step[counted].sum())


def _finite_pair(candidate: NDArray, reference: NDArray, has_opacity: bool) -> tuple[Pair, Kind | None]:
    """Return the pair in float32, equal where a picture is not finite, and the kind of pixels that are not finite."""
    with np.errstate(over="ignore"):
        pictures = {"candidate": np.asarray(candidate, np.float32), "reference": np.asarray(reference, np.float32)}
    if not has_opacity:
        one = np.ones((*candidate.shape[:2], 1), np.float32)
        pictures = {side: np.concatenate([each[..., :3], one], axis=2) for side, each in pictures.items()}
    not_finite = {side: ~np.isfinite(each).all(axis=2) for side, each in pictures.items()}
    broken = np.any(list(not_finite.values()), axis=0)
    if not broken.any():
        return Pair(pictures["candidate"], pictures["reference"], has_opacity), None
    row, column = divmod(int(broken.argmax()), broken.shape[1])
    counts = {side: int(each.sum()) for side, each in not_finite.items()}
    nan, infinite = (any(is_(each[broken]).any() for each in pictures.values()) for is_ in (np.isnan, np.isinf))
    what = " and ".join(["NaN"] * nan + ["infinity"] * infinite)
    parts = [f"{count} pixel{'s' * (count != 1)} of the {side}" for side, count in counts.items() if count]
    words = f"not finite ({what}): {' and '.join(parts)}; the first is at column {column}, row {row}"
    parameters = {"pixels": int(broken.sum()), **counts, "first": [column, row], "nan": nan, "infinity": infinite}
    pictures = {side: np.where(broken[..., np.newaxis], np.float32(0), each) for side, each in pictures.items()}
    return Pair(pictures["candidate"], pictures["reference"], has_opacity), Kind("not finite", 1.0, words, parameters)
