"""MetaImage: lines of `Key = value`, and samples after them or in separate files.

Read without ITK, which prints on stderr and opens any path that a header names; tests compare with ITK.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from texvol.formats.readers.colors import colored, component_axis, is_colored, with_color
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, grid_from_columns, pick, unnamed_axes
from texvol.formats.readers.stored import LONGEST_HEADER, Stored, data_files, header_lines, read_files
from texvol.formats.units import length_unit

# The format has no field for colour; ITK writes colours as bytes, and vectors as other types.
_COLOR_OF_BYTES = "channels of bytes"

_TYPES = {
    "MET_CHAR": "i1",
    "MET_UCHAR": "u1",
    "MET_SHORT": "i2",
    "MET_USHORT": "u2",
    "MET_INT": "i4",
    "MET_UINT": "u4",
    "MET_LONG": "i4",  # four bytes on every machine, as MetaIO defines them
    "MET_ULONG": "u4",
    "MET_LONG_LONG": "i8",
    "MET_ULONG_LONG": "u8",
    "MET_FLOAT": "f4",
    "MET_DOUBLE": "f8",
}


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of an `.mha`, or of an `.mhd` and its data."""
    fields, offset, listed = _header(path)
    sizes = _numbers(fields, "DimSize", int)
    count = int(fields.get("NDims", len(sizes)))
    if len(sizes) != count:
        raise FileFault(f"its header has {len(sizes)} sizes ({by(sizes)}) but NDims {count}")
    channels = int(fields.get("ElementNumberOfChannels", 1))
    axes = unnamed_axes(count)
    if channels != 1:
        sizes, axes = [channels, *sizes], axes + "C"
    said = _COLOR_OF_BYTES if _dtype(fields) == np.uint8 else ""
    axes = with_color(axes, sizes[::-1], component_axis(axes, sizes[::-1], "C"), choice, said)
    index = pick(axes, sizes[::-1], choice)
    where = fields["ElementDataFile"]
    files = data_files(_stored(fields, sizes), path, offset, None if where.upper() == "LOCAL" else where, listed)
    if len(files) not in (1, sizes[-1]):
        raise FileFault(f"names {len(files)} data files, but DimSize ({by(sizes)}) has {sizes[-1]} slices")
    values = read_files(files, index, choice)
    grid = _grid(fields, count)
    return Samples(**grid, **colored(values, axes, index, said)) if is_colored(axes) else Samples(values, **grid)


def _header(path: str) -> tuple[Mapping[str, str], int, list[str] | None]:
    """Return the header's fields, the offset of its end, and the data files if it lists them."""
    fields: dict[str, str] = {}
    with open(path, "rb") as file:
        for line in header_lines(file):
            key, equals, value = line.partition("=")
            if not equals and key.strip():
                raise FileFault(f"its header has a line that is not Key = value: {key.strip()[:80]!r}")
            fields[key.strip()] = value.strip()
            if key.strip() == "ElementDataFile":
                break
        else:
            raise FileFault("its header ends without ElementDataFile")
        offset = file.tell()
        if fields["ElementDataFile"].split()[:1] != ["LIST"]:
            return fields, offset, None
        listed = file.read(LONGEST_HEADER).decode("latin-1").split("\n")
        return fields, offset, [line.strip() for line in listed if line.strip()]


def _stored(fields: Mapping[str, str], sizes: Sequence[int]) -> Stored:
    """Return how the samples are stored, in a file that is still open."""
    dtype = _dtype(fields)
    if not _flag(fields, "BinaryData", default=True):
        raise FileFault("its samples are text (BinaryData = False), which texvol does not read")
    encoding = "deflate" if _flag(fields, "CompressedData") else "raw"
    skip = int(fields.get("HeaderSize", 0))
    if skip < -1:
        raise FileFault(f"HeaderSize must be at least -1, got {skip}")
    return Stored("", dtype, tuple(sizes[::-1]), encoding, skip=skip)


def _dtype(fields: Mapping[str, str]) -> np.dtype:
    name = fields.get("ElementType", "")
    code = _TYPES.get(name.removesuffix("_ARRAY"))
    if code is None:
        raise FileFault(f"ElementType {name or '(missing)'} is not a type of real numbers that texvol reads")
    is_big = _flag(fields, "BinaryDataByteOrderMSB") or _flag(fields, "ElementByteOrderMSB")
    return np.dtype(code).newbyteorder(">" if is_big else "<")


def _grid(fields: Mapping[str, str], count: int) -> dict[str, Any]:
    """Return spacing, origin and direction as ITK reads them: axis a of the grid is row a of the written matrix."""
    grid: dict[str, Any] = {"unit": _unit(fields), "space": "left-posterior-superior"}
    key = "ElementSpacing" if "ElementSpacing" in fields else "ElementSize"
    if key in fields:
        grid["spacing"] = _numbers(fields, key, float, count)[:3]
    for key in ("Offset", "Position", "Origin"):
        if key in fields:
            grid["origin"] = _numbers(fields, key, float, count)[:3]
            break
    for key in ("TransformMatrix", "Rotation", "Orientation"):
        if key in fields:
            matrix = np.array(_numbers(fields, key, float, count * count)).reshape(count, count)
            _, grid["direction"] = grid_from_columns(matrix.T[:3, :3])
            break
    return grid


def _unit(fields: Mapping[str, str]) -> str:
    name = fields.get("DistanceUnits", "mm")  # MetaIO leaves the default unit open; its data are medical
    return "" if name == "?" else length_unit(name)


def _numbers(fields: Mapping[str, str], key: str, kind: type, count: int | None = None) -> list[Any]:
    if key not in fields:
        raise FileFault(f"its header has no {key}")
    try:
        numbers = [kind(word) for word in fields[key].split()]
    except ValueError:
        raise FileFault(f"{key} must be numbers, got {fields[key][:80]!r}") from None
    if count is not None and len(numbers) != count:
        raise FileFault(f"{key} must be {count} numbers, got {len(numbers)}")
    return numbers


def _flag(fields: Mapping[str, str], key: str, default: bool = False) -> bool:
    return fields.get(key, str(default)).lower() in ("true", "1", "yes")
