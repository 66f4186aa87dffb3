"""Axes: three silhouette edges of the box, with ticks at round world coordinates, numbers, and names with units.

A number is the world coordinate of the point at its tick, along the world axis that the edge follows most closely. This
also holds for oblique and sheared boxes. Names give the direction of growing numbers: "x (mm)", or "L→R (mm)".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from decimal import Decimal
from itertools import pairwise, permutations
from typing import NamedTuple

import numpy as np

from texvol.annotation import rounding
from texvol.annotation.marks import Numbers, Point
from texvol.annotation.sheet import Rect, Sheet
from texvol.annotation.view import EDGES, Edge, View
from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume

_SCALE = 0.9
_TICK, _GAP, _NAME_GAP = 0.35, 0.3, 0.65  # ems
_SHORTEST = 3.0  # ems: a shorter edge has no room for two numbers
_CLOSEST = 1.2  # ems between ticks: for numbers beside a steep edge
_MOST_TICKS = 8
_STEEP = 0.8  # horizontal part of the outward unit vector: beyond, long names are written along the edge
_NAME_POSITIONS = (0.5, 0.35, 0.65, 0.2, 0.8)  # fractions of the edge


class Label(NamedTuple):
    """Line of text and its position in the picture."""

    text: str
    middle: Point
    rect: Rect
    turned: bool = False


class Tick(NamedTuple):
    """Tick: its world coordinate, and its position in the picture."""

    value: float
    position: Numbers


class Axis(NamedTuple):
    """Edge of the box with its ticks, numbers and name."""

    edge: Edge
    world_axis: int
    outward: Numbers  # unit vector in the picture
    ticks: list[Tick]
    numbers: list[Label]
    name: Label | None


def world_axes(volume: Volume) -> tuple[int, int, int]:
    """Return for each grid axis the world axis that the box's edge follows best; each world axis occurs once."""
    cosines = np.abs(volume.direction / np.linalg.norm(volume.direction, axis=0))
    x, y, z = max(permutations(range(3)), key=lambda order: float(np.prod([cosines[order[a], a] for a in range(3)])))
    return x, y, z


def axis_name(volume: Volume, world_axis: int, factor: str = "") -> str:
    """Return an axis' name, such as "x (mm)" or "L→R (mm)"; `factor` is the common factor of its numbers."""
    letters = letters_of_space(volume.space)
    name = f"{OPPOSITE[letters[world_axis]]}→{letters[world_axis]}" if letters else "xyz"[world_axis]
    unit = " ".join(part for part in (factor, volume.unit) if part)
    return f"{name} ({unit})" if unit else name


def laid_axes(sheet: Sheet, view: View) -> list[Axis]:
    """Return the axes that have room, longest first, and mark the room of their texts as taken."""
    followed = world_axes(view.volume)
    found: list[Axis] = []
    candidates = {axis: _candidates(view, axis) for axis in range(3)}
    for axis in sorted(range(3), key=lambda axis: -max((_length(view, edge) for edge in candidates[axis]), default=0)):
        laid = [
            each
            for edge in candidates[axis]
            for side in ((1.0,) if view.faces_that_show(edge) else (1.0, -1.0))
            if (each := _laid(sheet, view, edge, followed[axis], side)) is not None
        ]
        if laid:
            best = max(laid, key=_worth)
            for label in [*best.numbers, *([best.name] if best.name else [])]:
                sheet.taken.append(label.rect.grown(_GAP * sheet.em))  # keeps numbers of the next axis at a distance
            found.append(best)
    return found


def draw_axes(sheet: Sheet, view: View, axes: Iterable[Axis]) -> None:
    """Draw axes that have been laid."""
    for axis in axes:
        ends = view.edge(axis.edge)
        assert ends is not None
        sheet.broken_line(*ends, "line" if view.faces_that_show(axis.edge) else "behind")
        for tick in axis.ticks:
            sheet.line(tick.position, tick.position + _TICK * sheet.em * axis.outward)
        for label in [*axis.numbers, *([axis.name] if axis.name else [])]:
            sheet.text(label.text, label.middle, _SCALE, turned=label.turned)


def _candidates(view: View, axis: int) -> list[Edge]:
    """Return the axis' edges at the silhouette; all visible edges if there is none, as from inside the box."""
    seen = [edge for edge in EDGES if edge.axis == axis and view.visible_part(edge) is not None]
    silhouette = [edge for edge in seen if view.faces_that_show(edge) == 1]
    return silhouette or seen


def _worth(axis: Axis) -> tuple[bool, int, float]:
    """Return a sort key: axes with a name first, then with up to three numbers, then those at the left or below."""
    left_or_below = float(axis.outward @ (-1.0, 1.0))
    return axis.name is not None, min(len(axis.numbers), 3), left_or_below


def _length(view: View, edge: Edge) -> float:
    positions = _part(view, edge)
    return 0.0 if positions is None else float(np.linalg.norm(positions[1] - positions[0]))


def _part(view: View, edge: Edge) -> Numbers | None:
    """Return the ends of an edge's visible part in the picture, shape (2, 2)."""
    fractions = view.visible_part(edge)
    return None if fractions is None else view.positions(_along(view, edge, np.array(fractions)))


def _along(view: View, edge: Edge, fractions: Numbers) -> Numbers:
    start, end = view.corners[edge.start], view.corners[edge.end]
    return start + fractions[:, np.newaxis] * (end - start)


def _laid(sheet: Sheet, view: View, edge: Edge, world_axis: int, side: float) -> Axis | None:
    """Return the axis along an edge, with numbers on its outer (`side` 1) or inner (-1) side; None without room."""
    fractions, positions = view.visible_part(edge), _part(view, edge)
    if fractions is None or positions is None or not _length(view, edge) >= _SHORTEST * sheet.em:
        return None
    outward = side * _outward(view, positions)
    ends = view.volume.centre[world_axis] + view.corners[[edge.start, edge.end], world_axis]
    low, high = sorted(ends[0] + np.array(fractions) * (ends[1] - ends[0]))
    if not high - low > 1e-9 * max(abs(low), abs(high)):  # too far from the origin: the numbers would be equal
        return None
    closest = (high - low) * max(_CLOSEST * sheet.em / _length(view, edge), 1 / _MOST_TICKS)
    for values, step in _choices(low, high, closest):
        texts, factor = rounding.written(values, step)
        at = (np.array([float(value) for value in values]) - ends[0]) / (ends[1] - ends[0])
        marked = view.positions(_along(view, edge, at))
        labels = [_beside(sheet, text, position, outward) for text, position in zip(texts, marked, strict=True)]
        if not any(one.rect.grown(_GAP / 2 * sheet.em).meets(other.rect.grown(_GAP / 2 * sheet.em))
                   for one, other in pairwise(labels)):  # fmt: skip
            numbers = [label for label in labels if sheet.fits(label.rect)]
            if len(numbers) < 2:
                return None
            ticks = [Tick(float(value), position) for value, position in zip(values, marked, strict=True)]
            ticks = [tick for tick in ticks if _has_room(sheet, tick, outward)]
            name = _named(sheet, axis_name(view.volume, world_axis, factor), positions, outward, numbers)
            return Axis(edge, world_axis, outward, ticks, numbers, name)
    return None


def _choices(low: float, high: float, closest: float) -> Iterator[tuple[list[Decimal], Decimal]]:
    """Yield coordinates to mark and their round step, from the closest step on; the last choice has two coordinates."""
    step = rounding.round_up(closest)
    while len(values := rounding.multiples(low, high, step)) >= 2:
        yield values, step
        step = rounding.round_up(float(step) * 1.5)  # the next round number
    step = rounding.round_down(high - low)
    while len(values := rounding.multiples(low, high, step)) < 2:
        step = rounding.round_down(float(step) / 1.5)
    yield [values[0], values[-1]], step


def _outward(view: View, positions: Numbers) -> Numbers:
    """Return the unit vector across an edge, away from the box's centre, or from the picture's if inside the box."""
    along = (positions[1] - positions[0]) / np.linalg.norm(positions[1] - positions[0])
    across = np.array([-along[1], along[0]])
    corners = view.corner_positions
    middle = corners.mean(axis=0) if np.isfinite(corners).all() else np.array(view.size) / 2
    return across if across @ (positions.mean(axis=0) - middle) >= 0 else -across


def _beside(
    sheet: Sheet, text: str, position: Numbers, outward: Numbers, off: float = 0, *,
    turned: bool = False,
) -> Label:  # fmt: skip
    """Return a text just beyond a tick, `off` pixels farther out."""
    size = np.array(sheet.text_size(text, _SCALE))
    away = (_TICK + _GAP) * sheet.em + float(np.abs(outward) @ (size[::-1] if turned else size)) / 2 + off
    x, y = (float(part) for part in position + away * outward)
    return Label(text, (x, y), sheet.text_rect(text, (x, y), _SCALE, turned=turned), turned)


def _has_room(sheet: Sheet, tick: Tick, outward: Numbers) -> bool:
    ends = np.stack([tick.position, tick.position + _TICK * sheet.em * outward])
    rect = Rect(*ends.min(axis=0), *ends.max(axis=0))
    return not any(rect.meets(other) for other in sheet.taken)


def _named(sheet: Sheet, text: str, positions: Numbers, outward: Numbers, numbers: list[Label]) -> Label | None:
    """Return the axis' name where it has room: beyond the numbers, or in place of some of them; None without room."""
    widest = max(np.abs(outward) @ (label.rect.right - label.rect.left, label.rect.bottom - label.rect.top)
                 for label in numbers)  # fmt: skip
    width, height = sheet.text_size(text, _SCALE)
    turned = abs(float(outward[0])) > _STEEP and width > 2 * height
    spots = [positions[0] + fraction * (positions[1] - positions[0]) for fraction in _NAME_POSITIONS]
    for spot in spots:
        label = _beside(sheet, text, spot, outward, float(widest) + _NAME_GAP * sheet.em, turned=turned)
        if sheet.fits(label.rect, [number.rect for number in numbers]):
            return label
    for spot in spots:
        label = _beside(sheet, text, spot, outward)
        left = [number for number in numbers if not number.rect.grown(_GAP / 2 * sheet.em).meets(label.rect)]
        if sheet.fits(label.rect) and len(left) >= 2:
            numbers[:] = left
            return label
    return None
