"""HTML page of the methods; pictures and plots are inside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from texvol.comparison.templates import rendered
from texvol.formats.pictures.page_pictures import data_url, png
from texvol.report.error_pictures import decades, false_color, scale_bar
from texvol.report.page import scene_metadata
from texvol.report.survey.measuring import OWN, Survey
from texvol.report.survey.table import answer, cells, groups
from texvol.report.words import max_of, rms_of, seconds
from texvol.util.version import __version__

FILTERS: dict[str, Callable[[Any], Any]] = {"cells": cells, "seconds": seconds}


def html(found: Survey, plots: Mapping[str, bytes], fingerprint: Mapping[str, str], command: str) -> str:
    """Return the page's HTML."""
    return rendered(
        "methods.html",
        "texvol.report",
        filters=FILTERS,
        title=f"Methods of volume rendering: {found.scene.volume.name.rpartition('/')[2]}",
        version=__version__,
        answer=answer(found),
        metadata=_metadata(found),
        table=groups(found),
        own=OWN,
        plots={theme: data_url(plot) for theme, plot in plots.items()},
        pictures=pictures(found),
        taken=found.seconds,
        oracles=found.truths.seconds,
        command=command,
        fingerprint=fingerprint,
    )


def _metadata(found: Survey) -> list[tuple[str, str]]:
    metadata = scene_metadata(found.scene, found.size)
    model = found.truths.model_error
    if model is not None:
        size = f"maximum {max_of(model)}, rms {rms_of(model)}"
        metadata.append(("distance of the two oracles", size))
    return metadata


def pictures(found: Survey) -> dict[str, Any] | None:
    """Return picture and error picture of each method, and the scale; None if nothing was drawn."""
    drawn = [each for each in found.outcomes if each.picture is not None and each.errors is not None]
    if not drawn:
        return None
    scale = decades(max(float(np.max(each.errors, initial=0)) for each in drawn if each.errors is not None))
    entries = [
        {
            "name": each.measurement.name,
            "size": f"maximum {max_of(each.measurement.own)}, rms {rms_of(each.measurement.own)}",
            "time": seconds(each.measurement.draw_seconds),
            "picture": data_url(png(each.picture)) if each.picture is not None else "",
            "errors": data_url(false_color(each.errors, scale)) if each.errors is not None else "",
        }
        for each in drawn
    ]
    return {"entries": entries, "bar": data_url(scale_bar()), "powers": range(scale[0], scale[1] + 1)}
