"""NRRD: a text header, read by pynrrd, and samples after it or in separate files.

The samples are read without pynrrd, which unpacks a stream to any size and opens any path that a header names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import prod
from typing import Any

import numpy as np

from texvol.formats.readers.channels import described, note, with_first
from texvol.formats.readers.colors import colored, component_axis, is_colored, with_color
from texvol.formats.readers.missing import parsed, without_marked
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, grid_from_columns, pick
from texvol.formats.readers.segments import label_table, merged, of_nrrd
from texvol.formats.readers.segments import listed as segments_in_words
from texvol.formats.readers.stored import Stored, data_files, header_lines, read_files
from texvol.formats.units import length_unit

_TYPES = {
    "i1": "signed char, int8, int8_t",
    "u1": "uchar, unsigned char, uint8, uint8_t",
    "i2": "short, short int, signed short, signed short int, int16, int16_t",
    "u2": "ushort, unsigned short, unsigned short int, uint16, uint16_t",
    "i4": "int, signed int, int32, int32_t",
    "u4": "uint, unsigned int, uint32, uint32_t",
    "i8": "longlong, long long, long long int, signed long long, signed long long int, int64, int64_t",
    "u8": "ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t",
    "f4": "float",
    "f8": "double",
}
_ENCODINGS = {"raw": "raw", "gzip": "deflate", "gz": "deflate", "bzip2": "bzip2", "bz2": "bzip2"}
_ENCODINGS |= {"ascii": "ascii", "text": "ascii", "txt": "ascii", "hex": "hex"}

# The format marks missing samples by NaN only; as key/value pairs these have their meaning in netCDF.
_MARKS = ("_FillValue", "missing_value")

_SPACES = {
    "ras": "right-anterior-superior",
    "las": "left-anterior-superior",
    "lps": "left-posterior-superior",
    "scanner-xyz": "scanner-xyz",
}

# Kinds of axes of space in the format's definition; all kinds but these and time are components.
_SPATIAL_KINDS = ("domain", "space")

# Ends of the names of kinds of components.
_OF_COMPONENTS = ("vector", "gradient", "normal", "matrix", "color", "complex", "quaternion")

# Kinds of components that are red, green, blue and opacity; the format has others for HSV and XYZ.
_COLOR_KINDS = ("rgb-color", "rgba-color", "3-color", "4-color")


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of an `.nrrd`, or of an `.nhdr` and its data."""
    header, offset, listed = _header(path)
    sizes = [int(size) for size in header["sizes"]]
    if len(sizes) != int(header["dimension"]):
        raise FileFault(f"its header has {len(sizes)} sizes ({by(sizes)}) but dimension {header['dimension']}")
    check_size(sizes, 1)
    axes = _axes(header, sizes)
    segments = of_nrrd(header)
    if segments and axes[-1] == "?" and choice.channel is None and not choice.counting:
        return _segmentation(path, header, offset, listed, choice)
    at, said = _color_axis(header, axes, sizes[::-1])
    axes = with_color(axes, sizes[::-1], at, choice, said)
    axes = _with_components(header, axes)
    holds_channels = _holds_channels(header)
    choice = with_first(axes, sizes[::-1], choice) if holds_channels else choice
    index = pick(axes, sizes[::-1], choice)
    values = read_files(_files(header, sizes, path, offset, listed), index, choice)
    spatial = [axis for axis, letter in enumerate(axes[::-1]) if letter in "XYZ"]
    grid = _grid(header, spatial) | _times(header, axes[::-1], sizes)
    if is_colored(axes):
        return Samples(**grid, **colored(values, axes, index, said))
    if segments:
        stored = [each._replace(label=each.stored) for each in segments if each.layer == (choice.channel or 0)]
        table = label_table(path, stored)
        return Samples(values, **grid, labels=True, label_table=table, notes=(segments_in_words(segments),))
    marks = parsed(str(header[key]) for key in _MARKS if key in header)
    marked, notes = without_marked(values, marks, f"the header's {' and '.join(_MARKS)}", choice)
    channels = described(axes, sizes[::-1]) if holds_channels else ()
    channel = channels[choice.channel] if channels and choice.channel is not None else None
    notes = (*note(channels, choice.channel), *notes)
    return Samples(marked, **grid, notes=notes, channels=channels, channel=channel)


def _with_components(header: Mapping[str, Any], axes: str) -> str:
    """Return the axes with "C" for those whose kind is one of components, which are no time steps."""
    kinds = [str(kind).lower() for kind in header.get("kinds", [])][::-1]
    if len(kinds) != len(axes):
        return axes
    named = zip(axes, kinds, strict=True)
    return "".join("C" if axis == "?" and kind.endswith(_OF_COMPONENTS) else axis for axis, kind in named)


def _holds_channels(header: Mapping[str, Any]) -> bool:
    """True if what is called a vector holds channels: whole numbers; components of true vectors are floats."""
    kinds = [str(kind).lower() for kind in header.get("kinds", [])]
    return "vector" in kinds and str(header["type"]).lower() not in ("float", "double")


def header_of(path: str) -> Mapping[str, Any]:
    """Return the fields of a header."""
    return _header(path)[0]


def _files(
    header: Mapping[str, Any], sizes: Sequence[int], path: str, offset: int, listed: list[str] | None
) -> list[Stored]:
    """Return the samples of each data file."""
    files = data_files(_stored(header, sizes), path, offset, _field(header, "data file", None), listed)
    if not files or prod(sizes) % len(files):
        raise FileFault(f"its {len(files)} data files can't hold equal parts of {prod(sizes)} samples")
    return files


def _segmentation(
    path: str, header: Mapping[str, Any], offset: int, listed: list[str] | None, choice: Choice
) -> Samples:
    """Return the segments of all layers of a .seg.nrrd as one number for each sample."""
    sizes, segments = [int(size) for size in header["sizes"]], of_nrrd(header)
    if len(sizes) != 4 or choice.time is not None:
        raise FileFault(f"must have layers and three axes of space, got {by(sizes)}")
    layers = read_files(_files(header, sizes, path, offset, listed), (slice(None),) * 4, choice)
    values, shared = merged(np.moveaxis(layers, 3, 0), segments)
    notes = [segments_in_words(segments)]
    if shared:
        notes.append(f"{shared} samples are in several segments, and have the last one; --channel N reads one layer")
    table = label_table(path, segments)
    return Samples(values, **_grid(header, [1, 2, 3]), labels=True, label_table=table, notes=tuple(notes))


def _header(path: str) -> tuple[Mapping[str, Any], int, list[str] | None]:
    """Return the header's fields, the offset of its end, and the data files if it lists them one per line."""
    import nrrd

    lines: list[str] = []
    listed: list[str] | None = None
    with open(path, "rb") as file:
        for line in header_lines(file):
            text = line.rstrip()
            if not text:
                break
            if listed is not None:
                listed.append(text)
                continue
            if not text.startswith("#") and ":" not in text and lines:
                raise FileFault(f"its header has a line that is neither field nor comment: {text[:80]!r}")
            if re.match(r"data ?file: *list( |$)", text, re.IGNORECASE):
                listed = []
            lines.append(text)
        offset = file.tell()
    header = nrrd.read_header(lines)
    for field in ("type", "dimension", "sizes", "encoding"):
        if field not in header:
            raise FileFault(f"its header has no field '{field}'")
    return header, offset, listed


def _axes(header: Mapping[str, Any], sizes: Sequence[int]) -> str:
    """Return letters for `pick`, slowest axis first."""
    count = len(sizes)
    kinds = [kind.lower() for kind in header.get("kinds", [])]
    directions = header.get("space directions")
    if directions is not None and len(directions) == count:
        spatial = [vector is not None and not np.isnan(vector).all() for vector in directions]
    elif len(kinds) == count and count > 3:
        spatial = [kind in _SPATIAL_KINDS for kind in kinds]
    else:
        spatial = [axis < 3 for axis in range(count)]
    if sum(spatial) > 3 or (sum(spatial) < 3 <= count):
        spatial = [axis < 3 for axis in range(count)]
    names = iter("XYZ")
    letters = [
        next(names) if is_spatial else "T" if len(kinds) == count and kinds[axis] == "time" else "?"
        for axis, is_spatial in enumerate(spatial)
    ]
    return "".join(letters)[::-1]


def _color_axis(header: Mapping[str, Any], axes: str, sizes: Sequence[int]) -> tuple[int | None, str]:
    """Return the axis of colour components and the name of its mark; `axes` are the letters for `pick`."""
    kinds = [str(kind) for kind in header.get("kinds", [])]
    is_bytes = str(header["type"]).lower() in _TYPES["u1"].split(", ")
    for at, kind in enumerate(kinds[::-1] if len(kinds) == len(axes) else []):
        # Vectors of displacements have other types.
        is_color = kind.lower() in _COLOR_KINDS or (kind.lower() == "vector" and is_bytes)
        if axes[at] == "?" and is_color:
            return at, f"kind {kind}" + (" of bytes" if kind.lower() == "vector" else "")
    return component_axis(axes, sizes, "?"), ""


def _stored(header: Mapping[str, Any], sizes: Sequence[int]) -> Stored:
    """Return how the samples are stored, in a file that is still open."""
    encoding = _ENCODINGS.get(str(header["encoding"]).lower())
    lines, skip = int(_field(header, "line skip", 0)), int(_field(header, "byte skip", 0))
    if lines < 0:
        raise FileFault(f"line skip must be at least 0, got {lines}")
    if skip < -1:
        raise FileFault(f"byte skip must be at least -1, got {skip}")
    if encoding is None:
        raise FileFault(f"encoding must be raw, gzip, bzip2, ascii or hex, got {header['encoding']}")
    return Stored("", _dtype(header, encoding), tuple(sizes[::-1]), encoding, lines=lines, skip=skip)


def _field(header: Mapping[str, Any], name: str, default: Any) -> Any:
    """Return a field whose name may be written without a space."""
    return header.get(name, header.get(name.replace(" ", ""), default))


def _dtype(header: Mapping[str, Any], encoding: str) -> np.dtype:
    name = " ".join(str(header["type"]).lower().split())
    code = next((code for code, names in _TYPES.items() if name in names.split(", ")), None)
    if code is None:
        raise FileFault(f"type {header['type']} is not a type of real numbers that texvol reads")
    dtype = np.dtype(code)
    endian = str(header.get("endian", "")).lower()
    if dtype.itemsize > 1 and encoding != "ascii":
        if endian not in ("little", "big"):
            raise FileFault("its header must have 'endian: little' or 'endian: big' for samples of several bytes")
        dtype = dtype.newbyteorder("<" if endian == "little" else ">")
    return dtype


def _grid(header: Mapping[str, Any], spatial: Sequence[int]) -> dict[str, Any]:
    """Return spacing, origin, direction, units and space of three spatial axes."""
    directions = header.get("space directions")
    space = str(header.get("space", "")).lower()
    units = header.get("space units") or header.get("units") or []
    value_unit = str(header.get("sample units", "")).strip('" ')
    grid: dict[str, Any] = {"space": _SPACES.get(space, space), "unit": _unit(units), "value_unit": value_unit}
    if directions is not None:
        columns = np.array([directions[axis] for axis in spatial], dtype=np.float64).T
        if columns.shape != (3, 3):
            raise FileFault(f"space directions must have three components, got {columns.shape[0]}")
        grid["spacing"], grid["direction"] = grid_from_columns(columns)
        origin = header.get("space origin")
        grid["origin"] = np.zeros(3) if origin is None or np.isnan(origin).all() else origin
        return grid
    known = header.get("spacings", [])
    spacings = np.array([float(known[axis]) if axis < len(known) else 1.0 for axis in spatial])
    grid["spacing"] = spacings  # checked with the volume, since --spacing may override it
    grid["origin"] = [_axis_start(header, axis, step) for axis, step in zip(spatial, spacings, strict=True)]
    return grid


def _times(header: Mapping[str, Any], axes: str, sizes: Sequence[int]) -> dict[str, Any]:
    """Return the times of the steps, if the header has a spacing for the axis of time."""
    axis = axes.find("T")
    spacings, units = header.get("spacings", []), header.get("units") or []
    if axis < 0 or axis >= len(spacings) or not np.isfinite(spacings[axis]) or spacings[axis] <= 0:
        return {}
    start = _axis_start(header, axis, float(spacings[axis]))
    unit = str(units[axis]).strip('"') if axis < len(units) else ""
    return {"times": (start + spacings[axis] * np.arange(sizes[axis])).tolist(), "time_unit": unit}


def _axis_start(header: Mapping[str, Any], axis: int, spacing: float) -> float:
    """Return the world coordinate of the first sample: `axis mins`, half a sample inwards if samples are cells."""
    starts = _field(header, "axis mins", [])
    start = float(starts[axis]) if axis < len(starts) else np.nan
    if np.isnan(start):
        return 0.0
    centerings = header.get("centerings", header.get("centers", []))
    is_cell = axis < len(centerings) and str(centerings[axis]).lower() == "cell"
    return start + spacing / 2 if is_cell else start


def _unit(units: Sequence[str]) -> str:
    names = {str(unit).strip('"') for unit in units} - {"", "???", "none"}
    unit = names.pop() if len(names) == 1 else ""
    return length_unit(unit)
