"""Marching tetrahedra: cells cut into five tetrahedra (Shirley, Tuchman 1990), in which the field is linear.

A tetrahedron has a triangle or a quadrilateral of the surface, or none, and is never ambiguous. The price is a choice:
a face of a cell is cut by one of its diagonals, and on an ambiguous face that diagonal decides what is connected, not
the values. Neighbours are cut alternately, so that they share the diagonals of their faces: no cracks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.surfaces.field import Facets, Field


def _five(odd: bool) -> NDArray[np.int64]:
    """Return the tetrahedra (5, 4) of a cell, as numbers of its corners, each of positive volume."""
    flip = 7 if odd else 0
    numbers = np.array([(0, 3, 5, 6), (1, 0, 3, 5), (2, 0, 3, 6), (4, 0, 5, 6), (7, 3, 5, 6)]) ^ flip
    for tetrahedron in numbers:
        corners = (tetrahedron[:, np.newaxis] >> np.arange(3)) & 1
        if np.linalg.det(corners[1:] - corners[0]) < 0:
            tetrahedron[2:] = tetrahedron[:1:-1].copy()
    return numbers


def _triangles_of_cases() -> list[NDArray[np.int64]]:
    """Return the triangles (t, 3, 2) of each of 16 cases as edges between corners; bit c of a case: c is inside."""
    even = [p for p in np.ndindex(4, 4, 4, 4) if len(set(p)) == 4 and np.linalg.det(np.eye(4)[list(p)]) > 0]
    cases = []
    for case in range(16):
        is_inside = [bool(case >> corner & 1) for corner in range(4)]
        # An even permutation keeps the orientation; corners inside come first, but a single one outside.
        lone = is_inside.count(True) == 3
        a, b, c, d = next(p for p in even if sorted(p, key=lambda n: is_inside[n] == lone) == list(p))
        triangles = {
            0: [],
            1: [((a, b), (a, c), (a, d))],
            2: [((a, c), (a, d), (b, d)), ((a, c), (b, d), (b, c))],
            3: [((a, b), (a, d), (a, c))],
            4: [],
        }[sum(is_inside)]
        cases.append(np.array(triangles, np.int64).reshape(-1, 3, 2))
    return cases


def marching_tetrahedra(field: Field) -> Facets:
    """Return the surface, in time and memory by the number of cells that it crosses; vertices are shared."""
    values = field.decided.reshape(-1)
    tetrahedra = _tetrahedra(field)
    cases = ((values[tetrahedra] > 0) << np.arange(4)).sum(axis=1)
    edges = np.concatenate(
        [tetrahedra[cases == case][:, table].reshape(-1, 2) for case, table in enumerate(_triangles_of_cases())]
    )
    edges.sort(axis=1)
    keys, corners = np.unique(edges[:, 0] * np.int64(values.size) + edges[:, 1], return_inverse=True)
    ends = np.stack(np.divmod(keys, values.size), axis=1)
    of_ends = values[ends].astype(np.float64)
    fraction = (of_ends[:, 0] / (of_ends[:, 0] - of_ends[:, 1]))[:, np.newaxis]
    places, slopes = field.places(ends), field.gradients(ends)
    return Facets(
        places[:, 0] + fraction * (places[:, 1] - places[:, 0]),
        corners.reshape(-1, 3),
        -(slopes[:, 0] + fraction * (slopes[:, 1] - slopes[:, 0])),
    )


def _tetrahedra(field: Field) -> NDArray[np.int64]:
    """Return the tetrahedra (n, 4) of the crossed cells, as flat numbers of samples."""
    cells = field.crossed_cells()
    odd = np.sum(np.unravel_index(cells, field.above.shape), axis=0) % 2 == 1
    steps = field.corner_steps()
    parts = [cells[odd == is_odd][:, np.newaxis, np.newaxis] + steps[_five(is_odd)] for is_odd in (False, True)]
    return np.concatenate([part.reshape(-1, 4) for part in parts])
