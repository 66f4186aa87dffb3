"""Reader of mesh files: PLY, STL and OBJ by trimesh, VTP by texvol's own reader of VTK's XML.

Faces of more than three corners become fans of triangles, and several objects of a file one mesh. Normals at vertices
make a mesh smooth; those of STL belong to its flat triangles and are ignored. Colours and textures are not read.
"""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.loading import named_faults, silent_libraries
from texvol.formats.readers.samples import FileFault, check_size
from texvol.geometry.mesh_text import plain_obj, plain_ply, plain_stl
from texvol.scene.shapes import MESH_COLOR, Mesh
from texvol.util import reach
from texvol.util.errors import InputError
from texvol.util.text_files import check_regular

FORMATS = {".ply": "PLY", ".stl": "STL", ".obj": "OBJ", ".vtp": "VTP"}
# Memory per byte of text while it becomes numbers: a Python string and its slot in a list for each few characters.
_BYTES_PER_BYTE = 16
_STL_HEADER, _STL_TRIANGLE = 84, 50  # bytes

Parts = dict[str, NDArray]  # vertices, faces of at least three corners, and normals if there are any


def load_mesh(
    path: str | os.PathLike[str],
    *,
    color: tuple[float, float, float] | None = None,
    opacity: float = 1.0,
    lit: bool = True,
) -> Mesh:
    """Return the mesh of a PLY, STL, OBJ or VTP file, in the file's coordinates, named after the file.

    Raises
    ------
    InputError
        If the file can't be read in the format of its name; one line that names the file and the fault.
    MissingExtraError
        If trimesh is not installed.
    """
    name = os.fspath(path)
    kind = FORMATS.get(os.path.splitext(name)[1].lower())
    if kind is None:
        raise InputError(f"{name}: the name of a mesh must end with one of {', '.join(FORMATS)}")
    with named_faults(name, kind, "geometry"):
        parts = _read(kind, name)
        look: dict[str, Any] = {"color": MESH_COLOR if color is None else color, "opacity": opacity, "lit": lit}
        return Mesh(parts["vertices"], parts["faces"], normals=parts.get("normals"), name=name, **look)


def _read(kind: str, path: str) -> Parts:
    reach.check(path)
    size = check_regular(path)
    if not size:
        raise FileFault("is empty")
    check_size([size], _BYTES_PER_BYTE)
    if kind == "VTP":
        from texvol.geometry import vtp  # with the XML parser

        return vtp.read(path)
    with open(path, "rb") as file, silent_libraries():
        # On a misspelled number some versions of numpy only warn, and ignore the rest.
        warnings.filterwarnings("error", message="string or file could not be read")
        return {"PLY": _ply, "STL": _stl, "OBJ": _obj}[kind](file)


def _ply(file: BinaryIO) -> Parts:
    from trimesh.exchange.ply import load_ply

    if file.read(3) != b"ply":
        raise FileFault("is named PLY, but its content is not PLY")
    file.seek(0)
    loaded = load_ply(io.BytesIO(plain_ply(file.read())), fix_texture=False, skip_materials=True)
    elements = loaded["metadata"]["_ply_raw"]
    _check_lists(elements)
    for name in ("vertex", "face"):
        said, held = elements.get(name, {}).get("length", 0), _rows(elements.get(name, {}).get("data"))
        if held < said:
            raise FileFault(f"is truncated: its header has {said} of element {name}, and the file {held}")
    return _parts(loaded)


def _check_lists(elements: Mapping[str, Any]) -> None:
    """Raise FileFault unless binary lists are all as long as the first, which trimesh assumes."""
    for name, element in elements.items():
        data = element.get("data")
        for field in getattr(getattr(data, "dtype", None), "names", None) or ():
            parts = data.dtype[field].names or ()
            if parts == ("f0", "f1") and (data[field]["f0"] != np.prod(data.dtype[field]["f1"].shape, dtype=int)).any():
                raise FileFault(f"has elements {name} whose lists are of other lengths than they say")


def _rows(data: Any) -> int:
    if data is None:
        return 0
    return min(map(len, data.values()), default=0) if isinstance(data, dict) else len(data)


def _stl(file: BinaryIO) -> Parts:
    from trimesh.exchange.stl import load_stl_ascii, load_stl_binary

    start = file.read(_STL_HEADER)
    size = os.fstat(file.fileno()).st_size
    triangles = int.from_bytes(start[_STL_HEADER - 4 :], "little")
    if len(start) < _STL_HEADER or size != _STL_HEADER + _STL_TRIANGLE * triangles:
        # Not binary, so it must be text.
        file.seek(0)
        lines = [line.strip().lower() for line in file]
        begun, ended = (sum(line.startswith(word) for line in lines) for word in (b"solid", b"endsolid"))
        if not begun:
            held = max(size - _STL_HEADER, 0) // _STL_TRIANGLE
            raise FileFault(
                f"is truncated or not STL: its header has {triangles} triangles, and the file at most {held}"
            )
        if begun != ended:
            raise FileFault("is truncated: it has a solid without an end")
        return _parts(load_stl_ascii(io.BytesIO(plain_stl(lines))))
    file.seek(0)
    return _parts(load_stl_binary(file))


def _obj(file: BinaryIO) -> Parts:
    from trimesh.exchange.obj import load_obj

    if b"\0" in file.read(1024):
        raise FileFault("is named OBJ, but its content is not text")
    file.seek(0)
    text, triangles = plain_obj(file.read())
    parts = _parts(load_obj(io.StringIO(text), skip_materials=True, group_material=False, maintain_order=True))
    if len(parts["faces"]) != triangles:
        raise FileFault(f"has faces of {triangles} triangles, but only {len(parts['faces'])} can be read")
    return parts


def _parts(loaded: Mapping[str, Any]) -> Parts:
    """Return one mesh of trimesh's result, which may be several."""
    meshes = list(loaded["geometry"].values()) if "geometry" in loaded else [loaded]
    meshes = [mesh for mesh in meshes if mesh.get("faces") is not None and len(mesh["faces"])]
    if not meshes:
        raise FileFault("has no triangles")
    firsts = np.cumsum([0, *(len(mesh["vertices"]) for mesh in meshes)])
    for mesh in meshes:
        faces = np.asarray(mesh["faces"])
        if faces.min() < 0 or faces.max() >= len(mesh["vertices"]):
            raise FileFault(f"has a face with corner {faces.max()}, but only {len(mesh['vertices'])} vertices")
    triangles = [fans(np.asarray(mesh["faces"])) + first for mesh, first in zip(meshes, firsts, strict=False)]
    parts = {"vertices": np.concatenate([mesh["vertices"] for mesh in meshes]), "faces": np.concatenate(triangles)}
    corners = parts["vertices"][parts["faces"]]
    if (corners == corners[:, :1]).all():
        raise FileFault("has no triangle of more than a point")
    if all(mesh.get("vertex_normals") is not None for mesh in meshes):
        parts["normals"] = np.concatenate([mesh["vertex_normals"] for mesh in meshes])
    return parts


def fans(faces: NDArray) -> NDArray[np.int64]:
    """Return triangles (…, 3) of faces (n, corners) of at least three corners each."""
    if faces.ndim != 2 or faces.shape[1] < 3:
        raise FileFault("has faces of fewer than three corners")
    corners = [faces[:, [0, i, i + 1]] for i in range(1, faces.shape[1] - 1)]
    return np.stack(corners, axis=1).reshape(-1, 3).astype(np.int64)
