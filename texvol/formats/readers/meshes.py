"""Unstructured grids in the files that meshio reads: legacy VTK, Gmsh, XDMF and MED."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.samples import Choice, FileFault, Samples
from texvol.formats.readers.splitting import SHAPES
from texvol.formats.readers.unstructured import Cells, Field, chosen_name, samples_of, tetrahedral
from texvol.scene.tetrahedra import TetrahedralGrid
from texvol.util.terminal import library_reason

_KINDS = {"tetra": "tetrahedron", "pyramid": "pyramid", "wedge": "wedge", "hexahedron": "hexahedron", "voxel": "voxel"}
_KINDS |= {"vertex": "vertices", "line": "lines", "triangle": "triangles", "quad": "quadrilaterals"}
_KINDS |= {"pixel": "quadrilaterals", "polygon": "polygons"}
_STRUCTURED = "save it as VTI, VTR or VTS, in ParaView by File, Save Data"


def read(path: str, choice: Choice) -> Samples:
    """Return samples on a regular grid of a field at the points of a grid, or in its cells."""
    grid, notes = tetrahedra(path, choice)
    return samples_of(grid, notes, choice)


def tetrahedra(path: str, choice: Choice) -> tuple[TetrahedralGrid, tuple[str, ...]]:
    """Return the field of a file on tetrahedra, and notes."""
    mesh = _read(path)
    named = {name: True for name in mesh.point_data}
    for name in mesh.cell_data:
        named.setdefault(name, False)
    name, notes = chosen_name(named, choice.variable)
    points = np.asarray(mesh.points, np.float64)
    cells = _cells(mesh.cells)
    if named[name]:
        values = np.asarray(mesh.point_data[name])
        wanted = len(points)
    else:
        parts = [np.asarray(part).reshape(len(block.data), -1) for part, block in
                 zip(mesh.cell_data[name], mesh.cells, strict=True)]  # fmt: skip
        values, wanted = np.concatenate(parts), sum(len(block.data) for block in mesh.cells)
    if len(values) != wanted:
        raise FileFault(f"its array {name} must have {wanted} values, got {len(values)}")
    field = Field(_native(values.reshape(wanted, -1)), named[name], name)
    grid, about = tetrahedral(points, cells, field, choice)
    return grid, (*notes, *about)


def _native(values: NDArray) -> NDArray:
    """Return values in the machine's byte order."""
    return values.astype(values.dtype.newbyteorder("="))


def _cells(blocks: Sequence[Any]) -> list[Cells]:
    found, place = [], 0
    for block in blocks:
        base = re.sub(r"\d+$", "", block.type)
        kind = _KINDS.get(base)
        if kind is None:
            raise FileFault(f"has cells of type {block.type}, which texvol does not read")
        places = np.arange(place, place + len(block.data))
        place += len(block.data)
        count = SHAPES[kind].corners if kind in SHAPES else 0
        corners = np.asarray([] if not count else block.data)
        if count and (corners.ndim != 2 or corners.shape[1] < count or corners.dtype.kind not in "iu"):
            raise FileFault(f"a {kind} must have {count} corners, got {corners.dtype} of {corners.shape}")
        taken = corners[:, :count] if count else np.empty((len(places), 0), np.intp)
        found.append(Cells(kind, taken, places, base != block.type and kind in SHAPES))
    return found


def _read(path: str) -> Any:
    """Return meshio's mesh; its warnings, which it prints, are dropped, and what it raises becomes an error."""
    import meshio

    with open(path, "rb") as file:
        head = file.read(2**16)
    if head.startswith(b"# vtk DataFile"):
        _check_legacy(head)
        read_file = meshio.vtk.read
    elif head.startswith(b"$"):
        read_file = meshio.gmsh.read
    elif head.startswith(b"\x89HDF"):
        import h5py

        # The library may crash on a damaged file.
        check_survived(lambda: h5py.File(os.path.abspath(path), "r").close())
        read_file = meshio.med.read
    else:
        if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
            raise FileFault("has a document type declaration, which texvol does not read")
        read_file = meshio.xdmf.read
    printed = io.StringIO()
    try:
        with redirect_stderr(printed), redirect_stdout(printed):
            mesh = read_file(path)
    except SystemExit:  # meshio's answer to some faults
        raise FileFault(f"cannot be read: {library_reason(printed.getvalue())}") from None
    return mesh


def _check_legacy(head: bytes) -> None:
    """Raise FileFault unless a legacy VTK file holds an unstructured grid."""
    found = re.search(rb"^\s*DATASET\s+(\w+)", head, re.MULTILINE | re.IGNORECASE)
    kind = found.group(1).decode("ascii", "replace").upper() if found else "an unknown kind"
    if kind != "UNSTRUCTURED_GRID":
        raise FileFault(f"is legacy VTK of {kind}, of which texvol reads UNSTRUCTURED_GRID alone; {_STRUCTURED}")
