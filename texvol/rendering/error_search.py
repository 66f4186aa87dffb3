"""Search for the slab thickness of a maximum error: on few pixels by a finer reference, on all by coarser pictures.

A reference, see `error_control`, costs more than the picture itself. So it is drawn of few rays only, by a small
picture of the same view. Slabs have to be as thin at least as they are there, since the largest error of all rays is
hardly smaller than that of few; and a spike of the transfer function that all slabs pass over is found there.

Where the error is largest among all pixels is known from three pictures I(4d), I(2d), I(d). The coarser ones take three
quarters of the time of the last one. With the order that they show,

    p = log2(max |I(4d) - I(2d)| / max |I(2d) - I(d)|),    e(d) <= SAFETY · max |I(2d) - I(d)| / (2^p - 1)

p is at least 1, as in `error_control`, and at most what pictures of a classification can be trusted with: thicker slabs
may lose what makes the error of thin ones. Slabs are halved, with one more picture each time, until both estimates are
within the limit.

All pixels are held against the reference, as before, where the largest error may be that of a few lonely rays: by
slabs thicker than the spacing, which are drawn in no time; and by `post` with a transfer function that changes within
a small part of the values, since a ray that only just reaches them is off by all that they add, or by nothing.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.rendering import forecast
from texvol.rendering.error_control import (
    FINEST_RATE,
    ORDER,
    SAFETY,
    Begin,
    Choice,
    Draw,
    DrawScene,
    Size,
    converging,
    finest_rate,
    largest_difference,
    rounding_in,
    rounding_of,
    smaller,
    thickness_for_error,
)
from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
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
_MOST_TERMINATION = 1 / 8  # of the limit: no difference of two pictures shows where rays end
_USUAL_ORDER = 1.5  # of the error, for the forecast of a search
_FORESEEN = 0.25  # fraction of the time of a search that goes into small pictures


def fewer(size: Size) -> Size:
    """Return the size of a picture of few rays."""
    width, height = (max(side // _FEW, min(side, _LEAST_FEW)) for side in size)
    return width, height


def extrapolated(before: float, last: float, most_order: float) -> float:
    """Estimate the error of a picture from two differences of pictures.

    Parameters
    ----------
    before : float
        Largest difference of the pictures of four times and of twice the thickness.
    last : float
        Largest difference of the picture of twice the thickness and the picture itself.
    most_order : float
        Largest order of the error that is believed.
    """
    if not 0 < last < np.inf:
        return last
    order = np.clip(np.log2(max(before, last) / last), ORDER, most_order)
    return float(SAFETY * last / (2.0**order - 1))


def refined(
    draw: Draw,
    spacing: float,
    begin: Begin,
    wanted: float,
    known: Callable[[NDArray[np.float32]], float],
    least: float,
    most_order: float,
    finest: float = FINEST_RATE,
) -> Choice:
    """Halve the slabs until the error that coarser pictures show is at most `wanted`.

    Parameters
    ----------
    draw : callable
        Draws the scene at a slab thickness in world units.
    spacing : float
        Smallest spacing, world units.
    begin : Begin
        Rate at which slabs are thin enough for few pixels.
    known : callable
        Returns the part of a picture's error that does not depend on its slabs.
    least : float
        Error of few pixels, all parts of it.
    most_order : float
        See `extrapolated`.
    finest : float
        Largest rate.
    """
    rate, coarser = begin.rate, draw(2 * spacing / begin.rate)
    before = largest_difference(draw(4 * spacing / begin.rate), coarser)
    while True:
        picture = draw(spacing / rate)
        last = largest_difference(coarser, picture)
        error = max(extrapolated(before, last, most_order) + known(picture), least)
        if error <= wanted or rate >= finest:
            return Choice(spacing / rate, error, error <= wanted, picture, Begin(rate, begin.reference))
        rate, coarser, before = 2 * rate, picture, last


class ErrorSearch:
    """Search for slab thicknesses; it remembers the last rates found with a small picture.

    `draw` draws a scene with the settings, `draw_exactly` without the rounding and early termination in them;
    `rounding` returns the error that the rounding of values adds to the scene that was drawn last.
    """

    def __init__(self, draw: DrawScene, draw_exactly: DrawScene, rounding: Callable[[CompleteScene], float]) -> None:
        self._draw, self._draw_exactly, self._rounding = draw, draw_exactly, rounding
        self._last: tuple[CompleteScene, tuple[Size, Settings, float], Choice] | None = None

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

    def choose(self, scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> Choice:
        """Return the picture of coarse slabs that keep the error.

        Warns
        -----
        AccuracyWarning
            If the error cannot be reached.
        """
        choice = None
        if _may_extrapolate(scene, size, settings, wanted):
            with suppress(NoRoomError):  # thicker slabs need more margin around a brick
                choice = self._extrapolated(scene, size, settings, wanted)
        choice = choice or self._held_against_reference(scene, size, settings, wanted)
        if not choice.reached:
            warnings.warn(
                f"requested error of {wanted:g} not reached: {upward(choice.estimated_error)} by estimate, "
                f"at slab thickness {choice.slab_thickness:g}",
                AccuracyWarning,
                stacklevel=4,
            )
        return choice

    def _extrapolated(self, scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> Choice:
        """Return the choice by few pixels of a reference and all pixels of coarser pictures.

        Where slabs are thicker than the spacing all pixels are held against the reference.
        """
        with progress.span(_FORESEEN, lambda: forecast.of_foreseeing(scene, size)):
            few = self._search(scene, fewer(size), settings, wanted / _MARGIN)
        rate = few.begin.rate
        if rate < 1:
            return self._held_against_reference(scene, size, settings, wanted, few.begin)
        progress.expect(lambda: forecast.of_refining(scene, size, settings, rate))
        return refined(
            lambda thickness: self._draw(scene, size, replace(settings, slab_thickness=thickness)),
            scene.smallest_spacing,
            few.begin,
            wanted,
            lambda picture: self._rounding(scene) + rounding_in(picture) + settings.early_termination,
            _MARGIN * few.estimated_error,
            ORDER if _has_lonely_errors(scene) else _MOST_ORDER[scene.classification],
            finest_rate(scene),
        )

    def _held_against_reference(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float, begin: Begin | None = None
    ) -> Choice:
        """Return the choice by a reference of all pixels; the search begins with `foresee` unless told."""
        if begin is None:
            with progress.span(_FORESEEN, lambda: forecast.of_foreseeing(scene, size)):
                begin = self.foresee(scene, size, settings, wanted).begin
        progress.expect(lambda: forecast.of_search(scene, size, settings, begin.rate, begin.reference))
        return self._search(scene, size, settings, wanted, begin)

    def _search(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float, begin: Begin | None = None
    ) -> Choice:
        reference = converging(scene)

        def told(rate: float, excess: float) -> None:
            finer = min(rate * excess ** (1 / _USUAL_ORDER), FINEST_RATE)
            progress.expect(lambda: forecast.of_search(scene, size, settings, finer, finer))

        return thickness_for_error(
            lambda thickness: self._draw(scene, size, replace(settings, slab_thickness=thickness)),
            lambda thickness: self._draw_exactly(reference, size, replace(settings, slab_thickness=thickness)),
            scene.smallest_spacing,
            wanted,
            begin,
            converges_alone=reference is not scene,
            finest=finest_rate(scene),
            rounding=lambda: self._rounding(scene),
            relative=rounding_of(scene),
            told=told,
        )


def _may_extrapolate(scene: CompleteScene, size: Size, settings: Settings, wanted: float) -> bool:
    """True if coarser pictures tell the error: what all of them have in common is none, and there are fewer pixels."""
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
