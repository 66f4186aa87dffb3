"""Where the texture memory is small: what does not fit is not needed."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import FOG, smooth_volume

from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import Classification, Scene

SIZE = (40, 36)


def wide_view(classification: Classification, width: int = 40) -> Scene:
    """Slabs are several times as long in the corners as in the middle, which bricks need around them."""
    volume = smooth_volume(width)
    eye = volume.centre + np.array((60, 9, 5)) * width / 40
    camera = Camera.perspective(eye, volume.centre, (0, 0, 1), fov=150)
    return Scene(volume, FOG, camera, classification=classification)


@pytest.mark.parametrize("classification", ["slab", "extinction"])
def test_an_estimate_makes_do_with_the_bricks_that_fit(classification: Classification) -> None:
    """Texels of what stands for the integral are larger, and with slabs of half the thickness no brick has room."""
    scene = wide_view(classification)
    with Renderer(texture_memory=0.26) as renderer:
        picture = renderer.render(scene, SIZE, slab_thickness=15, texture_format="rgba8")
        stats = renderer.stats
    assert stats["bricks_total"] == 1
    assert np.abs(picture - raycast(scene, SIZE)).max() <= stats["estimated_error"] < 0.1


def test_an_estimate_that_there_is_no_room_for_is_left_out() -> None:
    with Renderer(texture_memory=0.02) as renderer:
        assert renderer.render(Scene(smooth_volume(16), FOG, classification="slab"), SIZE, texture_format="rgba8").any()
        assert renderer.stats["estimated_error"] is None and renderer.stats["samples"] > 0


def test_an_estimate_is_left_out_where_the_small_picture_is_too_wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """The small picture's sides are rounded, and slabs are longer in the corners of a wider one."""
    monkeypatch.setattr("texvol.rendering.late_estimate.smaller", lambda size: (200, 20))
    with Renderer(texture_memory=0.1) as renderer:
        assert renderer.render(wide_view("slab", 28), SIZE, slab_thickness=2.0, texture_format="rgba8").any()
        assert renderer.stats["estimated_error"] is None
        monkeypatch.undo()
        assert renderer.render(wide_view("slab", 28), SIZE, slab_thickness=2.0, texture_format="rgba8").any()
        assert renderer.stats["estimated_error"] is not None


def test_a_wanted_error_asks_for_no_thicker_slabs_than_there_is_room_for() -> None:
    scene, thicknesses = wide_view("post"), []
    truth = raycast(scene, SIZE)
    for megabytes in (None, 0.2):
        with Renderer(texture_memory=megabytes) as renderer:
            assert np.abs(renderer.render(scene, SIZE, max_error=0.3) - truth).max() < 0.3
            thicknesses.append(renderer.settings["slab_thickness"])
    assert thicknesses[1] < thicknesses[0]
