"""Tetrahedral grids: what they refuse, and the maps of barycentric coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from support.mesh_files import delaunay

from texvol import InputError, TetrahedralGrid
from texvol.scene.tetrahedra import barycentric_maps

POINTS, CELLS = delaunay(20)
VALUES = POINTS[:, 0]


def test_barycentric_coordinates_are_one_at_their_corner() -> None:
    """To rounding, times the ratio of the longest edge to the least height, 1e3 here."""
    corners = POINTS[CELLS]
    gradients, constants = barycentric_maps(corners)
    away = corners - corners[:, :1]
    at_corners = np.einsum("mij,mcj->mci", gradients, away) + constants[:, np.newaxis]
    np.testing.assert_allclose(at_corners, np.broadcast_to(np.eye(4), at_corners.shape), atol=1e-11)


def test_arrays_are_copied_and_cannot_be_written() -> None:
    values = VALUES.copy()
    grid = TetrahedralGrid(POINTS, CELLS, values)
    values[0] = 99
    assert grid.values[0] != 99
    with pytest.raises(ValueError, match="read-only"):
        grid.values[0] = 1


@pytest.mark.parametrize(
    ("points", "cells", "values", "per_cell", "reason"),
    [
        (POINTS[:, :2], CELLS, VALUES, False, r"points must be numbers of shape \(n, 3\), got float64 of \(28, 2\)"),
        (POINTS, CELLS[:, :3], VALUES, False, r"tetrahedra must be whole numbers of shape \(m, 4\)"),
        (POINTS, CELLS.astype("f8"), VALUES, False, r"tetrahedra must be whole numbers of shape \(m, 4\), got float64"),
        (POINTS, CELLS[:0], VALUES, False, r"tetrahedra must be whole numbers"),
        (POINTS, CELLS, VALUES[1:], False, r"values must be 28 real numbers, got float64 of \(27,\)"),
        (POINTS, CELLS, VALUES, True, rf"values must be {len(CELLS)} real numbers"),
        (POINTS, CELLS, VALUES.astype("c16"), False, "values must be 28 real numbers, got complex128"),
        (POINTS, CELLS + 1, VALUES, False, "tetrahedra must name points 0 to 27, got 28"),
        (POINTS, CELLS - 1, VALUES, False, "tetrahedra must name points 0 to 27, got -1"),
        (POINTS * np.nan, CELLS, VALUES, False, "points must be finite"),
        (POINTS * 1e91, CELLS, VALUES, False, "points must be finite and at most 1e"),
        (POINTS * [1, 1, 0], CELLS, VALUES, False, f"tetrahedra must have a volume, got {len(CELLS)} flat ones"),
    ],
)
def test_what_is_no_grid_is_refused(
    points: np.ndarray, cells: np.ndarray, values: np.ndarray, per_cell: bool, reason: str
) -> None:
    with pytest.raises(InputError, match=reason):
        TetrahedralGrid(points, cells, values, per_cell=per_cell)
