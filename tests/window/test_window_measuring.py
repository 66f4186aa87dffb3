"""Measuring in the window: points follow the hand, undo covers all of it, files and tables hold what is shown."""

from __future__ import annotations

import csv
import io
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.annotated import DIRECTIONS, outside
from support.desks import desk_with, done, said
from support.panel_frames import dressed, headless, noticed, shown
from support.windows import ball, display, script, until, viewed  # noqa: F401 (display is a fixture)

from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.options import scene_options as options
from texvol.options.measures import measure as measure_of
from texvol.provenance.stored_scene import stored_scene_of
from texvol.scene.measures.measure import Measure
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window import measure_changes, measure_grips
from texvol.window.counting import Counting
from texvol.window.desk import Desk
from texvol.window.handles import position_of
from texvol.window.measure_slices import SliceMap, lines_of
from texvol.window.slice_views import Plane, SliceView
from texvol.window.slices import NAMES, slices_of
from texvol.window.steering import Viewport

SIZE = (60, 40)
RULER = "ruler 0,0,0 3,4,0"
BOX = Measure("box", ((-3, -2, -1), (3, 2, 1)))


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    np.save(tmp_path / "v.npy", np.arange(6.0 * 5 * 4).reshape(4, 5, 6))
    return desk_with(str(tmp_path / "v.npy"))


def measures(desk: Desk) -> tuple[Measure, ...]:
    assert desk.document is not None
    return desk.document.measures


def test_undo_covers_all_that_is_done_to_measures(desk: Desk) -> None:
    steps: list[tuple[Measure, ...]] = [()]
    document = done(desk, f"measure {RULER}")
    steps.append(measures(desk))
    measure_changes.replaced(desk, 0, Measure("ruler", steps[-1][0].points, "aorta"))
    steps.append(measures(desk))
    measure_changes.replaced(desk, 0, Measure("ruler", steps[-1][0].points, "aorta", shown=False))
    steps.append(measures(desk))
    done(desk, "measure delete")
    steps.append(measures(desk))
    assert [len(each) for each in steps] == [0, 1, 1, 1, 0] and len(set(steps)) == 4
    for wanted in reversed(steps[:-1]):
        done(desk, "undo")
        assert measures(desk) == wanted
    assert not document.unsaved
    for wanted in steps[1:]:
        done(desk, "redo")
        assert measures(desk) == wanted


def test_a_drag_is_one_step_and_the_next_one_another(desk: Desk) -> None:
    document = done(desk, f"measure {RULER}")
    for stroke in range(2):
        for x in (1.0, 2.0, 3.0):
            measure_changes.replaced(desk, 0, measures(desk)[0].moved(0, (x, stroke, 0)), "measure grip")
        document.history.end_stroke()
    assert measures(desk)[0].points[0] == (3, 1, 0)
    done(desk, "undo")
    assert measures(desk)[0].points[0] == (3, 0, 0)
    done(desk, "undo")
    assert measures(desk) == (measure_of(RULER),)


def test_a_change_of_the_scene_keeps_measures_and_is_undone_without_them(desk: Desk) -> None:
    document = done(desk, f"measure {RULER}", "mode mip")
    assert document.scene.mode == "mip" and len(measures(desk)) == 1
    done(desk, "undo")
    assert document.scene.mode == "composite" and len(measures(desk)) == 1
    done(desk, "undo")
    assert measures(desk) == ()


def test_a_measure_is_an_unsaved_change_and_the_saved_scene_has_it(desk: Desk, tmp_path: Path) -> None:
    document = done(desk, f"measure {RULER}:aorta", "measure profile:9 0,0,0 1,1,1")
    assert document.unsaved
    measure_changes.replaced(desk, 1, Measure("profile", measures(desk)[1].points, samples=9, shown=False))
    done(desk, f"save {tmp_path / 's.toml'}")
    assert not document.unsaved
    assert options.SceneOptions.of(scene=str(tmp_path / "s.toml")).annotation.measures == measures(desk)
    other = desk_with(str(tmp_path / "s.toml"))
    assert measures(other) == measures(desk)
    assert other.document is not None and not other.document.unsaved
    done(other, "undo")  # they are no step of the history
    assert measures(other) == measures(desk)
    done(other, "mode mip")
    assert measures(other) == measures(desk)


def test_painting_processes_are_not_asked_for_what_the_window_draws_itself(desk: Desk) -> None:
    document = done(desk, f"measure {RULER}")
    assert document.showing.annotation.measures and not document.drawn.annotation
    assert document.drawn == done(desk, "measure delete").showing


def test_points_that_are_placed_one_by_one_make_a_measure(desk: Desk) -> None:
    done(desk, "measure angle")
    for number, point in enumerate([(0, 0, 0), (0, 0, 0), (1, 0, 0)]):
        assert desk.measuring.hint.startswith("angle: click the ")
        measure_changes.place(desk, point)
        assert len(desk.measuring.placed) == min(number + 1, 1) + (number == 2)  # the same point twice is a slip
    measure_changes.place(desk, (1, 1, 0))
    assert measures(desk) == (measure_of("angle 0,0,0 1,0,0 1,1,0"),)
    assert (desk.measuring.tool, desk.measuring.placed, desk.measuring.selected) == ("", (), 0)
    measure_changes.place(desk, (9, 9, 9))  # without a tool
    assert len(measures(desk)) == 1


def test_a_box_is_placed_about_its_middle_and_the_same_tool_twice_is_put_down(desk: Desk) -> None:
    done(desk, "measure box")
    measure_changes.place(desk, (2.0, 2.5, 1.0))
    np.testing.assert_allclose(np.mean(measures(desk)[0].points, axis=0), (2.0, 2.5, 1.0))
    done(desk, "measure ruler", "measure ruler")
    assert desk.measuring.tool == ""


def test_another_document_has_no_tool_of_the_one_before(desk: Desk, tmp_path: Path) -> None:
    done(desk, f"measure {RULER}", "measure ruler")
    measure_changes.place(desk, (1, 2, 3))
    np.save(tmp_path / "w.npy", np.ones((3, 3, 3)))
    done(desk, f"open {tmp_path / 'w.npy'}")
    measure_changes.update(desk)
    state = desk.measuring
    assert (state.tool, state.placed, state.selected) == ("", (), None)


@pytest.mark.parametrize("wrong", ["rod 0,0,0 1,1,1", "ruler 0,0,0", "ruler 0,0,0 1,1,1:\u0627", ""])
def test_what_is_no_measure_is_said_and_changes_nothing(desk: Desk, wrong: str) -> None:
    done(desk, f"measure {wrong}")
    assert measures(desk) == () and said(desk)


def copied(desk: Desk, *commands: str) -> str:
    """The text that a command copies, when it is worked out."""
    found: list[str] = []
    desk.copy = found.append
    done(desk, *commands)

    def arrived() -> bool:
        measure_changes.update(desk)
        return bool(found)

    until(arrived)
    return found[-1]


def test_the_copied_table_is_that_of_the_command_line(
    desk: Desk, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = f"measure {RULER}", "measure box 0,0,0 3,3,3:part", "measure profile 0,0,0 5,4,3"
    text = copied(desk, *made, "measure copy")
    done(desk, f"save {tmp_path / 's.toml'}")
    assert main(["measure", "--scene", str(tmp_path / "s.toml")]) == 0
    assert capsys.readouterr().out == text
    done(desk, f"measure csv {tmp_path / 'out.csv'}")
    until(lambda: measure_changes.update(desk) or (tmp_path / "out.csv").exists())
    assert (tmp_path / "out.csv").read_text() == text


def test_a_profile_is_copied_with_a_column_for_each_volume(desk: Desk) -> None:
    done(desk, f"measure {RULER}", "measure profile:6 0,0,0 5,0,0")
    found: list[str] = []
    desk.copy = found.append
    assert desk.document is not None
    measure_changes.copy(desk, desk.document, 1)
    until(lambda: measure_changes.update(desk) or found)
    rows = list(csv.reader(io.StringIO(found[0])))
    assert rows[0] == ["distance", "x", "y", "z", "v.npy"]
    assert [float(row[4]) for row in rows[1:]] == pytest.approx([0, 1, 2, 3, 4, 5], abs=1e-14)


def test_labels_in_a_box_are_shown_with_their_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("seg.npy", np.repeat(np.arange(2, dtype=np.uint8), 32).reshape(4, 4, 4))
    Path("seg.txt").write_text("1 left lobe\n")
    desk = dressed(desk_with("seg.npy"))
    done(desk, "measure box 0,0,0 3,3,3")
    with headless(), noticed(monkeypatch) as seen:
        until(lambda: (measure_changes.update(desk), shown(desk, "Measure"), "1 left lobe: samples" in seen.texts)[2])
    assert "label 0: samples" in seen.texts


def test_files_of_others_are_not_overwritten_by_a_table(desk: Desk, tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text("mine")
    done(desk, f"measure {RULER}", f"measure csv {tmp_path / 'mine.csv'}")
    until(lambda: measure_changes.update(desk) or desk.question)
    assert (tmp_path / "mine.csv").read_text() == "mine"
    done(desk, "answer write mine-1.csv")
    assert (tmp_path / "mine-1.csv").read_text().startswith("name,kind")


def test_values_are_counted_on_a_thread_and_only_the_newest_is_kept() -> None:
    counting, waking = Counting(), []
    started: list[int] = []

    def make(number: int) -> int:
        started.append(number)
        until(lambda: len(waking) or number != 0 or ready)
        return number

    ready: list[bool] = []
    assert counting.ask("slot", 0, lambda: make(0), lambda: waking.append(1)) is None
    until(lambda: started)
    for number in range(1, 6):  # while the first is worked on
        assert counting.ask("slot", number, lambda number=number: make(number), lambda: waking.append(1)) is None  # type: ignore[misc]
    assert counting.busy
    ready.append(True)
    until(lambda: not counting.busy)
    assert started == [0, 5]
    assert counting.ask("slot", 5, lambda: make(9), lambda: None) == 5
    assert counting.last("slot") == 5


def test_a_value_that_can_not_be_had_is_a_message_and_is_not_tried_again() -> None:
    counting, tries = Counting(), []

    def fail() -> None:
        tries.append(1)
        raise OSError("the store\nis gone")

    for _ in range(3):
        assert counting.ask("slot", 1, fail, lambda: None) is None
        until(lambda: not counting.busy)
    assert counting.faults == ["the store is gone"] and len(tries) == 1


VOLUME = Volume(np.zeros((9, 11, 13), np.uint8), (0.7, 1.3, 2.1), (-4.0, -7.0, -8.0))
moves = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))


@given(st.sampled_from(["orthographic", "perspective"]), moves, st.integers(0, 1))
@settings(deadline=None)
def test_a_point_goes_where_the_hand_does_and_stays_at_its_depth(projection: Any, to: Any, number: int) -> None:
    camera = outside(VOLUME, projection)
    scene = Scene(VOLUME, camera=camera, classification="slab")
    ruler = Measure("ruler", ((-1, 2, 0.5), (1, 0, 3)))
    grip = measure_grips.grips_of([ruler], None)[number]
    moved = measure_grips.dragged(ruler, grip, scene, camera, to, visible=False)
    assert position_of(camera, np.array(moved.points[number])) == pytest.approx(to, abs=1e-9)
    depths = [float(camera.forward @ np.array(each.points[number])) for each in (ruler, moved)]
    assert depths[0] == pytest.approx(depths[1], abs=1e-9)
    assert moved.points[1 - number] == ruler.points[1 - number]


def test_a_point_on_something_visible_stays_on_what_is_visible() -> None:
    z, y, x = np.mgrid[tuple(slice(-1, 1, 40j) for _ in range(3))]
    volume = Volume((x**2 + y**2 + z**2 < 0.7).astype(np.float32), (0.1,) * 3, (-1.95,) * 3)
    camera = outside(volume, "orthographic")
    scene = Scene(volume, camera=camera, mode="isosurface", isovalue=0.5)
    middle = volume.centre
    ruler = Measure("ruler", (tuple(middle), tuple(middle - 0.83 * 2 * camera.forward)))  # type: ignore[arg-type]
    inside, above = measure_grips.grips_of([ruler], None)
    assert measure_grips.on_surface(scene, camera, above) and not measure_grips.on_surface(scene, camera, inside)
    moved = measure_grips.dragged(ruler, above, scene, camera, (0.15, 0.1), visible=True)
    assert np.linalg.norm(np.array(moved.points[1]) - middle) == pytest.approx(np.sqrt(0.7) * 1.95, abs=0.15)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("end", (0, 1))
def test_a_face_of_a_box_moves_along_its_axis_and_not_past_the_other(axis: int, end: int) -> None:
    camera = outside(VOLUME, "orthographic")
    scene = Scene(VOLUME, camera=camera, classification="slab")
    grips = measure_grips.grips_of([BOX], 0)
    assert len(grips) == 7 and len(measure_grips.grips_of([BOX], None)) == 1
    (grip,) = [each for each in grips if each.face == (axis, end)]
    here = position_of(camera, np.array(grip.at))
    assert here is not None
    there = position_of(camera, np.array(grip.at) + 0.5 * np.eye(3)[axis])
    moved = measure_grips.dragged(BOX, grip, scene, camera, there, visible=False)  # type: ignore[arg-type]
    wanted = np.array(measure_grips.corners(BOX))
    wanted[end, axis] += 0.5
    np.testing.assert_allclose(measure_grips.corners(moved), wanted, atol=1e-6)
    far = position_of(camera, np.array(grip.at) + (12 if end == 0 else -12) * np.eye(3)[axis])
    flat = measure_grips.corners(measure_grips.dragged(BOX, grip, scene, camera, far, visible=False))  # type: ignore[arg-type]
    assert 0 < flat[1, axis] - flat[0, axis] < 0.1


def test_the_middle_of_a_box_carries_all_of_it() -> None:
    camera = outside(VOLUME, "perspective")
    scene = Scene(VOLUME, camera=camera, classification="slab")
    moved = measure_grips.dragged(BOX, measure_grips.grips_of([BOX], 0)[0], scene, camera, (0.2, -0.1), visible=False)
    steps = np.subtract(moved.points, BOX.points)
    np.testing.assert_allclose(steps[0], steps[1], atol=1e-12)
    assert np.linalg.norm(steps[0]) > 0.5


def view_of(volume: Volume, name: str, number: int) -> SliceView:
    plane = Plane.of(volume, slices_of(volume)[name], number)
    return SliceView.of(Viewport(20, 30, 130, 90), plane, volume, 1.0, None)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("name", NAMES)
def test_a_slice_shows_points_where_its_samples_are(direction: str, name: str) -> None:
    volume = Volume(np.zeros((9, 11, 13), np.uint8), (0.7, 1.3, 2.1), (-4.0, 30.0, 11.0), DIRECTIONS[direction])
    slice_ = slices_of(volume)[name]
    index = np.array((3.0, 4.0, 5.0))
    view = view_of(volume, name, int(index[slice_.axis]))
    seen = SliceMap.of(view, volume, slice_)
    point = volume.origin + volume.world_from_index @ index
    place = view.place(*view.plane.position(point))
    np.testing.assert_allclose(seen.positions(point[np.newaxis])[0], place, atol=1e-9)
    np.testing.assert_allclose(seen.point(*place), point, atol=1e-9)
    for step, (axis, sign) in ((seen.right, slice_.across), (seen.down, slice_.down)):
        assert step @ volume.world_from_index[:, axis] * sign > 0
    assert seen.holds(point)
    index[slice_.axis] += 0.51
    assert not seen.holds(volume.origin + volume.world_from_index @ index)


def test_a_slice_shows_the_outline_in_which_it_cuts_a_box() -> None:
    volume = Volume(np.zeros((20, 20, 20), np.uint8))
    seen = SliceMap.of(view_of(volume, "axial", 7), volume, slices_of(volume)["axial"])
    box = Measure("box", ((2, 3, 5), (8, 13, 9)))
    ends = np.array([each[:2] for each in lines_of(box, seen)]).reshape(-1, 2)
    corner = seen.positions(np.array([(x, y, 7.0) for x in (2, 8) for y in (3, 13)]))
    assert len(ends) == 8
    assert np.abs(ends[:, np.newaxis] - corner).max(axis=-1).min(axis=1).max() < 1e-9
    assert lines_of(Measure("box", ((2, 3, 8), (8, 13, 9))), seen) == []
    flat, through = (Measure("ruler", ((2, 3, 7), (5, 6, z))) for z in (7.4, 9))
    assert lines_of(flat, seen)[0].inside and not lines_of(through, seen)[0].inside


def clicked(t: float, x: float, y: float) -> list[dict[str, Any]]:
    press = [{"t": t + 0.1 + 0.1 * n, "kind": "button", "name": "left", "down": n == 0} for n in range(2)]
    return [{"t": t, "kind": "move", "x": x, "y": y}, *press]


def test_a_ruler_is_clicked_dragged_and_saved(display: str, tmp_path: Path) -> None:  # noqa: F811
    start, end, later = (180, 200), (220, 150), (150, 160)
    steps = [
        {"do": "rest"},
        {"t": 0.1, "do": "command", "name": "tab Measure"},
        {"t": 0.2, "do": "command", "name": "measure ruler"},
        {"t": 0.3, "kind": "move", "x": 190, "y": 190},  # a drag turns the view, and places no point
        {"t": 0.35, "kind": "button", "name": "left", "down": True},
        {"t": 0.4, "kind": "move", "x": 230, "y": 210},
        {"t": 0.45, "kind": "button", "name": "left", "down": False},
        *clicked(0.6, *start),
        *clicked(1.1, *end),
        {"t": 1.6, "do": "rest"},
        {"t": 1.7, "do": "screenshot", "file": "window.png"},
        {"t": 1.8, "do": "save", "file": "one.toml"},
        {"t": 1.9, "kind": "move", "x": end[0] + 3, "y": end[1]},
        {"t": 2.0, "kind": "button", "name": "left", "down": True},
        {"t": 2.1, "kind": "move", "x": 200, "y": 155},
        {"t": 2.2, "kind": "move", "x": later[0] + 3, "y": later[1]},
        {"t": 2.3, "kind": "button", "name": "left", "down": False},
        {"t": 2.4, "do": "command", "name": "picture written.png"},
        {"t": 2.4, "do": "rest"},
        {"t": 2.5, "do": "save", "file": "two.toml"},
        {"t": 2.6, "kind": "key", "name": "z", "down": True, "modifiers": ["ctrl"]},
        {"t": 2.7, "do": "save", "file": "three.toml"},
    ]
    name = script(tmp_path, steps)  # type: ignore[arg-type]
    words = ["--tf", "fog", "--size", "400x400", "--max-error", "0.1", "--script", name]
    done = viewed(display, tmp_path, ball(tmp_path), *words)
    assert done.returncode == 0, done.stderr
    files = [tomllib.loads((tmp_path / f"{each}.toml").read_text()) for each in ("one", "two", "three")]
    camera = options.SceneOptions.of(scene=str(tmp_path / "one.toml")).scene(Volume(np.zeros((2, 2, 2)))).camera
    assert camera is not None

    def places(file: dict[str, Any]) -> list[Any]:
        (each,) = file["measure"]
        found = [position_of(camera, np.array(point)) for point in each["points"]]
        return [(200 + x * 200, 200 - y * 200) for x, y in found if found]  # type: ignore[misc]

    np.testing.assert_allclose(places(files[0]), [start, end], atol=0.01)
    np.testing.assert_allclose(places(files[1]), [start, later], atol=0.01)
    assert files[2]["measure"] == files[0]["measure"]
    header = stored_scene_of(read_picture(tmp_path / "written.png").attributes, name="written.png")
    assert [each.as_table() for each in header.measures] == files[1]["measure"]
    assert {key: files[0][key] for key in ("eye", "target")} == {key: files[1][key] for key in ("eye", "target")}
