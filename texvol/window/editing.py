"""Edits of a transfer function's control points, and changes of the mode.

The colours of control points are straight and linear, whichever kind the transfer function holds. A premultiplied
transfer function stores colour × extinction; a point whose extinction is 0 takes the colour of its nearest neighbour.
The parts of a transfer function that depend on the gradient are not changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene import transfer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.air import air_in_8_bits
from texvol.scene.looks import Look
from texvol.scene.optics import depth_from_opacity, opacity_from_depth
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window.navigation import triple

Color = tuple[float, float, float]
_LENGTH = 1 / 20  # of the box's mean edge


@dataclass(frozen=True)
class Point:
    """Control point: value in data units, straight linear colour (or emission), extinction per world unit."""

    value: float
    color: Color
    extinction: float


@dataclass(frozen=True)
class Curve:
    """Control points, ascending by value; each edit returns a new Curve."""

    points: tuple[Point, ...]

    @classmethod
    def of(cls, medium: TransferFunction) -> Curve:
        """Return the control points of a transfer function."""
        numbers = medium.values.tolist(), map(triple, _straight(medium)), medium.extinctions.tolist()
        return cls(tuple(map(Point, *numbers)))

    def applied(self, medium: TransferFunction) -> TransferFunction:
        """Return the transfer function with these control points."""
        colors = np.array([point.color for point in self.points])
        extinctions = np.array([point.extinction for point in self.points])
        if medium.premultiplied:
            colors = colors * np.where(np.isinf(extinctions), 1.0, extinctions)[:, np.newaxis]
        values = np.array([point.value for point in self.points])
        return replace(medium, values=values, colors=colors, extinctions=extinctions)

    def moved(self, index: int, value: float, extinction: float) -> Curve:
        """Return the curve with point `index` moved; its value stays between its neighbours' values."""
        low = self.points[index - 1].value if index else -np.inf
        high = self.points[index + 1].value if index + 1 < len(self.points) else np.inf
        return self._with(index, value=float(np.clip(value, low, high)), extinction=max(extinction, 0.0))

    def colored(self, index: int, color: Color) -> Curve:
        """Return the curve with point `index` in another linear colour."""
        return self._with(index, color=triple(np.maximum(color, 0.0)))

    def added(self, value: float, extinction: float | None = None) -> tuple[Curve, int]:
        """Return the curve with a new point, and the point's index; by default the point lies on the curve."""
        values = np.array([point.value for point in self.points])
        index = int(np.searchsorted(values, value, side="right"))
        before, after = self.points[max(index - 1, 0)], self.points[min(index, len(self.points) - 1)]
        width = after.value - before.value
        fraction = (value - before.value) / width if width > 0 else 0.0
        fraction = float(np.clip(fraction, 0, 1))
        color = triple((1 - fraction) * np.array(before.color) + fraction * np.array(after.color))
        if extinction is None:
            ends = before.extinction, after.extinction
            extinction = max(ends) if np.isinf(max(ends)) else (1 - fraction) * ends[0] + fraction * ends[1]
        point = Point(float(value), color, float(extinction))
        return Curve((*self.points[:index], point, *self.points[index:])), index

    def removed(self, index: int) -> Curve:
        """Return the curve without point `index`; the last point is never removed."""
        if len(self.points) == 1:
            return self
        return Curve(self.points[:index] + self.points[index + 1 :])

    def denser(self, factor: float) -> Curve:
        """Return the curve with all extinctions multiplied by `factor`."""
        return Curve(tuple(replace(point, extinction=point.extinction * factor) for point in self.points))

    def between(self, low: float, high: float) -> Curve:
        """Return the curve scaled to the values from `low` to `high`."""
        first, last = self.points[0].value, self.points[-1].value
        if not high > low:
            return self
        if not last > first:
            return Curve(tuple(replace(point, value=low) for point in self.points))
        scale = (high - low) / (last - first)
        placed = accumulate((low + (point.value - first) * scale for point in self.points), max)
        return Curve(tuple(replace(point, value=value) for point, value in zip(self.points, placed, strict=True)))

    def _with(self, index: int, **changed: Any) -> Curve:
        return Curve((*self.points[:index], replace(self.points[index], **changed), *self.points[index + 1 :]))


def owner_of(scene: Scene, number: int) -> Scene | AddedVolume:
    """Return the object that has a volume by its number, with mask and transfer function: the scene has volume 0."""
    return scene if number == 0 else scene.added[number - 1]


def with_own(scene: Scene, number: int, **parts: Any) -> dict[str, Any]:
    """Return the changed parts of a scene with another transfer function or mask of a volume."""
    if number == 0:
        return parts
    changed = replace(scene.added[number - 1], **parts)
    return {"added": (*scene.added[: number - 1], changed, *scene.added[number:])}


def with_look(scene: Scene, number: int, look: Look) -> dict[str, Any]:
    """Return the changed parts of a scene with the look of a volume; light that it has none of stays as it is.

    A medium that emits is not lit. The next look after it is, if it has light.
    """
    parts = with_own(scene, number, transfer_function=look.transfer_function)
    before = owner_of(scene, number).transfer_function
    if look.transfer_function.emissive:
        parts["lighting"] = None
    elif look.lighting is not None and scene.lighting is None and before is not None and before.emissive:
        parts["lighting"] = look.lighting
    return parts


def with_file(scene: Scene, look: Look) -> dict[str, Any]:
    """Return the changed parts of a scene with the look of a file, its light included if it has any."""
    lit = {} if look.lighting is None else {"lighting": look.lighting, "gradient": look.gradient}
    return with_look(scene, 0, look) | lit


def with_mode(scene: Scene, mode: str) -> dict[str, Any]:
    """Return the changed parts of a scene in another mode, with values for what that mode requires."""
    parts: dict[str, Any] = {"mode": mode, "isovalue": None, "isosurfaces": (), "caps": False, "air": None}
    if mode == "xray":
        parts["air"] = air_in_8_bits(scene.volume)
    if mode == "isosurface":
        low, high = scene.volume.finite_range or (0.0, 1.0)
        parts["isovalue"] = (low + high) / 2
        if scene.lighting is not None and scene.lighting.shadows:
            parts["lighting"] = replace(scene.lighting, shadows=False)
    if mode == "composite" and scene.transfer_function is None:
        parts["transfer_function"] = transfer.proposed_for(scene.volume)
    return parts


def with_coloring(scene: Scene, coloring: str) -> dict[str, Any]:
    """Return the changed parts of a scene in another colouring of numbers: "grey", or "tf" by a transfer function."""
    parts: dict[str, Any] = {"coloring": coloring}
    if coloring == "tf" and scene.transfer_function is None:
        parts["transfer_function"] = transfer.proposed_for(scene.volume)
    return parts


def plot_length(volume: Volume) -> float:
    """Return the length, world units, over which proposed transfer functions use the height of a plot."""
    return _LENGTH * float(np.linalg.norm(volume.box_edges, axis=0).mean())


def opacity_of(extinction: NDArray | float, length: float) -> NDArray[np.float64]:
    """Return the opacity of a path: 1 - exp(-extinction × length)."""
    return np.asarray(opacity_from_depth(np.asarray(extinction, np.float64) * length))


def extinction_of(opacity: float, length: float) -> float:
    """Return the extinction, per world unit, of a medium with this opacity over a length; infinite for opacity 1."""
    return float(depth_from_opacity(np.clip(opacity, 0, 1)) / length)


def _straight(medium: TransferFunction) -> NDArray[np.float64]:
    """Return the straight colours of a transfer function's control points, shape (n, 3)."""
    if not medium.premultiplied:
        return medium.colors
    known = np.isinf(medium.extinctions) | (medium.extinctions > 0)
    weights = np.where(np.isinf(medium.extinctions), 1.0, medium.extinctions)
    straight = np.divide(
        medium.colors, weights[:, np.newaxis], out=np.zeros_like(medium.colors), where=known[:, np.newaxis]
    )
    if known.any():
        positions = np.flatnonzero(known)
        nearest = positions[np.abs(np.arange(len(known))[:, np.newaxis] - positions).argmin(axis=1)]
        straight = straight[nearest]
    return np.asarray(np.minimum(straight, 1.0))
