"""The parts of annotation: that each says what is so, that nothing overlaps, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.annotated import DIRECTIONS, EVERYTHING, blank, corners, crooked, ink, outside, projected
from support.real_data import real_volume

from texvol import load
from texvol.annotation import Annotation, annotate, check, with_room
from texvol.annotation.axes import axis_name, laid_axes
from texvol.annotation.drawing import place_all
from texvol.annotation.lettering import Lettering
from texvol.annotation.orientation import border_letters, draw_orientation, letters_towards
from texvol.annotation.scale_bar import bar_length, bar_text
from texvol.annotation.sheet import Rect
from texvol.annotation.view import EDGES, View
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (480, 400)
BOTH = ("orthographic", "perspective")
RAS, LPS = "right-anterior-superior", "left-posterior-superior"


def scene_of(direction: str = "straight", projection: Projection = "orthographic", space: str = "") -> Scene:
    """A scene with room for everything."""
    volume = crooked(direction, space)
    scene = Scene(volume, camera=outside(volume, projection, SIZE[0] / SIZE[1]), classification="slab")
    assert scene.camera is not None
    return Scene(volume, camera=with_room(scene.camera, scene, SIZE, Annotation(**EVERYTHING)), classification="slab")  # type: ignore[arg-type]


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("projection", BOTH)
def test_a_tick_marks_the_point_of_the_box_that_has_its_coordinate(projection: Projection, direction: str) -> None:
    scene = scene_of(direction, projection)
    assert scene.camera is not None
    sheet, view = blank(scene, SIZE)
    axes = laid_axes(sheet, view)
    assert sorted(axis.world_axis for axis in axes) == [0, 1, 2]
    ends = corners(scene.volume)
    for axis in axes:
        assert len(axis.ticks) >= 2
        start, end = ends[axis.edge.start], ends[axis.edge.end]
        values = np.array([tick.value for tick in axis.ticks])
        fractions = (values - start[axis.world_axis]) / (end[axis.world_axis] - start[axis.world_axis])
        assert ((fractions >= 0) & (fractions <= 1)).all()
        points = start + fractions[:, np.newaxis] * (end - start)
        wanted = projected(points, scene.camera, SIZE)
        np.testing.assert_allclose([tick.position for tick in axis.ticks], wanted, atol=1e-6)
        # What is written there says the same number.
        said = {float(number.text.replace("−", "-")) for number in axis.numbers}
        assert said <= {float(f"{value:.6g}") for value in values}
        assert len(said) >= 2


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("projection", BOTH)
def test_axes_stand_at_the_silhouette_and_their_numbers_outside(projection: Projection, direction: str) -> None:
    scene = scene_of(direction, projection)
    assert scene.camera is not None
    positions = projected(corners(scene.volume), scene.camera, SIZE)
    sheet, view = blank(scene, SIZE)
    for axis in laid_axes(sheet, view):
        start, end = positions[axis.edge.start], positions[axis.edge.end]
        across = np.array([-(end - start)[1], (end - start)[0]])
        sides = (positions - start) @ across
        # All corners are on one side, and the numbers on the other.
        assert (sides >= -1e-6).all() or (sides <= 1e-6).all()
        for label in [*axis.numbers, axis.name]:
            assert label is not None
            for x in (label.rect.left, label.rect.right):
                for y in (label.rect.top, label.rect.bottom):
                    assert ((np.array([x, y]) - start) @ across) * sides.sum() < 0


@pytest.mark.parametrize("projection", BOTH)
def test_of_an_edge_is_seen_what_is_projected_into_the_picture(projection: Projection) -> None:
    """Against points of each edge, from inside the box, from beside it, and from afar with little of it in view."""
    volume, size = crooked("sheared"), (320, 200)
    fractions, parts = np.linspace(0, 1, 2001), 0
    for away in (0.1, 0.9, 1.5):
        eye = volume.centre + away * volume.radius * np.array([0.5, -0.7, 0.4])
        framed = Camera.framing(volume, projection, eye=eye, target=volume.centre + (4, 3, -2), fov=60)
        scene = Scene(volume, camera=replace(framed, height=0.7 * framed.height), classification="slab")
        assert scene.camera is not None
        view, ends = View(scene.camera, volume, size), corners(volume)
        for edge in EDGES:
            points = ends[edge.start] + fractions[:, np.newaxis] * (ends[edge.end] - ends[edge.start])
            positions = projected(points, scene.camera, size)
            seen = ((positions >= 0) & (positions <= size)).all(axis=1)
            seen &= (points - scene.camera.eye) @ scene.camera.forward > 0
            found = view.visible_part(edge)
            if not seen.any():
                assert found is None or found[1] - found[0] < 1 / 2000
            else:
                assert found is not None
                # Known to the step of the points.
                np.testing.assert_allclose(found, (fractions[seen][0], fractions[seen][-1]), atol=1.01 / 2000)
                parts += found[0] > 0 or found[1] < 1
    assert parts > 5


def test_of_an_axis_that_is_seen_in_part_that_part_has_numbers() -> None:
    """A twentieth of the box in view: numbers as close as there is room for."""
    volume = crooked()
    eye = volume.centre + 5 * volume.radius * np.array([0.2, -1, 0.3])
    target = volume.box_corner + (0, 0, 5)
    scene = Scene(
        volume,
        camera=Camera.orthographic(eye + target - volume.centre, target, (0, 0, 1), height=2.0),
        classification="slab",
    )
    sheet, view = blank(scene, SIZE)
    (axis,) = (each for each in laid_axes(sheet, view) if each.world_axis == 2)
    values = [tick.value for tick in axis.ticks]
    # 2 world units in 400 pixels: between 0.2 and 0.5 of 8 ticks at most.
    assert 0.2 - 1e-9 < min(np.diff(values)) < 0.5 + 1e-9
    assert len(axis.numbers) >= 3


def test_an_axis_is_named_after_what_its_edge_follows_and_the_way_its_numbers_grow() -> None:
    assert axis_name(crooked(), 0) == "x (mm)"
    assert axis_name(crooked(unit=""), 1) == "y"
    assert axis_name(crooked(space=RAS), 0) == "L→R (mm)"
    assert axis_name(crooked(space=LPS), 1, "×10³") == "A→P (×10³ mm)"
    assert axis_name(crooked(space=LPS), 2) == "I→S (mm)"


@pytest.mark.parametrize("projection", BOTH)
def test_the_scale_bar_is_as_long_as_it_says(projection: Projection) -> None:
    """Against rays of neighbouring pixels, where they pass the target."""
    scene = scene_of("oblique", projection)
    assert scene.camera is not None
    origins, directions = scene.camera.rays(SIZE)
    depth = np.linalg.norm(np.subtract(scene.camera.target, scene.camera.eye))
    middle, right = SIZE[1] // 2, SIZE[0] // 2
    points = origins + directions * (depth / (directions @ scene.camera.forward))[..., np.newaxis]
    per_pixel = np.linalg.norm(points[middle, right] - points[middle, right - 1])
    drawn = ink(scene, SIZE, scale_bar=True)
    rows = np.nonzero(drawn.max(axis=1) > 0.99)[0]
    bar = drawn[rows[-1] - 1]  # a row across the bar, which stands below its text
    text = bar_text(*(lambda view: (view, bar_length(view)[0]))(View(scene.camera, scene.volume, SIZE)))
    number, unit = text.split(" ", 1)
    assert unit == ("mm" if projection == "orthographic" else "mm at the target")
    assert bar.sum() == pytest.approx(float(number) / per_pixel, abs=1e-6)
    assert SIZE[0] / 8 < bar.sum() <= SIZE[0] / 3  # of 1, 2, 5, 10 the next is at most 2.5 times as long
    assert float(f"{float(number):.0e}"[0]) in (1, 2, 5)


def test_a_volume_without_a_unit_has_a_scale_bar_in_world_units() -> None:
    scene = Scene(crooked(unit=""), classification="slab")
    view = View(scene.completed(SIZE).camera, scene.volume, SIZE)
    assert bar_text(view, bar_length(view)[0]).endswith(" world units")


# From where one looks, what is up; what lies to the right and up then, by right-handed common sense: seen from above
# with the face upwards the right hand is at the right, seen from the front it is at the left.
VIEWS = {
    "above": ((0, 0, 1), (0, 1, 0), "R", "A"),
    "below": ((0, 0, -1), (0, 1, 0), "L", "A"),
    "front": ((0, 1, 0), (0, 0, 1), "L", "S"),
    "back": ((0, -1, 0), (0, 0, 1), "R", "S"),
    "right": ((1, 0, 0), (0, 0, 1), "A", "S"),
    "left": ((-1, 0, 0), (0, 0, 1), "P", "S"),
}
OPPOSITE = dict(zip("RLAPSI", "LRPAIS", strict=True))


def looking(volume: Volume, position: tuple[float, ...], up: tuple[float, ...]) -> Scene:
    flipped = np.array([-1, -1, 1]) if volume.space == LPS else np.ones(3)
    eye = volume.centre + 5 * volume.radius * flipped * position
    return Scene(volume, camera=Camera.framing(volume, eye=eye, up=tuple(flipped * up)), classification="slab")


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("space", [RAS, LPS])
def test_borders_have_the_letters_of_where_they_lie(view: str, space: str) -> None:
    position, up, right, top = VIEWS[view]
    scene = looking(crooked("permuted", space), position, up)
    found = border_letters(View(scene.completed(SIZE).camera, scene.volume, SIZE))
    assert found == {"right": right, "left": OPPOSITE[right], "top": top, "bottom": OPPOSITE[top]}


def test_the_letters_of_a_head_agree_with_those_that_are_drawn_in_it() -> None:
    """A head with a large L and R in it: an R has more ink than an L, whose upper right is empty."""
    volume = load(real_volume("orientation/AIL.nii.gz"))
    scene = looking(volume, *VIEWS["above"][:2])
    assert scene.camera is not None
    bright = np.argwhere(volume.values > 0.999 * volume.values.max())[:, ::-1]
    positions = projected(volume.origin + bright @ volume.world_from_index.T, scene.camera, SIZE)
    positions = np.unique(np.round(positions / 8), axis=0) * 8  # seen from above: what lies below counts once
    left, right = (positions[(positions[:, 0] > SIZE[0] / 2) == side] for side in (False, True))
    assert len(right) > 1.2 * len(left) > 50
    middle = left.min(axis=0) / 2 + left.max(axis=0) / 2
    assert ((left[:, 0] > middle[0]) & (left[:, 1] < middle[1])).sum() < 0.02 * len(left)
    letters = border_letters(View(scene.camera, volume, SIZE))
    assert letters == {"left": "L", "right": "R", "top": "A", "bottom": "P"}
    # What is drawn at the right border is that letter.
    drawn = ink(scene, SIZE, orientation=True)
    wanted, _, _ = Lettering().coverage("R", 1.2 * SIZE[1] / 40)
    rows, columns = np.nonzero(drawn[:, SIZE[0] * 3 // 4 :])
    found = drawn[rows.min() : rows.max() + 1, SIZE[0] * 3 // 4 + columns.min() : SIZE[0] * 3 // 4 + columns.max() + 1]
    rows, columns = np.nonzero(wanted)
    np.testing.assert_allclose(
        found, wanted[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1], atol=1e-12
    )


@pytest.mark.parametrize(
    ("direction", "letters"),
    [
        ((1, 0.3, 0), "R"),
        ((1, 0.5, 0), "RA"),
        ((0.5, -1, 0), "PR"),
        ((-1, 0, 0.5), "LS"),
        ((-0.8, 0.7, -0.6), "LAI"),
        ((0.1, 0.1, -1), "I"),
    ],
)
def test_oblique_directions_have_several_letters_the_largest_part_first(
    direction: tuple[float, ...], letters: str
) -> None:
    """Between an axis and the diagonal of two, 45° apart, the border is at 22.5°, whose tangent is 0.41."""
    assert letters_towards(np.array(direction), ("R", "A", "S")) == letters


@pytest.mark.parametrize("space", ["", "scanner-xyz", "right-left-superior", "right-anterior"])
def test_letters_are_refused_where_nobody_knows_them(space: str) -> None:
    scene = Scene(crooked(space=space), classification="slab")
    with pytest.raises(InputError, match="straight: orientation letters need a volume whose file gives the directions"):
        check(Annotation(orientation=True), scene)
    with pytest.raises(InputError, match="got no space|got space"):
        annotate(np.zeros((64, 64, 4)), scene, (64, 64), Annotation(orientation=True))
    check(Annotation(**EVERYTHING), scene)  # type: ignore[arg-type]


def overlapping(rects: list[Rect]) -> list[tuple[Rect, Rect]]:
    return [(one, other) for number, one in enumerate(rects) for other in rects[:number] if one.meets(other)]


@settings(max_examples=30, deadline=None)
@given(
    st.tuples(st.integers(40, 450), st.integers(40, 350)),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(lambda eye: max(map(abs, eye)) > 0.1),
    st.sampled_from(sorted(DIRECTIONS)),
    st.sampled_from(BOTH),
    st.floats(0.3, 4),
)
def test_nothing_overlaps_and_all_is_in_the_picture(
    size: tuple[int, int], position: tuple[float, ...], direction: str, projection: Projection, away: float
) -> None:
    """Whatever the view, from inside the box too."""
    volume = crooked(direction, RAS)
    eye = volume.centre + away * volume.radius * np.array(position)
    scene = Scene(
        volume, camera=Camera.framing(volume, projection, eye=eye, up=(0.123, 0.0456, 1)), classification="slab"
    )
    sheet, view = blank(scene, size)
    place_all(sheet, view, scene, Annotation(orientation=True, **EVERYTHING), None)  # type: ignore[arg-type]
    assert not overlapping(sheet.written)
    for rect in sheet.written:
        assert rect.left >= 0
        assert rect.top >= 0
        assert rect.right <= size[0]
        assert rect.bottom <= size[1]


def test_ink_stays_in_the_room_that_its_text_has_taken() -> None:
    """What is kept from overlapping is what is drawn: letters reach no farther, but for a pixel of smoothing."""
    scene = scene_of(space=RAS)
    sheet, view = blank(scene, SIZE)
    draw_orientation(sheet, view)
    sheet.text("Å–gjpqy µm²", (200, 200))
    sheet.text("Å–gjpqy µm²", (300, 200), turned=True)
    allowed = np.zeros((SIZE[1], SIZE[0]), np.bool_)
    for rect in sheet.written:
        allowed[int(rect.top) - 1 : int(rect.bottom) + 2, int(rect.left) - 1 : int(rect.right) + 2] = True
    drawn = sheet.over(np.zeros((SIZE[1], SIZE[0], 4)), (0, 0, 0))[..., 0]
    assert drawn.max() > 0.9
    assert not drawn[~allowed].any()


@pytest.mark.parametrize("projection", BOTH)
def test_all_parts_are_there_where_there_is_room(projection: Projection) -> None:
    """At 360 x 360, too: three axes with their names, four letters, legend, scale bar and title."""
    volume = crooked("oblique", RAS)
    asked = Annotation(orientation=True, **EVERYTHING)  # type: ignore[arg-type]
    size = (360, 360)
    scene = Scene(volume, camera=outside(volume, projection), classification="slab")
    assert scene.camera is not None
    scene = Scene(volume, camera=with_room(scene.camera, scene, size, asked), classification="slab")
    sheet, view = blank(scene, size)
    place_all(sheet, view, scene, asked, None)
    texts = sheet.texts
    assert {"L→R (mm)", "P→A (mm)", "I→S (mm)", "All of it, µm² at 45°", "opacity of"} <= set(texts)
    assert {text for text in texts if set(text) <= set("RLAPSI")} == set(
        border_letters(View(scene.completed(size).camera, volume, size)).values()
    )
    assert any(text.startswith(bar_text(view, bar_length(view)[0])) for text in texts)


def test_large_and_small_pictures_look_alike() -> None:
    """The same texts at the same places."""
    found = []
    for size in ((480, 432), (1920, 1728)):
        volume = crooked("oblique", RAS)
        scene = Scene(volume, camera=outside(volume, "perspective", 480 / 432), classification="slab")
        sheet, view = blank(scene, size)
        place_all(sheet, view, scene, Annotation(orientation=True, **EVERYTHING), None)  # type: ignore[arg-type]
        found.append((sheet.texts, np.array(sheet.written) * 480 / size[0], sheet.em * 480 / size[0]))
    (small_texts, small, small_em), (large_texts, large, large_em) = found
    assert small_em == pytest.approx(large_em)
    assert small_texts == large_texts
    centres = [(rects[:, :2] + rects[:, 2:]) / 2 for rects in (small, large)]
    # Text stands on whole pixels, and the font's letters have whole widths: each is off by half a pixel at most, and
    # the middle by half as much.
    tolerance = 1.5 + np.array([len(text) for text in small_texts]) / 4
    assert (np.abs(centres[0] - centres[1]).max(axis=1) < tolerance).all()


@pytest.mark.parametrize("projection", BOTH)
def test_with_room_the_box_fills_what_annotation_leaves(projection: Projection) -> None:
    volume = crooked("sheared")
    size = (700, 500)
    scene = Scene(volume, camera=outside(volume, projection, 1.4), classification="slab")
    assert scene.camera is not None
    asked = Annotation(scale_bar=True, legend=True)
    camera = with_room(scene.camera, scene, size, asked)
    for vector in ("right", "upward", "forward"):
        np.testing.assert_allclose(getattr(camera, vector), getattr(scene.camera, vector), atol=1e-9)
    positions = projected(corners(volume), camera, size)
    left, top = positions.min(axis=0)
    right, bottom = size - positions.max(axis=0)
    sheet, view = blank(Scene(volume, camera=camera, classification="slab"), size)
    place_all(sheet, view, Scene(volume, camera=camera, classification="slab"), asked, None)
    legend_left = min(rect.left for rect in sheet.written if rect.left > size[0] / 2)
    bar_top = min(rect.top for rect in sheet.written if rect.right < size[0] / 2)
    assert size[0] - right < legend_left
    assert size[1] - bottom < bar_top
    # It touches both sides along one axis at least, and lies in the middle of what is left along the other.
    border = 500 * (1 - 1 / 1.05) / 2
    assert left >= border - 1e-6
    assert top >= border - 1e-6
    assert min(left, top) == pytest.approx(border, abs=1e-6)
    assert with_room(scene.camera, scene, size, Annotation()) is scene.camera
