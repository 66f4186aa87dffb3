"""The plot of a transfer function: its histogram and its area have their places and colours, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.scene.display import straight_colors
from texvol.scene.transfer import TransferFunction
from texvol.util.color import srgb_from_linear
from texvol.window.editing import opacity_of
from texvol.window.gestures import Frame
from texvol.window.histogram import Histogram
from texvol.window.plotted import Plotted

RED = TransferFunction([2.0, 8.0], [(1.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [0.5, 0.5])
HISTOGRAM = Histogram(np.array([0.0, 1.0, 4.0, 9.0]), np.array([3.0, 0.0, 7.0]))


def plotted(frame: Frame, histogram: Histogram = HISTOGRAM, medium: TransferFunction = RED) -> Plotted:
    return Plotted(frame, histogram, False, medium, 1.0, 1000)


@pytest.mark.parametrize("left, top, width, height", [(10, 20, 100, 60), (10.4, 19.7, 83.3, 61.1), (0, 0, 1, 1)])
@pytest.mark.parametrize("ends", [(0.0, 10.0), (3.0, 5.0)])
def test_each_pixel_shows_what_lies_there(
    left: float, top: float, width: float, height: float, ends: tuple[float, float]
) -> None:
    frame = Frame(ends, left, top, width, height)
    shown = plotted(frame)
    pixels, (x, y, right, bottom) = shown.pixels(), shown.place
    assert pixels.shape == (bottom - y, right - x, 4) and pixels.dtype == np.uint8
    heights = HISTOGRAM.heights(False)
    for row in range(bottom - y):
        for column in range(right - x):
            value, below = frame.value(x + column + 0.5), y + row + 0.5
            near = [abs(value - edge) < 1.01 * (ends[1] - ends[0]) / width for edge in (*HISTOGRAM.edges, 2.0, 8.0)]
            if any(near):
                continue  # edges lie on whole pixels
            bin_ = int(np.searchsorted(HISTOGRAM.edges, value)) - 1
            count = heights[bin_] if 0 <= bin_ < 3 else 0.0
            is_counted = count > 0 and below >= frame.y(count)
            opacity = float(opacity_of(RED.at(value)[3], 1.0))
            is_below = opacity > 0 and below >= frame.y(opacity)
            alpha = 1 - (1 - is_counted * 0x90 / 255) * (1 - is_below * 0x8C / 255)
            assert abs(pixels[row, column, 3] - 255 * alpha) <= 0.5
            if is_below and not is_counted:
                assert pixels[row, column].tolist() == [255, 0, 0, 0x8C]
            if is_counted and not is_below:
                assert pixels[row, column].tolist() == [0x6C, 0x78, 0x86, 0x90]


def test_the_area_is_composited_over_the_histogram() -> None:
    frame = Frame((0.0, 10.0), 0, 0, 100, 100)
    pixel = plotted(frame).pixels()[-2, 60] / 255
    over, under = 0x8C / 255, 0x90 / 255
    behind = np.array([0.2, 0.5, 0.7])
    grey = np.array([0x6C, 0x78, 0x86]) / 255
    wanted = over * np.array([1, 0, 0]) + (1 - over) * (under * grey + (1 - under) * behind)
    found = pixel[3] * pixel[:3] + (1 - pixel[3]) * behind
    assert np.abs(found - wanted).max() < 1 / 255


def test_columns_of_the_area_have_the_colours_of_their_middles() -> None:
    medium = TransferFunction([0.0, 10.0], [(0.0, 0.0, 0.0), (0.4, 0.8, 0.2)], [0.0, 30.0])
    frame = Frame((0.0, 10.0), 7, 0, 80, 50)
    pixels = plotted(frame, Histogram(HISTOGRAM.edges, np.zeros(3)), medium)._replace(columns=40).pixels()
    assert (pixels[-1, 40] == pixels[-1, 41]).all(), "two pixels wide"
    wanted = 255 * srgb_from_linear(straight_colors(medium, [frame.value(7 + 41.0)])[0])
    assert np.abs(pixels[-1, 40, :3] - wanted).max() <= 0.51


def test_the_same_plot_is_known_again() -> None:
    frame = Frame((0.0, 10.0), 0, 0, 100, 100)
    assert plotted(frame) == plotted(Frame((0.0, 10.0), 0, 0, 100, 100))
    again = Histogram(HISTOGRAM.edges, HISTOGRAM.counts)
    assert plotted(frame) != plotted(frame, again), "another volume"
