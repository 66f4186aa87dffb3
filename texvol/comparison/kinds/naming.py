"""kinds_of: from two arrays to the kinds of their difference; what needs no hypothesis is settled here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds import levels, posterised, selection
from texvol.comparison.kinds.kind import Kind, number
from texvol.comparison.kinds.pair import Pair
from texvol.util.errors import InputError

# Sums of squared roundings scatter; and of two pictures that differ by a twentieth of a step only a twentieth of the
# pixels does.
_OF_FLOOR, _OF_STEP = 1.05, 0.05


def kinds_of(
    candidate: NDArray,
    reference: NDArray,
    *,
    has_opacity: bool = True,
    allowance: NDArray | float = 0.0,
    roundings: tuple[NDArray, NDArray] | None = None,
) -> tuple[Kind, ...]:
    """What kinds of difference there are, best explanation first, three at most; empty where the pictures are the same.

    Each kind after the first explains what those before it leave; one whose words begin with "or" explains as much as
    the one before it. A difference that sums in float32 leave, a millionth of the largest value, is of kind "rounding".

    Parameters
    ----------
    candidate, reference : arrays of shape (height, width, 4)
        Premultiplied, linear.
    has_opacity : bool
        Whether both have an opacity; without, the fourth channel is not looked at.
    allowance : array that goes with the pictures, or a number
        Difference that the number formats explain. One that is nowhere more is banding, or rounding, unless it goes
        with what is shown, as a shift's does.
    roundings : pair of arrays that go with the pictures, optional
        Half a step of the candidate's and the reference's number format: the two parts of `allowance`, which need not
        be given then.

    Raises
    ------
    InputError
        If the arrays are not two pictures of one size.
    """
    candidate, reference = np.asarray(candidate), np.asarray(reference)
    if candidate.shape != reference.shape or candidate.ndim != 3 or candidate.shape[2] != 4 or candidate.size == 0:
        raise InputError(
            f"two pictures of one shape (height, width, 4) are wanted: {candidate.shape} and {reference.shape}"
        )
    pair, broken = _finite_pair(candidate, reference, has_opacity)
    found = [broken] if broken is not None else []
    if pair.largest == 0:
        return tuple(found)
    if pair.is_rounding:
        words = f"rounding: differences of {number(pair.largest)} at most, as sums in float32 leave"
        return (*found, Kind("rounding", 1.0, words, {"largest": pair.largest}))
    pair = _rounded(pair, allowance, roundings)
    if pair.is_within_allowance:
        return (*found, *(_systematic(pair) or [levels.within_formats(pair)]))[: selection.MOST_KINDS]
    return (*found, *selection.explain(pair))[: selection.MOST_KINDS]


def _rounded(pair: Pair, allowance: NDArray | float, roundings: tuple[NDArray, NDArray] | None) -> Pair:
    """The pair that knows by how much its numbers were rounded."""
    one, two = roundings if roundings is not None else (np.asarray(allowance), np.zeros(()))
    if not (np.any(one) or np.any(two)):
        return pair
    shape = pair.candidate.shape
    one, two = (np.nan_to_num(np.broadcast_to(np.asarray(each, np.float32), shape), posinf=0.0) for each in (one, two))
    return replace(pair, roundings=(one, two))


def _systematic(pair: Pair) -> list[Kind]:
    """What explains a difference that rounding alone could make, but hardly did."""
    if pair.total <= _OF_FLOOR * pair.floor or _mean_difference(pair) < _OF_STEP:
        return []
    few = posterised.posterised(pair)
    if few is not None:
        return [few.kind]
    lattices = [change for change in levels.changes(pair) if pair.all_explained_by(change.undone(pair)) > 1 - _OF_STEP]
    return [] if lattices else selection.explain_systematic(pair)


def _mean_difference(pair: Pair) -> float:
    """The difference δ before rounding, in steps of 2q; of a picture that was rounded and one that was not infinite.

    Of two that were rounded a share δ / 2q differs by a step: mean d² = 2qδ.
    """
    assert pair.roundings is not None
    if not all(each.any() for each in pair.roundings):
        return np.inf
    allowance = pair.roundings[0] + pair.roundings[1]
    step = np.square(allowance, dtype=np.float64)
    counted = allowance > 0
    return float(np.square(pair.difference[counted], dtype=np.float64).sum() / step[counted].sum())


def _finite_pair(candidate: NDArray, reference: NDArray, has_opacity: bool) -> tuple[Pair, Kind | None]:
    """The pair in float32, the same wherever one of the pictures is not finite; and what is not finite."""
    with np.errstate(over="ignore"):
        candidate, reference = (np.asarray(each, np.float32) for each in (candidate, reference))
    if not has_opacity:
        candidate, reference = candidate.copy(), reference.copy()
        candidate[..., 3] = reference[..., 3] = 1
    finite = np.isfinite(candidate), np.isfinite(reference)
    if all(each.all() for each in finite):
        return Pair(candidate, reference, has_opacity), None
    whole = [each.all(axis=2) for each in finite]
    broken: NDArray = ~(np.asarray(whole[0]) & np.asarray(whole[1]))
    counts = {side: int((~each).sum()) for side, each in zip(("candidate", "reference"), whole, strict=True)}
    kind = _not_finite(broken, counts, candidate, reference)
    candidate, reference = candidate.copy(), reference.copy()
    candidate[broken] = reference[broken] = 0
    return Pair(candidate, reference, has_opacity), kind


def _not_finite(broken: NDArray, counts: dict[str, int], candidate: NDArray, reference: NDArray) -> Kind:
    row, column = divmod(int(broken.argmax()), broken.shape[1])
    nan = bool(np.isnan(candidate[broken]).any() or np.isnan(reference[broken]).any())
    infinite = bool(np.isinf(candidate[broken]).any() or np.isinf(reference[broken]).any())
    what = " and ".join(["NaN"] * nan + ["infinity"] * infinite)
    parts = [f"{count} pixel{'s' * (count != 1)} of the {side}" for side, count in counts.items() if count]
    words = f"not finite ({what}): {' and '.join(parts)}; the first is at column {column}, row {row}"
    parameters = {"pixels": int(broken.sum()), **counts, "first": [column, row], "nan": nan, "infinity": infinite}
    return Kind("not finite", 1.0, words, parameters)
