"""Estimate of a drawn picture's error, and of its medium's, by pictures of a sixteenth of its pixels."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.rendering import error_control
from texvol.rendering.error_control import smaller
from texvol.rendering.gradient_rounding import gradient_rounding
from texvol.rendering.model_error import has_model, model_error, thickness_of_media
from texvol.rendering.pictures import Pictures
from texvol.rendering.settings import Settings
from texvol.rendering.shadow_error import ShadowError
from texvol.scene.scene import CompleteScene
from texvol.textures.value_texture import Rounded


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


@dataclass(frozen=True)
class OwnTexels:
    """Knowledge of a picture's error from pictures of its own texels.

    Attributes
    ----------
    hidden : {"nothing", "gradients", "values"}
        Part of the texels whose rounding may make two such pictures wrong alike. What it does is estimated of gradients
        from samples, see `gradient_rounding`, and else shown by a picture of other texels.
    by_slabs : float, optional
        Error by the thickness of the slabs, if the choice of the default rate has found it by two of them.
    """

    hidden: Rounded
    by_slabs: float | None = None


def estimates(
    pictures: Pictures,
    draw: Draw,
    exactly: Draw,
    scenes: tuple[CompleteScene, CompleteScene],
    size: tuple[int, int],
    settings: Settings,
    known: Estimates,
    own: OwnTexels,
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
    small, shared = smaller(size), thickness_of_media(unrefined) if has_model(scene) else 0.0
    by_gradients = gradient_rounding(scene) if own.hidden == "gradients" else None
    shows_all = own.hidden == "nothing" or by_gradients is not None  # what pictures of the own texels can show
    by_slabs = None if own.hidden == "values" else own.by_slabs
    picture = None
    if known.error is None and not (shows_all and by_slabs is not None):
        picture = draw(scene, small, settings if by_slabs is None else _exact_in_own_texels(settings))
    of_own = partial(_drawn_in_own_texels, draw)
    exactly = _once_each(of_own if shows_all else exactly)
    most_bytes = None if scene.added else _REFERENCE_BYTES
    with pictures.set_aside(most_bytes, exact_gradients=not shows_all):
        of_model = model_error(scene, unrefined, small, settings, exactly)
        of_shadows = known.of_shadows
        if of_shadows is None:
            of_shadows = ShadowError(exactly, scene, small, settings).at(settings.shadow_nodes)
        known = known._replace(of_model=of_model, of_shadows=of_shadows)
        if known.error is not None:
            return known
        if picture is not None and by_slabs is not None:
            by_slabs += error_control.largest_difference(picture, exactly(scene, small, settings))
        elif picture is not None:
            by_slabs = _by_finer(scene, picture, settings, exactly, shared, math.prod(size))
    assert by_slabs is not None
    by_texels = math.hypot(by_slabs, by_gradients or 0.0)  # slabs and rounding know nothing of each other
    return known._replace(error=by_texels + pictures.rounding(scene) + of_shadows)


def _exact_in_own_texels(settings: Settings) -> Settings:
    """Return the settings of a reference in the texels of the picture itself."""
    return replace(settings.exact, texture_format=settings.texture_format)


def _drawn_in_own_texels(
    draw: Draw, scene: CompleteScene, size: tuple[int, int], settings: Settings
) -> NDArray[np.float32]:
    return draw(scene, size, _exact_in_own_texels(settings))


def _by_finer(
    scene: CompleteScene,
    picture: NDArray[np.float32],
    settings: Settings,
    exactly: Draw,
    drawn_anyway: float,
    pixels: int,
) -> float:
    """Estimate the error by the thickness of the slabs from a finer picture; see `estimate_by_finer`."""
    size = picture.shape[1], picture.shape[0]

    def finer(scene: CompleteScene, thickness: float) -> NDArray[np.float32]:
        return exactly(scene, size, replace(settings, slab_thickness=thickness))

    return error_control.estimate_by_finer(scene, picture, settings.thinnest, finer, pixels, drawn_anyway)


def _once_each(draw: Draw) -> Draw:
    """Return a function that draws each picture once."""
    drawn: list[tuple[CompleteScene, tuple[int, int], Settings, NDArray[np.float32]]] = []

    def draw_once(scene: CompleteScene, size: tuple[int, int], settings: Settings) -> NDArray[np.float32]:
        for *known, picture in drawn:
            if known == [scene, size, settings]:
                return picture
        picture = draw(scene, size, settings)
        drawn.append((scene, size, settings, picture))
        return picture

    return draw_once
