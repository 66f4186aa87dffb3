"""Measures in pictures: where they are, what they say, and that they change nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.annotated import DIRECTIONS, EVERYTHING, blank, coverage, crooked, ink, outside, projected

from texvol.annotation import Annotation, annotate, check, with_room
from texvol.annotation.drawing import place_all
from texvol.annotation.measures import ON_DARK, ON_LIGHT, color_on, marks_of, placed_texts, value_text
from texvol.annotation.sheet import Rect
from texvol.annotation.view import View
from texvol.scene.camera import Camera, Projection
from texvol.scene.measures.measure import Measure
from texvol.scene.scene import Scene
from texvol.util.errors import InputError

SIZE = (480, 400)
BOTH = ("orthographic", "perspective")


def scene_of(direction: str = "straight", projection: Projection = "orthographic") -> Scene:
    volume = crooked(direction)
    return Scene(volume, camera=outside(volume, projection, SIZE[0] / SIZE[1]), classification="slab")


def around(scene: Scene, *offsets: Any) -> Any:
    """World points at distances from the middle of the volume."""
    return tuple(tuple(scene.volume.centre + np.array(each)) for each in offsets)


def drawn(scene: Scene, *measures: Measure) -> Any:
    """The sheet on which they are drawn."""
    sheet, view = blank(scene, SIZE)
    place_all(sheet, view, scene, Annotation(measures=measures), None)
    return sheet


@pytest.mark.parametrize("projection", BOTH)
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_lines_lie_between_the_points_that_are_measured(direction: str, projection: Projection) -> None:
    scene = scene_of(direction, projection)
    assert scene.camera is not None
    view = View(scene.camera, scene.volume, SIZE)
    points = around(scene, (-9, -5, 2), (8, 3, -6), (1, 9, 9))
    places = projected(np.array(points), scene.camera, SIZE)
    ruler = marks_of(Measure("ruler", points[:2]), view, 10.0, "mm")
    angle = marks_of(Measure("angle", points), view, 10.0, "mm")
    assert ruler is not None and angle is not None
    np.testing.assert_allclose(ruler.strokes[0][:2], places[:2], atol=1e-6)
    # Ticks stand at the ends, across the line.
    for tick, end in zip(ruler.strokes[1:3], places[:2], strict=True):
        np.testing.assert_allclose((tick.start + tick.end) / 2, end, atol=1e-6)
        assert abs((tick.end - tick.start) @ (places[1] - places[0])) < 1e-6
    for arm, end in zip(angle.strokes[:2], places[[0, 2]], strict=True):
        np.testing.assert_allclose(arm[:2], [places[1], end], atol=1e-6)
    # The arc begins and ends at the arms.
    for point, end in ((angle.strokes[2].start, places[0]), (angle.strokes[-1].end, places[2])):
        along, away = end - places[1], point - places[1]
        assert abs(along[0] * away[1] - along[1] * away[0]) < 1e-5 * np.linalg.norm(along) * np.linalg.norm(away)


@pytest.mark.parametrize("projection", BOTH)
def test_a_box_has_twelve_edges_and_those_behind_it_are_faint(projection: Projection) -> None:
    scene = scene_of("oblique", projection)
    assert scene.camera is not None
    low, high = around(scene, (-8, -6, -4), (3, 5, 7))
    marks = marks_of(Measure("box", (high, low)), View(scene.camera, scene.volume, SIZE), 10.0, "mm")
    assert marks is not None and len(marks.strokes) == 12
    corner = np.array([[(low, high)[c >> axis & 1][axis] for axis in range(3)] for c in range(8)])
    places = projected(corner, scene.camera, SIZE)
    ends = np.array([each[:2] for each in marks.strokes]).reshape(-1, 2)
    assert np.abs(ends[:, np.newaxis] - places).max(axis=-1).min(axis=1).max() < 1e-6
    # Seen from outside, three edges meet in the corner that is farthest from the eye.
    faint = [each for each in marks.strokes if each.faint]
    farthest = places[np.argmax((corner - scene.volume.centre) @ scene.camera.forward)]
    assert len(faint) == 3
    assert all(min(np.abs(each.start - farthest).max(), np.abs(each.end - farthest).max()) < 1e-6 for each in faint)


def test_a_picture_says_the_values_with_their_units() -> None:
    scene = scene_of()
    sheet = drawn(
        scene,
        Measure("ruler", around(scene, (0, 0, 0), (3, 4, 0)), "aorta"),
        Measure("angle", around(scene, (5, 0, 0), (0, 0, 0), (0, 5, 0))),
        Measure("box", around(scene, (0, 0, 0), (2, 3, 4))),
        Measure("profile", around(scene, (0, 0, 0), (0, 0, 1e-3))),
        Measure("ruler", around(scene, (0, 0, 0), (1, 0, 0)), shown=False),
    )
    assert sheet.texts == ["aorta: 5 mm", "90°", "24 mm³", "0.001 mm"]


def test_a_value_without_a_unit_has_none_and_a_lost_angle_says_so() -> None:
    assert value_text(Measure("ruler", ((0, 0, 0), (0, 0, 1234.5678))), "") == "1235"
    assert value_text(Measure("box", ((0, 0, 0), (30, 30, 37.5))), "mm") == "33,750 mm³"
    assert value_text(Measure("angle", ((0, 0, 0), (0, 0, 0), (1, 0, 0))), "mm") == "?°"


@pytest.mark.parametrize("part", [{}, {"transparent": True}])
def test_only_pixels_at_the_measure_change(part: dict[str, bool]) -> None:
    scene = scene_of()
    ruler = Measure("ruler", around(scene, (-9, 0, 0), (9, 0, 0)))
    assert scene.camera is not None
    picture = np.random.default_rng(0).random((SIZE[1], SIZE[0], 4)).astype(np.float32)
    changed = (annotate(picture, scene, SIZE, Annotation(measures=(ruler,)), **part) != picture).any(axis=-1)
    ends = projected(np.array(ruler.points), scene.camera, SIZE)
    rows, columns = np.nonzero(changed)
    low, high = ends.min(axis=0), ends.max(axis=0)
    assert columns.min() > low[0] - 12 and columns.max() < high[0] + 12
    assert rows.min() > low[1] - 40 and rows.max() < high[1] + 40
    assert 500 < changed.sum() < 5000


def test_the_line_is_as_long_in_pixels_as_the_length_by_the_scale() -> None:
    scene = scene_of()
    camera = scene.camera
    assert camera is not None
    # Across the view: nothing is foreshortened.
    across = np.array(camera.right) * 9
    found = ink(scene, SIZE, measures=(Measure("ruler", around(scene, -across, across)),))
    x, y = projected(np.array(around(scene, (0, 0, 0))), camera, SIZE)[0]
    row = found[int(y) - 2 : int(y) + 3].sum(axis=0) > 0.5
    assert row.sum() == pytest.approx(18 / (camera.height / SIZE[1]), abs=2)
    assert row[int(x)]


def test_a_color_of_the_annotation_is_that_of_measures() -> None:
    scene = scene_of()
    ruler = Measure("ruler", around(scene, (-9, 0, 0), (9, 0, 0)))
    black = np.zeros((SIZE[1], SIZE[0], 4))
    green = annotate(black, scene, SIZE, Annotation(measures=(ruler,), color=(0, 1, 0)))
    assert green[..., 1].max() > 0.9 and not green[..., 0].any()
    amber = annotate(black, scene, SIZE, Annotation(measures=(ruler,)))
    np.testing.assert_allclose(amber.reshape(-1, 4).max(axis=0)[:3], ON_DARK, atol=0.05)
    assert color_on((1.0, 1.0, 1.0)) == ON_LIGHT and color_on((0.0, 0.0, 0.3)) == ON_DARK


def test_behind_the_eye_nothing_is_drawn_and_a_line_past_the_eye_is_cut() -> None:
    volume = crooked()
    camera = Camera.perspective(tuple(volume.centre), tuple(volume.centre + (0, 10, 0)), (0, 0, 1), fov=60)
    scene = Scene(volume, camera=camera, classification="slab")
    view = View(camera, volume, SIZE)
    for kind, number in (("ruler", 2), ("angle", 3), ("box", 2), ("profile", 2)):
        behind = around(scene, (1, -9, 0), (-2, -4, 3), (3, -5, 1))[:number]
        assert marks_of(Measure(kind, behind), view, 10.0, "mm") is None
    past = marks_of(Measure("ruler", around(scene, (1, -9, 2), (-1, 9, 0))), view, 10.0, "mm")
    assert past is not None and np.isfinite(past.strokes[0][:2]).all()
    sheet = drawn(scene, Measure("angle", around(scene, (1, 9, 0), (0, -9, 1), (2, 9, 2))))
    assert len(sheet.texts) == 1


@given(st.integers(0, 2**31))
@example(2677)
@example(243421)
@settings(max_examples=25, deadline=None)
def test_values_stand_in_the_picture_and_not_on_each_other(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene = scene_of("oblique", "perspective")
    assert scene.camera is not None
    view, em = View(scene.camera, scene.volume, SIZE), 10.0
    points = scene.volume.centre + random.uniform(-15, 15, (6, 3))
    measures = [Measure("ruler", (tuple(points[n]), tuple(points[n + 3]))) for n in range(3)]  # type: ignore[arg-type]
    every = [marks for each in measures if (marks := marks_of(each, view, em, "mm")) is not None]
    texts = placed_texts(every, lambda text: (6.0 * len(text), em), em, SIZE, [Rect(0, 0, 100, 400)])
    rects = [Rect(x - 3 * len(text), y - 5, x + 3 * len(text), y + 5) for text, (x, y) in texts]
    assert len(rects) == 3
    for number, rect in enumerate(rects):
        assert rect.left >= 0 and rect.top >= 0 and rect.right <= SIZE[0] and rect.bottom <= SIZE[1]
        assert not any(rect.meets(other) for other in rects[:number])


def test_measures_leave_the_view_as_it_is_and_stand_beside_all_else() -> None:
    scene = scene_of()
    ruler = Measure("ruler", around(scene, (-9, 0, 0), (9, 0, 0)))
    assert scene.camera is not None
    assert with_room(scene.camera, scene, SIZE, Annotation(measures=(ruler,))) is scene.camera
    sheet, view = blank(scene, SIZE)
    place_all(sheet, view, scene, Annotation(**EVERYTHING, measures=(ruler,)), None)  # type: ignore[arg-type]
    assert any(text.startswith("18 mm") for text in sheet.texts)
    for number, rect in enumerate(sheet.written):
        assert not any(rect.meets(other) for other in sheet.written[:number])


def test_hidden_measures_are_no_annotation() -> None:
    scene = scene_of()
    hidden = Annotation(measures=(Measure("ruler", around(scene, (-9, 0, 0), (9, 0, 0)), shown=False),))
    assert not hidden
    assert not coverage(scene, SIZE, measures=hidden.measures).any()


def test_a_name_that_the_font_lacks_is_refused() -> None:
    scene = scene_of()
    arabic = Measure("ruler", around(scene, (0, 0, 0), (9, 0, 0)), "\u0627")
    with pytest.raises(InputError, match="measure: letter .* is written from right to left"):
        check(Annotation(measures=(arabic,)), scene)
    with pytest.raises(InputError, match="annotation: measures must be a Measure, got str"):
        Annotation(measures=("ruler",))  # type: ignore[arg-type]
