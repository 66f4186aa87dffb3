"""Lines: which pixels they cover, at which depth, and how translucent ones overlap."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.scenes import constant, inside, random_volume
from support.shapes import box_ends, fog_between

from texvol import Camera, InputError, Renderer, Scene, Volume, raycast
from texvol.geometry import Lines

NOTHING = Volume(np.zeros((4, 4, 4)))
FACING = Camera.orthographic((0, 0, 50), (0, 0, 0), (0, 1, 0), height=16)  # a pixel of a world unit at 16 rows
SIZE = (24, 16)
BOX = random_volume(5, (13, 9, 14))


def both(renderer: Renderer, scene: Scene, size: tuple[int, int] = SIZE) -> np.ndarray:
    """What the renderer draws, once the oracle agrees to float32's rounding."""
    picture, truth = renderer.render(scene, size), raycast(scene, size)
    assert np.abs(picture - truth).max() < 2e-6
    return truth


def middles() -> tuple[np.ndarray, np.ndarray]:
    """x and y of pixels' middles in the world."""
    return np.meshgrid(np.arange(24) - 11.5, 7.5 - np.arange(16))


@pytest.mark.parametrize("width", [1.0, 2.5, 6.0])
def test_a_pixel_belongs_to_a_line_within_half_its_width(renderer: Renderer, width: float) -> None:
    """A capsule: an oblique line with round ends, in the plane of the world that the picture shows."""
    a, b = np.array([-7.3, -3.1]), np.array([6.2, 4.4])
    lines = Lines([(*a, 0.0), (*b, 5.0)], [(0, 1)], (1, 0.5, 0.2), 0.6, width)
    truth = both(renderer, Scene(NOTHING, constant(0.0), FACING, geometry=(lines,), classification="slab"))
    x, y = middles()
    fraction = np.clip(((x - a[0]) * (b - a)[0] + (y - a[1]) * (b - a)[1]) / ((b - a) @ (b - a)), 0, 1)
    away = np.hypot(x - a[0] - fraction * (b - a)[0], y - a[1] - fraction * (b - a)[1])
    np.testing.assert_allclose(truth[..., 3], np.where(away <= width / 2, 0.6, 0.0), atol=1e-12)
    assert (truth[..., 3] > 0).sum() >= 14, "no gap: in every column that it crosses"


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("upright", [False, True])
def test_a_line_between_two_rows_of_pixels_covers_one(renderer: Renderer, flipped: bool, upright: bool) -> None:
    """Both rows' middles are exactly half the width away; which way the line goes makes no difference."""
    ends = np.array([(-6.0, 0.0, 0.0), (6.0, 0.0, 0.0)])
    if upright:
        ends = ends[:, [1, 0, 2]]
    lines = Lines(ends, [(1, 0)] if flipped else [(0, 1)], (1, 1, 1), 1.0, 1.0)
    picture = both(renderer, Scene(NOTHING, constant(0.0), FACING, geometry=(lines,), classification="slab"))[..., 3]
    covered = np.argwhere(picture > 0)
    assert len(covered) == 12
    assert set(covered[:, 1 if upright else 0]) == {11 if upright else 7} or len(set(covered[:, int(upright)])) == 1
    # The row is the same either way.
    other = Lines(ends, [(0, 1)], (1, 1, 1), 1.0, 1.0)
    np.testing.assert_array_equal(
        picture, raycast(Scene(NOTHING, constant(0.0), FACING, geometry=(other,), classification="slab"), SIZE)[..., 3]
    )


@pytest.mark.parametrize(
    "projection, ends",
    [
        ("orthographic", ((-0.5, -0.4, -0.2), (0.4, 0.5, 0.3))),
        ("perspective", ((0.1, -0.9, 0.2), (-0.6, 0.5, 0.1))),
    ],
)
def test_a_line_in_fog_is_where_the_ray_comes_nearest_to_it(renderer: Renderer, projection: str, ends: Any) -> None:
    """A ray through a pixel meets it where, in the picture, it is nearest: found by trying places along the line."""
    c, r = BOX.centre, BOX.radius
    camera = Camera.framing(BOX, projection, eye=c + r * np.array([1.5, -2.0, 1.2]))  # type: ignore[arg-type]
    ends = c + r * np.array(ends)
    size, width = (36, 32), 3.0
    lines = Lines(ends, [(0, 1)], (0.1, 0.9, 0.4), 0.7, width)
    scene = Scene(BOX, constant(0.2), camera, geometry=(lines,), classification="slab")
    picture = renderer.render(scene, size)
    eyes, directions = camera.rays(size)
    positions = ends[0] + np.linspace(0, 1, 20001)[:, np.newaxis] * (ends[1] - ends[0])
    on_screen = camera.in_eye_space(positions - c, c)
    scale = size[1] / 2 / camera.half_height / (on_screen[:, 2] if projection == "perspective" else 1.0)
    x, y = on_screen[:, 0] * scale + 17.5, 15.5 - on_screen[:, 1] * scale
    nearest, least = np.empty((32, 36), int), np.empty((32, 36))
    for row in range(32):
        away = np.hypot(np.arange(36)[:, np.newaxis] - x, row - y)
        nearest[row], least[row] = away.argmin(axis=-1), away.min(axis=-1)
    # The places are 1e-4 pixels apart: of a distance near the rim that says nothing.
    sure = np.abs(least - width / 2) > 1e-3
    depth = on_screen[nearest, 2] / (directions @ camera.forward)
    at = np.where(least < width / 2, depth, np.inf)
    exact = fog_between((0.9, 0.6, 0.3), 0.2, box_ends(BOX, eyes, directions), [(at, (0.1, 0.9, 0.4, 0.7))])
    assert sure.mean() > 0.99
    # Half the way between two places, in optical depth: r 1.5 / 20000 / 2 * 0.2.
    assert np.abs(picture - exact)[sure].max() < 1e-5 * r
    assert np.abs(picture - raycast(scene, size)).max() < 2e-6


def test_translucent_joints_and_crossings_are_no_darker(renderer: Renderer) -> None:
    points = np.array([(-8, -5, 0), (0, 5, 1), (8, -5, 2), (-8, 2, 3), (8, 2, -3)], float)
    lines = Lines(points, [(0, 1, 2), (3, 4)], (1, 1, 1), 0.5, 3.0)
    picture = both(renderer, Scene(NOTHING, constant(0.0), FACING, geometry=(lines,), classification="slab"))
    assert set(np.round(np.unique(picture[..., 3]), 9)) == {0.0, 0.5}
    # Two of them count each for itself.
    apart = (Lines(points, [(0, 1, 2)], (1, 1, 1), 0.5, 3.0), Lines(points, [(3, 4)], (1, 1, 1), 0.5, 3.0))
    picture = both(renderer, Scene(NOTHING, constant(0.0), FACING, geometry=apart, classification="slab"))
    assert set(np.round(np.unique(picture[..., 3]), 9)) == {0.0, 0.5, 0.75}


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_lines_past_the_eye(renderer: Renderer, projection: str) -> None:
    """From behind the eye to in front of it, through and beside the picture, and along the view."""
    camera = inside(BOX, projection)  # type: ignore[arg-type]
    eye, right, up, forward = np.array(camera.eye), camera.right, camera.upward, camera.forward
    r = BOX.radius
    points = [eye + r * p @ np.array([right, up, forward]) for p in np.random.default_rng(2).uniform(-1, 1, (40, 3))]
    points += [eye - r * forward + 0.1 * right, eye + r * forward + 0.1 * right, eye + 0.3 * r * forward]
    segments = [*zip(range(0, 40, 2), range(1, 40, 2), strict=True), (40, 41), (42, 42)]
    lines = Lines(points, segments, (0.2, 0.9, 0.8), 0.6, 2.5)
    picture = both(renderer, Scene(BOX, constant(0.1), camera, geometry=(lines,), classification="slab"), (72, 64))
    bare = raycast(Scene(BOX, constant(0.1), camera, classification="slab"), (72, 64))
    assert 0.05 < (np.abs(picture - bare).max(axis=-1) > 0.01).mean() < 0.9
    behind = Lines(points[:1] + [eye - r * forward, eye - 2 * r * forward + r * up], [(1, 2)], width=9.0)
    np.testing.assert_array_equal(
        raycast(Scene(BOX, constant(0.1), camera, geometry=(behind,), classification="slab"), (72, 64)), bare
    )


def test_more_translucent_lines_than_a_place_remembers_are_refused(renderer: Renderer) -> None:
    def scene(count: int, opacity: float) -> Scene:
        made = tuple(Lines([(-8, y, 0), (8, y, 0)], [(0, 1)], opacity=opacity) for y in np.linspace(-6, 6, count))
        return Scene(NOTHING, constant(0.0), FACING, geometry=made, classification="slab")

    both(renderer, scene(24, 0.5))
    both(renderer, scene(40, 1.0))
    with pytest.raises(InputError, match="at most 24 Lines can be translucent, got 25"):
        renderer.render(scene(25, 0.5), SIZE)
