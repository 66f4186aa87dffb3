"""Unstructured grids in other files than VTU: Exodus, and what meshio reads."""

from __future__ import annotations

import os
import re
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path

import meshio
import numpy as np
import pytest
from support.grid_files import linear, points_of
from support.mesh_files import delaunay, exodus, hexahedra
from support.refusal import refused
from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

from texvol import load, load_tetrahedra
from texvol.formats.readers import TimeSeries, time_steps

FILES = {
    "v.vtk": ("vtk", {"binary": False}),
    "binary.vtk": ("vtk", {"binary": True}),
    "old.vtk": ("vtk", {"binary": True, "fmt_version": "4.2"}),
    "v.msh": ("gmsh", {"binary": False, "fmt_version": "2.2"}),
    "binary.msh": ("gmsh", {"binary": True, "fmt_version": "2.2"}),
    "new.msh": ("gmsh", {"binary": True, "fmt_version": "4.1"}),
    "v.xdmf": ("xdmf", {"data_format": "XML"}),
    "hdf.xdmf": ("xdmf", {}),
    "v.med": ("med", {}),
    "v.e": ("exodus", {}),
    "v.vtu": ("vtu", {}),
}
ALL = pytest.mark.parametrize("name", FILES)


def written(path: Path, mesh: meshio.Mesh) -> Path:
    """A file by meshio's writer."""
    module, told = FILES[path.name]
    folder = os.getcwd()
    os.chdir(path.parent)  # XDMF names the file of its data as it is told
    try:
        with redirect_stderr(StringIO()):
            getattr(meshio, module).write(path.name, mesh, **told)
    finally:
        os.chdir(folder)
    if path.name == "v.msh":  # meshio 5.3 writes what numpy 2 calls its numbers
        path.write_bytes(re.sub(rb"np\.float64\(([^)]*)\)", rb"\1", path.read_bytes()))
    return path


@ALL
def test_a_linear_field_at_points(tmp_path: Path, name: str) -> None:
    """Hexahedra, and beside them a tetrahedron; where a file has one kind of cells alone, hexahedra."""
    points, cells = hexahedra((3, 2, 2), seed=1)
    blocks = [("hexahedron", cells)]
    volume = load(written(tmp_path / name, meshio.Mesh(points, blocks, point_data={"values": linear(points)})))
    assert volume.dimensions == (4, 3, 3)
    np.testing.assert_allclose(volume.values, linear(points_of(volume)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", [name for name in FILES if name not in ("v.e", "v.msh")])
def test_values_of_cells_in_several_blocks(tmp_path: Path, name: str) -> None:
    """Tetrahedra, then wedges, then a hexahedron; each has the x of its middle as value. Gmsh's writer takes one."""
    points, cells = hexahedra((3, 1, 1), seed=2)
    first, second, third = cells
    corners = [(0, 1, 3, 4), (1, 2, 3, 6), (4, 5, 6, 1), (4, 6, 7, 3), (1, 3, 4, 6)]
    blocks = [
        ("tetra", np.array([first[list(each)] for each in corners])),
        ("wedge", second[[[0, 1, 3, 4, 5, 7], [1, 2, 3, 5, 6, 7]]]),
        ("hexahedron", third[np.newaxis]),
    ]  # fmt: skip
    if "msh" in name:
        blocks = blocks[:1]
    values = [points[block].mean(axis=1)[:, 0] for _, block in blocks]
    mesh = meshio.Mesh(points, blocks, cell_data={"of_cells": values})
    grid = load_tetrahedra(written(tmp_path / name, mesh), variable="of_cells")
    middles = grid.points[grid.tetrahedra].mean(axis=1)[:, 0]
    block = np.minimum(middles.astype(int), 2)
    wanted = np.select([block == 0, block == 1], [middles, grid.values], 2.5)
    np.testing.assert_allclose(grid.values, wanted, rtol=0, atol=1e-12)
    if "msh" not in name:
        np.testing.assert_allclose(sorted(set(grid.values[block == 1].round(9))), [1.333333333, 1.666666667])
        assert grid.count == 5 + 2 * 3 + 6


def test_legacy_vtk_of_vtks_own_writer(tmp_path: Path) -> None:
    from support.mesh_files import TETRAHEDRON, unstructured

    points, cells = delaunay(20)
    writer = vtkUnstructuredGridWriter()
    writer.SetInputData(unstructured(points, [(TETRAHEDRON, cells)], linear(points)))
    for number in (0, 1):
        writer.SetFileType(number + 1)
        writer.SetFileName(str(tmp_path / f"{number}.vtk"))
        assert writer.Write()
        grid = load_tetrahedra(tmp_path / f"{number}.vtk")
        np.testing.assert_array_equal(grid.tetrahedra, cells)
        np.testing.assert_allclose(grid.values, linear(grid.points), rtol=0, atol=1e-5)  # six digits as text


def test_exodus_in_time(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = exodus(tmp_path / "v.exo")
    assert time_steps(path) == 2
    assert "has 2 time steps; choose one with --time 0..1" in refused(path, capfd)
    assert "--time must be in 0..1, got 2" in refused(path, capfd, time=2)
    for step in range(2):
        volume = load(path, time=step)
        np.testing.assert_allclose(volume.values, points_of(volume)[..., 0] + step, rtol=0, atol=1e-12)
    with TimeSeries(path) as series:
        np.testing.assert_array_equal(series.times, [0, 0.5])
        assert [each.values.max() for each in series] == [2, 3]


def test_exodus_values_of_some_blocks(tmp_path: Path) -> None:
    volume = load(exodus(tmp_path / "v.exo"), variable="stress", time=1, resolution=(8, 2, 2))
    np.testing.assert_array_equal(volume.values[0, 0], [np.nan] * 4 + [8.0] * 4)


def test_files_that_are_no_field_on_cells(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    points, cells = hexahedra((1, 1, 1))
    path = written(tmp_path / "v.vtk", meshio.Mesh(points, [("hexahedron", cells)]))
    assert "has no values at its points or in its cells" in refused(path, capfd)
    path = written(tmp_path / "v.vtk", meshio.Mesh(points, [("quad", cells[:, :4])], point_data={"a": points[:, 0]}))
    assert "has no cells with a volume, only quadrilaterals (1)" in refused(path, capfd)
    assert "has cells of type ODD8" in refused(exodus(tmp_path / "v.e", kind="ODD8"), capfd, time=0)
    path.write_text("# vtk DataFile Version 3.0\nv\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n0 0\n")
    assert "v.vtk: " in refused(path, capfd)
    (tmp_path / "v.msh").write_text("no mesh")
    assert "named Gmsh, but its content is text" in refused(tmp_path / "v.msh", capfd)
    (tmp_path / "v.xdmf").write_text('<!DOCTYPE x [<!ENTITY a "b">]><Xdmf Version="3.0">&a;</Xdmf>')
    refused(tmp_path / "v.xdmf", capfd)


def test_a_count_that_no_file_of_this_size_holds_takes_no_memory(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "v.vtk"
    for form in ("ASCII", "BINARY"):
        path.write_text(
            f"# vtk DataFile Version 3.0\nv\n{form}\nDATASET UNSTRUCTURED_GRID\nPOINTS 99999999 double\n0 0 0\n"
        )
        refused(path, capfd)


def test_a_crash_or_exit_of_the_library_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    points, cells = hexahedra((1, 1, 1))
    path = written(tmp_path / "v.vtk", meshio.Mesh(points, [("hexahedron", cells)], point_data={"a": points[:, 0]}))
    for fault, reason in ((os.abort, "reading it crashes the library (signal SIGABRT)"), (exit, "cannot be read")):
        monkeypatch.setattr("meshio.vtk.read", lambda _, fault=fault: fault())
        assert reason in refused(path, capfd)
