"""Polygons cover what they stand for, and slabs keep their phase."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from texvol.scene.camera import Camera, Projection
from texvol.scene.volume import Volume
from texvol.slicing import bricks
from texvol.slicing.slabs import WHOLE_BOX, SlabStacks, slab_stacks
from texvol.util.errors import InputError

SIZE = (64, 48)
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)


def _camera(volume: Volume, view: tuple[float, float, float], distance: float, projection: Projection) -> Camera:
    unit = np.array(view) / np.linalg.norm(view)
    up = np.eye(3)[np.argmin(np.abs(unit))]
    eye = volume.centre - distance * volume.radius * unit
    if projection == "perspective":
        return Camera.perspective(eye, eye + unit, up, fov=70)
    return Camera.orthographic(eye, eye + unit, up, height=1.7 * volume.radius)


def _covers(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which points lie in a convex polygon whose corners run counter-clockwise."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    offsets = points[:, np.newaxis] - polygon
    return (edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0] >= -1e-12).all(axis=1)


@settings(max_examples=60, deadline=None)
@given(directions, st.floats(0.0, 4.0), st.sampled_from(["orthographic", "perspective"]), st.integers(0, 2**32 - 1))
def test_a_polygon_covers_every_pixel_whose_ray_meets_its_stack(
    view: tuple[float, float, float], distance: float, projection: Projection, seed: int
) -> None:
    random = np.random.default_rng(seed)
    dimensions = random.integers(1, 30, 3)
    direction = np.eye(3) + 0.3 * random.standard_normal((3, 3))
    volume = Volume(np.zeros(dimensions[::-1], np.uint8), random.uniform(0.5, 3, 3), (5, -7, 1e3), direction)
    camera = _camera(volume, view, distance, projection)
    thickness = volume.radius / random.uniform(1, 30)
    part = np.sort(random.random((2, 3)), axis=0) if seed % 2 else WHOLE_BOX
    stacks = slab_stacks(volume, camera, thickness, SIZE, 4, part)
    # Points of the part in front of the eye, where they fall on the screen and which slab they are in.
    points = (part[0] + random.random((4000, 3)) * (part[1] - part[0]) - 0.5) @ volume.box_edges.T
    eye_space = camera.in_eye_space(points, volume.centre)
    eye_space = eye_space[eye_space[:, 2] > 1e-9]
    middle = camera.in_eye_space(np.zeros((1, 3)), volume.centre)[0, 2]
    slab = np.floor((eye_space[:, 2] - middle) / thickness)
    near = eye_space[:, 2:] if projection == "perspective" else 1.0
    screen = eye_space[:, :2] / near / camera.half_height / (SIZE[0] / SIZE[1], 1.0)
    visible = (np.abs(screen) <= 1).all(axis=1)
    for polygon, first, last in zip(stacks.polygons, stacks.first, stacks.last, strict=True):
        here = visible & (slab >= first) & (slab < last)
        assert _covers(polygon, screen[here]).all()
    assert visible.sum() == 0 or stacks.slab_count > 0


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_polygon_is_no_larger_than_the_hull_and_a_pixel(projection: Projection) -> None:
    from scipy.spatial import ConvexHull

    volume = Volume(np.zeros((8, 9, 10), np.uint8))
    camera = _camera(volume, (1, 2, 3), 3.0, projection)
    (polygon,) = slab_stacks(volume, camera, 1.0, SIZE).polygons
    right, up, depth = camera.in_eye_space(volume.corners_from_centre, volume.centre).T
    scale = SIZE[1] / 2 / camera.half_height / (depth if projection == "perspective" else 1.0)
    hull = ConvexHull(np.stack([right * scale, up * scale], axis=1))
    pixels = polygon * np.array(SIZE) / 2
    assert _covers(polygon, hull.points * 2 / SIZE).all()
    area = ConvexHull(pixels).volume  # of points in a plane that is their area
    assert hull.volume < area <= hull.volume + 1.5 * hull.area + 4


def test_slabs_do_not_move_with_the_eye() -> None:
    volume = Volume(np.zeros((20, 20, 20), np.uint8))
    near = slab_stacks(volume, _camera(volume, (1, 2, 3), 3.0, "orthographic"), 0.7, SIZE)
    far = slab_stacks(volume, _camera(volume, (1, 2, 3), 3.1234, "orthographic"), 0.7, SIZE)
    np.testing.assert_array_equal(near.first, far.first)
    np.testing.assert_array_equal(near.last, far.last)


def test_slabs_of_a_part_are_those_of_the_whole() -> None:
    """Whatever the part, slab k lies between the same two planes: none is counted from where the part begins."""
    volume = Volume(np.zeros((20, 20, 20), np.uint8))
    camera = _camera(volume, (1, 2, 3), 3.0, "perspective")
    whole = slab_stacks(volume, camera, 0.7, SIZE)
    halves = [np.array([(0, 0, low), (1, 1, low + 0.5)]) for low in (0.0, 0.5)]
    near, far = (slab_stacks(volume, camera, 0.7, SIZE, part=half) for half in halves)
    assert near.first[0] == whole.first[0]
    assert far.last[-1] == whole.last[-1]
    assert near.first[0] < far.first[0] < near.last[-1] < far.last[-1]
    assert near.eye_depth == far.eye_depth == whole.eye_depth


def test_a_polygon_wastes_little() -> None:
    volume = Volume(np.zeros((32, 32, 32), np.uint8))
    camera = Camera.framing(volume, eye=(16, -80, 16))
    stacks = slab_stacks(volume, camera, 1.0, (512, 512), per_stack=64)
    x, y = stacks.polygons[0].T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) * 256**2
    covered = (32 / camera.height * 512) ** 2
    assert covered < area < 1.03 * covered


def _nothing(stacks: SlabStacks) -> bool:
    return stacks.slab_count == 0 and len(stacks.polygons) == 0


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_box_behind_the_eye_gives_no_slabs(projection: Projection) -> None:
    volume = Volume(np.zeros((8, 8, 8), np.uint8))
    assert _nothing(slab_stacks(volume, _camera(volume, (0, 1, 0), -2.0, projection), 1.0, SIZE))


def test_too_many_slabs_are_refused() -> None:
    volume = Volume(np.zeros((8, 8, 8), np.uint8))
    with pytest.raises(InputError, match=r"slab thickness 1e-09 .* at most 1048576"):
        slab_stacks(volume, _camera(volume, (0, 1, 0), 2.0, "orthographic"), 1e-9, SIZE)


def test_a_brick_stores_what_half_a_slab_beyond_its_own_part_is_interpolated_from() -> None:
    """Half a slab reaches so far beyond the face, which lies half a sample before the neighbour's first sample."""
    volume = Volume(np.zeros((8, 8, 8)))
    camera = Camera.orthographic(volume.centre - (20, 0, 0), volume.centre, (0, 0, 1), height=8)
    for slab_thickness in np.linspace(0.1, 6, 60):
        beyond_first = 0.5 * slab_thickness - 0.5
        x, _, _ = bricks.margin(volume, camera, (16, 16), float(slab_thickness))
        assert np.ceil(beyond_first) + 1 <= x <= np.ceil(beyond_first) + 2
