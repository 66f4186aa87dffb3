"""Values of measures as CSV: a row for each quantity, and for each point of a profile.

Numbers have all their digits; a value that is not there, as outside a volume, is an empty field.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator
from typing import Any

from texvol.scene.measures.values import Measured, Profile

COLUMNS = ("name", "kind", "volume", "label", "quantity", "value", "unit", "distance", "x", "y", "z", "label name")


def csv_of(results: Iterable[Measured], unit: str = "") -> str:
    """Return all results as one table; `unit` is that of the world."""
    return _text([COLUMNS, *(row for each in results for row in _rows(each, unit))])


def csv_of_profile(profile: Profile, unit: str = "") -> str:
    """Return a profile as a table with a column for each volume, as a spreadsheet plots it."""
    unit = f" ({unit})" if unit else ""
    head = (f"distance{unit}", *(f"{axis}{unit}" for axis in "xyz"), *profile.volumes)
    rows = zip(profile.distances, profile.points, profile.values.T, strict=True)
    return _text([head, *((distance, *point, *values) for distance, point, values in rows)])


def _rows(each: Measured, unit: str) -> Iterator[tuple[Any, ...]]:
    for what, value, value_unit, volume, label, label_name in each.quantities:
        yield each.name, each.kind, volume, label, what, value, value_unit, "", "", "", "", label_name
    for number, point in enumerate(each.measure.points if each.measure else (), 1):
        yield each.name, each.kind, "", "", f"point {number}", "", unit, "", *point, ""
    if each.profile is not None:
        profile = each.profile
        for volume, value_unit, values in zip(profile.volumes, profile.units, profile.values, strict=True):
            for distance, point, value in zip(profile.distances, profile.points, values, strict=True):
                yield each.name, each.kind, volume, "", "value", value, value_unit, distance, *point, ""


def _text(rows: Iterable[Iterable[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_field(each) for each in row] for row in rows)
    return text.getvalue()


def _field(content: Any) -> Any:
    """Return a number with all its digits, or an empty field for NaN and None."""
    if content is None:
        return ""
    if isinstance(content, str | int):
        return content
    number = float(content)
    return "" if math.isnan(number) else repr(number)
