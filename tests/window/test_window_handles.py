"""Handles in the picture: they follow the hand, and move what they belong to and nothing else."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from support.panel_frames import desk_of_noise, headless, shown
from support.windows import ball, display, script, viewed  # noqa: F401 (display is a fixture)

from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window import handles
from texvol.window.navigation import triple
from texvol.window.panels import parts

VOLUME = Volume(np.zeros((10, 20, 30), np.uint8), spacing=(1.0, 2.0, 3.0), origin=(100.0, 0.0, -40.0))
CROP = ((103.0, 120.0), (-np.inf, 30.0), (-35.0, 500.0))
PLANES = (ClipPlane((1.0, 1.0, 0.0), 130.0), ClipPlane((0.0, 0.0, -4.0), 60.0))
cameras = st.sampled_from(["orthographic", "perspective"])
moving = st.sampled_from([*range(7), 8])  # numbers of the handles that move, and turn nothing


def scene(projection: Any, eye: Any = (60.0, -90.0, 40.0)) -> Scene:
    camera = Camera.framing(VOLUME, projection, eye=eye, up=(0, 0, 1), aspect=4 / 3)
    return Scene(VOLUME, camera=camera, crop=CROP, clip=PLANES, classification="slab")


def test_there_is_a_handle_for_each_face_and_plane() -> None:
    found = handles.handles_of(scene("orthographic"))
    assert [each.face for each in found[:6]] == [(axis, end) for axis in range(3) for end in (0, 1)]
    # Where the crop box reaches beyond the volume, its handle is on the volume's box.
    low, high = (np.array(found[number].point) for number in (2, 3))
    assert low[1] == -1.0 and high[1] == 30.0
    assert np.array(found[5].point)[2] == handles.bounds(VOLUME)[2][1]
    assert [(each.plane, each.turns) for each in found[6:]] == [(0, False), (0, True), (1, False), (1, True)]
    for handle, plane in zip(found[6::2], PLANES, strict=True):
        assert np.dot(plane.normal, handle.point) == pytest.approx(plane.offset)
        assert np.linalg.norm(handle.axis) == pytest.approx(1)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_of_two_opposite_faces_one_is_behind(projection: Any) -> None:
    shown = replace(scene(projection), crop=handles.bounds(VOLUME))
    assert shown.camera is not None
    box = VOLUME.centre, VOLUME.radius
    behind = [handles.is_behind(each.point, shown.camera, *box) for each in handles.handles_of(shown)[:6]]
    # The eye is at lower x and y and at higher z than the box.
    assert behind == [shown.camera.forward[0] < 0, shown.camera.forward[0] > 0, False, True, True, False]


@given(cameras, moving, st.tuples(st.floats(-0.01, 0.01), st.floats(-0.01, 0.01)))
def test_a_handle_follows_the_hand_as_far_as_its_axis_goes(projection: Any, number: int, by: Any) -> None:
    shown = scene(projection)
    handle = handles.handles_of(shown)[number]
    assert shown.camera is not None
    before = handles.position_of(shown.camera, np.array(handle.point))
    direction = handles.drag_distance(handle, shown.camera, by, VOLUME.radius)
    after = handles.position_of(shown.camera, np.array(handle.point) + direction * np.array(handle.axis))
    assert before is not None and after is not None
    along_axis = handles.position_of(shown.camera, np.array(handle.point) + VOLUME.radius * np.array(handle.axis))
    assume(along_axis is not None and np.hypot(*np.subtract(along_axis, before)) > 0.5)  # it does not point at the eye
    # What is left of the drag is across the way; to first order, over a hundredth of the picture.
    left = np.subtract(by, np.subtract(after, before))
    along = np.subtract(after, before)
    assert abs(left @ along) <= 0.03 * np.linalg.norm(by) * np.linalg.norm(along) + 1e-12


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("side", [1, -1])
def test_what_points_at_the_eye_goes_away_from_it_when_it_is_pushed_up(projection: Any, side: int) -> None:
    shown = scene(projection, eye=VOLUME.centre + (0, -200 * side, 0))
    along_y = handles.handles_of(shown)[3]
    assert shown.camera is not None
    assert handles.drag_distance(along_y, shown.camera, (0.3, 0.0), VOLUME.radius) == 0
    direction = handles.drag_distance(along_y, shown.camera, (0.0, 0.3), VOLUME.radius)
    # As much as it would move across the view there.
    depth = 1.0 if projection == "orthographic" else shown.camera.forward @ np.subtract(along_y.point, shown.camera.eye)
    assert direction == pytest.approx(side * 0.3 * shown.camera.half_height * depth)


@given(cameras, st.integers(0, 1), st.tuples(st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3)))
def test_the_tip_of_an_arrow_follows_the_hand_and_turns_its_plane(projection: Any, number: int, by: Any) -> None:
    shown = scene(projection)
    camera = shown.camera
    assert camera is not None
    # Across the view, as a plane is added: what turns it then is at the foot in the picture.
    for towards in (1.0, -1.0):
        normal = towards * camera.forward
        foot = VOLUME.centre
        plane = ClipPlane((float(normal[0]), float(normal[1]), float(normal[2])), float(normal @ foot))
        across = replace(shown, crop=None, clip=(plane,))
        before = handles.handles_of(across)[1]
        away = handles.points_away(before, camera)
        assert away == (towards > 0)
        turned = replace(across, **handles.turned(across, before, camera, by, away=away))  # type: ignore[arg-type]
        after = handles.handles_of(turned)[1]
        assert np.linalg.norm(turned.clip[0].normal) == pytest.approx(1)
        # It turns about the foot, which is in the middle of the box here.
        assert np.allclose(handles.handles_of(turned)[0].point, foot, atol=1e-9)
        # To first order; in perspective as much larger, or smaller, as the tip is nearer, or farther, than the foot.
        moved = np.subtract(after.point, before.point)
        depth = 1.0 if projection == "orthographic" else float(camera.forward @ (foot - camera.eye))
        wanted = (by[0] * camera.right + by[1] * camera.upward) * camera.half_height * depth
        assert np.allclose(moved, wanted, atol=0.01 * np.linalg.norm(wanted) + 1e-9)


@given(moving, st.floats(-300, 300))
def test_what_is_moved_makes_a_scene_and_leaves_the_rest(number: int, direction: float) -> None:
    shown = scene("perspective")
    handle = handles.handles_of(shown)[number]
    changed = replace(shown, **handles.moved(shown, handle, direction))  # a scene refuses an empty crop box
    if handle.plane is not None:
        kept = 1 - handle.plane
        assert changed.clip[kept] == PLANES[kept] and changed.crop == shown.crop
        point = np.array(handle.point) + direction * np.array(handle.axis)
        assert np.dot(PLANES[handle.plane].normal, point) == pytest.approx(changed.clip[handle.plane].offset)
        return
    assert changed.clip == PLANES and handle.face is not None and changed.crop is not None
    axis, end = handle.face
    for other in range(3):
        for side in (0, 1):
            if (other, side) != (axis, end):
                assert changed.crop[other][side] == CROP[other][side]
    low, high = handles.bounds(VOLUME)[axis]
    assert low <= changed.crop[axis][end] <= high


def test_the_border_of_a_plane_is_on_the_plane_and_on_the_box() -> None:
    shown = replace(scene("orthographic"), crop=None)
    lines = handles.outline(shown)
    # x + y = 130 leaves through four faces, z = -15 cuts a rectangle.
    assert len(lines) == 8
    limits = np.array(handles.bounds(VOLUME))
    for number, ends in enumerate(lines):
        for end in ends:
            plane = PLANES[number // 4]
            assert np.dot(plane.normal, end) == pytest.approx(plane.offset)
            assert (end >= limits[:, 0] - 1e-9).all() and (end <= limits[:, 1] + 1e-9).all()
            assert np.isclose(end[:, np.newaxis], limits, atol=1e-9).any()


def test_the_position_of_a_plane_that_was_turned_is_no_rounding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk, found = desk_of_noise(tmp_path, monkeypatch), []
    document, rng = desk.document, np.random.default_rng(3)
    assert document is not None
    box = document.scene.box
    monkeypatch.setattr(parts, "slider", lambda label, value, *ends: (found.append(value), value)[1])
    with headless():
        for _ in range(20):
            normal = rng.normal(size=3)
            document.change(clip=(ClipPlane(triple(normal), float(normal @ box.centre)),))
            shown(desk, "Cut", 2)
        assert len(found) >= 20 and set(found) == {0.0}
        document.change(clip=(ClipPlane((2.0, 0.0, 0.0), 2 * (float(box.centre[0]) + 1e-6)),))
        shown(desk, "Cut", 2)
        assert found[-1] == pytest.approx(1e-6, rel=1e-6)


def test_a_clip_plane_is_dragged_in_the_picture(display: str, tmp_path: Path) -> None:  # noqa: F811
    # Seen from the front, x to the right; the plane's handle is in the middle of the picture.
    view = ["--eye", "23.5,-100,23.5", "--target", "23.5,23.5,23.5", "--up", "0,0,1", "--height", "60"]
    steps: list[dict[str, Any]] = [
        {"do": "rest"},
        {"do": "command", "name": "tab Cut"},
        {"t": 0.2, "kind": "move", "x": 150, "y": 150},
        {"t": 0.3, "kind": "button", "name": "left", "down": True},
        *({"t": 0.4 + 0.02 * n, "kind": "move", "x": 150 + 2 * n, "y": 150 + n} for n in range(1, 26)),
        {"t": 1.1, "kind": "button", "name": "left", "down": False},
        {"t": 1.2, "do": "rest"},
        {"t": 1.2, "do": "save", "file": "moved.toml"},
        {"t": 1.3, "do": "command", "name": "undo"},
        {"t": 1.4, "do": "save", "file": "undone.toml"},
    ]
    words = [*view, "--clip", "1,0,0,23.5", "--size", "300x300", "--max-error", "0.1", "--light", "none"]
    done = viewed(display, tmp_path, ball(tmp_path), *words, "--script", script(tmp_path, steps))
    assert (done.returncode, done.stderr) == (0, "")

    def offset(name: str) -> float:
        (line,) = (each for each in (tmp_path / name).read_text().splitlines() if each.startswith("clip"))
        return float(line.rpartition("offset = ")[2].rstrip("}]"))

    # 50 of 300 pixels of 60 world units; the camera did not turn.
    assert offset("moved.toml") == pytest.approx(23.5 + 10, abs=0.2)
    assert offset("undone.toml") == 23.5
    assert "eye = [23.5, -100.0, 23.5]" in (tmp_path / "moved.toml").read_text()


def test_a_plane_across_the_view_is_pushed_and_turned_in_the_picture(display: str, tmp_path: Path) -> None:  # noqa: F811
    # Seen from the front; the foot of the arrow, which points away, is in the middle, its tip is drawn beside it.
    view = ["--eye", "23.5,-100,23.5", "--target", "23.5,23.5,23.5", "--up", "0,0,1", "--height", "60"]
    tip = 150 + 0.6 * 30, 150 - 0.8 * 30

    def drag(t: float, start: tuple[float, float], by: tuple[float, float]) -> list[dict[str, Any]]:
        return [
            {"t": t, "kind": "move", "x": start[0], "y": start[1]},
            {"t": t + 0.1, "kind": "button", "name": "left", "down": True},
            *({"t": t + 0.1 + 0.05 * n, "kind": "move", "x": start[0] + by[0] * n / 5, "y": start[1] + by[1] * n / 5}
              for n in range(1, 6)),
            {"t": t + 0.5, "kind": "button", "name": "left", "down": False},
        ]  # fmt: skip

    steps: list[dict[str, Any]] = [
        {"do": "rest"},
        {"do": "command", "name": "tab Cut"},
        *drag(0.2, (150, 150), (0, -50)),
        {"t": 0.9, "do": "save", "file": "pushed.toml"},
        {"t": 1.0, "do": "command", "name": "undo"},
        *drag(1.1, tip, (40, 0)),
        {"t": 1.8, "do": "save", "file": "turned.toml"},
    ]
    words = [*view, "--clip", "0,1,0,23.5", "--size", "300x300", "--max-error", "0.1", "--light", "none"]
    done = viewed(display, tmp_path, ball(tmp_path), *words, "--script", script(tmp_path, steps))
    assert (done.returncode, done.stderr) == (0, "")

    def plane(name: str) -> tuple[list[float], float]:
        (line,) = (each for each in (tmp_path / name).read_text().splitlines() if each.startswith("clip"))
        normal, offset = line.partition("normal = ")[2].rstrip("}]").split(", offset = ")
        return json.loads(normal), float(offset)

    normal, offset = plane("pushed.toml")
    assert normal == [0, 1, 0] and offset == pytest.approx(23.5 + 10, abs=0.2)  # 50 of 300 pixels of 60 world units
    normal, offset = plane("turned.toml")
    # The tip goes to the right, by 8 units on an arrow of half a radius: an arc of so many radians.
    angle = 8 / (0.5 * 24 * np.sqrt(3))
    assert normal == pytest.approx([np.sin(angle), np.cos(angle), 0], abs=0.02)
    assert offset == pytest.approx(np.dot(normal, (23.5, 23.5, 23.5)), abs=0.05)
