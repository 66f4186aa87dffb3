"""Axes of stored arrays: which one is x, y, z, channel or time, and which channel and time are read."""

from __future__ import annotations

from collections.abc import Sequence

from texvol.formats.readers.samples import Choice, pick
from texvol.formats.stores.sources import Layout

_LETTERS = {"T": "T", "TIME": "T", "C": "C", "CHANNEL": "C", "CHANNELS": "C", "BAND": "C", "Z": "Z", "Y": "Y", "X": "X"}
_LETTERS |= {
    "DEPTH": "Z",
    "HEIGHT": "Y",
    "WIDTH": "X",
    "PLANE": "Z",
    "SLICE": "Z",
    "ROW": "Y",
    "COLUMN": "X",
    "COL": "X",
}
_LETTERS |= {"LEV": "Z", "LEVEL": "Z", "ALTITUDE": "Z", "LAT": "Y", "LATITUDE": "Y", "LON": "X", "LONGITUDE": "X"}


def letter_of(name: str) -> str:
    """Return the letter of an axis by its name; empty if it is not known."""
    return _LETTERS.get(name.upper(), "")


def letters_of(names: Sequence[str | None]) -> str:
    """Return a letter for each axis by its name; without names for all of space the last three axes are z, y, x.

    Two axes, y and x, are space if only these are named, or if there are no others.
    """
    found = [letter_of(str(name or "")) or "?" for name in names]
    named = set(found)
    if {"Y", "X"} <= named and len(set(found) - {"?"}) == len([each for each in found if each != "?"]):
        return "".join(found)
    return ("?" * len(names) + "ZYX")[-len(names) :] if len(names) >= 3 else "YX"[-len(names) :]


def layout_of(letters: str, sizes: Sequence[int], choice: Choice, names: Sequence[str] | None = None) -> Layout:
    """Return where the samples of the chosen channel and time lie in an array.

    Raises
    ------
    FileFault, TimeSteps
        As `pick`.
    """
    # `pick` wants z, y, x in this order, and all of them.
    space = [letters.index(each) if each in letters else None for each in "ZYX"]
    others = [number for number, each in enumerate(letters) if each not in "ZYX"]
    sorted_letters = "".join(letters[each] for each in others) + "ZYX"
    sorted_sizes = [*(sizes[each] for each in others), *(1 if each is None else sizes[each] for each in space)]
    picked = pick(sorted_letters, sorted_sizes, choice)
    index: list[int | None] = [None] * len(letters)
    for number, chosen in zip(others, picked, strict=False):
        index[number] = chosen if isinstance(chosen, int) else None
    words = tuple(names or [each.lower() for each in letters])
    return Layout(words, tuple(int(each) for each in sizes), tuple(index), (space[0], space[1], space[2]))
