"""Trace rays through a volume in the projection modes."""

from __future__ import annotations

from math import inf, isnan, nan
from typing import NamedTuple

from numpy.typing import NDArray

from texvol.ray_casting.common.cells import in_cell, load_corners
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.rays import Numbers
from texvol.ray_casting.common.walk import walk_grid
from texvol.ray_casting.projection.cells import NO_HIT, first_hit, gap_value, highest_of, mean_above, mean_of

INTEGRAL, HIGHEST, SURFACE, ABOVE = 0, 1, 2, 3


class _Ray(NamedTuple):
    """A ray in index space, the volume it crosses, and scratch memory for one cell."""

    start: Numbers
    step: Numbers
    values: NDArray
    kind: int
    sign: float
    level: float
    rounding: Numbers
    corners: Numbers  # (8)


@woven_in
def _cross(ray, cell, here, there, state):
    """Return the state (number, length, side) behind a cell, and True if the ray has met a surface there."""
    load_corners(ray.values, cell.i, cell.j, cell.k, ray.corners)
    for corner in range(8):
        ray.corners[corner] *= ray.sign
    entry = in_cell(ray.start, ray.step, here, cell.i, cell.j, cell.k)
    leave = in_cell(ray.start, ray.step, there, cell.i, cell.j, cell.k)
    beside = gap_value(ray.corners, entry, leave, ray.rounding)
    number, length, side = state
    if ray.kind == SURFACE:
        t, side = first_hit(ray.corners, beside, entry, leave, ray.level, side)
        number, length = here + t * (there - here), (0.0 if t < NO_HIT else -1.0)
    elif not isnan(beside):
        number = _add_cell(ray, beside, entry, leave, there - here, number)
        length += there - here
    return (number, length, side), ray.kind == SURFACE and length >= 0.0


@compiled
def _add_cell(ray, beside, entry, leave, length, number):
    """Return the integral, or the highest value, in front of a cell and in it."""
    if ray.kind == INTEGRAL:
        return number + length * mean_of(ray.corners, beside, entry, leave)
    if ray.kind == ABOVE:
        return number + length * mean_above(ray.corners, beside, entry, leave, ray.level)
    return highest_of(ray.corners, beside, entry, leave, number)


def _projector(sources):
    @compiled_and_cached
    def project_rays(values, kind, sign, level, starts, steps, ends, rounding, corners, numbers):
        """Write two numbers of each ray (rows, columns, 3) in index space to `numbers` (rows, columns, 2).

        By `kind`, the first number is the INTEGRAL of the values times `sign`, the HIGHEST of them, or the integral of
        the part ABOVE `level`; the second is the length on which there are values. For SURFACE, the first number is the
        s at which `level` is first met, and the second is negative if it is not met. `corners` is scratch memory of
        shape (8).
        """
        sources  # noqa: B018 - see compiled_and_cached
        volume = uncounted((values, kind, sign, level, rounding, corners))
        starts, steps, ends, numbers = uncounted(starts), uncounted(steps), uncounted(ends), uncounted(numbers)
        for row in range(numbers.shape[0]):
            for column in range(numbers.shape[1]):
                ray = _Ray(starts[row, column], steps[row, column], *volume)
                state = (-inf if kind == HIGHEST else 0.0), (-1.0 if kind == SURFACE else 0.0), nan
                number, length, _ = walk_grid(_cross, ray, values.shape, ends[row, column], state)
                numbers[row, column, 0], numbers[row, column, 1] = number, length

    return project_rays


project_rays = _projector(sources())
