"""Unstructured grids with known fields, and VTU files of them, written by VTK's own writer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from support.grid_files import MODES, PACKERS

# VTK's numbers of cells.
TETRAHEDRON, VOXEL, HEXAHEDRON, WEDGE, PYRAMID = 10, 11, 12, 13, 14
CORNERS = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], indexing="ij"), axis=-1).reshape(-1, 3)


def delaunay(count: int, seed: int = 1) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and tetrahedra that fill the unit cube: its corners, and `count` points inside at random."""
    from scipy.spatial import Delaunay

    points = np.concatenate([np.random.default_rng(seed).random((count, 3)), CORNERS])
    return points, Delaunay(points).simplices.astype(np.int64)


def hexahedra(counts: Sequence[int], seed: int | None = None) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and cells of a block of unit cubes; with a seed, its points are numbered at random."""
    nx, ny, nz = counts
    z, y, x = np.meshgrid(*(np.arange(size + 1.0) for size in (nz, ny, nx)), indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(nz + 1, ny + 1, nx + 1)
    corners = [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0), (1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0)]
    cells = np.stack([number[k : k + nz, j : j + ny, i : i + nx] for k, j, i in corners], axis=-1).reshape(-1, 8)
    if seed is None:
        return points, cells
    order = np.random.default_rng(seed).permutation(len(points))
    moved = np.empty_like(points)
    moved[order] = points
    return moved, order[cells]


def unstructured(
    points: NDArray,
    cells: Sequence[tuple[int, NDArray]],
    values: NDArray | None = None,
    of_cells: NDArray | None = None,
) -> vtkUnstructuredGrid:
    """VTK's unstructured grid; `cells` are pairs of VTK's number of a kind, and corners of shape (m, corners)."""
    grid = vtkUnstructuredGrid()
    held = vtkPoints()
    held.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    grid.SetPoints(held)
    for kind, corners in cells:
        for each in corners:
            numbers = vtkIdList()
            for number in each:
                numbers.InsertNextId(int(number))
            grid.InsertNextCell(kind, numbers)
    for data, array, name in ((grid.GetPointData(), values, "values"), (grid.GetCellData(), of_cells, "of_cells")):
        if array is not None:
            held_values = numpy_to_vtk(np.ascontiguousarray(array), deep=True)
            held_values.SetName(name)
            data.SetScalars(held_values)
    return grid


def written(path: Path, grid: vtkUnstructuredGrid, mode: str = "binary", packer: str = "zlib", **more: int) -> Path:
    """The grid as a VTU file."""
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetDataMode(MODES[mode])
    writer.SetCompressorType(PACKERS[packer])
    writer.SetEncodeAppendedData(more.get("base64", 1))
    writer.SetByteOrder(more.get("little", 1))
    assert writer.Write()
    return path
