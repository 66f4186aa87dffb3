"""Search for the slab thickness of a maximum error: on few pixels by a finer reference, on all by coarser pictures.

A reference, see `error_control`, costs more than the picture itself. So it is drawn of few rays only, by a small
picture of the same view, with thin slabs where it still changes. Slabs have to be as thin at least as they are there,
since the largest error of all rays is hardly smaller than that of few; and a spike of the transfer function that all
slabs pass over is found there.

The other pixels are held against coarser pictures of themselves, tile by tile, see `tiles`: each tile has a ray of the
small picture in it.

All pixels are held against the reference, as before, where the largest error may be that of a few lonely rays: by
slabs thicker than the spacing, which are drawn in no time; and by `post` with a transfer function that changes within
a small part of the values, since a ray that only just reaches them is off by all that they add, or by nothing.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.rendering import forecast
from texvol.rendering.error_control import (
    FINEST_RATE,
    ORDER,
    Begin,
    Choice,
    DrawScene,
    HeldAgainstKnown,
    Size,
    coarsest,
    converging,
    differences,
    finest_rate,
    rounding_in,
    rounding_of,
    smaller,
    thickness_for_error,
)
from texvol.rendering.pictures import Pictures
from texvol.rendering.settings import Settings, checked_slicing, checked_target, checked_termination
from texvol.rendering.streaming.kinds import drawable
from texvol.rendering.tiles import LONELY, Tiles, refined, slabs_foreseen
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.slabs import Slicing
from texvol.textures.value_storage import bulk_of
from texvol.util import progress
from texvol.util.errors import AccuracyWarning, NoRoomError
from texvol.util.upward import upward

# Largest order that is believed: SAFETY then covers what 160 random scenes at four thicknesses were off.
_MOST_ORDER = {"slab": 1.3, "extinction": 1.75, "post": 1.75, "integrated": 1.5}
_LONELY = 1 / 40  # of the values: a transfer function that changes within less is off on lonely rays
_MARGIN = 1.25  # of the error of few pixels, which miss the largest one: the pictures of all pixels find that
_FEW = 8  # times fewer pixels along each side of a small picture, but
_LEAST_FEW = 48  # are as many at least
_TRIED = 2.0  # slabs per spacing of small pictures that tell whether slabs are divided
_REFERENCE_TILE = 4  # pixels along each side of the tiles of a small reference
_MOST_TERMINATION = 1 / 8  # of the limit: no difference of two pictures shows where rays end
Notes = dict[float, tuple[dict[str, float], int]]  # seconds of pictures by step, and bricks, by thickness

_USUAL_ORDER = 1.5  # of the error, for the forecast of a search
_FORESEEN = 0.25  # fraction of the time of a search, without textures, that goes into small pictures


def fewer(size: Size) -> Size:
    """Return the size of a picture of few rays."""
    width, height = (max(side // _FEW, min(side, _LEAST_FEW)) for side in size)
    return width, height


class ErrorSearch:
    """Search for slab thicknesses; it remembers the last rates found with a small picture.

    `draw` draws a scene with the settings, `draw_exactly` without the rounding and early termination in them;
    `pictures_of` returns what draws a scene, and knows what error the rounding of values added when it was last drawn.
    """

    def __init__(self, draw: DrawScene, draw_exactly: DrawScene, pictures_of: Callable[[Scene], Pictures]) -> None:
        self._draw, self._draw_exactly, self._pictures_of = draw, draw_exactly, pictures_of
        self._last: tuple[CompleteScene, tuple[Size, Settings, float], Choice] | None = None
        self._textures: object = None  # what those of the last search are made of

    def foresee(self, scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> Choice:
        """Return the choice for a picture of a sixteenth of the pixels.

        The largest error of all pixels is hardly more than twice that of a sixteenth of them, so half of the error is
        requested of the small picture.
        """
        asked = size, replace(settings, slab_thickness=0.0), wanted
        if self._last is None or self._last[0] is not scene or self._last[1] != asked:
            found = self._search(scene, smaller(size), settings, wanted / 2)
            # A reference is expensive and refines itself if it has to, so it begins as for twice the error.
            begin = replace(found.begin, reference=found.begin.reference / 2)
            self._last = scene, asked, replace(found, estimated_error=2 * found.estimated_error, begin=begin)
        return self._last[2]

    def choose(self, scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> tuple[Choice, Settings]:
        """Return the picture of coarse slabs that keep the error, and its settings.

        Warns
        -----
        AccuracyWarning
            If the error cannot be reached.
        """
        undivided = replace(settings, adaptive=None if settings.adaptive == "auto" else settings.adaptive)
        found = None
        if may_refine_tiles(scene, size, settings, wanted):
            with suppress(NoRoomError):  # thicker slabs need more margin around a brick
                found = self._extrapolated(scene, size, settings, wanted)
        choice, settings = found or (self._held_against_reference(scene, size, undivided, wanted), undivided)
        if not choice.reached:
            warnings.warn(
                f"requested error of {wanted:g} not reached: {upward(choice.estimated_error)} by estimate, "
                f"at slab thickness {choice.slab_thickness:g}",
                AccuracyWarning,
                stacklevel=4,
            )
        return choice, replace(settings, slab_thickness=choice.slab_thickness)

    def _extrapolated(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float
    ) -> tuple[Choice, Settings]:
        """Return the choice by few pixels of a reference and all pixels of coarser pictures, and their settings.

        Where slabs are thicker than the spacing all pixels are held against the reference.
        """
        tiles, lonely = Tiles(size, fewer(size)), _has_lonely_errors(scene)
        with self._foreseeing(scene, size):
            few, of_few, settings = self._by_few(scene, tiles.count, settings, wanted / _MARGIN)
        if few.rate < 1:
            return self._held_against_reference(scene, size, settings, wanted, few), settings
        choice = refined(
            lambda thickness, regions: self._draw(
                scene, size, replace(settings, slab_thickness=thickness, regions=regions)
            ),
            tiles,
            scene.smallest_spacing,
            few,
            wanted,
            lambda picture: (
                self._pictures_of(scene).rounding(scene) + rounding_in(picture) + settings.early_termination
            ),
            lambda rate: _MARGIN * of_few(rate),
            ORDER if lonely else _MOST_ORDER[scene.classification],
            finest_rate(scene),
            LONELY if lonely else 0.0,
            lambda passes: progress.expect(lambda: forecast.of_passes(scene, size, settings, passes)),
        )
        return choice, settings

    @contextmanager
    def _foreseeing(self, scene: CompleteScene, size: Size) -> Iterator[None]:
        """Count the small pictures as a part of the search, with the textures that are made for the first of them."""
        if not progress.is_heard():
            yield
            return
        before, self._textures = self._textures, forecast.of_what_textures(scene)
        small = forecast.of_foreseeing(scene, size)
        textures = 0.0 if before == self._textures else forecast.of_textures(scene)
        with progress.span((textures + small) / (textures + small / _FORESEEN), textures + small):
            yield

    def _by_few(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float
    ) -> tuple[Begin, Callable[[float], NDArray[np.float64]], Settings]:
        """Return the rates that a small picture needs, the error of its pixels by rate, and settings.

        Pictures of finer rates than that have at most its error, and are not drawn. The settings say whether slabs are
        divided.
        """
        spacing = scene.smallest_spacing
        pictures: dict[float, NDArray[np.float32]] = {}  # by rate
        reference = self._reference(scene, size, settings, wanted / 2)
        rounding = rounding_in(reference.picture) + self._pictures_of(scene).rounding(scene)
        held = HeldAgainstKnown(reference.picture, reference.begin.rate, reference.estimated_error + rounding)
        if settings.adaptive == "auto":
            pays = scene.lighting is not None and converging(scene) is not scene
            pays = pays and self._division_pays(scene, size, settings, reference.picture, wanted)
            settings = replace(settings, adaptive="on" if pays else None)

        def drawn(thickness: float) -> NDArray[np.float32]:
            pictures[spacing / thickness] = self._draw(scene, size, replace(settings, slab_thickness=thickness))
            return pictures[spacing / thickness]

        def error(rate: float) -> NDArray[np.float64]:
            rate = min(rate, begin.rate)
            return held.errors(pictures[rate] if rate in pictures else drawn(spacing / rate))

        begin = coarsest(drawn, held, spacing, wanted, Begin(), finest=finest_rate(scene)).begin
        return begin, error, settings

    def _division_pays(
        self, scene: CompleteScene, size: Size, settings: Settings, reference: NDArray[np.float32], wanted: float
    ) -> bool:
        """Return True if divided slabs reach an error with fewer samples, by a small picture of each kind."""
        samples = []
        for adaptive in (None, "on"):
            at = replace(settings, slab_thickness=scene.smallest_spacing / _TRIED, adaptive=adaptive)
            errors = differences(self._draw(scene, size, at), reference)
            slabs = slabs_foreseen(errors, _TRIED, wanted, finest_rate(scene))
            samples.append(slabs * self._pictures_of(scene).count(scene, size, at))
        return samples[1] < samples[0]

    def _reference(self, scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> Choice:
        """Return a small picture that is refined where its own error is more than `wanted`."""
        reference, lonely = converging(scene), _has_lonely_errors(scene)
        width, height = size
        return refined(
            lambda thickness, regions: self._draw_exactly(
                reference, size, replace(settings, slab_thickness=thickness, regions=regions)
            ),
            Tiles(size, (-(-width // _REFERENCE_TILE), -(-height // _REFERENCE_TILE))),
            scene.smallest_spacing,
            Begin(),
            wanted,
            lambda picture: 0.0,
            lambda rate: np.zeros(()),
            ORDER if lonely else _MOST_ORDER[reference.classification],
            2 * finest_rate(scene),
            LONELY if lonely else 0.0,
        )

    def _held_against_reference(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float, begin: Begin | None = None
    ) -> Choice:
        """Return the choice by a reference of all pixels; the search begins with `foresee` unless told."""
        if begin is None:
            with self._foreseeing(scene, size):
                begin = self.foresee(scene, size, settings, wanted).begin
        progress.expect(lambda: forecast.of_search(scene, size, settings, begin.rate, begin.reference))
        return self._search(scene, size, settings, wanted, begin)

    def _search(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        wanted: float,
        begin: Begin | None = None,
    ) -> Choice:
        reference, spacing = converging(scene), scene.smallest_spacing

        def draw_reference(thickness: float) -> NDArray[np.float32]:
            return self._draw_exactly(reference, size, replace(settings, slab_thickness=thickness))

        def told(rate: float, excess: float) -> None:
            finer = min(rate * excess ** (1 / _USUAL_ORDER), FINEST_RATE)
            progress.expect(lambda: forecast.of_search(scene, size, settings, finer, finer))

        return thickness_for_error(
            lambda thickness: self._draw(scene, size, replace(settings, slab_thickness=thickness)),
            draw_reference,
            spacing,
            wanted,
            begin,
            converges_alone=reference is not scene,
            finest=finest_rate(scene),
            rounding=lambda: self._pictures_of(scene).rounding(scene),
            relative=rounding_of(scene),
            told=told,
        )


def may_refine_tiles(scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> bool:
    """Return True if coarser pictures tell the error: few rays know what they have in common, and are fewer."""
    in_memory = scene.mode == "composite" and not isinstance(scene.volume, LargeVolume)
    formats = settings.texture_format, settings.target_format, settings.slicing
    exact = formats == ("rgba32f", "rgba32f", "stacks") and settings.early_termination <= _MOST_TERMINATION * wanted
    post = scene.classification == "post" and in_memory and _has_lonely_errors(scene)
    return in_memory and exact and not post and fewer(size) != size


def _has_lonely_errors(scene: CompleteScene) -> bool:
    """True if a value is classified when it is drawn, and its medium changes within a small part of the values."""
    return scene.classification in ("post", "integrated") and any(map(_changes_fast, scene.each_alone()))


def _changes_fast(alone: CompleteScene) -> bool:
    medium, (low, high) = alone.medium, bulk_of(alone.volume)
    changes = (np.diff(medium.extinctions) != 0) | (np.diff(medium.colors, axis=0) != 0).any(axis=1)
    narrowest = np.diff(medium.values)[changes].min(initial=np.inf)
    return bool(narrowest < _LONELY * (high - low))


def searched(
    scene: Scene, size: Size, max_error: float, slicing: Slicing
) -> tuple[CompleteScene, Size, Settings, float]:
    """Return what a search is asked by these arguments of `Renderer.render`."""
    scene = drawable(scene, size)
    complete = scene.completed(size)
    termination, target = checked_termination(None, max_error), checked_target("auto")
    slicing = checked_slicing(slicing, complete)
    settings = Settings(0.0, "rgba32f", target, termination, skip_empty=True, slicing=slicing)
    return complete, size, settings, max_error


def of_passes(notes: Notes, choice: Choice) -> tuple[dict[str, float], int]:
    """Return the seconds and bricks of a chosen picture; seconds of all passes if its tiles differ."""
    seconds, bricks = notes[choice.slab_thickness]
    for step in ("draw", "read") if len(choice.passes) > 1 else ():
        seconds[step] = sum(notes[thickness][0][step] for thickness, _ in choice.passes)
    return seconds, bricks
