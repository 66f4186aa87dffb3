"""Mesh files: what is written is read again, other programs' files too, and bad ones are refused in one line."""

from __future__ import annotations

import os
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from support.shapes import ball
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader, vtkSTLWriter
from vtkmodules.vtkIOPLY import vtkPLYReader, vtkPLYWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

from texvol import InputError, TexvolError
from texvol.geometry import Mesh, load_mesh, save_mesh

ENDINGS = ("ply", "stl", "obj", "vtp")
each_ending = pytest.mark.parametrize("ending", ENDINGS)
VERTICES, FACES = ball(30)
BALL = Mesh(3 * VERTICES + (10, -20, 5), FACES, normals=VERTICES)
# Of coordinates up to 23: PLY and STL hold float32.
ROUNDING = {"ply": 23 * 2.0**-24, "stl": 23 * 2.0**-24, "obj": 1e-14, "vtp": 0.0}


def corners(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[mesh.triangles]


def refused(path: Path, capfd: pytest.CaptureFixture[str]) -> str:
    """The one line that reading a file ends with."""
    with pytest.raises(TexvolError) as error:
        load_mesh(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and message.count(path.name) == 1
    assert capfd.readouterr().err == ""
    return message


@each_ending
@pytest.mark.parametrize("smooth", [False, True])
def test_what_is_written_is_read(tmp_path: Path, ending: str, smooth: bool) -> None:
    mesh = BALL if smooth else Mesh(BALL.vertices, BALL.triangles)
    path = tmp_path / f"ball.{ending.upper()}"
    save_mesh(mesh, path)
    read = load_mesh(path, color=(0.1, 0.2, 0.3), opacity=0.5, lit=False)
    assert (read.name, read.color, read.opacity, read.lit) == (str(path), (0.1, 0.2, 0.3), 0.5, False)
    np.testing.assert_allclose(corners(read), corners(mesh), rtol=0, atol=ROUNDING[ending])
    assert (read.normals is not None) == (smooth and ending != "stl")
    if read.normals is not None:
        normals = VERTICES[mesh.triangles]
        np.testing.assert_allclose(read.normals[read.triangles], normals, atol=1e-7)
    assert sorted(os.listdir(tmp_path)) == [path.name], "nothing is left beside it"


@pytest.mark.parametrize("scale", [1e-9, 1e9])
@each_ending
def test_meshes_of_any_size_keep_their_digits(tmp_path: Path, ending: str, scale: float) -> None:
    mesh = Mesh(scale * BALL.vertices, FACES)
    save_mesh(mesh, tmp_path / f"m.{ending}")
    read = load_mesh(tmp_path / f"m.{ending}")
    np.testing.assert_allclose(corners(read), corners(mesh), rtol=0, atol=scale * max(ROUNDING[ending], 1e-13))


@pytest.mark.parametrize(
    ("ending", "reader"),
    [("ply", vtkPLYReader), ("stl", vtkSTLReader), ("obj", vtkOBJReader), ("vtp", vtkXMLPolyDataReader)],
)
def test_another_program_reads_what_is_written(tmp_path: Path, ending: str, reader: Any) -> None:
    save_mesh(BALL, tmp_path / f"m.{ending}")
    reading = reader()
    reading.SetFileName(str(tmp_path / f"m.{ending}"))
    reading.Update()
    data = reading.GetOutput()
    positions = vtk_to_numpy(data.GetPoints().GetData())[
        vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    ]
    np.testing.assert_allclose(positions, corners(BALL), atol=23 * 2.0**-23)
    if ending == "vtp":
        np.testing.assert_array_equal(vtk_to_numpy(data.GetPointData().GetNormals()), VERTICES)


def poly_data(points: np.ndarray, polygons: Any, strips: Any = (), lines: Any = ()) -> vtkPolyData:
    data, held = vtkPolyData(), vtkPoints()
    held.SetData(numpy_to_vtk(points, deep=True))
    data.SetPoints(held)
    for cells, put in ((polygons, data.SetPolys), (strips, data.SetStrips), (lines, data.SetLines)):
        if len(cells):
            array = vtkCellArray()
            ends = np.cumsum([0, *map(len, cells)])
            array.SetData(
                numpy_to_vtkIdTypeArray(ends.astype(np.int64), deep=True),
                numpy_to_vtkIdTypeArray(np.concatenate(cells).astype(np.int64), deep=True),
            )
            put(array)
    return data


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended"])
@pytest.mark.parametrize("packer", ["None", "ZLib", "LZMA", "LZ4"])
@pytest.mark.parametrize("base64", [False, True])
def test_vtp_as_vtk_writes_it(tmp_path: Path, mode: str, packer: str, base64: bool) -> None:
    """Triangles, a pentagon, a strip; and a line, which is no surface."""
    points = np.concatenate([VERTICES, np.random.default_rng(1).normal(size=(9, 3))]).astype(np.float32)
    n = len(VERTICES)
    data = poly_data(
        points, [*FACES, [n, n + 1, n + 2, n + 3, n + 4]], strips=[[n + 4, n + 5, n + 6, n + 7, n + 8]], lines=[[0, 1]]
    )
    data.GetPointData().SetNormals(numpy_to_vtk(points, deep=True))
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(tmp_path / "m.vtp"))
    writer.SetInputData(data)
    {
        "ascii": writer.SetDataModeToAscii,
        "binary": writer.SetDataModeToBinary,
        "appended": writer.SetDataModeToAppended,
    }[mode]()
    getattr(writer, f"SetCompressorTypeTo{packer}")()
    writer.SetEncodeAppendedData(base64)
    writer.Write()
    mesh = load_mesh(tmp_path / "m.vtp")
    np.testing.assert_allclose(mesh.vertices, points, rtol=1e-6)
    fan = [(n, n + 1, n + 2), (n, n + 2, n + 3), (n, n + 3, n + 4)]
    strip = [(n + 4, n + 5, n + 6), (n + 6, n + 5, n + 7), (n + 6, n + 7, n + 8)]
    turned = mesh.triangles[-3:]
    np.testing.assert_array_equal(mesh.triangles[:-3], [*FACES, *fan])
    # A strip's triangles begin anywhere, and go around one way.
    for found, wanted in zip(turned, strip, strict=True):
        assert any(tuple(np.roll(found, shift)) == wanted for shift in range(3))
    assert mesh.normals is not None


@pytest.mark.parametrize("text", [False, True])
def test_ply_and_stl_as_vtk_writes_them(tmp_path: Path, text: bool) -> None:
    data = poly_data(BALL.vertices, FACES)
    for writer, name in ((vtkPLYWriter(), "m.ply"), (vtkSTLWriter(), "m.stl")):
        (writer.SetFileTypeToASCII if text else writer.SetFileTypeToBinary)()
        writer.SetFileName(str(tmp_path / name))
        writer.SetInputData(data)
        writer.Write()
        np.testing.assert_allclose(corners(load_mesh(tmp_path / name)), corners(BALL), atol=2e-5)


def test_obj_with_all_that_people_put_into_it(tmp_path: Path) -> None:
    """Quads and triangles, negative numbers, texture coordinates, groups, materials that are not there, remarks."""
    (tmp_path / "m.obj").write_text(
        "# a remark\nmtllib none.mtl\no one\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
        "usemtl red\nf 1/1/1 2/1/1 3/1/1 4/1/1\ng two\nusemtl blue\nv 0 0 5\nf 1//1 2//1 5//1\nf -1 -2 -3\n"
    )
    mesh = load_mesh(tmp_path / "m.obj")
    area = np.linalg.norm(np.cross(*np.moveaxis(corners(mesh)[:, 1:] - corners(mesh)[:, :1], 1, 0)), axis=1)
    assert len(mesh.triangles) == 4 and mesh.vertices[:, 2].max() == 5
    # Two halves of the quad; (0 0 0), (1 0 0), (0 0 5); and the last three, (0 0 5), (0 1 0), (1 1 0).
    np.testing.assert_allclose(sorted(area), [1, 1, 5, np.sqrt(26)])


def write(ending: str, path: Path) -> None:
    save_mesh(BALL, path)
    if path.stem == "text":  # the other kind of the same format
        kind = {"ply": vtkPLYWriter, "stl": vtkSTLWriter, "vtp": vtkXMLPolyDataWriter}[ending]()
        if ending == "vtp":
            kind.SetDataModeToAppended()
            kind.SetEncodeAppendedData(False)
        else:
            kind.SetFileTypeToASCII()
        kind.SetFileName(str(path))
        kind.SetInputData(poly_data(BALL.vertices, FACES))
        kind.Write()


KINDS = [*((ending, "m") for ending in ENDINGS), ("ply", "text"), ("stl", "text"), ("vtp", "text")]


@each_ending
def test_files_that_are_none(tmp_path: Path, ending: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"m.{ending}"
    assert refused(path, capfd).endswith(": cannot be read: No such file or directory")
    path.touch()
    assert refused(path, capfd).endswith(": is empty")
    for content in (b"Lorem ipsum\n" * 99, Random(1).randbytes(2000), b"\0" * 100, b"solid\n", b"ply\n", b"<VTKFile/>"):
        path.write_bytes(content)
        refused(path, capfd)
    path.unlink()
    path.mkdir()
    assert refused(path, capfd).endswith(": is a folder")
    path.rmdir()
    os.mkfifo(path)
    assert refused(path, capfd).endswith(": is not a regular file")


@pytest.mark.parametrize(("ending", "stem"), KINDS)
def test_truncated_files(tmp_path: Path, ending: str, stem: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"{stem}.{ending}"
    write(ending, path)
    content, whole = path.read_bytes(), corners(load_mesh(path))
    for length in [1, 4, *np.linspace(8, len(content) - 3, 60).astype(int)]:
        path.write_bytes(content[:length])
        try:
            mesh = load_mesh(path)
        except InputError:
            refused(path, capfd)
        else:
            # An OBJ file does not say how much it holds: any whole line may be its last. In the others what is gone is
            # no number, but a line's end or a closing word; or the last digit of the last one of a text.
            last = -1 if (ending, stem) == ("ply", "text") else None
            if ending != "obj":
                assert length > len(content) - 40
                np.testing.assert_array_equal(corners(mesh)[:last], whole[:last])


@pytest.mark.parametrize(("ending", "stem"), KINDS)
def test_damaged_files_are_read_or_refused(
    tmp_path: Path, ending: str, stem: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"{stem}.{ending}"
    write(ending, path)
    content = path.read_bytes()
    for seed in range(80):
        random, damaged = Random(seed), bytearray(content)
        reach = len(damaged) if seed % 2 else min(len(damaged), 600)  # headers are where the harm is
        for _ in range(random.randrange(1, 5)):
            damaged[random.randrange(reach)] = (
                random.choice(b"0123456789-\0\xff") if seed % 3 else random.randrange(256)
            )
        path.write_bytes(damaged)
        try:
            load_mesh(path)
        except TexvolError:
            refused(path, capfd)
        assert capfd.readouterr().err == "", seed


def test_what_a_file_lacks_is_said(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.obj"
    for text, words in (
        ("v 0 0 0\nv 1 0 0\n", "has no triangles"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ""),
        ("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "must be finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "fewer than three corners"),
        ("v 0 0 0\nv 1 O 0\nv 0 1 0\nf 1 2 3\n", ""),
    ):
        path.write_text(text)
        assert words in refused(path, capfd)
    path = tmp_path / "m.ply"
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    path.write_text(
        f"{header}element face 2\nproperty list uchar int vertex_indices\nend_header\n" + "0 0 0\n" * 3 + "3 0 1 2\n"
    )
    assert "its header has 2 of element face, and the file 1" in refused(path, capfd)
    path.write_text(f"{header}end_header\n" + "0 0 0\n" * 3)
    assert "has no triangles" in refused(path, capfd)
    path = tmp_path / "m.stl"
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    path.write_text(f"solid a\n{facet}endsolid a\nsolid b\n{facet}")
    assert "a solid without an end" in refused(path, capfd)
    path.write_text(f"solid a\n{facet}endsolid a\nsolid b\n{facet}endsolid b\n")
    assert len(load_mesh(path).triangles) == 2
    path = tmp_path / "m.vtp"
    path.write_text('<VTKFile type="ImageData"/>')
    assert "must be VTK XML of type PolyData, got ImageData" in refused(path, capfd)
    path.write_text(
        '<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="0" NumberOfPolys="0"/></PolyData></VTKFile>'
    )
    assert "has no polygons" in refused(path, capfd)
    path.write_text('<!DOCTYPE a [<!ENTITY b "c">]><VTKFile type="PolyData"><PolyData/></VTKFile>')
    assert "document type" in refused(path, capfd)


@pytest.mark.parametrize("name", ["m.gltf", "m", "m.nrrd"])
def test_other_formats_are_refused_with_the_list(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=".ply, .stl, .obj,? (or )?.vtp"):
        load_mesh(tmp_path / name)
    with pytest.raises(InputError, match=".ply, .stl, .obj,? (or )?.vtp"):
        save_mesh(BALL, tmp_path / name)


def test_a_file_that_cannot_be_written_leaves_what_was_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        save_mesh(BALL, tmp_path / "none" / "m.ply")
    (tmp_path / "m.ply").mkdir()
    with pytest.raises(InputError, match="must be a file, got a folder"):
        save_mesh(BALL, tmp_path / "m.ply")
    assert os.listdir(tmp_path) == ["m.ply"]
