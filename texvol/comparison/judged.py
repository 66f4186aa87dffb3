"""Judgement of a comparison by the scenes in the headers: the oracle's verdict, and mistakes that explain it.

Each picture is compared with the oracle's picture of its own scene. If the scenes are equal, the oracle's picture shows
which of the two is nearer to it; see `three_way` for unequal scenes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from texvol.comparison.common_form import SCENE_ATTRIBUTE, CommonForm, header_of
from texvol.comparison.kinds.pair import SIDES
from texvol.comparison.outcome import Outcome, with_truths
from texvol.comparison.patience import Patience
from texvol.comparison.pictures import Picture
from texvol.comparison.three_way import supposing
from texvol.util.errors import InputError, TexvolError

if TYPE_CHECKING:
    from texvol.provenance.stored_scene import StoredScene
    from texvol.scene.scene import Scene


def judged(
    outcome: Outcome,
    *,
    volume: str | None = None,
    required: bool = False,
    scene: Scene | None = None,
    explain: bool = True,
    device: int | str | None = None,
    limit: float | None = None,
) -> Outcome:
    """Return the outcome with the oracle's verdict, as far as the scenes and their volumes are found.

    Parameters
    ----------
    volume : path, optional
        Volume of the scenes, if it was moved.
    required : bool
        True to raise an error if there is no scene; otherwise a note gives the reason.
    scene : Scene, optional
        The candidate's scene, if it is in memory; the reference's scene may have the same volumes.
    explain : bool
        True to search for mistakes of a renderer that explain the candidate.
    device : int or str, optional
        That draws these, as for `Renderer`.
    limit : float, optional
        Seconds that the oracle and the mistakes may take; a note names what was left out. Default: no limit.

    Raises
    ------
    InputError, MissingExtraError
        If `required`, and there is no scene, its volume is not found, or the oracle's library is missing.
    """
    has_scene = [SCENE_ATTRIBUTE in each.attributes for each in (outcome.candidate, outcome.reference)]
    if not any(has_scene) and required:
        names = f"{outcome.candidate.name} and {outcome.reference.name}"
        raise InputError(f"{names}: the oracle needs a scene in a header ({SCENE_ATTRIBUTE}), got none")
    if not any(has_scene) or outcome.measures is None:
        return outcome
    found, faults = _scenes(outcome, volume, scene)
    patience = Patience(limit)
    try:
        if not found:
            raise next(iter(faults.values()))
        outcome = _with_verdict(outcome, found, faults, patience)
        outcome = replace(outcome, notes=(*outcome.notes, *_taken_as_they_are(outcome)))
        if explain:
            outcome = _with_mistakes(outcome, found.get("candidate"), device, patience)
    except TexvolError as error:
        if required:
            raise
        outcome = replace(outcome, notes=(*outcome.notes, f"the oracle was not used: {error}"))
    return outcome


def _scenes(
    outcome: Outcome, volume: str | None, scene: Scene | None
) -> tuple[dict[str, StoredScene], dict[str, TexvolError]]:
    """Return the scenes of candidate and reference by role, and the errors of scenes that are not found."""
    found: dict[str, StoredScene] = {}
    faults: dict[str, TexvolError] = {}
    for role, picture in zip(SIDES, (outcome.candidate, outcome.reference), strict=True):
        if SCENE_ATTRIBUTE not in picture.attributes:
            continue
        try:
            found[role] = _stored(picture, volume, scene)
        except TexvolError as error:
            faults[role] = error
    return found, faults


def _stored(picture: Picture, volume: str | None, scene: Scene | None) -> StoredScene:
    """Return the scene of a picture, with the volumes in memory if they are that scene's."""
    from texvol.provenance.stored_scene import stored_scene_of

    how: dict[str, Any] = {"name": picture.name, "folder": Path(picture.name).resolve().parent}
    if scene is None:
        return stored_scene_of(picture.attributes, volume=volume, **how)
    at_hand: dict[str, Any] = {"volume": scene.volume, "mask": scene.mask, "added": scene.added}
    try:
        return stored_scene_of(picture.attributes, **how, **at_hand)
    except TexvolError as error:
        try:
            return stored_scene_of(picture.attributes, **how)
        except TexvolError:
            raise error from None


def _with_verdict(
    outcome: Outcome, found: Mapping[str, StoredScene], faults: Mapping[str, TexvolError], patience: Patience
) -> Outcome:
    changes = outcome.scene_changes
    if changes:
        truths = [_truth(outcome, found[role], patience.of_oracle(role)) if role in found else None for role in SIDES]
        return with_truths(outcome, truths, [f"the {role} was not judged: {fault}" for role, fault in faults.items()])
    who = list(found)[0 if changes is None else -1]  # of equal scenes that of the reference
    outcome = with_truths(outcome, [_truth(outcome, found[who], patience.of_oracle(who))])
    if outcome.three_way is None or changes is not None or len(found) == 2:
        return outcome
    return replace(outcome, three_way=supposing(outcome.three_way, who))


def _taken_as_they_are(outcome: Outcome) -> list[str]:
    """Return a note on pictures whose header holds no checksum of the volume, such as PNG."""
    headers = {each.name: header_of(each) for each in (outcome.candidate, outcome.reference)}
    unknown = [name for name, header in headers.items() if header is not None and _may_have_changed(header)]
    if not unknown:
        return []
    return [f"{' and '.join(unknown)}: the header holds no checksum of the volume; the file is used as it is"]


def _may_have_changed(header: Mapping[str, Any]) -> bool:
    source = header.get("source")
    return "checksum" not in header and not (isinstance(source, dict) and "built_in" in source)


def _truth(outcome: Outcome, stored: StoredScene, tell: Callable[[float], None]) -> NDArray:
    """Return the oracle's picture of a scene in the form of the compared pictures."""
    from texvol.rendering.streaming.exact import raycast

    height, width = outcome.reference.pixels.shape[:2]
    form = CommonForm.of_pair(outcome.candidate, outcome.reference)
    exact = raycast(stored.scene, (width, height), texture_refinement=stored.texture_refinement, tell=tell)
    return form.of_truth(exact, stored)


def _with_mistakes(outcome: Outcome, own: StoredScene | None, device: int | str | None, patience: Patience) -> Outcome:
    """Return the outcome with the mistakes of a renderer that explain the candidate, if it was drawn in slabs."""
    candidate = outcome.candidate
    if own is None or outcome.status != "different" or not own.settings or own.shows_numbers or _is_right(outcome):
        return outcome
    from texvol.comparison.explaining import mistakes_that_explain

    mistakes, notes = mistakes_that_explain(candidate, own, device, patience)
    return replace(outcome, kinds=mistakes + outcome.kinds, notes=(*outcome.notes, *notes))


def _is_right(outcome: Outcome) -> bool:
    """True if no pixel of the candidate is farther from the oracle than a pixel may differ: there is no mistake."""
    verdict = outcome.three_way
    error = None if verdict is None or verdict.verdict == "unknown" else verdict.candidate_error
    return error is not None and not error.non_finite and error.max_error <= outcome.limits.max_abs
