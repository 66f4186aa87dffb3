"""kinds_of: from two arrays to the kinds of their difference; what needs no hypothesis is settled here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds import levels, selection
from texvol.comparison.kinds.kind import Kind, number
from texvol.comparison.kinds.pair import ROUNDING, Pair
from texvol.errors import InputError


def kinds_of(
    candidate: NDArray, reference: NDArray, *, has_opacity: bool = True, allowance: NDArray | float = 0.0
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
        Difference that the number formats explain. One that is nowhere more is banding, or rounding.

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
    if bool((np.abs(pair.difference) <= np.asarray(allowance) * (1 + ROUNDING)).all()):
        return (*found, _within_formats(pair))
    return (*found, *selection.explain(pair))[: selection.MOST_KINDS]


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


def _within_formats(pair: Pair) -> Kind:
    """A difference that the number formats explain, named after the coarser of them."""
    found: list[tuple[int, str, levels.Lattice]] = []
    for side in ("candidate", "reference"):
        lattice = levels.lattice_of(pair.of(side), pair.has_opacity)
        if lattice is not None:
            found.append((2**11 if lattice.is_half else lattice.steps or lattice.opacity_steps, side, lattice))
    if not found:
        words = f"rounding: within what the number formats explain, {number(pair.largest)} at most"
        return Kind("rounding", 1.0, words, {"largest": pair.largest})
    steps, side, lattice = min(found, key=lambda each: each[:2])
    bits = "half floats" if lattice.is_half else f"{int(np.ceil(np.log2(steps + 0.5)))} bits"
    said = {**levels.parameters(lattice, side), "largest": pair.largest}
    return Kind("banding", 1.0, f"within the rounding of {bits}", said)
