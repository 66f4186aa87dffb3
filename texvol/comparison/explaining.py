"""Which mistake of a renderer a picture shows, told from its scene: each is drawn, and held against the picture.

That a mistake explains a picture means that what it gives is far nearer to it than the right picture is. The pictures
alone tell more of what was done to them afterwards: see `kinds`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.comparison.kinds.kind import Kind
from texvol.comparison.mistakes import Bench, Mistake, distance, drawn
from texvol.comparison.planting import PlantedRenderer
from texvol.comparison.three_way import ROUNDING
from texvol.provenance.stored_scene import StoredScene

LEAST_EXPLAINED = 0.9  # of the squared difference: by rms, what is left is under a third of it
_BAND = 32  # a slab is looked for in one part of so many of the rows


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
    """Mistakes whose picture of a scene is far nearer to a candidate than the right one is, the nearest first.

    Parameters
    ----------
    candidate : array of shape (height, width, 4)
        Linear, premultiplied.
    stored : StoredScene
        What it should show.
    eight_bits, has_opacity : bool
        Whether the candidate ends at 1, and whether its fourth channel means anything.
    is_straight : bool
        Whether it also ends at its opacity, as straight colour in 8 bits does.
    allowance : float or array of the candidate's shape
        What its number format rounds away.
    """
    pixels = np.asarray(candidate, np.float64)
    seen = _Seen(stored, eight_bits, eight_bits and is_straight, 4 if has_opacity else 3)
    with PlantedRenderer(backend) as renderer:
        bench = Bench(renderer, stored, (pixels.shape[1], pixels.shape[0]))
        right = seen.of(bench.right)
        ours, nothing = (np.broadcast_to(each, pixels.shape)[..., : seen.channels] for each in (pixels, allowance))
        rounding = ROUNDING * float(np.abs(right[np.isfinite(right)]).max(initial=1.0))
        if not (np.abs(ours - right) > nothing + rounding).any():
            return ()
        whole = distance(ours, right)
        found = []
        for mistake, picture in drawn(bench):
            if not isinstance(picture, str) and mistake.guessed:
                explained = 1 - distance(ours, seen.of(picture)) / whole if whole > 0 else 0.0
                found.append(_kind(mistake, explained))
        found = [each for each in found if each.explained >= LEAST_EXPLAINED] or _dropped_slab(bench, seen, ours, right)
    return tuple(sorted(found, key=lambda each: -each.explained))


@dataclass(frozen=True)
class _Seen:
    """How pictures of the scene become what the candidate is one of."""

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
    return Kind(mistake.name, explained, f"the candidate is what the scene gives if {mistake.words}")


def _dropped_slab(bench: Bench, seen: _Seen, ours: NDArray, right: NDArray) -> list[Kind]:
    """The slab without which the scene gives the candidate, if there is one; looked for where most is different."""
    band = max(1, len(ours) // _BAND)
    off = np.square(np.nan_to_num(ours - right, posinf=0.0, neginf=0.0)).sum(axis=(1, 2))
    start = int(np.convolve(off, np.ones(band), "valid").argmax())
    rows = slice(start, start + band)
    bench.renderer.render(bench.scene, bench.size, **bench.settings)
    first, end = bench.renderer.slab_range()
    with bench.renderer.dropping() as compositor:
        compositor.keep_rows((rows.start, rows.stop))
        left = []
        for slab in range(first, end):
            compositor.drop((slab, slab + 1))
            picture = bench.renderer.render(bench.scene, bench.size, **bench.settings)
            left.append(distance(ours[rows], seen.of(picture[rows])))
    if not left or min(left) > (1 - LEAST_EXPLAINED) * off[rows].sum():
        return []
    slab = first + int(np.argmin(left))
    explained = 1 - distance(ours, seen.of(bench.without((slab, slab + 1)))) / distance(ours, right)
    if explained < LEAST_EXPLAINED:
        return []
    depth = f"slab {slab - first + 1} of {end - first}, counted from the eye,"
    words = f"the candidate is what the scene gives if {depth} is not drawn"
    return [Kind("dropped slab", explained, words, {"slab": slab - first, "slabs": end - first})]
