"""Unstructured grids with known fields; VTU files of them, written by VTK's own writer, and Exodus files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import netCDF4
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


def exodus(path: Path, *, kind: str = "HEX8", steps: int = 2) -> Path:
    """Two blocks of a hexahedron each; nodal values x + step, and values of the second block's cells alone."""
    points, cells = hexahedra((2, 1, 1))
    with netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET") as dataset:
        sizes = {"time_step": None, "num_dim": 3, "num_nodes": 12, "num_elem": 2, "len_name": 33, "one": 1, "eight": 8}
        for name, size in sizes.items():
            dataset.createDimension(name, size)
        dataset.createVariable("time_whole", "f8", ("time_step",))[:] = 0.5 * np.arange(steps)
        for axis in range(3):
            dataset.createVariable(f"coord{'xyz'[axis]}", "f8", ("num_nodes",))[:] = points[:, axis]
        for block in (1, 2):
            variable = dataset.createVariable(f"connect{block}", "i4", ("one", "eight"))
            variable.elem_type = kind
            variable[:] = cells[block - 1] + 1
        for key, name in (("name_nod_var", b"heat"), ("name_elem_var", b"stress")):
            dataset.createVariable(key, "S1", ("one", "len_name"))[:] = np.frombuffer(name.ljust(33, b"\0"), "S1")
        nodal = dataset.createVariable("vals_nod_var1", "f8", ("time_step", "num_nodes"))
        element = dataset.createVariable("vals_elem_var1eb2", "f8", ("time_step", "one"))
        for step in range(steps):
            nodal[step] = points[:, 0] + step
            element[step] = 7 + step
    return path
