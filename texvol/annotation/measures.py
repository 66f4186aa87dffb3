"""Measures in a picture: lines with ticks at their ends, arcs and boxes, and the value of each.

Measures are drawn in front of everything, as a ruler is laid on a photograph: a ruler through a head would otherwise
lose its end. The edges of a box that its faces hide are fainter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.annotation import rounding
from texvol.annotation.marks import fractions_inside
from texvol.annotation.sheet import Rect, Sheet
from texvol.annotation.view import EDGES, View
from texvol.scene.measures.measure import Measure
from texvol.scene.measures.values import own_quantities
from texvol.scene.volume import Volume

Color = tuple[float, float, float]
Numbers = NDArray[np.float64]
# Linear colours on a dark and on a light background: amber and rust stand out from grey pictures and from most colours.
ON_DARK: Color = (1.0, 0.62, 0.07)
ON_LIGHT: Color = (0.55, 0.10, 0.0)
_LUMINANCE, _MID_GREY = (0.2126, 0.7152, 0.0722), 0.18  # Rec. 709; linear light half way between black and white
FAINT = 0.45  # opacity of hidden edges
_DIGITS = 4  # of a value below 10,000
_TICK, _ARROW, _GAP, _ARC = 0.45, 0.55, 0.5, 1.6  # ems: half a tick, an arrow's head, text beside a line, least arc
_HALO = 1 / 5  # ems by which the outline of a line is wider than the line
_ARC_PART = 0.35  # of the shorter arm
_ARC_STEPS = 24
_THINNEST = 1e-9  # of the box's radius: the least edge of a measured box
_FARTHEST = 6  # ems above or below the best position of a value, where those beside the measure are taken
_ALONG = (0.5, 0.35, 0.65, 0.2, 0.8)  # positions of a value along its line


class Stroke(NamedTuple):
    """Line in the picture, in pixels."""

    start: Numbers
    end: Numbers
    faint: bool = False


class Anchor(NamedTuple):
    """Point beside which a value may be written, and the direction away from the measure."""

    point: Numbers
    away: Numbers


@dataclass(frozen=True)
class Marks:
    """Lines of a measure, its text, and the positions where the text may stand, the best first."""

    strokes: tuple[Stroke, ...]
    text: str
    anchors: tuple[Anchor, ...]


def value_text(measure: Measure, unit: str) -> str:
    """Return the value of a measure with its unit: a length, an angle, or the volume of a box."""
    quantity = own_quantities(measure, unit)[0]
    number = rounding.grouped(quantity.value, _DIGITS)
    return f"{number}°" if measure.kind == "angle" else f"{number} {quantity.unit}".strip()


def text_of(measure: Measure, unit: str) -> str:
    """Return the text at a measure: its name, if it has one, and its value."""
    value = value_text(measure, unit)
    return f"{' '.join(measure.name.split())}: {value}" if measure.name.strip() else value


def color_on(background: ArrayLike) -> Color:
    """Return the colour of measures over a linear background."""
    linear = np.clip(np.asarray(background, np.float64), 0, 1)
    return ON_LIGHT if float(linear @ _LUMINANCE) > _MID_GREY else ON_DARK


def marks_of(measure: Measure, view: View, em: float, unit: str) -> Marks | None:
    """Return the marks of a measure in a picture; None if no part is in front of the eye."""
    points = np.array(measure.points) - view.volume.centre
    make = {"ruler": _line, "profile": _line, "angle": _angle, "box": _box}[measure.kind]
    strokes, anchors = make(points, view, em)
    if measure.kind == "profile":
        strokes = [*strokes, *_arrow(points, view, em)]
    return Marks(tuple(strokes), text_of(measure, unit), tuple(anchors)) if strokes else None


def draw_measures(sheet: Sheet, view: View, measures: Sequence[Measure], color: Color) -> None:
    """Draw the measures that are shown."""
    unit = view.volume.unit
    shown = [marks_of(measure, view, sheet.em, unit) for measure in measures if measure.shown]
    every = [marks for marks in shown if marks is not None]
    for width, layer, shade in ((_HALO * sheet.em, "outline", sheet.outline_color), (0.0, "line", color)):
        with _pen(sheet, shade, sheet.width + width):
            for stroke in (stroke for marks in every for stroke in marks.strokes):
                if not (stroke.faint and layer == "outline"):
                    sheet.line(stroke.start, stroke.end, layer, FAINT if stroke.faint else 1.0)
    for text, middle in placed_texts(every, sheet.text_size, sheet.em, sheet.size, sheet.taken):
        sheet.taken.append(sheet.text_rect(text, middle))
        with _pen(sheet, color, sheet.width):
            sheet.text(text, middle)


@contextmanager
def _pen(sheet: Sheet, color: ArrayLike, width: float) -> Iterator[None]:
    """Draw with another colour and width of lines."""
    before = sheet.color, sheet.width
    sheet.color, sheet.width = np.asarray(color, np.float64), width
    yield
    sheet.color, sheet.width = before


def placed_texts(
    every: Sequence[Marks], extent: Callable[[str], tuple[float, float]], em: float, size: tuple[int, int],
    taken: Sequence[Rect],
) -> list[tuple[str, tuple[float, float]]]:  # fmt: skip
    """Return the texts of measures in the picture, with their middles: free of others and of lines if possible.

    A value is never left out: where nothing is free it stands at the best position all the same.

    Parameters
    ----------
    extent : callable
        Returns the width and the height of a text in pixels.
    taken : sequence of Rect
        Rectangles of other parts of the annotation.
    """
    strokes = [stroke for marks in every for stroke in marks.strokes if _is_in(stroke, size)]
    found: list[tuple[str, tuple[float, float]]] = []
    rects = list(taken)
    for marks in every:
        if not any(_is_in(stroke, size) for stroke in marks.strokes):
            continue
        text = extent(marks.text)
        beside = [_moved_inside(middle, text, em, size) for middle in _middles(marks, text, em)]
        farther = [_moved_inside(middle, text, em, size) for middle in _farther(beside[0], em)]
        free = _free(beside, text, em, rects) or _free(farther, text, em, rects)
        clear = (each for each in free if not any(_crosses(stroke, _around(each, text)) for stroke in strokes))
        middle = next(clear, (free or beside)[0])
        rects.append(_around(middle, text))
        found.append((marks.text, middle))
    return found


def _meets(rect: Rect, others: Sequence[Rect]) -> bool:
    return any(rect.meets(other) for other in others)


def _free(
    middles: Sequence[tuple[float, float]], text: tuple[float, float], em: float, taken: Sequence[Rect]
) -> list[tuple[float, float]]:
    """Return the positions at which a text keeps clear of rectangles."""
    return [each for each in middles if not _meets(_around(each, text).grown(_GAP / 2 * em), taken)]


def _crosses(stroke: Stroke, rect: Rect) -> bool:
    """True if a line crosses a rectangle."""
    first, last = fractions_inside(stroke.start, stroke.end, rect)
    return first < last


def _middles(marks: Marks, text: tuple[float, float], em: float) -> Iterator[tuple[float, float]]:
    for point, away in marks.anchors:
        distance = _GAP * em + float(np.abs(away) @ np.array(text)) / 2
        yield float(point[0] + distance * away[0]), float(point[1] + distance * away[1])


def _farther(middle: tuple[float, float], em: float) -> Iterator[tuple[float, float]]:
    """Yield positions around one, the nearest first."""
    for distance in range(1, _FARTHEST + 1):
        for x, y in ((0, -1), (0, 1), (-2, 0), (2, 0), (-2, -1), (2, -1), (-2, 1), (2, 1)):
            yield middle[0] + x * distance * em, middle[1] + y * distance * em


def _around(middle: tuple[float, float], text: tuple[float, float]) -> Rect:
    (x, y), (width, height) = middle, text
    return Rect(x - width / 2, y - height / 2, x + width / 2, y + height / 2)


def _moved_inside(
    middle: tuple[float, float], text: tuple[float, float], em: float, size: tuple[int, int]
) -> tuple[float, float]:
    x, y = (
        float(np.clip(at, low, high)) if (low := _GAP * em + own / 2) < (high := count - low) else count / 2
        for at, own, count in zip(middle, text, size, strict=True)
    )
    return x, y


def _is_in(stroke: Stroke, size: tuple[int, int]) -> bool:
    """True if a part of a line is in the picture."""
    first, last = fractions_inside(stroke.start, stroke.end, (0, 0, *size))
    return first < last


def _line(points: Numbers, view: View, em: float) -> tuple[list[Stroke], list[Anchor]]:
    """Return a line with a tick at each end, and positions on both sides of it, upper ones first."""
    ends = view.segment(points)
    if ends is None:
        return [], []
    across = _across(ends[1] - ends[0])
    strokes = [Stroke(*ends)]
    for seen in view.positions(points):
        if np.isfinite(seen).all():
            strokes.append(Stroke(seen - _TICK * em * across, seen + _TICK * em * across))
    inside = _clipped(*ends, view.size)
    anchors = [
        Anchor(inside[0] + fraction * (inside[1] - inside[0]), side * across)
        for fraction in _ALONG for side in (1.0, -1.0)
    ]  # fmt: skip
    return strokes, anchors


def _arrow(points: Numbers, view: View, em: float) -> list[Stroke]:
    """Return the head of an arrow at the end of a profile, so that its direction is seen."""
    start, end = view.positions(points)
    length = float(np.linalg.norm(end - start))
    if not (np.isfinite(length) and length > 2 * _ARROW * em):
        return []
    along = (end - start) / length
    side = np.array([-along[1], along[0]])
    return [Stroke(end, end - _ARROW * em * (1.6 * along + sign * 0.8 * side)) for sign in (1, -1)]


def _angle(points: Numbers, view: View, em: float) -> tuple[list[Stroke], list[Anchor]]:
    """Return two arms and an arc of a circle between them, in the plane of the three points."""
    strokes = []
    for end in (points[0], points[2]):
        seen = view.segment(np.stack([points[1], end]))
        strokes += [] if seen is None else [Stroke(*seen)]
    vertex = view.positions(points[1:2])[0]
    if not strokes or not np.isfinite(vertex).all():
        return strokes, [Anchor(stroke.start, np.array((0.0, -1.0))) for stroke in strokes]
    arc = _arc(points, view, em)
    strokes += [Stroke(one, other) for one, other in pairwise(arc) if np.isfinite([one, other]).all()]
    middle = arc[len(arc) // 2] if len(arc) and np.isfinite(arc[len(arc) // 2]).all() else vertex
    outward = _unit(middle - vertex, np.array((0.0, -1.0)))
    return strokes, [
        Anchor(middle, outward), Anchor(vertex, -outward),
        *(Anchor(middle, side * np.array((outward[1], -outward[0]))) for side in (1.0, -1.0)),
    ]  # fmt: skip


def _arc(points: Numbers, view: View, em: float) -> Numbers:
    """Return the positions of points of the arc, shape (n, 2); none if an arm has no length."""
    arms = points[[0, 2]] - points[1]
    lengths = np.linalg.norm(arms, axis=1)
    if not (lengths > 0).all():
        return np.empty((0, 2))
    first, second = arms / lengths[:, np.newaxis]
    across = second - (first @ second) * first
    height = float(np.linalg.norm(across))
    if height < 1e-9:  # arms on one line have no plane
        return np.empty((0, 2))
    whole = float(np.arctan2(height, first @ second))
    depth = float(view.camera.in_eye_space(points[1:2], view.volume.centre)[0, 2])
    least = _ARC * em * view.pixel_size(max(depth, 0.0))
    radius = min(max(_ARC_PART * float(lengths.min()), least), 0.9 * float(lengths.min()))
    angles = np.linspace(0, whole, _ARC_STEPS + 1)[:, np.newaxis]
    return view.positions(points[1] + radius * (np.cos(angles) * first + np.sin(angles) * across / height))


def _box(points: Numbers, view: View, em: float) -> tuple[list[Stroke], list[Anchor]]:
    """Return the edges of a box, hidden ones faint, and positions below and above it."""
    low, high = points.min(axis=0), points.max(axis=0)
    edges = np.maximum(high - low, _THINNEST * view.volume.radius)
    centre = view.volume.centre + (low + high) / 2
    box = View(view.camera, Volume(np.zeros((1, 1, 1), np.uint8), tuple(edges), tuple(centre)), view.size)
    strokes = []
    for edge in EDGES:
        seen = box.edge(edge)
        if seen is not None:
            strokes.append(Stroke(*seen, faint=box.faces_that_show(edge) == 0))
    if not strokes:
        return [], []
    ends = np.concatenate([(stroke.start, stroke.end) for stroke in strokes])
    first, last = ends.min(axis=0), ends.max(axis=0)
    middle = (first + last) / 2
    sides = ((middle[0], last[1]), (0, 1)), ((middle[0], first[1]), (0, -1)), ((last[0], middle[1]), (1, 0))
    further = (((first[0], middle[1]), (-1, 0)),)
    return strokes, [Anchor(np.array(point), np.array(away, np.float64)) for point, away in sides + further]


def _across(along: Numbers) -> Numbers:
    """Return the unit vector across a line of the picture that points upwards, or to the right."""
    unit = _unit(along, np.array((1.0, 0.0)))
    across = np.array((unit[1], -unit[0]))
    return -across if across[1] > 1e-9 or (abs(across[1]) <= 1e-9 and across[0] < 0) else across


def _unit(vector: Numbers, otherwise: Numbers) -> Numbers:
    length = float(np.linalg.norm(vector))
    return vector / length if np.isfinite(length) and length > 1e-9 else otherwise


def _clipped(start: Numbers, end: Numbers, size: tuple[int, int]) -> tuple[Numbers, Numbers]:
    """Return the part of a line in the picture; the line itself if no part is."""
    first, last = fractions_inside(start, end, (0, 0, *size))
    step = end - start
    return (start + first * step, start + last * step) if first < last else (start, end)
