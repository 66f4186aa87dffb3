"""Readers of tables of labels: names and colours of the numbers in a segmentation.

A table is a text file. Empty lines and lines that begin with # or // are left out; so is a first line without a digit,
a header. All other lines have one form:

    1  255 0 0  1 1 1  "liver"        ITK-SNAP: label, red, green, blue, opacity, visible, mesh, name
    1  liver  255 0 0 0               FreeSurfer (.ctab), 3D Slicer (.ctbl): label, name, red, green, blue[, alpha]
    1  1.0 0.0 0.0  liver             FSL (.lut): label, red, green, blue, name; from 0 to 1, or whole numbers to 255
    liver                             Connectome Workbench: a line with the name, and
    1  255 0 0 255                    a line with label, red, green, blue, alpha
    1  liver                          label and name, and perhaps a number behind each name, as MRIcron has it

or a first line names its columns, as in BIDS and newer tables of 3D Slicer, see `label_columns`.

Commas, semicolons and tabs separate as spaces do. Colours are sRGB. A name has at least one letter, so that tables of
numbers are no tables of labels.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from texvol.formats import label_columns
from texvol.formats.label_columns import LONGEST, Row, without_empty_alpha
from texvol.scene.label_table import LabelEntry, LabelTable
from texvol.scene.volume import LARGEST_LABEL
from texvol.util import text_files
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line

NONE = "none"  # in place of a file: no table, also if there is one beside the volume
ENDINGS = (".txt", ".lut", ".ctbl", ".ctab", ".label", ".csv", ".tsv")
_MOST_BYTES = 1 << 22  # FreeSurfer's own table has 0.1 MB
_MOST_FOUND_BYTES = 1 << 20  # of a file that nobody asked for
_MOST_LISTED, _MOST_TRIED = 4096, 32  # files of a folder that are looked at, and that are read
_LONGEST_LINE = 1000  # letters
_PACKED = (".gz", ".bz2", ".xz", ".zip")
_SEGMENTED = (".seg", ".label")  # before the ending of a volume's name

# Of lines in which each run of white space is one blank, so that no pattern has several ways to match them.
_LABEL, _SPACE, _BYTE, _REAL = r"([+-]?\d{1,9})", r"(?: ?[,;] ?| )", r"(\d{1,3})", r"(\d*\.?\d+(?:e[+-]?\d+)?)"
_NAME = r"(\S|\S.*\S)"
_BYTES = _SPACE.join([_BYTE] * 3)
_ITK_SNAP = re.compile(_SPACE.join([_LABEL, _BYTES, _REAL, r"(\d+)", r"\d+", r'"(.*)"']))
_NAME_FIRST = tuple(re.compile(_SPACE.join([_LABEL, _NAME, _BYTES, *last])) for last in ([_BYTE], []))
_FSL = re.compile(_SPACE.join([_LABEL, _REAL, _REAL, _REAL, _NAME]), re.IGNORECASE)
_COLOR_LINE = re.compile(_SPACE.join([_LABEL, _BYTES, _BYTE]))
_PLAIN = re.compile(rf"{_LABEL}(?: ?[:=,;] ?| ){_NAME}")
_FORMS = "'LABEL NAME', or those of ITK-SNAP, FreeSurfer, 3D Slicer, FSL or Connectome Workbench"


def read_label_table(path: str | os.PathLike[str]) -> LabelTable:
    """Return the table of labels in a file.

    Raises
    ------
    InputError
        If the file can't be read, or is no table of labels; the message names the line.
    """
    text = text_files.read_text(path, "a table of labels", _MOST_BYTES)
    try:
        rows = _read(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if rows is None:
        raise InputError(f"{path}: label names must be lines of one form, {_FORMS}; {_fault(_lines(text))}")
    return _table(rows, os.fspath(path))


def absolute(path: str) -> str:
    """Return the absolute path of a table; "none" stays."""
    return path if path == NONE else os.path.abspath(path)


def table_for(volume: str, told: str | None) -> LabelTable | None:
    """Return the table of a volume's file: the one that is told, or the one beside; None if "none" is told.

    Raises
    ------
    InputError
        If the file that is told can't be read, or is no table of labels.
    """
    if told is not None:
        return None if told == NONE else read_label_table(told)
    return label_table_beside(volume)


def label_table_beside(path: str | os.PathLike[str]) -> LabelTable | None:
    """Return the table of labels beside a volume's file: of the same name, or the only one in its folder.

    None if there is none, if the folder has several, or if the volume is not a file. A file that is no table of labels,
    or can't be read, is passed over.
    """
    name = os.fspath(path)
    if not os.path.isfile(name):
        return None
    for each in _of_same_name(name):
        if (table := _tried(each)) is not None:
            return table
    found = [table for each in itertools.islice(_in_folder(name), _MOST_TRIED) if (table := _tried(each)) is not None]
    return found[0] if len(found) == 1 else None


def _of_same_name(name: str) -> Iterator[str]:
    """Yield paths with the name of a volume's file and an ending of tables."""
    stems = [name]
    for endings in (_PACKED, None, _SEGMENTED):
        stem, ending = os.path.splitext(stems[-1])
        if ending and (endings is None or ending.lower() in endings):
            stems.append(stem)
    for stem in reversed(stems):
        for ending in ENDINGS:
            if stem + ending != name:
                yield stem + ending


def _in_folder(name: str) -> Iterator[str]:
    """Yield the files with an ending of tables in the folder of a volume's file, sorted."""
    try:
        with os.scandir(os.path.dirname(name) or ".") as entries:
            listed = [entry.path for entry in itertools.islice(entries, _MOST_LISTED)]
    except OSError:
        return
    for each in sorted(listed):
        if each.lower().endswith(ENDINGS) and os.path.basename(each) != os.path.basename(name):
            yield each


def _tried(path: str) -> LabelTable | None:
    if not os.path.isfile(path):
        return None
    try:
        rows = _read(text_files.read_text(path, "a table of labels", _MOST_FOUND_BYTES))
    except InputError:
        return None
    return None if rows is None else _table(rows, path, found=True)


def _read(text: str) -> list[Row] | None:
    """Return the rows of a text, by the names of its columns or by the form of its lines; None if it has neither."""
    rows = label_columns.rows_of(text)
    if rows is None:
        rows = _rows(_lines(text))
    return rows


def _lines(text: str) -> list[tuple[int, str]]:
    """Return the lines that are neither empty nor remarks, with their numbers from 1 on, without a header."""
    lines = [" ".join(line.split()) for line in text.removeprefix("\ufeff").splitlines()]
    found = [(number, line) for number, line in enumerate(lines, 1) if line and not line.startswith(("#", "//"))]
    if len(found) < 2 or re.search(r"\d", found[0][1]):
        return found
    # A name before a line with a colour is the first one of Connectome Workbench, and no header.
    is_header = re.match(r"[+-]?\d", found[1][1]) and not _COLOR_LINE.fullmatch(found[1][1])
    return found[1:] if is_header else found


def _rows(lines: list[tuple[int, str]]) -> list[Row] | None:
    """Return the rows of the first form that all lines have; None if there is none."""
    texts = [line for _, line in lines]
    if not texts or max(map(len, texts)) > _LONGEST_LINE:
        return None
    fitting = [convert for convert in _LINE_FORMS if convert(texts[0]) is not None]
    for convert in fitting:
        if convert is _plain and len(fitting) > 1:  # a table of colours with a fault, and no names that end in numbers
            return None
        rows = [row for row in map(convert, texts) if row is not None]
        if len(rows) == len(texts):
            return _OF_ALL.get(convert, list)(rows)
    return _workbench(texts)


def _fault(lines: list[tuple[int, str]]) -> str:
    """Return what is wrong: the first line that is not of the form that most lines have."""
    if not lines:
        return "it has no lines"
    long = next((number for number, line in lines if len(line) > _LONGEST_LINE), None)
    if long is not None:
        return f"line {long} has more than {_LONGEST_LINE} letters"
    fitting = [convert for convert in _LINE_FORMS if convert(lines[0][1]) is not None] or [_plain]
    number, line = next((each for each in lines if fitting[0](each[1]) is None), lines[0])
    return f"line {number} is {shown_line(line)[:60]!r}"


def _itk_snap(line: str) -> Row | None:
    found = _ITK_SNAP.fullmatch(line)
    if found is None:
        return None
    label, *color, opacity, visible, name = found.groups()
    return _row(label, name, _of_bytes(color), float(opacity) if int(visible) else 0.0)


def _free_surfer(line: str) -> Row | None:
    found = _NAME_FIRST[0].fullmatch(line)
    if found is None:
        return None
    label, name, red, green, blue, alpha = found.groups()
    return _row(label, name, _of_bytes([red, green, blue]), int(alpha) / 255)


def _without_alpha(line: str) -> Row | None:
    found = _NAME_FIRST[1].fullmatch(line)
    return None if found is None else _row(found[1], found[2], _of_bytes(found.groups()[2:]))


def _fsl(line: str) -> Row | None:
    found = _FSL.fullmatch(line)
    if found is None:
        return None
    label, *color, name = found.groups()
    numbers = [float(each) for each in color]
    if max(numbers) > 1:
        return _row(label, name, _of_bytes(color)) if all(each.isdigit() for each in color) else None
    return _row(label, name, (numbers[0], numbers[1], numbers[2]))


def _plain(line: str) -> Row | None:
    found = _PLAIN.fullmatch(line)
    return None if found is None else _row(found[1], found[2])


_LINE_FORMS: tuple[Callable[[str], Row | None], ...] = (_itk_snap, _free_surfer, _without_alpha, _fsl, _plain)


def _workbench(texts: list[str]) -> list[Row] | None:
    """Return the rows of pairs of lines: a name, and a label with its colour."""
    rows = []
    for name, numbers in zip(texts[::2], texts[1::2], strict=False):
        found = _COLOR_LINE.fullmatch(numbers)
        row = None if found is None else _row(found[1], name, _of_bytes(found.groups()[1:4]), int(found[5]) / 255)
        if row is None:
            return None
        rows.append(row)
    return without_empty_alpha(rows) if rows and len(texts) % 2 == 0 else None


def _row(
    label: str, name: str, color: tuple[float, float, float] | None = None, opacity: float | None = None
) -> Row | None:
    """Return a row; None if the label is too large, the colour out of range, or the name has no letter."""
    name = shown_line(name.strip().strip("\"'").strip())
    is_name = any(letter.isalpha() for letter in name) and len(name) <= LONGEST
    in_range = color is None or max(color) <= 1
    return Row(int(label), name, color, opacity) if is_name and in_range and abs(int(label)) <= LARGEST_LABEL else None


def _of_bytes(color: Sequence[str]) -> tuple[float, float, float]:
    red, green, blue = (int(each) / 255 for each in color)
    return red, green, blue


def _without_numbers(rows: list[Row]) -> list[Row]:
    """Return rows without the numbers behind the names, if all names are one word and have one."""
    words = [row.name.split() for row in rows]
    if not all(len(each) == 2 and each[1].isdigit() and re.search(r"[^\W\d]", each[0]) for each in words):
        return rows
    return [row._replace(name=each[0]) for row, each in zip(rows, words, strict=True)]


_OF_ALL: dict[Callable, Callable[[list[Row]], list[Row]]] = {
    _plain: _without_numbers,
    _free_surfer: without_empty_alpha,
}


def _table(rows: list[Row], source: str, *, found: bool = False) -> LabelTable:
    hides = any(row.opacity for row in rows)
    entries = {}
    for row in rows:
        color = None if row.color is None else tuple(linear_from_srgb(np.array(row.color)).tolist())
        entries[row.label] = LabelEntry(row.name, color, row.opacity != 0 or not hides)
    return LabelTable(entries, source, found)
