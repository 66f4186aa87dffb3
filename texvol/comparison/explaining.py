"""Mistakes of a renderer that explain a picture: each is drawn from the picture's scene and compared with the picture.

A mistake explains a picture if drawing with the mistake is far nearer to it than the right picture is. Changes after
drawing are better found from the pictures alone: see `kinds`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.comparison.kinds.kind import Kind
from texvol.comparison.mistakes import Mistake, MistakeTrial, distance, drawn
from texvol.comparison.planting import PlantedRenderer
from texvol.comparison.three_way import ROUNDING
from texvol.provenance.stored_scene import StoredScene

LEAST_EXPLAINED = 0.9  # of the squared difference; the rest is less than a third of the rms
_BAND = 32  # a dropped slab is searched in 1/32 of the rows


def mistakes_that_explain(
    candidate: ArrayLike,
    stored: StoredScene,
    *,
    eight_bits: bool = False,
    has_opacity: bool = True,
    is_straight: bool = False,
    allowance: NDArray | float = 0.0,
    backend: str = "auto",
) -> tuple[Kind, ...]:
    """Return the mistakes whose picture of a scene is far nearer to a candidate than the right one, nearest first.

    Parameters
    ----------
    candidate : array of shape (height, width, 4)
        Linear, premultiplied.
    stored : StoredScene
        Scene that the candidate should show.
    eight_bits, has_opacity : bool
        True if the candidate ends at 1; True if its fourth channel means something.
    is_straight : bool
        True if colour also ends at the opacity, as straight colour in 8 bits does.
    allowance : float or array of the candidate's shape
        Rounding of the candidate's number format.
    """
    pixels = np.asarray(candidate, np.float64)
    seen = _Seen(stored, eight_bits, eight_bits and is_straight, 4 if has_opacity else 3)
    with PlantedRenderer(backend) as renderer:
        trial = MistakeTrial(renderer, stored, (pixels.shape[1], pixels.shape[0]))
        right = seen.of(trial.right)
        ours, nothing = (np.broadcast_to(each, pixels.shape)[..., : seen.channels] for each in (pixels, allowance))
        rounding = ROUNDING * float(np.abs(right[np.isfinite(right)]).max(initial=1.0))
        if not (np.abs(ours - right) > nothing + rounding).any():
            return ()
        whole = distance(ours, right)
        found = []
        for mistake, picture in drawn(trial):
            if not isinstance(picture, str) and mistake.guessed:
                explained = 1 - distance(ours, seen.of(picture)) / whole if whole > 0 else 0.0
                found.append(_kind(mistake, explained))
        found = [each for each in found if each.explained >= LEAST_EXPLAINED] or _dropped_slab(trial, seen, ours, right)
    return tuple(sorted(found, key=lambda each: -each.explained))


@dataclass(frozen=True)
class _Seen:
    """Conversion of the scene's pictures to the candidate's form."""

    stored: StoredScene
    eight_bits: bool
    ends_at_opacity: bool
    channels: int

    def of(self, picture: NDArray) -> NDArray[np.float64]:
        shown = self.stored.in_eight_bits(picture) if self.eight_bits else picture.astype(np.float64)
        if self.ends_at_opacity:
            shown[..., :3] = np.minimum(shown[..., :3], shown[..., 3:])
        return shown[..., : self.channels]


def _kind(mistake: Mistake, explained: float) -> Kind:
    return Kind(mistake.name, explained, f"the candidate equals the scene drawn with a mistake: {mistake.words}")


def _dropped_slab(trial: MistakeTrial, seen: _Seen, ours: NDArray, right: NDArray) -> list[Kind]:
    """Return the slab whose absence gives the candidate, if there is one, searched in the rows that differ most."""
    band = max(1, len(ours) // _BAND)
    off = np.square(np.nan_to_num(ours - right, posinf=0.0, neginf=0.0)).sum(axis=(1, 2))
    start = int(np.convolve(off, np.ones(band), "valid").argmax())
    rows = slice(start, start + band)
    trial.renderer.render(trial.scene, trial.size, **trial.settings)
    first, end = trial.renderer.slab_range()
    with trial.renderer.dropping() as compositor:
        compositor.keep_rows((rows.start, rows.stop))
        left = []
        for slab in range(first, end):
            compositor.drop((slab, slab + 1))
            picture = trial.renderer.render(trial.scene, trial.size, **trial.settings)
            left.append(distance(ours[rows], seen.of(picture[rows])))
    if not left or min(left) > (1 - LEAST_EXPLAINED) * off[rows].sum():
        return []
    slab = first + int(np.argmin(left))
    explained = 1 - distance(ours, seen.of(trial.without((slab, slab + 1)))) / distance(ours, right)
    if explained < LEAST_EXPLAINED:
        return []
    depth = f"slab {slab - first + 1} of {end - first}, counted from the eye,"
    words = f"the candidate equals the scene drawn with a mistake: {depth} is not drawn"
    return [Kind("dropped slab", explained, words, {"slab": slab - first, "slabs": end - first})]
