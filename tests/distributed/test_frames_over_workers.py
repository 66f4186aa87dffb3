"""Frames that workers draw whole are those of one process, whatever becomes of a worker."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.processes import REPOSITORY
from support.quick_stats import quick_stats
from support.stores import write_ome

import texvol
from texvol import Camera, InputError, Renderer, Scene, TransferFunction, Volume
from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.distributed.renderer import DistributedRenderer
from texvol.distributed.workers import Workers
from texvol.rendering.frames import Frame
from texvol.scene import orbit

FOG = TransferFunction([0.3, 0.6, 1.0], [(1, 0, 0), (1, 0.5, 0), (1, 1, 1)], [0.0, 0.1, 0.3])
SIZE = (40, 32)
COUNT = 6


def ball(side: int = 32, centre: float = 0.5) -> np.ndarray:
    z, y, x = np.mgrid[:side, :side, :side] / (side - 1) - centre
    return (1 - 2 * np.sqrt(x * x + y * y + z * z)).astype(np.float32)


def turned(scene: Scene, count: int = COUNT) -> Iterator[Scene]:
    camera = Camera.framing(scene.volume, eye=scene.completed(SIZE).camera.eye)
    return (replace(scene, camera=orbit.turned(camera, 360 * i / count)) for i in range(count))


def frames(renderer: Renderer, scenes: Any, **asked: Any) -> list[Frame]:
    return list(renderer.frames(scenes, SIZE, **{"count": COUNT, "views": COUNT, "max_error": None} | asked))


def in_memory(folder: Path) -> Scene:
    return Scene(Volume(ball()), FOG, background=(0.2, 0.3, 0.4))


def in_store(folder: Path) -> Scene:
    return Scene(texvol.load(write_ome(folder / "v.ome.zarr", ball(48), chunk=16)), FOG)


@pytest.mark.parametrize("scene_in", [in_memory, in_store])
@pytest.mark.parametrize("asked", [{}, {"max_error": 0.003}], ids=["rate", "error"])
def test_frames_are_those_of_one_process(
    workers: Workers, renderer: Renderer, tmp_path: Path, scene_in: Any, asked: dict[str, Any]
) -> None:
    scene = scene_in(tmp_path)
    with DistributedRenderer(workers) as several:
        found, stats = frames(several, turned(scene), **asked), several.stats
    wanted = frames(renderer, turned(scene), **asked)
    assert len(found) == COUNT and found[0].kept.accuracy == wanted[0].kept.accuracy
    for one, other in zip(found, wanted, strict=True):
        assert_array_equal(one.picture, other.picture)
        assert one.settings == other.settings and one.scene.camera == other.scene.camera
        assert one.scene.classification == other.scene.classification != "auto"
    assert not np.array_equal(found[0].picture, found[1].picture)
    assert stats["divided"] == "frames" and stats["divided_because"] == "6 frames for 2 workers"
    assert [each["number"] for each in stats["frames"]] == list(range(COUNT))
    assert len({each["process"] for each in stats["frames"]}) == 2
    assert stats["samples"] == quick_stats(renderer, samples=True)["samples"]


def test_time_steps_are_those_of_one_process(workers: Workers, renderer: Renderer) -> None:
    camera = Scene(Volume(ball()), FOG).completed(SIZE).camera
    steps = [Scene(Volume(ball(centre=0.3 + 0.05 * i)), FOG, camera, classification="slab") for i in range(COUNT)]
    with DistributedRenderer(workers) as several:
        found = frames(several, steps, views=1)
    for one, other in zip(found, frames(renderer, steps, views=1), strict=True):
        assert_array_equal(one.picture, other.picture)


def test_few_frames_go_on_their_way_at_once(workers: Workers) -> None:
    taken = []

    def counted() -> Iterator[Scene]:
        for scene in turned(Scene(Volume(ball()), FOG), 20):
            taken.append(scene)
            yield scene

    with DistributedRenderer(workers) as several:
        coming = several.frames(counted(), SIZE, count=20, max_error=None)
        for number, _ in enumerate(coming, 1):
            assert number < len(taken) <= number + 2 * 2 or len(taken) == 20
            if number == 12:
                break
        coming.close()
    assert len(taken) < 20


@pytest.mark.parametrize("blocks", [None, 3])
def test_blocks_go_over_workers_where_frames_are_few(workers: Workers, renderer: Renderer, blocks: int | None) -> None:
    scene, count = Scene(Volume(ball()), FOG, classification="post"), 1 if blocks is None else 2
    with DistributedRenderer(workers, blocks=blocks) as several:
        found, stats = frames(several, turned(scene, count), count=count), several.stats
        assert stats["divided"] == "blocks" and len(stats["blocks"]) == (blocks or 2) and "frames" not in stats
        assert stats["divided_because"] == ("1 frame for 2 workers" if blocks is None else "3 blocks were asked for")
        several.render(scene, SIZE)
        assert several.stats["divided_because"] == "a single picture"
    for one, other in zip(found, frames(renderer, turned(scene, count), count=count), strict=True):
        assert_allclose(one.picture, other.picture, atol=2e-6)


def test_what_a_worker_holds_in_blocks_only_is_drawn_in_blocks(
    workers: Workers, renderer: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    volume = texvol.load(write_ome(tmp_path / "v.ome.zarr", ball(96), chunk=16), memory=4_800_000)
    scene = Scene(volume, FOG, classification="post")
    # A frame takes 3.5 MB of samples, of which each worker has room for three quarters of its memory.
    monkeypatch.setattr(workers, "_machine", replace(workers._machine, memory=2_400_000))
    with DistributedRenderer(workers) as several:
        found, stats = frames(several, turned(scene, 3), level=0, count=3), several.stats
    assert stats["divided"] == "blocks" and "whole frame takes" in stats["divided_because"]
    for one, other in zip(found, frames(renderer, turned(scene, 3), level=0, count=3), strict=True):
        assert_allclose(one.picture, other.picture, atol=2e-6)


def test_an_error_of_a_worker_is_that_of_one_process(workers: Workers, tmp_path: Path) -> None:
    scene = in_store(tmp_path)
    for chunk in (tmp_path / "v.ome.zarr" / "0").rglob("c/*/*/*"):
        chunk.write_bytes(b"nothing that decodes")
    with DistributedRenderer(workers) as several, pytest.raises(InputError, match=r"v\.ome\.zarr.*chunk") as raised:
        frames(several, turned(scene), level=0)
    assert "\n" not in str(raised.value)


def test_the_command_writes_the_same_film(workers: Workers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By workers that are there: that the command starts its own is held by others, such as the one of ctrl-C."""
    asked: list[int] = []

    def there(count: int, **_: Any) -> Workers:
        asked.append(count)
        return workers

    monkeypatch.setattr("texvol.distributed.workers.Workers", there)
    monkeypatch.setattr(workers, "close", lambda: None)  # they are for other tests as well
    monkeypatch.chdir(tmp_path)
    np.save("ball.npy", ball())
    line = ["render", "ball.npy", "--tf", "fog", "--size", "40x32", "--orbit", "4", "--stats", "stats.json"]
    for name in ("%d.exr", ".gif"):
        assert main([*line, "-o", f"one{name}"]) == 0
        assert main([*line, "-o", f"two{name}", "--workers", "2"]) == 0
    for number in range(4):
        one, two = (read_picture(f"{name}{number}.exr") for name in ("one", "two"))
        assert_array_equal(one.pixels, two.pixels)
        one, two = ({k: v for k, v in each.attributes.items() if k != "DateTime"} for each in (one, two))
        assert one == two
    assert Path("one.gif").read_bytes() == Path("two.gif").read_bytes()
    assert asked == [2, 2]


def test_ctrl_c_leaves_whole_frames_and_no_process(tmp_path: Path) -> None:
    np.save(tmp_path / "ball.npy", ball())
    line = [
        "render",
        "ball.npy",
        "--tf",
        "fog",
        "--orbit",
        "500",
        "--size",
        "100x80",
        "-o",
        "f%d.exr",
        "--workers",
        "2",
    ]
    command = subprocess.Popen(
        [sys.executable, "-m", "texvol", *line, "--sampling-rate", "8", "--classification", "post"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # a terminal sends the signal to the whole group
    )
    deadline = time.monotonic() + 100
    while not (tmp_path / "f2.exr").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(command.pid, signal.SIGINT)
    _, said = command.communicate(timeout=60)
    assert (command.returncode, said) == (130, "texvol: interrupted\n")
    written = {path.name for path in tmp_path.iterdir()} - {"ball.npy"}
    assert written == {f"f{number}.exr" for number in range(len(written))} and 3 <= len(written) < 500
    assert all(read_picture(tmp_path / name).pixels.any() for name in written)


@pytest.mark.parametrize("count", [1, 2])
def test_killed_workers_change_no_frame(renderer: Renderer, request: pytest.FixtureRequest, count: int) -> None:
    """The only worker, and both of two: those of this module, in whose last test others come in their place."""
    scene = Scene(Volume(ball()), FOG, classification="post")
    wanted = frames(renderer, turned(scene), sampling_rate=4)
    with ExitStack() as stack:
        workers = request.getfixturevalue("workers") if count == 2 else stack.enter_context(Workers(count))
        several = stack.enter_context(DistributedRenderer(workers))
        for number, frame in enumerate(several.frames(turned(scene), SIZE, count=COUNT, sampling_rate=4)):
            assert_array_equal(frame.picture, wanted[number].picture)
            if number < 2:
                assert several._whole is not None
                os.kill(several._whole.stats[-1]["process"], signal.SIGKILL)
        assert several._whole is not None and len({each["process"] for each in several._whole.stats}) > 1
