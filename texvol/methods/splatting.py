"""Splatting: each sample leaves a footprint in the picture; those of a slice are added, slices are composited.

Westover 1990, section 6.2 of the survey. The field is reconstructed by a Gaussian around each sample, of deviation
`sigma` samples along each axis. Its integral along the view, the footprint, is a Gaussian, too: its covariance is that
of the kernel, projected to the picture, so that ellipses come from anisotropic grids. Footprints are not computed at
each pixel but looked up in one table of the normalised kernel, by the squared distance from the ellipse's centre.

Samples are sorted into sheets: slices across the axis that is nearest to the view. All footprints of a sheet, weighted
by emission and extinction, are added in a sheet buffer; then the buffer becomes colour and opacity, goes behind the
picture, and is cleared. Sheets come front to back, so opaque pixels take no more footprints. (Westover weights opacity
instead of extinction: the same for thin media; opacities of more than 1 do not arise here.)

Cost: samples that show, times the pixels below a footprint (about (2 · 4 sigma)² at one pixel per sample).

Error: the Gaussian blurs more than trilinear interpolation (variance sigma² instead of 1/6 of a spacing), and bleeds
over edges of the box and of the medium. A narrow one lets the grid show: the sum of a constant volume's footprints
varies by 4 e^(-2 π² sigma²) of itself at most, 1e-3 at the default of 0.65, 3e-2 at 0.5. Samples of a sheet hide each
other nowhere, and the depth within a sheet is lost. Order 2 in the spacing of smooth media, order 1 where a medium
reaches the sides of the box.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.methods.grid_view import GridView, grid_view
from texvol.methods.method import (
    LEAST_TRANSMITTANCE,
    Method,
    Numbers,
    Size,
    classified,
    positive,
    visible,
    with_background,
)
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene

_REACH = 4.0  # deviations: e^-8 of the footprint lies outside
_ENTRIES = 4096  # of the table: a lookup is off by at most _REACH² / _ENTRIES / 4 = 1e-3 of the footprint's middle


class Splatting(Method):
    """Splatting in sheets, for parallel rays.

    Parameters
    ----------
    sigma : float
        Deviation of the Gaussian, in samples.
    least_opacity : float
        A sample of less emission and optical depth per smallest spacing is passed over.
    least_transmittance : float
        A pixel that lets no more through is opaque.
    """

    name = "splatting"
    source = "Westover 1990, section 6.2"

    def __init__(
        self,
        scene: CompleteScene,
        sigma: float = 0.65,
        least_opacity: float = 1e-6,
        least_transmittance: float = LEAST_TRANSMITTANCE,
    ) -> None:
        super().__init__(scene)
        self.sigma, self.least_transmittance = positive("sigma", sigma), least_transmittance
        samples = classified(scene)
        seen = visible(scene, samples, least_opacity)
        self._media = samples[seen]
        self._places = np.argwhere(seen)[:, ::-1].astype(np.int32)  # x, y, z
        self._sorted = [np.argsort(self._places[:, axis], kind="stable").astype(np.int32) for axis in range(3)]
        middles = (np.arange(_ENTRIES) + 0.5) * _REACH**2 / _ENTRIES
        # What lies beyond the reach is given back to what lies within.
        self._table = np.exp(-middles / 2) / -np.expm1(-(_REACH**2) / 2)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, see `Method.picture`."""
        view = grid_view(self.volume, camera, size)
        normals = np.linalg.norm(self.volume.index_from_world, axis=1)
        axis = int((np.abs(view.step) / normals).argmax())
        order = self._sorted[axis]
        if view.step[axis] < 0:
            order = order[::-1]
        picture = np.zeros((size[1], size[0], 4))
        depth = np.append(view.depth, -view.depth @ view.middle - view.near)
        footprint = (*self._ellipse(view), self._table, 1 / abs(view.step[axis]))
        _draw(
            *(self._media, self._places, np.ascontiguousarray(order), axis, view.start, view.to_picture, depth),
            *(footprint, self.least_transmittance, picture),
        )
        return with_background(picture, self.scene)

    def _ellipse(self, view: GridView) -> tuple[NDArray, float, float, float]:
        """Return the footprint's form, half width, half height, and height of its middle.

        The squared distance of an offset o in pixels is oᵀ form o; the middle is in world units.
        """
        covariance = self.sigma**2 * view.to_picture @ view.to_picture.T
        # Index space per pixel and world unit of depth: so many samples share a pixel's column of the box.
        samples = abs(np.linalg.det(np.column_stack([view.across, view.down, view.step])))
        middle = 1 / (samples * 2 * np.pi * np.sqrt(np.linalg.det(covariance)))
        half = _REACH * np.sqrt(np.diag(covariance))
        return np.linalg.inv(covariance), float(half[0]), float(half[1]), float(middle)


@compiled
def _composite(sheet, picture, touched):  # type: ignore[no-untyped-def]
    """Put the touched part of a sheet behind the picture, and clear it."""
    for row in range(touched[0], touched[1]):
        for column in range(touched[2], touched[3]):
            depth = sheet[row, column, 3]
            opacity = -np.expm1(-depth)
            left = 1 - picture[row, column, 3]
            weight = left * (opacity / depth if depth > 0 else 1.0)
            for channel in range(3):
                picture[row, column, channel] += weight * sheet[row, column, channel]
            picture[row, column, 3] += left * opacity
            sheet[row, column] = 0.0


@compiled_and_cached
def _draw(media, places, order, axis, start, to_picture, depth, footprint, least, picture):  # type: ignore[no-untyped-def]
    """Add all samples in sheets, front to back, to a picture."""
    form, half_width, half_height, middle, table, path = footprint
    per_square = len(table) / _REACH**2
    sheet = np.zeros_like(picture)
    height, width = picture.shape[:2]
    touched = np.array([height, 0, width, 0])
    for n in range(len(order)):
        x, y, z = places[order[n]]
        if n > 0 and places[order[n], axis] != places[order[n - 1], axis]:
            _composite(sheet, picture, touched)
            touched[:] = height, 0, width, 0
        # Part of the slab around the sample that lies in front of the eye.
        seen = (depth[0] * x + depth[1] * y + depth[2] * z + depth[3]) / path + 0.5
        if seen <= 0:
            continue
        weight = middle * min(seen, 1.0)
        x, y, z = x - start[0], y - start[1], z - start[2]
        u = to_picture[0, 0] * x + to_picture[0, 1] * y + to_picture[0, 2] * z
        v = to_picture[1, 0] * x + to_picture[1, 1] * y + to_picture[1, 2] * z
        top, bottom = max(int(np.ceil(v - half_height)), 0), min(int(np.floor(v + half_height)) + 1, height)
        left, right = max(int(np.ceil(u - half_width)), 0), min(int(np.floor(u + half_width)) + 1, width)
        if top >= bottom or left >= right:
            continue
        touched[0], touched[1] = min(touched[0], top), max(touched[1], bottom)
        touched[2], touched[3] = min(touched[2], left), max(touched[3], right)
        medium = media[order[n]]
        for row in range(top, bottom):
            b = row - v
            for column in range(left, right):
                a = column - u
                entry = int((form[0, 0] * a * a + 2 * form[0, 1] * a * b + form[1, 1] * b * b) * per_square)
                if entry < len(table) and 1 - picture[row, column, 3] > least:
                    share = weight * table[entry]
                    for channel in range(4):
                        sheet[row, column, channel] += share * medium[channel]
    _composite(sheet, picture, touched)
