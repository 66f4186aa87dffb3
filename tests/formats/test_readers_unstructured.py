"""VTU files: a linear field comes out as itself, whatever the cells, their numbering and the file's encoding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from support.grid_files import PACKERS, linear, points_of, smooth
from support.mesh_files import (
    HEXAHEDRON,
    PYRAMID,
    TETRAHEDRON,
    VOXEL,
    WEDGE,
    delaunay,
    hexahedra,
    unstructured,
    written,
)
from support.refusal import refused
from vtkmodules.util.numpy_support import numpy_to_vtk

from texvol import InputError, load, load_tetrahedra
from texvol.cli import information

# Of the values, which are of size 10: rounding of float64 in a hundred operations.
_ROUNDING = 1e-12


def check_linear(path: Path, atol: float = _ROUNDING, **options: object) -> None:
    """The file holds the field `linear` and fills its box."""
    volume = load(path, **options)
    assert np.isfinite(volume.values).all()
    np.testing.assert_allclose(volume.values, linear(points_of(volume)), rtol=0, atol=atol)
    assert volume.resampling["max_error"] < atol
    assert volume.resampling["outside"] == volume.resampling["lost"] == 0


@pytest.mark.parametrize("packer", PACKERS)
@pytest.mark.parametrize(("mode", "base64"), [("ascii", 1), ("binary", 1), ("appended", 1), ("appended", 0)])
@pytest.mark.parametrize("little", [0, 1])
def test_every_form_that_vtk_writes(tmp_path: Path, mode: str, base64: int, packer: str, little: int) -> None:
    points, cells = delaunay(30)
    grid = unstructured(points, [(TETRAHEDRON, cells)], linear(points))
    path = written(tmp_path / "v.vtu", grid, mode, packer, base64=base64, little=little)
    # VTK writes 11 digits of a float64 as text.
    check_linear(path, atol=1e-9 if mode == "ascii" else _ROUNDING)


@pytest.mark.parametrize("scale", [[1, 1, 1], [1e-6, 1, 1e6]])
@pytest.mark.parametrize("away", [0.0, 1e4])
def test_a_linear_field_on_tetrahedra(tmp_path: Path, scale: list[float], away: float) -> None:
    """In axes of different units, and far from the origin, where a coordinate has 1e-12 of the cube's edge."""
    points, cells = delaunay(200)
    grid = unstructured(points * scale + away * np.array(scale), [(TETRAHEDRON, cells)], linear(points))
    volume = load(written(tmp_path / "v.vtu", grid))
    wanted = linear(points_of(volume) / scale - away)
    np.testing.assert_allclose(volume.values, wanted, rtol=0, atol=1e-9 if away else _ROUNDING)


def test_float32_points_and_values(tmp_path: Path) -> None:
    """To the rounding of float32, 4 times half an ulp of values up to 5; samples are float32."""
    points, cells = delaunay(100)
    rounded = points.astype("f4")
    grid = unstructured(rounded, [(TETRAHEDRON, cells)], linear(rounded.astype("f8")).astype("f4"))
    volume = load(written(tmp_path / "v.vtu", grid))
    assert volume.values.dtype == np.float32
    np.testing.assert_allclose(volume.values, linear(points_of(volume)), rtol=0, atol=4 * 2.0**-22)


_KINDS = {
    HEXAHEDRON: range(8),
    VOXEL: [0, 1, 3, 2, 4, 5, 7, 6],
}


@pytest.mark.parametrize("kind", _KINDS)
def test_a_linear_field_on_hexahedra(tmp_path: Path, kind: int) -> None:
    points, cells = hexahedra((3, 4, 2), seed=2)
    grid = unstructured(points, [(kind, cells[:, _KINDS[kind]])], linear(points))
    check_linear(written(tmp_path / "v.vtu", grid))
    check_linear(tmp_path / "v.vtu", resolution=(11, 8, 9))


def test_a_linear_field_on_wedges_and_pyramids(tmp_path: Path) -> None:
    """A cube of two wedges beside a cube of six pyramids."""
    points, cells = hexahedra((2, 1, 1), seed=3)
    first, second = cells
    wedges = first[[[0, 1, 3, 4, 5, 7], [1, 2, 3, 5, 6, 7]]]
    middle = len(points)
    points = np.concatenate([points, points[second].mean(axis=0, keepdims=True)])
    faces = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    pyramids = np.array([[*second[list(face)], middle] for face in faces])
    path = written(tmp_path / "v.vtu", unstructured(points, [(WEDGE, wedges), (PYRAMID, pyramids)], linear(points)))
    check_linear(path)
    check_linear(path, resolution=(13, 7, 8))
    assert any("2 wedges, 6 pyramids" in note for note in load(path).notes)


def test_warped_hexahedra_leave_no_gap(tmp_path: Path) -> None:
    """Faces are not plane, so neighbours that cut them differently would leave gaps between them."""
    points, cells = hexahedra((5, 5, 5), seed=4)
    inside = ((points > 0) & (points < 5)).all(axis=1)
    points[inside] += np.random.default_rng(1).uniform(-0.25, 0.25, (int(inside.sum()), 3))
    check_linear(written(tmp_path / "v.vtu", unstructured(points, [(HEXAHEDRON, cells)], linear(points))))
    check_linear(tmp_path / "v.vtu", resolution=(61, 62, 63))


def test_values_of_cells_are_constant_in_each(tmp_path: Path) -> None:
    points, cells = hexahedra((4, 3, 2), seed=6)
    values = np.arange(24, dtype="i2")
    path = written(tmp_path / "v.vtu", unstructured(points, [(HEXAHEDRON, cells)], of_cells=values))
    volume = load(path, resolution=(40, 30, 20))
    x, y, z = np.moveaxis(points_of(volume), -1, 0)
    wanted = np.floor(x) + 4 * np.floor(y) + 12 * np.floor(z)
    between = (np.abs(points_of(volume) % 1 - 0.5) < 0.49).all(axis=-1)
    np.testing.assert_array_equal(volume.values[between], wanted[between])
    labels = load(path, resolution=(40, 30, 20), labels=True)
    assert labels.values.dtype == np.int16
    np.testing.assert_array_equal(labels.values[between], wanted[between])
    assert labels.resampling["compared"] == 24 * 6


@pytest.mark.parametrize("last", [[0, 0, 1.0], [0, 1, 1.0]])
def test_points_outside_are_missing(tmp_path: Path, last: list[float]) -> None:
    """The tetrahedron fills a sixth of its box; one of its faces may be along x, and slanted."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], last])
    path = written(tmp_path / "v.vtu", unstructured(points, [(TETRAHEDRON, np.arange(4)[np.newaxis])], linear(points)))
    volume = load(path, resolution=(33, 33, 33))
    x, y, z = np.moveaxis(points_of(volume), -1, 0)
    inside = x + y + z <= 1 if last[1] == 0 else (z <= y) & (x + y <= 1)
    np.testing.assert_array_equal(np.isfinite(volume.values), inside)
    np.testing.assert_allclose(volume.values[inside], linear(points_of(volume))[inside], rtol=0, atol=_ROUNDING)
    assert volume.resampling["outside"] == (~inside).sum()


def test_inverted_and_flat_tetrahedra(tmp_path: Path) -> None:
    points, cells = delaunay(60)
    random = np.random.default_rng(2)
    turned = random.permuted(cells, axis=1)
    flat = np.array([[0, 0, 1, 2], [len(points), len(points) + 1, len(points) + 2, len(points) + 3]])
    plane = np.array([[0.1, 0.2, 0.5], [0.7, 0.2, 0.5], [0.4, 0.9, 0.5], [0.6, 0.6, 0.5]])
    every = np.concatenate([points, plane])
    path = written(
        tmp_path / "v.vtu", unstructured(every, [(TETRAHEDRON, np.concatenate([turned, flat]))], linear(every))
    )
    check_linear(path)
    assert load(path).resampling["flat_cells"] == 2
    assert "2 cells of the source have no volume" in information.text(information.metadata(load(path)))


def test_the_error_is_the_one_at_points_and_middles(tmp_path: Path) -> None:
    """Against scipy's interpolation of the samples, which all are inside."""
    points, cells = delaunay(60)
    values, points = smooth(3 * points), points + 5
    path = written(tmp_path / "v.vtu", unstructured(points, [(TETRAHEDRON, cells)], values))
    volume = load(path, resolution=(17, 18, 19))
    where = np.concatenate([points, points[cells].mean(axis=1)])
    own = np.concatenate([values, values[cells].mean(axis=1)])
    grid = tuple(np.arange(size) for size in volume.values.shape)
    drawn = RegularGridInterpolator(grid, volume.values)(((where - volume.origin) / volume.spacing)[:, ::-1])
    metadata = volume.resampling
    assert metadata["compared"] == len(where)
    assert metadata["max_error"] == pytest.approx(np.abs(drawn - own).max(), rel=1e-9)
    assert metadata["rms_error"] == pytest.approx(np.sqrt(((drawn - own) ** 2).mean()), rel=1e-9)
    assert metadata["rms_error"] > 0.01  # of a field of range 3: the grid is coarse
    assert load(path, resolution=(129,) * 3).resampling["rms_error"] < metadata["rms_error"] / 2


def test_a_border_inside_of_the_box_is_sampled_finely(tmp_path: Path) -> None:
    """Two hexahedra that fill their box need three samples along it; without one of their corners, 65 or more."""
    points, cells = hexahedra((2, 1, 1))
    path = written(tmp_path / "v.vtu", unstructured(points, [(HEXAHEDRON, cells)], linear(points)))
    assert load(path).dimensions == (3, 2, 2)
    points[(points == (2, 1, 1)).all(axis=1)] = (1.9, 0.9, 0.9)
    volume = load(written(path, unstructured(points, [(HEXAHEDRON, cells)], linear(points))))
    assert min(volume.dimensions) == 65
    assert max(volume.dimensions) < 2 * 65
    found = np.isfinite(volume.values)
    np.testing.assert_allclose(volume.values[found], linear(points_of(volume))[found], rtol=0, atol=_ROUNDING)
    assert 0.8 < found.mean() < 1


def test_the_page_of_info_says_what_was_lost(tmp_path: Path) -> None:
    points, cells = hexahedra((3, 3, 3))
    path = written(tmp_path / "v.vtu", unstructured(points, [(HEXAHEDRON, cells)], smooth(points)))
    volume = load(path, resolution=(6, 7, 8))
    page = information.text(information.metadata(volume))
    assert "from an unstructured grid of 64 points and 162 tetrahedra to a regular one of 6 x 7 x 8" in page
    assert "error at its points and the middles of its tetrahedra: max " in page
    assert volume.resampling["compared"] == 64 + 162
    assert "split into tetrahedra: 27 hexahedra" in page


def test_cells_without_volume_are_left_out_with_a_note(tmp_path: Path) -> None:
    points, cells = delaunay(10)
    kinds = [(5, cells[:2, :3]), (TETRAHEDRON, cells), (3, cells[:1, :2])]
    path = written(tmp_path / "v.vtu", unstructured(points, kinds, linear(points)))
    check_linear(path)
    assert "left out, without a volume: lines (1), triangles (2)" in load(path).notes


def test_values_of_cells_stay_with_them_where_others_are_left_out(tmp_path: Path) -> None:
    points, cells = hexahedra((2, 1, 1))
    kinds = [(5, cells[:1, :3]), (HEXAHEDRON, cells[:1]), (3, cells[:1, :2]), (HEXAHEDRON, cells[1:])]
    path = written(tmp_path / "v.vtu", unstructured(points, kinds, of_cells=np.array([9.0, 1, 9, 2])))
    volume = load(path, resolution=(4, 2, 2))
    np.testing.assert_array_equal(volume.values[0, 0], [1, 1, 2, 2])


def test_quadratic_tetrahedra_are_taken_by_their_corners(tmp_path: Path) -> None:
    points, cells = delaunay(10)
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    middles = [(points[cells[:, a]] + points[cells[:, b]]) / 2 for a, b in edges]
    numbers = np.arange(len(cells) * 6).reshape(6, len(cells)).T + len(points)
    every = np.concatenate([points, *middles])
    path = written(
        tmp_path / "v.vtu", unstructured(every, [(24, np.concatenate([cells, numbers], axis=1))], linear(every))
    )
    check_linear(path)
    assert f"{len(cells)} cells of higher order are taken by their corners, straight and linear" in load(path).notes


def test_missing_values_show_nothing(tmp_path: Path) -> None:
    points, cells = hexahedra((3, 1, 1))
    values = linear(points)
    values[points[:, 0] == 3] = -999
    path = written(tmp_path / "v.vtu", unstructured(points, [(HEXAHEDRON, cells)], values))
    volume = load(path, resolution=(13, 3, 3), missing=-999)
    np.testing.assert_array_equal(np.isfinite(volume.values[1, 1]), np.arange(13) <= 8)
    assert any("6 of 18 tetrahedra have missing values" in note for note in volume.notes)


def test_components_are_chosen_and_arrays_too(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    points, cells = delaunay(10)
    grid = unstructured(points, [(TETRAHEDRON, cells)], linear(points), of_cells=np.arange(float(len(cells))))
    path = written(tmp_path / "v.vtu", grid)
    assert load(path, variable="of_cells").values.max() == len(cells) - 1
    assert "has no array none (--variable); it has values, of_cells" in refused(path, capfd, variable="none")
    vector = np.stack([linear(points), -points[:, 0], points[:, 1]], axis=1)
    path = written(tmp_path / "w.vtu", unstructured(points, [(TETRAHEDRON, cells)], vector))
    assert "its array values has 3 components for each point; choose one with --channel 0..2" in refused(path, capfd)
    check_linear(path, channel=0)
    assert "--channel must be in 0..2, got 3" in refused(path, capfd, channel=3)
    assert "--time 2: the file has one time step" in refused(path, capfd, channel=1, time=2)
    assert "--labels must be whole numbers" in refused(path, capfd, channel=0, labels=True)
    assert "--resolution must be at least 2" in refused(path, capfd, channel=0, resolution=(1, 2, 3))


def test_pieces_meet_without_a_gap(tmp_path: Path) -> None:
    """Two pieces with points of their own at the common face, which is not plane."""
    points, cells = hexahedra((2, 1, 1))
    points[np.flatnonzero((points == (1, 1, 1)).all(axis=1))] = (1.2, 1, 1)
    texts = []
    for number in range(2):
        own = written(tmp_path / f"{number}.vtu", unstructured(
            points[cells[number]][::(-1) ** number], [(HEXAHEDRON, np.arange(8)[np.newaxis, ::(-1) ** number])],
            linear(points[cells[number]][::(-1) ** number]),
        ), "ascii").read_text()  # fmt: skip
        texts.append((own[: own.index("<Piece")], own[own.index("<Piece") : own.index("</UnstructuredGrid>")]))
    (tmp_path / "v.vtu").write_text(texts[0][0] + texts[0][1] + texts[1][1] + "</UnstructuredGrid></VTKFile>")
    check_linear(tmp_path / "v.vtu", atol=1e-9, resolution=(41, 21, 21))
    assert load_tetrahedra(tmp_path / "v.vtu").count == 12


def test_parts_of_a_parallel_file(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Hexahedra in three parts along rough borders, each with points of its own and copies of cells of others."""
    points, cells = hexahedra((4, 4, 4), seed=7)
    inside = ((points > 0) & (points < 4)).all(axis=1)
    points[inside] += np.random.default_rng(2).uniform(-0.2, 0.2, (int(inside.sum()), 3))
    order = np.random.default_rng(3).permutation(len(cells))
    for part in range(3):
        own = np.concatenate([cells[order[part::3]], cells[order[(part + 1) % 3 :: 3]][:5]])
        used, numbers = np.unique(own, return_inverse=True)
        copies = np.arange(len(own)) >= len(own) - 5
        # Copies have another value, which must not be seen.
        grid = unstructured(
            points[used], [(HEXAHEDRON, numbers.reshape(-1, 8))], linear(points[used]), np.where(copies, 99.0, 1.0)
        )
        ghosts = numpy_to_vtk(copies.astype(np.uint8), deep=True)
        ghosts.SetName("vtkGhostType")
        grid.GetCellData().AddArray(ghosts)
        written(tmp_path / f"v_{part}.vtu", grid)
    parts = "".join(f'<Piece Source="v_{part}.vtu"/>' for part in range(3))
    text = f'<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid GhostLevel="1">{parts}</PUnstructuredGrid></VTKFile>'
    (tmp_path / "v.pvtu").write_text(text)
    check_linear(tmp_path / "v.pvtu", resolution=(41, 42, 43))
    assert load_tetrahedra(tmp_path / "v.pvtu").count == 64 * 6
    assert (load(tmp_path / "v.pvtu", variable="of_cells").values == 1).all()
    (tmp_path / "v_1.vtu").unlink()
    assert "its part 'v_1.vtu' is no file" in refused(tmp_path / "v.pvtu", capfd)
    (tmp_path / "v_1.vtu").write_text(text)
    assert "must be VTK XML of type UnstructuredGrid, got PUnstructuredGrid" in refused(tmp_path / "v.pvtu", capfd)


def test_no_volume_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    points, cells = delaunay(10)
    path = written(tmp_path / "v.vtu", unstructured(points, [(5, cells[:, :3])], linear(points)))
    assert "has no cells with a volume, only triangles" in refused(path, capfd)
    flat = points * [1, 1, 0]
    path = written(tmp_path / "v.vtu", unstructured(flat, [(TETRAHEDRON, cells)], linear(points)))
    assert "its cells must have a volume" in refused(path, capfd)
    path = written(tmp_path / "v.vtu", unstructured(points, [(TETRAHEDRON, cells)]))
    assert "has no values at its points or in its cells" in refused(path, capfd)
    path = written(tmp_path / "v.vtu", unstructured(points, [(16, np.arange(12)[np.newaxis])], linear(points)))
    assert "has hexagonal prisms (VTK's type 16), which texvol does not read" in refused(path, capfd)
    points[3] = np.nan
    path = written(tmp_path / "v.vtu", unstructured(points, [(TETRAHEDRON, cells)], linear(points)))
    assert "its point 3 is not finite" in refused(path, capfd)


_TEXT = """<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells>
<PointData><DataArray type="Float32" Name="a" format="ascii">1 2 3 4</DataArray></PointData>
</Piece></UnstructuredGrid></VTKFile>"""


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (">0 1 2 3<", ">0 1 2 4<", "a cell must have corners 0 to 3, got 4"),
        (">0 1 2 3<", ">0 1 2 -1<", "a cell must have corners 0 to 3, got -1"),
        (">0 1 2 3<", ">0 1 2<", "holds 3 numbers"),
        (">4<", ">3<", "holds 4 numbers"),
        (">4<", ">-4<", "must not decrease, got -4"),
        (">10<", ">12<", "its cell 0 is a hexahedron and must have 8 corners, got 4"),
        (">10<", ">42<", "has polyhedra (VTK's type 42)"),
        (">10<", ">99<", "has cells of another kind (VTK's type 99)"),
        ('"4" NumberOfCells="1"', '"99999999999999" NumberOfCells="1"', "this machine has"),
        ('"4" NumberOfCells="1"', '"4" NumberOfCells="-1"', "NumberOfCells of a piece must be a whole number"),
        ('"4" NumberOfCells="1"', '"4" NumberOfCells="0"', "has no Piece with points and cells"),
        ('Name="types"', 'Name="kinds"', "the cells of a piece have no types"),
        ('"Int32" Name="offsets"', '"Float32" Name="offsets"', "must be whole numbers, got Float32"),
        (">0 0 0 1 0 0 ", ">nan 0 0 1 0 0 ", "its point 0 is not finite"),
        (">0 0 0 1 0 0 ", ">1e38 0 0 1 0 0 ", ""),
        (">1 2 3 4<", ">1 2 3<", "holds 3 numbers"),
        ("Points>", "Spots>", "a piece of it has no points"),
    ],
)
def test_files_that_contradict_themselves_are_refused(
    tmp_path: Path, old: str, new: str, reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "v.vtu"
    path.write_text(_TEXT)
    assert load(path, resolution=(3, 3, 3)).values[0, 0, 1] == 1.5
    path.write_text(_TEXT.replace(old, new))
    if reason:
        assert reason in refused(path, capfd)
    else:
        assert load(path).values[0, 0, 0] == pytest.approx(2)


def test_tetrahedra_are_those_of_the_file(tmp_path: Path) -> None:
    points, cells = delaunay(20)
    path = written(tmp_path / "v.vtu", unstructured(points, [(TETRAHEDRON, cells)], linear(points)))
    grid = load_tetrahedra(path)
    np.testing.assert_array_equal(grid.tetrahedra, cells)
    np.testing.assert_array_equal(grid.points, points)
    np.testing.assert_array_equal(grid.values, linear(points))
    np.save(tmp_path / "v.npy", np.zeros((3, 3, 3)))
    with pytest.raises(InputError, match=r"is NPY: tetrahedra are read from VTU, Exodus"):
        load_tetrahedra(tmp_path / "v.npy")
