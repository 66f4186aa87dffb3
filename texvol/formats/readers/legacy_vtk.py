"""Legacy VTK of structured points, rectilinear and structured grids: lines of keywords, and arrays as text or bytes.

    DATASET STRUCTURED_POINTS | RECTILINEAR_GRID | STRUCTURED_GRID, and its grid
    POINT_DATA n, CELL_DATA n, and arrays after each: SCALARS, VECTORS, FIELD, …

Bytes are big-endian. The arrays have to be passed over in their order to be found; only the chosen one is kept.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from math import prod
from typing import IO, NamedTuple
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.curvilinear import middles, on_points
from texvol.formats.readers.rectilinear import axis_between, axis_of, on_axes
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_size, native, pick
from texvol.formats.readers.unstructured import chosen_name

KINDS = ("STRUCTURED_POINTS", "RECTILINEAR_GRID", "STRUCTURED_GRID")
_TYPES = {"unsigned_char": "u1", "char": "i1", "unsigned_short": "u2", "short": "i2", "unsigned_int": "u4", "int": "i4"}
_TYPES |= {"unsigned_long": "u8", "long": "i8", "vtktypeuint64": "u8", "vtktypeint64": "i8", "vtkidtype": "i8"}
_COLOR = "color"  # bytes; as text, fractions of 255
_TYPES |= {"float": "f4", "double": "f8", "bit": "bit", _COLOR: _COLOR}
_COMPONENTS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}
_LONGEST_LINE = 2**16
_KIND = re.compile(rb"^\s*DATASET\s+(\w+)", re.MULTILINE | re.IGNORECASE)


class _Array(NamedTuple):
    """Array of a file: where its numbers begin, their type or "bit", and how many there are."""

    begin: int
    code: str
    numbers: int
    components: int = 1
    is_text: bool = False


def kind_of(head: bytes) -> str:
    """Return the kind of data set of a legacy VTK file by its first bytes, "" if they do not say."""
    found = _KIND.search(head)
    return found.group(1).decode("ascii", "replace").upper() if found else ""


def read(path: str, choice: Choice) -> Samples:
    """Return the samples at the points of a structured data set, or in its cells if only these have values."""
    with open(path, "rb") as file:
        document = _Document(file)
        at_points, arrays = document.at_points, document.arrays
        name, notes = chosen_name(dict.fromkeys(arrays, at_points), choice.variable, document.scalars)
        array = arrays[name]
        sizes = [size if at_points else max(size - 1, 1) for size in document.sizes[::-1]]
        if array.numbers != prod(sizes) * array.components:
            said = f"{array.numbers} numbers, but the dimensions need {prod(sizes) * array.components}"
            raise FileFault(f"its array {name} has {said}")
        axes = "ZYXC" if array.components > 1 else "ZYX"
        shape = [*sizes, array.components][: len(axes)]
        index = pick(axes, shape, choice)
        values = document.numbers(array).reshape(shape)[index]
        values = values.copy() if array.components > 1 else values
        return document.placed(values, choice)._replace(notes=notes)


class _Document:
    """Keywords of a file, and the arrays at its points, or in its cells if only these have some."""

    def __init__(self, file: IO[bytes]) -> None:
        self.file, self.size = file, os.fstat(file.fileno()).st_size
        self._line(), self._line()
        self.is_text = next(self._keywords(), [""])[0].upper() == "ASCII"
        self.kind, self.sizes, self.told = "", (0, 0, 0), dict[str, list[float]]()
        self.grid = dict[str, _Array]()
        self.of_points, self.of_cells = dict[str, _Array](), dict[str, _Array]()
        self.marked: dict[bool, str] = {}
        target, in_points, count = dict[str, _Array](), True, 0
        for words in self._keywords():
            key = words[0].upper()
            if key in ("POINT_DATA", "CELL_DATA"):
                in_points, count = key == "POINT_DATA", int(words[1])
                target = self.of_points if in_points else self.of_cells
                continue
            if count == 0 and self._is_of_grid(key, words):
                continue
            for name, array in self._arrays(key, words, count):
                target.setdefault(name, array)
                if key in ("SCALARS", "COLOR_SCALARS"):
                    self.marked.setdefault(in_points, name)

    @property
    def at_points(self) -> bool:
        """True if there are arrays at points."""
        return bool(self.of_points)

    @property
    def arrays(self) -> dict[str, _Array]:
        """Arrays at points, or in cells if there are none at points."""
        return self.of_points or self.of_cells

    @property
    def scalars(self) -> str | None:
        """Name of the array that is marked as scalars."""
        return self.marked.get(self.at_points)

    def placed(self, values: NDArray, choice: Choice) -> Samples:
        """Return samples on a regular grid."""
        if self.kind == "STRUCTURED_POINTS":
            spacing = self.told.get("SPACING") or self.told.get("ASPECT_RATIO") or [1.0, 1.0, 1.0]
            origin = np.array(self.told.get("ORIGIN") or [0.0, 0.0, 0.0])
            first = [0.0 if self.at_points or size == 1 else 0.5 for size in self.sizes]
            return Samples(values, spacing, (origin + np.multiply(first, spacing)).tolist())
        if self.kind == "RECTILINEAR_GRID":
            found = [self._of_grid(f"{name}_COORDINATES", size) for name, size in zip("XYZ", self.sizes, strict=True)]
            between = axis_of if self.at_points else axis_between
            return on_axes(values, [between(each, name) for each, name in zip(found, "xyz", strict=True)], choice)
        points = self._of_grid("POINTS", 3 * prod(self.sizes)).reshape(*self.sizes[::-1], 3)
        return on_points(values, points if self.at_points else middles(points), choice)

    def numbers(self, array: _Array) -> NDArray:
        """Return the numbers of an array."""
        self.file.seek(array.begin)
        if array.is_text:
            return self._text(array)
        if array.code == "bit":
            packed = np.fromfile(self.file, np.uint8, -(-array.numbers // 8))
            return np.unpackbits(packed, count=array.numbers)
        check_size([array.numbers], np.dtype(array.code).itemsize)
        return native(np.fromfile(self.file, ">" + array.code, array.numbers))

    def _text(self, array: _Array) -> NDArray:
        """Return numbers that are text; those that their type cannot hold are an error."""
        dtype = np.dtype({"bit": "u1", _COLOR: "f4"}.get(array.code, array.code))
        wide = dtype if dtype.kind == "f" or dtype.itemsize == 8 else np.dtype(np.float64)
        check_size([array.numbers], wide.itemsize)
        numbers = np.empty(0, wide)
        with catch_warnings(action="ignore"), suppress(ValueError):  # by numpy's version, of what is no number
            numbers = np.fromfile(self.file, wide, array.numbers, sep=" ")
        if numbers.size != array.numbers:
            raise FileFault(f"is truncated or corrupt: an array has {numbers.size} numbers of {array.numbers}")
        if array.code == _COLOR:
            return np.rint(255 * np.clip(numbers, 0, 1)).astype(np.uint8)
        values = numbers if wide == dtype else numbers.astype(dtype)
        if not np.array_equal(values, numbers, equal_nan=dtype.kind == "f"):
            raise FileFault(f"has numbers in an array that {dtype} cannot hold")
        return values

    def _of_grid(self, key: str, count: int) -> NDArray:
        array = self.grid.get(key)
        if array is None or array.numbers != count:
            raise FileFault(f"its {key} must be {count} numbers, got {array.numbers if array else 'none'}")
        return self.numbers(array)

    def _line(self) -> str:
        line = self.file.readline(_LONGEST_LINE)
        if len(line) == _LONGEST_LINE:
            raise FileFault("is corrupt: a line of its header does not end")
        return line.decode("latin-1")

    def _keywords(self) -> Iterator[list[str]]:
        while self.file.tell() < self.size:
            if words := self._line().split():
                yield words

    def _is_of_grid(self, key: str, words: list[str]) -> bool:
        """Take a keyword of the grid; False if it is none."""
        if key == "DATASET":
            self.kind = words[1].upper()
        elif key == "DIMENSIONS":
            nx, ny, nz = (int(word) for word in words[1:4])
            self.sizes = nx, ny, nz
            check_size(self.sizes, 1)
        elif key in ("SPACING", "ASPECT_RATIO", "ORIGIN"):
            self.told[key] = [float(word) for word in words[1:4]]
        elif key in ("X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES", "POINTS"):
            components = 3 if key == "POINTS" else 1
            self.grid[key] = self._passed(words[2], int(words[1]) * components)
        else:
            return False
        return True

    def _arrays(self, key: str, words: list[str], count: int) -> Iterator[tuple[str, _Array]]:
        """Pass over the arrays of a keyword, and yield them by name."""
        if key == "SCALARS":
            components = int(words[3]) if len(words) > 3 else 1
            begin = self.file.tell()
            if not self._line().upper().startswith("LOOKUP_TABLE"):
                self.file.seek(begin)
            yield words[1], self._passed(words[2], count * components, components)
        elif key == "COLOR_SCALARS":
            components = int(words[2])
            yield words[1], self._passed(_COLOR if self.is_text else "unsigned_char", count * components, components)
        elif key == "LOOKUP_TABLE":
            self._passed(_COLOR if self.is_text else "unsigned_char", 4 * int(words[2]))
        elif key == "TEXTURE_COORDINATES":
            yield words[1], self._passed(words[3], count * int(words[2]), int(words[2]))
        elif key in _COMPONENTS:
            components = _COMPONENTS[key]
            yield words[1], self._passed(words[2], count * components, components)
        elif key == "FIELD":
            yield from self._field(int(words[2]))
        elif key == "METADATA":
            while self._line().strip() and self.file.tell() < self.size:
                pass
        else:
            raise FileFault(f"has a keyword that texvol does not know: {words[0][:40]!r}")

    def _field(self, count: int) -> Iterator[tuple[str, _Array]]:
        arrays = 0
        for words in self._keywords():
            if words[0].upper() == "METADATA":
                list(self._arrays("METADATA", words, 0))
                continue
            components, tuples = int(words[1]), int(words[2])
            if words[3].lower() == "string":
                raise FileFault(f"has an array of text, {words[0]}, which texvol does not read")
            yield words[0], self._passed(words[3], components * tuples, components)
            arrays += 1
            if arrays == count:
                return

    def _passed(self, name: str, count: int, components: int = 1) -> _Array:
        """Pass over an array; return where it is."""
        code = _TYPES.get(name.lower())
        if code is None:
            raise FileFault(f"has an array of type {name[:40]!r}, which texvol does not read")
        needed = count if self.is_text else -(-count // 8) if code == "bit" else count * np.dtype(code).itemsize
        begin = self.file.tell()
        if count < 0 or components < 1 or begin + needed > self.size:
            raise FileFault(f"is truncated: an array of {count} numbers is longer than the file")
        array = _Array(begin, code, count, components, self.is_text)
        if self.is_text:
            self._text(array)
        else:
            self.file.seek(begin + needed)
        return array
