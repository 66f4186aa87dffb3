"""Options that cut: their texts, on the line and in a scene file, and what they become."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from texvol.scene.cutting import ClipPlane, Range, checked_crop
from texvol.util.errors import InputError

T = TypeVar("T")


def clip_plane(text: str) -> ClipPlane:
    """A plane from "NX,NY,NZ,D"."""
    numbers = _numbers(text)
    if len(numbers) != 4:
        raise argparse.ArgumentTypeError(f"four numbers NX,NY,NZ,D are wanted, and not {text!r}")
    return _made(lambda: ClipPlane(numbers[:3], numbers[3]))


def clip_plane_table(table: Mapping[str, Any]) -> ClipPlane:
    """A plane from a scene file's {normal = [NX, NY, NZ], offset = D}."""
    if set(table) != {"normal", "offset"}:
        raise argparse.ArgumentTypeError(f"a clip plane is {{normal = [X, Y, Z], offset = D}}, and not {dict(table)!r}")
    return _made(lambda: ClipPlane(_triple(table["normal"]), _number(table["offset"])))


def crop_box(text: str) -> tuple[Range, Range, Range]:
    """Three ranges from "X0,X1,Y0,Y1,Z0,Z1"."""
    numbers = _numbers(text)
    if len(numbers) != 6:
        raise argparse.ArgumentTypeError(f"six numbers X0,X1,Y0,Y1,Z0,Z1 are wanted, and not {text!r}")
    return _made(lambda: checked_crop((numbers[0:2], numbers[2:4], numbers[4:6])))


def _triple(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"clip plane: its normal is three numbers, and is {value!r}")
    x, y, z = map(_number, value)
    return x, y, z


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"clip plane: a number is wanted, and not {value!r}")
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
