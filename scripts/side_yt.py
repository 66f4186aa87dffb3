"""yt's volume renderer on the processor: its sampler, with the grid and the rays that it is given.

Its own scenes average cells to corners, and its lenses put rays at the edges of pixels and stretch steps off the axis;
here the samples are the corners of its grid, padded and cut at the box, and all rays are as long. Each cell of a ray
has a whole number of steps, and a step of length d lets 1 - τ d through, not exp(-τ d).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from side_given import Array, Given, Medium
from yt.utilities.lib.image_samplers import VolumeRenderSampler
from yt.utilities.lib.partitioned_grid import PartitionedGrid
from yt.visualization.volume_rendering.transfer_functions import MultiVariateTransferFunction, TransferFunction

_CHANNELS = 4


class Program:
    """Grid, rays and transfer function as yt's sampler takes them."""

    def __init__(self, given: Given) -> None:
        self._given = given
        near, far = given.spans()
        self._length = float((far - near).max()) * 1.01
        origins, directions = given.rays
        # yt puts each sample over those before it, so rays come from behind. The first axis of its pictures counts
        # columns, the second rows from below.
        self._starts = _by_column(origins + far[..., np.newaxis] * directions)
        self._paths = _by_column(directions * -self._length)
        self._ends = _by_column((far - near) / self._length)

    def classify(self, medium: Medium) -> None:
        """Take another transfer function."""
        values, medium = medium.widened().from_one(self._given.values.astype(np.float64))
        function = MultiVariateTransferFunction(grey_opacity=True)
        for channel, entries in enumerate(medium.per(self._length)):
            table = TransferFunction((medium.low, medium.high), len(entries))
            table.y = np.ascontiguousarray(entries, np.float64)
            function.add_field_table(table, 0)
            function.link_channels(channel, channel)
        self._function = function
        corners = np.ascontiguousarray(np.pad(values, 1, mode="edge").transpose(2, 1, 0))
        cells = np.array(corners.shape, np.int64) - 1
        left = -self._given.spacing / 2
        self._grid = PartitionedGrid(
            0, [corners], np.ones(cells, np.uint8), left, left + cells * self._given.spacing, cells
        )

    def draw(self, family: str, rate: float) -> NDArray[np.float32]:
        """Return the picture with so many steps in each cell."""
        width, height = self._given.size
        picture, unused = np.zeros((width, height, _CHANNELS)), np.ones(3)
        sampler = VolumeRenderSampler(
            self._starts, self._paths, unused, (0.0, 1.0, 0.0, 1.0), picture, unused, unused, np.zeros(3), "KDTree",
            self._function, int(rate), lens_type="perspective", zbuffer=self._ends,
        )  # fmt: skip
        sampler(self._grid, num_threads=0)
        return picture[:, ::-1].transpose(1, 0, 2).astype(np.float32)


def _by_column(rows: Array) -> Array:
    return np.ascontiguousarray(np.swapaxes(rows[::-1], 0, 1), dtype=np.float64)
