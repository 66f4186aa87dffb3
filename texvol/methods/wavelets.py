"""Ray casting in a volume of wavelet coefficients (section 6.5.2; Muraki 1993, Westermann 1994).

The volume is transformed once, and all but the largest coefficients are set to 0. Rays are cast in the coefficients:
at a point the value is the coarsest mean, plus what the coefficients of each finer level add to it. Where a node and
all that is finer have none, the value is constant over its 2^j voxels, and the ray crosses them in one step.

The basis is Haar's, whose functions are constant on cubes: the step is exact, where for smoother ones the source makes
it 2^(j-1) times as long. The nodes are an octree; each node with coefficients points to its seven.

Cost: 7 additions for each level that has coefficients, and as many steps as a ray crosses cubes. The error has two
parts: the coefficients that are left out, which `bits_per_voxel` is bought with; and the reconstruction, a value that
is constant in each voxel, as by the nearest sample (`tripod-true` has that alone), which remains when all are kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.methods.coefficients import bits_per_voxel, checked_fraction, keep_largest
from texvol.methods.compiling import compiled, part
from texvol.methods.compositing import add_behind, classify, table_of
from texvol.methods.method import Method, Numbers, Size, with_background
from texvol.methods.rays import in_threads, rays_of
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene
from texvol.util.errors import missing_extra

_DEEPEST = 5  # levels; cubes of 32 voxels
_DETAILS = ("aad", "ada", "add", "daa", "dad", "dda", "ddd")  # z, y, x; bit c of 1 + n is set where axis c has a d
_NONE, _UNIFORM = -1, -2  # a node without coefficients, and one where all that is finer has none either


class Wavelets(Method):
    """Ray casting in Haar coefficients.

    Parameters
    ----------
    kept : float
        Fraction of the coefficients that is kept.

    Attributes
    ----------
    bits_per_voxel : float
        Of the coefficients that are kept, and their places, see `coefficients`.
    """

    name = "wavelets"
    source = "Muraki 1993, Westermann 1994, section 6.5.2"
    order = "after"
    perspective = True

    def __init__(self, scene: CompleteScene, *, kept: float = 0.1) -> None:
        super().__init__(scene)
        self.kept = checked_fraction(kept)
        values = self.volume.values
        self.levels = max(1, min(_DEEPEST, int(np.log2(min(values.shape)))))
        means, details = _transformed(values, self.levels)
        self.bits_per_voxel = self._threshold(means, details)
        # Orthonormal coefficients of level j are sums over 8^j voxels, divided by √8^j; here their parts of a mean.
        self.means = np.ascontiguousarray(means / np.float32(8 ** (self.levels / 2)))
        self.nodes, self.first, self.table = _octree(details)
        self.points = table_of(scene.medium)

    def _threshold(self, means: NDArray, details: list[NDArray]) -> float:
        """Set small coefficients to 0; return the bits per voxel."""
        flat = np.concatenate([means.ravel(), *(each.ravel() for each in details)])
        keep_largest(flat, self.kept)
        means[:] = flat[: means.size].reshape(means.shape)
        at = means.size
        for each in details:
            each[:] = flat[at : at + each.size].reshape(each.shape)
            at += each.size
        return bits_per_voxel(flat, self.volume.values.size)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, shape (height, width, 4)."""
        rays = rays_of(camera, size, self.volume)
        picture = np.zeros((size[1], size[0], 4))
        held = (self.means, self.nodes, self.first, self.table, self.points)

        def draw(rows: slice) -> None:
            cast(*held, *(each[rows] for each in rays), picture[rows])

        in_threads(draw, size[1])
        return with_background(picture, self.scene)


def _transformed(values: NDArray, levels: int) -> tuple[NDArray, list[NDArray]]:
    """Return coefficients of the coarsest means (z, y, x), and details (7, z, y, x) of each level, the finest first."""
    try:
        import pywt
    except ImportError as error:
        raise missing_extra("PyWavelets", "methods", "ray casting in wavelets") from error
    edge = 2**levels
    padded = np.pad(values.astype(np.float32), [(0, -count % edge) for count in values.shape], mode="edge")
    means, *finer = pywt.wavedecn(padded, "haar", mode="periodization", level=levels)
    return means, [np.stack([each[name] for name in _DETAILS]) for each in reversed(finer)]


def _octree(details: list[NDArray]) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float32]]:
    """Return the nodes of all levels, the first node of each level, and the coefficients that nodes point to.

    A node is a row of the coefficients (n, 7), or `_NONE`, or `_UNIFORM`.
    """
    nodes: list[NDArray] = []
    rows: list[NDArray] = []
    finer: NDArray = np.ones(np.multiply(details[0].shape[1:], 2), np.bool_)  # voxels are uniform
    for level, each in enumerate(details, start=1):
        empty = ~each.any(axis=0)
        z, y, x = empty.shape
        finer = empty & np.asarray(finer.reshape(z, 2, y, 2, x, 2).all(axis=(1, 3, 5)))
        node = np.where(finer, _UNIFORM, _NONE).astype(np.int32)
        node[~empty] = sum(map(len, rows)) + np.arange(np.count_nonzero(~empty))
        nodes.append(node.ravel())
        rows.append(each[:, ~empty].T / np.float32(8 ** (level / 2)))
    first = np.cumsum([0, *(each.size for each in nodes[:-1])])
    return np.concatenate(nodes), first, np.ascontiguousarray(np.concatenate(rows))


@compiled
def cast(means, nodes, first, table, points, start, step, near, far, picture):
    """Cast the rays of some rows through the octree, from cube to cube."""
    sample, low, voxel = np.empty(4), np.empty(3, np.int64), np.empty(3, np.int64)
    count = np.array([means.shape[2], means.shape[1], means.shape[0]]) << first.size
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            t, end = near[row, column], far[row, column]
            p, d, transmittance = start[row, column], step[row, column], 1.0
            for axis in range(3):
                at = p[axis] + t * d[axis] if end > t else 0.0
                voxel[axis] = min(max(int(np.floor(at) if d[axis] >= 0 else np.ceil(at) - 1), 0), count[axis] - 1)
            while end > t:
                value, edge = _value_at(means, nodes, first, table, voxel)
                leaves, across = end, -1
                for axis in range(3):
                    low[axis] = voxel[axis] // edge * edge
                    face = low[axis] + (edge if d[axis] > 0 else 0)
                    crossing = (face - p[axis]) / d[axis] if d[axis] != 0 else np.inf
                    if crossing < leaves:
                        leaves, across = crossing, axis
                classify(value, points, sample)
                transmittance = add_behind(picture[row, column], transmittance, sample, max(leaves - t, 0.0))
                t = max(leaves, t)
                if across < 0:
                    break
                for axis in range(3):
                    at = int(np.floor(p[axis] + t * d[axis]))
                    voxel[axis] = min(max(at, low[axis]), low[axis] + edge - 1)
                voxel[across] = low[across] + (edge if d[across] > 0 else -1)
                if voxel[across] < 0 or voxel[across] >= count[across]:
                    break


@part
def _value_at(means, nodes, first, table, voxel):
    """Return the value in a voxel, and the edge of the cube around it in which the value is constant."""
    x, y, z = voxel
    levels = first.size
    value = means[z >> levels, y >> levels, x >> levels]
    for level in range(levels, 0, -1):
        ny, nx = means.shape[1] << (levels - level), means.shape[2] << (levels - level)
        node = nodes[first[level - 1] + ((z >> level) * ny + (y >> level)) * nx + (x >> level)]
        if node == _UNIFORM:
            return value, 1 << level
        if node >= 0:
            half = level - 1
            octant = 4 * ((z >> half) & 1) + 2 * ((y >> half) & 1) + ((x >> half) & 1)
            for n in range(7):
                # The sign is that of the product over the axes that have a d.
                odd = octant & (n + 1)
                odd = (odd ^ (odd >> 1) ^ (odd >> 2)) & 1
                value += -table[node, n] if odd else table[node, n]
    return value, 1
