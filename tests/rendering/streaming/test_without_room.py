"""Several volumes in memory whose textures have no room on the device together are drawn part by part."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.large import large
from support.quick_stats import quick_stats
from support.scenes import FOG, smooth_volume
from support.several import turned

from texvol import AddedVolume, Camera, Lighting, Renderer, Scene, Volume
from texvol.scene.scene import CLASSIFICATIONS

SIZE = (48, 40)
# Positions in textures of other sizes, and blends of other parts, are rounded to 1e-6; gradients of parts are rounded
# to 16 bits of another range.
ROUNDING = 3e-5


def scene_of(beside: Volume, **how: Any) -> Scene:
    volume = smooth_volume(32)
    eye = volume.centre + volume.radius * np.array([1.6, -2.0, 1.1])
    camera = Camera.framing(volume, "perspective", eye=eye)
    added = AddedVolume(beside, None if beside.labels else FOG)
    return Scene(volume, FOG, camera, added=(added,), **({"classification": "post"} | how))


def beside() -> Volume:
    moved: Volume = smooth_volume(32).moved(turned(20, shift=(0.3, 0.2, 0.1)))
    return moved


@pytest.mark.parametrize("how", [*CLASSIFICATIONS, "lit", "labels"])
def test_the_picture_is_the_same(renderer: Renderer, how: str) -> None:
    other = beside()
    if how == "labels":
        other = Volume(np.rint(3 * other.values).astype(np.uint8), other.spacing, other.origin, labels=True)
    lighting = Lighting() if how == "lit" else None
    scene = scene_of(other, classification=how if how in CLASSIFICATIONS else "post", lighting=lighting)
    accuracy: dict[str, Any] = {"texture_format": "rgba32f", "sampling_rate": 1.5}
    expected = renderer.render(scene, SIZE, **accuracy)
    with Renderer(texture_memory=0.15) as small:
        for _ in range(2):
            np.testing.assert_allclose(small.render(scene, SIZE, **accuracy), expected, atol=ROUNDING)
        assert quick_stats(small)["bricks_total"] > 2


def test_an_error_is_kept_and_an_orbit_drawn(renderer: Renderer) -> None:
    scene = scene_of(beside())
    with Renderer(texture_memory=0.1) as small:
        picture = small.render(scene, SIZE, max_error=0.01, check=20)
        assert small.stats["estimated_error"] <= 0.01 and small.stats["check"]["pixels"] >= 20
        assert np.abs(picture - renderer.render(scene, SIZE, sampling_rate=8)).max() < 0.012
        frames = list(small.orbit(scene, 2, SIZE, sampling_rate=2))
    with Renderer() as large:
        expected = list(large.orbit(scene, 2, SIZE, sampling_rate=2))
    np.testing.assert_allclose(frames, expected, atol=ROUNDING)


def test_stores_that_fit_in_memory_only(renderer: Renderer) -> None:
    """It is known before anything is read that there is no room, so that samples are read once."""
    scene = scene_of(beside())
    expected = renderer.render(scene, SIZE, sampling_rate=1)
    (first, (source, *_)), (other, _) = (large(each, levels=1) for each in scene.volumes)
    stored = replace(scene, volume=first, added=(AddedVolume(other, FOG),))
    with Renderer(texture_memory=0.06) as small:
        for _ in range(2):
            np.testing.assert_allclose(small.render(stored, SIZE, sampling_rate=1), expected, atol=ROUNDING)
    assert source.reads.max() == 1


def test_volumes_that_have_room_are_drawn_at_once(renderer: Renderer) -> None:
    renderer.render(scene_of(beside()), SIZE)
    assert quick_stats(renderer)["bricks_total"] == 2 and "parts" not in quick_stats(renderer)
