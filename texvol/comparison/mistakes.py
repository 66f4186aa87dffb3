"""Mistakes that renderers make, each drawn of a scene: to see which a limit catches, and which one a picture shows.

Those in the picture are made of the right one. The others are drawn by the renderer itself, with a wrong function in
its shaders, a slab left out, or matter that is not the scene's: opacities of `slab` are in its texels already when a
shader sees them, so that "linear opacity" of that classification is planted in what the texels are made of.

A mistake may have no meaning for a scene, and then says why; or it may change nothing there, as half a texel does of a
volume that is the same everywhere. Neither is one that could be caught.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.other_medium import linear_in_depth, times
from texvol.comparison.planting import OVER_WHAT_IS_THERE, UNDER_BY_ITS_OWN_ALPHA, Planted, PlantedRenderer, Slabs
from texvol.comparison.three_way import ROUNDING
from texvol.comparison.wrong_functions import WrongFunction
from texvol.provenance.stored_scene import StoredScene
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction, proposed_for
from texvol.util.color import srgb_from_linear

Pixels = NDArray[np.float32]

# Wrong functions of the shaders.
_OVER = "vec4 over(vec4 front, vec4 back)"
_TEXEL_AT = "vec4 texel_at(vec3 position)"
ALPHA_OF_THE_BACK: WrongFunction = (_OVER, "return front + (1.0 - back.a) * back;")
HALF_A_TEXEL: WrongFunction = (
    _TEXEL_AT,
    "return textureLod(texels, texture_position(position) + 0.5 / vec3(textureSize(texels, 0)), 0.0);",
)
UNCLIPPED_END_SLABS: WrongFunction = (
    "BoxWalk walk_through(Ray ray, real2 interval, float path_length)",
    "BoxWalk walk = walk_through_right(ray, interval, path_length); "
    "walk.first_fraction = 0.0; walk.last_fraction = 1.0; return walk;",
)
# The uniform has to stay in use, or setting it is an error.
MISSING_COSINE: WrongFunction = ("float obliquity_of(vec2 pixel)", "return 1.0 + 1e-20 * obliquity_of_right(pixel);")
LINEAR_OPACITY: WrongFunction = ("float opacity_from_depth(float x)", "return min(x, 1.0);")
_SEARCHED_AT = 64  # pixels along the longer side: enough to tell which slab shows
WRONG_BY = 0.5  # of one pixel


def other_axes(order: str) -> WrongFunction:
    """A look-up of texels with the axes in another order, such as zyx."""
    return (_TEXEL_AT, f"return textureLod(texels, texture_position(position).{order}, 0.0);")


class DoesNotApply(Exception):
    """A mistake has no meaning for a scene; the message says why."""


class Bench:
    """A scene, its right picture, and a renderer to plant mistakes in."""

    def __init__(self, renderer: PlantedRenderer, stored: StoredScene, size: tuple[int, int]) -> None:
        self.renderer = renderer
        self.stored = stored
        self.scene = stored.scene
        self.size = size
        self.right = renderer.render(stored.scene, size, **stored.settings)
        self.settings = renderer.settings

    def draw(self, mistake: Planted | None = None, *, scene: Scene | None = None, **settings: Any) -> Pixels:
        """The picture with a mistake, of another scene, or with other settings."""
        with self.renderer.planted(mistake or Planted()):
            return self.renderer.render(scene or self.scene, self.size, **{**self.settings, **settings})

    def without(self, slabs: Slabs) -> Pixels:
        """The picture without some slabs."""
        return self.draw(Planted(dropped=slabs))

    @cached_property
    def rounding(self) -> float:
        """How far texels and float32 round the right picture: what a mistake changes has to be more."""
        exact = self.draw(texture_format="rgba32f")
        return _largest(self.right - exact) + ROUNDING * max(1.0, _largest(self.right))

    def is_right(self, picture: Pixels) -> bool:
        """Whether a picture is the right one but for rounding."""
        finite = np.isfinite(self.right)
        if not np.array_equal(picture[~finite], self.right[~finite], equal_nan=True) or not finite.any():
            return not finite.any()
        return bool((np.abs(picture - self.right)[finite] <= self.rounding).all())

    @property
    def medium(self) -> TransferFunction:
        """What the scene is made of, also where it does not say."""
        return self.scene.transfer_function or proposed_for(self.scene.volume)

    @property
    def draws_pieces(self) -> bool:
        """Whether rays are walked piece by piece, through several volumes or from label to label."""
        return bool(self.scene.added) or self.scene.volume.labels

    @cached_property
    def slab(self) -> Slabs:
        """A slab that shows: of any slabs the half is kept whose absence changes the picture more."""
        longest = max(self.size)
        small = tuple(max(1, round(side * min(1.0, _SEARCHED_AT / longest))) for side in self.size)
        render = self.renderer.render
        with self.renderer.dropping() as compositor:
            right = render(self.scene, small, **self.settings)  # type: ignore[arg-type]
            first, end = self.renderer.slab_range()
            while end - first > 1:
                middle = (first + end) // 2
                changes = []
                for half in ((first, middle), (middle, end)):
                    compositor.drop(half)
                    changes.append(distance(render(self.scene, small, **self.settings), right))  # type: ignore[arg-type]
                first, end = (first, middle) if changes[0] >= changes[1] else (middle, end)
        return first, end

    def needs(self, condition: bool, otherwise: str) -> None:
        """Raise DoesNotApply unless the condition holds."""
        if not condition:
            raise DoesNotApply(otherwise)

    def needs_medium(self) -> None:
        """Raise DoesNotApply where values are seen, and no matter."""
        self.needs(self.scene.mode == "composite", f"mode {self.scene.mode} composites nothing")

    def needs_light(self) -> None:
        """Raise DoesNotApply where pixels are data."""
        self.needs(not self.stored.shows_numbers, f"pixels of mode {self.scene.mode} are numbers, and not light")


@dataclass(frozen=True)
class Mistake:
    """A mistake, and how it is drawn.

    `guessed` says whether another picture with the same mistake is the same, so that this one tells it.
    """

    name: str
    words: str
    draw: Callable[[Bench], Pixels]
    guessed: bool = True

    def picture(self, bench: Bench) -> Pixels:
        """The bench's scene with the mistake in it.

        Raises
        ------
        DoesNotApply
            If it has no meaning there.
        """
        return self.draw(bench)


def drawn(bench: Bench) -> Iterator[tuple[Mistake, Pixels | str]]:
    """Every mistake with its picture, or with the reason why there is none."""
    for mistake in CATALOGUE:
        try:
            yield mistake, mistake.picture(bench)
        except DoesNotApply as reason:
            yield mistake, str(reason)


def _dropped_slab(bench: Bench) -> Pixels:
    first, end = bench.slab
    bench.needs(end > first, "no slab is in the picture")
    return bench.without(bench.slab)


def _swapped_order(bench: Bench) -> Pixels:
    bench.needs_medium()
    return bench.draw(Planted(((_OVER, "return over_right(back, front);"),), under=OVER_WHAT_IS_THERE))


def _alpha_of_the_back(bench: Bench) -> Pixels:
    bench.needs_medium()
    return bench.draw(Planted((ALPHA_OF_THE_BACK,), under=UNDER_BY_ITS_OWN_ALPHA))


def _half_a_texel(bench: Bench) -> Pixels:
    return bench.draw(Planted((HALF_A_TEXEL,)))


def _other_axis(bench: Bench) -> Pixels:
    # Of a volume with a symmetry some two axes may be the same.
    for order in ("zyx", "yxz", "xzy"):
        picture = bench.draw(Planted((other_axes(order),)))
        if not bench.is_right(picture):
            break
    return picture


def _unclipped_end_slabs(bench: Bench) -> Pixels:
    return bench.draw(Planted((UNCLIPPED_END_SLABS,)))


def _missing_cosine(bench: Bench) -> Pixels:
    parallel = bench.scene.camera_for(bench.size).projection == "orthographic"
    bench.needs(not parallel, "rays are parallel")
    return bench.draw(Planted((MISSING_COSINE,)))


def _linear_opacity(bench: Bench) -> Pixels:
    bench.needs_medium()
    if bench.scene.classification != "slab" or bench.draws_pieces:
        return bench.draw(Planted((LINEAR_OPACITY,)))
    medium = linear_in_depth(bench.medium, float(bench.settings["slab_thickness"]))
    return bench.draw(scene=replace(bench.scene, transfer_function=medium))


def _double_thickness(bench: Bench) -> Pixels:
    bench.needs_medium()
    added = tuple(
        replace(each, transfer_function=times(each.transfer_function or proposed_for(each.volume), 2.0))
        for each in bench.scene.added
    )
    return bench.draw(scene=replace(bench.scene, transfer_function=times(bench.medium, 2.0), added=added))


def _eight_bit_target(bench: Bench) -> Pixels:
    bench.needs_light()
    return bench.draw(target_format="rgba8")


def _wrong_gamma(bench: Bench) -> Pixels:
    bench.needs_light()
    return np.concatenate([srgb_from_linear(bench.right[..., :3]), bench.right[..., 3:]], axis=2).astype(np.float32)


def _straight_colour(bench: Bench) -> Pixels:
    bench.needs_light()
    picture = bench.right.copy()
    there = picture[..., 3] > 0
    picture[there, :3] /= picture[there, 3:]
    return picture


def _wrong_pixel(bench: Bench) -> Pixels:
    """The pixel nearest to the middle of those that show anything, or to the middle of the picture."""
    picture = bench.right.copy()
    there = np.argwhere((picture != picture[0, 0]).any(axis=2) & np.isfinite(picture).all(axis=2))
    where = there if there.size else np.argwhere(np.ones(picture.shape[:2], np.bool_))
    row, column = where[np.square(where - where.mean(axis=0)).sum(axis=1).argmin()]
    finite = picture[..., :3][np.isfinite(picture[..., :3])]
    span = float(np.ptp(finite)) if bench.stored.shows_numbers and finite.size else 1.0
    color = picture[row, column, :3]
    middle = float(finite.min()) + span / 2 if bench.stored.shows_numbers and finite.size else 0.5
    picture[row, column, :3] = np.where(color < middle, color + WRONG_BY * span, color - WRONG_BY * span)
    return picture


CATALOGUE = (
    Mistake("dropped slab", "a slab that shows is not drawn", _dropped_slab, guessed=False),
    Mistake("swapped order", "slabs are composited from back to front", _swapped_order),
    Mistake("half a texel", "texels are looked up half a texel off along each axis", _half_a_texel),
    Mistake("wrong gamma", "colours are sRGB where linear ones belong", _wrong_gamma),
    Mistake("straight colour", "colours are not multiplied with opacity", _straight_colour),
    Mistake("linear opacity", "the opacity of a slab is its optical depth, at most 1", _linear_opacity),
    Mistake("other axis", "two axes of the volume are swapped", _other_axis),
    Mistake("one wrong pixel", f"one pixel is off by {WRONG_BY:g}", _wrong_pixel, guessed=False),
    Mistake("unclipped end slabs", "slabs at the box's faces count whole", _unclipped_end_slabs),
    Mistake("double thickness", "opacity is that of slabs twice as thick", _double_thickness),
    Mistake("missing cosine", "oblique rays cross slabs no longer than the middle one", _missing_cosine),
    Mistake("alpha of the back", "over weighs the back with its own opacity", _alpha_of_the_back),
    Mistake("8-bit target", "slabs are composited in 8 bits", _eight_bit_target),
)


def _largest(numbers: NDArray) -> float:
    """The largest finite absolute number."""
    return float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))


def distance(one: NDArray, other: NDArray) -> float:
    """Sum of squared differences where both are finite."""
    difference = one.astype(np.float64) - other
    return float(np.square(difference[np.isfinite(difference)]).sum())
