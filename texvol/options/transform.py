"""The option --transform: matrix that moves a volume, as numbers or in a file."""

from __future__ import annotations

import argparse
import math
import os
import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.options import texts
from texvol.util import text_files
from texvol.util.errors import InputError

_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_LONGEST_FILE = 1 << 16  # bytes: sixteen numbers and generous comments
_FORMS = "12 or 16 numbers separated by commas (rows of a 4 x 4 matrix, the last row 0,0,0,1), or a file of them"


class TransformChoice(NamedTuple):
    """Numbers of a matrix, or the path of a file with them."""

    numbers: tuple[float, ...] = ()
    path: str = ""

    def matrix(self) -> NDArray[np.float64]:
        """Return the matrix, shape (4, 4).

        Raises
        ------
        InputError
            If the file can't be read, or does not hold a matrix.
        """
        numbers = _of_file(self.path) if self.path else self.numbers
        return np.array([*numbers, *_LAST_ROW[: 16 - len(numbers)]]).reshape(4, 4)


def transform(text: str) -> TransformChoice:
    """Return the choice of "M00,M01,…" or "FILE"."""
    if os.path.exists(text):
        return TransformChoice(path=text)
    numbers = _numbers(text.split(","))
    if numbers is None and text.strip() and text.count(",") < 11:
        return TransformChoice(path=text)  # a missing file, reported when it is read
    if numbers is None or len(numbers) not in (12, 16):
        raise argparse.ArgumentTypeError(f"must be {_FORMS}, got {text!r}")
    return TransformChoice(numbers)


def transform_value(value: Any) -> TransformChoice:
    """Return the choice of a scene file: a text, an array of numbers, or an array of rows."""
    if isinstance(value, str):
        return transform(value)
    rows = value if isinstance(value, list) else []
    flat = [number for row in rows for number in row] if all(isinstance(row, list) for row in rows) else rows
    if not (texts.are_numbers(flat, 12) or texts.are_numbers(flat, 16)):
        raise argparse.ArgumentTypeError(f"must be {_FORMS}, got {value!r}")
    return TransformChoice(tuple(map(float, flat)))


def _of_file(path: str) -> tuple[float, ...]:
    """Return the numbers of a text file with three or four rows of four; # begins a comment."""
    text = text_files.read_text(path, "a transform, 4 rows of 4 numbers", _LONGEST_FILE)
    lines = (line.partition("#")[0] for line in text.splitlines())
    rows = [_numbers(re.split(r"[,\s]+", line.strip(" \t,"))) for line in lines if line.strip()]
    if len(rows) not in (3, 4) or not all(row is not None and len(row) == 4 for row in rows):
        raise InputError(f"{path}: a transform must be 4 rows of 4 numbers (or 3, without 0 0 0 1)")
    return tuple(number for row in rows for number in row or ())


def _numbers(words: list[str]) -> tuple[float, ...] | None:
    """Return finite numbers, or None if a word is not a finite number."""
    try:
        numbers = tuple(map(float, words))
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None
