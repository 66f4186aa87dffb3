"""Labels beside the marks of a plot, placed so that they do not cover each other."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FONT_SIZE = 8
_MARK = 6.0  # half of a mark's edge, pixels
_DISTANCES = (9.0, 16.0, 25.0, 36.0, 50.0, 66.0)  # pixels from the mark to the label's edge
_ANGLES = np.radians((0, 45, -45, 90, -90, 180, 135, -135, 22, -22, 67, -67, 112, -112, 157, -157))
_LINE_STEP = 4.0  # pixels
_LEADER = 14.0  # pixels; a label farther away has a line to its mark


def place_labels(
    figure: Any, panel: Any, points: NDArray[np.float64], texts: list[str], colors: list[str], paper: str
) -> None:
    """Write `texts` beside `points` (data coordinates), each where it covers least.

    `paper` is the background's colour, in which each label has a thin rim.
    """
    if not len(points):
        return
    from matplotlib.patheffects import withStroke

    positions = panel.transData.transform(points)
    canvas = figure.canvas.get_renderer()
    taken = [np.array([x - _MARK, y - _MARK, x + _MARK, y + _MARK]) for x, y in positions]
    taken += [np.array([x - 1, y - 1, x + 1, y + 1]) for x, y in _along_lines(panel)]
    frame = panel.get_window_extent(canvas)
    inside = np.array([frame.x0, frame.y0, frame.x1, frame.y1])
    for position, text, color in zip(positions, texts, colors, strict=True):
        label = panel.text(0, 0, text, fontsize=_FONT_SIZE, color=color, ha="center", va="center", transform=None)
        extent = label.get_window_extent(canvas)
        half = np.array([extent.width, extent.height]) / 2
        centre, distance = _best_position(position, half, np.array(taken), inside)
        label.set_position(centre)
        label.set_path_effects([withStroke(linewidth=2.5, foreground=paper)])
        taken.append(np.concatenate([centre - half, centre + half]))
        if distance > _LEADER:
            _draw_leader(panel, position, centre, half, color)


def _best_position(
    position: NDArray[np.float64], half: NDArray[np.float64], taken: NDArray[np.float64], inside: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return the label's centre and distance from the mark: the nearest free position, or the one that covers least."""
    best, least = (position, 0.0), np.inf
    for distance in _DISTANCES:
        for angle in _ANGLES:
            direction = np.array([np.cos(angle), np.sin(angle)])
            centre = position + direction * (half + distance)
            box = np.concatenate([centre - half, centre + half])
            covered = _overlap(box, taken)
            outside = np.maximum(inside[:2] - box[:2], 0).sum() + np.maximum(box[2:] - inside[2:], 0).sum()
            cost = covered + 100 * outside
            if cost == 0:
                return centre, distance
            if cost < least:
                best, least = (centre, distance), cost
    return best


def _along_lines(panel: Any) -> NDArray[np.float64]:
    """Positions on the panel's lines, in pixels, a few pixels apart."""
    positions = [np.empty((0, 2))]
    for line in panel.get_lines():
        if line.get_linestyle() == "None":
            continue
        ends = line.get_transform().transform(np.column_stack(line.get_data()).astype(float))
        for start, end in pairwise(ends):
            count = int(np.hypot(*(end - start)) / _LINE_STEP) + 1
            positions.append(start + np.linspace(0, 1, count)[:, np.newaxis] * (end - start))
    return np.concatenate(positions)


def _overlap(box: NDArray[np.float64], others: NDArray[np.float64]) -> float:
    """Area, in pixels, that a box (x0, y0, x1, y1) shares with the others."""
    sides = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return float(np.maximum(sides, 0).prod(axis=1).sum())


def _draw_leader(panel: Any, position: NDArray, centre: NDArray, half: NDArray, color: str) -> None:
    from matplotlib.lines import Line2D

    end = np.clip(position, centre - half, centre + half)
    x, y = np.transpose([position, end])
    panel.add_line(Line2D(x, y, color=color, linewidth=0.6, alpha=0.7, transform=None))
