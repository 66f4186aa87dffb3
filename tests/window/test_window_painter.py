"""Painting processes: they draw what a Renderer draws, get what is large once, and leave off for what is newer."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing.connection import Pipe
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from texvol.formats.pictures import image
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util import progress
from texvol.window.jobs import Answer
from texvol.window.painter import Painter
from texvol.window.transport import Receiver, Sender, SharedArrays

SIZE = (64, 48)
z, y, x = np.mgrid[tuple(slice(-1, 1, 40j) for _ in range(3))]
VOLUME = Volume(np.exp(-3 * (x**2 + y**2 + z**2)).astype(np.float32), name="ball")
FOG = TransferFunction([0.2, 1.0], [(0.9, 0.4, 0.1), (0.2, 0.5, 0.9)], [0.0, 0.3])
SCENE = Scene(VOLUME, FOG, Camera.framing(VOLUME, aspect=4 / 3), background=(0.0, 0.1, 0.2), classification="slab")
PATIENCE = 60  # seconds


@pytest.fixture
def pipe() -> Iterator[tuple[Sender, Receiver, SharedArrays]]:
    one, other = Pipe()
    shared = SharedArrays()
    yield Sender(one, shared), Receiver(other), shared
    shared.close()
    one.close()
    other.close()


def test_what_stays_the_same_is_the_same_object_over_there(pipe: tuple[Sender, Receiver, SharedArrays]) -> None:
    sender, receiver, _ = pipe
    found = []
    for brightness in (0.0, 0.5):
        sender.send(replace(SCENE, background=(brightness, 0.0, 0.0)))
        found.append(receiver.receive())
    first, second = found
    assert first.volume is second.volume and first.transfer_function is second.transfer_function
    assert first.volume is not VOLUME and np.array_equal(first.volume.values, VOLUME.values)
    assert (first.background[0], second.background[0]) == (0.0, 0.5)
    assert first.volume.name == "ball" and (first.volume.spacing == VOLUME.spacing).all()


def test_what_is_no_longer_needed_is_forgotten_and_comes_again(pipe: tuple[Sender, Receiver, SharedArrays]) -> None:
    sender, receiver, _ = pipe
    other = TransferFunction([0.5], [(1, 1, 1)], [1.0])
    scenes = []
    for medium in (FOG, other, FOG):
        sender.send(replace(SCENE, transfer_function=medium))
        scenes.append(receiver.receive())
        assert np.array_equal(scenes[-1].transfer_function.values, medium.values)
    assert scenes[0].transfer_function is not scenes[2].transfer_function
    assert scenes[0].volume is scenes[2].volume
    assert len(receiver._known) == 3  # the volume, its array, one transfer function


def test_volumes_within_volumes_keep_their_arrays(pipe: tuple[Sender, Receiver, SharedArrays]) -> None:
    sender, receiver, shared = pipe
    second = Volume(VOLUME.values[::-1].copy())
    scene = replace(SCENE, added=(AddedVolume(second, FOG),))
    for _ in range(3):
        sender.send(scene)
        shared.keep_only(sender.arrays)
        there = receiver.receive()
        assert np.array_equal(there.added[0].volume.values, second.values)
    assert {id(VOLUME.values), id(second.values)} <= sender.arrays


class Studio:
    """A painter, and a way to wait for it."""

    def __init__(self) -> None:
        self.shared, self._woken = SharedArrays(), threading.Event()
        self.painter = Painter(self.shared, self._woken.set)

    def answers(self, **job: Any) -> list[Answer]:
        """All that come of a job, the final one last."""
        self.painter.ask(**job)
        # How many times a single picture tells its progress depends on the machine.
        return [each for each in self.rest() if each.kind != "progress" or job["kind"] == "film"]

    def pictures(self, **job: Any) -> list[Answer]:
        """The answers that are pictures; one that is drawn for its time alone may follow them."""
        return [each for each in self.answers(**job) if each.kind == "picture"]

    def rest(self) -> list[Answer]:
        found: list[Answer] = []
        end = time.monotonic() + PATIENCE
        while self.painter.busy and time.monotonic() < end:
            self._woken.wait(0.05)
            self._woken.clear()
            found += self.painter.answers()
        assert found and found[-1].final
        return found


@pytest.fixture(scope="module")
def studio() -> Iterator[Studio]:
    made = Studio()
    yield made
    made.painter.close()
    made.shared.close()


def test_a_painter_draws_on_the_device_that_is_asked_for() -> None:
    shared, woken = SharedArrays(), threading.Event()
    painter = Painter(shared, woken.set, device="titan")
    try:
        assert woken.wait(PATIENCE)
        (answer,) = painter.answers()
        assert answer.kind == "failed" and "got 'titan'; there are: " in answer.text
    finally:
        painter.close()
        shared.close()


def test_a_painter_draws_what_render_writes(studio: Studio) -> None:
    (answer,) = studio.pictures(kind="move", scene=SCENE, size=SIZE, accuracy={"sampling_rate": 0.7})
    with Renderer() as renderer:
        picture = renderer.render(SCENE, SIZE, sampling_rate=0.7)
        assert answer.metadata["settings"] == renderer.settings
    assert answer.pixels is not None and np.array_equal(answer.pixels, image.eight_bits(picture))


def test_the_first_picture_of_its_kind_is_timed_by_a_smaller_one(studio: Studio) -> None:
    """Its own time is that of programs and textures too, and would have the first turn drawn too finely or coarsely."""
    asked: dict[str, Any] = {"kind": "move", "size": SIZE, "accuracy": {"sampling_rate": 0.7}}
    scene = replace(SCENE, gradient=Estimator("gaussian", 3.0))
    first, timed = studio.answers(scene=scene, **asked)
    assert (first.kind, first.final) == ("picture", False)
    assert (timed.kind, timed.final, timed.pixels) == ("timed", True, None)
    assert 0 < timed.metadata["seconds"] < PATIENCE and timed.metadata["shrink"] == 2
    (again,) = studio.answers(scene=scene, **asked)
    assert (again.kind, again.final) == ("picture", True)
    assert np.array_equal(again.pixels, first.pixels)


def test_light_that_is_new_is_preceded_by_the_same_unlit(studio: Studio) -> None:
    """Gradients take a while to find, and there should be something to look at."""
    lit = replace(SCENE, classification="post", lighting=Lighting(), gradient=Estimator("gaussian", 2.0))
    asked: dict[str, Any] = {"kind": "move", "size": SIZE, "accuracy": {"sampling_rate": 0.7}}
    first, second = studio.pictures(scene=lit, **asked)
    (again,) = studio.answers(scene=replace(lit, lighting=Lighting(diffuse=0.5)), **asked)
    assert not first.final
    with Renderer() as renderer:
        for answer, scene in ((first, replace(lit, lighting=None)), (second, lit)):
            picture = renderer.render(scene, SIZE, sampling_rate=0.7)
            assert answer.pixels is not None and np.array_equal(answer.pixels, image.eight_bits(picture))
    assert not np.array_equal(again.pixels, second.pixels)
    assert len(studio.pictures(scene=replace(lit, gradient=Estimator("gaussian", 1.0)), **asked)) == 2


@pytest.mark.parametrize("kind", ["slab", "extinction", "post", "integrated"])
def test_at_rest_the_error_is_what_was_wanted(studio: Studio, kind: Any) -> None:
    scene, wanted = replace(SCENE, classification=kind), 1 / 255
    answers = studio.answers(kind="rest", scene=scene, size=SIZE, accuracy={"max_error": wanted})
    metadata = answers[-1].metadata
    assert [answer.kind for answer in answers] == ["picture"] * 2 and metadata["reached"]
    assert metadata["estimated_error"] <= wanted
    with Renderer() as renderer:
        picture = renderer.render(scene, SIZE, max_error=wanted)
        assert renderer.settings == metadata["settings"]
        finest = renderer.render(scene, SIZE, sampling_rate=32, early_termination=0)
    assert np.array_equal(answers[-1].pixels, image.eight_bits(picture))
    assert np.abs(picture - finest).max() <= wanted


def test_a_picture_in_pieces_is_the_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    from texvol.opengl import compositor
    from texvol.opengl import pieces as of_frames
    from texvol.window import painting

    pieces, draw_triangles = 0, compositor.draw_triangles

    def counted(*how: Any) -> None:
        nonlocal pieces
        pieces += 1
        draw_triangles(*how)

    monkeypatch.setattr(compositor, "draw_triangles", counted)
    monkeypatch.setattr(of_frames, "_FEWEST", 5)
    monkeypatch.setattr(of_frames, "_HEARD", 0.0)  # no piece ever grows
    renderer = painting.PiecewiseRenderer()
    try:
        whole = renderer.render(SCENE, SIZE, sampling_rate=3)
        assert pieces == 1, "nobody hears the progress"
        with progress.heard(lambda _: None):
            parts = renderer.render(replace(SCENE), SIZE, sampling_rate=3)
            drawn = pieces - 1
            again = renderer.render(SCENE, SIZE, sampling_rate=3.5)
            assert pieces == 1 + 2 * drawn, "another thickness is drawn"
            same = renderer.render(SCENE, SIZE, sampling_rate=3.5)
            assert pieces == 1 + 2 * drawn, "the very same is not drawn again"
    finally:
        renderer.close()
    assert drawn == np.ceil(SIZE[0] / 5) * np.ceil(SIZE[1] / 5)
    assert np.array_equal(whole, parts) and np.array_equal(again, same) and not np.array_equal(whole, again)


def test_what_is_superseded_is_left_off(studio: Studio) -> None:
    # Minutes of work, if it were done.
    long = {"kind": "rest", "scene": replace(SCENE, classification="integrated"), "size": (1200, 900)}
    studio.painter.ask(**long, accuracy={"max_error": 1e-9})
    time.sleep(1.0)
    start = time.monotonic()
    answers = studio.pictures(kind="move", scene=SCENE, size=SIZE, accuracy={"sampling_rate": 1})
    assert answers[-1].kind == "picture" and answers[-1].pixels is not None and answers[-1].pixels.shape[:2] == (48, 64)
    # A piece takes some 15 ms; the rest is for a busy machine. Undisturbed it would be minutes.
    assert time.monotonic() - start < PATIENCE


def test_what_goes_wrong_is_said_and_the_painter_paints_on(studio: Studio) -> None:
    (answer,) = studio.answers(kind="move", scene=SCENE, size=(1 << 20, 8))
    assert answer.kind == "failed" and "size 1048576x8" in answer.text
    assert studio.pictures(kind="move", scene=SCENE, size=SIZE)


def test_a_painter_that_was_killed_is_another_one_next_time(studio: Studio) -> None:
    process = studio.painter._process
    process.send_signal(signal.SIGKILL)
    process.wait(10)
    assert studio.pictures(kind="move", scene=SCENE, size=SIZE)
    # And one that is killed in the middle of its work says so.
    studio.painter.ask(kind="rest", scene=SCENE, size=(1200, 900), accuracy={"max_error": 1e-9})
    studio.painter._process.kill()
    (answer,) = studio.rest()
    assert answer.kind == "failed" and "ended unexpectedly" in answer.text
    before = len(os.listdir("/proc/self/fd"))
    assert studio.pictures(kind="move", scene=SCENE, size=SIZE)
    assert len(os.listdir("/proc/self/fd")) <= before, "nothing of the one before is held"


def test_files_are_those_of_render(studio: Studio, tmp_path: Path) -> None:
    path = str(tmp_path / "a.exr")
    answers = studio.answers(kind="file", scene=SCENE, size=SIZE, accuracy={"sampling_rate": 2}, path=path, name="ball")
    assert answers[-1].kind == "done"
    with Renderer() as renderer:
        assert np.array_equal(image.read(path), renderer.render(SCENE, SIZE, sampling_rate=2))
    (failed,) = studio.answers(kind="file", scene=SCENE, size=SIZE, path=str(tmp_path / "no/where.png"), name="ball")
    assert failed.kind == "failed" and "where.png" in failed.text


def test_a_film_is_an_orbit(studio: Studio, tmp_path: Path) -> None:
    path = str(tmp_path / "f%02d.png")
    answers = studio.answers(
        kind="film", scene=SCENE, size=SIZE, accuracy={"sampling_rate": 1}, path=path, views=3, name="b"
    )
    assert answers[-1].kind == "done" and answers[-1].metadata["views"] == 3
    assert [answer.metadata["done"] for answer in answers[:-1]] == pytest.approx([0, 1 / 3, 2 / 3])
    assert sorted(each.name for each in tmp_path.iterdir()) == ["f00.png", "f01.png", "f02.png"]


def test_closing_waits_only_so_long_for_a_process_that_was_killed() -> None:
    studio = Studio()
    process = studio.painter._process
    with patch.object(process, "wait", side_effect=subprocess.TimeoutExpired("painter", 1)) as wait:
        studio.painter.close()
    assert wait.called
    studio.shared.close()
    assert process.wait(PATIENCE) == -signal.SIGKILL


def test_closing_leaves_no_process_and_no_descriptor() -> None:
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(3):
        studio = Studio()
        studio.answers(kind="move", scene=SCENE, size=SIZE)
        process = studio.painter._process
        studio.painter.close()
        studio.shared.close()
        assert process.returncode is not None
        del studio  # which maps the number of the newest job
    assert len(os.listdir("/proc/self/fd")) <= before


def test_arrays_that_there_is_no_room_for_leave_nothing_half_sent(pipe: tuple[Sender, Receiver, SharedArrays]) -> None:
    """A limit on the size of files holds for memory that processes share, too."""
    sender, receiver, _ = pipe
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            sender.send(SCENE)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    sender.send(SCENE)
    assert np.array_equal(receiver.receive().volume.values, VOLUME.values)


def test_a_painter_says_that_there_is_no_room(studio: Studio) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    volume = Volume(VOLUME.values.copy())  # which the other side has not got yet
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, limits[1]))
    try:
        job = {"scene": replace(SCENE, volume=volume), "size": SIZE, "accuracy": {"sampling_rate": 0.7}}
        (answer,) = studio.answers(kind="move", **job)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert answer.kind == "failed" and "File too large: the limit (ulimit -f) is 1024 bytes" in answer.text


def test_prepared_arrays_are_kept_until_others_are(pipe: tuple[Sender, Receiver, SharedArrays]) -> None:
    _, _, shared = pipe
    one, other, small = np.zeros((64, 64, 64)), np.ones((64, 64, 64)), np.zeros(3)
    shared.prepare([one, small])
    shared.keep_only(set())
    assert copies_made(shared, one) == 0
    shared.prepare([other])
    shared.keep_only(set())
    assert copies_made(shared, other) == 0 and copies_made(shared, one) == 1
    assert copies_made(shared, small) == 1  # too small to be kept


def copies_made(shared: SharedArrays, array: np.ndarray) -> int:
    """Number of copies that `descriptor` makes of an array."""
    before = memory_files()
    shared.descriptor(array)
    return len(memory_files() - before)


def memory_files() -> set[int]:
    """Memory files that this process has open."""
    return {int(each) for each in os.listdir("/proc/self/fd") if "texvol-array" in target_of(each)}


def target_of(descriptor: str) -> str:
    """Name of the file that a descriptor refers to; "" if it has been closed."""
    try:
        return os.readlink(f"/proc/self/fd/{descriptor}")
    except OSError:
        return ""
