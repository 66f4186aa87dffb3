"""Reader of tables of labels whose first line names their columns: BIDS (`_dseg.tsv`), 3D Slicer (.csv), and the like.

    index  name          abbreviation  color     mapping      BIDS: separated by tabs
    100    Gray Matter   GM            #ff53bb   1
    LabelValue,Name,Color_R,Color_G,Color_B,Color_A,…         3D Slicer: separated by commas

A column has the label, another the name; colours are sRGB, as #RRGGBB or in three columns from 0 to 255. All other
columns are passed over. n/a is no value.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import NamedTuple

from texvol.scene.volume import LARGEST_LABEL
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line

LONGEST = 200  # letters of a name
_SEPARATORS = "\t,;"
_LABELS = ("index", "labelvalue", "label", "id", "value")  # names of columns, the first that is there
_NAMES = ("name", "label_name", "labelname", "label", "structure", "region")
_HEXES = ("color", "colour", "hex")
_CHANNELS = (("color_r", "color_g", "color_b"), ("red", "green", "blue"), ("r", "g", "b"))
_ALPHAS = ("color_a", "alpha", "a")
_NOTHING = ("", "n/a")


class Row(NamedTuple):
    """Label with its name, its sRGB colour from 0 to 1, and its opacity; None for what the line does not have."""

    label: int
    name: str
    color: tuple[float, float, float] | None = None
    opacity: float | None = None


class _Columns(NamedTuple):
    """Places of the columns, and the separator."""

    label: int
    name: int
    hex: int | None
    channels: tuple[int, ...]
    alpha: int | None
    separator: str


def rows_of(text: str) -> list[Row] | None:
    """Return the rows of a table with named columns; None if the first line names none.

    Raises
    ------
    InputError
        If a line has no label, or a colour that is none; the message names the line.
    """
    lines = [
        (number, line)
        for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1)
        if line.strip() and not line.startswith(("#", "//"))
    ]
    columns = _columns(lines[0][1]) if lines else None
    if columns is None:
        return None
    found = [row for number, line in lines[1:] if (row := _row(_cells(line, columns.separator), columns, number))]
    if not found:
        raise InputError("must have a line with a label and a name below the names of its columns")
    return without_empty_alpha(found)


def without_empty_alpha(rows: list[Row]) -> list[Row]:
    """Return rows without opacities if most are 0: FreeSurfer's tables have 0 for nearly all, and hide none."""
    clear = sum(row.opacity == 0 for row in rows if row.label)
    return [row._replace(opacity=None) for row in rows] if 2 * clear > sum(row.label != 0 for row in rows) else rows


def _columns(header: str) -> _Columns | None:
    separator = next((each for each in _SEPARATORS if each in header), None)
    if separator is None:
        return None
    names = [each.strip().lower() for each in _cells(header, separator)]
    label = next((names.index(each) for each in _LABELS if each in names), None)
    name = next((at for each in _NAMES if each in names and (at := names.index(each)) != label), None)
    if label is None or name is None:
        return None
    channels = next(([names.index(each) for each in three] for three in _CHANNELS if {*three} <= {*names}), [])
    hexes, alphas = (next((names.index(one) for one in known if one in names), None) for known in (_HEXES, _ALPHAS))
    return _Columns(label, name, hexes, tuple(channels), alphas if channels else None, separator)


def _cells(line: str, separator: str) -> list[str]:
    return [each.strip() for each in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _row(cells: Sequence[str], columns: _Columns, number: int) -> Row | None:
    """Return the row of a line; None if it has no name."""

    def cell(place: int | None) -> str:
        text = cells[place] if place is not None and place < len(cells) else ""
        return "" if text.lower() in _NOTHING else text

    name = shown_line(cell(columns.name))
    if not name:
        return None
    if not re.fullmatch(r"[+-]?\d{1,9}(\.0*)?", cell(columns.label)) or len(name) > LONGEST:
        wanted = f"a whole number as label and a name of at most {LONGEST} letters"
        raise InputError(f"line {number} must have {wanted}, got {shown_line(cell(columns.label))[:40]!r}")
    label = int(float(cell(columns.label)))
    if abs(label) > LARGEST_LABEL:
        raise InputError(f"line {number}: labels must be at most {LARGEST_LABEL}, got {label}")
    alpha = cell(columns.alpha)
    opacity = _bytes([alpha], number)[0] if alpha else None
    return Row(label, name, _color(cell(columns.hex), [cell(each) for each in columns.channels], number), opacity)


def _color(text: str, channels: list[str], number: int) -> tuple[float, float, float] | None:
    if text:
        if not re.fullmatch(r"#?[0-9a-fA-F]{6}", text):
            raise InputError(f"line {number}: color must be #RRGGBB, got {shown_line(text)[:40]!r}")
        red, green, blue = (each / 255 for each in bytes.fromhex(text.lstrip("#")))
        return red, green, blue
    if not all(channels) or not channels:
        return None
    red, green, blue = _bytes(channels, number)
    return red, green, blue


def _bytes(texts: Sequence[str], number: int) -> list[float]:
    for text in texts:
        if not re.fullmatch(r"\d{1,3}", text) or int(text) > 255:
            raise InputError(
                f"line {number}: colours must be whole numbers from 0 to 255, got {shown_line(text)[:40]!r}"
            )
    return [int(text) / 255 for text in texts]
