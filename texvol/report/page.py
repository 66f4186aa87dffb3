"""HTML page of a report; pictures and plots are inside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from texvol.comparison.templates import rendered
from texvol.formats.pictures.page_pictures import data_url, png
from texvol.report import words
from texvol.report.convergence import discretisation_max, total_max, total_rms
from texvol.report.error_pictures import error_pictures
from texvol.report.measuring import Findings
from texvol.report.orders import slab_orders
from texvol.report.plot import THEMES
from texvol.report.survey.measuring import OWN
from texvol.report.survey.plot import methods_plot
from texvol.report.survey.table import cells, groups
from texvol.report.table import fronts
from texvol.scene.scene import CompleteScene, Scene
from texvol.util.version import __version__

Plots = Mapping[str, Mapping[str, bytes]]  # metric → theme → PNG file
_FILTERS: dict[str, Callable[[Any], Any]] = {
    "cells": cells,
    "seconds": words.seconds,
    "error": words.error,
    "max_of": words.max_of,
    "rms_of": words.rms_of,
}
_CAPTIONS = {
    "max": "The largest error of any pixel and channel. Each mark is a setting, labelled with its rate and, if "
    "they are not automatic, its texel format and → target format.",
    "rms": "The same for the root mean square error.",
}


def html(findings: Findings, plots: Plots) -> str:
    """Return the page's HTML."""
    scene = findings.scene
    on_max, on_rms = fronts(findings)
    columns = (total_max, total_rms, discretisation_max)  # of the table of recommendations
    order = list(dict.fromkeys(each.setting.name for each in findings.measurements))
    rows = sorted(findings.measurements, key=lambda each: order.index(each.setting.name))  # stable: coarse to fine
    return rendered(
        "report.html",
        "texvol.report",
        filters=_FILTERS,
        findings=findings,
        title=f"Speed against error: {', '.join(Path(volume.name).name for volume in scene.volumes)}",
        version=__version__,
        picture=data_url(png(findings.picture)),
        size="{} × {}".format(*findings.size),
        spacing=scene.smallest_spacing,
        answer=_answer(findings),
        metadata=_metadata(findings),
        recommendations=[
            (limit, [words.recommendation(findings.ours, each, limit, findings.asked) for each in columns])
            for limit in words.LIMITS
        ],
        plots={metric: {theme: data_url(plot) for theme, plot in each.items()} for metric, each in plots.items()},
        captions=_CAPTIONS,
        orders=_order_rows(findings),
        errors=error_pictures(findings),
        **_methods(findings),
        measurements=[(each, each.setting in on_max | on_rms) for each in rows],
    )


def _methods(findings: Findings) -> dict[str, Any]:
    """Return table and plots of the survey's methods, for the page."""
    found = findings.survey
    if found is None:
        return {"table": None, "own": OWN, "method_plots": None}
    plots = {theme: data_url(methods_plot(found, theme)) for theme in THEMES}
    return {"table": groups(found), "own": OWN, "method_plots": plots}


def _answer(findings: Findings) -> str:
    if not findings.has_errors:
        return "No error could be measured, so no setting can be recommended."
    what = "the error of every pixel, all causes together,"
    said = words.sentence(findings.ours, total_max, what, findings.asked)
    return f"{said} {words.of_discretisation(findings.ours, total_max, findings.asked)}".strip()


def _metadata(findings: Findings) -> list[tuple[str, str]]:
    metadata = scene_metadata(findings.scene.completed(findings.size), findings.size)
    model = findings.truths.model_error
    if model is not None:
        error = f"maximum {words.max_of(model)}, rms {words.rms_of(model)}"
        metadata.append(("model error of slab and extinction", error))
    return metadata


def scene_metadata(scene: CompleteScene, size: tuple[int, int]) -> list[tuple[str, str]]:
    """Return names and texts of what a scene shows, and how it is seen."""
    volume, camera = scene.volume, scene.camera
    unit = volume.unit or "world units"
    view = f"{camera.fov:g}° from bottom to top"
    if camera.projection != "perspective":
        view = f"{camera.height:.5g} {unit} high"
    return [
        *(fact for each in scene.each_alone() for fact in _volume_metadata(each)),
        ("camera", f"{camera.projection}, {view}, eye {_triple(camera.eye)}, target {_triple(camera.target)}"),
        ("picture", "{} × {} pixels".format(*size)),
    ]


def _volume_metadata(scene: Scene) -> list[tuple[str, str]]:
    """Names and texts of one volume's properties."""
    volume, transfer_function = scene.volume, scene.transfer_function
    assert transfer_function is not None
    low, high = volume.finite_range or (float("nan"),) * 2
    kind = "labels" if volume.labels else "values" if volume.colors is None else "amounts of colour"
    metadata = [
        ("file", volume.name),
        ("volume", f"{' × '.join(map(str, volume.dimensions))} samples of {volume.dtype}"),
        ("spacing", f"{' × '.join(f'{each:.5g}' for each in volume.spacing)} {volume.unit or 'world units'}"),
        (kind, f"{low:.6g} to {high:.6g}"),
        ("transfer function", f"{transfer_function.name}, {len(transfer_function.values)} points"),
    ]
    return metadata + ([("mask", scene.mask.name)] if scene.mask is not None else [])


def _order_rows(findings: Findings) -> list[tuple[str, str, str]]:
    """Refined step, expected and measured order of convergence."""
    rows = [
        (f"slab thickness, {name}", expected, "–" if order is None else f"{order:.2f}")
        for (name, order), expected in zip(slab_orders(findings.ours).items(), ("1 to 2", "2", "2", "2"), strict=True)
    ]
    if findings.grid_change is not None and findings.grid_order is not None:
        rows.append(("grid of a trilinear field", "0", f"no change (at most {findings.grid_change:.0e})"))
        rows.append(("grid of a smooth field", "2", f"{findings.grid_order:.2f}"))
    return rows


def _triple(numbers: tuple[float, float, float]) -> str:
    return ", ".join(f"{each:.4g}" for each in numbers)
