"""Estimate of a drawn picture's error, and of its medium's, by pictures of a sixteenth of its pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.rendering import error_control
from texvol.rendering.error_control import smaller
from texvol.rendering.model_error import model_error
from texvol.rendering.pictures import Pictures
from texvol.rendering.settings import Settings
from texvol.scene.scene import CompleteScene

Draw = Callable[[CompleteScene, tuple[int, int], Settings], NDArray[np.float32]]
_REFERENCE_BYTES = 64 << 20  # most bytes of textures for a picture that an estimate is made from


def estimates(
    pictures: Pictures,
    draw: Draw,
    exactly: Draw,
    scenes: tuple[CompleteScene, CompleteScene],
    size: tuple[int, int],
    settings: Settings,
    known: float | None,
) -> tuple[float, float | None]:
    """Return the estimated error of a picture, and the model error of its medium.

    Parameters
    ----------
    draw, exactly : callable
        Draw a scene by its settings, or as a reference.
    scenes : (CompleteScene, CompleteScene)
        The scene as it was drawn, and before its volume was refined.
    known : float, optional
        The estimate, if the choice of the thickness has found it.

    Raises
    ------
    NoRoomError
        If a small picture needs larger margins around bricks than there is memory for.
    """
    scene, unrefined = scenes
    small = smaller(size)
    picture = draw(scene, small, settings) if known is None else None
    with pictures.set_aside(None if scene.added else _REFERENCE_BYTES):
        of_model = model_error(scene, unrefined, small, settings, exactly)
        if known is not None or picture is None:
            return known or 0.0, of_model
        by_finer = error_control.estimate_by_finer(
            scene,
            picture,
            settings.slab_thickness,
            lambda other, thickness: exactly(other, small, replace(settings, slab_thickness=thickness)),
        )
    return by_finer + pictures.rounding(scene), of_model
