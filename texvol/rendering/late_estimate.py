"""Estimate of a drawn picture's error, and of its medium's, by pictures of a sixteenth of its pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.rendering import error_control
from texvol.rendering.error_control import smaller
from texvol.rendering.model_error import model_error
from texvol.rendering.pictures import Pictures
from texvol.rendering.settings import Settings
from texvol.rendering.shadow_error import ShadowError
from texvol.scene.scene import CompleteScene


class Estimates(NamedTuple):
    """Estimated largest errors of a picture; each is None as long as it is not known."""

    error: float | None = None  # of the picture against the integral of its classification
    of_model: float | None = None  # of its medium beside that of post
    of_shadows: float | None = None  # by the nodes of shadows, a part of the first
    quick: float | None = None  # of the picture, by two small pictures

    @property
    def metadata(self) -> dict[str, float | None]:
        """Entries of `--stats`, without the first."""
        found = {"estimated_model_error": self.of_model, "estimated_shadow_error": self.of_shadows}
        return {name: error_control.if_finite(error) for name, error in found.items()}


Draw = Callable[[CompleteScene, tuple[int, int], Settings], NDArray[np.float32]]
_REFERENCE_BYTES = 64 << 20  # most bytes of textures for a picture that an estimate is made from


def estimates(
    pictures: Pictures,
    draw: Draw,
    exactly: Draw,
    scenes: tuple[CompleteScene, CompleteScene],
    size: tuple[int, int],
    settings: Settings,
    known: Estimates,
) -> Estimates:
    """Return the estimated errors of a picture.

    Parameters
    ----------
    draw, exactly : callable
        Draw a scene by its settings, or as a reference.
    scenes : (CompleteScene, CompleteScene)
        The scene as it was drawn, and before its volume was refined.
    known : Estimates
        Those that the choice of thickness and nodes has found.

    Raises
    ------
    NoRoomError
        If a small picture needs larger margins around bricks than there is memory for.
    """
    scene, unrefined = scenes
    small = smaller(size)
    picture = draw(scene, small, settings) if known.error is None else None
    with pictures.set_aside(None if scene.added else _REFERENCE_BYTES):
        of_model = model_error(scene, unrefined, small, settings, exactly)
        of_shadows = known.of_shadows
        if of_shadows is None:
            of_shadows = ShadowError(exactly, scene, small, settings).at(settings.shadow_nodes)
        known = known._replace(of_model=of_model, of_shadows=of_shadows)
        if picture is None:
            return known
        by_finer = error_control.estimate_by_finer(
            scene,
            picture,
            settings.slab_thickness,
            lambda other, thickness: exactly(other, small, replace(settings, slab_thickness=thickness)),
        )
    return known._replace(error=by_finer + pictures.rounding(scene) + of_shadows)
