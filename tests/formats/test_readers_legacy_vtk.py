"""Legacy VTK of structured grids, as VTK's own writers write it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import marked
from support.grid_files import linear, points_of, points_of_axes, rectilinear, structured, warped
from support.refusal import refused
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkDataSet, vtkImageData
from vtkmodules.vtkIOLegacy import vtkDataSetWriter

from texvol import load, load_tetrahedra

AXES = ([0.0, 1.0, 2.5, 3.0, 5.0], [0.0, 2.0, 3.0, 4.0], [1.0, 2.0, 5.0])
HEAD = (
    "# vtk DataFile Version 3.0\nv\n\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 1\nORIGIN 0 0 0\nSPACING 1 1 1\n"
)


def image(dtype: str, *, cells: bool = False) -> vtkImageData:
    grid = vtkImageData()
    grid.SetDimensions(*(size + cells for size in marked.DIMENSIONS))
    grid.SetSpacing(*marked.SPACING)
    grid.SetOrigin(*marked.ORIGIN)
    _add(grid, marked.marked(dtype), "marked", cells)
    return grid


def _add(grid: vtkDataSet, values: Any, name: str, cells: bool = False, components: int = 1) -> None:
    array = numpy_to_vtk(np.ascontiguousarray(values).reshape(-1, components), deep=True)
    array.SetName(name)
    data = grid.GetCellData() if cells else grid.GetPointData()
    data.AddArray(array) if data.GetScalars() else data.SetScalars(array)


def written(grid: vtkDataSet, path: Path, *, text: bool, version: int = 42) -> Path:
    writer = vtkDataSetWriter()
    writer.SetInputData(grid)
    writer.SetFileName(str(path))
    writer.SetFileVersion(version)
    writer.SetFileTypeToASCII() if text else writer.SetFileTypeToBinary()
    assert writer.Write()
    return path


@pytest.mark.parametrize("text", [True, False])
@pytest.mark.parametrize("dtype", ["u1", "i2", "i4", "i8", "f4", "f8"])
@pytest.mark.parametrize("version", [42, 51])
def test_structured_points(tmp_path: Path, dtype: str, text: bool, version: int) -> None:
    grid = image(dtype)
    _add(grid, np.arange(120), "vectors", components=2)
    volume = load(written(grid, tmp_path / "v.vtk", text=text, version=version))
    np.testing.assert_array_equal(volume.values, marked.marked(dtype))
    assert volume.dtype == np.dtype(dtype)
    np.testing.assert_allclose(marked.found_mark(volume), marked.position_of_mark(direction=np.eye(3)))
    assert volume.notes == ("array marked; others: vectors",)
    second = load(tmp_path / "v.vtk", variable="vectors", channel=1)
    np.testing.assert_array_equal(second.values.reshape(-1), np.arange(1, 120, 2))


def test_samples_in_cells(tmp_path: Path) -> None:
    volume = load(written(image("f4", cells=True), tmp_path / "v.vtk", text=False))
    np.testing.assert_array_equal(volume.values, marked.marked("f4"))
    np.testing.assert_allclose(volume.origin, np.add(marked.ORIGIN, np.divide(marked.SPACING, 2)))


@pytest.mark.parametrize("text", [True, False])
def test_grids_that_are_not_regular(tmp_path: Path, text: bool) -> None:
    straight = rectilinear(AXES, linear(points_of_axes(AXES)))
    points = warped((6, 5, 4))
    for grid in (straight, structured(points, linear(points))):
        volume = load(written(grid, tmp_path / "v.vtk", text=text))
        known = np.isfinite(volume.values)
        assert known.any() and volume.resampling is not None
        np.testing.assert_allclose(volume.values[known], linear(points_of(volume))[known], atol=1e-4)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (HEAD, "no values"),
        (HEAD + "POINT_DATA 4\nSCALARS a float\nLOOKUP_TABLE default\n1 2 3\n", "is truncated"),
        (HEAD + "POINT_DATA 4\nSCALARS a unsigned_char\nLOOKUP_TABLE default\n1 2 3 300\n", "uint8 cannot hold"),
        (HEAD + "POINT_DATA 4\nSCALARS a float\nLOOKUP_TABLE default\n1 2 x 4\n", "truncated or corrupt"),
        (HEAD + "POINT_DATA 3\nSCALARS a float\nLOOKUP_TABLE default\n1 2 3\n", "the dimensions need 4"),
        (HEAD + "POINT_DATA 4\nSCALARS a complex\n1 2 3 4\n", "type 'complex'"),
        (HEAD + "POINT_DATA 4\nFIELD f 1\na 1 4 string\n1\n2\n3\n4\n", "array of text, a"),
        (HEAD.replace("2 2 1", "2 2 0") + "POINT_DATA 4\n", "every dimension must be positive"),
        (HEAD + "POINT_DATA 4\nSPHERES 3\n", "keyword that texvol does not know: 'SPHERES'"),
        (HEAD.replace("STRUCTURED_POINTS", "STRUCTURED_GRID") + "POINT_DATA 4\nSCALARS a int\n1 2 3 4", "its POINTS"),
        (HEAD.replace("STRUCTURED_POINTS", "POLYDATA"), "is legacy VTK of POLYDATA, of which texvol reads UNSTR"),
    ],
)
def test_what_makes_no_sense(tmp_path: Path, capfd: pytest.CaptureFixture[str], text: str, reason: str) -> None:
    (tmp_path / "v.vtk").write_text(text)
    assert reason in refused(tmp_path / "v.vtk", capfd)


def test_a_grid_has_no_tetrahedra(tmp_path: Path) -> None:
    path = written(image("f4"), tmp_path / "v.vtk", text=True)
    with pytest.raises(ValueError, match="is legacy VTK of STRUCTURED_POINTS, whose samples are on a grid"):
        load_tetrahedra(path)
