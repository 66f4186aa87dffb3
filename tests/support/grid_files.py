"""Files of grids that are not regular, written by VTK's and netCDF's own writers, and fields to put on them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import netCDF4
import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkDataSet, vtkRectilinearGrid, vtkStructuredGrid
from vtkmodules.vtkIOXML import vtkXMLRectilinearGridWriter, vtkXMLStructuredGridWriter

from texvol import Volume

MODES = {"ascii": 0, "binary": 1, "appended": 2}
PACKERS = {"plain": 0, "zlib": 1, "lz4": 2, "lzma": 3}


def linear(points: NDArray) -> NDArray[np.float64]:
    """A field that every interpolation reproduces; its slopes differ, so that no axis stands for another."""
    return 1.0 + points @ np.array([2.0, -3.0, 0.5])


def smooth(points: NDArray) -> NDArray[np.float64]:
    """A field with bounded second derivatives."""
    return np.sin(2 * points[..., 0]) * np.cos(points[..., 1]) + np.sin(points[..., 2])


def points_of_axes(axes: Sequence[ArrayLike]) -> NDArray[np.float64]:
    """World positions, shape (nz, ny, nx, 3), of a grid with axes x, y, z."""
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def warped(dimensions: Sequence[int]) -> NDArray[np.float64]:
    """Points of a curvilinear grid over about 1 x 2 x 1.5, no two cells alike, none folded."""
    w, v, u = np.meshgrid(*(np.linspace(0, 1, size) for size in dimensions[::-1]), indexing="ij")
    x = u + 0.1 * np.sin(2 * v + w)
    y = 2 * v + 0.1 * np.sin(3 * u)
    return np.stack([x, y, 1.5 * w + 0.1 * u * v + 0.05 * np.sin(3 * v)], axis=-1)


def points_of(volume: Volume, every: int = 1) -> NDArray[np.float64]:
    """World positions of a volume's samples, or of every so many along each axis, shape (nz, ny, nx, 3)."""
    indices = points_of_axes([np.arange(0, size, every) for size in volume.dimensions])
    return volume.origin + indices @ volume.world_from_index.T


def rectilinear(
    axes: Sequence[ArrayLike], values: NDArray, dtype: str = "f8", cells: bool = False
) -> vtkRectilinearGrid:
    """VTK's rectilinear grid; `values` at its points or its cells."""
    grid = vtkRectilinearGrid()
    grid.SetDimensions(*(len(np.atleast_1d(axis)) for axis in axes))
    for name, axis in zip("XYZ", axes, strict=True):
        getattr(grid, f"Set{name}Coordinates")(numpy_to_vtk(np.asarray(axis, dtype), deep=True))
    return _with_values(grid, values, cells)


def structured(points: NDArray, values: NDArray, dtype: str = "f8", cells: bool = False) -> vtkStructuredGrid:
    """VTK's structured grid; `values` at its points or its cells."""
    grid = vtkStructuredGrid()
    grid.SetDimensions(*points.shape[2::-1])
    held = vtkPoints()
    held.SetData(numpy_to_vtk(np.ascontiguousarray(points.reshape(-1, 3), dtype), deep=True))
    grid.SetPoints(held)
    return _with_values(grid, values, cells)


def _with_values(grid: vtkDataSet, values: NDArray, cells: bool) -> vtkDataSet:
    array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
    array.SetName("values")
    (grid.GetCellData() if cells else grid.GetPointData()).SetScalars(array)
    return grid


def written(path: Path, grid: vtkDataSet, mode: str = "binary", packer: str = "zlib", **more: int) -> Path:
    """The grid as a file."""
    writer = vtkXMLRectilinearGridWriter() if path.suffix == ".vtr" else vtkXMLStructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetDataMode(MODES[mode])
    writer.SetCompressorType(PACKERS[packer])
    writer.SetEncodeAppendedData(more.get("base64", 1))
    writer.SetByteOrder(more.get("little", 1))
    assert writer.Write()
    return path


LEVELS = (1000.0, 850.0, 500.0)
LATITUDES = (40.0, 38.0, 35.0, 31.0)
LONGITUDES = (10.0, 12.0, 14.0, 16.0, 18.0)


def write_netcdf(
    path: Path,
    values: NDArray,
    axes: Sequence[tuple[str, ArrayLike | None, str]] = (),
    *,
    form: str = "NETCDF4",
    name: str = "t",
    **attributes: object,
) -> Path:
    """A netCDF file of one variable; `axes` are name, coordinates and units of each dimension, slowest first."""
    defaults = [("time", np.arange(99.0), "hours since 2001-01-01"), ("lev", LEVELS, "hPa")]
    defaults += [("lat", LATITUDES, "degrees_north"), ("lon", LONGITUDES, "degrees_east")]
    with netCDF4.Dataset(path, "w", format=form) as dataset:
        chosen = list(axes) or defaults[-values.ndim :]
        for (dimension, coordinates, units), size in zip(chosen, values.shape, strict=True):
            dataset.createDimension(dimension, None if dimension == "time" else size)
            if coordinates is not None:
                variable = dataset.createVariable(dimension, "f8", (dimension,))
                variable.units = units
                variable[:] = np.asarray(coordinates)[:size]
        fill = attributes.pop("_FillValue", None)
        dimensions = [dimension for dimension, *_ in chosen]
        variable = dataset.createVariable(name, values.dtype, dimensions, fill_value=fill)
        variable.setncatts(attributes)
        variable.set_auto_maskandscale(False)
        variable[:] = values
    return path
