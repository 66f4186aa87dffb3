"""A picture in the window: only what it shows is interpolated, and the frame is that of the whole picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from texvol.opengl.contexts import Context, open_context
from texvol.opengl.overlay import Overlay
from texvol.window.filled import filled_part

SIZE = (230, 171)  # of the window
WHOLE = np.array([[0, 0, 1, 1]], np.float32)


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    opened = open_context("auto")
    yield opened
    opened.release()


def ball(height: int, width: int, radius: float = 0.3, components: int = 3) -> NDArray[np.uint8]:
    """Noise within a circle, on a background."""
    y, x = np.mgrid[:height, :width]
    inside = np.hypot(y / height - 0.5, (x - 0.4 * width) / height) < radius
    pixels = np.full((height, width, components), 37, np.uint8)
    pixels[inside] = np.random.default_rng(5).integers(0, 256, (int(inside.sum()), components))
    return pixels


def corners(height: int, width: int) -> NDArray[np.uint8]:
    """Two pixels that differ: the last one, and one at the left edge."""
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[-1, -1] = pixels[height // 2, 0] = 255
    return pixels


def shown(context: Context, pixels: NDArray[np.uint8], part: NDArray[np.float32]) -> NDArray[np.uint8]:
    height, width, components = pixels.shape
    with context:
        gl = context.gl
        overlay, target = Overlay(gl), gl.framebuffer([gl.texture(SIZE, 4)])
        texture = gl.texture((width, height), components, pixels, alignment=1)
        texture.repeat_x = texture.repeat_y = False
        target.use()
        target.clear(*(pixels[0, 0, :3] / 255))
        overlay.draw(texture, SIZE, [], [], (0.0, 0.0, 0.0), part)
        found = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1]
        assert gl.error == "GL_NO_ERROR"
        overlay.release()
        texture.release()
    return found


@pytest.mark.parametrize("make", [ball, corners])
@pytest.mark.parametrize("size", [(30, 40), (7, 5), (171, 230), (400, 301), (1, 1)])
def test_the_frame_is_that_of_the_whole_picture(
    context: Context, make: Callable[[int, int], NDArray[np.uint8]], size: tuple[int, int]
) -> None:
    pixels = make(*size)
    found, wanted = shown(context, pixels, filled_part(pixels)), shown(context, pixels, WHOLE)
    # The places of pixels are interpolated from other corners, and rounded otherwise.
    assert np.abs(found.astype(int) - wanted).max() <= 1


def test_rectangles_hug_the_shape() -> None:
    part = filled_part(ball(300, 400, components=4))
    area = float(((part[:, 2] - part[:, 0]) * (part[:, 3] - part[:, 1])).sum())
    circle = np.pi * 0.3**2 * 300 / 400
    assert circle < area < 1.15 * circle
    assert (part[1:, 1] == part[:-1, 3]).all(), "no gap between them"


def test_a_picture_of_one_colour_has_no_part() -> None:
    assert filled_part(np.full((20, 30, 3), 9, np.uint8)).shape == (0, 4)
