"""VTP: VTK's polygons, in XML with the same arrays as VTK's volumes; no light library reads or writes it.

Polygons and strips of triangles of all pieces are read; lines and single points are ignored.
"""

from __future__ import annotations

import base64
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.formats.readers.samples import FileFault
from texvol.formats.readers.vti_arrays import Document
from texvol.formats.readers.vtk_xml import document_of
from texvol.geometry.points import Points
from texvol.scene.shapes import Mesh

_MOST = 2**40  # of points or polygons of a piece


def read(path: str) -> dict[str, NDArray]:
    """Return vertices, faces and, if all pieces have them, normals."""
    document = document_of(path, "PolyData")
    pieces = [_Piece(piece, document) for piece in document.data.findall("Piece")]
    parts: list[dict[str, NDArray]] = []
    first = 0
    for piece in pieces:
        faces = piece.faces()
        if len(faces):
            part = {"vertices": piece.points(), "faces": faces + first}
            normals = piece.normals()
            parts.append(part if normals is None else part | {"normals": normals})
            first += len(part["vertices"])
    if not parts:
        raise FileFault("has no polygons")
    names = set.intersection(*(set(part) for part in parts))
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


class _Piece:
    def __init__(self, piece: Element, document: Document) -> None:
        self._piece, self._document = piece, document
        self._points = self._count("NumberOfPoints")

    def points(self) -> NDArray:
        array = self._piece.find("Points/DataArray")
        if array is None:
            raise FileFault("has a piece without points")
        return self._vectors(array)

    def normals(self) -> NDArray | None:
        """Return normals of the points, or None."""
        data = self._piece.find("PointData")
        named = {array.get("Name"): array for array in (data.findall("DataArray") if data is not None else ())}
        array = named.get(data.get("Normals") if data is not None else None)
        return None if array is None else self._vectors(array)

    def faces(self) -> NDArray[np.int64]:
        """Return triangles of polygons, as fans, and of strips."""
        triangles = [np.empty((0, 3), np.int64)]
        for name, is_strip in (("Polys", False), ("Strips", True)):
            count = self._count(f"NumberOf{name}")
            if count:
                triangles.append(self._triangles(name, count, is_strip))
        faces = np.concatenate(triangles)
        if faces.size and not (faces.min() >= 0 and faces.max() < self._points):
            raise FileFault(f"has a polygon with corner {faces.max()}, but only {self._points} points")
        return faces

    def _triangles(self, name: str, count: int, is_strip: bool) -> NDArray[np.int64]:
        arrays = {array.get("Name"): array for array in self._piece.findall(f"{name}/DataArray")}
        if not {"connectivity", "offsets"} <= set(arrays):
            raise FileFault(f"its {name} lack connectivity or offsets")
        ends = self._document.array(arrays["offsets"], [count]).astype(np.int64)
        sizes = np.diff(ends, prepend=0)
        if not (sizes >= 0).all() or ends[-1] > _MOST:
            raise FileFault(f"the offsets of its {name} must increase")
        corners = self._document.array(arrays["connectivity"], [int(ends[-1])]).astype(np.int64)
        # Triangle t of a polygon of k corners, of k - 2.
        of_each = np.maximum(sizes - 2, 0)
        start = np.repeat(ends - sizes, of_each)
        step = np.arange(len(start)) - np.repeat(np.cumsum(of_each) - of_each, of_each)
        if is_strip:
            odd = step % 2  # every other triangle of a strip goes the other way round
            positions = start + step + odd, start + step + 1 - odd, start + step + 2
        else:
            positions = start, start + step + 1, start + step + 2
        return np.stack([corners[position] for position in positions], axis=1)

    def _count(self, name: str) -> int:
        count = int(self._piece.get(name, 0))
        if not 0 <= count <= _MOST:
            raise FileFault(f"its {name} must be 0 to {_MOST}, got {count}")
        return count

    def _vectors(self, array: Element) -> NDArray:
        return self._document.array(array, [self._points, 3], f"array {array.get('Name')!r}")


def encoded(mesh: Mesh) -> bytes:
    """Return the bytes of a file with the mesh, in float64."""
    corners = mesh.triangles.reshape(-1)
    return _file(mesh.vertices, mesh.normals, "Polys", corners, 3)


def encoded_points(cloud: Points) -> bytes:
    """Return the bytes of a file with points and normals, in float64, a vertex cell for each point."""
    return _file(cloud.points, cloud.normals, "Verts", np.arange(len(cloud.points)), 1)


def _file(places: NDArray, normals: NDArray | None, cells: str, corners: NDArray[np.int64], of_each: int) -> bytes:
    """Return the bytes of a file with cells of one kind, of so many corners each."""
    file = Element("VTKFile", type="PolyData", version="1.0", byte_order="LittleEndian", header_type="UInt64")
    counts = {"NumberOfPoints": str(len(places)), f"NumberOf{cells}": str(len(corners) // of_each)}
    piece = ElementTree.SubElement(ElementTree.SubElement(file, "PolyData"), "Piece", counts)
    _put(ElementTree.SubElement(piece, "Points"), "Points", places, "f8")
    if normals is not None:
        _put(ElementTree.SubElement(piece, "PointData", Normals="Normals"), "Normals", normals, "f8")
    element = ElementTree.SubElement(piece, cells)
    _put(element, "connectivity", corners, "i8")
    _put(element, "offsets", np.arange(of_each, len(corners) + 1, of_each), "i8")
    return ElementTree.tostring(file, encoding="utf-8", xml_declaration=True)


def _put(parent: Element, name: str, numbers: ArrayLike, code: str) -> None:
    array = np.ascontiguousarray(numbers, "<" + code)
    about: dict[str, Any] = {"type": {"f8": "Float64", "i8": "Int64"}[code], "Name": name, "format": "binary"}
    if array.ndim > 1:
        about["NumberOfComponents"] = str(array.shape[1])
    data = ElementTree.SubElement(parent, "DataArray", about)
    data.text = base64.b64encode(np.uint64(array.nbytes).tobytes() + array.tobytes()).decode("ascii")
