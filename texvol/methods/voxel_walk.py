"""Ray casting by a walk from voxel to voxel (section 6.1): Bresenham's line in 3-D, and the tripod.

Both take one sample for each voxel that they visit, without interpolation, so that no voxel is sought or visited twice.

*Bresenham* (Foley et al. 1990): one voxel for each step along the longest axis, from the voxel where the ray enters to
the one where it leaves. Integers only; voxels meet at corners (26-connected), and voxels that the ray crosses may be
missed.

*Tripod* (Cohen and Kaufman 1994; algorithm 6.3): from face to face (6-connected), so that each voxel that the ray
crosses is visited. Of the three edges that meet at the corner ahead, the signs of e_xy, e_xz and e_zy say on which side
the ray passes, and so through which face it leaves. The source's walk goes from centre to centre of two voxels, where
e_xy = a_y - a_x; here the ray starts where it enters, at distances r from the faces ahead: e_xy = a_y r_x - a_x r_y,
which is half of that for r = 1/2. As printed the walk does not end, and e_zy begins under another name.

Cost: a step per voxel, of additions and comparisons. The error has two causes. A sample stands for a *length 1*, as in
the source, here the smallest spacing, whatever the ray's path in the voxel: along a diagonal Bresenham counts 1/√3 of
the path, the tripod √3 times the path, and where spacings differ, each axis is off by its own factor. `true_lengths`
removes that: Bresenham's samples share the path equally, the tripod's have the length that the ray has in the voxel.
What remains is the reconstruction: the nearest sample instead of the trilinear mean, of order 1 in the spacing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from texvol.methods.compiling import compiled, part
from texvol.methods.compositing import add_behind
from texvol.methods.method import Method, Numbers, Size, classified, with_background
from texvol.methods.rays import checked_transmittance, in_threads, rays_of
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene


class Bresenham(Method):
    """Samples along Bresenham's line, each of length 1.

    Parameters
    ----------
    true_lengths : bool
        True if a sample stands for the path of the ray, False if for the smallest spacing.
    least_transmittance : float
        A ray ends where it lets less than this through; 0 never ends it.
    """

    name = "bresenham"
    source = "Foley et al. 1990, section 6.1"
    perspective = True
    lengths_are_true = False  # unless told

    def __init__(
        self, scene: CompleteScene, *, true_lengths: bool | None = None, least_transmittance: float = 0.0
    ) -> None:
        super().__init__(scene)
        true = self.lengths_are_true if true_lengths is None else true_lengths
        self.length = 0.0 if true else self.volume.smallest_spacing
        self.least_transmittance = checked_transmittance(least_transmittance)
        self.samples = classified(scene)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, shape (height, width, 4)."""
        rays = rays_of(camera, size, self.volume)
        picture = np.zeros((size[1], size[0], 4))

        def draw(rows: slice) -> None:
            part = tuple(each[rows] for each in rays)
            self.walk(self.samples, *part, self.length, self.least_transmittance, picture[rows])

        in_threads(draw, size[1])
        return with_background(picture, self.scene)

    def walk(self, *arguments: Any) -> None:
        """Add the samples of some rows to their picture."""
        bresenham(*arguments)


class BresenhamTrue(Bresenham):
    """Samples along Bresenham's line, which share the path of the ray."""

    name = "bresenham-true"
    lengths_are_true = True


class Tripod(Bresenham):
    """Samples in all voxels that a ray crosses, each of length 1."""

    name = "tripod"
    source = "Cohen and Kaufman 1994, section 6.1"

    def walk(self, *arguments: Any) -> None:
        """Add the samples of some rows to their picture."""
        tripod(*arguments)


class TripodTrue(Tripod):
    """Samples in all voxels that a ray crosses, each of the length of its path there."""

    name = "tripod-true"
    lengths_are_true = True


@compiled
def bresenham(samples, start, step, near, far, length, least, picture):
    """Walk the rays of some rows; a `length` of 0 asks for true ones."""
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            t, end = near[row, column], far[row, column]
            if end > t:
                entry = start[row, column] + t * step[row, column]
                _line(samples, entry, step[row, column], end - t, length, least, picture[row, column])


@part
def _line(samples, p, d, path, length, least, pixel):
    """Bresenham's line from where a ray enters, at `p`, to where it leaves."""
    nz, ny, nx, _ = samples.shape
    x, last_x = _ends(p[0], p[0] + path * d[0], d[0], nx)
    y, last_y = _ends(p[1], p[1] + path * d[1], d[1], ny)
    z, last_z = _ends(p[2], p[2] + path * d[2], d[2], nz)
    sx, sy, sz = np.sign(last_x - x), np.sign(last_y - y), np.sign(last_z - z)
    ax, ay, az = abs(last_x - x), abs(last_y - y), abs(last_z - z)
    n = max(ax, ay, az)
    ex, ey, ez = 2 * ax - n, 2 * ay - n, 2 * az - n
    each = length if length > 0 else path / (n + 1)
    transmittance = 1.0
    for _ in range(n + 1):
        transmittance = add_behind(pixel, transmittance, samples[z, y, x], each)
        if transmittance < least:
            break
        # The longest axis has e = n > 0 always, and moves each time.
        if ex > 0:
            x, ex = x + sx, ex - 2 * n
        if ey > 0:
            y, ey = y + sy, ey - 2 * n
        if ez > 0:
            z, ez = z + sz, ez - 2 * n
        ex, ey, ez = ex + 2 * ax, ey + 2 * ay, ez + 2 * az


@compiled
def tripod(samples, start, step, near, far, length, least, picture):
    """Walk the rays of some rows; a `length` of 0 asks for true ones."""
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            t, end = near[row, column], far[row, column]
            if end > t:
                entry = start[row, column] + t * step[row, column]
                _faces(samples, entry, step[row, column], end - t, length, least, picture[row, column])


@part
def _faces(samples, p, d, path, length, least, pixel):
    """Walk from face to face from where a ray enters, at `p`; algorithm 6.3."""
    nz, ny, nx, _ = samples.shape
    x, last_x = _ends(p[0], p[0] + path * d[0], d[0], nx)
    y, last_y = _ends(p[1], p[1] + path * d[1], d[1], ny)
    z, last_z = _ends(p[2], p[2] + path * d[2], d[2], nz)
    sx, sy, sz = 1 if d[0] >= 0 else -1, 1 if d[1] >= 0 else -1, 1 if d[2] >= 0 else -1
    ax, ay, az = abs(d[0]), abs(d[1]), abs(d[2])
    rx, ry, rz = _ahead(p[0], x, sx), _ahead(p[1], y, sy), _ahead(p[2], z, sz)
    tx, ty, tz = rx / ax, ry / ay, rz / az  # infinite where a ray is parallel to an axis's faces
    exy, exz, ezy = ay * rx - ax * ry, az * rx - ax * rz, ay * rz - az * ry
    n = abs(last_x - x) + abs(last_y - y) + abs(last_z - z) + 1
    t, transmittance = 0.0, 1.0
    while n > 0 and transmittance >= least:
        i, j, k = x, y, z
        if exy < 0 and exz < 0:
            leaves, tx = tx, tx + 1 / ax
            x, exy, exz = x + sx, exy + ay, exz + az
        elif exy >= 0 and ezy >= 0:
            leaves, ty = ty, ty + 1 / ay
            y, exy, ezy = y + sy, exy - ax, ezy - az
        else:
            leaves, tz = tz, tz + 1 / az
            z, exz, ezy = z + sz, exz - ax, ezy + ay
        if i < 0 or i >= nx or j < 0 or j >= ny or k < 0 or k >= nz:
            break  # rounding in a face or an edge of the box
        leaves = max(min(leaves, path), t)
        transmittance = add_behind(pixel, transmittance, samples[k, j, i], length if length > 0 else leaves - t)
        t, n = leaves, n - 1


@part
def _ends(low, high, step, count):
    """Return the voxels along one axis where a ray enters, at `low`, and leaves, at `high`."""
    forward = step >= 0
    first = math.floor(low) if forward else math.ceil(low) - 1
    last = math.ceil(high) - 1 if forward else math.floor(high)
    return min(max(first, 0), count - 1), min(max(last, 0), count - 1)


@part
def _ahead(position, voxel, sign):
    """Return the distance along one axis to the face ahead."""
    return voxel + 1 - position if sign > 0 else position - voxel
