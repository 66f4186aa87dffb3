"""Sound unstructured grids for `fuzz.py`: VTU in every coding, Exodus, and the files that meshio writes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from support.fuzzing.seeds import Seed, of
from support.mesh_files import HEXAHEDRON, TETRAHEDRON, exodus, hexahedra, unstructured, written

_CODINGS = (("ascii", "plain", 1), ("binary", "zlib", 1), ("appended", "plain", 0), ("appended", "lz4", 1))
_POINTS, _CELLS = hexahedra((2, 1, 1), seed=1)
_TETRAHEDRA = _CELLS[:, [0, 1, 3, 4]]
_VALUES = np.arange(12.0)


def seeds() -> Iterator[Seed]:
    """Two hexahedra, and a tetrahedron in each, with values at points and in cells."""
    for mode, packer, base64 in _CODINGS:
        grid = unstructured(
            _POINTS, [(HEXAHEDRON, _CELLS), (TETRAHEDRON, _TETRAHEDRA)], _VALUES, of_cells=np.arange(4, dtype="i4")
        )
        yield of(
            "vtu", "v.vtu",
            lambda path, coding=(mode, packer, base64), grid=grid: written(path, grid, *coding[:2], base64=coding[2]),
            text=mode == "ascii",
        )  # fmt: skip
    yield of("exodus", "v.e", lambda path: exodus(path, steps=1))
    yield of("exodus", "v.exo", exodus, "series")
    for kind, name, module, told in (
        ("vtk", "v.vtk", "vtk", {"binary": False}),
        ("vtk", "v.vtk", "vtk", {"binary": True}),
        ("gmsh", "v.msh", "gmsh", {"binary": False, "fmt_version": "2.2"}),
        ("gmsh", "v.msh", "gmsh", {"binary": True, "fmt_version": "4.1"}),
        ("xdmf", "v.xdmf", "xdmf", {"data_format": "XML"}),
        ("med", "v.med", "med", {}),
    ):
        text = not told.get("binary", True) or kind == "xdmf"
        yield of(kind, name, lambda path, module=module, told=told: write_mesh(path, module, **told), text=text)


def write_mesh(path: Path, module: str, **told: Any) -> None:
    """Write hexahedra with the values 0 … 11 at their points, by a module of meshio."""
    mesh = meshio.Mesh(_POINTS, [("hexahedron", _CELLS)], point_data={"values": _VALUES})
    with redirect_stderr(StringIO()):
        getattr(meshio, module).write(str(path), mesh, **told)
    if not told.get("binary", True):  # meshio 5.3 writes what numpy 2 calls its numbers
        path.write_bytes(re.sub(rb"np\.float64\(([^)]*)\)", rb"\1", path.read_bytes()))
