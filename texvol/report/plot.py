"""Plots of time against error, log-log: total error above, discretisation error below, every mark labelled."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from texvol.report.convergence import (
    ErrorOf,
    Measurement,
    discretisation_max,
    discretisation_rms,
    pareto_front,
    total_max,
    total_rms,
)
from texvol.report.labels import place_labels
from texvol.report.measuring import Findings
from texvol.report.words import seconds

METRICS: dict[str, tuple[str, ErrorOf, ErrorOf]] = {
    "max": ("maximum", total_max, discretisation_max),
    "rms": ("rms", total_rms, discretisation_rms),
}
THEMES = {
    "light": {"paper": "#ffffff", "ink": "#1b1f24", "faint": "#d5d9de", "front": "#9aa3ad"},
    "dark": {"paper": "#14171b", "ink": "#e3e6ea", "faint": "#33393f", "front": "#6f7882"},
}
# Colour and mark of each name; colours for all kinds of colour vision, on white and on black (Okabe, Ito 2008).
_LOOKS = {
    "slab": ("#e69f00", "s"),
    "slab refined": ("#e6550d", "v"),
    "slab by polygons": ("#c9b458", "p"),
    "slab by Wilson": ("#a6761d", "h"),
    "extinction": ("#009e73", "o"),
    "post": ("#56a0e4", "^"),
    "integrated": ("#d5553a", "D"),
    "VTK GPU": ("#b978c2", "P"),
    "VTK fixed-point": ("#8a8f98", "X"),
}
_INCHES = (11.0, 14.0)
_DPI = 110


def pareto_plot(findings: Findings, metric: str, theme: str) -> bytes:
    """PNG file of both panels for "max" or "rms" error, in the colours of a light or a dark page."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    word, total, discretisation = METRICS[metric]
    colors = THEMES[theme]
    with matplotlib.rc_context(style(colors)):
        figure = Figure(figsize=_INCHES, dpi=_DPI, layout="constrained")
        FigureCanvasAgg(figure)
        above, below = figure.subplots(2, 1)
        panels = ((above, total), (below, discretisation))
        for panel, error_of in panels:
            _draw_panel(panel, findings.measurements, error_of, colors["front"])
            panel.set(xlabel="time of a warm frame", ylabel=f"{word} error")
        above.set_title(f"Total {word} error: against the exact post-classified integral")
        below.set_title(
            f"Discretisation alone: {word} error against the exact integral of the setting's own classification"
        )
        _draw_model_error(above, findings, metric, colors["ink"])
        _add_legend(figure, above, colors["ink"])
        figure.draw_without_rendering()  # fixes the layout; labels are placed in pixels
        figure.set_layout_engine("none")
        for panel, error_of in panels:
            _label(figure, panel, findings.measurements, error_of, colors["paper"])
        file = io.BytesIO()
        figure.savefig(file, format="png")
    return file.getvalue()


def style(colors: dict[str, str]) -> dict[Any, Any]:
    """Return matplotlib's settings for a theme."""
    inked = ("text.color", "axes.labelcolor", "axes.titlecolor", "xtick.color", "ytick.color")
    faint = ("axes.edgecolor", "grid.color")
    return {
        **{"figure.facecolor": colors["paper"], "axes.facecolor": colors["paper"]},
        **dict.fromkeys(inked, colors["ink"]) | dict.fromkeys(faint, colors["faint"]),
        **{"axes.grid": True, "axes.axisbelow": True, "axes.titlelocation": "left", "axes.titlesize": 12},
    }


def _draw_panel(panel: Any, measurements: list[Measurement], error_of: ErrorOf, front_color: str) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    panel.set(xscale="log", yscale="log")
    if not any(any(_shown(measurements, name, error_of)) for name in _LOOKS):
        panel.set(xlim=(1e-3, 1), ylim=(1e-7, 1))
        panel.text(0.5, 0.5, "no setting has an error", ha="center", transform=panel.transAxes)
    panel.margins(0.06, 0.08)
    # Times are 50 ms, 100 ms, 200 ms … instead of powers of ten.
    panel.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda time, _: seconds(time)))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(True, which="minor", linewidth=0.3)
    front = [(each.seconds, error_of(each)) for each in pareto_front(measurements, error_of) if error_of(each)]
    if front:
        times, errors = zip(*front, strict=True)
        panel.step(times, errors, where="post", color=front_color, linewidth=5, alpha=0.35, label="Pareto front")
    for name, (color, mark) in _LOOKS.items():
        shown = list(_shown(measurements, name, error_of))
        plain = [(each.seconds, error) for each, error in shown if not each.setting.formats]
        formats = [(each.seconds, error) for each, error in shown if each.setting.formats]
        if plain:
            panel.plot(*zip(*plain, strict=True), color=color, marker=mark, markersize=7, linewidth=1.3, label=name)
        if formats:
            panel.plot(*zip(*formats, strict=True), mark, color=color, markersize=7, markerfacecolor="none")


def _draw_model_error(panel: Any, findings: Findings, metric: str, ink: str) -> None:
    """Draw a line at the model error, which slab and extinction keep however thin the slabs."""
    model = findings.truths.model_error
    size = None if model is None else model.max_error if metric == "max" else model.rms_error
    if size:
        label = f"model error of slab and extinction, {size:.1e}"
        panel.axhline(size, color=ink, linewidth=1.2, linestyle=(0, (6, 4)), label=label)


def _add_legend(figure: Any, panel: Any, ink: str) -> None:
    from matplotlib.lines import Line2D

    handles, names = panel.get_legend_handles_labels()
    handles.append(Line2D([], [], marker="o", color=ink, markerfacecolor="none", linestyle="none"))
    names.append("hollow: other than the automatic formats")
    figure.legend(handles, names, loc="outside upper left", ncols=4, frameon=False, fontsize=10)


def _label(figure: Any, panel: Any, measurements: list[Measurement], error_of: ErrorOf, paper: str) -> None:
    """Write the rate beside each mark, and the formats if they are not the default."""
    points, texts, inks = [], [], []
    for name, (color, _) in _LOOKS.items():
        for each, error in _shown(measurements, name, error_of):
            points.append((each.seconds, error))
            texts.append(_short(each))
            inks.append(color)
    place_labels(figure, panel, np.array(points, float).reshape(-1, 2), texts, inks, paper)


def _short(measurement: Measurement) -> str:
    setting = measurement.setting
    texels = "" if setting.texture_format == "auto" else f" {setting.texture_format}"
    target = "" if setting.target_format == "auto" else f" → {setting.target_format}"
    return setting.rate + texels + target


def _shown(measurements: Iterable[Measurement], name: str, error_of: ErrorOf) -> Iterable[tuple[Measurement, float]]:
    """Yield the measurements of one name that logarithmic axes can show."""
    for each in measurements:
        error = error_of(each)
        if each.setting.name == name and each.seconds and error and np.isfinite(error):
            yield each, error
