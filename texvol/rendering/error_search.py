"""Search for the slab thickness of an error: begun with a small picture, ended with the picture itself."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.error_control import Begin, Choice, converging, finest_rate, rounding_of, thickness_for_error
from texvol.rendering.settings import Settings
from texvol.scene.scene import CompleteScene
from texvol.util.errors import AccuracyWarning

Size = tuple[int, int]
Draw = Callable[[CompleteScene, Size, Settings], NDArray[np.float32]]

_LEAST_ESTIMATED = 48  # pixels along each side: fewer may miss the largest error


def smaller(size: Size) -> Size:
    """Return a size of a sixteenth of the pixels, with at least _LEAST_ESTIMATED along each side."""
    width, height = (max(side // 4, min(side, _LEAST_ESTIMATED)) for side in size)
    return width, height


class ErrorSearch:
    """Search for slab thicknesses; it remembers the last rates found with a small picture.

    Parameters
    ----------
    draw, draw_exactly : callable
        Draw a scene with the settings, and without the rounding and early termination in them.
    rounding : callable
        Returns the error that the rounding of values adds to the scene that was drawn last.
    """

    def __init__(self, draw: Draw, draw_exactly: Draw, rounding: Callable[[CompleteScene], float]) -> None:
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
        """Return the picture of the coarsest slabs that keep the error; the search begins with `foresee`.

        Warns
        -----
        AccuracyWarning
            If the error cannot be reached.
        """
        choice = self._search(scene, size, settings, wanted, self.foresee(scene, size, settings, wanted).begin)
        if not choice.reached:
            warnings.warn(
                f"requested error of {wanted:g} not reached: {choice.estimated_error:.2g} by estimate, "
                f"at slab thickness {choice.slab_thickness:g}",
                AccuracyWarning,
                stacklevel=4,
            )
        return choice

    def _search(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float, begin: Begin | None = None
    ) -> Choice:
        reference = converging(scene)
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
        )
