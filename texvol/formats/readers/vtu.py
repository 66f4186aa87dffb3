"""VTU: VTK's unstructured grid, points and cells of any kind between them, in XML; PVTU names files of its parts."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.missing import noted, without_where
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_size
from texvol.formats.readers.splitting import SHAPES
from texvol.formats.readers.unstructured import Cells, Field, chosen_name, samples_of, tetrahedral
from texvol.formats.readers.vti_arrays import Document
from texvol.formats.readers.vtk_xml import GHOSTS, HIDDEN_POINT, document_of
from texvol.scene.tetrahedra import TetrahedralGrid
from texvol.util import reach

_LEFT_OUT = 32 | 1  # hidden cells, and copies of those of other pieces

# VTK's numbers of linear cells (vtkCellType.h), and of cells of higher order, whose first nodes are their corners.
_LINEAR = {10: "tetrahedron", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid"}
_HIGHER = {24: "tetrahedron", 25: "hexahedron", 26: "wedge", 27: "pyramid", 29: "hexahedron", 32: "wedge"}
_HIGHER |= {33: "hexahedron", 37: "pyramid", 71: "tetrahedron", 72: "hexahedron", 73: "wedge", 74: "pyramid"}
_FLAT = {1: "vertices", 2: "vertices", 3: "lines", 4: "lines", 21: "lines", 35: "lines", 68: "lines"}
_FLAT |= {5: "triangles", 6: "triangles", 22: "triangles", 34: "triangles", 69: "triangles"}
_FLAT |= {7: "polygons", 8: "quadrilaterals", 9: "quadrilaterals", 23: "quadrilaterals", 28: "quadrilaterals"}
_FLAT |= {30: "quadrilaterals", 36: "polygons", 70: "quadrilaterals"}
_EMPTY = 0
_REFUSED = {15: "pentagonal prisms", 16: "hexagonal prisms", 41: "convex point sets", 42: "polyhedra"}


class _Piece(NamedTuple):
    """A piece of a file: the file, its element, and its numbers of points and cells."""

    document: Document
    element: Element
    points: int
    cells: int


def read(path: str, choice: Choice) -> Samples:
    """Return samples on a regular grid of a field at the points of a grid, or in its cells."""
    grid, notes = tetrahedra(path, choice)
    return samples_of(grid, notes, choice)


def tetrahedra(path: str, choice: Choice) -> tuple[TetrahedralGrid, tuple[str, ...]]:
    """Return the field of a file on tetrahedra, and notes."""
    pieces = [_piece(document, each) for document in _documents(path) for each in document.data.findall("Piece")]
    pieces = [piece for piece in pieces if piece.cells and piece.points]
    if not pieces:
        raise FileFault("has no Piece with points and cells")
    name, at_points, notes = _chosen(pieces, choice)
    points = [_points(piece) for piece in pieces]
    begin, place, cells = 0, 0, []
    for piece in pieces:
        cells += _cells(piece, begin, place)
        begin, place = begin + piece.points, place + piece.cells
    values = _joined([_values(piece, name, at_points) for piece in pieces], name)
    if at_points and not choice.labels:
        values, more = _without_hidden(pieces, values)
        notes += more
    whole = np.concatenate(points)
    # Pieces have points of their own at common faces: points at one position are one for the choice of diagonals.
    rank = np.unique(whole, axis=0, return_inverse=True)[1].reshape(-1) if len(pieces) > 1 else None
    grid, about = tetrahedral(whole, cells, Field(values, at_points, name), choice, rank=rank)
    return grid, (*notes, *about)


def _documents(path: str) -> list[Document]:
    """Return the XML of a file, or that of all parts of a PVTU file."""
    with open(path, "rb") as file:
        is_parallel = re.search(rb"type\s*=\s*[\"']PUnstructuredGrid", file.read(4096)) is not None
    if not is_parallel:
        return [document_of(path, "UnstructuredGrid")]
    names = [each.get("Source", "") for each in document_of(path, "PUnstructuredGrid").data.findall("Piece")]
    found = []
    for name in names:
        part = os.path.join(os.path.dirname(path), name)
        if not name or "\0" in name or not os.path.isfile(part):
            raise FileFault(f"its part {name!r} is no file")
        reach.check(part)
        found.append(document_of(part, "UnstructuredGrid"))
    return found


def _piece(document: Document, element: Element) -> _Piece:
    sizes = []
    for name in ("NumberOfPoints", "NumberOfCells"):
        text = element.get(name, "")
        if not text.strip().isdigit() or len(text) > 18:
            raise FileFault(f"{name} of a piece must be a whole number, got {text[:40]!r}")
        sizes.append(int(text))
    return _Piece(document, element, *sizes)


def _chosen(pieces: Sequence[_Piece], choice: Choice) -> tuple[str, bool, tuple[str, ...]]:
    """Return the name of the array to read, True if it is at points, and a note on the others."""
    named: dict[str, bool] = {}
    marked = None
    for kind in ("PointData", "CellData"):
        data = pieces[0].element.find(kind)
        if data is None:
            continue
        for array in data.findall("DataArray"):
            if array.get("Name", "") != GHOSTS:
                named.setdefault(array.get("Name", ""), kind == "PointData")
        marked = data.get("Scalars") if marked not in named else marked
    name, notes = chosen_name(named, choice.variable, marked)
    return name, named[name], notes


def _array(piece: _Piece, kind: str, name: str) -> Element | None:
    return next((each for each in piece.element.findall(f"{kind}/DataArray") if each.get("Name", "") == name), None)


def _values(piece: _Piece, name: str, at_points: bool) -> NDArray:
    array = _array(piece, "PointData" if at_points else "CellData", name)
    if array is None:
        raise FileFault(f"one of its pieces has no array {name}")
    sizes = [piece.points if at_points else piece.cells, piece.document.type_of(array)[1]]
    return piece.document.array(array, sizes)


def _joined(parts: Sequence[NDArray], name: str) -> NDArray:
    """Return the values of all pieces, in the machine's byte order."""
    if any((part.dtype, part.shape[1]) != (parts[0].dtype, parts[0].shape[1]) for part in parts):
        raise FileFault(f"the types of its array {name} differ from piece to piece")
    return np.concatenate(parts).astype(parts[0].dtype.newbyteorder("="))


def _points(piece: _Piece) -> NDArray[np.float64]:
    array = piece.element.find("Points/DataArray")
    if array is None:
        raise FileFault("a piece of it has no points")
    check_size([piece.points, 3], 8)
    points = piece.document.array(array, [piece.points, 3], "points").astype(np.float64)
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if wrong.size:
        raise FileFault(f"its point {wrong[0]} is not finite: {points[wrong[0]].tolist()}")
    return points


def _cells(piece: _Piece, begin: int, place: int) -> list[Cells]:
    """Return the cells of a piece by kind; `begin` and `place` are its first point and cell in the whole."""
    kinds = _numbers(piece, "types", piece.cells)
    ends = _numbers(piece, "offsets", piece.cells)
    sizes = np.diff(ends, prepend=0)
    if (sizes < 0).any():
        raise FileFault(f"the offsets of its cells must not decrease, got {ends[np.argmax(sizes < 0)]}")
    used = int(ends[-1])
    corners = _numbers(piece, "connectivity", used) if used else np.empty(0, np.intp)
    if used and (corners.min() < 0 or corners.max() >= piece.points):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise FileFault(f"a cell must have corners 0 to {piece.points - 1}, got {wrong}")
    shown = _shown(piece)
    found = []
    for number in np.unique(kinds).tolist():
        places = np.flatnonzero((kinds == number) & shown)
        kind = _kind_of(number)
        if kind is None or not places.size:
            continue
        count = SHAPES[kind].corners if kind in SHAPES else 0
        is_wrong = sizes[places] < count if number in _HIGHER else (sizes[places] != count) & (kind in SHAPES)
        if is_wrong.any():
            at = places[np.argmax(is_wrong)]
            raise FileFault(f"its cell {at} is a {kind} and must have {count} corners, got {sizes[at]}")
        first = ends[places] - sizes[places]
        taken = corners[first[:, np.newaxis] + np.arange(count)] + begin
        found.append(Cells(kind, taken, place + places, number in _HIGHER))
    return found


def _kind_of(number: int) -> str | None:
    """Return the kind of VTK's cells of a number, or None for the empty cell."""
    if number == _EMPTY:
        return None
    kind = _LINEAR.get(number) or _HIGHER.get(number) or _FLAT.get(number)
    if kind is None:
        name = _REFUSED.get(number, "cells of another kind")
        raise FileFault(f"has {name} (VTK's type {number}), which texvol does not read; in ParaView, Tetrahedralize")
    return kind


def _numbers(piece: _Piece, name: str, count: int) -> NDArray[np.intp]:
    """Return whole numbers that tell of the cells."""
    array = _array(piece, "Cells", name)
    if array is None:
        raise FileFault(f"the cells of a piece have no {name}")
    if piece.document.type_of(array)[0].kind not in "iu":
        raise FileFault(f"the {name} of its cells must be whole numbers, got {array.get('type')}")
    return piece.document.array(array, [count, 1], name)[:, 0].astype(np.intp)


def _shown(piece: _Piece) -> NDArray[np.bool_]:
    array = _array(piece, "CellData", GHOSTS)
    if array is None:
        return np.ones(piece.cells, np.bool_)
    return (piece.document.array(array, [piece.cells, 1], GHOSTS)[:, 0].astype(np.uint8) & _LEFT_OUT) == 0


def _without_hidden(pieces: Sequence[_Piece], values: NDArray) -> tuple[NDArray, tuple[str, ...]]:
    """Return values without those of hidden points, and a note."""
    ghosts = [_array(piece, "PointData", GHOSTS) for piece in pieces]
    if all(array is None for array in ghosts):
        return values, ()
    hidden = np.concatenate([
        np.zeros(piece.points, np.bool_) if array is None
        else (piece.document.array(array, [piece.points, 1], GHOSTS)[:, 0].astype(np.uint8) & HIDDEN_POINT) != 0
        for piece, array in zip(pieces, ghosts, strict=True)
    ])  # fmt: skip
    marked, count = without_where(values.T, lambda *_: hidden)
    return marked.T, noted(count, f"array {GHOSTS}")
