"""Meshes of a picture's header, read again: file, look and checksum of each mesh.

    geometry    [{"path", "absolute", "color", "opacity", "lit", "cut", "checksum"}, …]

Lines, and meshes without a file, have an entry as well, but can't be drawn again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from texvol.formats.pictures.scene_metadata import checksum_of_mesh
from texvol.geometry import load_mesh
from texvol.provenance.volumes import Folder, positions
from texvol.scene.shapes import Mesh
from texvol.util.errors import InputError

_LOOK = {"color": list, "opacity": (int, float), "lit": bool, "cut": bool}
_KEYS = {*_LOOK, "path", "absolute", "checksum"}


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
    if entry.get("checksum", checksum_of_mesh(mesh)) != checksum_of_mesh(mesh):
        raise InputError(f"the mesh {path} has changed since it was drawn")
    return mesh
