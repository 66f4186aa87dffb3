"""Strips between contours, and cells that are ambiguous: against the plainest way of finding them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from support.surfaces import facets

from texvol import Volume
from texvol.geometry import euler_number, surface_of
from texvol.geometry.extraction import ambiguous_cell_count
from texvol.geometry.surfaces.torus_path import area_of, strip


def area(*corners: np.ndarray) -> float:
    a, b, c = corners
    return float(np.linalg.norm(np.cross(b - a, c - a)) / 2)


def least_area(lower: np.ndarray, upper: np.ndarray) -> float:
    """The least cost of all walks around both contours, from every start, one node at a time."""
    m, n = len(lower), len(upper)
    found = []
    for start in range(n):
        costs = {(0, start): 0.0}
        for i, j in product(range(m + 1), range(start, start + n + 1)):
            if (i, j) != (0, start):
                p, q = lower[i % m], upper[j % n]
                across = costs.get((i - 1, j), np.inf) + area(lower[i - 1], p, q)
                along = costs.get((i, j - 1), np.inf) + area(upper[(j - 1) % n], p, q)
                costs[i, j] = min(across, along)
        found.append(costs[m, start + n])
    return min(found)


@pytest.mark.parametrize(("m", "n"), [(1, 1), (1, 5), (3, 3), (4, 7), (7, 4), (9, 8)])
def test_the_strip_has_the_least_area(m: int, n: int) -> None:
    random = np.random.default_rng(10 * m + n)
    for _ in range(4):
        lower, upper = random.random((m, 3)), random.random((n, 3))
        assert area_of(lower, upper) == pytest.approx(least_area(lower, upper), rel=1e-12)


@pytest.mark.parametrize(("m", "n"), [(3, 5), (40, 31), (31, 40)])
def test_a_strip_goes_once_along_the_lower_and_once_against_the_upper_contour(m: int, n: int) -> None:
    random = np.random.default_rng(m)
    triangles = strip(random.random((m, 3)), random.random((n, 3)))
    assert len(triangles) == m + n
    edges = [(int(a), int(b)) for t in triangles for a, b in zip(t, np.roll(t, -1), strict=True)]
    alone = {edge for edge in edges if edge[::-1] not in edges}
    wanted = {(i, (i + 1) % m) for i in range(m)} | {(m + (j + 1) % n, m + j) for j in range(n)}
    assert alone == wanted


def test_circles_are_joined_straight() -> None:
    """Two like circles a height apart: the area of the prism on a polygon, not turned although it starts elsewhere."""
    count, height = 24, 0.3
    angles = 2 * np.pi * np.arange(count) / count
    lower = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    upper = np.roll(lower, 7, axis=0) + [0, 0, height]
    assert area_of(lower, upper) == pytest.approx(count * height * 2 * np.sin(np.pi / count))


def has_ambiguous_face(inside: np.ndarray) -> bool:
    """The plain way: a face whose corners alternate around it."""
    for axis, side in product(range(3), range(2)):
        face = np.take(inside, side, axis=axis)
        if face[0, 0] == face[1, 1] != face[0, 1] == face[1, 0]:
            return True
    return False


def test_all_256_cells_are_told() -> None:
    cells = [np.array(signs, float).reshape(2, 2, 2) for signs in product((0, 1), repeat=8)][1:-1]
    told = [ambiguous_cell_count(Volume(cell), 0.5) == 1 for cell in cells]
    assert told == [has_ambiguous_face(cell > 0.5) for cell in cells]
    # Cases 3, 6, 7, 10, 12 and 13 of Lorensen and Cline, and their complements.
    assert sum(told) == 24 + 48 + 16 + 6 + 24 + 2


def test_cells_with_a_missing_corner_are_not_ambiguous() -> None:
    values = np.array([[[0, 1, 0], [1, 0, 1.0]]] * 2)
    assert ambiguous_cell_count(Volume(values), 0.5) == 2
    values[0, 0, 0] = np.nan
    assert ambiguous_cell_count(Volume(values), 0.5) == 1


def alternating(saddle: float, shift: int) -> Volume:
    """One ambiguous face, whose bilinear field has `saddle` at its saddle point, in a layer that begins at `shift`."""
    low = saddle - (1 - saddle)
    values = np.full((3, 4, 5 + shift), -1.0)
    values[1, 1, 1 + shift] = values[1, 2, 2 + shift] = 1
    values[1, 1, 2 + shift] = values[1, 2, 1 + shift] = low
    return Volume(values)


@pytest.mark.parametrize("shift", [0, 1])
@pytest.mark.parametrize(("saddle", "joined"), [(0.2, True), (-0.2, False)])
def test_values_decide_ambiguous_faces_of_cubes_and_the_cut_those_of_tetrahedra(
    saddle: float, joined: bool, shift: int
) -> None:
    volume = alternating(saddle, shift)
    assert ambiguous_cell_count(volume, 0.0) == 2, "to both sides of the face"
    assert euler_number(surface_of(volume, 0.0, "marching-cubes")) == (2 if joined else 4)
    # The diagonal of the face joins the samples above, or those below, by where the volume begins.
    assert euler_number(surface_of(volume, 0.0, "marching-tetrahedra")) == (4 if shift else 2)
    # In a slice the samples below are joined; boxes share an edge.
    assert euler_number(surface_of(volume, 0.0, "contours")) == 4
    boxes = surface_of(volume, 0.0, "cuberille")
    assert np.linalg.norm(facets(boxes)[1], axis=1).sum() / 2 == pytest.approx(12)
