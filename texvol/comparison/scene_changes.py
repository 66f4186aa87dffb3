"""Differences between the scenes in two pictures' headers, with both values.

Headers are compared as they are stored (see `scene_metadata`), so that new parts of a scene count at once. Not counted
are

    where a volume, mask or mesh was read from, if the checksums of both are equal
    numbers within 1e-9 of the larger: another version of a library computes those of the same file or view
    settings of the drawing ("settings"): another picture of the same scene
    parts that the pictures don't show: the display of numbers, for pictures that hold the numbers; their transfer
    function, for pictures that don't show it; the classification, for modes without a medium
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from texvol.comparison.common_form import NUMBER_MODES, SCENE_ATTRIBUTE, SHOWING, header_of
from texvol.comparison.pictures import Picture

_SAME = 1e-9
_MOST_TEXT = 60  # characters of a value
_MOST_VALUES = 3  # values of a part that a sentence lists
_LONGEST_TUPLE = 4  # numbers that are shown together: a position, a colour
_NO_SCENE = ("format", "settings")
_POSITIONS = ("volume", "name", "source", "path", "absolute", "type")  # keys that a checksum replaces
_BY_TRANSFER_FUNCTION = "transfer function"  # scene_metadata.BY_TRANSFER_FUNCTION, without its imports
_FILES = ("volume", "name", "path")
_VOLUME = ("volume", "source", "dimensions", "spacing", "origin", "direction", "type", "kind", "checksum")
_ABSENT = object()


@dataclass(frozen=True)
class SceneChange:
    """One value that differs.

    Attributes
    ----------
    part : str
        "volume", "camera", "lighting", "transfer function", …
    where : str
        Name of the value within the part; empty for the whole part.
    candidate, reference : str
        Both values; "none" for a missing value.
    """

    part: str
    where: str
    candidate: str
    reference: str

    @property
    def words(self) -> str:
        """The value in the candidate and in the reference."""
        values = f"{self.candidate} instead of {self.reference}"
        return f"{self.where} {values}" if self.where else values


def scene_changes(candidate: Picture, reference: Picture) -> tuple[SceneChange, ...] | None:
    """Return the values in which the scenes differ; None if a header holds no scene."""
    if header_of(candidate) is None or header_of(reference) is None:
        return None
    if candidate.attributes[SCENE_ATTRIBUTE] == reference.attributes[SCENE_ATTRIBUTE]:
        return ()
    try:
        ours, theirs = _seen(candidate, reference)
        return _changes(ours, theirs)
    except RecursionError:  # a header of texvol is never so deep
        return None


def drawing_changes(candidate: Picture, reference: Picture) -> tuple[SceneChange, ...]:
    """Return the settings of drawing in which the pictures differ, if both headers have settings."""
    ours, theirs = ((header_of(each) or {}).get("settings") for each in (candidate, reference))
    if not (isinstance(ours, dict) and isinstance(theirs, dict) and ours and theirs):
        return ()
    return _changes(ours, theirs, ("settings",))


def _changes(ours: Any, theirs: Any, start: tuple[str, ...] = ()) -> tuple[SceneChange, ...]:
    return tuple(
        SceneChange(_part(path[0]), _where(path), _text(one, other), _text(other, one))
        for path, one, other in _unequal(ours, theirs, start)
    )


def in_words(changes: Sequence[SceneChange]) -> list[str]:
    """Return a sentence for each part that differs."""
    by_part: dict[str, list[str]] = {}
    for each in changes:
        by_part.setdefault(each.part, []).append(each.words)
    return [f"the scenes differ in {part}: {listed(words)}" for part, words in by_part.items()]


def listed(words: Sequence[str]) -> str:
    """Return the first of some texts, and the number of the rest."""
    more = len(words) - _MOST_VALUES
    return ", ".join(words[:_MOST_VALUES]) + (f", and {more} more" if more > 0 else "")


def _seen(candidate: Picture, reference: Picture) -> list[dict[str, Any]]:
    """Return the parts of both headers that the pictures show."""
    pair = candidate, reference
    headers = [header_of(each) or {} for each in pair]
    left_out = {*_NO_SCENE}
    modes = {header.get("mode", "composite") for header in headers}
    if "composite" not in modes:
        left_out.add("classification")
    if modes <= {*NUMBER_MODES}:
        are_shown = all(each.whole_numbers for each in pair)
        are_colored = are_shown and all(each.get("colors") == _BY_TRANSFER_FUNCTION for each in headers)
        left_out |= (set() if are_shown else {*SHOWING}) | (set() if are_colored else {"transfer_function"})
    if headers[0].get("format") != headers[1].get("format"):  # texvol 0.3 wrote fewer parts
        left_out |= headers[0].keys() ^ headers[1].keys()
    return [{key: value for key, value in each.items() if key not in left_out} for each in headers]


def _unequal(ours: Any, theirs: Any, path: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], Any, Any]]:
    """Yield path and both values of each value that differs."""
    if isinstance(ours, dict) and isinstance(theirs, dict):
        for key in _compared_keys(ours, theirs):
            yield from _unequal(ours.get(key, _ABSENT), theirs.get(key, _ABSENT), (*path, key))
    elif isinstance(ours, list) and isinstance(theirs, list) and not (_is_tuple(ours) and _is_tuple(theirs)):
        for index in range(max(len(ours), len(theirs))):
            one, other = (each[index] if index < len(each) else _ABSENT for each in (ours, theirs))
            yield from _unequal(one, other, (*path, index + 1))
    elif not (_is_same(ours, theirs) or (path[-1] in _FILES and _file(ours) == _file(theirs))):
        yield path, ours, theirs


def _compared_keys(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> list[str]:
    """Return the keys of two objects that are compared; a checksum replaces the file's name.

    A PNG has no checksum, and is compared by file names.
    """
    keys = list({**ours, **theirs})
    if "checksum" in ours and "checksum" in theirs:
        return [key for key in keys if key not in _POSITIONS]
    left_out = {"checksum", "absolute"} | ({"volume", "name"} if ours.get("source") and theirs.get("source") else set())
    return [key for key in keys if key not in left_out]


def _file(path: Any) -> str:
    """Name of a file without its folder."""
    return os.path.basename(str(path).rstrip("/\\"))


def _is_tuple(content: list[Any]) -> bool:
    return len(content) <= _LONGEST_TUPLE and all(isinstance(each, int | float) for each in content)


def _is_same(ours: Any, theirs: Any) -> bool:
    if any(each is _ABSENT or each is None for each in (ours, theirs)):
        return all(each is _ABSENT or each is None for each in (ours, theirs))
    if isinstance(ours, list) and isinstance(theirs, list) and _is_tuple(ours) and _is_tuple(theirs):
        one, other = ([_number(each) for each in numbers] for numbers in (ours, theirs))
        scale = max((abs(each) for each in (*one, *other) if math.isfinite(each)), default=0.0)
        return len(one) == len(other) and all(_is_near(*pair, scale) for pair in zip(one, other, strict=True))
    if isinstance(ours, bool) or isinstance(theirs, bool):
        return ours is theirs
    if isinstance(ours, int | float) and isinstance(theirs, int | float):
        return _is_near(_number(ours), _number(theirs), 0.0)
    return bool(ours == theirs)


def _is_near(one: float, other: float, scale: float) -> bool:
    both_nan = math.isnan(one) and math.isnan(other)
    return both_nan or math.isclose(one, other, rel_tol=_SAME, abs_tol=_SAME * scale)


def _number(value: float) -> float:
    """Return a number of JSON, whose integers are unlimited, as float64."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _part(key: str | int) -> str:
    """Return the part that a key of the header belongs to."""
    return "volume" if key in _VOLUME else str(key).replace("_", " ")


def _where(path: tuple[str | int, ...]) -> str:
    words = [str(each) for each in (path if path[0] in _VOLUME else path[1:])]
    if words[-1:] == ["checksum"]:
        words[-1] = "content, by its checksum,"
    elif words[-1:] in (["volume"], ["path"]):
        words[-1] = "file"
    return _in_a_line(" ".join(each for each in words if each != "source").replace("_", " "))


def _in_a_line(text: str) -> str:
    return " ".join(text.split())


def _text(value: Any, other: Any) -> str:
    """Return a value with six digits, or with all if six are the same as the other value's."""
    short = _written(value, 6)
    return short if short != _written(other, 6) else _written(value, 17)


def _written(value: Any, digits: int) -> str:
    if value is _ABSENT or value is None:
        return "none"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, int | float):
        return f"{_number(value):.{digits}g}"
    if isinstance(value, list):
        text = "(" + ", ".join(_written(each, digits) for each in value) + ")"
    elif isinstance(value, dict):
        text = ", ".join(f"{key} {_written(each, digits)}" for key, each in value.items())
    else:
        text = str(value)
    text = _in_a_line(text)
    return text if len(text) <= _MOST_TEXT else text[: _MOST_TEXT - 1] + "…"
