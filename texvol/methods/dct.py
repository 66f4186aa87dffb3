"""Ray casting in blocks of cosine coefficients (section 6.5; Yeo and Liu 1995).

The volume is cut into blocks of 8³ samples, as JPEG cuts a picture; each is transformed by cosines (DCT-II) once, and
all but the largest coefficients of the volume are set to 0. The value at a point of a block is the sum of its cosines,

    v(x, y, z) = Σ c_uvw cos(π u x / 8) cos(π v y / 8) cos(π w z / 8),    x, y, z from 0 to 8, sample i at i + 1/2

A ray goes from block to block. A block of one coefficient, its mean, is crossed in one step, which is exact; others are
crossed in equal steps.

Cost: for each step as many multiplications as the block has coefficients. The error has three parts: the coefficients
that are left out, which `bits_per_voxel` is bought with, as seams between blocks; the reconstruction, by cosines
instead of trilinear weights, which rings at edges; and that of the steps, of order 2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from texvol.methods.coefficients import bits_per_voxel, checked_fraction, keep_largest
from texvol.methods.compiling import compiled, part
from texvol.methods.compositing import add_behind, classify, steps_in, table_of
from texvol.methods.method import Method, Numbers, Size, with_background
from texvol.methods.rays import in_threads, rays_of
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene
from texvol.util.errors import InputError, missing_extra

_EDGE = 8  # samples along a block, as the authors have it


class Cosines(Method):
    """Ray casting in cosine coefficients of blocks.

    Parameters
    ----------
    kept : float
        Fraction of the coefficients that is kept.
    sampling_rate : float
        Steps per smallest spacing, at least, where a block has more than its mean.

    Attributes
    ----------
    bits_per_voxel : float
        Of the coefficients that are kept, and their places, see `coefficients`.
    """

    name = "dct"
    source = "Yeo and Liu 1995, section 6.5"
    order = "after"
    perspective = True

    def __init__(self, scene: CompleteScene, *, kept: float = 0.1, sampling_rate: float = 1.0) -> None:
        super().__init__(scene)
        if not 0 < sampling_rate < math.inf:
            raise InputError(f"sampling_rate must be positive and finite, got {sampling_rate!r}")
        self.kept, self.sampling_rate = checked_fraction(kept), sampling_rate
        blocks = _transformed(self.volume.values)
        keep_largest(blocks.reshape(-1), kept)
        self.bits_per_voxel = bits_per_voxel(blocks, self.volume.values.size)
        filled = blocks.reshape(-1, _EDGE**3) != 0
        self.grid = np.array(blocks.shape[:3])
        self.ends = np.append(0, np.cumsum(filled.sum(axis=1)))  # where a block's coefficients begin, and end
        self.places = np.broadcast_to(np.arange(_EDGE**3, dtype=np.int16), filled.shape)[filled]
        self.coefficients = (blocks.reshape(-1, _EDGE**3) * _scale())[filled]
        self.points = table_of(scene.medium)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, shape (height, width, 4)."""
        rays = rays_of(camera, size, self.volume)
        picture = np.zeros((size[1], size[0], 4))
        held = (self.grid, self.ends, self.places, self.coefficients, self.points)
        distance = self.volume.smallest_spacing / self.sampling_rate

        def draw(rows: slice) -> None:
            cast(*held, *(each[rows] for each in rays), distance, picture[rows])

        in_threads(draw, size[1])
        return with_background(picture, self.scene)


def _transformed(values: NDArray) -> NDArray[np.float32]:
    """Return the orthonormal coefficients of all blocks, shape (blocks along z, y, x, w, v, u)."""
    try:
        from scipy.fft import dctn
    except ImportError as error:
        raise missing_extra("scipy", "methods", "ray casting in cosines") from error
    padded = np.pad(values.astype(np.float32), [(0, -count % _EDGE) for count in values.shape], mode="edge")
    z, y, x = (count // _EDGE for count in padded.shape)
    blocks = padded.reshape(z, _EDGE, y, _EDGE, x, _EDGE).transpose(0, 2, 4, 1, 3, 5)
    return np.ascontiguousarray(dctn(blocks, type=2, axes=(3, 4, 5), norm="ortho", workers=-1))


def _scale() -> NDArray[np.float32]:
    """Return what orthonormal coefficients are multiplied by to be factors of cosines, flat (w, v, u)."""
    along = np.full(_EDGE, math.sqrt(2 / _EDGE))
    along[0] = math.sqrt(1 / _EDGE)
    return np.multiply.outer(np.multiply.outer(along, along), along).ravel().astype(np.float32)


@compiled
def cast(grid, ends, places, coefficients, points, start, step, near, far, distance, picture):
    """Cast the rays of some rows, from block to block."""
    sample, along, block = np.empty(4), np.empty((3, _EDGE)), np.empty(3, np.int64)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            t, end = near[row, column], far[row, column]
            p, d, transmittance = start[row, column], step[row, column], 1.0
            for axis in range(3):
                at = (p[axis] + t * d[axis]) / _EDGE if end > t else 0.0
                last = grid[2 - axis] - 1
                block[axis] = min(max(int(np.floor(at) if d[axis] >= 0 else np.ceil(at) - 1), 0), last)
            while end > t:
                leaves, across = end, -1
                for axis in range(3):
                    face = (block[axis] + (1 if d[axis] > 0 else 0)) * _EDGE
                    crossing = (face - p[axis]) / d[axis] if d[axis] != 0 else np.inf
                    if crossing < leaves:
                        leaves, across = crossing, axis
                leaves = max(leaves, t)
                index = (block[2] * grid[1] + block[1]) * grid[2] + block[0]
                here = slice(ends[index], ends[index + 1])
                is_constant = places[here].size == 0 or (places[here].size == 1 and places[here][0] == 0)
                steps = 1 if is_constant else steps_in(leaves - t, distance)
                for i in range(steps):
                    at = t + (i + 0.5) * (leaves - t) / steps
                    for axis in range(3):
                        _cosines(p[axis] + at * d[axis] - block[axis] * _EDGE, along[axis])
                    classify(_sum(places[here], coefficients[here], along), points, sample)
                    transmittance = add_behind(picture[row, column], transmittance, sample, (leaves - t) / steps)
                t = leaves
                if across < 0:
                    break
                block[across] += 1 if d[across] > 0 else -1
                if block[across] < 0 or block[across] >= grid[2 - across]:
                    break


@part
def _cosines(position, cosines):
    """Write cos(π u x / 8) for all u, by the sum formula."""
    turn = math.cos(math.pi / _EDGE * position)
    cosines[0], cosines[1] = 1.0, turn
    for u in range(2, _EDGE):
        cosines[u] = 2 * turn * cosines[u - 1] - cosines[u - 2]


@part
def _sum(places, coefficients, along):
    """Return the value at a point of a block."""
    value = 0.0
    for n in range(places.size):
        x, y, z = places[n] % _EDGE, places[n] // _EDGE % _EDGE, places[n] // (_EDGE * _EDGE)
        value += coefficients[n] * along[0, x] * along[1, y] * along[2, z]
    return value
