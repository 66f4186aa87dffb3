"""VTK's XML files: arrays that stand inline or appended, as text or bytes, packed or not, in pieces of a whole.

Read here and not by VTK, whose reader ends the process on a corrupt packed array (std::bad_alloc); the tests hold it
against VTK's writer.
"""

from __future__ import annotations

import os
import re
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.colors import colored, is_colored, with_color
from texvol.formats.readers.missing import noted, without_chosen, without_where
from texvol.formats.readers.samples import Choice, FileFault, by, check_size, pick
from texvol.formats.readers.vti_arrays import Appended, read_array

_TYPES = {"Int8": "i1", "Int16": "i2", "Int32": "i4", "Int64": "i8", "Float32": "f4", "Float64": "f8"}
_TYPES |= {"UInt8": "u1", "UInt16": "u2", "UInt32": "u4", "UInt64": "u8"}
_COLOR_NAMES = ("rgb", "rgba", "color", "colors", "colour", "colours")
_GHOSTS, _HIDDEN_POINT, _HIDDEN_CELL = "vtkGhostType", 2, 32  # vtkDataSetAttributes
_HINT = "; --variable NAME chooses"
_LONGEST_HEADER = 2**20  # bytes in which appended data begin, unless other arrays stand inline before them


class Whole(NamedTuple):
    """Structured grid of a VTK file: the result of `read_whole`."""

    root: ElementTree.Element
    grid: ElementTree.Element
    appended: Appended | None
    extent: list[int]
    pieces: list[ElementTree.Element]
    at_points: bool
    values: NDArray
    notes: tuple[str, ...]
    colors: NDArray | None = None

    def array(
        self, piece: ElementTree.Element, array: ElementTree.Element | None, sizes: list[int], what: str
    ) -> NDArray:
        """Return another array of a piece, such as its coordinates; the last size is the number of components."""
        if array is None:
            raise FileFault(f"its piece of extent {piece.get('Extent')} has no {what}")
        dtype, components = _type(array, self.root)
        check_size(sizes, dtype.itemsize)
        if components != sizes[-1]:
            raise FileFault(f"its {what} must have {sizes[-1]} components, got {components}")
        return read_array(array, self.root, self.appended, dtype, sizes)


def read_whole(path: str, kind: str, choice: Choice) -> Whole:
    """Return the samples of a file of VTK's type `kind`: at its points, or at its cells if only these have values."""
    root, appended = _document(path)
    grid = root.find(kind)
    if root.tag != "VTKFile" or root.get("type") != kind or grid is None:
        raise FileFault(f"must be VTK XML of type {kind}, got {root.get('type')}")
    extent = extent_of(grid.get("WholeExtent"))
    pieces = grid.findall("Piece")
    at_points = any(piece.find("PointData/DataArray") is not None for piece in pieces)
    data = [piece.find("PointData" if at_points else "CellData") for piece in pieces]
    if not pieces:
        raise FileFault("has no Piece, and therefore no samples")
    arrays = [_array(each, choice.variable) for each in data]
    dtype, components = _type(arrays[0], root)
    sizes = [*sizes_of(extent, at_points), components]
    check_size(sizes, dtype.itemsize)
    said = _color_name(arrays[0], data[0]) if kind == "ImageData" else ""
    axes = with_color("ZYXC", sizes, 3, choice, said)
    index = pick(axes, sizes, choice)
    values = _assembled(root, appended, extent, pieces, arrays, dtype, sizes, at_points)
    names = [array.get("Name", "") for array in data[0].findall("DataArray")] if data[0] is not None else []
    others = [name for name in names if name != arrays[0].get("Name", "")]
    notes = (f"array {arrays[0].get('Name')}; others: {', '.join(others)}",) if others else ()
    whole = Whole(root, grid, appended, extent, pieces, at_points, values[index], notes)
    if is_colored(axes):
        found = colored(whole.values, axes, index, said)
        return whole._replace(**found | {"notes": (*notes, *found["notes"])})
    marked, about = _without_blank(whole, data, sizes, choice)
    if kind != "ImageData":  # before the grid is resampled to a regular one
        marked, more = without_chosen(marked, choice)
        about += more
    return whole._replace(values=marked, notes=(*notes, *about))


def _without_blank(
    whole: Whole, data: list[ElementTree.Element | None], sizes: list[int], choice: Choice
) -> tuple[NDArray, tuple[str, ...]]:
    """Return values without the points or cells that VTK's array of ghosts hides, and notes."""
    ghosts = [None if each is None else each.find(f"DataArray[@Name='{_GHOSTS}']") for each in data]
    if choice.labels or any(array is None for array in ghosts):
        return whole.values, ()
    found = [array for array in ghosts if array is not None]
    what = (whole.root, whole.appended, whole.extent, whole.pieces, found)
    kinds = _assembled(*what, np.dtype(np.uint8), [*sizes[:3], 1], whole.at_points)[..., 0]
    bit = _HIDDEN_POINT if whole.at_points else _HIDDEN_CELL
    marked, count = without_where(whole.values, lambda number, part: (kinds[number] & bit) != 0)
    return marked, noted(count, f"array {_GHOSTS}")


def _document(path: str) -> tuple[ElementTree.Element, Appended | None]:
    """Return the XML up to the appended data, and the location of the appended data."""
    with open(path, "rb") as file:
        check_size([os.fstat(file.fileno()).st_size], 1)
        text = file.read(_LONGEST_HEADER)
        if b"<AppendedData" not in text:
            text += file.read()
        if b"<!DOCTYPE" in text[:_LONGEST_HEADER]:
            raise FileFault("has a document type declaration, which no VTK file needs")
        appended = None
        found = re.search(rb"<AppendedData\b([^>]*)>\s*_", text)
        if found:
            file.seek(found.end())
            is_raw = re.search(rb"encoding\s*=\s*[\"']raw[\"']", found.group(1)) is not None
            appended = Appended(path, found.end(), is_raw)
            text = text[: found.start()] + b"</VTKFile>"
    return ElementTree.fromstring(text), appended


def extent_of(text: str | None) -> list[int]:
    numbers = [int(word) for word in (text or "").split()]
    if len(numbers) != 6 or max(abs(number) for number in numbers) > 2**40:
        raise FileFault(f"an extent must be six whole numbers, got {text!r}")
    return numbers


def sizes_of(extent: list[int], at_points: bool) -> list[int]:
    """Return the numbers of samples of an extent, slowest axis first."""
    return [extent[2 * axis + 1] - extent[2 * axis] + (1 if at_points else 0) for axis in (2, 1, 0)]


def _array(data: ElementTree.Element | None, wanted: str | None) -> ElementTree.Element:
    """Return the array named `wanted`, or the one marked as scalars, or the only one."""
    arrays = [] if data is None else [each for each in data.findall("DataArray") if each.get("Name") != _GHOSTS]
    named = {array.get("Name", ""): array for array in arrays}
    if wanted is not None and wanted not in named:
        raise FileFault(f"has no array {wanted} (--variable); it has {', '.join(named) or 'none'}")
    if wanted is not None:
        return named[wanted]
    if data is not None and data.get("Scalars") in named:
        return named[data.get("Scalars", "")]
    if len(arrays) == 1:
        return arrays[0]
    raise FileFault(f"has no array marked as Scalars; it has {', '.join(named) or 'none'}{_HINT if named else ''}")


def _color_name(array: ElementTree.Element, data: ElementTree.Element | None) -> str:
    """Return the mark of an array as colour, or "": VTK shows arrays of bytes as colours, and others as numbers."""
    name = array.get("Name", "")
    if data is not None and name and name in (data.get("Vectors"), data.get("Normals")):
        return ""
    if name.lower() in _COLOR_NAMES:
        return f"array {name}"
    return "components of bytes" if array.get("type") == "UInt8" else ""


def _type(array: ElementTree.Element, root: ElementTree.Element) -> tuple[np.dtype, int]:
    code = _TYPES.get(array.get("type", ""))
    if code is None:
        raise FileFault(f"its array {array.get('Name')!r} must hold numbers, got type {array.get('type')}")
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    return np.dtype(order + code), int(array.get("NumberOfComponents", 1))


def _assembled(
    root: ElementTree.Element,
    appended: Appended | None,
    extent: list[int],
    pieces: list[ElementTree.Element],
    arrays: list[ElementTree.Element],
    dtype: np.dtype,
    sizes: list[int],
    at_points: bool,
) -> NDArray:
    """Return the whole array from one piece or from several that cover it."""
    values = None
    covered = None
    for piece, array in zip(pieces, arrays, strict=True):
        part_extent = extent_of(piece.get("Extent"))
        part_sizes = [*sizes_of(part_extent, at_points), sizes[3]]
        inside = all(extent[at] <= part_extent[at] and part_extent[at + 1] <= extent[at + 1] for at in range(0, 6, 2))
        if not inside or min(part_sizes) < 1 or _type(array, root) != (dtype, sizes[3]):
            raise FileFault(f"its piece of extent {piece.get('Extent')} does not fit into the whole")
        part = read_array(array, root, appended, dtype, part_sizes)
        if part_sizes == sizes:
            return part
        if values is None or covered is None:
            values, covered = np.empty(sizes, dtype), np.zeros(sizes[:3], np.bool_)
        begin = [part_extent[2 * axis] - extent[2 * axis] for axis in (2, 1, 0)]
        where = tuple(slice(at, at + size) for at, size in zip(begin, part_sizes[:3], strict=True))
        values[where], covered[where] = part, True
    if values is None or covered is None or not covered.all():
        raise FileFault(f"its pieces do not cover its extent of {by(sizes[2::-1])} samples")
    return values
