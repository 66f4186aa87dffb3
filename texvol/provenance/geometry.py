"""Geometry in a picture's header: file, look and checksum of each mesh.

    geometry    [{"path", "absolute", "color", "opacity", "lit", "cut", "checksum"}, …]

Lines, and meshes without a file, have an entry as well, but can't be drawn again.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from texvol.geometry import load_mesh
from texvol.provenance.scene_metadata import crc32_of
from texvol.provenance.volumes import Folder, positions
from texvol.scene.shapes import Lines, Mesh
from texvol.util.errors import InputError

_LOOK = {"color": list, "opacity": (int, float), "lit": bool, "cut": bool}
_KEYS = {*_LOOK, "path", "absolute", "checksum"}


def geometry_metadata(geometry: Iterable[Mesh | Lines]) -> list[dict[str, Any]]:
    """Return the header's entry for each shape."""
    entries = []
    for shape in geometry:
        entry: dict[str, Any] = {"color": list(shape.color), "opacity": shape.opacity}
        if isinstance(shape, Mesh):
            entry |= {"lit": shape.lit, "cut": shape.cut, "checksum": _checksum(shape)}
            if os.path.isfile(shape.name):
                entry |= {"path": shape.name, "absolute": os.path.abspath(shape.name)}
        entries.append(entry)
    return entries


def geometry_from_metadata(content: Any, folder: Folder) -> tuple[Mesh, ...]:
    """Return the meshes of the header's entries; `folder` is that of the picture, in which their files may be.

    Raises
    ------
    InputError
        If the content is malformed, or a mesh has no file, is not found, or has changed.
    """
    if not isinstance(content, list) or not all(isinstance(each, dict) and set(each) <= _KEYS for each in content):
        raise InputError("must be a list of meshes")
    return tuple(_mesh(each, folder) for each in content)


def _mesh(entry: Mapping[str, Any], folder: Folder) -> Mesh:
    for key, kind in _LOOK.items():
        if key in entry and not isinstance(entry[key], kind):  # type: ignore[arg-type]
            raise InputError(f"{key} has the wrong type")
    if not isinstance(entry.get("path"), str) or not isinstance(entry.get("absolute", ""), str):
        raise InputError("lines, and meshes without a file, can't be drawn again")
    path = next(positions(entry, folder), None)
    if path is None:
        raise InputError(f"the mesh {entry['path']!r} is neither here nor beside the picture")
    color = entry.get("color")
    mesh = load_mesh(
        path,
        color=None if color is None else tuple(color),
        opacity=entry.get("opacity", 1.0),
        lit=entry.get("lit", True),
    )
    if entry.get("checksum", _checksum(mesh)) != _checksum(mesh):
        raise InputError(f"the mesh {path} has changed since it was drawn")
    return mesh


def _checksum(mesh: Mesh) -> str:
    return crc32_of(mesh.vertices, mesh.triangles, mesh.normals)
