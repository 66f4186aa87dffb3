"""Mesh files of text: names in any encoding, indices and counts that have to be right."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from texvol import InputError
from texvol.geometry import load_mesh

SQUARE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
TRIANGLES = [(0, 1, 2), (0, 2, 3)]
NAMES = ["Größe".encode("latin-1"), "部品".encode("shift-jis"), "Größe".encode(), b"\xff\xfe\x80"]


def written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def corners(path: Path) -> np.ndarray:
    mesh = load_mesh(path)
    return mesh.vertices[mesh.triangles]


@pytest.mark.parametrize("name", NAMES)
def test_names_in_any_encoding_do_not_matter(tmp_path: Path, name: bytes) -> None:
    obj = b"# " + name + b"\no " + name + b"\n" + SQUARE + b"usemtl " + name + b"\nf 1 2 3\nf 1 3 4\n"
    stl = b"solid " + name + b"\n"
    for triangle in TRIANGLES:
        vertices = b"".join(b"vertex %d %d %d\n" % tuple(CORNERS[corner]) for corner in triangle)
        stl += b"facet normal 0 0 1\nouter loop\n" + vertices + b"endloop\nendfacet\n"
    stl += b"endsolid " + name + b"\n"
    ply = b"ply\nformat ascii 1.0\ncomment " + name + b"\nelement vertex 4\nproperty float x\nproperty float y\n"
    ply += b"property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    ply += b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"
    for ending, content in (("obj", obj), ("stl", stl), ("ply", ply)):
        found = corners(written(tmp_path / f"m.{ending}", content))
        np.testing.assert_array_equal(found, CORNERS[TRIANGLES])


FORMS = [
    b"f 1 2 3\nf 1 3 4\n",
    b"f 1 2 3 4\n",
    b"  f\t1 2 3\n\tf 1 3 4\n",
    b"f -4 -3 -2\nf -4 -2 -1\n",
    b"f 1 2 \\\n3\nf 1 3 4 # the last\n",
    b"f -4 -3 -2\nf 1 3 4\nv 5 5 5\nv 6 6 6\n",
    b"f 1// 2// 3//\nf 1// 3// 4//\n",
]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("ends", [b"\n", b"\r\n", b"\r"])
def test_faces_of_obj_are_all_read(tmp_path: Path, form: bytes, ends: bytes) -> None:
    content = (SQUARE + form).replace(b"\n", ends)
    np.testing.assert_array_equal(corners(written(tmp_path / "m.obj", content)), CORNERS[TRIANGLES])


@pytest.mark.parametrize(
    ("faces", "reason"),
    [
        (b"f 0 1 2\n", "index 0.* in line 5: 'f 0"),
        (b"f 1 2 1000000000\n", "index '1000000000', where there are 4"),
        (b"f 1 2 3\nf 1 0 3\n", "index 0.* in line 6"),
        (b"vn 0 0 1\nf 1//1 2//0 3//1\n", "index 0"),
        (b"vt 0 0\nf 1/1 2/1 3/00\n", "index 0"),
        (b"f 1 2 3\nf 1 2\n", "fewer than three corners, in line 6"),
        (b"f 1 2\n", "fewer than three"),
        (b"f\nf 1 2 3\n", "fewer than three"),
        (b"f -5 -4 -3\n", "index -5, where there are 4"),
        (b"f 1 2 5\n", "m.obj: "),
        (b"f 1 2 x\n", "m.obj: "),
        (b"f 1 2 3\nf 1 2 x\n", "m.obj: "),
    ],
)
def test_faces_of_obj_that_are_wrong(tmp_path: Path, faces: bytes, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        load_mesh(written(tmp_path / "m.obj", SQUARE + faces))


PLY = (
    b"ply\nformat %s 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face %d\nproperty list uchar int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize(
    "rows",
    [
        b"4 0 1 2\n", b"3 0 1\n", b"3 0 1 2 3\n", b"3 0 1 2\n4 0 1 2\n", b"3 0 1 2\n4 0 1 2 3\n5 0 1 2\n",
        b"255 0 1 2\n", b"3\n",
    ],
)  # fmt: skip
def test_faces_of_ply_with_other_corners_than_they_say(tmp_path: Path, rows: bytes) -> None:
    header = PLY % (b"ascii", rows.count(b"\n"))
    with pytest.raises(InputError, match="more or fewer numbers than declared"):
        load_mesh(written(tmp_path / "m.ply", header + b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + rows))


def test_faces_of_binary_ply_with_other_corners_than_they_say(tmp_path: Path) -> None:
    header = PLY % (b"binary_little_endian", 2)
    vertices = CORNERS.astype("<f4").tobytes()
    right = struct.pack("<B3iB3i", 3, 0, 1, 2, 3, 0, 2, 3)
    np.testing.assert_array_equal(corners(written(tmp_path / "m.ply", header + vertices + right)), CORNERS[TRIANGLES])
    wrong = struct.pack("<B3iB3i", 3, 0, 1, 2, 200, 0, 2, 3)
    with pytest.raises(InputError, match="of other lengths than they say"):
        load_mesh(written(tmp_path / "m.ply", header + vertices + wrong))


def test_facets_of_stl_with_other_than_three_vertices(tmp_path: Path) -> None:
    four = b"vertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\n"
    two = b"vertex 0 0 0\nvertex 1 0 0\n"
    facets = b"".join(b"facet normal 0 0 1\nouter loop\n" + each + b"endloop\nendfacet\n" for each in (four, two))
    with pytest.raises(InputError, match="number 1, that has not three vertices"):
        load_mesh(written(tmp_path / "m.stl", b"solid a\n" + facets + b"endsolid a\n"))
