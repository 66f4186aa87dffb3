"""Options --clip and --crop: converters of command-line texts and scene-file values."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from texvol.scene.cutting import ClipPlane, Range, checked_crop
from texvol.util.errors import InputError

T = TypeVar("T")


def clip_plane(text: str) -> ClipPlane:
    """Return the plane of "NX,NY,NZ,D"."""
    numbers = _numbers(text)
    if len(numbers) != 4:
        raise argparse.ArgumentTypeError(f"must be four numbers NX,NY,NZ,D, got {text!r}")
    return _made(lambda: ClipPlane(numbers[:3], numbers[3]))


def clip_plane_table(table: Mapping[str, Any]) -> ClipPlane:
    """Return the plane of a scene file's {normal = [NX, NY, NZ], offset = D}."""
    if set(table) != {"normal", "offset"}:
        raise argparse.ArgumentTypeError(f"must be {{normal = [X, Y, Z], offset = D}}, got {dict(table)!r}")
    return _made(lambda: ClipPlane(_triple(table["normal"]), _number(table["offset"])))


def crop_box(text: str) -> tuple[Range, Range, Range]:
    """Return the three ranges of "X0,X1,Y0,Y1,Z0,Z1"."""
    numbers = _numbers(text)
    if len(numbers) != 6:
        raise argparse.ArgumentTypeError(f"must be six numbers X0,X1,Y0,Y1,Z0,Z1, got {text!r}")
    return _made(lambda: checked_crop((numbers[0:2], numbers[2:4], numbers[4:6])))


def _triple(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"clip plane: normal must be three numbers, got {value!r}")
    x, y, z = map(_number, value)
    return x, y, z


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"clip plane: normal and offset must be numbers, got {value!r}")
    return float(value)


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        return ()


def _made(make: Callable[[], T]) -> T:
    try:
        return make()
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
