"""Plot of the methods: time of a picture against its rms error, log-log, every mark with its name."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from texvol.report.labels import place_labels
from texvol.report.plot import THEMES, style
from texvol.report.survey.measuring import OWN, MethodMeasurement, Survey
from texvol.report.words import seconds

# Colour and mark of each kind; colours for all kinds of colour vision, on white and on black (Okabe, Ito 2008).
_LOOKS = {
    "texvol's slices": ("#e69f00", "s"),
    "classified before interpolation": ("#009e73", "o"),
    "classified after interpolation": ("#56a0e4", "^"),
    "projection of the value, of its maximum": ("#b978c2", "D"),
}
_KINDS = dict(zip(("before", "after", "projection"), list(_LOOKS)[1:], strict=True))
_INCHES, _DPI = (11.0, 11.0), 110
_LEAST_ERROR = 1e-12  # smaller ones are rounding, and drawn as this


def methods_plot(found: Survey, theme: str) -> bytes:
    """PNG file of both panels in the colours of a light or a dark page."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    colors = THEMES[theme]
    with matplotlib.rc_context(style(colors)):
        figure = Figure(figsize=_INCHES, dpi=_DPI, layout="constrained")
        FigureCanvasAgg(figure)
        above, below = figure.subplots(2, 1)
        panels = ((above, _own_error), (below, _total_error))
        for panel, error_of in panels:
            _draw(panel, found, error_of)
        above.set_title("Rms error from the exact integral of the method's own medium")
        below.set_title("Rms error from the exact post-classified integral")
        handles, names = above.get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper left", ncols=4, frameon=False, fontsize=10)
        figure.draw_without_rendering()  # fixes the layout; labels are placed in pixels
        figure.set_layout_engine("none")
        for panel, error_of in panels:
            marks = list(_marks(found, error_of))
            points = np.array([mark[2:] for mark in marks], float).reshape(-1, 2)
            inks = [_LOOKS[kind][0] for kind, *_ in marks]
            place_labels(figure, panel, points, [mark[1] for mark in marks], inks, colors["paper"])
        file = io.BytesIO()
        figure.savefig(file, format="png")
    return file.getvalue()


def _own_error(each: MethodMeasurement) -> float | None:
    return None if each.own is None else each.own.rms_error


def _total_error(each: MethodMeasurement) -> float | None:
    return None if each.after is None else each.after.rms_error


def _marks(
    found: Survey, error_of: Callable[[MethodMeasurement], float | None]
) -> Iterator[tuple[str, str, float, float]]:
    """Yield kind, name, time and error of what logarithmic axes can show."""
    for each in found.measurements:
        size = error_of(each)
        if each.draw_seconds and size is not None and np.isfinite(size):
            kind = next(iter(_LOOKS)) if each.name in OWN else _KINDS[each.order]
            yield kind, each.name.removeprefix("texvol "), each.draw_seconds, max(size, _LEAST_ERROR)


def _draw(panel: Any, found: Survey, error_of: Callable[[MethodMeasurement], float | None]) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    panel.set(xscale="log", yscale="log", xlabel="time of a picture", ylabel="rms error")
    panel.margins(0.08, 0.1)
    panel.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda time, _: seconds(time)))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(True, which="minor", linewidth=0.3)
    marks = list(_marks(found, error_of))
    if not marks:
        panel.set(xlim=(1e-3, 1), ylim=(1e-7, 1))
        panel.text(0.5, 0.5, "no method was drawn", ha="center", transform=panel.transAxes)
    for kind, (color, shape) in _LOOKS.items():
        points = [(time, size) for each, _, time, size in marks if each == kind]
        if points:
            panel.plot(*zip(*points, strict=True), shape, color=color, markersize=7, label=kind)
