"""The thickness of a scene's slabs for a wanted error: foreseen by a small picture, found by the picture itself."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.error_control import Begin, Choice, reference_for, thickness_for_error
from texvol.errors import AccuracyWarning
from texvol.recipe import Settings
from texvol.scene import Scene

Size = tuple[int, int]
Draw = Callable[[Scene, Size, Settings], NDArray[np.float32]]

_LEAST_ESTIMATED = 48  # pixels along each side: fewer may miss where the error is


def smaller(size: Size) -> Size:
    """A sixteenth of the pixels, where that leaves enough of them."""
    width, height = (max(side // 4, min(side, _LEAST_ESTIMATED)) for side in size)
    return width, height


class ErrorSearch:
    """Looks for thicknesses, and remembers the last that was foreseen.

    Parameters
    ----------
    draw, draw_reference : callable
        Draw a scene, and what it is held against (`error_control.reference_for`).
    """

    def __init__(self, draw: Draw, draw_reference: Draw) -> None:
        self._draw, self._draw_reference = draw, draw_reference
        self._last: tuple[Scene, tuple[Size, Settings, float], Choice] | None = None

    def foresee(self, scene: Scene, size: Size, settings: Settings, wanted: float) -> Choice:
        """What a picture of a sixteenth of the pixels says of the one in that size.

        The error is the largest of all pixels, and hardly twice another in a sixteenth of them: a part of what is
        wanted is asked of these. An estimate by pictures of one kind is about twice the error, so that half of it will
        do; one by a reference that knows its own is the error itself.
        """
        asked = size, replace(settings, slab_thickness=0.0), wanted
        if self._last is None or self._last[0] is not scene or self._last[1] != asked:
            share = 2 if reference_for(scene) is scene else 4
            found = self._search(scene, smaller(size), settings, wanted / share)
            # A reference is dear, and refines itself where it has to: it begins as for twice the error.
            begin = replace(found.begin, reference=found.begin.reference / 2)
            self._last = scene, asked, replace(found, estimated_error=share * found.estimated_error, begin=begin)
        return self._last[2]

    def choose(self, scene: Scene, size: Size, settings: Settings, wanted: float) -> Choice:
        """The picture of the coarsest slabs that keep the error, beginning with what is foreseen.

        Warns
        -----
        AccuracyWarning
            Where the error can't be reached.
        """
        choice = self._search(scene, size, settings, wanted, self.foresee(scene, size, settings, wanted).begin)
        if not choice.reached:
            warnings.warn(
                f"an error of {wanted:g} was wanted and {choice.estimated_error:.2g} was reached, by estimate, "
                f"at slab thickness {choice.slab_thickness:g}",
                AccuracyWarning,
                stacklevel=4,
            )
        return choice

    def _search(
        self, scene: Scene, size: Size, settings: Settings, wanted: float, begin: Begin | None = None
    ) -> Choice:
        return thickness_for_error(
            lambda thickness: self._draw(scene, size, replace(settings, slab_thickness=thickness)),
            lambda thickness: self._draw_reference(scene, size, replace(settings, slab_thickness=thickness)),
            scene.smallest_spacing,
            wanted,
            begin,
            converges_alone=reference_for(scene) is not scene,
        )
