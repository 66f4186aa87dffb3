"""What the scene in the pictures' headers adds to a comparison: the oracle's word, and which mistake it may be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.comparison.outcome import SCENE_ATTRIBUTE, Outcome, with_truth
from texvol.comparison.pictures import Picture
from texvol.errors import InputError, TexvolError
from texvol.text_files import parsed_json

if TYPE_CHECKING:
    from texvol.stored_scene import StoredScene

# What of the header does not change the picture that is wanted.
_NO_SCENE = ("format", "source", "settings", "checksum", "type", "volume")


def judged(outcome: Outcome, *, volume: str | None = None, required: bool = False) -> Outcome:
    """The outcome with the oracle's word, as far as a scene and its volume are found.

    Parameters
    ----------
    volume : path, optional
        The scene's volume, where it is no longer where it was.
    required : bool
        Whether it is an error if there is no scene; otherwise a note says why nothing was asked.

    Raises
    ------
    InputError, MissingExtraError
        If `required` and there is no scene, or its volume is not found, or the oracle's library is missing.
    """
    held = [each for each in (outcome.reference, outcome.candidate) if SCENE_ATTRIBUTE in each.attributes]
    if not held and required:
        names = f"{outcome.candidate.name} and {outcome.reference.name}"
        raise InputError(f"{names}: there is no scene in their headers ({SCENE_ATTRIBUTE}) for the oracle to draw")
    if not held or outcome.measures is None:
        return outcome
    notes = [*outcome.notes, *_scene_changes(outcome)]
    try:
        stored = _stored(held[0], volume)
        outcome = with_truth(outcome, _truth(outcome, stored))
        outcome = replace(outcome, kinds=_explained(outcome, stored, volume) + outcome.kinds)
    except TexvolError as error:
        if required:
            raise
        notes.append(f"the oracle was not asked: {error}")
    return replace(outcome, notes=tuple(notes))


def _stored(picture: Picture, volume: str | None) -> StoredScene:
    from texvol.stored_scene import stored_scene_of

    folder = Path(picture.name).resolve().parent
    return stored_scene_of(picture.attributes, name=picture.name, folder=folder, volume=volume)


def _truth(outcome: Outcome, stored: StoredScene) -> Any:
    from texvol.comparison.three_way import truth_of

    both = outcome.candidate, outcome.reference
    height, width = outcome.reference.pixels.shape[:2]
    return truth_of(
        stored,
        (width, height),
        eight_bits=any(each.whole_numbers for each in both),
        has_opacity=all(each.has_opacity for each in both),
    )


def _explained(outcome: Outcome, stored: StoredScene, volume: str | None) -> tuple[Any, ...]:
    """Mistakes of a renderer that make the candidate of its scene, where it differs and was drawn in slabs."""
    candidate = outcome.candidate
    if SCENE_ATTRIBUTE not in candidate.attributes or outcome.status != "different":
        return ()
    own = stored if candidate.attributes == outcome.reference.attributes else _stored(candidate, volume)
    if not own.settings or own.shows_numbers:
        return ()
    from texvol.comparison.explaining import mistakes_that_explain

    return mistakes_that_explain(
        candidate.pixels,
        own,
        eight_bits=candidate.whole_numbers,
        has_opacity=candidate.has_opacity,
        allowance=candidate.rounding,
    )


def _scene_changes(outcome: Outcome) -> list[str]:
    """Notes where the headers describe different scenes, or ways to draw them."""
    facts: list[dict[str, Any]] = []
    for picture in (outcome.candidate, outcome.reference):
        try:
            found = parsed_json(picture.attributes.get(SCENE_ATTRIBUTE, ""), "the scene")
        except ValueError:
            return []
        if not isinstance(found, dict):
            return []
        facts.append(found)
    notes = []
    changed = [key for key in _changed(*facts) if key not in _NO_SCENE]
    if changed:
        notes.append(f"their scenes are not the same: {', '.join(changed).replace('_', ' ')} changed")
    ours, theirs = (each.get("settings") for each in facts)
    if isinstance(ours, dict) and isinstance(theirs, dict) and ours and theirs:
        names = _changed(ours, theirs)
        said = [f"{name.replace('_', ' ')} {ours.get(name)} instead of {theirs.get(name)}" for name in names]
        notes += [f"they were not drawn alike: {', '.join(said)}"] if said else []
    return notes


def _changed(ours: dict[str, Any], theirs: dict[str, Any]) -> list[str]:
    return [key for key in {**ours, **theirs} if ours.get(key) != theirs.get(key)]
