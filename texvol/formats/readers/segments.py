"""Segments of a segmentation: number, name and colour, from 3D Slicer's .seg.nrrd, DICOM SEG, and BIDS's tables.

A .seg.nrrd has layers along its first axis, so that segments may overlap: `Segment0_LabelValue` is the number of
segment 0 in layer `Segment0_Layer`. Where numbers repeat in several layers, segments are numbered from 1 in the file's
order.
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault
from texvol.scene.label_table import LabelEntry, LabelTable
from texvol.util import text_files
from texvol.util.color import color_of_text, linear_from_srgb
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line

Color = tuple[float, float, float]
_MOST = 1 << 16  # segments
_MOST_BYTES = 16 << 20  # of a table
_KEY = re.compile(r"Segment(\d{1,5})_LabelValue")


class Segment(NamedTuple):
    """Segment of a segmentation: number of its samples, name, linear colour, and its layer and number in the file."""

    label: int
    name: str = ""
    color: Color | None = None
    layer: int = 0
    stored: int = 0


def of_nrrd(header: Mapping[str, Any]) -> tuple[Segment, ...]:
    """Return the segments that the key/value pairs of a NRRD header name, by their numbers in the header."""
    numbers = sorted(int(found[1]) for found in map(_KEY.fullmatch, header) if found)
    pairs = [
        (_whole(header, f"Segment{each}_Layer", 0), _whole(header, f"Segment{each}_LabelValue", 1)) for each in numbers
    ]
    is_unique = len({stored for _, stored in pairs}) == len(pairs)
    return tuple(
        Segment(
            stored if is_unique else position,
            str(header.get(f"Segment{number}_Name", "")),
            _color(str(header.get(f"Segment{number}_Color", "")).split()),
            layer,
            stored,
        )
        for position, (number, (layer, stored)) in enumerate(zip(numbers, pairs, strict=True), 1)
    )


def _whole(header: Mapping[str, Any], key: str, default: int) -> int:
    text = str(header.get(key, default)).strip()
    if not re.fullmatch(r"-?\d{1,9}", text):
        raise FileFault(f"{key} must be a whole number, got {text[:60]!r}")
    return int(text)


def _color(words: Sequence[str]) -> Color | None:
    """Return the linear colour of three sRGB numbers from 0 to 1, or None."""
    try:
        encoded = np.array([float(word) for word in words])
    except ValueError:
        return None
    if encoded.shape != (3,) or not ((encoded >= 0) & (encoded <= 1)).all():
        return None
    red, green, blue = linear_from_srgb(encoded).tolist()
    return red, green, blue


def of_dicom(header: Any) -> tuple[Segment, ...]:
    """Return the segments of a DICOM SEG header."""
    found = []
    for each in header.get("SegmentSequence") or ():
        number = int(each.get("SegmentNumber") or 0)
        found.append(Segment(number, str(each.get("SegmentLabel") or ""), _of_lab(each), 0, number))
    return tuple(found)


def _of_lab(segment: Any) -> Color | None:
    """Return the linear colour of RecommendedDisplayCIELabValue (DICOM PS3.3, C.10.7.1.1): L, a, b as 16 bits, D50."""
    stored = segment.get("RecommendedDisplayCIELabValue")
    if stored is None or len(stored) != 3:
        return None
    lightness, a, b = (float(each) / 65535 for each in stored)
    y = (100 * lightness + 16) / 116
    cubes = np.array([y + (255 * a - 128) / 500, y, y - (255 * b - 128) / 200])
    xyz = np.where(cubes > 6 / 29, cubes**3, (cubes - 4 / 29) * 3 * (6 / 29) ** 2) * _WHITE
    red, green, blue = np.clip(_RGB_FROM_D50 @ xyz, 0, 1).tolist()
    return red, green, blue


_WHITE = np.array([0.9642, 1.0, 0.8251])
# Linear sRGB from XYZ under D50, adapted by Bradford's matrix.
_RGB_FROM_D50 = np.array(
    [[3.1338561, -1.6168667, -0.4906146], [-0.9787684, 1.9161415, 0.0334540], [0.0719453, -0.2289914, 1.4052427]]
)


def of_table(path: str | os.PathLike[str]) -> tuple[Segment, ...]:
    """Return the labels of a table of BIDS (*_dseg.tsv): columns `index`, `name`, and perhaps `color` as #RRGGBB.

    Raises
    ------
    InputError
        If it cannot be read, or is no such table.
    """
    text = text_files.read_text(path, "a table of labels", _MOST_BYTES)
    rows = list(csv.DictReader(text.splitlines(), delimiter="\t"))
    if not rows or "index" not in rows[0] or "name" not in rows[0]:
        columns = ", ".join(map(str, rows[0])) if rows else "none"
        raise InputError(f"{path}: must have columns index and name, separated by tabs, got {columns}")
    found: dict[int, Segment] = {}
    for number, row in enumerate(rows, 2):
        if not re.fullmatch(r"-?\d{1,9}", str(row["index"]).strip()):
            raise InputError(f"{path}: index in line {number} must be a whole number, got {str(row['index'])[:60]!r}")
        label = int(str(row["index"]))
        if label in found:
            raise InputError(f"{path}: index {label} must be given once, got it again in line {number}")
        found[label] = Segment(
            label, str(row["name"] or "").strip(), color_of_text(str(row.get("color") or "")), 0, label
        )
    return tuple(found.values())


def merged(layers: NDArray, segments: Sequence[Segment]) -> tuple[NDArray, int]:
    """Return one number for each sample of several layers, and the number of samples in several segments.

    Of several segments at a sample the one that the file names last is taken.

    Parameters
    ----------
    layers : array of shape (layers, nz, ny, nx)
    """
    largest = max((segment.label for segment in segments), default=0)
    values = np.zeros(layers.shape[1:], np.uint8 if largest < 256 else np.uint16 if largest < 65536 else np.int32)
    shared = 0
    for segment in segments:
        if not 0 <= segment.layer < len(layers):
            raise FileFault(f"segment {segment.name!r} must be in one of {len(layers)} layers, got {segment.layer}")
        here = layers[segment.layer] == segment.stored
        shared += int(np.count_nonzero(here & (values != 0)))
        values[here] = segment.label
    return values, shared


def label_table(path: str, segments: Iterable[Segment]) -> LabelTable:
    """Return the names and colours of the segments of a file by their labels."""
    return LabelTable({each.label: LabelEntry(shown_line(each.name), each.color) for each in segments}, path)


def listed(segments: Sequence[Segment]) -> str:
    """Return a note that names the segments."""
    names = [f"{each.label} {each.name}".strip() for each in segments[:48]]
    more = len(segments) - len(names)
    return f"segments: {', '.join(names)}" + (f" and {more} more" if more else "")


def check_count(count: int) -> None:
    """Raise FileFault if there are more segments than can be told apart."""
    if count > _MOST:
        raise FileFault(f"must have at most {_MOST} segments, got {count}")
