"""Forecast of the seconds that pictures take on two cores, for progress that is told while they are made.

What counts is how the parts of the work compare, so that fractions of the forecast are fractions of time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from texvol.opengl.texture_store import SECONDS_OF_A_GRADIENT, SECONDS_OF_A_LIT_SAMPLE, SECONDS_OF_A_SAMPLE
from texvol.rendering.checking import ALL, seconds_of_oracle
from texvol.rendering.settings import Settings
from texvol.scene.gradient import seconds_of
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.slabs import slabs_crossed_about
from texvol.textures.shaded_samples import needs_samples

Size = tuple[int, int]
_OF_A_SLAB, _OF_A_LIT_SLAB = 2e-9, 5e-9  # where a ray crosses it
_OF_A_PIXEL, _LEAST = 1e-7, 0.02  # seconds of a pixel, and of a picture of few
_USUAL_RATE = 2.0  # that an error asks for, as long as nothing is known of it
# Pictures of an error's search, in pictures at the rate that it ends with: this one, those of twice and four times the
# slabs, and small ones before them.
_SEARCH = 2.25


def of_drawing(scene: CompleteScene, size: Size, settings: Settings) -> float:
    """Return about how long a picture takes to be drawn, without its textures."""
    crossed = slabs_crossed_about(scene.box, scene.camera, settings.slab_thickness, size) * len(scene.volumes)
    lit_when_drawn = scene.lighting is not None and scene.classification in ("post", "integrated", "auto")
    pixels = size[0] * size[1]
    whole = crossed * (_OF_A_LIT_SLAB if lit_when_drawn else _OF_A_SLAB) + pixels * _OF_A_PIXEL
    share = 1.0
    if settings.regions is not None:
        share = sum(width * height for _, _, width, height in settings.regions) / pixels
    return share * whole + _LEAST


def of_textures(scene: Scene) -> float:
    """Return about how long the textures of a scene take to be made."""
    total = 0.0
    for alone in scene.completed((64, 64)).each_alone():
        volume = alone.volume
        each = SECONDS_OF_A_SAMPLE
        if alone.classification in ("slab", "extinction"):
            each = SECONDS_OF_A_LIT_SAMPLE if needs_samples(alone) else each
        elif alone.needs_gradient:
            total += 2 * seconds_of(volume, alone.gradient)  # for the largest, and for the texels
            each = SECONDS_OF_A_GRADIENT
        total += volume.size * each
    return total


def of_what_textures(scene: Scene) -> tuple[Any, ...]:
    """Return what the textures of a scene are made of: with the same parts they are not made again."""
    lit = bool(scene.lighting), scene.gradient
    return (*scene.volumes, scene.transfer_function, *lit) if scene.classification == "slab" else (*scene.volumes, *lit)


def of_picture(scene: Scene, size: Size, accuracy: Mapping[str, Any], *, has_textures: bool = False) -> float:
    """Return about how long `Renderer.render` takes with these arguments."""
    if isinstance(scene.volume, LargeVolume):
        return 0.0  # parts are counted as they are read
    complete = scene.completed(size)
    thickness, rate = accuracy.get("slab_thickness"), accuracy.get("sampling_rate")
    check, searches = accuracy.get("check"), accuracy.get("max_error") is not None
    if thickness is None:
        thickness = scene.smallest_spacing / (rate or _USUAL_RATE)
    if not thickness > 0:
        return 0.0  # no picture will be drawn
    settings = Settings(min(thickness, 2 * scene.box.radius), "auto", "auto", 0.0, skip_empty=True)
    drawing = of_drawing(complete, size, settings) * (_SEARCH if searches else 1.0)
    checking = 0.0 if check is None else seconds_of_oracle(scene, size[0] * size[1] if check == ALL else int(check))
    return drawing + checking + (0.0 if has_textures else of_textures(scene))


def of_foreseeing(scene: CompleteScene, size: Size) -> float:
    """Return about how long the pictures of a sixteenth of the pixels take that a search for an error begins with."""
    settings = Settings(scene.smallest_spacing, "auto", "auto", 0.0, skip_empty=True)
    small = max(size[0] // 4, 1), max(size[1] // 4, 1)
    return of_search(scene, small, settings, 2 * _USUAL_RATE, 2 * _USUAL_RATE)


def of_search(scene: CompleteScene, size: Size, settings: Settings, rate: float, reference: float) -> float:
    """Return about how long a search for an error takes that begins at these rates, with textures as they are."""
    return of_passes(scene, size, settings, [(each, 1.0) for each in (rate, reference, 2 * reference)])


def of_passes(scene: CompleteScene, size: Size, settings: Settings, passes: Sequence[tuple[float, float]]) -> float:
    """Return about how long pictures take, given the rate of each, and the share of the pixels that it draws."""
    spacing = scene.smallest_spacing
    return sum(
        share * of_drawing(scene, size, replace(settings, slab_thickness=spacing / rate)) for rate, share in passes
    )
