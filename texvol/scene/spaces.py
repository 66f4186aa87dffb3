"""Worlds of the body: what a volume's `space` says its world axes point to, and the way from one world to another."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

OPPOSITE = {"R": "L", "L": "R", "A": "P", "P": "A", "S": "I", "I": "S"}
_LETTERS = {"right": "R", "left": "L", "anterior": "A", "posterior": "P", "superior": "S", "inferior": "I"}
_PAIRS = {frozenset(pair) for pair in ("RL", "AP", "SI")}


def letters_of_space(space: str) -> tuple[str, str, str] | None:
    """Letters of the world axes, such as ("R", "A", "S"); None if the volume's `space` does not say."""
    found = tuple(_LETTERS.get(word, "") for word in space.lower().split("-"))[:3]
    if len(found) != 3 or {frozenset((letter, OPPOSITE.get(letter, ""))) for letter in found} != _PAIRS:
        return None
    return found[0], found[1], found[2]


def is_map(space: str) -> bool:
    """True if two axes of the world are longitude and latitude, by their units."""
    return bool(re.search(r"degrees?_?e(ast)?\b", space) and re.search(r"degrees?_?n(orth)?\b", space))


def turned(volume: Volume, space: str) -> Volume:
    """The volume in a world whose axes point to `space`; itself where it lies in that, or one of the two does not say.

    NRRD and DICOM often have left-posterior-superior where NIfTI has right-anterior-superior: the same head, mirrored
    in x and y.
    """
    matrix = turn(volume.space, space)
    if matrix is None:
        return volume
    other = volume.moved(matrix)
    other.space = space
    return other


def turn(from_space: str, to_space: str) -> NDArray[np.float64] | None:
    """Matrix of shape (4, 4) from one world to another; None where they are one, or one of the two does not say."""
    here, there = letters_of_space(from_space), letters_of_space(to_space)
    if here is None or there is None or here == there:
        return None
    matrix = np.zeros((4, 4))
    matrix[3, 3] = 1
    for row, letter in enumerate(there):
        for column, own in enumerate(here):
            if own in (letter, OPPOSITE[letter]):
                matrix[row, column] = 1 if own == letter else -1
    return matrix
