"""Ray casting by equal steps (section 6.1; Tuy and Tuy 1984, Levoy 1988): the plain ray marcher.

The ray's way through the box, of length L, is cut into n = ⌈L rate / spacing⌉ equal steps of length d. In the middle of
each the medium is evaluated, and stands for the whole step:

    picture = Σ_i q_i d φ(τ_i d) Π_{j<i} e^(-τ_j d),    φ(x) = (1 - e^-x) / x

`equal-steps` interpolates the value, trilinearly, and classifies it (order "after"); `equal-steps-before` interpolates
emission and extinction of the classified samples; `equal-steps-nearest` takes the nearest classified sample. No empty
space is skipped, and no ray ends early unless asked.

Cost: for each pixel and step 8 samples, and a search in the transfer function. Error: that of the midpoint rule, of
order 2 in the step where the medium is smooth, and of order 1 where it jumps, as at a step of the transfer function;
of the nearest sample also the reconstruction, which no step removes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from texvol.methods.compiling import compiled, part
from texvol.methods.compositing import add_behind, classify, steps_in, table_of
from texvol.methods.method import Method, Numbers, Size, classified, with_background
from texvol.methods.rays import checked_transmittance, in_threads, rays_of
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene
from texvol.util.errors import InputError


class EqualStepsBefore(Method):
    """Equal steps through the classified samples.

    Parameters
    ----------
    sampling_rate : float
        Steps per smallest spacing, at least.
    least_transmittance : float
        A ray ends where it lets less than this through; 0 never ends it.
    """

    name = "equal-steps-before"
    source = "Tuy and Tuy 1984, Levoy 1988, section 6.1"
    perspective = True
    interpolates = True

    def __init__(self, scene: CompleteScene, *, sampling_rate: float = 1.0, least_transmittance: float = 0.0) -> None:
        super().__init__(scene)
        if not 0 < sampling_rate < math.inf:
            raise InputError(f"sampling_rate must be positive and finite, got {sampling_rate!r}")
        self.sampling_rate, self.least_transmittance = sampling_rate, checked_transmittance(least_transmittance)
        self.prepare()

    def prepare(self) -> None:
        """Classify the samples."""
        self.samples = classified(self.scene)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, shape (height, width, 4)."""
        rays = rays_of(camera, size, self.volume)
        picture = np.zeros((size[1], size[0], 4))
        distance = self.volume.smallest_spacing / self.sampling_rate

        def draw(rows: slice) -> None:
            self.march(*(each[rows] for each in rays), distance, self.least_transmittance, picture[rows])

        in_threads(draw, size[1])
        return with_background(picture, self.scene)

    def march(self, *arguments: Any) -> None:
        """Draw some rows."""
        march_classified(self.samples, self.interpolates, *arguments)


class EqualStepsNearest(EqualStepsBefore):
    """Equal steps through the nearest classified samples."""

    name = "equal-steps-nearest"
    interpolates = False


class EqualSteps(EqualStepsBefore):
    """Equal steps through the interpolated value, classified at each."""

    name = "equal-steps"
    order = "after"

    def prepare(self) -> None:
        """Take the values and the points of the transfer function."""
        self.values = np.ascontiguousarray(self.volume.values, np.float32)
        self.table = table_of(self.scene.medium)

    def march(self, *arguments: Any) -> None:
        """Draw some rows."""
        march_values(self.values, self.table, *arguments)


@part
def _cell(position, count):
    """Return the two neighbours of a position along one axis, and the weight of the second; sample i is at i + 1/2."""
    q = min(max(position - 0.5, 0.0), count - 1.0)
    low = int(q)
    return low, min(low + 1, count - 1), q - low


@compiled
def march_values(values, table, start, step, near, far, distance, least, picture):
    """Interpolate the value, then classify it."""
    nz, ny, nx = values.shape
    sample = np.empty(4)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            path = far[row, column] - near[row, column]
            steps = steps_in(path, distance) if path > 0 else 0
            transmittance = 1.0
            for i in range(steps):
                t = near[row, column] + (i + 0.5) * (path / steps)
                x0, x1, fx = _cell(start[row, column, 0] + t * step[row, column, 0], nx)
                y0, y1, fy = _cell(start[row, column, 1] + t * step[row, column, 1], ny)
                z0, z1, fz = _cell(start[row, column, 2] + t * step[row, column, 2], nz)
                low = (values[z0, y0, x0] * (1 - fx) + values[z0, y0, x1] * fx) * (1 - fy)
                low += (values[z0, y1, x0] * (1 - fx) + values[z0, y1, x1] * fx) * fy
                high = (values[z1, y0, x0] * (1 - fx) + values[z1, y0, x1] * fx) * (1 - fy)
                high += (values[z1, y1, x0] * (1 - fx) + values[z1, y1, x1] * fx) * fy
                classify(low * (1 - fz) + high * fz, table, sample)
                transmittance = add_behind(picture[row, column], transmittance, sample, path / steps)
                if transmittance < least:
                    break


@compiled
def march_classified(samples, interpolates, start, step, near, far, distance, least, picture):
    """Interpolate the classified samples, or take the nearest one."""
    nz, ny, nx, _ = samples.shape
    sample = np.empty(4)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            path = far[row, column] - near[row, column]
            steps = steps_in(path, distance) if path > 0 else 0
            transmittance = 1.0
            for i in range(steps):
                t = near[row, column] + (i + 0.5) * (path / steps)
                x0, x1, fx = _cell(start[row, column, 0] + t * step[row, column, 0], nx)
                y0, y1, fy = _cell(start[row, column, 1] + t * step[row, column, 1], ny)
                z0, z1, fz = _cell(start[row, column, 2] + t * step[row, column, 2], nz)
                if not interpolates:
                    fx, fy, fz = math.floor(fx + 0.5), math.floor(fy + 0.5), math.floor(fz + 0.5)
                for channel in range(4):
                    low = (samples[z0, y0, x0, channel] * (1 - fx) + samples[z0, y0, x1, channel] * fx) * (1 - fy)
                    low += (samples[z0, y1, x0, channel] * (1 - fx) + samples[z0, y1, x1, channel] * fx) * fy
                    high = (samples[z1, y0, x0, channel] * (1 - fx) + samples[z1, y0, x1, channel] * fx) * (1 - fy)
                    high += (samples[z1, y1, x0, channel] * (1 - fx) + samples[z1, y1, x1, channel] * fx) * fy
                    sample[channel] = low * (1 - fz) + high * fz
                transmittance = add_behind(picture[row, column], transmittance, sample, path / steps)
                if transmittance < least:
                    break
