"""Unstructured grids in the files that meshio reads: legacy VTK, Gmsh, XDMF and MED."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import BytesIO, StringIO
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers import hdf5_files, legacy_vtk
from texvol.formats.readers.child_process import forked
from texvol.formats.readers.samples import Choice, FileFault, Samples
from texvol.formats.readers.splitting import SHAPES
from texvol.formats.readers.unstructured import Cells, Field, chosen_name, samples_of, tetrahedral
from texvol.scene.tetrahedra import TetrahedralGrid
from texvol.util import reach
from texvol.util.terminal import library_reason

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

_PATIENCE, _PATIENCE_PER_BYTE = 5.0, 5e-6  # seconds: text is read some twenty times as fast
_LONGEST_NAME = 4096  # letters that the system takes
# Bytes of memory for each byte of a file: a digit and a space in a text make a number in a list, of some 40 bytes, and
# compressed data may unpack to as many.
_MEMORY_PER_BYTE, _LEAST_MEMORY = 64, 2**27
_KINDS = {"tetra": "tetrahedron", "pyramid": "pyramid", "wedge": "wedge", "hexahedron": "hexahedron", "voxel": "voxel"}
_KINDS |= {"vertex": "vertices", "line": "lines", "triangle": "triangles", "quad": "quadrilaterals"}
_KINDS |= {"pixel": "quadrilaterals", "polygon": "polygons"}
_TAGS = "gmsh:dim_tags"  # of points, by meshio: no field
_LEGACY = b"# vtk DataFile"


class _Mesh(NamedTuple):
    """Points, shape (n, 3), blocks of cells as meshio's type and corners, and values by name."""

    points: NDArray
    blocks: list[tuple[str, NDArray]]
    at_points: dict[str, NDArray]
    in_cells: dict[str, NDArray]


def read(path: str, choice: Choice) -> Samples:
    """Return samples on a regular grid of a field at the points of a grid, or in its cells."""
    if _legacy_kind(path) in legacy_vtk.KINDS:
        return legacy_vtk.read(path, choice)
    grid, notes = tetrahedra(path, choice)
    return samples_of(grid, notes, choice)


def tetrahedra(path: str, choice: Choice) -> tuple[TetrahedralGrid, tuple[str, ...]]:
    """Return the field of a file on tetrahedra, and notes."""
    kind = _legacy_kind(path)
    if kind in legacy_vtk.KINDS:
        raise FileFault(f"is legacy VTK of {kind}, whose samples are on a grid: it has no tetrahedra")
    if kind not in ("UNSTRUCTURED_GRID", None):
        kinds = ", ".join(("UNSTRUCTURED_GRID", *legacy_vtk.KINDS))
        raise FileFault(f"is legacy VTK of {kind or 'an unknown kind'}, of which texvol reads {kinds}")
    mesh = _read(path)
    named = {name: True for name in mesh.at_points if name != _TAGS}
    for name in mesh.in_cells:
        named.setdefault(name, False)
    name, notes = chosen_name(named, choice.variable)
    values = mesh.at_points[name] if named[name] else mesh.in_cells[name]
    wanted = len(mesh.points) if named[name] else sum(len(corners) for _, corners in mesh.blocks)
    if len(values) != wanted:
        raise FileFault(f"its array {name} must have {wanted} values, got {len(values)}")
    field = Field(_native(values.reshape(wanted, -1)), named[name], name)
    grid, about = tetrahedral(mesh.points.astype(np.float64), _cells(mesh.blocks), field, choice)
    return grid, (*notes, *about)


def _native(values: NDArray) -> NDArray:
    """Return values in the machine's byte order."""
    return values.astype(values.dtype.newbyteorder("="))


def _cells(blocks: Sequence[tuple[str, NDArray]]) -> list[Cells]:
    found, place = [], 0
    for name, corners in blocks:
        kind = _KINDS.get(_base(name))
        if kind is None:
            raise FileFault(f"has cells of type {name}, which texvol does not read")
        places = np.arange(place, place + len(corners))
        place += len(corners)
        count = SHAPES[kind].corners if kind in SHAPES else 0
        if count and (corners.ndim != 2 or corners.shape[1] < count or corners.dtype.kind not in "iu"):
            raise FileFault(f"a {kind} must have {count} corners, got {corners.dtype} of {corners.shape}")
        found.append(Cells(kind, corners[:, :count], places, _base(name) != name and kind in SHAPES))
    return found


def _read(path: str) -> _Mesh:
    """Return what meshio reads of a file, in a process of its own.

    meshio trusts the numbers in a file: there it may loop, exit, or ask for any memory, and HDF5 may crash.
    """
    read_file, size = _reader_for(path), sum(map(os.path.getsize, _files_of(path)))

    def work(output: Connection) -> None:
        try:
            _limit_memory(size)
            with redirect_stderr(StringIO()), redirect_stdout(StringIO()):
                message = _packed(read_file(path))
        except MemoryError:
            message = b"-its data need more memory than a sound file of its size"
        except BaseException as error:  # SystemExit is meshio's answer to some faults
            message = f"-cannot be read: {library_reason(str(error) or type(error).__name__)}".encode()
        output.send_bytes(message)

    seconds = _PATIENCE + _PATIENCE_PER_BYTE * size
    with forked(work) as child:
        try:
            message = child.take(seconds)
        except TimeoutError:
            raise FileFault(f"is corrupt or too large: meshio does not read it within {seconds:.3g} seconds") from None
        except EOFError as end:
            raise FileFault(f"is corrupt: reading it crashes the library ({end})") from None
    if message.startswith(b"-"):
        raise FileFault(message[1:].decode("utf-8", "replace"))
    return _unpacked(message)


def _files_of(path: str) -> list[str]:
    """Return a file, and the files with numbers that an XDMF file names.

    Raises
    ------
    InputError
        If one is out of reach, see `texvol.util.reach`.
    """
    files = [path]
    if path.lower().endswith((".xdmf", ".xmf")):
        # meshio looks for HDF5 beside the file that a link leads to, and for Binary in the working directory.
        folders = {os.path.dirname(path), os.path.dirname(os.path.realpath(path)), "."}
        named = {os.path.join(folder, name) for folder in folders for name in _names_in_xdmf(path)}
        files += [name for name in sorted(named) if os.path.isfile(name)]
    for each in files:
        reach.check(each)
        hdf5_files.check(each)
    return files


def _names_in_xdmf(path: str) -> set[str]:
    """Return the texts that may be names: whole, as of Binary, and up to a colon, as of HDF."""
    texts = set()
    with suppress(ElementTree.ParseError), open(path, "rb") as file:  # meshio tells what is wrong
        for _, element in ElementTree.iterparse(file):
            text = (element.text or "").strip()[: _LONGEST_NAME + 1]
            texts |= {text, text.split(":")[0]}
            element.clear()
    return {each for each in texts if 0 < len(each) <= _LONGEST_NAME}


def _limit_memory(size: int) -> None:
    """Limit the memory of this process to what a file of a size may need, beyond what the process has."""
    import resource

    with open("/proc/self/statm", encoding="ascii") as numbers:
        held = int(numbers.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    most = held + _LEAST_MEMORY + _MEMORY_PER_BYTE * size
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _packed(mesh: Any) -> bytes:
    """Return a mesh as bytes: names as JSON, and arrays, which are numbers, in numpy's format."""
    arrays = [np.asarray(mesh.points)]
    for block in mesh.cells:
        arrays.append(np.asarray(block.data) if _is_solid(block.type) else np.empty((len(block.data), 0)))
    names: list[dict[str, int]] = [{}, {}]
    in_cells = {name: _whole(parts) for name, parts in mesh.cell_data.items()}
    for held, data in zip(names, (mesh.point_data, in_cells), strict=True):
        for name, values in data.items():
            held[name] = len(arrays)
            arrays.append(np.asarray(values))
    target = BytesIO()
    told = json.dumps({"types": [block.type for block in mesh.cells], "names": names}).encode()
    np.save(target, np.frombuffer(told, np.uint8))
    for array in arrays:
        np.save(target, array, allow_pickle=False)
    return b"+" + target.getvalue()


def _unpacked(message: bytes) -> _Mesh:
    source = BytesIO(message[1:])
    told = json.loads(np.load(source).tobytes())
    count = 1 + len(told["types"]) + sum(map(len, told["names"]))
    arrays = [np.load(source, allow_pickle=False) for _ in range(count)]
    fields = [{name: arrays[number] for name, number in held.items()} for held in told["names"]]
    return _Mesh(arrays[0], list(zip(told["types"], arrays[1:], strict=False)), *fields)


def _whole(parts: Sequence[NDArray]) -> NDArray:
    """Return values of all cells from those of each block."""
    return np.concatenate([np.asarray(part).reshape(len(part), -1) for part in parts])


def _is_solid(name: str) -> bool:
    return _KINDS.get(_base(name)) in SHAPES


def _base(name: str) -> str:
    """Return the type of a cell without its number of nodes."""
    return re.sub(r"\d+$", "", name)


def _reader_for(path: str) -> Callable[[str], Any]:
    """Return meshio's function for the content of a file."""
    import meshio

    with open(path, "rb") as file:
        head = file.read(2**16)
    if head.startswith(_LEGACY):
        return meshio.vtk.read
    if head.startswith(b"$"):
        return meshio.gmsh.read
    import h5py  # noqa: F401 - here, as an import in the process would take long

    if head.startswith(b"\x89HDF"):
        return meshio.med.read
    if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
        raise FileFault("has a document type declaration, which texvol does not read")
    return meshio.xdmf.read


def _legacy_kind(path: str) -> str | None:
    """Return the kind of data set of a legacy VTK file; None of another file."""
    with open(path, "rb") as file:
        head = file.read(2**16)
    return legacy_vtk.kind_of(head) if head.startswith(_LEGACY) else None
