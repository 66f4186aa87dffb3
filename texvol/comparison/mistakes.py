"""Catalogue of mistakes that renderers make, each drawn in a given scene.

Limits are tested by the mistakes that they find, and a picture is explained by a mistake that gives the same picture.

Mistakes after drawing are made in the right picture. The renderer draws the others, with a wrong function in its
shaders, without a slab, or with another medium: opacities of classification `slab` are in the texels before a shader
reads them, so that "linear opacity" is planted in the texels.

A mistake may not apply to a scene, and then gives the reason; or it may change nothing in the scene, as half a texel in
a constant volume. Neither counts as missed.
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
from texvol.util.color import srgb_from_linear

Pixels = NDArray[np.float32]

# Wrong functions of the shaders.
_OVER = "vec4 over(vec4 front, vec4 back)"
_LOOKUP = "vec3 lookup_position(vec3 position)"
ALPHA_OF_THE_BACK: WrongFunction = (_OVER, "return front + (1.0 - back.a) * back;")
HALF_A_TEXEL: WrongFunction = (
    _LOOKUP,
    "return lookup_position_right(position) + 0.5 / vec3(textureSize(texels, 0));",
)
UNCLIPPED_END_SLABS: WrongFunction = (
    "BoxWalk walk_through(Ray ray, real2 interval, float path_length)",
    "BoxWalk walk = walk_through_right(ray, interval, path_length); "
    "walk.first_fraction = 0.0; walk.last_fraction = 1.0; return walk;",
)
# The uniform must stay in use: setting an unused uniform is an error.
MISSING_COSINE: WrongFunction = ("float obliquity_of(vec2 pixel)", "return 1.0 + 1e-20 * obliquity_of_right(pixel);")
LINEAR_OPACITY: WrongFunction = ("float opacity_from_depth(float x)", "return min(x, 1.0);")
LINEAR_OPACITY_OF_INTERVALS: WrongFunction = (
    "float opacity_from_mean(float depth, float mean)",
    "return min(depth, 1.0);",
)
_SEARCHED_AT = 64  # pixels along the longer side of the pictures in which a visible slab is searched
WRONG_BY = 0.5  # change of the wrong pixel


def other_axes(order: str) -> WrongFunction:
    """Look-up of texels with the axes in another order, such as zyx."""
    return (_LOOKUP, f"return lookup_position_right(position).{order};")


class DoesNotApply(Exception):
    """A mistake does not apply to a scene; the message gives the reason."""


class MistakeTrial:
    """Trial of mistakes: a scene, its right picture, and a renderer to plant mistakes in."""

    def __init__(self, renderer: PlantedRenderer, stored: StoredScene, size: tuple[int, int]) -> None:
        self.renderer = renderer
        self.stored = stored
        self.size = size
        self.right = renderer.render(stored.scene, size, **stored.settings)
        self.scene = (renderer.drawn_scene or stored.scene).completed(size)
        # A mistake must not change which tiles have thin slabs.
        self.settings = renderer.uniform_settings
        if self.settings != renderer.settings:
            self.right = renderer.render(self.scene, size, **self.settings)

    def draw(self, mistake: Planted | None = None, *, scene: Scene | None = None, **settings: Any) -> Pixels:
        """Return the picture with a mistake, of another scene, or with other settings."""
        with self.renderer.planted(mistake or Planted()):
            return self.renderer.render(scene or self.scene, self.size, **{**self.settings, **settings})

    def without(self, slabs: Slabs) -> Pixels:
        """Return the picture without some slabs."""
        return self.draw(Planted(dropped=slabs))

    @cached_property
    def rounding(self) -> float:
        """Rounding of the right picture by texels and float32; a mistake has to change more."""
        exact = self.draw(texture_format="rgba32f")
        return _largest(self.right - exact) + ROUNDING * max(1.0, _largest(self.right))

    def is_right(self, picture: Pixels) -> bool:
        """True if a picture equals the right one within rounding."""
        finite = np.isfinite(self.right)
        if not np.array_equal(picture[~finite], self.right[~finite], equal_nan=True) or not finite.any():
            return not finite.any()
        return bool((np.abs(picture - self.right)[finite] <= self.rounding).all())

    @cached_property
    def slab(self) -> Slabs:
        """A visible slab, found by bisection: the half whose absence changes the picture more is kept."""
        longest = max(self.size)
        small = tuple(max(1, round(side * min(1.0, _SEARCHED_AT / longest))) for side in self.size)
        render = self.renderer.render
        with self.renderer.planted(Planted()) as compositor:
            right = render(self.scene, small, **self.settings)
            first, end = self.renderer.slab_range()
            while end - first > 1:
                middle = (first + end) // 2
                changes = []
                for half in ((first, middle), (middle, end)):
                    compositor.drop(half)
                    changes.append(distance(render(self.scene, small, **self.settings), right))
                first, end = (first, middle) if changes[0] >= changes[1] else (middle, end)
        return first, end

    def needs(self, condition: bool, otherwise: str) -> None:
        """Raise DoesNotApply unless the condition holds."""
        if not condition:
            raise DoesNotApply(otherwise)

    def needs_medium(self) -> None:
        """Raise DoesNotApply for modes that show values, not a medium."""
        self.needs(self.scene.mode == "composite", f"mode {self.scene.mode} composites nothing")

    def needs_light(self) -> None:
        """Raise DoesNotApply if pixels are numbers."""
        self.needs(not self.stored.shows_numbers, f"pixels of mode {self.scene.mode} are numbers, not light")


@dataclass(frozen=True)
class Mistake:
    """A mistake, and the function that draws it, which raises DoesNotApply for other scenes.

    `guessed` is True if the mistake gives the same picture each time, so that it can be recognised.
    """

    name: str
    words: str
    draw: Callable[[MistakeTrial], Pixels]
    guessed: bool = True


def drawn(trial: MistakeTrial) -> Iterator[tuple[Mistake, Pixels | str]]:
    """Yield every mistake with its picture, or with the reason why it does not apply."""
    for mistake in CATALOGUE:
        try:
            yield mistake, mistake.draw(trial)
        except DoesNotApply as reason:
            yield mistake, str(reason)


def _dropped_slab(trial: MistakeTrial) -> Pixels:
    first, end = trial.slab
    trial.needs(end > first, "the picture has no slabs")
    return trial.without(trial.slab)


def _with(function: WrongFunction) -> Callable[[MistakeTrial], Pixels]:
    return lambda trial: trial.draw(Planted((function,)))


def _composited(function: WrongFunction, under: tuple[int, int]) -> Callable[[MistakeTrial], Pixels]:
    """Return the drawing with a wrong function `over` and the blending that makes the same mistake."""

    def draw(trial: MistakeTrial) -> Pixels:
        trial.needs_medium()
        return trial.draw(Planted((function,), under=under))

    return draw


_swapped_order = _composited((_OVER, "return over_right(back, front);"), OVER_WHAT_IS_THERE)
_alpha_of_the_back = _composited(ALPHA_OF_THE_BACK, UNDER_BY_ITS_OWN_ALPHA)


def _other_axis(trial: MistakeTrial) -> Pixels:
    # Exchanging two axes of a symmetric volume may change nothing.
    for order in ("zyx", "yxz", "xzy"):
        picture = trial.draw(Planted((other_axes(order),)))
        if not trial.is_right(picture):
            break
    return picture


def _missing_cosine(trial: MistakeTrial) -> Pixels:
    parallel = trial.scene.camera.projection == "orthographic"
    trial.needs(not parallel, "rays are parallel")
    return trial.draw(Planted((MISSING_COSINE,)))


def _linear_opacity(trial: MistakeTrial) -> Pixels:
    trial.needs_medium()
    scene = trial.scene
    # Rays through several volumes, or from label to label, are walked piece by piece.
    if scene.classification != "slab" or scene.added or scene.volume.nearest:
        return trial.draw(Planted((LINEAR_OPACITY, LINEAR_OPACITY_OF_INTERVALS)))
    medium = linear_in_depth(scene.medium, float(trial.settings["slab_thickness"]))
    return trial.draw(scene=replace(scene, transfer_function=medium))


def _double_thickness(trial: MistakeTrial) -> Pixels:
    trial.needs_medium()
    added = tuple(replace(each, transfer_function=times(each.medium, 2.0)) for each in trial.scene.added)
    return trial.draw(scene=replace(trial.scene, transfer_function=times(trial.scene.medium, 2.0), added=added))


def _eight_bit_target(trial: MistakeTrial) -> Pixels:
    trial.needs_light()
    return trial.draw(target_format="rgba8")


def _wrong_gamma(trial: MistakeTrial) -> Pixels:
    trial.needs_light()
    return np.concatenate([srgb_from_linear(trial.right[..., :3]), trial.right[..., 3:]], axis=2).astype(np.float32)


def _straight_colour(trial: MistakeTrial) -> Pixels:
    trial.needs_light()
    picture = trial.right.copy()
    there = picture[..., 3] > 0
    picture[there, :3] /= picture[there, 3:]
    return picture


def _wrong_pixel(trial: MistakeTrial) -> Pixels:
    """Change the visible pixel nearest to the centre of all visible pixels, or the middle of an empty picture."""
    picture = trial.right.copy()
    there = np.argwhere((picture != picture[0, 0]).any(axis=2) & np.isfinite(picture).all(axis=2))
    where = there if there.size else np.argwhere(np.ones(picture.shape[:2], np.bool_))
    row, column = where[np.square(where - where.mean(axis=0)).sum(axis=1).argmin()]
    finite = picture[..., :3][np.isfinite(picture[..., :3])]
    span = float(np.ptp(finite)) if trial.stored.shows_numbers and finite.size else 1.0
    color = picture[row, column, :3]
    middle = float(finite.min()) + span / 2 if trial.stored.shows_numbers and finite.size else 0.5
    picture[row, column, :3] = np.where(color < middle, color + WRONG_BY * span, color - WRONG_BY * span)
    return picture


CATALOGUE = (
    Mistake("dropped slab", "a visible slab is not drawn", _dropped_slab, guessed=False),
    Mistake("swapped order", "slabs are composited from back to front", _swapped_order),
    Mistake("half a texel", "texels are looked up half a texel off along each axis", _with(HALF_A_TEXEL)),
    Mistake("wrong gamma", "colours are encoded as sRGB instead of linear", _wrong_gamma),
    Mistake("straight colour", "colours are not multiplied with opacity", _straight_colour),
    Mistake("linear opacity", "the opacity of a slab is its optical depth, at most 1", _linear_opacity),
    Mistake("other axis", "two axes of the volume are swapped", _other_axis),
    Mistake("one wrong pixel", f"one pixel is off by {WRONG_BY:g}", _wrong_pixel, guessed=False),
    Mistake("unclipped end slabs", "slabs at the box's faces count whole", _with(UNCLIPPED_END_SLABS)),
    Mistake("double thickness", "opacity is that of slabs twice as thick", _double_thickness),
    Mistake("missing cosine", "oblique rays cross slabs no longer than the middle one", _missing_cosine),
    Mistake("alpha of the back", "over weights the back with its own opacity", _alpha_of_the_back),
    Mistake("8-bit target", "slabs are composited in 8 bits", _eight_bit_target),
)


def _largest(numbers: NDArray) -> float:
    """Return the largest finite absolute number."""
    return float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))


def distance(one: NDArray, other: NDArray) -> float:
    """Return the sum of squared differences over finite numbers."""
    difference = one.astype(np.float64) - other
    return float(np.square(difference[np.isfinite(difference)]).sum())
