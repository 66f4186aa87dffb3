"""VTK's XML files: arrays that stand inline or appended, as text or bytes, packed or not, in pieces of a whole.

Read here and not by VTK, whose reader ends the process on a corrupt packed array (std::bad_alloc); the tests hold it
against VTK's writer.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.colors import colored, is_colored, with_color
from texvol.formats.readers.missing import noted, without_chosen, without_where
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, pick
from texvol.formats.readers.vti_arrays import Appended, Document

_COLOR_NAMES = ("rgb", "rgba", "color", "colors", "colour", "colours")
GHOSTS, HIDDEN_POINT, HIDDEN_CELL = "vtkGhostType", 2, 32  # vtkDataSetAttributes
_HINT = "; --variable NAME chooses"
_LONGEST_HEADER = 2**20  # bytes in which appended data begin, unless other arrays stand inline before them


class Grid:
    """Structured grid of a VTK file of type `kind`, with samples at its points, or at its cells if only these have."""

    def __init__(self, path: str, kind: str) -> None:
        self.document = document_of(path, kind)
        self.extent = extent_of(self.document.data.get("WholeExtent"))
        self.pieces = self.document.data.findall("Piece")
        self.at_points = any(piece.find("PointData/DataArray") is not None for piece in self.pieces)
        if not self.pieces:
            raise FileFault("has no Piece, and therefore no samples")

    def assembled(
        self,
        arrays: Iterable[Element],
        components: int,
        *,
        at_points: bool,
        dtype: np.dtype | None = None,
        what: str = "",
    ) -> NDArray:
        """Return the whole of an array from the one piece that has it, or from several that cover it.

        The arrays of the pieces must be of type `dtype`; without it they are converted to that of the first, and `what`
        is their name in messages.
        """
        sizes = [*sizes_of(self.extent, at_points), components]
        values = covered = None
        for piece, array in zip(self.pieces, arrays, strict=True):
            extent, whole = extent_of(piece.get("Extent")), self.extent
            part_sizes = [*sizes_of(extent, at_points), components]
            inside = all(whole[at] <= extent[at] and extent[at + 1] <= whole[at + 1] for at in range(0, 6, 2))
            is_like = dtype is None or self.document.type_of(array) == (dtype, components)
            if not inside or min(part_sizes) < 1 or not is_like:
                raise FileFault(f"its piece of extent {piece.get('Extent')} does not fit into the whole")
            part = self.document.array(array, part_sizes, what)
            if part_sizes == sizes:
                return part
            if values is None or covered is None:
                check_size(sizes, part.dtype.itemsize)
                values, covered = np.empty(sizes, part.dtype), np.zeros(sizes[:3], np.bool_)
            begin = [extent[2 * axis] - whole[2 * axis] for axis in (2, 1, 0)]
            where = tuple(slice(at, at + size) for at, size in zip(begin, part_sizes[:3], strict=True))
            values[where], covered[where] = part, True
        if values is None or covered is None or not covered.all():
            raise FileFault(f"its pieces do not cover its extent of {by(sizes[2::-1])} samples")
        return values


def read_whole(path: str, kind: str, choice: Choice) -> tuple[Grid, Samples]:
    """Return the grid of a file of VTK's type `kind`, and its samples without their positions."""
    grid = Grid(path, kind)
    found = [piece.find("PointData" if grid.at_points else "CellData") for piece in grid.pieces]
    data = [Element("none") if each is None else each for each in found]
    arrays = [_array(each, choice.variable) for each in data]
    dtype, components = grid.document.type_of(arrays[0])
    sizes = [*sizes_of(grid.extent, grid.at_points), components]
    check_size(sizes, dtype.itemsize)
    said = _color_name(arrays[0], data[0]) if kind == "ImageData" else ""
    axes = with_color("ZYXC", sizes, 3, choice, said)
    index = pick(axes, sizes, choice)
    values = grid.assembled(arrays, components, at_points=grid.at_points, dtype=dtype)[index]
    names = [array.get("Name", "") for array in data[0].findall("DataArray")]
    others = [name for name in names if name != arrays[0].get("Name", "")]
    notes = (f"array {arrays[0].get('Name')}; others: {', '.join(others)}",) if others else ()
    if is_colored(axes):
        samples = Samples(**colored(values, axes, index, said))
        return grid, samples._replace(notes=(*notes, *samples.notes))
    marked, about = _without_blank(grid, values, data, choice)
    if kind != "ImageData":  # before the grid is resampled to a regular one
        marked, more = without_chosen(marked, choice)
        about += more
    return grid, Samples(marked, notes=(*notes, *about))


def _without_blank(
    grid: Grid, values: NDArray, data: Sequence[Element], choice: Choice
) -> tuple[NDArray, tuple[str, ...]]:
    """Return values without the points or cells that VTK's array of ghosts hides, and notes."""
    found = (each.find(f"DataArray[@Name='{GHOSTS}']") for each in data)
    ghosts = [array for array in found if array is not None]
    if choice.labels or len(ghosts) < len(data):
        return values, ()
    kinds = grid.assembled(ghosts, 1, at_points=grid.at_points, dtype=np.dtype(np.uint8))[..., 0]
    bit = HIDDEN_POINT if grid.at_points else HIDDEN_CELL
    marked, count = without_where(values, lambda number, part: (kinds[number] & bit) != 0)
    return marked, noted(count, f"array {GHOSTS}")


def document_of(path: str, kind: str) -> Document:
    """Return the XML of a file of VTK's type `kind` up to the appended data; raise FileFault if it is of another."""
    with open(path, "rb") as file:
        check_size([os.fstat(file.fileno()).st_size], 1)
        text = file.read(_LONGEST_HEADER)
        if b"<AppendedData" not in text:
            text += file.read()
        if b"<!DOCTYPE" in text[:_LONGEST_HEADER]:
            raise FileFault("has a document type declaration, which no VTK file needs")
    appended = None
    if found := re.search(rb"<AppendedData\b([^>]*)>\s*_", text):
        is_raw = re.search(rb"encoding\s*=\s*[\"']raw[\"']", found.group(1)) is not None
        appended = Appended(path, found.end(), is_raw)
        text = text[: found.start()] + b"</VTKFile>"
    root = ElementTree.fromstring(text)
    data = root.find(kind)
    if root.tag != "VTKFile" or root.get("type") != kind or data is None:
        raise FileFault(f"must be VTK XML of type {kind}, got {root.get('type')}")
    return Document(root, data, appended)


def extent_of(text: str | None) -> list[int]:
    numbers = [int(word) for word in (text or "").split()]
    if len(numbers) != 6 or max(abs(number) for number in numbers) > 2**40:
        raise FileFault(f"an extent must be six whole numbers, got {text!r}")
    return numbers


def sizes_of(extent: list[int], at_points: bool) -> list[int]:
    """Return the numbers of samples of an extent, slowest axis first."""
    return [extent[2 * axis + 1] - extent[2 * axis] + (1 if at_points else 0) for axis in (2, 1, 0)]


def _array(data: Element, wanted: str | None) -> Element:
    """Return the array named `wanted`, or the one marked as scalars, or the only one."""
    arrays = [each for each in data.findall("DataArray") if each.get("Name") != GHOSTS]
    named = {array.get("Name", ""): array for array in arrays}
    chosen = data.get("Scalars") if wanted is None else wanted
    if chosen is not None and chosen in named:
        return named[chosen]
    if wanted is not None:
        raise FileFault(f"has no array {wanted} (--variable); it has {', '.join(named) or 'none'}")
    if len(arrays) == 1:
        return arrays[0]
    raise FileFault(f"has no array marked as Scalars; it has {', '.join(named) or 'none'}{_HINT if named else ''}")


def _color_name(array: Element, data: Element) -> str:
    """Return the mark of an array as colour, or "": VTK shows arrays of bytes as colours, and others as numbers."""
    name = array.get("Name", "")
    if name and name in (data.get("Vectors"), data.get("Normals")):
        return ""
    if name.lower() in _COLOR_NAMES:
        return f"array {name}"
    return "components of bytes" if array.get("type") == "UInt8" else ""
