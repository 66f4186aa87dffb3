"""Opacity shapes: ramp, peak, step and others, between the ends of a transfer function whose colours stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from texvol.scene.transfer import TransferFunction, adjusting
from texvol.window import editing
from texvol.window.color_maps import color_at
from texvol.window.editing import Curve, Point
from texvol.window.layers import Layers
from texvol.window.lineage import lineage_of, palette_of, remembered
from texvol.window.navigation import triple

Shape = tuple[tuple[float, float], ...]  # fraction of the range, and fraction of the greatest extinction

SHAPES: dict[str, tuple[Shape, str]] = {
    "ramp": (((0.0, 0.0), (1.0, 1.0)), "rises evenly from nothing at the low end to the most at the high end"),
    "curve": (
        ((0.0, 0.0), (0.25, 0.0625), (0.5, 0.25), (0.75, 0.5625), (1.0, 1.0)),
        "rises with the square: low values stay thin",
    ),
    "falling ramp": (((0.0, 1.0), (1.0, 0.0)), "falls evenly: low values are dense, high values clear"),
    "peak": (((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)), "shows the values about the middle of the range"),
    "plateau": (((0.0, 0.0), (0.2, 1.0), (0.8, 1.0), (1.0, 0.0)), "shows the values of the range alike"),
    "step": (((0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0)), "shows nothing below the middle, all above it alike"),
    "two sides": (
        ((0.0, 1.0), (0.4, 0.0), (0.6, 0.0), (1.0, 1.0)),
        "shows both ends and leaves the middle clear, for data with two signs",
    ),
    "even": (((0.0, 1.0), (1.0, 1.0)), "shows all values alike"),
}
_THIN = 0.5  # opacity over the plot's length, where a transfer function has none


def shaped(medium: TransferFunction, name: str, length: float) -> TransferFunction:
    """Return a transfer function with one of `SHAPES` between its ends, as dense at most as it was.

    Parameters
    ----------
    length : float
        Length, world units, over which a transfer function without extinction gets an opacity of a half at most.
    """
    ends = adjusting.ends(medium)
    if not ends[1] > ends[0]:
        wide = max(abs(ends[0]), 1.0) / 100
        ends = ends[0] - wide, ends[1] + wide
    shape, _ = SHAPES[name]
    finite = medium.extinctions[np.isfinite(medium.extinctions)]
    most = float(finite.max()) if finite.size else 0.0
    most = most if most > 0 else editing.extinction_of(_THIN, length)
    rows = [(ends[0] * (1 - at) + ends[1] * at, most * fraction) for at, fraction in shape]
    return with_opacities(medium, rows)


def with_opacities(medium: TransferFunction, rows: Sequence[tuple[float, float]]) -> TransferFunction:
    """Return a transfer function with the extinctions of rows (value, extinction), and with its colours as they are.

    A medium that emits emits in its hues, as strongly as its extinction is large.
    """
    palette = palette_of(medium)
    before = replace(lineage_of(medium), changed=True, base=None, factor=1.0)
    colors = [triple(color_at(palette, value)) for value, _ in rows]
    curve = Curve(tuple(Point(value, color, most) for (value, most), color in zip(rows, colors, strict=True)))
    if medium.emissive:
        curve = _glowing(medium, curve)
        return remembered(curve.applied(medium), replace(before, layers=Layers(curve)))
    layers = Layers(curve).with_palette(palette)
    return remembered(layers.applied(medium), replace(before, layers=layers))


def _glowing(medium: TransferFunction, curve: Curve) -> Curve:
    """Return the curve with the emission of each point: most where its extinction is most."""
    strongest = float(medium.colors.max())
    finite = [point.extinction for point in curve.points if np.isfinite(point.extinction)]
    most = max(finite, default=0.0) or 1.0
    points = []
    for point in curve.points:
        hue = np.array(point.color) / max(point.color) if max(point.color) > 0 else np.ones(3)
        fraction = min(point.extinction / most, 1.0)
        points.append(replace(point, color=triple(strongest * fraction * hue)))
    return Curve(tuple(points))
