"""Dividing cubes: points of crossed parts of cells, as VTK finds them, on any grid and in files of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.surfaces import GRIDS, ball, in_cube, on_grid

from texvol import InputError, Volume
from texvol.geometry import Points, load_mesh, save_mesh, surface_of

READERS = {".ply": "vtkPLYReader", ".vtp": "vtkXMLPolyDataReader"}


def by_vtk(volume: Volume, value: float, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of vtkRecursiveDividingCubes, each once."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersGeneral import vtkRecursiveDividingCubes

    image = vtkImageData()
    image.SetDimensions(*volume.dimensions)
    image.SetSpacing(*volume.spacing)
    image.SetOrigin(*volume.origin)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.values.reshape(-1)))
    cubes = vtkRecursiveDividingCubes()
    cubes.SetInputData(image)
    cubes.SetValue(value)
    cubes.SetDistance(distance)
    cubes.Update()
    found = cubes.GetOutput()
    points = vtk_to_numpy(found.GetPoints().GetData()).astype(np.float64)
    _, firsts = np.unique(points.round(6), axis=0, return_index=True)
    return points[firsts], vtk_to_numpy(found.GetPointData().GetNormals())[firsts]


@pytest.mark.parametrize("parts", [1, 2, 4])
def test_points_and_normals_are_those_of_vtk(parts: int) -> None:
    volume = in_cube(ball(0.7), 14)
    size = volume.smallest_spacing / parts
    found = surface_of(volume, 0.0, "dividing-cubes", cell_size=size)
    # VTK's parts are shorter than its distance, ours at most as long.
    points, normals = by_vtk(volume, 0.0, 1.001 * size)
    order = np.lexsort(found.points.round(6).T[::-1])
    np.testing.assert_allclose(found.points[order], points, atol=1e-6)
    np.testing.assert_allclose(found.normals[order], normals, atol=1e-6)


def test_points_come_closer_in_order_1() -> None:
    volume = in_cube(ball(0.7), 32)
    distances = []
    for parts in (1, 3):
        found = surface_of(volume, 0.0, "dividing-cubes", cell_size=volume.smallest_spacing / parts)
        off = np.linalg.norm(found.points - [0.013, 0.021, -0.017], axis=1) - 0.7
        # Half a diagonal, and what a cell's trilinear field is off the sphere, h² / 8 R in each direction.
        bound = np.sqrt(3) / 2 * volume.smallest_spacing / parts + 3 * volume.smallest_spacing**2 / 8 / 0.7
        assert np.abs(off).max() < bound
        distances.append(np.sqrt(np.mean(off**2)))
    assert 0.9 < np.log(distances[0] / distances[1]) / np.log(3) < 1.1


@pytest.mark.parametrize("grid", GRIDS)
def test_normals_point_to_lower_values_on_any_grid(grid: str) -> None:
    volume = on_grid(ball(7.0), GRIDS[grid])
    found = surface_of(volume, 0.0, "dividing-cubes")
    outward = (found.points - volume.centre) / np.linalg.norm(found.points - volume.centre, axis=1, keepdims=True)
    assert (found.normals * outward).sum(axis=1).min() > 0.99
    # Half the smallest spacing, 0.4, divides 1, 0.8 and 1.2 into 3, 2 and 3: half a diagonal of a part.
    reach = np.abs(volume.world_from_index / [3, 2, 3]).sum() / 2
    assert np.abs(np.linalg.norm(found.points - volume.centre, axis=1) - 7).max() < reach + 0.05


def test_a_plane_has_a_point_for_each_part() -> None:
    """Parts of 1/4: 16 to a cell's face, 4 and 8 where the cells at the box are half and a quarter of one."""
    values = np.broadcast_to(np.arange(12.0), (5, 6, 12))
    found = surface_of(Volume(values), 4.3, "dividing-cubes", cell_size=0.25)
    assert len(found.points) == 6 * 7 * 16
    np.testing.assert_allclose(found.points[:, 0], 4.375)
    np.testing.assert_allclose(found.normals, np.broadcast_to([-1.0, 0, 0], found.normals.shape), atol=1e-12)
    assert (found.points[:, 1:].min(axis=0) > -0.5).all() and (found.points[:, 1:].max(axis=0) < [5.5, 4.5]).all()


def test_cells_beside_missing_samples_have_no_points() -> None:
    values = np.broadcast_to(np.arange(12.0), (8, 9, 12)).copy()
    values[4, 3, 6] = np.nan
    found = surface_of(Volume(values), 5.5, "dividing-cubes")
    assert not ((np.abs(found.points[:, 1] - 3) < 1) & (np.abs(found.points[:, 2] - 4) < 1)).any()
    assert np.isfinite(found.normals).all()


@pytest.mark.parametrize("kind", [".ply", ".vtp", ".obj"])
def test_files_of_points_are_read_by_others(kind: str, tmp_path: Path) -> None:
    found = surface_of(in_cube(ball(0.7), 8), 0.0, "dividing-cubes")
    path = tmp_path / f"points{kind}"
    save_mesh(found, path)
    if kind == ".obj":
        rows = {word: [] for word in ("v", "vn", "p")}  # type: ignore[var-annotated]
        for line in path.read_text().splitlines():
            word, *numbers = line.split()
            rows[word].append([float(number) for number in numbers])
        points, normals = rows["v"], rows["vn"]
        assert rows["p"] == [[number] for number in range(1, len(found.points) + 1)]
    else:
        from vtkmodules import vtkIOPLY, vtkIOXML
        from vtkmodules.util.numpy_support import vtk_to_numpy

        reader = getattr(vtkIOPLY if kind == ".ply" else vtkIOXML, READERS[kind])()
        reader.SetFileName(str(path))
        reader.Update()
        output = reader.GetOutput()
        points, normals = (
            vtk_to_numpy(each) for each in (output.GetPoints().GetData(), output.GetPointData().GetNormals())
        )
    np.testing.assert_allclose(points, found.points, atol=1e-7 if kind == ".ply" else 0)
    np.testing.assert_allclose(normals, found.normals, atol=1e-7 if kind == ".ply" else 0)
    with pytest.raises(InputError, match="no triangles|no polygons"):
        load_mesh(path)


def test_points_are_not_written_as_stl(tmp_path: Path) -> None:
    points = Points(np.zeros((1, 3)), np.zeros((1, 3)))
    with pytest.raises(InputError, match=r"points.stl: STL holds triangles only; points need .ply, .obj or .vtp"):
        save_mesh(points, tmp_path / "points.stl")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("points", "normals", "words"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), r"points must have shape \(n, 3\), got \(0, 3\)"),
        (np.zeros((2, 3)), np.zeros((1, 3)), "normals must be as many as points, 2, got 1"),
        (np.zeros((2, 2)), np.zeros((2, 3)), r"points must have shape \(n, 3\), got \(2, 2\)"),
        (np.full((2, 3), np.nan), np.zeros((2, 3)), "points must be finite"),
    ],
)
def test_points_are_checked(points: np.ndarray, normals: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Points(points, normals)


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan, np.inf, "1"])
def test_a_size_that_is_none_is_refused(size: float) -> None:
    with pytest.raises(InputError, match="^cell_size must be a finite number above 0, got"):
        surface_of(in_cube(ball(0.7), 8), 0.0, "dividing-cubes", cell_size=size)


def test_too_many_parts_are_refused() -> None:
    for size in (1e-300, 1e-9, 0.25 / 256):
        with pytest.raises(
            InputError, match="^cell_size must make at most 1.68e.07 parts of a cell and 1.07e.09 in all, "
        ):
            surface_of(in_cube(ball(0.7), 8), 0.0, "dividing-cubes", cell_size=size)
