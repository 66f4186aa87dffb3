"""Annotation as pixels: which it covers, by how much, how it blends, and that lines are where the camera says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.annotated import DIRECTIONS, EVERYTHING, corners, coverage, crooked, ink, outside, projected

from texvol.annotation import Annotation, annotate, marks
from texvol.formats.pictures import image
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (200, 160)
BOTH = ("orthographic", "perspective")
EDGES = [(c, c | 1 << axis) for axis in range(3) for c in range(8) if not c >> axis & 1]


def scene_of(direction: str = "straight", projection: Projection = "perspective", **further: Any) -> Scene:
    volume = crooked(direction)
    return Scene(
        volume, camera=outside(volume, projection, SIZE[0] / SIZE[1]), **({"classification": "slab"} | further)
    )


def noise(seed: int = 0, opacity: float | None = None) -> np.ndarray:
    """A premultiplied picture of noise."""
    picture = np.random.default_rng(seed).random((SIZE[1], SIZE[0], 4)).astype(np.float32)
    if opacity is not None:
        picture[..., 3] = opacity
    picture[..., :3] *= picture[..., 3:]
    return picture


@given(
    st.tuples(st.floats(-20, 60), st.floats(-20, 60)),
    st.floats(0, 2 * np.pi),
    st.floats(0.3, 6),
)
def test_across_a_line_the_coverage_adds_up_to_its_width(
    start: tuple[float, float], angle: float, width: float
) -> None:
    """Over a row or column of a line that goes on beyond the picture: the length that it cuts from that."""
    ray = np.array([np.cos(angle), np.sin(angle)])
    begin, end = np.array(start) - 500 * ray, np.array(start) + 500 * ray
    covered = covered_by(marks.line(tuple(begin), tuple(end), width, (1, 1, 1), (40, 40)), 40)
    if abs(ray[0]) < abs(ray[1]):
        covered, begin, ray = covered.T, begin[::-1], ray[::-1]
    middle = begin[1] + (np.arange(40) + 0.5 - begin[0]) * ray[1] / ray[0]
    # A pixel's shadow on the line is at most √2 long, the strip's cut at most √2 widths.
    whole = (middle > 0.75 * width + 1.5) & (middle < 40 - 0.75 * width - 1.5)
    # The area of a parallelogram one pixel wide is its height, to the 1e-6 of a direction that marks keep apart from 0.
    np.testing.assert_allclose(covered.sum(axis=0)[whole], width / abs(ray[0]), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("width", [0.4, 1.0, 3.7])
@pytest.mark.parametrize("end", [(17.2, 8.9), (9.4, 16.1), (-3.0, 4.0), (3.1, 14.0)])
def test_a_line_covers_of_each_pixel_what_lies_in_it(end: tuple[float, float], width: float) -> None:
    """Against 64 x 64 points per pixel; both edges of a line run past 2 x 64 of them, which count for half of it."""
    begin = np.array((3.1, 4.2))
    drawn = covered_by(marks.line(tuple(begin), end, width, (1, 1, 1), (20, 20)), 20)
    along = (end - begin) / np.linalg.norm(end - begin)
    fine = (np.arange(20 * 64) + 0.5) / 64
    x, y = fine[np.newaxis, :] - begin[0], fine[:, np.newaxis] - begin[1]
    across, onward = np.abs(y * along[0] - x * along[1]), x * along[0] + y * along[1]
    inside = (across < width / 2) & (onward > 0) & (onward < np.linalg.norm(end - begin))
    exact = inside.reshape(20, 64, 20, 64).mean(axis=(1, 3))
    x, y = (np.arange(20) + 0.5)[np.newaxis, :] - begin[0], (np.arange(20) + 0.5)[:, np.newaxis] - begin[1]
    onward = x * along[0] + y * along[1]
    between = (onward > 1) & (onward < np.linalg.norm(end - begin) - 1)
    np.testing.assert_allclose(drawn[between], exact[between], atol=2 * 64 / 64**2)
    # At the ends it is a product, near the exact area.
    np.testing.assert_allclose(drawn, exact, atol=0.15)


def covered_by(mark: marks.Mark, side: int) -> np.ndarray:
    covered = np.zeros((side, side))
    covered[mark.rows, mark.columns] = mark.coverage
    return covered


@pytest.mark.parametrize("upright", [False, True])
def test_a_level_line_covers_exactly_its_area(upright: bool) -> None:
    start, end, width = (3.3, 7.6), (20.85, 7.6), 1.7
    if upright:
        start, end = start[::-1], end[::-1]
    covered = covered_by(marks.line(start, end, width, (1, 1, 1), (30, 30)), 30)
    covered = covered.T if upright else covered
    columns, rows = (np.minimum(np.arange(30) + 1, high) - np.maximum(np.arange(30), low)
                     for low, high in ((3.3, 20.85), (7.6 - 0.85, 7.6 + 0.85)))  # fmt: skip
    np.testing.assert_allclose(covered, np.clip(rows, 0, 1)[:, None] * np.clip(columns, 0, 1), atol=1e-5)


def test_a_rectangle_covers_exactly_its_area() -> None:
    drawn = marks.rectangle(-3.5, 2.25, 4.75, 90.0, (1, 1, 1), (10, 8))
    assert drawn.coverage.sum() == pytest.approx(4.75 * 5.75, abs=1e-12)


@pytest.mark.parametrize("opacity", [1.0, None])
def test_what_is_not_covered_stays_and_the_rest_blends_in_linear_light(opacity: float | None) -> None:
    """Nothing but the box's far edges lies behind; without them, p becomes (1 - c) p + c m, opacity included."""
    scene, parts = scene_of(), EVERYTHING | {"box": False, "color": (0.2, 1.0, 0.6)}
    covered = coverage(scene, SIZE, **parts)
    assert 0.03 < (covered > 0).mean() < 0.5
    picture = noise(opacity=opacity)
    dark = np.zeros((SIZE[1], SIZE[0], 4))
    mark = annotate(dark, scene, SIZE, Annotation(**parts))  # c m
    shown = annotate(picture, scene, SIZE, Annotation(**parts))
    assert shown.dtype == picture.dtype
    untouched = covered < 1e-12
    np.testing.assert_array_equal(shown[untouched], picture[untouched])
    wanted = (1 - covered[..., np.newaxis]) * picture + mark
    np.testing.assert_allclose(shown, wanted, atol=1e-6)  # float32 in, float32 out
    # All there is in the empty picture is the ink, its outline, which is black, and the legend's colours.
    np.testing.assert_allclose(mark[..., 3], covered, atol=1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("projection", BOTH)
def test_the_box_lies_where_its_corners_are_projected(projection: Projection, direction: str) -> None:
    scene = scene_of(direction, projection)
    assert scene.camera is not None
    drawn = ink(scene, SIZE, box=True)
    positions = projected(corners(scene.volume), scene.camera, SIZE)
    checked = 0
    for here, (one, other) in enumerate(EDGES):
        start, end = positions[one], positions[other]
        along = (end - start) / np.linalg.norm(end - start)
        # Far from other edges, the centre of what is drawn across the edge.
        for fraction in np.linspace(0.1, 0.9, 9):
            point = start + fraction * (end - start)
            if min(distance(point, positions[list(edge)]) for number, edge in enumerate(EDGES) if number != here) < 10:
                continue
            major = int(abs(along[1]) > abs(along[0]))
            at = int(point[major])
            exact = start[1 - major] + (at + 0.5 - start[major]) * along[1 - major] / along[major]
            low = int(exact) - 4
            line = (drawn[low : low + 9, at] if major == 0 else drawn[at, low : low + 9]).astype(np.float64)
            assert line.sum() > 0.5
            centre = float((line * (low + np.arange(9) + 0.5)).sum() / line.sum())
            assert abs(centre - exact) < 0.1  # another edge's end, 10 pixels off, is not among the nine
            checked += 1
    assert checked > 30
    # Nothing is drawn anywhere else.
    rows, columns = np.nonzero(drawn)
    pixels = np.column_stack([columns, rows]) + 0.5
    away = np.min([distance(pixels, positions[list(edge)]) for edge in EDGES], axis=0)
    assert away.max() < 2


def clear_of_others(positions: np.ndarray, one: int, other: int) -> np.ndarray:
    """The point of an edge that is farthest from all other edges."""
    points = [positions[one] + fraction * (positions[other] - positions[one]) for fraction in np.linspace(0, 1, 33)]
    others = [list(edge) for edge in EDGES if set(edge) != {one, other}]
    return max(points, key=lambda point: min(distance(point, positions[edge]) for edge in others))


def distance(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Distance of points, shape (..., 2), from a straight line between two."""
    ray = ends[1] - ends[0]
    fraction = np.clip((points - ends[0]) @ ray / (ray @ ray), 0, 1)
    return np.asarray(np.linalg.norm(points - ends[0] - fraction[..., np.newaxis] * ray, axis=-1))


@pytest.mark.parametrize("projection", BOTH)
@pytest.mark.parametrize("direction", ["straight", "mirrored", "sheared"])
def test_far_edges_lie_behind_the_matter_and_near_ones_before_it(direction: str, projection: Projection) -> None:
    """Three edges meet at the farthest corner: opaque matter hides them, thin matter lets them through by 1 - a."""
    background = (0.25, 0.0, 0.5)
    scene = scene_of(direction, projection, background=background)
    assert scene.camera is not None
    empty = np.zeros((SIZE[1], SIZE[0], 4)) + (*background, 0)
    thin, opaque = (np.zeros((SIZE[1], SIZE[0], 4)) for _ in range(2))
    thin[:] = *(0.7 * np.array(background) + 0.1), 0.3  # premultiplied 0.1 over the background
    opaque[:] = 0.4, 0.4, 0.4, 1.0
    parts = Annotation(box=True, color=(1, 1, 0.5))
    positions = projected(corners(scene.volume), scene.camera, SIZE)
    depths = (corners(scene.volume) - scene.camera.eye) @ scene.camera.forward
    far, near = int(np.argmax(depths)), int(np.argmin(depths))
    for corner, hidden in ((far, True), (near, False)):
        for axis in range(3):
            x, y = clear_of_others(positions, corner, corner ^ 1 << axis).astype(int)
            box = slice(y - 2, y + 3), slice(x - 2, x + 3)
            drawn = annotate(empty, scene, SIZE, parts)[box]
            fraction = drawn[..., 3]
            assert fraction.max() > 0.1
            ink_over = np.append(parts.color, 1)  # type: ignore[arg-type]
            for picture in (thin, opaque):
                found, before = annotate(picture, scene, SIZE, parts)[box], picture[box]
                let_through = 1 - before[..., 3:]
                if hidden:
                    wanted = before + let_through * fraction[..., None] * (ink_over - (*background, 0))
                else:
                    wanted = before + fraction[..., None] * (ink_over - before)
                np.testing.assert_allclose(found, wanted, atol=1e-9)


@pytest.mark.parametrize("projection", BOTH)
def test_from_inside_the_box_edges_are_cut_where_the_eye_is(projection: Projection) -> None:
    """Against points of the edges, projected one by one; matter that fills the view hides all of them."""
    volume = crooked("sheared")
    eye = volume.centre + 0.2 * volume.radius * np.array([0.3, -0.5, 0.4])
    target = eye + np.array([-0.5, 1.0, -0.35])
    camera = (Camera.perspective(eye, target, (0, 0, 1), fov=100) if projection == "perspective"
              else Camera.orthographic(eye, target, (0, 0, 1), height=2.5 * volume.radius))  # fmt: skip
    scene = Scene(volume, camera=camera, classification="slab")
    drawn = ink(scene, SIZE, box=True)
    ends = corners(volume)
    fractions = np.linspace(0, 1, 4001)[:, np.newaxis]
    points = np.concatenate([
        ends[one] + fractions * (ends[other] - ends[one]) for one, other in EDGES
    ])  # fmt: skip
    points = points[(points - eye) @ camera.forward > 0]
    positions = projected(points, camera, SIZE)
    inside = ((positions > 2) & (positions < np.array(SIZE) - 2)).all(axis=1)
    assert inside.sum() > 1000
    seen = np.zeros(drawn.shape, np.bool_)
    columns, rows = positions[inside].astype(int).T
    seen[rows, columns] = True
    # A line is at least a pixel wide: beside every point of it, something is drawn; and nothing far from all of them.
    grown = np.zeros_like(drawn)
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            grown = np.maximum(grown, np.roll(drawn, (down, across), (0, 1)))
    assert (grown[seen] > 0.1).all()
    if projection == "perspective":
        opaque = np.ones((SIZE[1], SIZE[0], 4))
        np.testing.assert_array_equal(annotate(opaque, scene, SIZE, Annotation(box=True, color=(0, 0, 0))), opaque)
    in_picture = positions[((positions > 0) & (positions < SIZE)).all(axis=1)]
    for y, x in zip(*np.nonzero(drawn[3:-3, 3:-3] > 0.05), strict=True):
        assert np.abs(in_picture - (x + 3.5, y + 3.5)).max(axis=1).min() < 2


def test_a_transparent_picture_gains_opacity_where_it_is_annotated() -> None:
    scene, parts = scene_of(), Annotation(title="Title", box=True)
    shown = annotate(np.zeros((SIZE[1], SIZE[0], 4), np.float32), scene, SIZE, parts, transparent=True)
    file = image.eight_bits(shown, transparent=True)
    assert file[..., 3].max() == 255
    # Black ink and white outlines, which show on every page.
    solid = file[file[..., 3] == 255][:, :3]
    assert (solid == 0).all(axis=1).any()
    assert (solid == 255).all(axis=1).any()


def test_what_8_bits_cannot_hold_is_clipped_only_where_it_is_covered() -> None:
    scene, parts = scene_of(), {"title": "Title", "color": (0.0, 0.0, 0.0)}
    covered = coverage(scene, SIZE, **parts)
    bright, ones = np.full((SIZE[1], SIZE[0], 4), 50.0), np.ones((SIZE[1], SIZE[0], 4))
    bright[:, ::3], ones[:, ::3] = np.nan, 0.0  # no number is black
    found, wanted = (annotate(picture, scene, SIZE, Annotation(**parts)) for picture in (bright, ones))
    np.testing.assert_allclose(found[covered > 0], wanted[covered > 0], atol=1e-12)
    np.testing.assert_array_equal(found[covered < 1e-12], bright[covered < 1e-12])


@pytest.mark.parametrize("background", [(0, 0, 0), (1, 1, 1), (0.1, 0.1, 0.4), (0.9, 0.9, 0)])
def test_the_ink_is_told_from_the_background(background: tuple[float, float, float]) -> None:
    scene = scene_of(background=background)
    picture = np.zeros((SIZE[1], SIZE[0], 4)) + (*background, 0)
    shown = annotate(picture, scene, SIZE, Annotation(title="Title"))
    light, behind = (
        np.array([each]) @ (0.2126, 0.7152, 0.0722) for each in (shown[shown[..., 3] > 0.99][:, :3], background)
    )
    # The contrast ratio of the Web Content Accessibility Guidelines, of which 4.5 is wanted for text.
    ratio = (np.maximum(light.max(), behind) + 0.05) / (np.minimum(light.min(), behind) + 0.05)
    assert ratio >= 4.5


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(InputError, match=r"must have shape \(160, 200, 4\) for size 200x160, got \(160, 201, 4\)"):
        annotate(np.zeros((160, 201, 4)), scene_of(), SIZE, Annotation(box=True))


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (8, 8), (32, 32), (64, 64), (20, 300), (300, 20)])
def test_tiny_pictures_are_drawn(size: tuple[int, int]) -> None:
    volume = crooked("oblique", "left-posterior-superior")
    picture = np.zeros((size[1], size[0], 4), np.float32)
    shown = annotate(picture, Scene(volume, classification="slab"), size, Annotation(orientation=True, **EVERYTHING))  # type: ignore[arg-type]
    assert np.isfinite(shown).all()


def test_the_volumes_samples_do_not_matter_but_their_place() -> None:
    """A box of one sample, and far from the origin: lines are computed relative to the box."""
    near, far = (Volume(np.zeros((1, 1, 1)), (1, 1, 1), (at, 0, 0)) for at in (0, 1e9))
    pictures = [ink(Scene(each, classification="slab"), SIZE, box=True) for each in (near, far)]
    # The camera's eye is a float64 at 1e9: known to 1e-7 of the box, some 1e-5 pixels.
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-3)
