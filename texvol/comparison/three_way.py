"""Verdict of the oracle: the candidate is nearer to the oracle's picture of the scene than the reference, or farther.

Each of the two pictures has an error against the oracle, of which two numbers count, since each alone is blind: rms
misses one wrong pixel among a million, the maximum misses all pixels but one. A number has changed if it changed by
more than

    rms    5 %, and more than rounding in float32. The rms of n independent errors is known to 1 / sqrt(2 n) of itself:
           two standard deviations in a picture of 32 × 32.
    max    20 %, and more than rounding. The largest of n normal errors varies by 1.28 / (2 ln n) of itself: two
           standard deviations in the same picture.

If the scenes differ, each picture is compared with the oracle's picture of its own scene, and there is no verdict: the
scene may have changed the error. There is no verdict either if only one scene is known.

Better: a number fell, and none rose. Worse: a number rose, and none fell; or the candidate is not finite. Sideways:
no number changed, or one fell and one rose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.comparison import Difference, compare
from texvol.comparison.kinds.pair import SIDES, other

RMS_CHANGE, MAX_CHANGE = 0.05, 0.2
# Fraction of the brightest pixel: sums of some hundreds of slabs in float32, by two drivers, 2^-22 each.
ROUNDING = 2.0**-20
BETTER, WORSE, SIDEWAYS = "better", "worse", "sideways"
OTHER_SCENE, UNKNOWN = "other scene", "unknown"


@dataclass(frozen=True)
class OracleVerdict:
    """Errors of a candidate and its reference against the oracle, and the verdict."""

    candidate_error: Difference | None  # of the candidate against the oracle; None if unknown
    reference_error: Difference | None
    verdict: str  # "better", "worse", "sideways", "other scene" or "unknown"
    words: str


def three_way(
    candidate: ArrayLike, reference: ArrayLike, truth: ArrayLike, *, has_opacity: bool = True
) -> OracleVerdict:
    """Return the verdict on which of two pictures is nearer to the oracle's.

    Parameters
    ----------
    candidate, reference, truth : array of shape (height, width, 4)
        Linear, premultiplied, of one range: pictures of 8 bits end at 1, and so must the truth; pictures of numbers are
        fractions of their range.
    has_opacity : bool
        True if the fourth channel means something.

    Raises
    ------
    InputError
        If the shapes differ.
    """
    channels = 4 if has_opacity else 3
    pictures = [np.asarray(each, np.float64)[..., :channels] for each in (candidate, reference, truth)]
    pictures = _without_common_infinities(*pictures)
    ours, theirs = (compare(each, pictures[2]) for each in pictures[:2])
    verdict, reason = _verdict(ours, theirs, ROUNDING * max(1.0, float(np.abs(pictures[2]).max())))
    return OracleVerdict(ours, theirs, verdict, f"{_TITLES[verdict]}: {reason}")


def each_by_its_own(
    candidate: ArrayLike,
    reference: ArrayLike,
    truths: Sequence[ArrayLike | None],
    *,
    has_opacity: bool = True,
    reasons: Sequence[str] = (),
) -> OracleVerdict:
    """Compare two pictures of different scenes, each with the oracle's picture of its own scene.

    Parameters
    ----------
    candidate, reference : array of shape (height, width, 4)
        As in `three_way`.
    truths : pair of array or None
        The oracle's pictures of the candidate's scene and of the reference's; None if it can't be drawn.
    reasons : sequence of str
        Why a picture can't be drawn.

    Returns
    -------
    OracleVerdict
        With verdict "other scene"; or that of `three_way` if both truths are equal within rounding, as when the
        changed part of the scene is not visible.
    """
    channels = 4 if has_opacity else 3
    pictures = [np.asarray(each, np.float64)[..., :channels] for each in (candidate, reference)]
    known = [None if each is None else np.asarray(each, np.float64)[..., :channels] for each in truths]
    if known[0] is not None and known[1] is not None:
        apart = compare(*_without_common_infinities(known[0], known[1]))
        if apart.max_error <= ROUNDING * max(1.0, float(np.abs(known[1][np.isfinite(known[1])]).max(initial=0.0))):
            return three_way(candidate, reference, np.asarray(truths[1]), has_opacity=has_opacity)
        oracles = f"the oracle's two pictures differ by rms {apart.rms_error:.2g}, at most {apart.max_error:.2g}"
        reasons = [*reasons, oracles]
    errors = [
        None if truth is None else compare(*_without_common_infinities(picture, truth))
        for picture, truth in zip(pictures, known, strict=True)
    ]
    said = [
        f"the {role} differs from the oracle of its own scene by rms {error.rms_error:.2g}, "
        f"at most {error.max_error:.2g}"
        for role, error in zip(SIDES, errors, strict=True)
        if error is not None
    ]
    words = "the scenes differ, so there is no verdict: " + "; ".join([*said, *reasons])
    return OracleVerdict(errors[0], errors[1], OTHER_SCENE, words)


def supposing(found: OracleVerdict, side: str) -> OracleVerdict:
    """Return the verdict for a pair of which only one side names its scene: the other may show another one."""
    words = f"the {other(side)} names no scene, so there is no verdict; if its scene is that of the {side}: "
    return replace(found, verdict=UNKNOWN, words=words + found.words.partition(": ")[2])


_TITLES = {
    BETTER: "changed for the better",
    WORSE: "changed for the worse",
    SIDEWAYS: "changed sideways",
}


def _verdict(ours: Difference, theirs: Difference, rounding: float) -> tuple[str, str]:
    """Return the verdict and its reason."""
    if ours.non_finite:
        return WORSE, f"the candidate is not finite in {ours.non_finite} pixels"
    if theirs.non_finite:
        return BETTER, f"the reference is not finite in {theirs.non_finite} pixels, and the candidate is finite"
    rms = _change(ours.rms_error, theirs.rms_error, RMS_CHANGE, rounding)
    largest = _change(ours.max_error, theirs.max_error, MAX_CHANGE, rounding)
    numbers = (
        f"rms {ours.rms_error:.2g} from the oracle, the reference {theirs.rms_error:.2g}; "
        f"at most {ours.max_error:.2g}, the reference {theirs.max_error:.2g}"
    )
    if rms * largest < 0:
        nearer, farther = ("rms", "in its worst pixel") if rms < 0 else ("in its worst pixel", "rms")
        return SIDEWAYS, f"nearer {nearer} and farther {farther}: {numbers}"
    if rms + largest == 0:
        return SIDEWAYS, f"as far from the oracle as before: {numbers}"
    return (BETTER if rms + largest < 0 else WORSE), numbers


def _change(now: float, before: float, fraction: float, rounding: float) -> int:
    """Return -1 if the number fell, 1 if it rose, 0 if the change may be chance or rounding."""
    if abs(now - before) <= max(fraction * max(now, before), rounding):
        return 0
    return 1 if now > before else -1


def _without_common_infinities(*pictures: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return the pictures with 0 where the truth is not finite and a picture equals the truth."""
    truth = pictures[-1]
    if np.isfinite(truth).all() or any(each.shape != truth.shape for each in pictures):
        return list(pictures)
    broken = ~np.isfinite(truth)
    settled = [np.where(broken & ((each == truth) | np.isnan(each) & np.isnan(truth)), 0.0, each) for each in pictures]
    return [*settled[:-1], np.where(broken, 0.0, truth)]
