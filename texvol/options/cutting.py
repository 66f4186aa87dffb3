"""Options --clip and --crop: converters of command-line texts and scene-file values."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from texvol.options import texts
from texvol.scene.cutting import ClipPlane, Range, checked_crop


def clip_plane(text: str) -> ClipPlane:
    """Return the plane of "NX,NY,NZ,D"."""
    *normal, offset = texts.numbers(text, "four numbers NX,NY,NZ,D", 4, finite=False)
    return texts.made(lambda: ClipPlane(tuple(normal), offset))


def clip_plane_table(table: Mapping[str, Any]) -> ClipPlane:
    """Return the plane of a scene file's {normal = [NX, NY, NZ], offset = D}."""
    if set(table) != {"normal", "offset"}:
        raise argparse.ArgumentTypeError(f"must be {{normal = [X, Y, Z], offset = D}}, got {dict(table)!r}")
    normal, offset = table["normal"], table["offset"]
    if not isinstance(normal, list) or len(normal) != 3:
        raise argparse.ArgumentTypeError(f"clip plane: normal must be three numbers, got {normal!r}")
    for each in (*normal, offset):
        if not texts.is_number(each):
            raise argparse.ArgumentTypeError(f"clip plane: normal and offset must be numbers, got {each!r}")
    return texts.made(lambda: ClipPlane(tuple(map(float, normal)), float(offset)))


def crop_box(text: str) -> tuple[Range, Range, Range]:
    """Return the three ranges of "X0,X1,Y0,Y1,Z0,Z1"."""
    ends = texts.numbers(text, "six numbers X0,X1,Y0,Y1,Z0,Z1", 6, finite=False)
    return texts.made(lambda: checked_crop((ends[0:2], ends[2:4], ends[4:6])))
