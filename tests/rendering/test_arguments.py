"""Arguments of `Renderer.render` and of loops over pictures, as people give them, and errors in one line."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from fractions import Fraction
from itertools import count
from typing import Any

import numpy as np
import pytest

import texvol
from texvol.distributed.frames import division_of

BALL = np.pad(np.ones((6, 6, 6), np.float32), 5)
SCENE = texvol.Scene(texvol.Volume(BALL, name="box"), "viridis")
CALLS = {
    "render": lambda renderer, **how: renderer.render(SCENE, **{"size": 16} | how),
    "orbit": lambda renderer, **how: next(renderer.orbit(SCENE, 3, **{"size": 16} | how)),
    "frames": lambda renderer, **how: next(renderer.frames([SCENE], **{"size": 16} | how)).picture,
    "texvol.render": lambda renderer, **how: texvol.render(SCENE, **{"size": 16} | how),
}


@pytest.fixture(scope="module")
def renderer() -> Iterator[texvol.Renderer]:
    with texvol.Renderer() as renderer:
        yield renderer


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize("size", [20, np.int64(20), (20, 20), [20, 20], np.array([20, 20])])
def test_a_size_is_a_number_or_a_pair(renderer: texvol.Renderer, call, size: Any) -> None:
    assert call(renderer, size=size).shape == (20, 20, 4)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize("size", [0, -3, 2.5, (0, 5), (1, 2, 3), (64.5, 48), float("nan"), True, "x", (4, "a"), 10**9])
def test_another_size_is_an_error_of_one_line(renderer: texvol.Renderer, call, size: Any) -> None:
    with pytest.raises(texvol.InputError, match="^size[: ]") as caught:
        call(renderer, size=size)
    assert "\n" not in str(caught.value)
    assert call(renderer).shape == (16, 16, 4), "the renderer can still be used"


@pytest.mark.parametrize("wanted", ["1/50", Fraction(1, 50), 0.02, np.float64(0.02), np.array(0.02), "0.02"])
def test_an_error_is_any_number_or_a_fraction(renderer: texvol.Renderer, wanted: Any) -> None:
    for call in CALLS.values():
        error = call(renderer, max_error=wanted).error
        assert error is not None
        assert error <= 0.02
    rate = renderer.render(SCENE, 16, sampling_rate=wanted).settings
    assert rate == renderer.render(SCENE, 16, sampling_rate=0.02).settings


@pytest.mark.parametrize(
    "name", ["max_error", "sampling_rate", "slab_thickness", "early_termination", "level_error", "views", "repeat"]
)
@pytest.mark.parametrize("value", ["abc", "1/0", -1, float("nan"), float("inf"), [1], True, 1j, np.array([0.1])])
def test_another_number_is_an_error_of_one_line(renderer: texvol.Renderer, name: str, value: Any) -> None:
    with pytest.raises(texvol.InputError, match=f"{name.split('_')[-1]}( of levels|) must be [^\n]*, got [^\n]*$"):
        renderer.render(SCENE, 16, **{name: value})


@pytest.mark.parametrize("number", [0, -1, 2.5, "3", float("nan"), None, True])
def test_a_wrong_count_is_told_at_once(renderer: texvol.Renderer, number: Any) -> None:
    with pytest.raises(texvol.InputError, match="count of views must be a whole number of at least 1, got"):
        renderer.orbit(SCENE, number)
    with pytest.raises(texvol.InputError, match="scene must be a Scene, got Volume"):
        renderer.orbit(SCENE.volume, 3)  # type: ignore[arg-type]


def test_frames_need_no_length(renderer: texvol.Renderer) -> None:
    scenes = (SCENE.replace(background=(number % 2, 0, 0)) for number in count())
    for number, frame in enumerate(renderer.frames(scenes, 16)):
        assert frame.picture.scene is not None
        assert frame.picture.scene.background == (number % 2, 0, 0)
        if number == 2:
            break
    assert division_of(None, 3, None).divided == "frames"


def test_a_loop_that_is_left_keeps_nothing(renderer: texvol.Renderer) -> None:
    left = [weakref.ref(next(loop)) for loop in (renderer.orbit(SCENE, 4, 16), renderer.orbit(SCENE, 4, 16))]
    for picture in renderer.orbit(SCENE, 4, 16):
        left.append(weakref.ref(picture))
        break
    del picture
    gc.collect()
    assert not [each for each in left if each() is not None]


def test_an_error_in_a_loop_leaves_the_renderer_as_it_was(renderer: texvol.Renderer) -> None:
    def scenes() -> Iterator[texvol.Scene]:
        yield SCENE
        raise KeyError("no more")

    with pytest.raises(KeyError, match="no more"):
        list(renderer.frames(scenes(), 16))
    first, second = renderer.orbit(SCENE, 2, 16), renderer.orbit(SCENE, 2, (8, 8))
    assert [each.shape for pair in zip(first, second, strict=True) for each in pair] == [(16, 16, 4), (8, 8, 4)] * 2
