"""Cells of unstructured grids as tetrahedra, split so that neighbours agree on the diagonals of shared faces.

A quadrilateral is cut from its corner of the smallest number (Dompierre, Labbé, Vallet, Camarero 1999, "How to
subdivide pyramids, prisms and hexahedra into tetrahedra"): the numbers are those of the whole grid, so both cells at a
face cut it alike. A cell is then the fan from its smallest corner: one tetrahedron to each triangle of the faces that
do not touch that corner. A pyramid makes 2 tetrahedra, a wedge 3, a hexahedron 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.intp]


class Shape(NamedTuple):
    """Number of corners of a kind of cell, and its faces as numbers of corners, around each face."""

    corners: int
    faces: tuple[tuple[int, ...], ...]


# Corners in VTK's order, which those of Exodus, Gmsh and meshio share.
_TETRAHEDRON = Shape(4, ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)))
_PYRAMID = Shape(5, ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)))
_WEDGE = Shape(6, ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)))
_HEXAHEDRON = Shape(
    8, ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
)  # fmt: skip
# A voxel numbers its corners along x, then y, then z.
_VOXEL = Shape(8, ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)))
SHAPES = {
    "tetrahedron": _TETRAHEDRON,
    "pyramid": _PYRAMID,
    "wedge": _WEDGE,
    "hexahedron": _HEXAHEDRON,
    "voxel": _VOXEL,
}


def split(kind: str, cells: NDArray, rank: NDArray | None = None) -> tuple[Integers, Integers]:
    """Return the tetrahedra of cells, shape (k, 4), and the number of the cell of each, shape (k,).

    A cell that names a point twice, such as a hexahedron with an edge drawn together, makes fewer tetrahedra.

    Parameters
    ----------
    kind : str
        A key of SHAPES.
    cells : array of shape (m, corners)
        Numbers of points.
    rank : array of shape (n,), optional
        Numbers of the points that decide diagonals, where two points of the file are one; else the points' own.
    """
    cells = cells.astype(np.intp, copy=False)
    if kind == "tetrahedron":
        return cells, np.arange(len(cells))
    order = cells if rank is None else rank[cells]
    smallest = order.argmin(axis=1)
    made, sources = [], []
    for corner in range(SHAPES[kind].corners):
        here = np.flatnonzero(smallest == corner)
        for face in SHAPES[kind].faces:
            if corner not in face and here.size:
                for triangle in _triangles(cells[here][:, face], order[here][:, face]):
                    made.append(np.concatenate([cells[here, corner][:, np.newaxis], triangle], axis=1))
                    sources.append(here)
    tetrahedra, source = np.concatenate(made), np.concatenate(sources)
    in_order = np.sort(tetrahedra if rank is None else rank[tetrahedra], axis=1)
    has_four = (np.diff(in_order, axis=1) != 0).all(axis=1)
    return tetrahedra[has_four], source[has_four]


def _triangles(faces: Integers, order: Integers) -> Sequence[Integers]:
    """Return one or two triangles of each face; quadrilaterals are cut from their smallest corner."""
    if faces.shape[1] == 3:
        return (faces,)
    around = (order.argmin(axis=1)[:, np.newaxis] + np.arange(4)) % 4
    turned = np.take_along_axis(faces, around, axis=1)
    return turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]
