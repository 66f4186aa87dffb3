"""Text files of 3D Slicer, Inviwo, MRIcroGL and VisRTX, as curves of colour and opacity."""

from __future__ import annotations

import configparser
from collections.abc import Sequence
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

from texvol.scene.transfer.foreign.content import Content, Length
from texvol.scene.transfer.foreign.curves import Curve, Node, nodes_of
from texvol.scene.transfer.foreign.json_forms import by_gradient, lit
from texvol.util.errors import InputError

_SLICER_LINES = 9
_BOX_LENGTHS = 150.0  # Inviwo's opacities are of this fraction of an edge of the box (its REF_SAMPLING_INTERVAL)
_OF_THE_BOX = f"per {_BOX_LENGTHS:g}th of the mean edge of the volume's box, as Inviwo's"
_IN_RANGE = {"values": "range"}
_OF_THE_RANGE = (
    "its values are fractions of the range, from the smallest to the largest sample; --range LOW,HIGH moves them"
)
_BYTE = 255.0
_LEAST_ROWS = 2


def slicer(text: str) -> Content:
    """Return the content of a .vp: nine lines with one number each, then three lists that begin with their length."""
    lines = text.splitlines()
    if len(lines) < _SLICER_LINES:
        raise InputError(f"must have {_SLICER_LINES} lines, got {len(lines)}")
    _, shade, diffuse, ambient, specular, power = (_number(line, number) for number, line in enumerate(lines[:6], 1))
    opacity, gradient, color = (_list(line, number) for number, line in enumerate(lines[6:9], 7))
    keys: dict[str, Any] = lit(ambient, diffuse, specular, power) if shade else {}
    notes: tuple[str, ...] = ()
    if gradient:
        more, notes = by_gradient(nodes_of(gradient, 1, "gradient opacity"))
        keys |= more
    length = Length(reason="per 1 world unit, as 3D Slicer takes those of a .vp")
    colors = Curve(nodes_of(color, 3, "colours"))
    return Content(colors, Curve(nodes_of(opacity, 1, "opacities")), length, keys, notes)


def _number(line: str, number: int) -> float:
    words = line.split()
    try:
        return float(words[0])
    except (IndexError, ValueError):
        raise InputError(f"line {number} must be a number, got {line[:60]!r}") from None


def _list(line: str, number: int) -> list[float]:
    words = line.split()
    try:
        count, numbers = int(words[0]), [float(word) for word in words[1:]]
    except (IndexError, ValueError):
        raise InputError(f"line {number} must be a count and numbers, got {line[:60]!r}") from None
    if count != len(numbers):
        raise InputError(f"line {number} must have {count} numbers by its first word, got {len(numbers)}")
    return numbers


def inviwo(text: str) -> Content:
    """Return the content of an .itf: points with a position in [0, 1] of the range of values, or with the value."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError("must have no document type, which a transfer function of Inviwo does not have")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"is not XML: {error}") from None
    points = [each for each in root.iter() if each.tag.lower() == "point"]
    if not points:
        raise InputError("must have points, each with pos and rgba")
    rows = sorted((_inviwo_row(point) for point in points), key=lambda row: row[0])
    kind = next((each.get("content", "") for each in root.iter("type")), "0")
    is_absolute = kind in ("1", "Absolute", "absolute")
    low, high = (_content(root, name, default) for name, default in (("maskMin", None), ("maskMax", None)))
    color, opacity = _both(rows)
    masked = _masked(opacity, low, high)
    length = Length("box", 1 / _BOX_LENGTHS, _OF_THE_BOX)
    keys = {} if is_absolute else _IN_RANGE
    return Content(color, masked, length, keys, () if is_absolute else (_OF_THE_RANGE,))


def _inviwo_row(point: ElementTree.Element) -> list[float]:
    position, color = point.find("pos"), point.find("rgba")
    if position is None or color is None:
        raise InputError("each point must have pos and rgba")
    # Older files have the position as x of two numbers.
    texts = [position.get("content") or position.get("x"), *(color.get(axis) for axis in "xyzw")]
    try:
        return [float(each or "") for each in texts]
    except ValueError:
        raise InputError(f"pos and rgba must be numbers, got {texts}") from None


def _content(root: ElementTree.Element, name: str, default: float | None) -> float | None:
    found = next(root.iter(name), None)
    if found is None:
        return default
    try:
        return float(found.get("content", ""))
    except ValueError:
        raise InputError(f"{name} must be a number, got {found.get('content')!r}") from None


def _masked(opacity: Curve, low: float | None, high: float | None) -> Curve:
    """Return the opacity that is 0 below and above the ends of a mask."""
    first, last = opacity.knots[0], opacity.knots[-1]
    begin, end = (first if low is None else low), (last if high is None else high)
    if begin <= first and end >= last:
        return opacity
    knots = [begin, *(each for each in opacity.knots if begin < each < end), end]
    nodes = [Node(begin, opacity.first.numbers * 0)]
    for before, after in pairwise(knots):
        function = opacity.inside(before, after)
        nodes += [Node(before, function(before)), Node(after, function(after))]
    return Curve([*nodes, Node(end, opacity.first.numbers * 0)])


def mricrogl(text: str) -> Content:
    """Return the content of a .clut: nodes of an intensity from 0 to 255 between the ends `min` and `max`."""
    parser = configparser.ConfigParser(interpolation=None, strict=False, allow_no_value=True)
    try:
        parser.read_string(text)
    except configparser.Error as error:
        raise InputError(f"is not a colour table of MRIcroGL: {' '.join(str(error).split())}") from None
    fields = {key: value or "" for section in parser.sections() for key, value in parser[section].items()}
    count = int(_field(fields, "numnodes"))
    if not 1 <= count <= 65536:
        raise InputError(f"numnodes must be from 1 to 65536, got {count}")
    low, high = (float(fields.get(name) or 0.0) for name in ("min", "max"))
    is_relative = not high > low
    rows = []
    for number in range(count):
        at = _field(fields, f"nodeintensity{number}") / _BYTE
        at = 1.0 if number == count - 1 else at  # as MRIcroGL moves the last node
        rgba = _bytes(fields.get(f"nodergba{number}", ""), f"nodergba{number}")
        rows.append([at if is_relative else low + at * (high - low), *rgba])
    color, opacity = _both(sorted(rows, key=lambda row: row[0]))
    length = Length("spacing", 1.0, "per smallest spacing of samples, MRIcroGL's voxel")
    return Content(color, opacity, length, _IN_RANGE if is_relative else {}, (_OF_THE_RANGE,) if is_relative else ())


def _bytes(text: str, what: str) -> list[float]:
    """Return red, green, blue and opacity of a text R|G|B|A, at most 1 as MRIcroGL takes them."""
    words = [each.strip() for each in text.rstrip().rstrip("|").split("|")]
    if len(words) != 4 or not all(each.isdigit() and len(each) < 10 for each in words):
        raise InputError(f"{what} must be four whole numbers R|G|B|A, got {text[:60]!r}")
    return [min(int(each) / _BYTE, 1.0) for each in words]


def _field(fields: dict[str, str], key: str) -> float:
    try:
        return float(fields.get(key, ""))
    except ValueError:
        raise InputError(f"{key} must be a number, got {fields.get(key)!r}") from None


def rows(text: str) -> Content:
    """Return the content of a .1dt: a line of red, green, blue and opacity for each of evenly spread values."""
    found: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or line.startswith("#"):
            continue
        if len(words) == 1 and not found and words[0].isdigit():  # ImageVis3D's files begin with their length
            continue
        try:
            found.append([float(word) for word in words[:4]])
        except ValueError:
            found.append([])
        if len(found[-1]) != 4:
            raise InputError(f"line {number} must be red, green, blue and opacity, got {line[:60]!r}")
    if len(found) < _LEAST_ROWS:
        raise InputError(f"must have at least {_LEAST_ROWS} lines of red, green, blue and opacity, got {len(found)}")
    table = [[number / (len(found) - 1), *row] for number, row in enumerate(found)]
    color, opacity = _both(table)
    length = Length(reason="per 1 world unit, ANARI's own default")
    return Content(color, opacity, length, _IN_RANGE, (_OF_THE_RANGE,))


def _both(table: Sequence[Sequence[float]]) -> tuple[Curve, Curve]:
    """Return the curves of colour and opacity of rows of a value, red, green, blue and opacity."""
    color = nodes_of([number for row in table for number in row[:4]], 3, "colours")
    opacity = nodes_of([number for row in table for number in (row[0], row[4])], 1, "opacities")
    return Curve(color), Curve(opacity)
