"""Sampling rate of pictures for which nobody chose one.

A `post` picture at one slab per voxel has rings where the transfer function is steep. Its error is of order 1 at least,
so that two small pictures, one of a quarter of the slab thickness, bound it:

    e(d) <= max |I(d) - I(d/4)| / (1 - 1/4)

A picture of half the thickness would need a divisor of 1/2, and is mostly as far off on the other side. The rate is
doubled until the bound is at most `LIMIT`, as long as the rays sample no more slabs than a warm frame of half a second
can have; then it is lowered to what the last two bounds foresee, if the bound there is small enough as well. Slabs are
counted, not timed, so that the same scene always gives the same picture. Rays end at a transmittance of a sixteenth of
the limit, which is part of the estimate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.error_control import DrawScene, Size, estimate, smaller
from texvol.rendering.model_error import Classified
from texvol.rendering.settings import DEFAULT_EARLY_TERMINATION, Settings
from texvol.rendering.shadow_error import ShadowError
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.slicing.slabs import slabs_crossed_about
from texvol.util.errors import InputError

LIMIT = 1 / 64  # of the largest error of a linear picture
# Slabs that are sampled in half a second by a software renderer of two cores: 5 ns each where they are lit.
_MOST_SAMPLED, _MOST_SAMPLED_UNLIT = 1e8, 2e8
_MOST_IN_PARTS = 1e8  # slabs that the rays cross of a volume that is read in parts
_FINEST, _IN_PARTS = 32, 4
_PATIENCE = 1.0  # seconds of a picture, beyond which textures are not made again for an estimate
_MOST_PIXELS = 192  # along a side of a small picture
_HALVINGS = 2  # of the slab thickness, from a picture to the one that bounds its error
_STEP = 0.5  # of rates between powers of two
_MARGIN = 1.05  # of a rate that is foreseen
_MUCH_LESS = 0.9  # of a rate: less is not worth a picture
# Transmittance at which rays end if the rate is not 1: a sixteenth of the limit, of which it is a part.
_TERMINATION = LIMIT / 16

CountSlabs = Callable[[CompleteScene, Size, Settings], int]


def _small(size: Size) -> Size:
    """Return the size of the pictures that are compared."""
    width, height = smaller(size)
    shrink = min(1.0, _MOST_PIXELS / max(width, height))
    return max(1, round(shrink * width)), max(1, round(shrink * height))


class DefaultRate:
    """Chooser of rates; it remembers the last choice.

    `draw` draws a scene with the settings, without background; `count` returns how many slabs that samples.
    """

    def __init__(self, draw: DrawScene, count: CountSlabs) -> None:
        self._draw, self._count = draw, count
        self._last: tuple[tuple[Any, ...], float, float | None] | None = None  # key, rate and estimate
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
            self._last = key, self._chosen(scene, size, plain), self.estimate
            self._kept = parts, scene.added  # whose identities are in the key
        rate, self.estimate = self._last[1:]
        if rate > 1 and settings.early_termination == DEFAULT_EARLY_TERMINATION:
            settings = replace(settings, early_termination=_TERMINATION)
            self.estimate = None if self.estimate is None else self.estimate + _TERMINATION
        return replace(settings, slab_thickness=settings.slab_thickness / rate)

    def estimated(self, scene: CompleteScene, size: Size, settings: Settings, seconds: float) -> float | None:
        """Return an estimate of the error of the last picture, from two small ones; None if they would take long.

        Two more tell what is by shadows.

        `seconds` is what the picture took. Texels of `slab` are baked for the slabs, but for labels, which are kept as
        they are; parts of a store are read for a size.
        """
        baked_for_slabs = scene.classification == "slab" and not scene.volume.nearest
        made_anew = baked_for_slabs or isinstance(scene.volume, LargeVolume)
        if self.estimate is None and made_anew and seconds > _PATIENCE:
            return None
        small = _small(size)
        try:
            by_slabs = self._error(scene, small, settings) if self.estimate is None else self.estimate
            return by_slabs + ShadowError(self._draw, scene, small, settings).at(settings.shadow_nodes)
        except InputError:
            return None

    def _chosen(self, scene: CompleteScene, size: Size, settings: Settings) -> float:
        """Return the factor of the rate."""
        small, rate, pictures = _small(size), 1.0, {}

        def drawn(factor: float) -> NDArray[np.float32]:
            if factor not in pictures:
                thinner = replace(settings, slab_thickness=settings.slab_thickness / factor)
                pictures[factor] = self._draw(scene, small, thinner)
            return pictures[factor]

        try:
            most, last = None, None
            while True:
                self.estimate = estimate(drawn(rate), drawn(rate * 2**_HALVINGS), _HALVINGS)
                if self.estimate + _TERMINATION <= LIMIT:
                    return self._lowered(drawn, rate, last) if last else rate
                if rate >= _FINEST:
                    return rate
                last = rate, self.estimate
                most = most or self._finest(scene, size, settings)
                finer = min(2 * rate, np.floor(most / _STEP) * _STEP)
                if finer <= rate:
                    return rate
                rate = float(finer)
        except InputError:  # no room, or too many slabs: the picture itself says so if it has to
            return rate

    def _lowered(self, drawn: Callable[[float], NDArray[np.float32]], rate: float, last: tuple[float, float]) -> float:
        """Return the least rate that keeps the limit, if it is much less than one that does.

        `last` is a lower rate and its estimate, beyond the limit.
        """
        assert self.estimate is not None
        limit, finest = LIMIT - _TERMINATION, rate * 2**_HALVINGS
        order = np.log(last[1] / max(self.estimate, 1e-12)) / np.log(rate / last[0])
        foreseen = rate * (self.estimate / limit) ** (1 / max(order, 1.0))
        lower = float(np.ceil(_MARGIN * max(foreseen, last[0]) / _STEP) * _STEP)
        if lower > _MUCH_LESS * rate:
            return rate
        error = estimate(drawn(lower), drawn(finest), np.log2(finest / lower))
        if error > limit:
            return rate
        self.estimate = error
        return lower

    def _finest(self, scene: CompleteScene, size: Size, settings: Settings) -> float:
        """Return the factor of the rate at which a frame takes half a second, by the samples of a small picture."""
        small = _small(size)
        pixels = size[0] * size[1] / (small[0] * small[1])
        sampled = max(self._count(scene, small, replace(settings, early_termination=_TERMINATION)) * pixels, 1.0)
        return (_MOST_SAMPLED_UNLIT if scene.lighting is None else _MOST_SAMPLED) / sampled

    def _error(self, scene: CompleteScene, small: Size, settings: Settings) -> float:
        thinner = replace(settings, slab_thickness=settings.slab_thickness / 2**_HALVINGS)
        fine = self._draw(scene, small, thinner)
        return estimate(self._draw(scene, small, settings), fine, _HALVINGS)

    def _in_parts(self, scene: CompleteScene, size: Size, settings: Settings) -> Settings:
        """Return the settings for a volume in a store, whose parts are not read for a choice."""
        rate = 1
        while rate < _IN_PARTS:
            thinner = settings.slab_thickness / (2 * rate)
            if slabs_crossed_about(scene.box, scene.camera, thinner, size) > _MOST_IN_PARTS:
                break
            rate *= 2
        return replace(settings, slab_thickness=settings.slab_thickness / rate)
