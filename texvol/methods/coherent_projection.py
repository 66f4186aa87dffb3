"""Coherent projection: each cell projected once, its medium integrated over the depth between its front and its back.

Wilhelms and Van Gelder 1991; section 6.3 of the survey has its formulas. Seen along parallel rays all cells of a grid
look the same: a polygon of up to six corners. At each pixel below it the ray's entry into the cell and exit from it are
found; emission and extinction are interpolated between the samples of the faces there, and taken to be linear in
between. With the mean τ and E of both ends and the depth Δ between them,

    A = 1 - e^(-τΔ),   C = E Δ (1 - e^(-τΔ)) / (τΔ),

composited front to back. (The survey prints C without the factor Δ.) The original computes depth, colour and opacity at
corners of parts of the polygon, and leaves it to graphics hardware to interpolate them; here each pixel has its own.

Cost: cells that show, times the pixels below one.

Error: the medium is not linear between entry and exit, and its mean is composited instead of its course: order 2 in
the spacing of the grid, without a choice of sampling. A pixel lacks what `least_transmittance` hides.
"""

from __future__ import annotations

import numpy as np

from texvol.methods import cells
from texvol.methods.cells import any_corner, cell_order, path_in_cell, pixels_below, shows_through
from texvol.methods.grid_view import grid_view
from texvol.methods.method import LEAST_TRANSMITTANCE, Method, Numbers, Size, classified, with_background
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene


class CoherentProjection(Method):
    """Coherent projection for parallel rays.

    Parameters
    ----------
    least_transmittance : float
        A pixel that lets no more through is opaque.
    """

    name = "coherent-projection"
    source = "Wilhelms and Van Gelder 1991, section 6.3"

    def __init__(self, scene: CompleteScene, least_transmittance: float = LEAST_TRANSMITTANCE) -> None:
        super().__init__(scene)
        self.least_transmittance = least_transmittance
        self._media = np.pad(classified(scene), ((1, 1), (1, 1), (1, 1), (0, 0)), mode="edge")
        self._shows = any_corner(self._media.max(axis=-1) > 0, np.logical_or)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, see `Method.picture`."""
        view = grid_view(self.volume, camera, size)
        picture = np.zeros((size[1], size[0], 4))
        rays = (view.start, view.across, view.down, view.step, view.near)
        _draw(self._media, self._shows, cell_order(view), rays, view.to_picture, self.least_transmittance, picture)
        return with_background(picture, self.scene)


@compiled
def _add_half(media, i, j, k, x, y, z, mean):  # type: ignore[no-untyped-def]
    """Add half of the medium at offsets from 0 to 1 in a cell of the padded samples to a mean."""
    for corner in range(8):
        a, b, c = corner & 1, corner >> 1 & 1, corner >> 2
        weight = 0.5 * (x if a else 1 - x) * (y if b else 1 - y) * (z if c else 1 - z)
        if weight != 0:  # on a face four of the eight samples count
            for channel in range(4):
                mean[channel] += weight * media[k + c, j + b, i + a, channel]


def _drawer(source):  # type: ignore[no-untyped-def]
    @compiled_and_cached
    def draw(media, shows, order, rays, to_picture, least, picture):  # type: ignore[no-untyped-def]
        """Add all cells, front to back, to a picture."""
        source  # noqa: B018 - see compiled_and_cached
        start, across, down, step, near = rays
        first, forward = order
        nz, ny, nx = shows.shape
        mean = np.zeros(4)
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
                            ends = path_in_cell(i, j, k, shows.shape, x, y, z, step, near)
                            if ends[1] <= ends[0]:
                                continue
                            mean[:] = 0.0
                            for s in ends:
                                # Cell 0 lies before sample 0, which is at 1 in padded samples.
                                u, v, w = x + s * step[0] + 1 - i, y + s * step[1] + 1 - j, z + s * step[2] + 1 - k
                                _add_half(media, i, j, k, u, v, w, mean)
                            path = ends[1] - ends[0]
                            shows_through(picture[row, column], mean[0], mean[1], mean[2], mean[3], path)

    return draw


_draw = _drawer(cells.SOURCE)
