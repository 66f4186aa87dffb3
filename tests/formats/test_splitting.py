"""Splitting of cells into tetrahedra: of the same volume, and with the same triangles on both sides of a face."""

from __future__ import annotations

from collections import Counter
from itertools import permutations

import numpy as np
import pytest
from support.mesh_files import hexahedra

from texvol.formats.readers.splitting import SHAPES, split

# Corners of a cell of each kind, convex and with plane faces, and its volume.
_CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
CELLS = {
    "tetrahedron": (_CUBE[[0, 1, 3, 4]], 1 / 6),
    "pyramid": (np.concatenate([_CUBE[:4], [[0.3, 0.6, 2.0]]]), 2 / 3),
    "wedge": (_CUBE[[0, 1, 3, 4, 5, 7]], 1 / 2),
    "hexahedron": (_CUBE, 1.0),
    "voxel": (_CUBE[[0, 1, 3, 2, 4, 5, 7, 6]], 1.0),
}


def volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    corners = points[tetrahedra]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6


def triangles(tetrahedra: np.ndarray) -> Counter:
    return Counter(
        tuple(sorted(each[list(three)]))
        for each in tetrahedra
        for three in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
    )


@pytest.mark.parametrize("kind", CELLS)
def test_tetrahedra_fill_their_cell_however_it_is_numbered(kind: str) -> None:
    """720 orders of up to six corners, and as many at random of eight; to rounding."""
    points, volume = CELLS[kind]
    count = len(points)
    random = np.random.default_rng(0)
    orders = np.array(list(permutations(range(count)))) if count < 7 else random.permuted(
        np.tile(np.arange(count), (720, 1)), axis=1
    )  # fmt: skip
    for order in orders:
        placed = np.empty_like(points)
        placed[order] = points
        tetrahedra, source = split(kind, order[np.newaxis])
        assert len(tetrahedra) == {4: 1, 5: 2, 6: 3, 8: 6}[count]
        assert not source.any()
        parts = np.abs(volumes(placed, tetrahedra))
        assert parts.min() > 0.05
        np.testing.assert_allclose(parts.sum(), volume, rtol=1e-14)


def test_hexahedra_agree_on_their_shared_faces() -> None:
    """Each triangle inside of a block belongs to two tetrahedra, each of the border to one: two for each square."""
    points, cells = hexahedra((3, 4, 2), seed=5)
    tetrahedra, _ = split("hexahedron", cells)
    counts = Counter(triangles(tetrahedra).values())
    assert set(counts) == {1, 2}
    assert counts[1] == 2 * 2 * (3 * 4 + 4 * 2 + 2 * 3)
    np.testing.assert_allclose(np.abs(volumes(points, tetrahedra)).sum(), 24, rtol=1e-14)


@pytest.mark.parametrize("seed", range(12))
def test_cells_of_different_kinds_agree_on_their_shared_faces(seed: int) -> None:
    """A cube with a wedge on one side and a pyramid on another; the border has 2 x 4 + 4 + 4 + 4 triangles."""
    points = np.concatenate([_CUBE, [[2, 0, 0], [2, 0, 1], [0.5, 0.5, 2]]])
    order = np.random.default_rng(seed).permutation(len(points))
    parts = [
        split(kind, order[np.array([cell])])[0]
        for kind, cell in (
            ("hexahedron", list(range(8))), ("wedge", [1, 8, 2, 5, 9, 6]), ("pyramid", [4, 5, 6, 7, 10]),
        )
    ]  # fmt: skip
    counts = Counter(triangles(np.concatenate(parts)).values())
    assert set(counts) == {1, 2}
    # Four free faces of the cube, two squares and two triangles of the wedge, four triangles of the pyramid.
    assert counts[1] == 4 * 2 + 2 * 2 + 2 + 4


@pytest.mark.parametrize("seed", range(6))
def test_points_of_one_rank_are_one_point(seed: int) -> None:
    """Two cubes whose points at the common face are stored twice, in any order."""
    points, cells = hexahedra((2, 1, 1))
    order = np.random.default_rng(seed).permutation(16)
    apart = order.reshape(2, 8)
    doubled = np.empty((16, 3))
    doubled[apart] = points[cells]
    rank = np.unique(doubled, axis=0, return_inverse=True)[1].reshape(-1)
    counts = Counter(triangles(rank[split("hexahedron", apart, rank)[0]]).values())
    assert set(counts) == {1, 2}
    assert counts[1] == 20


def test_an_edge_drawn_together_makes_fewer_tetrahedra() -> None:
    """A cube with two of its edges drawn together is a wedge."""
    cell = np.array([[0, 1, 2, 3, 4, 5, 2, 3]])
    tetrahedra, _ = split("hexahedron", cell)
    assert len(tetrahedra) == 3
    np.testing.assert_allclose(np.abs(volumes(_CUBE, tetrahedra)).sum(), 0.5, rtol=1e-14)


def test_faces_are_closed() -> None:
    """Each edge of a cell belongs to two of its faces: a slip in a table would leave one open."""
    for shape in SHAPES.values():
        edges = Counter(tuple(sorted((face[at - 1], face[at]))) for face in shape.faces for at in range(len(face)))
        assert set(edges.values()) == {2}
        assert shape.corners - len(edges) + len(shape.faces) == 2  # Euler
