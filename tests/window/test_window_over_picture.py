"""Controls and annotation over the picture: their places, their order, and what a small picture has of them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from imgui_bundle import imgui
from support.desks import desk_with, done
from support.panel_frames import desk_of_noise, dressed, headless, noticed, shown

from texvol.annotation import Annotation
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window import panels
from texvol.window.desk import Desk
from texvol.window.panels import cube, grips, ground, overlay, planes, tips
from texvol.window.slice_views import Plane
from texvol.window.slices import NAMES
from texvol.window.steering import Viewport


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """A desk with a volume open."""
    return desk_of_noise(tmp_path, monkeypatch)


@pytest.mark.parametrize(
    "side, scale, shows, edge",
    [
        (290, 1, False, 0),
        (300, 1, True, 25 * 300 / 480),
        (480, 1, True, 25),
        (900, 1, True, 25),
        (590, 2, False, 0),
        (900, 2, True, 25 * 900 / 480),
    ],
)
def test_the_cube_shrinks_in_a_small_picture_and_leaves_the_smallest_free(
    desk: Desk, side: float, scale: float, shows: bool, edge: float
) -> None:
    desk.viewport = Viewport(0, 0, 1000, side)
    with headless(scale):
        assert cube._shows(desk) == shows
        if shows:
            assert cube._place(desk)[1] == pytest.approx(edge)


def test_the_ground_is_that_of_the_picture_where_it_fills_the_height(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    filled: list[tuple[tuple[float, ...], tuple[int, ...]]] = []
    monkeypatch.setattr(
        cast(Any, desk.textures).target,
        "clear",
        lambda *color, viewport: filled.append((color, viewport)),
        raising=False,
    )
    area, height = Viewport(0, 0, 540, 1200), 1200
    panel = (540, 0, 360, height)
    with headless():
        for mode, color in (("", (0, 0, 0)), ("2x2", ground.BEHIND)):
            desk.layout.shown = bool(mode)
            desk.viewport = view = desk.layout.arrange(area, 1.0, True)
            assert ground.color(desk) == color
            filled.clear()
            ground.lay(desk)
            place = (round(view.x), height - round(view.y + view.height), round(view.width), round(view.height))
            assert [each[1] for each in filled] == ([panel] if not mode else [place, panel])
        desk.viewport = desk.layout.arrange(area, 1.0, False, foot=40.0)
        assert ground.color(desk) == ground.BEHIND, "beside the time bar as well"


def test_a_frame_of_the_medium_tab_looks_at_no_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = desk_of_noise(tmp_path, monkeypatch)
    np.save("like.npy", np.random.default_rng(4).integers(-1000, 1200, (6, 7, 8)).astype(np.int16))
    desk = dressed(desk_with("like.npy"))
    with headless():
        shown(desk, "Medium", 2)
        monkeypatch.setattr("texvol.scene.transfer.units.typical_samples", None)
        shown(desk, "Medium", 2)


def test_the_cube_changes_its_corner_where_the_legend_is(desk: Desk) -> None:
    document = cast(Any, desk.document)
    desk.layout.become("2x2")  # the cube is below the buttons then
    with headless():
        places = {}
        for height in (400, 900):
            for legend in (False, True):
                document.show(annotation=Annotation(legend=legend))
                desk.viewport = Viewport(0, 0, 800, height)
                places[height, legend] = cube._place(desk)[0][0]
    assert places[400, True] == 50 and places[400, False] == 800 - 50
    assert places[900, True] == places[900, False] == 800 - 60


def test_the_cube_tells_where_a_click_looks_from(desk: Desk) -> None:
    assert cube._tip(cast(Any, desk.document), (1, 0, -1)) == "look from +X −Z; drag to turn"
    body = Volume(np.zeros((4, 5, 6), np.float32), space="right-anterior-superior")
    of_body: Any = SimpleNamespace(scene=Scene(body))
    assert cube._tip(of_body, (-1, 0, 1)) == "look from L S; drag to turn"


@pytest.mark.parametrize("height, columns", [(1200, 2), (500, 5)])
def test_the_table_of_keys_has_two_columns_in_a_low_window(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, height: int, columns: int
) -> None:
    found: list[int] = []
    begin = imgui.begin_table
    with headless():
        imgui.get_io().display_size = imgui.ImVec2(1280, height)
        monkeypatch.setattr(
            imgui, "begin_table", lambda name, count, how: (found.append(count), begin(name, count, how))[1]
        )
        imgui.new_frame()
        overlay.keys(desk)
        imgui.end_frame()
    assert found == [columns]


def test_slices_are_drawn_before_the_grips_that_they_would_hide(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    for name in ("planes", "grips", "measure_marks", "cube"):
        monkeypatch.setattr(getattr(panels, name), "draw", lambda desk, name=name: order.append(name))
    with headless():
        shown(desk, "Cut", 1)
    assert order == ["planes", "grips", "measure_marks", "cube"]


@pytest.mark.parametrize("projection, count", [("orthographic", 1), ("perspective", 36)])
def test_the_annotation_is_drawn_over_each_part_of_a_slice_where_it_is_in_the_picture(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, projection: Any, count: int
) -> None:
    document = cast(Any, desk.document)
    if projection != document.view.camera.projection:
        done(desk, "projection")
    desk.viewport, drawn = Viewport(100, 50, 600, 400), []
    monkeypatch.setattr(planes, "_annotation", lambda desk: "annotation")
    monkeypatch.setattr(planes, "_texture", lambda desk, name, layer: name)
    monkeypatch.setattr(planes, "_add", lambda drawn_in, *what: drawn.append(what))
    desk.layout.follow(document.scene)
    with headless():
        imgui.new_frame()
        planes._pictures(desk, document, None)
        imgui.end_frame()
    assert len(drawn) == 24, "four quarters of three slices, and the annotation over each"
    for (name, parts, _), (over, again, _) in zip(drawn[::2], drawn[1::2], strict=True):
        assert name.removesuffix(" 0") in NAMES and over == "annotation" and len(parts) == len(again) == count
        for (corners, _), (same, places) in zip(parts, again, strict=True):
            assert (corners == same).all()
            np.testing.assert_allclose((100, 450) + places * (600, -400), corners)


@pytest.mark.parametrize("projection, off", [("orthographic", 1e-6), ("perspective", 1.0)])
def test_slices_in_the_picture_have_further_volumes_over_them(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, projection: Any, off: float
) -> None:
    np.save("parts.npy", np.arange(27, dtype=np.uint8).reshape(3, 3, 3))
    document = done(desk, "add parts.npy", "spacing 2 2.5,2.5,2.5", "as-labels 2")  # it juts out of the first
    if projection != document.view.camera.projection:
        done(desk, "projection")
    desk.viewport, drawn, layout = Viewport(100, 50, 600, 400), [], desk.layout
    monkeypatch.setattr(planes, "_annotation", lambda desk: None)
    monkeypatch.setattr(planes, "_texture", lambda desk, name, layer: (name, layer))
    monkeypatch.setattr(planes, "_add", lambda drawn_in, *what: drawn.append(what))
    layout.follow(document.scene)
    with headless():
        imgui.new_frame()
        planes._pictures(desk, document, None)
        imgui.end_frame()
    for name in NAMES:
        plane, covered = Plane.of(document.scene.volume, layout.slices[name], layout.number(name)), 0.0
        for (texture, layer), polygons, _ in drawn:
            for places, fractions in polygons if texture == f"{name} 1" else ():
                assert (fractions >= -1e-9).all() and (fractions <= 1 + 1e-9).all()
                corners = np.array([plane.point(*each) for each in layer.corners])
                wanted = planes._placed(desk, document.view.camera, planes._at(corners, fractions))
                np.testing.assert_allclose(places, wanted, atol=off)
                x, y = fractions.T
                covered += abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) / 2
        assert covered == pytest.approx(1), "all of the further volume's picture, once"


def test_the_ends_of_the_crop_box_say_how_they_are_changed(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    cast(Any, desk.document).change(crop=((0.0, 5.0), (0.0, 5.0), (0.0, 5.0)))
    with headless(), noticed(monkeypatch) as seen:
        shown(desk, "Cut")
    assert {tips.TIPS[f"{axis}##crop"] for axis in "xyz"} <= seen.texts


def test_the_time_that_was_left_of_another_file_is_not_told(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.job, desk.now = {"path": "second.mp4"}, 60.0
    for part, now in ((0.5, 50.0), (0.9, 59.0)):
        desk.moving.left.learn(part, now)
    desk.moving.forecasts["second.mp4"] = 42.0
    for part, wanted in ((0.0, "42 s or so"), (0.9, "1 s left")):
        desk.writing = part
        with headless(), noticed(monkeypatch) as seen:
            shown(desk, "Cut", 1)
        assert f"writing second.mp4, {wanted}" in seen.texts


@pytest.mark.parametrize("side, is_small", [(290, True), (600, False)])
def test_over_a_small_picture_what_is_written_is_a_tooltip(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, side: float, is_small: bool
) -> None:
    desk.writing, desk.job = 0.4, {"path": "film.mp4"}
    wrapped: list[str] = []
    text = imgui.text_wrapped
    with headless(), noticed(monkeypatch) as seen:
        monkeypatch.setattr(imgui, "text_wrapped", lambda words: (wrapped.append(words), text(words))[1])
        desk.viewport = Viewport(0, 0, 500, side)
        shown(desk, "Cut", 2)
    assert "writing film.mp4" in seen.texts | set(wrapped)
    assert ("writing film.mp4" in wrapped) != is_small


def test_faces_of_a_measured_box_have_the_grips_of_the_crop_box(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    document = done(desk, "measure box 1,1,1 4,5,6", "axis +x")
    drawn: list[tuple[int, bool]] = []
    monkeypatch.setattr(grips, "grip", lambda _, __, color, hollow, *___: drawn.append((color, hollow)))
    with headless():
        desk.measuring.selected = 0
        shown(desk, "Measure", 3)
        # The middle, and both faces of each axis; seen along x, one face is behind, and the others are beside.
        faces = [(color, hollow) for color in grips.OF_AXIS for hollow in (False, False)]
        faces[0 if document.view.camera.forward[0] < 0 else 1] = grips.OF_AXIS[0], True
        assert drawn[-6:] == faces and drawn[-7][1] is False and drawn[-7][0] not in grips.OF_AXIS
        drawn.clear()
        desk.measuring.selected = None
        shown(desk, "Measure", 1)
        assert [hollow for _, hollow in drawn] == [True], "a measure that is not selected has hollow grips"
