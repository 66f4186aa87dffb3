"""Cameras: rays, their two descriptions, framing and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.scenes import clip_from_world

from texvol.scene.camera import Camera, Projection
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (8, 6)
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


def _camera(projection: Projection) -> Camera:
    eye, target, up = (3.0, -4.0, 2.0), (0.5, 1.0, 0.25), (0.1, 0.2, 1.0)
    if projection == "perspective":
        return Camera.perspective(eye, target, up, fov=60)
    return Camera.orthographic(eye, target, up, height=5)


def test_the_middle_ray_goes_from_eye_to_target_and_the_top_row_is_up() -> None:
    camera = Camera.perspective((0, -5, 0), (0, 0, 0), (0, 0, 1), fov=90)
    origins, directions = camera.rays((3, 3))
    np.testing.assert_allclose(origins[1, 1], (0, -5, 0))
    np.testing.assert_allclose(directions[1, 1], (0, 1, 0), atol=1e-15)
    assert directions[0, 1, 2] > 0 > directions[2, 1, 2]  # up is z
    assert directions[1, 2, 0] > 0 > directions[1, 0, 0]  # right is x: right-handed
    # Pixel centres: a third of the picture is 2/3 high at depth 1.
    np.testing.assert_allclose(directions[0, 1] / directions[0, 1, 1], (0, 1, 2 / 3))


def test_orthographic_height_is_what_is_seen_from_top_to_bottom() -> None:
    origins, directions = Camera.orthographic((0, -5, 0), (0, 0, 0), (0, 0, 1), height=4).rays((6, 4))
    np.testing.assert_allclose(origins[:, 0, 2], [1.5, 0.5, -0.5, -1.5])
    np.testing.assert_allclose(origins[0, :, 0], [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5])
    np.testing.assert_allclose(directions.reshape(-1, 3), np.tile((0, 1, 0), (24, 1)), atol=1e-15)


@projections
def test_both_descriptions_of_the_rays_agree(projection: Projection) -> None:
    camera = _camera(projection)
    about = np.array([0.7, 0.3, -0.2])
    origins, directions = camera.rays(SIZE)
    rays = camera.pixel_rays(SIZE, about)
    for row in range(SIZE[1]):
        for column in range(SIZE[0]):
            x, y = column - (SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2 - row
            point = rays.point + x * rays.point_per_column + y * rays.point_per_row
            velocity = rays.velocity + x * rays.velocity_per_column + y * rays.velocity_per_row
            np.testing.assert_allclose(velocity / np.linalg.norm(velocity), directions[row, column], atol=1e-14)
            along = point + about - origins[row, column]
            np.testing.assert_allclose(np.cross(along, directions[row, column]), 0, atol=1e-13)
            assert camera.forward @ point == pytest.approx(0, abs=1e-13)
            assert camera.forward @ velocity == pytest.approx(1, abs=1e-13)


@projections
def test_projection_matrix_and_rays_agree(projection: Projection) -> None:
    camera = _camera(projection)
    aspect = SIZE[0] / SIZE[1]
    origins, directions = camera.rays(SIZE)
    points = origins + 3.3 * directions
    world = np.concatenate([points.reshape(-1, 3), np.ones((points.size // 3, 1))], axis=1)
    clip = world @ clip_from_world(camera, aspect, 0.1, 100).T
    screen = clip[:, :2] / clip[:, 3:]
    x = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1
    y = 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2
    expected = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    np.testing.assert_allclose(screen, expected, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    st.sampled_from(["orthographic", "perspective"]),
    st.floats(0.2, 5),
    st.floats(5, 140),
    st.integers(0, 2**32 - 1),
)
def test_framing_shows_the_whole_box_and_fills_the_picture(
    projection: Projection, aspect: float, fov: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    direction = np.linalg.qr(random.standard_normal((3, 3)))[0]
    volume = Volume(
        np.zeros(random.integers(1, 9, 3), np.uint8), random.uniform(0.1, 9, 3), random.uniform(-99, 99, 3), direction
    )
    camera = Camera.framing(volume, projection, fov=fov, aspect=aspect)
    corners = camera.in_eye_space(volume.corners_from_centre, volume.centre)
    depth = corners[:, 2:] if projection == "perspective" else 1.0
    assert (corners[:, 2] > 0).all()
    screen = np.abs(corners[:, :2] / depth / camera.half_height / (aspect, 1))
    assert 0.9 < screen.max() < 1


@projections
def test_what_is_given_is_kept(projection: Projection) -> None:
    volume = Volume(np.zeros((4, 5, 6), np.uint8))
    camera = Camera.framing(volume, projection, eye=(9, 8, 7), target=(1, 2, 3), up=(0, 1, 0), fov=33, height=12)
    assert camera == Camera(projection, (9, 8, 7), (1, 2, 3), (0, 1, 0), 33, 12)


def test_an_eye_above_the_box_needs_no_up() -> None:
    camera = Camera.framing(Volume(np.zeros((4, 4, 4))), eye=(1.5, 1.5, 30))
    assert camera.up == (0, 1, 0)


def test_patients_are_seen_from_the_front() -> None:
    values = np.zeros((4, 4, 4))
    assert Camera.framing(Volume(values, space="right-anterior-superior")).eye[1] > 4
    assert Camera.framing(Volume(values, space="left-posterior-superior")).eye[1] < 0


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: Camera.perspective((1, 2, 3), (1, 2, 3), (0, 0, 1)), "eye and target must differ, got 1,2,3"),
        (lambda: Camera.perspective((0, 0, 5), (0, 0, 0), (0, 0, -2)), "up must not be parallel to the view"),
        (lambda: Camera.perspective((0, 0, 5), (0, 0, 0), (0, 0, 0)), "up must not be zero"),
        (lambda: Camera.perspective((0, 0, np.nan), (0, 0, 0), (0, 1, 0)), "eye must be three finite numbers"),
        (lambda: Camera.perspective((0, 0), (0, 0, 0), (0, 1, 0)), "eye must be three finite numbers"),
        (
            lambda: Camera.perspective((0, 0, 5), (0, 0, 0), (0, 1, 0), fov=180),
            "fov must be an angle between 0",
        ),
        (lambda: Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), height=0), "height must be positive"),
        (lambda: Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), height=np.inf), "height must be positive"),
        (lambda: Camera.framing(Volume(np.zeros((1, 1, 1))), height=0), "height must be positive"),
        (lambda: Camera("fisheye", (0, 0, 5), (0, 0, 0), (0, 1, 0)), "projection must be orthographic or perspective"),  # type: ignore[arg-type]
    ],
)
def test_impossible_cameras_are_refused(make: Callable[[], Camera], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
