"""Sphere of the Light tab: lights lie where they come from, and follow the mouse."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting
from texvol.scene.volume import Volume
from texvol.util.color import linear_from_srgb
from texvol.window import light_sphere
from texvol.window.light_sphere import Spot

CAMERA = Camera.perspective((30, -20, 13), (5, 5, 5), (0, 0.2, 1))
VOLUME = Volume(np.zeros((4, 5, 6), np.float32), origin=(7, 0, -3))
FRAME = np.stack([CAMERA.right, CAMERA.upward, -CAMERA.forward])
DARK = np.zeros(3)


@pytest.mark.parametrize("spot", [Spot(0.3, -0.5), Spot(-0.2, 0.7, behind=True), Spot(0.0, 0.0)])
@pytest.mark.parametrize("light", [Light("directional", (1, 2, 3)), Light("point", (40.0, 3, 9), (1, 0.5, 0.2), 30.0)])
def test_a_light_lies_where_it_was_dragged_to(light: Light, spot: Spot) -> None:
    moved = light_sphere.moved(light, spot, CAMERA, VOLUME)
    found = light_sphere.spot_of(moved, CAMERA, VOLUME)
    assert (found.x, found.y) == pytest.approx((spot.x, spot.y)) and found.behind == spot.behind
    assert (moved.kind, moved.color, moved.fall_off) == (light.kind, light.color, light.fall_off)
    if light.kind == "point":
        distances = [np.linalg.norm(np.array(each.vector) - VOLUME.centre) for each in (light, moved)]
        assert distances[0] == pytest.approx(distances[1])


def test_a_head_light_is_in_the_middle_and_becomes_directional() -> None:
    assert light_sphere.spot_of(Light(), CAMERA, VOLUME) == Spot(pytest.approx(0), pytest.approx(0))  # type: ignore[arg-type]
    moved = light_sphere.moved(Light(color=(1, 0, 0)), Spot(0.6, 0.0), CAMERA, VOLUME)
    assert moved.kind == "directional" and moved.color == (1, 0, 0)
    np.testing.assert_allclose(np.array(moved.vector), FRAME.T @ [0.6, 0, 0.8])


def test_over_the_rim_is_the_other_half() -> None:
    assert light_sphere.dragged(Spot(0.5, 0), 0.9, 0) == Spot(0.9, 0)
    assert light_sphere.dragged(Spot(0.5, 0), 1.25, 0) == Spot(0.75, 0, behind=True)
    assert light_sphere.dragged(Spot(0.5, 0, behind=True), 0, -1.5) == Spot(0, -0.5)
    far = light_sphere.dragged(Spot(0, 0), 50, 0)
    assert far.behind and 0 <= far.x < 0.01


def test_the_sphere_is_bright_where_the_light_comes_from() -> None:
    light = Light("directional", tuple(FRAME.T @ [-0.6, 0, 0.8]), (1, 0.5, 0))  # type: ignore[arg-type]
    lighting = Lighting((light,), ambient=0.1, diffuse=0.5, specular=0.0)
    picture = linear_from_srgb(light_sphere.shaded(lighting, CAMERA, VOLUME, 101, DARK) / 255)
    row, column = np.unravel_index(picture[..., 0].argmax(), picture.shape[:2])
    # In 8 bits the brightest place is as wide as the cosine of 8 degrees is near 1.
    assert (row - 50, column - 50) == (pytest.approx(0, abs=8), pytest.approx(-30, abs=8))
    # In the middle N·L is 0.8: straight colour 0.8 times ambient + diffuse N·L.
    np.testing.assert_allclose(picture[50, 50], 0.8 * (0.1 + 0.5 * 0.8 * np.array([1, 0.5, 0])), atol=0.005)
    assert not picture[0, 0].any(), "beside the sphere is the panel"


def test_a_light_from_behind_shows_at_the_rim_only() -> None:
    light = Light("directional", tuple(FRAME.T @ [0, 0.6, -0.8]))  # type: ignore[arg-type]
    picture = light_sphere.shaded(Lighting((light,), ambient=0.0), CAMERA, VOLUME, 101, DARK)
    assert not picture[50:, 50].any() and picture[2, 50].all()
