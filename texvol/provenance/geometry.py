"""Geometry in a picture's header: the file of each mesh and how it looks, with a checksum of what was drawn.

    geometry    [{"path", "absolute", "color", "opacity", "lit", "cut", "checksum"}, …]

Lines, and meshes that are in no file, are counted as such, and can't be drawn again.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from texvol.geometry import load_mesh
from texvol.scene.shapes import Lines, Mesh
from texvol.util.errors import InputError

_LOOK = {"color": list, "opacity": (int, float), "lit": bool, "cut": bool}
_KEYS = {*_LOOK, "path", "absolute", "checksum"}


def geometry_metadata(geometry: Iterable[Mesh | Lines]) -> list[dict[str, Any]]:
    """What the header says of it."""
    metadata = []
    for shape in geometry:
        fact: dict[str, Any] = {"color": list(shape.color), "opacity": shape.opacity}
        if isinstance(shape, Mesh):
            fact |= {"lit": shape.lit, "cut": shape.cut, "checksum": _checksum(shape)}
            if os.path.isfile(shape.name):
                fact |= {"path": shape.name, "absolute": os.path.abspath(shape.name)}
        metadata.append(fact)
    return metadata


def geometry_from_metadata(content: Any, positions: Callable[[Mapping[str, Any]], Iterator[str]]) -> tuple[Mesh, ...]:
    """The meshes again; `places` says where a file may be.

    Raises
    ------
    InputError
        If the content is not that, or a mesh is in no file, is not found, or has changed.
    """
    if not isinstance(content, list) or not all(isinstance(each, dict) and set(each) <= _KEYS for each in content):
        raise InputError("a list of meshes is wanted")
    return tuple(_mesh(each, positions) for each in content)


def _mesh(fact: Mapping[str, Any], positions: Callable[[Mapping[str, Any]], Iterator[str]]) -> Mesh:
    for key, kind in _LOOK.items():
        if key in fact and not isinstance(fact[key], kind):  # type: ignore[arg-type]
            raise InputError(f"{key} is of another type than it should be")
    if not isinstance(fact.get("path"), str) or not isinstance(fact.get("absolute", ""), str):
        raise InputError("lines, or a mesh that was in no file, which can't be drawn again")
    path = next(positions(fact), None)
    if path is None:
        raise InputError(f"the mesh {fact['path']!r}, which is neither here nor beside the picture")
    color = fact.get("color")
    mesh = load_mesh(
        path,
        color=None if color is None else tuple(color),
        opacity=fact.get("opacity", 1.0),
        lit=fact.get("lit", True),
    )
    if fact.get("checksum", _checksum(mesh)) != _checksum(mesh):
        raise InputError(f"the mesh {path} has changed since it was drawn")
    return mesh


def _checksum(mesh: Mesh) -> str:
    arrays = [mesh.vertices, mesh.triangles, *([] if mesh.normals is None else [mesh.normals])]
    found = 0
    for array in arrays:
        found = zlib.crc32(np.ascontiguousarray(array).tobytes(), found)
    return f"crc32 {found:08x}"
