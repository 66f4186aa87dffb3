"""Writer of mesh files: PLY, STL and OBJ by trimesh, VTP as VTK's XML; whole or not at all.

VTP holds float64, PLY and STL float32, OBJ as many digits as float64 has. STL has no normals at vertices. Points with
normals are vertices without faces in PLY, `p` elements in OBJ and Verts in VTP; STL has none.
"""

from __future__ import annotations

import os
from math import floor, log10

import numpy as np

from texvol.geometry.points import Points
from texvol.geometry.reading import FORMATS
from texvol.scene.shapes import Mesh
from texvol.util import writing
from texvol.util.errors import InputError, missing_extra

_DIGITS = 17  # of a float64


def check_writable(path: str | os.PathLike[str], *, points: bool = False) -> None:
    """Raise InputError if no mesh, or no points, can be written to `path`; called before they are made."""
    if _kind(path) == "STL" and points:
        raise InputError(f"{os.fspath(path)}: STL holds triangles only; points need .ply, .obj or .vtp")
    writing.check_writable(path)


def save_mesh(mesh: Mesh | Points, path: str | os.PathLike[str]) -> None:
    """Write a mesh or points in the format of the name: .ply, .stl, .obj or .vtp.

    Raises
    ------
    InputError
        If the name has another ending, or that of STL for points, or the file can't be written.
    MissingExtraError
        If trimesh is not installed, for a mesh.
    """
    check_writable(path, points=isinstance(mesh, Points))
    content = _encoded_points(mesh, _kind(path)) if isinstance(mesh, Points) else _encoded(mesh, _kind(path))
    writing.write_files({path: content})


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


def _encoded_points(cloud: Points, kind: str) -> bytes:
    if kind == "VTP":
        from texvol.geometry import vtp

        return vtp.encoded_points(cloud)
    rows = np.concatenate([cloud.points, cloud.normals], axis=1)
    if kind == "PLY":
        properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
        header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
        return header.encode("ascii") + rows.astype("<f4").tobytes()
    lines = [f"v {x!r} {y!r} {z!r}\nvn {u!r} {v!r} {w!r}\n" for x, y, z, u, v, w in rows.tolist()]
    return "".join([*lines, *(f"p {number}\n" for number in range(1, len(rows) + 1))]).encode("ascii")
