"""Parallel rays of a picture in index space: the affine map from pixel and depth to the grid that all methods share.

The ray of pixel (column, row) is at index `start` + column `across` + row `down` + s `step`, with s in world units and
0 in the plane across the view through the middle of the box. What lies at s < `near`, behind the eye, is not seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from texvol.methods.method import Numbers, Size
from texvol.scene.camera import Camera
from texvol.scene.volume import Volume

_PARALLEL = 1e-12  # of the largest component: a ray as nearly along an axis counts as along it


class GridView(NamedTuple):
    """Parallel rays; triples are (x, y, z)."""

    start: Numbers  # index, of pixel (0, 0)
    across: Numbers  # index per column
    down: Numbers  # index per row
    step: Numbers  # index per world unit
    depth: Numbers  # s per index
    middle: Numbers  # index where s is 0
    near: float  # s of the eye

    @property
    def to_picture(self) -> Numbers:
        """Matrix of shape (2, 3): columns and rows per index; of the point `start`, 0 and 0."""
        return np.linalg.inv(np.column_stack([self.across, self.down, self.step]))[:2]


def grid_view(volume: Volume, camera: Camera, size: Size) -> GridView:
    """Return the rays of an orthographic camera.

    Parameters
    ----------
    size : (width, height)
        In pixels.
    """
    width, height = size
    rays = camera.pixel_rays(size, volume.centre)
    to_index, middle = volume.index_from_world, (np.array(volume.dimensions) - 1) / 2
    corner = rays.point - (width - 1) / 2 * rays.point_per_column + (height - 1) / 2 * rays.point_per_row
    step = to_index @ camera.forward
    step[np.abs(step) < _PARALLEL * np.abs(step).max()] = 0.0
    return GridView(
        start=middle + to_index @ corner,
        across=to_index @ rays.point_per_column,
        down=-to_index @ rays.point_per_row,
        step=step,
        depth=volume.world_from_index.T @ camera.forward,
        middle=middle,
        near=-rays.reference_depth,
    )
