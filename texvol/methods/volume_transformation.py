"""Volume transformation: the classified volume resampled to the axes of the view in three passes, then composited.

Drebin, Carpenter and Hanrahan 1988, and Hanrahan 1990 ("Three-pass affine transforms for volume rendering"); chapter 5
of the survey names it with the methods of affine transformations that end in section 6.4. An affine map of three axes
is three maps of one axis each: with target axes (a, b, c) and source axes (x, y, z),

    S(x, y, z) → I1(a, y, z) → I2(a, b, z) → T(a, b, c),

each pass samples lines of the array before it at an affine position, linearly. Any source axis may be replaced by any
target axis in any order: 36 ways. A pass that shrinks its lines, for a later one to stretch them, loses what lies
between (a bottleneck); of the 36 ways the one is taken whose most shrinking pass shrinks least. T has the columns and
rows of the picture and planes across the view; its planes are composited front to back, each over the path of the
pixel's ray that lies in the box and in front of the eye. The passes are made for one a at a time, so that no more than
two planes of the arrays in between are held.

Cost: the size of T, the picture times planes, whatever shows; nothing is skipped but what is hidden or beside the box.

Error: each pass interpolates linearly along a line that is oblique in the volume, so three passes blur more than
trilinear interpolation; less than shear-warp, because T has the pixels of the picture, and no picture is resampled
after it. Order 2 in the spacing of smooth media; more planes remove only the error of the midpoint rule.
"""

from __future__ import annotations

from itertools import pairwise, permutations, product

import numpy as np
from numpy.typing import NDArray

from texvol.methods.grid_view import GridView, grid_view
from texvol.methods.method import LEAST_TRANSMITTANCE, Method, Numbers, Size, classified, positive, with_background
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene

Axes = tuple[int, ...]


class VolumeTransformation(Method):
    """Three-pass transformation for parallel rays.

    Parameters
    ----------
    sampling_rate : float
        Planes per smallest spacing.
    least_transmittance : float
        A pixel that lets no more through is opaque.
    """

    name = "volume-transformation"
    source = "Drebin, Carpenter and Hanrahan 1988, Hanrahan 1990, section 6.4"

    def __init__(
        self, scene: CompleteScene, sampling_rate: float = 1.0, least_transmittance: float = LEAST_TRANSMITTANCE
    ) -> None:
        super().__init__(scene)
        self.sampling_rate = positive("sampling_rate", sampling_rate)
        self.least_transmittance = least_transmittance
        self._media = classified(scene)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, see `Method.picture`."""
        view = grid_view(self.volume, camera, size)
        counts = np.array(self.volume.dimensions)
        thickness = self.volume.smallest_spacing / self.sampling_rate
        corners = [view.depth @ (np.array(corner) * counts - 0.5 - view.middle) for corner in product((0, 1), repeat=3)]
        first = max(min(corners), view.near)
        planes = max(int(np.ceil((max(corners) - first) / thickness)), 0)
        index = np.column_stack([view.across, view.down, thickness * view.step])
        base = view.start + (first + thickness / 2) * view.step  # in the middle of the first plane's slab
        targets, sources = ways(index * self.volume.spacing[:, np.newaxis])[0]
        maps = passes(index[np.ix_(sources, targets)], base[list(sources)])
        strides = [self._media.strides[2 - axis] // self._media.strides[2] for axis in sources]
        lengths = [(size[0], size[1], planes)[axis] for axis in targets]
        picture = np.zeros((size[1], size[0], 4))
        ends = (_inside(view, counts, size) - first) / thickness  # in slabs
        _draw(
            *(self._media.reshape(-1, 4), tuple(counts[list(sources)]), tuple(strides), tuple(lengths), targets),
            *(*maps, ends, thickness, self.least_transmittance, picture),
        )
        return with_background(picture, self.scene)


def ways(index: Numbers) -> list[tuple[Axes, Axes]]:
    """Return the orders of target and source axes, the one with the least bottleneck first.

    Parameters
    ----------
    index : array of shape (3, 3)
        World units along each source axis per step of each target axis.
    """
    index = index / np.linalg.norm(index, axis=0)

    def shrinks(way: tuple[Axes, Axes]) -> float:
        targets, sources = way
        matrix = index[np.ix_(sources, targets)]
        # The last pass has the last element for its scale; before it a Schur complement, and another.
        minors = [1.0, *(abs(np.linalg.det(matrix[n:, n:])) for n in (2, 1, 0))]
        if min(minors) < 1e-9:
            return np.inf
        return max(after / before for before, after in pairwise(minors))

    axes = list(permutations(range(3)))
    return sorted(product(axes, axes), key=shrinks)


def passes(matrix: Numbers, base: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return the affine maps of the three passes, coefficients and constant (4).

    The first takes (a, y, z) to x, the second (a, b, z) to y, the third (a, b, c) to z, of
    (x, y, z) = `matrix` (a, b, c) + `base`.
    """
    steps = []
    for n in range(3):  # source axes after n are known, and target axes after n are not
        solved = matrix[n, n + 1 :] @ np.linalg.inv(matrix[n + 1 :, n + 1 :])
        known = matrix[n, : n + 1] - solved @ matrix[n + 1 :, : n + 1]
        steps.append(np.array([*known, *solved, base[n] - solved @ base[n + 1 :]]))
    return steps[0], steps[1], steps[2]


def _inside(view: GridView, counts: NDArray[np.int64], size: Size) -> Numbers:
    """Return where each pixel's ray enters and leaves the box in front of the eye, world units, (height, width, 2)."""
    rows, columns = np.mgrid[: size[1], : size[0]]
    s, s_end = np.full(rows.shape, view.near), np.full(rows.shape, np.inf)
    for axis in range(3):
        x = view.start[axis] + columns * view.across[axis] + rows * view.down[axis]
        if view.step[axis] == 0:
            s_end = np.where((x >= -0.5) & (x < counts[axis] - 0.5), s_end, -np.inf)
            continue
        ends = np.sort([(-0.5 - x) / view.step[axis], (counts[axis] - 0.5 - x) / view.step[axis]], axis=0)
        s, s_end = np.maximum(s, ends[0]), np.minimum(s_end, ends[1])
    return np.stack([s, np.maximum(s, s_end)], axis=-1)


@compiled
def _sample(source, start, stride, count, x, target):  # type: ignore[no-untyped-def]
    """Set a medium to that at x on a line of `count` media, linearly; the ends are repeated."""
    x = min(max(x, 0.0), count - 1.0)
    i = min(int(x), max(count - 2, 0))
    f = x - i
    p = start + i * stride
    q = p + stride if f > 0 else p
    for channel in range(4):
        target[channel] = (1 - f) * source[p, channel] + f * source[q, channel]


@compiled_and_cached
def _draw(  # type: ignore[no-untyped-def]
    media, counts, strides, lengths, targets, to_x, to_y, to_z, ends, thickness, least, picture
):
    """Resample the media in three passes, one plane after the other, and composite."""
    nx, ny, nz = counts
    plane, turned = np.empty((nz * ny, 4), np.float32), np.empty((nz * lengths[1], 4), np.float32)
    medium, at = np.empty(4), np.zeros(3, np.int64)
    for a in range(lengths[0]):
        for z in range(nz):
            for y in range(ny):
                x = to_x[0] * a + to_x[1] * y + to_x[2] * z + to_x[3]
                _sample(media, z * strides[2] + y * strides[1], strides[0], nx, x, plane[z * ny + y])
            for b in range(lengths[1]):
                y_there = to_y[0] * a + to_y[1] * b + to_y[2] * z + to_y[3]
                _sample(plane, z * ny, 1, ny, y_there, turned[z * lengths[1] + b])
        for b in range(lengths[1]):
            for c in range(lengths[2]):
                at[targets[0]], at[targets[1]], at[targets[2]] = a, b, c
                column, row, n = at
                slab = min(ends[row, column, 1], n + 1.0) - max(ends[row, column, 0], float(n))
                left = 1 - picture[row, column, 3]
                if slab <= 0 or left <= least:
                    continue
                _sample(turned, b, lengths[1], nz, to_z[0] * a + to_z[1] * b + to_z[2] * c + to_z[3], medium)
                path = slab * thickness
                opacity = -np.expm1(-medium[3] * path)
                weight = left * (opacity / medium[3] if medium[3] > 0 else path)
                for channel in range(3):
                    picture[row, column, channel] += weight * medium[channel]
                picture[row, column, 3] += left * opacity
