"""Blocks of the box: they fill it, have about as much work each, and are composited front to back."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.large import large

from texvol import Camera, Renderer, Scene, TransferFunction, Volume
from texvol.distributed.blocks import blocks_of, composited, leaves
from texvol.distributed.cropped import Cropped, cropped, over
from texvol.scene.scene import CompleteScene

BALL_TF = TransferFunction([0.4, 0.5, 1.0], [(1, 0, 0), (1, 0.5, 0), (1, 1, 1)], [0.0, 0.2, 0.4])


def ball(side: int = 40, centre: float = 0.5) -> np.ndarray:
    z, y, x = np.mgrid[:side, :side, :side] / (side - 1) - centre
    return (1 - 2 * np.sqrt(x * x + y * y + z * z)).astype(np.float32)


def complete(volume: Volume, camera: Camera | None = None) -> CompleteScene:
    return Scene(volume, BALL_TF, camera, classification="post").completed((40, 30))


@pytest.mark.parametrize("count", [1, 2, 3, 5, 7, 16, 33])
@pytest.mark.parametrize("in_store", [False, True])
def test_blocks_fill_the_box_once(count: int, in_store: bool) -> None:
    volume: Volume = large(Volume(ball()), 8)[0] if in_store else Volume(ball())
    blocks = list(leaves(blocks_of(complete(volume), (40, 30), count)))
    assert len(blocks) <= count and (in_store or len(blocks) == count)
    assert [block.number for block in blocks] == list(range(len(blocks)))
    assert sum(block.work for block in blocks) == pytest.approx(1.0)
    points = np.random.default_rng(count).random((500, 3))
    inside = [(points >= block.corners[0]).all(1) & (points < block.corners[1]).all(1) for block in blocks]
    assert_array_equal(np.sum(inside, axis=0), 1)


def test_work_is_divided_and_not_volume() -> None:
    values = np.zeros((64, 64, 64), np.float32)
    values[:, :, :16] = ball(64)[:, :, 24:40]  # everything is in a quarter of the box
    scene = complete(Volume(values, spacing=(1, 0.2, 0.2)))
    low, high = leaves(blocks_of(scene, (40, 30), 2))
    assert 0.35 < low.work < 0.65
    assert low.high[0] <= 16 / 64 and low.high == (high.low[0], 1e9, 1e9)


def test_what_is_off_the_screen_is_no_work() -> None:
    volume = Volume(np.ones((32, 32, 32), np.float32))
    camera = Camera.orthographic((8, 15.5, -100), (8, 15.5, 15.5), (0, 1, 0), height=8)
    shown = list(leaves(blocks_of(complete(volume, camera), (8, 8), 2)))
    everything = list(leaves(blocks_of(complete(volume), (8, 8), 2)))
    assert shown[0].high[0] < everything[0].high[0] == 0.5


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("eye", [(90, 70, -60), (-40, 10, 15), (15, -80, 90), (18, 25, 12)])
def test_no_block_hides_one_before_it(projection: str, eye: tuple[float, float, float]) -> None:
    volume = Volume(ball(32))
    target = (15.5, 15.5, 15.5) if eye != (18, 25, 12) else (5.0, 3.0, 9.0)
    look = {"eye": eye, "target": target, "up": (0.1, 0.2, 1.0)}
    is_parallel = projection == "orthographic"
    camera = Camera.orthographic(**look, height=40) if is_parallel else Camera.perspective(**look, fov=60)
    scene = complete(volume, camera)
    tree = blocks_of(scene, (40, 30), 12)
    order = composited(tree, scene, lambda block: [block], lambda front, behind: front + behind)
    assert len(order) == 12
    eyes, directions = scene.camera.rays((9, 9))
    for start, direction in zip(eyes.reshape(-1, 3), directions.reshape(-1, 3), strict=True):
        depths = np.linspace(0.01, 250, 4000)
        if projection == "orthographic":
            depths = depths - 125
        points = (start + depths[:, np.newaxis] * direction - volume.box_corner) @ volume.index_from_world.T / 32
        points = points[((points >= 0) & (points < 1)).all(1)]
        inside = [(points >= block.corners[0]).all(1) & (points < block.corners[1]).all(1) for block in order]
        met = np.argmax(inside, axis=0).tolist()
        assert met == sorted(met)


def test_over_of_cropped_pictures_is_that_of_whole_ones() -> None:
    generator = np.random.default_rng(1)
    for (a, b), (c, d) in itertools.product([((3, 9), (4, 12)), ((0, 2), (0, 3)), ((5, 5), (1, 8))], repeat=2):
        front, behind = np.zeros((2, 14, 16, 4), np.float32)
        front[a[0] : a[1], a[0] : b[1]] = generator.random((*front[a[0] : a[1], a[0] : b[1]].shape[:2], 4)) * 0.9
        behind[c[0] : c[1], d[0] : d[1]] = generator.random((*behind[c[0] : c[1], d[0] : d[1]].shape[:2], 4)) * 0.9
        found = over(cropped(front), cropped(behind)).whole((16, 14))
        assert_allclose(found, front + (1 - front[..., 3:]) * behind, atol=1e-7)
    assert cropped(np.zeros((3, 4, 4), np.float32)).is_empty
    assert cropped(behind).pixels.shape[:2] <= behind.shape[:2]
    assert isinstance(cropped(front), Cropped)


@pytest.mark.parametrize("slicing", ["stacks", "polygons"])
@pytest.mark.parametrize("nearest", [False, True])
def test_pictures_of_blocks_make_the_whole_picture(renderer: Renderer, slicing: str, nearest: bool) -> None:
    if nearest and slicing == "polygons":
        pytest.skip("samples that are blocks are drawn in stacks")
    scene = Scene(Volume(ball(24), blocks=nearest), BALL_TF, classification="post")
    whole = renderer.render(scene, (48, 40), slicing=slicing)  # type: ignore[arg-type]
    assert renderer._last is not None
    drawn, size, settings = renderer._last
    tree = blocks_of(drawn, size, 6)
    with renderer._context:
        pictures = renderer._pictures_of(drawn)
        parts = [cropped(pictures.draw(drawn, size, settings, block=each.corners)) for each in leaves(tree)]
        counts = [pictures.count(drawn, size, settings, each.corners) for each in leaves(tree)]
        assert sum(counts) == pytest.approx(pictures.count(drawn, size, settings), rel=0.1)  # several at a time
    made = composited(tree, drawn, lambda block: parts[block.number], over)
    assert_allclose(made.whole(size), whole, atol=2e-6)
    assert all((part.whole(size) != whole).any() for part in parts)
