"""Pixels below the curve in the plot of a transfer function: the histogram, and over it the area in its colours.

As rectangles they would be a column of two triangles for each pixel of the plot's width, of which a software driver
draws as many blocks of 4 x 4 pixels as if they were four times as wide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.display import straight_colors
from texvol.scene.transfer import TransferFunction
from texvol.util.color import srgb_from_linear
from texvol.window.editing import opacity_of
from texvol.window.gestures import Frame
from texvol.window.histogram import Histogram

_HISTOGRAM = np.array([0x6C, 0x78, 0x86, 0x90], np.uint8)  # straight sRGB and opacity
_AREA = 0x8C  # opacity


class Plotted(NamedTuple):
    """Plot, by all that its pixels depend on; `columns` is the number of columns of one colour of the area."""

    frame: Frame
    histogram: Histogram
    logarithmic: bool
    medium: TransferFunction
    length: float
    columns: int

    @property
    def place(self) -> tuple[int, int, int, int]:
        """Edges of the pixels in the window: left, top, right, bottom."""
        frame = self.frame
        left, top = round(frame.left), round(frame.top)
        return left, top, max(round(frame.left + frame.width), left + 1), max(round(frame.top + frame.height), top + 1)

    def pixels(self) -> NDArray[np.uint8]:
        """Return straight sRGB and opacity, shape (height, width, 4)."""
        left, top, right, bottom = self.place
        across = np.arange(left, right, dtype=np.float64) + 0.5
        below = np.arange(top, bottom, dtype=np.float64)[:, np.newaxis] + 0.5
        counts, (opacities, colors) = self._counts(across), self._area(across)
        is_counted, is_below = (
            (below >= np.array([self.frame.y(height) for height in heights])) & (heights > 0)
            for heights in (counts, opacities)
        )
        kinds = _kinds(colors).view(np.uint32)[..., 0]
        pixels = np.take_along_axis(kinds, is_counted.astype(np.intp) + 2 * is_below, axis=0)
        return pixels[..., np.newaxis].view(np.uint8)

    def _counts(self, across: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the heights of the histogram at pixels, from 0 to 1."""
        edges = np.array([self.frame.x(edge) for edge in self.histogram.edges.tolist()])
        heights = np.append(self.histogram.heights(self.logarithmic), 0.0)
        return np.asarray(heights[_in_columns(across, edges)])

    def _area(self, across: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        """Return the opacities at pixels, and the colours there, shape (pixels, 4)."""
        frame, places = self.frame, np.arange(self.columns + 1) / self.columns
        values = frame.shown[0] + (places[:-1] + 0.5 / self.columns) * (frame.shown[1] - frame.shown[0])
        column = _in_columns(across, frame.left + places * frame.width)
        opacities = np.append(opacity_of(self.medium.at(values)[:, 3], self.length), 0.0)[column]
        shown = np.rint(255 * srgb_from_linear(np.clip(straight_colors(self.medium, values), 0, 1))).astype(np.uint8)
        colors = np.pad(shown, ((0, 1), (0, 1)), constant_values=_AREA)[column]
        return opacities, colors


def _in_columns(across: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the number of the column that holds each pixel; -1 beside them. Columns have whole pixels."""
    found = np.searchsorted(np.round(edges), across, side="right") - 1
    return np.where(found < len(edges) - 1, found, -1)


def _kinds(area: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the colours of each column by what is there, shape (4, width, 4): nothing, histogram, area, both."""
    kinds = np.zeros((4, *area.shape), np.uint8)
    kinds[1], kinds[2] = _HISTOGRAM, area
    over, under = area[:, 3:] / 255, (1 - area[:, 3:] / 255) * (int(_HISTOGRAM[3]) / 255)
    kinds[3, :, :3] = np.rint((over * area[:, :3] + under * _HISTOGRAM[:3]) / (over + under))
    kinds[3, :, 3:] = np.rint(255 * (over + under))
    return kinds
