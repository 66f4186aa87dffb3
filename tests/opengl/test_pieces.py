"""Frames of more than half a second are drawn in tiles, which make the same picture, and end with ctrl-C."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, random_volume

from texvol.opengl import pieces
from texvol.opengl.compositor import Compositor
from texvol.opengl.pieces import LONG, Pieces, Region, Regions
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util import progress

SIZE = (120, 90)
NOISE = random_volume(3, (12, 10, 9))
SCENE = Scene(NOISE, BONE, Camera.framing(NOISE), classification="extinction")


class Device:
    """A device on which time passes as it draws: so many seconds for a slab of a pixel."""

    def __init__(self, pace: float, monkeypatch: pytest.MonkeyPatch) -> None:
        self.pace, self.now, self.asked = pace, 0.0, 0.0
        self.waits: list[float] = []  # seconds of work that was waited for
        self.frame = Pieces(self.finish)
        monkeypatch.setattr(pieces.time, "perf_counter", lambda: self.now)

    def finish(self) -> None:
        self.waits.append(self.asked)
        self.now, self.asked = self.now + self.asked, 0.0

    def draw(self, size: tuple[int, int], slabs: float, regions: Regions | None = None, bricks: int = 1) -> list[Any]:
        """Draw a picture; return its pieces."""
        self.frame.begin()
        self.waits.clear()
        drawn: list[Region | None] = []
        for _ in range(bricks):
            for piece in self.frame.of(regions, size, "kind", slabs):
                _, _, width, height = piece or (0, 0, *size)
                self.asked += self.pace * slabs * width * height
                drawn.append(piece)
        self.finish()
        self.frame.end()
        return drawn


def cover(drawn: list[Region], size: tuple[int, int]) -> np.ndarray:
    """How often each pixel is drawn."""
    times = np.zeros(size[::-1], int)
    for x, y, width, height in drawn:
        times[y : y + height, x : x + width] += 1
    return times


@pytest.mark.parametrize("pace", [1e-10, 5e-9, 1e-7, 3e-6])
def test_tiles_cover_the_picture_once_and_none_takes_long(pace: float, monkeypatch: pytest.MonkeyPatch) -> None:
    device, size = Device(pace, monkeypatch), (640, 500)
    for _ in range(3):  # the first one knows nothing of the device
        drawn = device.draw(size, 400)
        if drawn != [None]:
            assert (cover(drawn, size) == 1).all()
        assert max(device.waits) <= LONG
    assert (drawn == [None]) == (pace * 400 * size[0] * size[1] <= LONG)


def test_regions_keep_to_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    device, regions = Device(1e-7, monkeypatch), ((3, 5, 100, 40), (200, 0, 64, 64))
    assert device.draw((300, 200), 4, regions) == list(regions)
    times = cover(device.draw((300, 200), 4000, regions), (300, 200))
    assert (times == cover(list(regions), (300, 200))).all()


def test_a_device_that_is_slower_than_thought_is_known_the_next_time(monkeypatch: pytest.MonkeyPatch) -> None:
    device = Device(1e-6, monkeypatch)
    assert device.draw((100, 100), 100) == [None] and max(device.waits) > 0.9
    assert len(device.draw((100, 100), 100)) > 1 and max(device.waits) <= LONG


def test_many_short_bricks_do_not_pile_up(monkeypatch: pytest.MonkeyPatch) -> None:
    device = Device(2e-8, monkeypatch)
    assert device.draw((100, 100), 1000, bricks=20) == [None] * 20  # 0.2 seconds each
    assert max(device.waits) <= LONG and len(device.waits) > 8


def test_those_who_hear_the_progress_wait_for_short_tiles(monkeypatch: pytest.MonkeyPatch) -> None:
    device, told = Device(1e-8, monkeypatch), []
    with progress.heard(told.append, 0.4), progress.part(0.4):
        drawn = device.draw((200, 200), 1000)
    assert max(device.waits) < 0.1 and (cover(drawn, (200, 200)) == 1).all()
    assert told == sorted(told) and told[-1] >= 0.9


@pytest.mark.parametrize("pipeline", ["fragment", "compute"])
@pytest.mark.parametrize("slicing", ["stacks", "polygons", "wilson"])
def test_a_picture_in_tiles_is_the_picture(pipeline: str, slicing: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    if (pipeline, slicing) in (("compute", "polygons"), ("compute", "wilson")):
        return
    scenes = [SCENE if slicing != "wilson" else replace(SCENE, classification="slab")]
    if slicing == "stacks":
        moved = Volume(NOISE.values, (1, 1, 1), (4, 2, 0))
        scenes += [replace(SCENE, mode="mip"), replace(SCENE, added=(AddedVolume(moved, BONE),))]
    with Renderer(pipeline=pipeline) as renderer:
        whole = [np.asarray(renderer.render(scene, SIZE, slicing=slicing)) for scene in scenes]
    tiles, of = 0, Pieces.of

    def counted(*how: Any) -> Any:
        nonlocal tiles
        for piece in of(*how):
            tiles += piece is not None
            yield piece

    monkeypatch.setattr(Pieces, "of", counted)
    monkeypatch.setattr(pieces, "_UNKNOWN", 1.0)
    monkeypatch.setattr(pieces, "_TILE", 0.0)  # no tile ever grows
    with Renderer(pipeline=pipeline) as renderer:
        for scene, picture in zip(scenes, whole, strict=True):
            assert np.array_equal(renderer.render(scene, SIZE, slicing=slicing), picture, equal_nan=True)
            assert tiles >= 10
            tiles = 0


def test_an_interruption_ends_the_picture_at_the_next_tile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "_UNKNOWN", 1.0)
    monkeypatch.setattr(pieces, "_TILE", 0.0)  # no tile ever grows
    waits = 0

    def interrupted() -> None:
        nonlocal waits
        waits += 1
        if waits == 4:
            raise KeyboardInterrupt
        finish()

    with Renderer() as renderer:
        compositor: Compositor = renderer._compositor
        finish = compositor._frame._finish
        compositor._frame._finish = interrupted  # type: ignore[method-assign]
        with pytest.raises(KeyboardInterrupt):
            renderer.render(SCENE, SIZE)
        assert waits == 4
        compositor._frame._finish = finish  # type: ignore[method-assign]
        with Renderer() as other:
            assert np.array_equal(renderer.render(SCENE, SIZE), other.render(SCENE, SIZE))
