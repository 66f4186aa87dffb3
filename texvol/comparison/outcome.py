"""Outcome of comparing two pictures: measures, broken limits, kinds of difference, the oracle's verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.common_form import CommonForm, header_of, holds_numbers
from texvol.comparison.kinds import Kind, kinds_of
from texvol.comparison.limits import DRIVER_ATTRIBUTE, Limits, default_limits, violations
from texvol.comparison.measures import Measures, measure, without_infinities
from texvol.comparison.pictures import Picture
from texvol.comparison.regions import NOTHING, Ignored, Region
from texvol.comparison.scene_changes import SceneChange, drawing_changes, in_words, listed, scene_changes
from texvol.comparison.three_way import OracleVerdict, each_by_its_own, three_way

_SEEN_LIGHT = 1 / 255  # a level of 8 bits


@dataclass(frozen=True)
class Outcome:
    """Outcome of comparing a candidate with its reference.

    Attributes
    ----------
    status : "same", "different" or "broken"
        Broken: not finite, of another size, or with another number of channels.
    measures : Measures or None
        None if the sizes differ.
    violations : tuple of str
        Sentences on broken limits; empty if all limits are kept.
    notes : tuple of str
        Further information for a reader.
    scene_changes : tuple of SceneChange or None
        Values that differ between the scenes of the two headers; None if a header holds no scene.
    ignored : Ignored
        Pixels that were not compared.
    """

    name: str
    candidate: Picture
    reference: Picture
    measures: Measures | None
    limits: Limits
    violations: tuple[str, ...]
    status: str
    kinds: tuple[Kind, ...] = ()
    three_way: OracleVerdict | None = None
    notes: tuple[str, ...] = ()
    scene_changes: tuple[SceneChange, ...] | None = None
    ignored: Ignored = NOTHING

    @property
    def is_equal(self) -> bool:
        """True if no pixel differs at all."""
        return self.measures is not None and self.measures.max_error == 0

    @property
    def scene_words(self) -> tuple[str, ...]:
        """A sentence for each part in which the scenes differ."""
        return tuple(in_words(self.scene_changes or ()))

    @property
    def passed(self) -> bool:
        return self.status == "same"

    def in_common_form(self) -> tuple[Picture, Picture]:
        """Return candidate and reference as they were compared; unchanged if their sizes differ."""
        if self.measures is None:
            return self.candidate, self.reference
        quiet = self.ignored.quiet
        return _alike(quiet(self.candidate), quiet(self.reference), self.ignored)[:2]

    def as_json(self) -> dict[str, Any]:
        """The outcome without the pixels."""
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
            "scene_changes": None if self.scene_changes is None else [asdict(each) for each in self.scene_changes],
            "notes": list(self.notes),
            "ignored": list(self.ignored.words),
        }


def examine(
    candidate: Picture,
    reference: Picture,
    limits: Limits | None = None,
    *,
    name: str | None = None,
    explain: bool = True,
    regions: Sequence[Region] = (),
) -> Outcome:
    """Compare a candidate with its reference.

    Parameters
    ----------
    limits : Limits, optional
        By default those of the pair, see `default_limits`.
    explain : bool
        True to find the kinds of difference.
    regions : sequence of Region
        Regions of the picture that don't count.

    Raises
    ------
    InputError
        If a region does not fit the reference, or the regions leave nothing to compare.
    """
    limits = limits or default_limits(candidate, reference)
    name = name or candidate.name
    changes = scene_changes(candidate, reference)
    if candidate.pixels.shape != reference.pixels.shape:
        unlike = (f"the candidate has {candidate.size_in_words} pixels, the reference {reference.size_in_words}",)
        notes = _notes(candidate, reference)
        return Outcome(name, candidate, reference, None, limits, unlike, "broken", notes=notes, scene_changes=changes)
    ignored = Ignored.of(regions, reference)
    pair = ignored.quiet(candidate), ignored.quiet(reference)
    ours, theirs, form = _alike(*pair, ignored)
    are_numbers = form.display is None and (holds_numbers(candidate) or holds_numbers(reference))
    scale = number_range(theirs) if are_numbers else None
    measures = measure(ours, theirs, limits.max_abs, scale, counted=ignored.counted)
    shown = (ours, theirs) if form.display else pair
    broken = (*_lost_channels(candidate, reference), *_not_finite(*shown), *filter(None, [form.reason]))
    over = violations(measures, limits)
    status = "broken" if broken else "different" if over else "same"
    notes = (*ignored.words, *_notes(*pair, measures.scale, form))
    found = Outcome(
        name, candidate, reference, measures, limits, broken + over, status,
        notes=notes, scene_changes=changes, ignored=ignored,
    )  # fmt: skip
    return explained(found) if explain else found


def _alike(candidate: Picture, reference: Picture, ignored: Ignored) -> tuple[Picture, Picture, CommonForm]:
    """Return the pair in its common form, with the reference's pixels in both where nothing counts, and the form."""
    form = CommonForm.of_pair(candidate, reference)
    ours, theirs = form.of(candidate), form.of(reference)
    return ignored.like(ours, theirs), theirs, form


def explained(outcome: Outcome) -> Outcome:
    """Return the outcome with the kinds of difference, found from the two pictures alone."""
    measures = outcome.measures
    if measures is None or not measures.max_error > 0:
        return outcome
    (ours, theirs), scale = outcome.in_common_form(), measures.scale
    roundings = ours.rounding / scale, theirs.rounding / scale
    has_opacity = ours.has_opacity and theirs.has_opacity
    kinds = kinds_of(ours.pixels / scale, theirs.pixels / scale, has_opacity=has_opacity, roundings=roundings)
    return replace(outcome, kinds=kinds)


def with_truths(outcome: Outcome, truths: Sequence[NDArray | None], reasons: Sequence[str] = ()) -> Outcome:
    """Return the outcome with the oracle's verdict.

    Parameters
    ----------
    truths : sequence of array or None
        The oracle's picture of the scene of both pictures; or two, that of each picture's own scene, None if it can't
        be drawn. They have the form of the pictures, see `CommonForm.of_truth`.
    reasons : sequence of str
        Why a picture can't be drawn.
    """
    if outcome.measures is None:
        return outcome
    ours, theirs = outcome.in_common_form()
    scale, both = outcome.measures.scale, ours.has_opacity and theirs.has_opacity
    pair = ours.pixels / scale, theirs.pixels / scale
    known = [None if each is None else each / scale for each in truths]
    if len(known) == 1 and known[0] is not None:
        return replace(outcome, three_way=three_way(*pair, known[0], has_opacity=both))
    return replace(outcome, three_way=each_by_its_own(*pair, known, has_opacity=both, reasons=reasons))


def number_range(picture: Picture) -> float:
    """Unit of differences of pictures of numbers: the range of the picture's finite numbers."""
    numbers = picture.pixels[..., :3]
    numbers = numbers[np.isfinite(numbers)]
    return float(np.ptp(numbers)) or float(np.abs(numbers).max(initial=0.0)) or 1.0 if numbers.size else 1.0


def shown_range(reference: NDArray, scale: float) -> list[float]:
    """Return the values that are shown black and white: 0 and 1 for light, the range of the reference for numbers."""
    if scale == 1:
        return [0.0, 1.0]
    colors = reference[..., :3]
    low = float(colors[np.isfinite(colors)].min(initial=np.inf))
    return [low, low + scale] if np.isfinite(low) else [0.0, scale]


def _lost_channels(candidate: Picture, reference: Picture) -> tuple[str, ...]:
    """Return a sentence if one picture lacks channels that its format could hold.

    PNG, TIFF and JPEG files of a picture with opacity are often opaque: the picture over its background. An EXR or an
    array holds all channels.
    """
    if candidate.channels == reference.channels:
        return ()
    poorer = min(candidate, reference, key=lambda each: each.channels)
    if candidate.container != reference.container and poorer.container not in ("EXR", "array"):
        return ()
    return (f"the candidate has {candidate.channels} channels, the reference {reference.channels}",)


def _not_finite(candidate: Picture, reference: Picture) -> tuple[str, ...]:
    broken = []
    for role, picture in (("candidate", candidate), ("reference", reference)):
        wrong = ~np.isfinite(picture.pixels).all(axis=2)
        if wrong.any():
            row, column = np.argwhere(wrong)[0]
            broken.append(
                f"the {role} is not finite in {wrong.sum()} of {wrong.size} pixels, first in column {column}, row {row}"
            )
    return tuple(broken)


def _notes(
    candidate: Picture, reference: Picture, scale: float = 1.0, form: CommonForm | None = None
) -> tuple[str, ...]:
    notes = [
        f"the {role} is a JPEG, which changes the pixels"
        for role, picture in (("candidate", candidate), ("reference", reference))
        if picture.lossy
    ]
    if candidate.has_opacity != reference.has_opacity:
        notes.append(_over_background(candidate, reference))
    if form is not None and form.display is not None:
        notes.append("one picture shows numbers; the numbers of the other are shown in the same way")
    notes += [_cut_light(form, candidate, reference)] if form is not None and form.cut is not None else []
    if candidate.whole_numbers != reference.whole_numbers:
        notes.append("one picture ends at 1; both are cut to 0 … 1")
    if scale != 1.0:
        notes.append(f"the pictures hold numbers; differences are fractions of their range, {scale:.6g}")
    drivers = [each.attributes.get(DRIVER_ATTRIBUTE) for each in (candidate, reference)]
    if all(drivers) and drivers[0] != drivers[1]:
        notes.append(f"drivers: {drivers[0]} drew the candidate, {drivers[1]} the reference")
    drawn = [each.words for each in drawing_changes(candidate, reference)]
    notes += [f"settings of the drawing differ: {listed(drawn)}"] if drawn else []
    return tuple(filter(None, notes))


def _over_background(candidate: Picture, reference: Picture) -> str:
    """Return a note on the opaque picture, and on the background behind the other one."""
    opaque, other = (candidate, reference) if reference.has_opacity else (reference, candidate)
    words = f"{opaque.name} has no opacity; only colours are compared, each over its background"
    if "background" in (header_of(other) or {}):
        return words
    return f"{words}; the background of {other.name} is unknown and taken as black"


def _cut_light(form: CommonForm, candidate: Picture, reference: Picture) -> str:
    """Return a note on light that is not compared, since straight colour in whole numbers ends at 1."""
    floats = [each.pixels for each in (candidate, reference) if not each.whole_numbers]
    if not floats or form.cut is None:
        return ""
    beyond = np.where(form.cut, floats[0][..., :3] - floats[0][..., 3:], 0)
    most = float(np.nan_to_num(beyond, posinf=0.0, neginf=0.0).max())
    if not most > _SEEN_LIGHT:
        return ""
    pixels = int((beyond > _SEEN_LIGHT).any(axis=2).sum())
    return (
        f"light beyond opacity is not compared, in {pixels} pixels by up to {most:.3g}: straight colour in whole "
        "numbers ends at 1"
    )


def _described(picture: Picture) -> dict[str, Any]:
    height, width = picture.pixels.shape[:2]
    return {
        "name": picture.name,
        "size": [width, height],
        "format": picture.words,
        "driver": picture.attributes.get(DRIVER_ATTRIBUTE),
        "software": picture.attributes.get("Software"),
    }
