"""Sampling rate of pictures for which nobody chose one.

A `post` picture at one slab per voxel has rings where the transfer function is steep. Its error is of order 1 at least,
so that two small pictures, one of a quarter of the slab thickness, bound it:

    e(d) <= max |I(d) - I(d/4)| / (1 - 1/4)

A picture of half the thickness would need a divisor of 1/2, and is mostly as far off on the other side. The rate is
doubled until the bound is at most `LIMIT`, as long as the rays sample no more slabs than a warm frame of half a second
can have; then it is lowered to what the last two bounds foresee, if the bound there is small enough as well. Slabs are
counted, not timed, so that the same scene always gives the same picture. Rays end at a transmittance of a sixteenth of
the limit, which is part of the estimate.

An unlit scene whose transfer function is given, and not of a look, is drawn at one slab per voxel as it always was.

A lit scene that is nearly transparent for the most part needs fewer samples if its slabs are divided (`adaptive` of
`Settings`), at about a third of the rate. It is drawn so where that takes less time for the same error, or keeps the
limit where nothing else does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.error_control import DrawScene, Size, estimate, more_halvings, rounding_of, smaller
from texvol.rendering.model_error import Classified
from texvol.rendering.settings import DEFAULT_EARLY_TERMINATION, PARTS, Settings
from texvol.rendering.shadow_error import ShadowError
from texvol.scene.large_volume import LargeVolume
from texvol.scene.picture_size import shrunk
from texvol.scene.scene import CompleteScene
from texvol.slicing.slabs import slabs_crossed_about
from texvol.util.errors import InputError

LIMIT = 1 / 64  # of the largest error of a linear picture
# Slabs that are sampled in half a second by a software renderer of two cores: 5 ns each where they are lit.
_MOST_SAMPLED, _MOST_SAMPLED_UNLIT = 1e8, 2e8
_MOST_IN_PARTS = 1e8  # slabs that the rays cross of a volume that is read in parts
_FINEST, _IN_PARTS = 32, 4
PATIENCE = 1.0  # seconds of a picture, beyond which textures are not made again for an estimate
_MOST_PIXELS = 192  # along a side of a small picture
_HALVINGS = 2  # of the slab thickness, from a picture to the one that bounds its error
_STEP = 0.5  # of rates between powers of two
_MARGIN = 1.05  # of a rate that is foreseen
_MUCH_LESS = 0.9  # of a rate, or of the samples: less is not worth a picture
_PRICE = 1.3  # of a sample where slabs may be divided, in others
_USUAL_ORDER = 1.5  # of the error
# Transmittance at which rays end if the rate is not 1: a sixteenth of the limit, of which it is a part.
_TERMINATION = LIMIT / 16
_OF_SLABS = LIMIT - _TERMINATION  # the part of the limit that is left for them

CountSlabs = Callable[[CompleteScene, Size, Settings], int]


class _Choice(NamedTuple):
    """Factor of the rate, whether slabs are divided, as settings have it, and the estimate of the picture's error."""

    rate: float
    adaptive: str | None
    error: float | None


def _small(size: Size) -> Size:
    """Return the size of the pictures that are compared."""
    return shrunk(smaller(size), _MOST_PIXELS)


class DefaultRate:
    """Chooser of rates; it remembers the last choice.

    `draw` draws a scene with the settings, without background; `count` returns how many slabs that samples.
    """

    def __init__(self, draw: DrawScene, count: CountSlabs) -> None:
        self._draw, self._count = draw, count
        self._last: tuple[tuple[Any, ...], _Choice] | None = None  # with its key
        self.estimate: float | None = None  # of the picture for which the last rate was chosen

    def settled(self, scene: CompleteScene, size: Size, settings: Settings, chosen: Classified | None) -> Settings:
        """Return the settings with slabs that are thin enough for the scene, if it is one of classification auto.

        `chosen` is the choice of its classification; None if there was none, or if a rate is given.
        """
        self.estimate = None
        if np.isnan(settings.slab_thickness):  # a maximum error decides
            return settings
        undivided = replace(settings, adaptive=None if settings.adaptive == "auto" else settings.adaptive)
        medium = scene.transfer_function
        is_as_given = scene.lighting is None and medium is not None and not medium.by_look
        if chosen is None or chosen.classification != "post" or scene.mode != "composite" or is_as_given:
            return undivided
        if isinstance(scene.volume, LargeVolume):
            return self._in_parts(scene, size, undivided)
        # What ends rays or skips cells has no say in the rate: pictures with and without are to be compared.
        plain = replace(settings, early_termination=DEFAULT_EARLY_TERMINATION, skip_empty=True)
        parts = scene.volume, scene.transfer_function, scene.lighting, scene.mask, scene.depth_cue
        key = (*map(id, parts), f"{size} {scene.cutting} {scene.gradient} {plain}", *map(id, scene.added))
        if self._last is None or self._last[0] != key:
            self._last = key, _Search(self._draw, self._count, scene, size, plain).choice()
            self._kept = parts, scene.added  # whose identities are in the key
        rate, adaptive, self.estimate = self._last[1]
        if rate > 1 and settings.early_termination == DEFAULT_EARLY_TERMINATION:
            settings = replace(settings, early_termination=_TERMINATION)
            self.estimate = None if self.estimate is None else self.estimate + _TERMINATION
        return replace(settings, slab_thickness=settings.slab_thickness / rate, adaptive=adaptive)

    def estimated(self, scene: CompleteScene, size: Size, settings: Settings, seconds: float) -> float | None:
        """Return an estimate of the error of the last picture, from two small ones; None if they would take long.

        Two more tell what is by shadows.

        `seconds` is what the picture took. Texels of `slab` are baked for the slabs, but for labels, which are kept as
        they are; parts of a store are read for a size.
        """
        baked_for_slabs = scene.classification == "slab" and not scene.volume.nearest
        made_anew = baked_for_slabs or isinstance(scene.volume, LargeVolume)
        if self.estimate is None and made_anew and seconds > PATIENCE:
            return None
        small = _small(size)
        try:
            by_slabs = self._error(scene, size, settings) if self.estimate is None else self.estimate
            return by_slabs + ShadowError(self._draw, scene, small, settings).at(settings.shadow_nodes)
        except InputError:
            return None

    def _error(self, scene: CompleteScene, size: Size, settings: Settings) -> float:
        small, halvings = _small(size), _HALVINGS + more_halvings(scene)
        fine = self._draw(scene, small, replace(settings, slab_thickness=settings.slab_thickness / 2**halvings))
        picture = self._draw(scene, small, settings)
        return estimate(picture, fine, halvings, rounding_of(scene), math.prod(size))

    def _in_parts(self, scene: CompleteScene, size: Size, settings: Settings) -> Settings:
        """Return the settings for a volume in a store, whose parts are not read for a choice."""
        rate = 1
        while rate < _IN_PARTS:
            thinner = settings.slab_thickness / (2 * rate)
            if slabs_crossed_about(scene.box, scene.camera, thinner, size) > _MOST_IN_PARTS:
                break
            rate *= 2
        return replace(settings, slab_thickness=settings.slab_thickness / rate)


class _Search:
    """Search for the slabs of a scene by small pictures, which are kept as long as it lasts."""

    def __init__(
        self, draw: DrawScene, count: CountSlabs, scene: CompleteScene, size: Size, settings: Settings
    ) -> None:
        self._draw, self._count, self._scene, self._settings = draw, count, scene, settings
        self._small = _small(size)
        self._pixels = size[0] * size[1] / (self._small[0] * self._small[1])
        self._most = _MOST_SAMPLED_UNLIT if scene.lighting is None else _MOST_SAMPLED
        self._pictures: dict[tuple[float, str | None], NDArray[np.float32]] = {}  # by rate, and whether slabs divide
        self._is_open = settings.adaptive == "auto"
        self._found = _Choice(1.0, None if self._is_open else settings.adaptive, None)

    def choice(self) -> _Choice:
        """Return the choice; its error is None if no picture can be drawn."""
        with suppress(InputError):  # no room, or too many slabs: the picture itself says so if it has to
            self._refine()
            if self._is_open and self._scene.lighting is not None and self._found.rate > PARTS:
                self._divide()
        return self._found

    def _refine(self) -> None:
        """Raise the rate until the limit is kept, or a frame takes half a second."""
        last, most, rate = None, None, 1.0
        while True:
            self._found = self._held_against(rate, rate * 2**_HALVINGS, self._found.adaptive)
            if self._keeps_limit(self._found):
                if last:
                    self._lower(last)
                return
            if rate >= _FINEST:
                return
            last = self._found
            most = most or self._most / self._samples(1.0, last.adaptive)
            finer = float(min(2 * rate, np.floor(most / _STEP) * _STEP))
            if finer <= rate:
                return
            rate = finer

    def _lower(self, last: _Choice) -> None:
        """Lower the rate as far as it keeps the limit, if it is much; `last` is a lower one that does not."""
        assert self._found.error is not None and last.error is not None
        rate = self._found.rate
        order = np.log(last.error / max(self._found.error, 1e-12)) / np.log(rate / last.rate)
        foreseen = rate * (self._found.error / _OF_SLABS) ** (1 / max(order, 1.0))
        lower = float(np.ceil(_MARGIN * max(foreseen, last.rate) / _STEP) * _STEP)
        if lower <= _MUCH_LESS * rate:
            found = self._held_against(lower, rate * 2**_HALVINGS, last.adaptive)
            self._found = found if self._keeps_limit(found) else self._found

    def _divide(self) -> None:
        """Divide slabs in place of what was found, if that takes less time, or keeps the limit where nothing else does.

        Both are held against the finest picture that was drawn.
        """
        plain, finest = self._found, max(rate for rate, _ in self._pictures)
        rate = max(float(np.floor(plain.rate / PARTS / _STEP) * _STEP), 1.0)
        price, has_kept = _PRICE * self._samples(rate, "on") / rate, self._keeps_limit(plain)
        most = _MUCH_LESS * self._samples(plain.rate, None) if has_kept else self._most
        while rate * price <= most and 2 * PARTS * rate <= finest:
            found = self._held_against(rate, finest, "on", PARTS)
            if self._keeps_limit(found):
                self._found = found
                return
            assert found.error is not None
            foreseen = rate * (found.error / _OF_SLABS) ** (1 / _USUAL_ORDER)
            rate = max(float(np.floor(foreseen / _STEP) * _STEP), rate + _STEP)

    @staticmethod
    def _keeps_limit(found: _Choice) -> bool:
        return found.error is not None and found.error <= _OF_SLABS

    def _held_against(self, rate: float, finest: float, adaptive: str | None, parts: int = 1) -> _Choice:
        """Return a rate with its error against the finest one, in which no slab is divided more than in it.

        `parts` is of a slab, where slabs of the finest picture are whole.
        """
        against = self._picture(finest, None if parts > 1 else adaptive)
        error = estimate(self._picture(rate, adaptive), against, float(np.log2(finest / (parts * rate))))
        return _Choice(rate, adaptive, error)

    def _picture(self, rate: float, adaptive: str | None) -> NDArray[np.float32]:
        if (rate, adaptive) not in self._pictures:
            self._pictures[rate, adaptive] = self._draw(self._scene, self._small, self._at(rate, adaptive))
        return self._pictures[rate, adaptive]

    def _samples(self, rate: float, adaptive: str | None) -> float:
        """Return how many slabs a picture samples, by a small one."""
        settings = replace(self._at(rate, adaptive), early_termination=_TERMINATION)
        return max(self._count(self._scene, self._small, settings) * self._pixels, 1.0)

    def _at(self, rate: float, adaptive: str | None) -> Settings:
        return replace(self._settings, slab_thickness=self._settings.slab_thickness / rate, adaptive=adaptive)
