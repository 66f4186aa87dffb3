"""Bounds of cells: each is the extreme of the samples between whose planes the cell lies."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.scene.volume import Volume
from texvol.slicing.bounds import CELL, bounds_of, first_place_of, side_of, with_large_cells


@pytest.mark.parametrize("reduce", [np.fmax, np.fmin])
@pytest.mark.parametrize("shape", [(1, 4, 5), (8, 3, 12), (7, 9, 6)])
def test_a_bound_is_the_extreme_from_plane_to_plane(shape, reduce):
    values = np.random.default_rng(2).normal(size=shape)
    values[0, 1:3, 2:] = np.nan
    bounds = bounds_of(values, 4, reduce)
    assert bounds.shape == tuple(-(-count // 4) for count in shape)
    for cell in np.ndindex(bounds.shape):
        # Samples 4 c - 1 to 4 c + 3, of those that there are.
        between = values[tuple(slice(max(4 * c - 1, 0), 4 * c + 4) for c in cell)]
        assert bounds[cell] == reduce.reduce(between, axis=None)


def test_cells_of_long_volumes_fit_a_texture():
    assert side_of(Volume(np.zeros((2, 2, 300), np.uint8))) == CELL
    most = 1632 * CELL
    for count, side in ((most, CELL), (most + 1, CELL + 1)):
        long = Volume(np.zeros((count, 1, 1), np.uint8))
        assert side_of(long) == side
        assert 1600 < len(with_large_cells(bounds_of(long.values, side, np.fmax), np.fmax, 0)) <= 2048


@pytest.mark.parametrize("shape", [(1, 4, 5), (8, 3, 12), (7, 9, 6)])
def test_the_bound_of_a_large_cell_is_that_of_its_small_ones(shape):
    bounds = np.random.default_rng(3).normal(size=shape)
    levels = with_large_cells(bounds, np.fmax, -9)
    nz, ny, nx = (-(-count // 4) for count in shape)
    np.testing.assert_array_equal(levels[: shape[0]], bounds)
    assert levels.shape == (shape[0] + nz, *shape[1:])
    for cell in np.ndindex(nz, ny, nx):
        own = bounds[tuple(slice(4 * c, 4 * c + 4) for c in cell)]
        assert levels[shape[0] + cell[0], cell[1], cell[2]] == own.max()
    assert (levels[shape[0] :, ny:] == -9).all() and (levels[shape[0] :, :, nx:] == -9).all()


@pytest.mark.parametrize("first", [(0, 0, 0), (5, 16, 2), (17, 40, 31)])
def test_bounds_of_a_part_are_in_the_cells_of_the_whole(first):
    """The first and the last cells of a part lack samples that it does not have."""
    whole = np.random.default_rng(4).normal(size=(60, 70, 50))
    part = whole[tuple(slice(at, at + 18) for at in first)]
    place = first_place_of(first, CELL)
    assert all(at % (4 * CELL) == 0 and 0 <= start - at < 4 * CELL for at, start in zip(place, first, strict=True))
    bounds = bounds_of(part, CELL, np.fmax, tuple(start - at for at, start in zip(place, first, strict=True)))
    cells = bounds_of(whole, CELL, np.fmax)
    for cell in np.ndindex(*bounds.shape):
        low = [at + CELL * c - 1 for at, c in zip(place, cell, strict=True)]
        if all(a >= start and a + CELL < start + 18 for a, start in zip(low, first, strict=True)):
            assert bounds[cell] == cells[tuple(at // CELL + c for at, c in zip(place, cell, strict=True))]
