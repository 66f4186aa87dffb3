"""Sampling rate of pictures for which nobody chose one.

A `post` picture at one slab per voxel has rings where the transfer function is steep. Its error is of order 1 at least,
so that two small pictures, one of half the slab thickness, bound it:

    e(d) <= max |I(d) - I(d/2)| / (1 - 1/2)

The rate is doubled until that is at most `LIMIT`, as long as the rays cross no more slabs than a warm frame of half a
second can have. Slabs are counted, not timed, so that the same scene always gives the same picture.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from texvol.rendering.error_control import DrawScene, Size, estimate, smaller
from texvol.rendering.model_error import Classified
from texvol.rendering.settings import DEFAULT_EARLY_TERMINATION, Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.slicing.slabs import slabs_crossed_about
from texvol.util.errors import InputError

LIMIT = 1 / 64  # of the largest error of a linear picture
_SAFETY = 1.5  # of the estimate against that by another classification, which `Renderer.stats` has
_MOST_CROSSED = 2.5e8  # slabs of all rays: 2 ns each by a software renderer of two cores, with empty space and light
_MOST_IN_PARTS = 1e8  # of a volume that is read in parts
_FINEST, _IN_PARTS = 16, 4
_PATIENCE = 1.0  # seconds of a picture, beyond which textures are not made again for an estimate
_MOST_PIXELS = 192  # along a side of a small picture


def _small(size: Size) -> Size:
    """Return the size of the pictures that are compared."""
    width, height = smaller(size)
    shrink = min(1.0, _MOST_PIXELS / max(width, height))
    return max(1, round(shrink * width)), max(1, round(shrink * height))


class DefaultRate:
    """Chooser of rates; it remembers the last choice.

    `draw` draws a scene with the settings, without background.
    """

    def __init__(self, draw: DrawScene) -> None:
        self._draw = draw
        self._last: tuple[tuple[Any, ...], float] | None = None  # key and rate
        self.estimate: float | None = None  # of the picture for which the last rate was chosen

    def settled(self, scene: CompleteScene, size: Size, settings: Settings, chosen: Classified | None) -> Settings:
        """Return the settings with slabs that are thin enough for the scene, if it is one of classification auto.

        `chosen` is the choice of its classification; None if there was none, or if a rate is given.
        """
        self.estimate = None
        if chosen is None or chosen.classification != "post" or scene.mode != "composite":
            return settings
        if isinstance(scene.volume, LargeVolume):
            return self._in_parts(scene, size, settings)
        # What ends rays or skips cells has no say in the rate: pictures with and without are to be compared.
        plain = replace(settings, early_termination=DEFAULT_EARLY_TERMINATION, skip_empty=True)
        parts = scene.volume, scene.transfer_function, scene.lighting, scene.mask, scene.depth_cue
        key = (*map(id, parts), f"{size} {scene.cutting} {scene.gradient} {plain}", *map(id, scene.added))
        if self._last is None or self._last[0] != key:
            self._last = key, self._chosen(scene, size, plain)
            self._kept = parts, scene.added  # whose identities are in the key
        return replace(settings, slab_thickness=settings.slab_thickness / self._last[1])

    def estimated(self, scene: CompleteScene, size: Size, settings: Settings, seconds: float) -> float | None:
        """Return an estimate of the error of a picture, from two small ones; None if they would take long.

        `seconds` is what the picture took. Texels of `slab` are baked for the slabs, and parts of a store for a size.
        """
        made_anew = scene.classification == "slab" or isinstance(scene.volume, LargeVolume)
        if made_anew and seconds > _PATIENCE:
            return None
        try:
            return self._error(scene, _small(size), settings)
        except InputError:
            return None

    def _chosen(self, scene: CompleteScene, size: Size, settings: Settings) -> float:
        """Return the factor of the rate."""
        small, rate = _small(size), 1
        try:
            coarse = self._draw(scene, small, settings)
            while True:
                finer = replace(settings, slab_thickness=settings.slab_thickness / (2 * rate))
                fine = self._draw(scene, small, finer)
                self.estimate = estimate(coarse, fine, 1)
                if _SAFETY * self.estimate <= LIMIT or rate >= _FINEST:
                    return rate
                if slabs_crossed_about(scene.box, scene.camera, finer.slab_thickness, size) > _MOST_CROSSED:
                    return rate
                rate, coarse = 2 * rate, fine
        except InputError:  # no room, or too many slabs: the picture itself says so if it has to
            return rate

    def _error(self, scene: CompleteScene, small: Size, settings: Settings) -> float:
        fine = self._draw(scene, small, replace(settings, slab_thickness=settings.slab_thickness / 2))
        return estimate(self._draw(scene, small, settings), fine, 1)

    def _in_parts(self, scene: CompleteScene, size: Size, settings: Settings) -> Settings:
        """Return the settings for a volume in a store, whose parts are not read for a choice."""
        rate = 1
        while rate < _IN_PARTS:
            thinner = settings.slab_thickness / (2 * rate)
            if slabs_crossed_about(scene.box, scene.camera, thinner, size) > _MOST_IN_PARTS:
                break
            rate *= 2
        return replace(settings, slab_thickness=settings.slab_thickness / rate)
