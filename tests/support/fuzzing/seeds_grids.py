"""Sound grids for `fuzz.py`: VTK's XML formats in every coding, its legacy format, and netCDF in all of its formats."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import netCDF4
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkDataSet, vtkImageData, vtkRectilinearGrid, vtkStructuredGrid
from vtkmodules.vtkIOLegacy import vtkDataSetWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLRectilinearGridWriter, vtkXMLStructuredGridWriter

from support.fuzzing.seeds import STEPS, VALUES, Seed, of

_WRITERS = {".vti": vtkXMLImageDataWriter, ".vtr": vtkXMLRectilinearGridWriter, ".vts": vtkXMLStructuredGridWriter}
# Data mode (ascii, binary, appended), compressor (none, zlib, lz4, lzma), and whether appended data are base64.
_CODINGS = ((0, 0, 0), (1, 1, 0), (2, 0, 0), (2, 2, 1), (1, 3, 0))


def seeds() -> Iterator[Seed]:
    """Image data, rectilinear and curvilinear grids, netCDF of three and four axes."""
    for ending in _WRITERS:
        for coding in _CODINGS:
            yield of(
                ending[1:], f"v{ending}", lambda path, coding=coding: _write_vtk(path, coding), text=coding[0] == 0
            )
        for text in (True, False):
            yield of("vtk-grid", "v.vtk", lambda path, of=ending, text=text: _write_legacy(path, of, text), text=text)
    for form in ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4", "NETCDF4_CLASSIC"):
        kind = "netcdf4" if "4" in form and "64" not in form else "netcdf3"
        yield of(kind, "v.nc", lambda path, form=form: _write_netcdf(path, form))
        yield of(kind, "t.nc", lambda path, form=form: _write_netcdf(path, form, steps=True), "series")


def _write_vtk(path: Path, coding: tuple[int, int, int]) -> None:
    writer = _WRITERS[path.suffix]()
    writer.SetFileName(str(path))
    writer.SetInputData(_grid(path.suffix))
    mode, packer, encoded = coding
    writer.SetDataMode(mode)
    writer.SetCompressorType(packer)
    writer.SetEncodeAppendedData(encoded)
    writer.Write()


def _write_legacy(path: Path, ending: str, text: bool) -> None:
    writer = vtkDataSetWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(_grid(ending))
    writer.SetFileVersion(42)
    writer.SetFileTypeToASCII() if text else writer.SetFileTypeToBinary()
    writer.Write()


def _grid(ending: str) -> vtkDataSet:
    nz, ny, nx = VALUES.shape
    if ending == ".vti":
        grid = vtkImageData()
        grid.SetSpacing(2, 3, 4)
        grid.SetOrigin(1, 2, 3)
    elif ending == ".vtr":
        grid = vtkRectilinearGrid()
        for name, size in zip("XYZ", (nx, ny, nz), strict=True):
            positions = numpy_to_vtk(np.arange(size) ** 1.5, deep=True)
            positions.SetName(name)
            getattr(grid, f"Set{name}Coordinates")(positions)
    else:
        grid = vtkStructuredGrid()
        z, y, x = np.meshgrid(*(np.arange(size, dtype="f8") for size in VALUES.shape), indexing="ij")
        points = vtkPoints()
        positions = np.stack([x + 0.1 * np.sin(y), y + 0.1 * z, z], axis=-1).reshape(-1, 3)
        points.SetData(numpy_to_vtk(positions, deep=True))
        grid.SetPoints(points)
    grid.SetDimensions(nx, ny, nz)
    for name, values in (("first", VALUES), ("second", VALUES.astype("f4"))):
        array = numpy_to_vtk(values.ravel(), deep=True)
        array.SetName(name)
        grid.GetPointData().AddArray(array)
    grid.GetPointData().SetActiveScalars("first")
    return grid


def _write_netcdf(path: Path, form: str, *, steps: bool = False) -> None:
    values = STEPS if steps else VALUES
    names = ("time", "lev", "lat", "lon")[-values.ndim :]
    units = {"time": "hours since 2001-01-01", "lev": "hPa", "lat": "degrees_north", "lon": "degrees_east"}
    positions = {"time": [0, 1.5], "lev": [1000, 850, 500], "lat": [40, 38, 35, 31], "lon": [10, 12, 14, 16, 18]}
    with netCDF4.Dataset(path, "w", format=form) as dataset:
        for name, size in zip(names, values.shape, strict=True):
            dataset.createDimension(name, None if name == "time" else size)
            variable = dataset.createVariable(name, "f8", (name,))
            variable.units = units[name]
            variable[:] = positions[name]
        packed = {"zlib": True, "shuffle": True} if form.startswith("NETCDF4") else {}
        variable = dataset.createVariable("t", "i2", names, fill_value=-999, **packed)
        variable.setncatts({"units": "K", "scale_factor": 0.5, "add_offset": 273.0, "valid_min": np.int16(-5)})
        variable.set_auto_maskandscale(False)
        variable[:] = values
