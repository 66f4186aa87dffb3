"""The option --measure: rulers, angles, boxes and profiles."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from texvol.options import texts
from texvol.scene.measures.measure import KINDS, POINTS, Measure
from texvol.util.suggestions import did_you_mean

FORM = "KIND X,Y,Z X,Y,Z [X,Y,Z][:NAME]"
_KEYS = ("kind", "points", "name", "shown", "samples")


def measure(text: str) -> Measure:
    """Return the measure of "ruler 0,0,0 10,0,0:NAME"; the kind of a profile may be "profile:SAMPLES"."""
    kind, _, rest = text.strip().partition(" ")
    kind, colon, samples = kind.partition(":")
    if kind not in POINTS:
        near = did_you_mean(kind, KINDS)
        raise argparse.ArgumentTypeError(f"must be {FORM} with KIND of {', '.join(KINDS)}, got {text!r}{near}")
    positions, _, name = rest.partition(":")
    points = [texts.numbers(each, "a point X,Y,Z", 3) for each in positions.split()]
    if len(points) != POINTS[kind]:
        article = "an" if kind == "angle" else "a"
        raise argparse.ArgumentTypeError(f"must have {POINTS[kind]} points X,Y,Z for {article} {kind}, got {text!r}")
    given = texts.count(samples, "samples") if colon else None
    return texts.made(lambda: Measure(kind, tuple(points), name.strip(), samples=given), names_option=True)


def measure_table(table: Mapping[str, Any]) -> Measure:
    """Return the measure of a scene file's {kind = …, points = [[X, Y, Z], …], name = …, samples = N}."""
    unknown = [key for key in table if key not in _KEYS]
    if unknown:
        near = did_you_mean(unknown[0], _KEYS)
        raise argparse.ArgumentTypeError(f"unknown key {unknown[0]!r}; keys are {', '.join(_KEYS)}{near}")
    missing = [key for key in _KEYS[:2] if key not in table]
    if missing:
        raise argparse.ArgumentTypeError(f"must have kind and points, got {dict(table)!r}")
    points = table["points"]
    if not (isinstance(points, list) and all(texts.are_numbers(point, 3) for point in points)):
        raise argparse.ArgumentTypeError(f"points must be an array of points [X, Y, Z], got {points!r}")
    return texts.made(lambda: Measure(**table), names_option=True)


def as_text(each: Measure) -> str:
    """Return a measure as the option takes it; the inverse of `measure`."""
    kind = f"{each.kind}:{each.samples}" if each.samples else each.kind
    points = " ".join(",".join(repr(number) for number in point) for point in each.points)
    return f"{kind} {points}" + (f":{each.name}" if each.name else "")
