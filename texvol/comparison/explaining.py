"""Mistakes of a renderer that explain a picture: each is drawn from the picture's scene and compared with the picture.

A mistake explains a picture if drawing with the mistake is far nearer to it than the right picture is. Changes after
drawing are better found from the pictures alone: see `kinds`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.common_form import CommonForm
from texvol.comparison.kinds import Kind
from texvol.comparison.mistakes import CATALOGUE, MistakeTrial, distance, drawn
from texvol.comparison.patience import Patience
from texvol.comparison.pictures import Picture
from texvol.comparison.planting import Planted, PlantedRenderer
from texvol.comparison.three_way import ROUNDING
from texvol.provenance.stored_scene import StoredScene

LEAST_EXPLAINED = 0.9  # of the squared difference; the rest is less than a third of the rms
_WORDS = "the candidate equals the scene drawn with a mistake"
Seen = Callable[[NDArray], NDArray]  # a picture in the form of the candidate
IsOver = Callable[[int, int], bool]  # see Patience.of_mistakes
_BAND = 32  # a dropped slab is searched in 1/32 of the rows


def mistakes_that_explain(
    candidate: Picture, stored: StoredScene, device: int | str | None = None, patience: Patience | None = None
) -> tuple[tuple[Kind, ...], tuple[str, ...]]:
    """Return the mistakes whose picture of a scene is far nearer to a candidate than the right one, and notes.

    The nearest comes first. A note says what took longer than `patience` and was not drawn. `stored` is the scene that
    the candidate should show, `device` as for `Renderer`.
    """
    pixels = candidate.pixels.astype(np.float64)
    channels = 4 if candidate.has_opacity else 3
    # Straight colour of whole numbers ends at 1, premultiplied colour at the opacity.
    cut = np.ones((1, 1, 3), np.bool_) if candidate.whole_numbers and candidate.is_straight else None
    form = CommonForm(candidate.whole_numbers, candidate.has_opacity, cut)

    def seen(picture: NDArray) -> NDArray[np.float64]:
        return form.of_truth(picture, stored)[..., :channels]

    patience = patience or Patience()
    is_over = patience.of_mistakes()
    with PlantedRenderer(device=device) as renderer:
        trial = MistakeTrial(renderer, stored, (pixels.shape[1], pixels.shape[0]))
        ours, right = pixels[..., :channels], seen(trial.right)
        rounding = ROUNDING * float(np.abs(right[np.isfinite(right)]).max(initial=1.0))
        if not (np.abs(ours - right) > candidate.rounding[..., :channels] + rounding).any():
            return (), ()
        found, left_out = _of_the_catalogue(trial, seen, ours, right, is_over)
        if not found and not left_out:
            found, left_out = _dropped_slab(trial, seen, ours, right, patience.of_mistakes())
    return tuple(sorted(found, key=lambda each: -each.explained)), left_out


def _of_the_catalogue(
    trial: MistakeTrial, seen: Seen, ours: NDArray, right: NDArray, is_over: IsOver
) -> tuple[list[Kind], tuple[str, ...]]:
    """Return the mistakes of the catalogue that explain a candidate, and a note if not all could be drawn."""
    whole = distance(ours, right)
    found: list[Kind] = []
    mistakes = drawn(trial)
    for done in range(len(CATALOGUE)):
        if is_over(1 + done, 1 + len(CATALOGUE)):
            note = "mistakes that explain the candidate were not looked for further, since that takes too long"
            return found, (f"{note}: {done} of {len(CATALOGUE)} were drawn; --oracle draws all",)
        mistake, picture = next(mistakes)
        if not isinstance(picture, str) and mistake.guessed:
            explained = 1 - distance(ours, seen(picture)) / whole if whole > 0 else 0.0
            if explained >= LEAST_EXPLAINED:
                found.append(Kind(mistake.name, explained, f"{_WORDS}: {mistake.words}"))
    return found, ()


def _dropped_slab(
    trial: MistakeTrial, seen: Seen, ours: NDArray, right: NDArray, is_over: IsOver
) -> tuple[list[Kind], tuple[str, ...]]:
    """Return the slab whose absence gives the candidate, if there is one, searched in the rows that differ most.

    A note says that the search would have taken too long.
    """
    band = max(1, len(ours) // _BAND)
    off = np.square(np.nan_to_num(ours - right, posinf=0.0, neginf=0.0)).sum(axis=(1, 2))
    start = int(np.convolve(off, np.ones(band), "valid").argmax())
    rows = slice(start, start + band)
    trial.renderer.render(trial.scene, trial.size, **trial.settings)
    first, end = trial.renderer.slab_range()
    with trial.renderer.planted(Planted()) as compositor:
        compositor.keep_rows((rows.start, rows.stop))
        left = []
        for slab in range(first, end):
            if is_over(slab - first, end - first):
                return [], (
                    "a slab that is missing was not looked for, since that takes too long; --oracle looks for it",
                )
            compositor.drop((slab, slab + 1))
            picture = trial.renderer.render(trial.scene, trial.size, **trial.settings)
            left.append(distance(ours[rows], seen(picture[rows])))
    if not left or min(left) > (1 - LEAST_EXPLAINED) * off[rows].sum():
        return [], ()
    slab = first + int(np.argmin(left))
    explained = 1 - distance(ours, seen(trial.without((slab, slab + 1)))) / distance(ours, right)
    if explained < LEAST_EXPLAINED:
        return [], ()
    depth = f"slab {slab - first + 1} of {end - first}, counted from the eye,"
    place = {"slab": slab - first, "slabs": end - first}
    return [Kind("dropped slab", explained, f"{_WORDS}: {depth} is not drawn", place)], ()
