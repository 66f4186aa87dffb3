"""V-buffer: cell by cell, front to back, with values interpolated inside each cell.

Upson and Keeler 1988, section 6.2 of the survey. A cell lies between eight samples. Cells are visited front to back,
in three nested loops over the grid. Each is projected to the picture; for each pixel below it, the path of the ray
through the cell is found, the value is interpolated trilinearly at the middles of equal parts of it, classified, and
composited. Cells in which no value shows are passed over. The outer half spacing of the box belongs to thinner cells,
in which edge samples are repeated.

Cost: cells that show, times the pixels below one, times samples per path; rays are not stored, pixels are.

Error: the midpoint rule on each part, and nothing else: order 2 in the distance of samples. A transfer function with
steps inside a cell is met only by the samples: order 1 there. A pixel lacks what `least_transmittance` hides.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from texvol.methods import cells
from texvol.methods.cells import any_corner, cell_order, path_in_cell, pixels_below, shows_through
from texvol.methods.grid_view import grid_view
from texvol.methods.method import LEAST_TRANSMITTANCE, Method, Numbers, Order, Size, positive, with_background
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene


class VBuffer(Method):
    """V-buffer for parallel rays.

    Parameters
    ----------
    sampling_rate : float
        Least number of samples per smallest spacing; at least one sample per path through a cell is taken.
    least_transmittance : float
        A pixel that lets no more through is opaque.
    """

    name = "v-buffer"
    source = "Upson and Keeler 1988, section 6.2"
    order: ClassVar[Order] = "after"

    def __init__(
        self, scene: CompleteScene, sampling_rate: float = 1.0, least_transmittance: float = LEAST_TRANSMITTANCE
    ) -> None:
        super().__init__(scene)
        self.sampling_rate = positive("sampling_rate", sampling_rate)
        self.least_transmittance = least_transmittance
        self._values = np.pad(self.volume.values.astype(np.float64), 1, mode="edge")
        low, high = any_corner(self._values, np.minimum), any_corner(self._values, np.maximum)
        self._shows = np.asarray(scene.medium.shows_between(low, high))

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, see `Method.picture`."""
        view, medium = grid_view(self.volume, camera, size), self.scene.medium
        picture = np.zeros((size[1], size[0], 4))
        function = (medium.values, medium.numbers, medium.glows)
        distance = self.volume.smallest_spacing / self.sampling_rate
        rays = (view.start, view.across, view.down, view.step, view.near)
        _draw(
            *(self._values, self._shows, cell_order(view), rays, view.to_picture, function),
            *(distance, self.least_transmittance, picture),
        )
        return with_background(picture, self.scene)


@compiled
def _medium_at(function, value):  # type: ignore[no-untyped-def]
    """Emission and extinction of a value, from control points that are linear in between."""
    values, numbers, glows = function
    right = np.searchsorted(values, value, side="right")
    left = max(right - 1, 0)
    right = min(right, len(values) - 1)
    gap = values[right] - values[left]
    f = (value - values[left]) / gap if gap > 0 else 0.0
    color = numbers[left] + f * (numbers[right] - numbers[left])
    tau = color[3]
    weight = 1.0 if glows else tau
    return color[0] * weight, color[1] * weight, color[2] * weight, tau


@compiled
def _value_at(values, i, j, k, x, y, z):  # type: ignore[no-untyped-def]
    """Trilinear value in a cell of the padded samples, at offsets from 0 to 1 from its first corner."""
    total = 0.0
    for c in range(2):
        for b in range(2):
            line = values[k + c, j + b, i] * (1 - x) + values[k + c, j + b, i + 1] * x
            total += line * (y if b else 1 - y) * (z if c else 1 - z)
    return total


def _drawer(source):  # type: ignore[no-untyped-def]
    @compiled_and_cached
    def draw(values, shows, order, rays, to_picture, function, distance, least, picture):  # type: ignore[no-untyped-def]
        """Add all cells, front to back, to a picture."""
        source  # noqa: B018 - see compiled_and_cached
        start, across, down, step, near = rays
        first, forward = order
        nz, ny, nx = shows.shape
        for c in range(nz):
            for b in range(ny):
                for a in range(nx):
                    i, j, k = first[0] + a * forward[0], first[1] + b * forward[1], first[2] + c * forward[2]
                    if not shows[k, j, i]:
                        continue
                    top, bottom, left, right = pixels_below(i, j, k, shows.shape, start, to_picture, picture.shape)
                    for row in range(top, bottom):
                        for column in range(left, right):
                            if 1 - picture[row, column, 3] <= least:
                                continue
                            x = start[0] + column * across[0] + row * down[0]
                            y = start[1] + column * across[1] + row * down[1]
                            z = start[2] + column * across[2] + row * down[2]
                            s, s_end = path_in_cell(i, j, k, shows.shape, x, y, z, step, near)
                            if s_end <= s:
                                continue
                            samples = int(np.ceil((s_end - s) / distance))
                            path = (s_end - s) / samples
                            for n in range(samples):
                                at = s + (n + 0.5) * path
                                # Cell 0 lies before sample 0, which is at 1 in padded samples.
                                u, v, w = x + at * step[0] + 1 - i, y + at * step[1] + 1 - j, z + at * step[2] + 1 - k
                                q0, q1, q2, tau = _medium_at(function, _value_at(values, i, j, k, u, v, w))
                                shows_through(picture[row, column], q0, q1, q2, tau, path)

    return draw


_draw = _drawer(cells.SOURCE)
