"""Everything about one pair of pictures: measures, limits they break, kinds of difference, the oracle's word."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds import Kind, kinds_of
from texvol.comparison.limits import DRIVER_ATTRIBUTE, Limits, default_limits, violations
from texvol.comparison.measures import Measures, measure, without_infinities
from texvol.comparison.pictures import Picture
from texvol.comparison.three_way import ThreeWay, three_way
from texvol.text_files import parsed_json

SCENE_ATTRIBUTE = "texvol:scene"
_NUMBER_MODES = ("xray", "mip", "minip", "average")  # display.NUMBER_MODES, without what it imports


@dataclass(frozen=True)
class Outcome:
    """What came of holding a candidate against its reference.

    Attributes
    ----------
    status : "same", "different" or "broken"
        Broken: not finite, of another size, or with another number of channels.
    measures : Measures or None
        None where the sizes differ.
    violations : tuple of str
        Sentences; empty where all is within the limits.
    notes : tuple of str
        What else a reader should know.
    """

    name: str
    candidate: Picture
    reference: Picture
    measures: Measures | None
    limits: Limits
    violations: tuple[str, ...]
    status: str
    kinds: tuple[Kind, ...] = ()
    three_way: ThreeWay | None = None
    notes: tuple[str, ...] = ()

    @property
    def is_equal(self) -> bool:
        """Whether no pixel differs at all."""
        return self.measures is not None and self.measures.max_error == 0

    @property
    def passed(self) -> bool:
        return self.status == "same"

    def as_json(self) -> dict[str, Any]:
        """All of it but the pixels."""
        return {
            "name": self.name,
            "status": self.status,
            "candidate": _described(self.candidate),
            "reference": _described(self.reference),
            "measures": None if self.measures is None else self.measures.as_json(),
            "limits": self.limits.as_json(),
            "violations": list(self.violations),
            "kinds": [without_infinities(asdict(each)) for each in self.kinds],
            "oracle": None if self.three_way is None else without_infinities(asdict(self.three_way)),
            "notes": list(self.notes),
        }


def examine(
    candidate: Picture,
    reference: Picture,
    limits: Limits | None = None,
    *,
    name: str | None = None,
    truth: NDArray | None = None,
    explain: bool = True,
) -> Outcome:
    """Hold a candidate against its reference.

    Parameters
    ----------
    limits : Limits, optional
        The defaults for the pair, unless told.
    truth : array of shape (height, width, 4), optional
        The oracle's picture of the same scene, to say which of the two is nearer to it.
    explain : bool
        Whether to say what kind of difference there is.
    """
    limits = limits or default_limits(candidate, reference)
    name = name or candidate.name
    if candidate.pixels.shape != reference.pixels.shape:
        sizes = [f"{each.pixels.shape[1]} × {each.pixels.shape[0]}" for each in (candidate, reference)]
        unlike = (f"the candidate has {sizes[0]} pixels, the reference {sizes[1]}",)
        return Outcome(name, candidate, reference, None, limits, unlike, "broken", notes=_notes(candidate, reference))
    ours, theirs = on_one_range(candidate, reference)
    holds_numbers = _holds_numbers(candidate) or _holds_numbers(reference)
    measures = measure(ours, theirs, limits.max_abs, number_range(theirs) if holds_numbers else None)
    scale = measures.scale
    broken = _what_is_broken(candidate, reference, measures)
    over = violations(measures, limits)
    status = "broken" if broken else "different" if over else "same"
    notes = _notes(candidate, reference, scale)
    found = Outcome(name, candidate, reference, measures, limits, broken + over, status, notes=notes)
    found = explained(found) if explain else found
    return found if truth is None else with_truth(found, truth)


def explained(outcome: Outcome) -> Outcome:
    """The outcome with what kinds of difference there are, from the two pictures alone."""
    measures = outcome.measures
    if measures is None or not measures.max_error > 0:
        return outcome
    ours, theirs = on_one_range(outcome.candidate, outcome.reference)
    scale = np.float32(measures.scale)
    kinds = kinds_of(
        ours.pixels / scale,
        theirs.pixels / scale,
        has_opacity=ours.has_opacity and theirs.has_opacity,
        roundings=(ours.rounding / scale, theirs.rounding / scale),
    )
    return replace(outcome, kinds=kinds)


def with_truth(outcome: Outcome, truth: NDArray) -> Outcome:
    """The outcome with what the oracle says; `truth` is on the range of the pictures, see `three_way.truth_of`."""
    if outcome.measures is None:
        return outcome
    ours, theirs = on_one_range(outcome.candidate, outcome.reference)
    scale = outcome.measures.scale
    both = ours.has_opacity and theirs.has_opacity
    said = three_way(ours.pixels / scale, theirs.pixels / scale, truth / scale, has_opacity=both)
    return replace(outcome, three_way=said)


def number_range(picture: Picture) -> float:
    """What differences of numbers that are no colours are shares of: the range of the picture's finite ones."""
    numbers = picture.pixels[..., :3]
    numbers = numbers[np.isfinite(numbers)]
    return float(np.ptp(numbers)) or float(np.abs(numbers).max(initial=0.0)) or 1.0 if numbers.size else 1.0


def _holds_numbers(picture: Picture) -> bool:
    """Whether the scene in the header is one of a mode whose floating-point pictures hold the volume's own numbers."""
    if picture.whole_numbers or SCENE_ATTRIBUTE not in picture.attributes:
        return False
    try:
        facts = parsed_json(picture.attributes[SCENE_ATTRIBUTE], "the scene")
    except ValueError:
        return False
    return isinstance(facts, dict) and facts.get("mode") in _NUMBER_MODES


def on_one_range(candidate: Picture, reference: Picture) -> tuple[Picture, Picture]:
    """Both, cut to [0, 1] where one of them can hold no more; without opacity where one has none."""
    pair = [candidate, reference]
    if candidate.whole_numbers != reference.whole_numbers:
        pair = [_replaced(each, np.clip(each.pixels, 0, 1)) for each in pair]
    if candidate.has_opacity != reference.has_opacity:
        pair = [_replaced(each, np.dstack([each.pixels[..., :3], np.ones(each.pixels.shape[:2])])) for each in pair]
    return pair[0], pair[1]


def _replaced(picture: Picture, pixels: NDArray) -> Picture:
    return replace(picture, pixels=np.asarray(pixels, np.float32))


def _what_is_broken(candidate: Picture, reference: Picture, measures: Measures) -> tuple[str, ...]:
    broken = []
    if candidate.channels != reference.channels:
        broken.append(f"the candidate has {candidate.channels} channels, the reference {reference.channels}")
    for role, picture in (("candidate", candidate), ("reference", reference)):
        wrong = ~np.isfinite(picture.pixels).all(axis=2)
        if wrong.any():
            row, column = np.argwhere(wrong)[0]
            broken.append(
                f"the {role} is not finite in {wrong.sum()} of {wrong.size} pixels, first in column {column}, row {row}"
            )
    return tuple(broken)


def _notes(candidate: Picture, reference: Picture, scale: float = 1.0) -> tuple[str, ...]:
    notes = [
        f"the {role} is a JPEG, which does not hold the pixels that were written"
        for role, picture in (("candidate", candidate), ("reference", reference))
        if picture.lossy
    ]
    if candidate.has_opacity != reference.has_opacity:
        notes.append("only one of them has opacity, so that colours alone are compared")
    if candidate.whole_numbers != reference.whole_numbers:
        notes.append("one of them ends at 1, so both are cut to 0 … 1")
    if scale != 1.0:
        notes.append(f"the pictures hold numbers, so differences are shares of their range, {scale:.6g}")
    drivers = [each.attributes.get(DRIVER_ATTRIBUTE) for each in (candidate, reference)]
    if all(drivers) and drivers[0] != drivers[1]:
        notes.append(f"drawn by {drivers[0]}, the reference by {drivers[1]}")
    return tuple(notes)


def _described(picture: Picture) -> dict[str, Any]:
    height, width = picture.pixels.shape[:2]
    return {
        "name": picture.name,
        "size": [width, height],
        "format": picture.words,
        "driver": picture.attributes.get(DRIVER_ATTRIBUTE),
        "software": picture.attributes.get("Software"),
    }
