"""Chart of time against error, a panel for each scene and a curve for each program, as a small picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image

# Colour and marker of each program: colours of Wong (2011), which people who see few colours tell apart.
STYLES = {
    "texvol": ("#000000", "o"),
    "numba marcher": ("#e69f00", "s"),
    "VTK GPU": ("#0072b2", "^"),
    "VTK fixed-point": ("#56b4e9", "v"),
    "pyvista": ("#009e73", "D"),
    "vispy": ("#d55e00", "P"),
    "yt": ("#cc79a7", "X"),
    "Mitsuba 3": ("#7f7f7f", "*"),
}
_OTHER = ("#b8a000", "h")
_MILLISECONDS = 1e3
_COLUMNS, _PANEL_INCHES = 2, (4.6, 3.3)


@dataclass(frozen=True)
class Curve:
    """Errors of a program, and the processor seconds of a frame with each."""

    name: str
    errors: Sequence[float]
    seconds: Sequence[float]


def draw_chart(scenes: Mapping[str, Sequence[Curve]], target: Path) -> None:
    """Write the chart as a PNG of few colours."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    columns = min(_COLUMNS, len(scenes))
    rows = -(-len(scenes) // columns)
    width, height = _PANEL_INCHES
    figure, panels = plt.subplots(rows, columns, figsize=(width * columns, height * rows + 0.6), dpi=110, squeeze=False)
    for panel, (name, curves) in zip(panels.flat, scenes.items(), strict=False):
        _draw_panel(panel, name, curves)
    for panel in panels.flat[len(scenes) :]:
        panel.set_axis_off()
    _legend(figure, columns=2 * columns)
    figure.savefig(target, facecolor="white")
    plt.close(figure)
    Image.open(target).convert("P", palette=Image.Palette.ADAPTIVE, colors=64).save(target, optimize=True)


def _draw_panel(panel: Any, name: str, curves: Sequence[Curve]) -> None:
    for curve in curves:
        color, marker = STYLES.get(curve.name, _OTHER)
        milliseconds = [_MILLISECONDS * each for each in curve.seconds]
        size = 2.2 if curve.name == "texvol" else 1.3
        panel.loglog(
            curve.errors, milliseconds, color=color, marker=marker, markersize=6, linewidth=size, label=curve.name
        )
    panel.invert_xaxis()
    panel.set_title(name, fontsize=10)
    panel.set_xlabel("rms error (smaller to the right)", fontsize=9)
    panel.set_ylabel("processor time of a frame, ms", fontsize=9)
    panel.tick_params(labelsize=9)
    panel.grid(which="major", color="#cccccc", linewidth=0.7)


def _legend(figure: Any, columns: int) -> None:
    handles: dict[str, Any] = {}
    for panel in figure.axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    order = [name for name in STYLES if name in handles] + [name for name in handles if name not in STYLES]
    figure.legend(
        [handles[name] for name in order], order, loc="upper center", ncols=columns, fontsize=9, frameon=False
    )
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.22 * -(-len(order) // columns) / figure.get_figheight()))
