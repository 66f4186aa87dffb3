"""Whether a candidate is nearer to the truth than its reference: the oracle's picture of the scene is the third.

Each of the two has an error from the truth, and two numbers of it are looked at, since either alone is blind: rms
forgets one wrong pixel among a million, the maximum forgets all pixels but one. What counts as a change of them:

    rms    5 %, over what float32 rounds away. Of n independent errors rms is known to 1 / sqrt(2 n) of itself: two
           standard deviations in a picture of 32 × 32.
    max    20 %, over the same. The largest of n normal errors varies by 1.28 / (2 ln n) of itself: two standard
           deviations in the same picture.

Of two scenes each picture is held against the truth of its own, and neither better nor worse is said: an error may have
changed since the scene did. Where one of the scenes is not known, nor is whether the other's truth holds for both.

Better: one of them fell, and neither rose. Worse: one rose, and neither fell; or the candidate is not finite, whatever
the reference is. Sideways: neither changed, or they contradict each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.comparison.common_form import CommonForm
from texvol.comparison.difference import Difference, compare

if TYPE_CHECKING:
    from texvol.provenance.stored_scene import StoredScene

RMS_CHANGE, MAX_CHANGE = 0.05, 0.2
# Of the brightest pixel: float32 sums some hundreds of slabs to 2^-22, and another driver to another 2^-22.
ROUNDING = 2.0**-20
BETTER, WORSE, SIDEWAYS = "better", "worse", "sideways"
OTHER_SCENE, UNKNOWN = "other scene", "unknown"


@dataclass(frozen=True)
class ThreeRay:
    """What came of holding a candidate and its reference against the truth."""

    candidate_error: Difference | None  # of the candidate from the truth; None where that is not known
    reference_error: Difference | None
    verdict: str  # "better", "worse" or "sideways"; "other scene" or "unknown" where that can't be said
    words: str


def truth_of(
    stored: StoredScene,
    size: tuple[int, int],
    *,
    eight_bits: bool = False,
    has_opacity: bool = True,
    form: CommonForm | None = None,
) -> NDArray[np.float64]:
    """The oracle's picture of a scene, shape (height, width, 4), as a file would be read that had no error.

    Parameters
    ----------
    size : (width, height)
    eight_bits : bool
        Whether the files hold whole numbers, which end at 1, and in which numbers are shown as grey or colours.
    has_opacity : bool
        Whether the files have one; if not it is 1.
    form : CommonForm, optional
        That of a pair of pictures, which says these two and more.

    Raises
    ------
    MissingExtraError
        If the oracle's library is not installed.
    """
    from texvol.ray_casting import raycast

    form = form or CommonForm(ends_at_one=eight_bits, has_opacity=has_opacity)
    return form.of_truth(raycast(stored.scene, size), stored)


def three_way(candidate: ArrayLike, reference: ArrayLike, truth: ArrayLike, *, has_opacity: bool = True) -> ThreeRay:
    """Which of two pictures is nearer to the truth.

    Parameters
    ----------
    candidate, reference, truth : array of shape (height, width, 4)
        Linear, premultiplied, on one range: pictures of 8 bits end at 1, and so must the truth; pictures of numbers
        are shares of their range.
    has_opacity : bool
        Whether the fourth channel means anything.

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
    return ThreeRay(ours, theirs, verdict, f"{_TITLES[verdict]}: {reason}")


def each_by_its_own(
    candidate: ArrayLike,
    reference: ArrayLike,
    truths: Sequence[ArrayLike | None],
    *,
    has_opacity: bool = True,
    reasons: Sequence[str] = (),
) -> ThreeRay:
    """Two pictures of unlike scenes, each held against the truth of its own scene.

    Parameters
    ----------
    candidate, reference : array of shape (height, width, 4)
        As in `three_way`.
    truths : pair of array or None
        Of the candidate's scene and of the reference's; None where it can't be drawn.
    reasons : sequence of str
        Why it can't.

    Returns
    -------
    ThreeWay
        Of verdict "other scene"; or that of `three_way` where both truths are the same but for rounding, as where a
        part of the scene differs that does not show.
    """
    channels = 4 if has_opacity else 3
    pictures = [np.asarray(each, np.float64)[..., :channels] for each in (candidate, reference)]
    known = [None if each is None else np.asarray(each, np.float64)[..., :channels] for each in truths]
    if known[0] is not None and known[1] is not None:
        apart = compare(*_without_common_infinities(known[0], known[1]))
        if apart.max_error <= ROUNDING * max(1.0, float(np.abs(known[1][np.isfinite(known[1])]).max(initial=0.0))):
            return three_way(candidate, reference, np.asarray(truths[1]), has_opacity=has_opacity)
        reasons = [*reasons, f"the two oracles are rms {apart.rms_error:.2g} apart, at most {apart.max_error:.2g}"]
    errors = [
        None if truth is None else compare(*_without_common_infinities(picture, truth))
        for picture, truth in zip(pictures, known, strict=True)
    ]
    said = [
        f"the {role} is rms {error.rms_error:.2g}, at most {error.max_error:.2g}, from the oracle of its own scene"
        for role, error in zip(("candidate", "reference"), errors, strict=True)
        if error is not None
    ]
    words = "the scenes are not the same, so that neither better nor worse can be said: " + "; ".join([*said, *reasons])
    return ThreeRay(errors[0], errors[1], OTHER_SCENE, words)


def supposing(found: ThreeRay, who: str, other: str) -> ThreeRay:
    """A verdict where only one of the pictures says of which scene it is: that of `who` may not be that of `other`."""
    words = f"{other} does not say which scene it shows, so that it can't be judged; if it is that of {who}: "
    return replace(found, verdict=UNKNOWN, words=words + found.words.partition(": ")[2])


_TITLES = {
    BETTER: "changed for the better",
    WORSE: "changed for the worse",
    SIDEWAYS: "changed sideways",
}


def _verdict(ours: Difference, theirs: Difference, rounding: float) -> tuple[str, str]:
    """The verdict, and why."""
    if ours.non_finite:
        return WORSE, f"the candidate is not finite in {ours.non_finite} of its pixels"
    if theirs.non_finite:
        return BETTER, f"the reference is not finite in {theirs.non_finite} of its pixels, the candidate in all"
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
    """-1 if it fell, 1 if it rose, 0 if that may be chance or rounding."""
    if abs(now - before) <= max(fraction * max(now, before), rounding):
        return 0
    return 1 if now > before else -1


def _without_common_infinities(*pictures: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The pictures with 0 where the truth is no finite number, and a picture is the same: values may be infinite."""
    truth = pictures[-1]
    if np.isfinite(truth).all() or any(each.shape != truth.shape for each in pictures):
        return list(pictures)
    broken = ~np.isfinite(truth)
    settled = [np.where(broken & ((each == truth) | np.isnan(each) & np.isnan(truth)), 0.0, each) for each in pictures]
    return [*settled[:-1], np.where(broken, 0.0, truth)]
