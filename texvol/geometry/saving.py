"""Writer of mesh files: PLY, STL and OBJ by trimesh, VTP as VTK's XML; whole or not at all.

VTP holds float64, PLY and STL float32, OBJ as many digits as float64 has. STL has no normals at vertices.
"""

from __future__ import annotations

import os
from math import floor, log10

import numpy as np

from texvol.geometry.reading import FORMATS
from texvol.scene.shapes import Mesh
from texvol.util import writing
from texvol.util.errors import InputError, missing_extra

_DIGITS = 17  # of a float64


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if no mesh can be written to `path`; called before the mesh is made."""
    _kind(path)
    writing.check_writable(path)


def save_mesh(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh in the format of the name: .ply, .stl, .obj or .vtp.

    Raises
    ------
    InputError
        If the name has another ending, or the file can't be written.
    MissingExtraError
        If trimesh is not installed.
    """
    check_writable(path)
    writing.write_files({path: _encoded(mesh, _kind(path))})


def _kind(path: str | os.PathLike[str]) -> str:
    kind = FORMATS.get(os.path.splitext(os.fspath(path))[1].lower())
    if kind is None:
        raise InputError(f"{os.fspath(path)}: the name of a mesh must end with .ply, .stl, .obj or .vtp")
    return kind


def _encoded(mesh: Mesh, kind: str) -> bytes:
    if kind == "VTP":
        from texvol.geometry import vtp

        return vtp.encoded(mesh)
    try:
        import trimesh
        from trimesh.exchange import obj, ply, stl
    except ImportError as error:
        raise missing_extra("trimesh", "geometry", f"writing {kind}") from error
    made = trimesh.Trimesh(mesh.vertices, mesh.triangles, vertex_normals=mesh.normals, process=False)
    has_normals = mesh.normals is not None
    if kind == "PLY":
        return bytes(ply.export_ply(made, vertex_normal=has_normals, include_attributes=False))
    if kind == "STL":
        return bytes(stl.export_stl(made))
    largest = float(np.abs(mesh.vertices).max())
    digits = _DIGITS - 1 - floor(log10(largest)) if largest > 0 else 1  # behind the point
    text = obj.export_obj(made, include_normals=has_normals, include_color=False, digits=max(digits, 1), header=None)
    return str(text).encode("utf-8")
