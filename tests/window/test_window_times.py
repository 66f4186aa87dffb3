"""Time steps in the window: opened at the first, read ahead within a bound, played, and no part of the history."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.desks import SIZE, desk_with, done, said, settled
from support.raised import raised
from support.windows import PATIENCE

from texvol.formats.readers import TimeSeries, load
from texvol.util.errors import InputError
from texvol.window import opening, playing, saving
from texvol.window.ahead import Ahead, Track
from texvol.window.desk import Desk
from texvol.window.document import opened_file
from texvol.window.screen import Screen

STEPS, SIDE = 6, 12
VALUES = np.arange(STEPS * SIDE**3, dtype=np.float32).reshape(STEPS, SIDE, SIDE, SIDE) % 1009
BYTES = SIDE**3 * 4


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Time series in several formats, one with two channels, vectors, and a volume without time."""
    import nibabel
    import nrrd
    import tifffile

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    np.save("steps.npy", VALUES)
    np.save("still.npy", VALUES[0])
    image = nibabel.Nifti1Image(VALUES.T, np.diag([1.0, 1.0, 2.0, 1.0]))
    image.header.set_xyzt_units("mm", "sec")
    image.header["pixdim"][4] = 0.5
    nibabel.save(image, "steps.nii.gz")
    nrrd.write("steps.nrrd", VALUES.T, {"kinds": ["domain"] * 3 + ["list"]})
    both = np.stack([VALUES, VALUES[::-1]], axis=2).astype(np.uint16)
    tifffile.imwrite("both.tif", both, imagej=True, metadata={"axes": "TZCYX"})
    vectors = np.stack([VALUES[0], VALUES[1], VALUES[2]], axis=3)
    nrrd.write("vectors.nrrd", vectors.transpose(3, 2, 1, 0), {"kinds": ["vector"] + ["domain"] * 3})
    return tmp_path


def went(desk: Desk, *commands: str) -> Any:
    """The document after commands, each when the wanted step is shown."""
    if commands:
        went(desk)
    document = done(desk, *commands[:1])
    end = time.monotonic() + PATIENCE
    while True:
        playing.follow(desk)
        if desk.times.has_steps and not desk.times.pending:
            return went(desk, *commands[1:]) if commands[1:] else document
        assert time.monotonic() < end, f"the step never came: {said(desk)}"
        time.sleep(0.002)


def shown_steps(desk: Desk) -> list[int]:
    assert desk.document is not None
    return [each.source["time"] for each in desk.document.scene.volumes]


@pytest.mark.parametrize("name", ["steps.npy", "steps.nii.gz", "steps.nrrd"])
def test_a_series_opens_at_its_first_step_and_goes_to_others(folder: Path, name: str) -> None:
    assert "--channel" in str(raised(InputError, load, name)) or "--time" in str(raised(InputError, load, name))
    desk = desk_with(name)
    document = went(desk)
    assert desk.times.count == STEPS and desk.times.step == 0
    for words, expected in (("4", 4), ("+1", 5), ("+1", 0), ("-1", 5), ("first", 0), ("last", 5)):
        went(desk, f"step {words}")
        assert desk.times.step == expected and shown_steps(desk) == [expected]
        np.testing.assert_array_equal(document.scene.volume.values, VALUES[expected])
    assert desk.times.time == ("2.5 s" if name == "steps.nii.gz" else "")


def test_a_step_that_is_none_is_said(folder: Path) -> None:
    desk = desk_with("steps.npy")
    went(desk, "step 2")
    for words in ("6", "one", "1.5", "+x"):
        done(desk, f"step {words}")
        assert "step must be" in said(desk) and desk.times.wanted == 2
        desk.messages.clear()
    other = desk_with("still.npy")
    playing.follow(other)
    done(other, "step 1", "play")
    assert "one time step only" in said(other) and not other.times.has_steps and not other.times.playing


def test_the_place_of_a_volume_stays_through_all_steps(folder: Path) -> None:
    desk = desk_with("still.npy")
    opening.open_file(desk, "steps.nii.gz", {"spacing": (3.0, 1.0, 1.0)})
    settled(desk)
    before = went(desk).scene.volume
    after = went(desk, "transform 1 moved.txt", "step 3").scene.volume
    np.testing.assert_array_equal(after.spacing, before.spacing)
    (folder / "moved.txt").write_text("1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    went(desk, "transform 1 moved.txt", "step 4")
    moved = desk.document.scene.volume  # type: ignore[union-attr]
    np.testing.assert_array_equal(moved.origin, before.origin + (5, 0, 0))
    np.testing.assert_array_equal(moved.values, VALUES[4])


def test_time_is_no_step_of_the_history_and_no_change(folder: Path) -> None:
    desk = desk_with("steps.npy")
    document = went(desk, "step 3")
    assert not document.unsaved and not document.history.past
    desk.change(background=(0.5, 0.0, 0.0))
    went(desk, "step 5", "undo")
    assert shown_steps(desk) == [5] and document.scene.background == (0, 0, 0) and not document.unsaved
    went(desk, "redo", "step 1")
    assert shown_steps(desk) == [1] and document.scene.background == (0.5, 0, 0) and document.unsaved
    # No other step is held by the history.
    assert {id(volume) for scene in document.scenes for volume in scene.volumes} == {id(document.scene.volume)}
    done(desk, "save kept.toml")
    assert "time = 1" in (folder / "kept.toml").read_text() and not document.unsaved
    went(desk, "step 2")
    assert not document.unsaved
    again = opened_file("kept.toml", SIZE)
    np.testing.assert_array_equal(again.scene.volume.values, VALUES[1])


def test_the_command_line_is_of_the_step_that_is_shown(folder: Path) -> None:
    desk = desk_with("steps.npy")
    document = went(desk, "step 3")
    assert "steps.toml" not in saving.command_line(document, SIZE, {})
    first = saving.command_line(document, SIZE, {})
    went(desk, "step 4")
    second = saving.command_line(document, SIZE, {})
    assert first[first.index("--scene") + 1] != second[second.index("--scene") + 1]
    assert "time = 4" in Path(second[second.index("--scene") + 1]).read_text()


def test_changes_are_of_every_step(folder: Path) -> None:
    desk = desk_with("steps.npy")
    document = went(desk, "opacity 1 0.5")
    medium = document.scene.transfer_function
    went(desk, "step 2")
    assert document.scene.transfer_function is medium
    histogram = document.histogram(document.scene.volume)
    state = SimpleNamespace(volume=document.scene.volume)
    desk.panel_state |= {"of a panel": state, "sliced": document.scene.volume}
    desk.layout.follow(document.scene)
    desk.layout.index = np.array([1.0, 2.0, 3.0])
    went(desk, "step 3")
    assert document.histogram(document.scene.volume) is histogram, "a new one would take longer than a frame"
    assert state.volume is desk.panel_state["sliced"] is document.scene.volume, "panels keep their state"
    desk.layout.follow(document.scene)
    assert desk.layout.index.tolist() == [1, 2, 3] and desk.layout.volume is document.scene.volume


def test_channels_of_one_file_go_together(folder: Path) -> None:
    desk = desk_with("both.tif")
    document = went(desk)
    assert [each.channel.number for each in document.scene.volumes] == [0, 1] and desk.times.count == STEPS
    went(desk, "step 2")
    assert shown_steps(desk) == [2, 2]
    one, other = document.scene.volumes
    np.testing.assert_array_equal(one.values, VALUES[2].astype(np.uint16))
    np.testing.assert_array_equal(other.values, VALUES[STEPS - 3].astype(np.uint16))


def test_a_series_that_is_added_comes_to_the_shown_step(folder: Path) -> None:
    desk = desk_with("steps.npy")
    went(desk, "step 4")
    document = done(desk, "add steps.nrrd", "add still.npy")
    went(desk)
    assert [each.source.get("time") for each in document.scene.volumes] == [4, 4, None]
    assert not said(desk)


def test_another_scene_has_its_own_time(folder: Path) -> None:
    desk = desk_with("steps.npy")
    went(desk, "step 4")
    opening.open_file(desk, "still.npy")
    settled(desk)
    playing.follow(desk)
    assert not desk.times.has_steps and desk.times.ahead is None
    done(desk, "back")
    went(desk)
    assert desk.times.step == 4 and shown_steps(desk) == [4]


def test_vectors_are_shown_by_their_length(folder: Path) -> None:
    desk = desk_with("vectors.nrrd")
    volume = desk.document.scene.volume  # type: ignore[union-attr]
    np.testing.assert_allclose(volume.values, np.sqrt((VALUES[:3] ** 2).sum(axis=0)), rtol=1e-6)
    assert "by their length" in said(desk) and volume.source["channel"] == "magnitude"


def pictured(desk: Desk) -> None:
    """The picture of the present scene has arrived."""
    desk.director.version = getattr(desk.director, "version", 0)
    desk.director.shown = SimpleNamespace(version=desk.director.version)  # type: ignore[assignment]


def test_a_film_waits_for_the_picture_and_for_its_pace(folder: Path) -> None:
    desk = desk_with("steps.npy")
    went(desk)
    pictured(desk)
    desk.times.pace = 10.0
    playing.play(desk)
    seen = []
    end = time.monotonic() + PATIENCE
    while len(seen) < STEPS + 2:
        assert time.monotonic() < end
        desk.now += 0.05
        before = desk.times.step
        playing.follow(desk)
        if desk.times.step != before:
            seen.append((desk.times.step, desk.now))
        time.sleep(0.002)
    assert [step for step, _ in seen] == [1, 2, 3, 4, 5, 0, 1, 2]
    assert min(np.diff([moment for _, moment in seen])) >= 0.1 - 1e-9
    desk.director.version += 1  # a picture that has not arrived
    here = desk.times.step
    for _ in range(20):
        desk.now += 0.2
        playing.follow(desk)
    assert desk.times.step == here
    pictured(desk)
    desk.now += 0.2
    playing.follow(desk)
    assert desk.times.wanted == (here + 1) % STEPS
    playing.play(desk)
    assert not desk.times.playing and desk.times.due(desk.now) == np.inf


def waited(ahead: Ahead, reached: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not reached():
        assert time.monotonic() < end, ahead.faults
        time.sleep(0.002)


def test_no_more_is_read_ahead_than_there_is_room_for(folder: Path) -> None:
    track = Track.of(load("steps.npy", time=0))
    assert track is not None
    most = int(2.5 * BYTES)
    ahead = Ahead(lambda: None, most)
    ahead.ask([track], range(STEPS))
    waited(ahead, lambda: ahead.steps([track.key], 2) is not None)
    time.sleep(0.05)
    held = [number for number in range(STEPS) if ahead.steps([track.key], number) is not None]
    assert held == [0, 1, 2] and ahead.nbytes <= BYTES + most
    ahead.ask([track], [4, 5, 0])
    waited(ahead, lambda: ahead.steps([track.key], 4) is not None)
    assert ahead.steps([track.key], 1) is None and ahead.nbytes <= BYTES + most
    ahead.close()
    assert ahead.nbytes == 0


def test_a_step_that_can_not_be_read_is_said_and_the_shown_one_stays(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = TimeSeries.__getitem__

    def broken(series: TimeSeries, step: int) -> Any:
        if step == 3:
            raise InputError("steps.npy: its step 3 is damaged")
        return read(series, step)

    monkeypatch.setattr(TimeSeries, "__getitem__", broken)
    desk = desk_with("steps.npy")
    went(desk, "step 2")
    went(desk, "step 3")
    assert desk.times.step == desk.times.wanted == 2 and shown_steps(desk) == [2]
    assert said(desk).count("its step 3 is damaged") == 1
    went(desk, "step 4")
    assert shown_steps(desk) == [4]


def test_steps_are_prepared_on_the_thread_that_reads_before_they_are_shown(folder: Path) -> None:
    track = Track.of(load("steps.npy", time=0))
    assert track is not None
    prepared: list[tuple[str, list[int]]] = []
    first = VALUES[:, 0, 0, 0].tolist()

    def prepare(arrays: Sequence[np.ndarray]) -> None:
        prepared.append((threading.current_thread().name, [first.index(each[0, 0, 0]) for each in arrays]))

    ahead = Ahead(lambda: None, prepare=prepare)
    ahead.ask([track], range(STEPS))
    waited(ahead, lambda: ahead.steps([track.key], 1) is not None)
    assert ahead.steps([track.key], 2) is None  # though there is room for it
    ahead.ask([track], [1, 2, 3])
    waited(ahead, lambda: ahead.steps([track.key], 2) is not None)
    assert {name for name, _ in prepared} == {"texvol time steps"}
    assert [sorted(each) for _, each in prepared][-1] == [1, 2]
    ahead.close()
    waited(ahead, lambda: prepared[-1][1] == [])


def test_a_step_is_shown_even_if_there_is_no_memory_to_prepare_it(folder: Path) -> None:
    track = Track.of(load("steps.npy", time=0))
    assert track is not None

    def prepare(arrays: Sequence[np.ndarray]) -> None:
        if arrays:
            raise OSError("no memory")

    ahead = Ahead(lambda: None, prepare=prepare)
    ahead.ask([track], [3])
    waited(ahead, lambda: ahead.steps([track.key], 3) is not None)
    ahead.close()


class Glfw:
    """A monitor of 1280 x 800 with a bar of 30 at its top, and a window with a frame on it."""

    MAXIMIZED = 1

    def __init__(self, top: int, height: int) -> None:
        self.left, self.top, self.width, self.height, self.maximised = 1, top, 1278, height, False

    def get_primary_monitor(self) -> bool:
        return True

    def get_window_attrib(self, window: object, name: int) -> bool:
        return self.maximised

    def get_monitor_workarea(self, monitor: object) -> tuple[int, int, int, int]:
        return 0, 30, 1280, 770

    def get_window_pos(self, window: object) -> tuple[int, int]:
        return self.left, self.top

    def get_window_frame_size(self, window: object) -> tuple[int, int, int, int]:
        return 1, 20, 1, 5

    def get_window_size(self, window: object) -> tuple[int, int]:
        return self.width, self.height

    def set_window_size(self, window: object, width: int, height: int) -> None:
        self.width, self.height = width, height

    def set_window_pos(self, window: object, left: int, top: int) -> None:
        self.left, self.top = left, top


@pytest.mark.parametrize(
    "size, place",
    [((1920, 1080), (1, 50, 1278, 745)), ((900, 700), (300, 95, 900, 700)), ((600, 400), (300, 200, 600, 400))],
)
def test_a_resized_window_stays_on_the_monitor_with_its_frame(
    size: tuple[int, int], place: tuple[int, int, int, int]
) -> None:
    screen = Screen.__new__(Screen)
    screen._glfw, screen._window, screen._windowed = glfw, _, _ = Glfw(200, 500), object(), None
    glfw.left = 300
    screen.resize(size)
    assert (glfw.left, glfw.top, glfw.width, glfw.height) == place


@pytest.mark.parametrize("top, height, more", [(50, 745, 0), (50, 720, 25), (50, 600, 44), (300, 745, 0)])
def test_the_window_grows_by_the_time_bar_as_far_as_the_monitor_has_room(top: int, height: int, more: int) -> None:
    screen = Screen.__new__(Screen)
    screen._glfw, screen._window, screen._windowed = glfw, _, _ = Glfw(top, height), object(), None
    assert screen.grow(44) == more and glfw.height == height + more
    assert screen.grow(-more) == -more and glfw.height == height
    glfw.maximised = True
    assert screen.grow(44) == 0 and glfw.height == height
