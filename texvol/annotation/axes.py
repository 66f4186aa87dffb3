"""Axes: three edges of the box at its silhouette, with ticks at round world coordinates, numbers, and names with units.

A number is the world coordinate of the point that its tick marks, along the world axis that the edge follows most
closely; where the box is oblique or sheared, too. Names say which way the numbers grow: "x (mm)", or "L→R (mm)".
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from itertools import pairwise, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.annotation import rounding
from texvol.annotation.marks import Point
from texvol.annotation.sheet import Rect, Sheet
from texvol.annotation.view import EDGES, Edge, View
from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume

_SCALE = 0.9
_TICK, _GAP, _NAME_GAP = 0.35, 0.3, 0.65  # ems
_SHORTEST = 3.0  # ems: on a shorter edge no two numbers have room
_CLOSEST = 1.2  # ems between ticks: numbers that stand beside a steep edge
_MOST_TICKS = 8
_STEEP = 0.8  # of a unit vector's part across: longer names go along edges steeper than that
_NAME_POSITIONS = (0.5, 0.35, 0.65, 0.2, 0.8)  # along the edge


class Label(NamedTuple):
    """A line of text and where it goes."""

    text: str
    middle: Point
    rect: Rect
    turned: bool = False


class Tick(NamedTuple):
    """A tick: the world coordinate that it marks, and where that lies in the picture."""

    value: float
    position: NDArray[np.float64]


class Axis(NamedTuple):
    """An edge of the box with all that belongs to it."""

    edge: Edge
    world_axis: int
    outward: NDArray[np.float64]  # unit vector of the picture
    ticks: list[Tick]
    numbers: list[Label]
    name: Label | None


def world_axes(volume: Volume) -> tuple[int, int, int]:
    """For each grid axis the world axis that the box's edge follows: each once, as closely as can be."""
    cosines = np.abs(volume.direction / np.linalg.norm(volume.direction, axis=0))
    x, y, z = max(permutations(range(3)), key=lambda order: float(np.prod([cosines[order[a], a] for a in range(3)])))
    return x, y, z


def axis_name(volume: Volume, world_axis: int, factor: str = "") -> str:
    """What an axis is called: "x (mm)", or which way its numbers grow in the body; and the factor of its numbers."""
    letters = letters_of_space(volume.space)
    name = f"{OPPOSITE[letters[world_axis]]}→{letters[world_axis]}" if letters else "xyz"[world_axis]
    unit = " ".join(part for part in (factor, volume.unit) if part)
    return f"{name} ({unit})" if unit else name


def laid_axes(sheet: Sheet, view: View) -> list[Axis]:
    """The axes that have room, longest first; what they take of the sheet is taken."""
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
                sheet.take(label.rect.grown(_GAP * sheet.em))  # the next axis' numbers are not to read on from these
            found.append(best)
    return found


def draw_axes(sheet: Sheet, view: View) -> None:
    """Draw the axes that have room."""
    for axis in laid_axes(sheet, view):
        ends = view.edge(axis.edge)
        assert ends is not None
        sheet.line(*ends, "line" if view.faces_that_show(axis.edge) else "behind")
        for tick in axis.ticks:
            sheet.line(tick.position, tick.position + _TICK * sheet.em * axis.outward)
        for label in [*axis.numbers, *([axis.name] if axis.name else [])]:
            sheet.text(label.text, label.middle, _SCALE, turned=label.turned)


def _candidates(view: View, axis: int) -> list[Edge]:
    """Edges at the silhouette; where there is none, as from inside the box, all."""
    seen = [edge for edge in EDGES if edge.axis == axis and view.visible_part(edge) is not None]
    silhouette = [edge for edge in seen if view.faces_that_show(edge) == 1]
    return silhouette or seen


def _worth(axis: Axis) -> tuple[bool, int, float]:
    """Names first, then a few numbers, then what lies at the left or below, where readers look for axes."""
    left_or_below = float(axis.outward @ (-1.0, 1.0))
    return axis.name is not None, min(len(axis.numbers), 3), left_or_below


def _length(view: View, edge: Edge) -> float:
    positions = _part(view, edge)
    return 0.0 if positions is None else float(np.linalg.norm(positions[1] - positions[0]))


def _part(view: View, edge: Edge) -> NDArray[np.float64] | None:
    """Where what is seen of an edge begins and ends in the picture."""
    fractions = view.visible_part(edge)
    return None if fractions is None else view.positions(_along(view, edge, np.array(fractions)))


def _along(view: View, edge: Edge, fractions: NDArray[np.float64]) -> NDArray[np.float64]:
    start, end = view.corners[edge.start], view.corners[edge.end]
    return start + fractions[:, np.newaxis] * (end - start)


def _laid(sheet: Sheet, view: View, edge: Edge, world_axis: int, side: float) -> Axis | None:
    """The axis along an edge, with its numbers on its outer (way 1) or inner side; None where it has no room."""
    fractions, positions = view.visible_part(edge), _part(view, edge)
    if fractions is None or positions is None or not _length(view, edge) >= _SHORTEST * sheet.em:
        return None
    outward = side * _outward(view, positions)
    ends = view.volume.centre[world_axis] + view.corners[[edge.start, edge.end], world_axis]
    low, high = sorted(ends[0] + np.array(fractions) * (ends[1] - ends[0]))
    if not high - low > 1e-9 * max(abs(low), abs(high)):  # so far from the origin that no digits are left
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
    """What may be marked, and its round step, from the closest on: all multiples of a step, or at last but two."""
    step = rounding.round_up(closest)
    while len(values := rounding.multiples(low, high, step)) >= 2:
        yield values, step
        step = rounding.next_round(step)
    step = rounding.round_down(high - low)
    while len(values := rounding.multiples(low, high, step)) < 2:
        step = rounding.round_down(float(step) / 1.5)
    yield [values[0], values[-1]], step


def _outward(view: View, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vector of the picture across an edge, away from the middle of the box, or of the picture from inside it."""
    along = (positions[1] - positions[0]) / np.linalg.norm(positions[1] - positions[0])
    across = np.array([-along[1], along[0]])
    corners = view.positions(view.corners)
    middle = corners.mean(axis=0) if np.isfinite(corners).all() else np.array(view.size) / 2
    return across if across @ (positions.mean(axis=0) - middle) >= 0 else -across


def _beside(
    sheet: Sheet, text: str, position: NDArray[np.float64], outward: NDArray[np.float64], off: float = 0, *,
    turned: bool = False,
) -> Label:  # fmt: skip
    """A text just beyond a tick, `off` pixels farther."""
    size = np.array(sheet.text_size(text, _SCALE))
    away = (_TICK + _GAP) * sheet.em + float(np.abs(outward) @ (size[::-1] if turned else size)) / 2 + off
    x, y = (float(part) for part in position + away * outward)
    return Label(text, (x, y), sheet.text_rect(text, (x, y), _SCALE, turned=turned), turned)


def _has_room(sheet: Sheet, tick: Tick, outward: NDArray[np.float64]) -> bool:
    ends = np.stack([tick.position, tick.position + _TICK * sheet.em * outward])
    rect = Rect(*ends.min(axis=0), *ends.max(axis=0))
    return not any(rect.meets(other) for other in sheet.taken)


def _named(
    sheet: Sheet, text: str, positions: NDArray[np.float64], outward: NDArray[np.float64], numbers: list[Label]
) -> Label | None:
    """The axis' name where there is room for it: beyond the numbers, or in the place of some of them."""
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
