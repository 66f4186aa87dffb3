"""Tables of the measurements: CSV, and Markdown for a README."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from texvol.comparison import Difference
from texvol.report.convergence import OURS, PRECLASSIFIED, Measurement, Setting, pareto_front, total_max, total_rms
from texvol.report.measuring import Findings
from texvol.report.words import LIMITS, recommendation, rms_of, seconds
from texvol.scene.volume import Volume
from texvol.util.shown_text import markdown


def csv_text(findings: Findings) -> str:
    """Return a line for each measurement; unknown numbers are empty. Lengths in world units, times in seconds."""
    on_max, on_rms = fronts(findings)
    text = io.StringIO()
    rows = []
    for each in findings.measurements:
        model = findings.truths.model_error if each.setting.classification in PRECLASSIFIED else None
        fronted = {"on_max_front": int(each.setting in on_max), "on_rms_front": int(each.setting in on_rms)}
        rows.append(_row(each, model) | fronted | {"skipped": each.skipped})
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def fronts(findings: Findings) -> tuple[set[Setting], set[Setting]]:
    """Return the settings on the Pareto fronts of maximum and of rms error, over all renderers."""
    return (
        {each.setting for each in pareto_front(findings.measurements, total_max)},
        {each.setting for each in pareto_front(findings.measurements, total_rms)},
    )


def markdown_text(findings: Findings) -> str:
    """Return two Markdown tables: the settings with automatic formats, and recommended settings for each error."""
    model = findings.truths.model_error
    plain = [each for each in findings.measurements if not each.setting.formats]
    rates = sorted({each.setting.sampling_rate for each in plain})
    names = list(dict.fromkeys(each.setting.name for each in plain))
    cells = {(each.setting.name, each.setting.sampling_rate): _cell(each) for each in plain}
    lines = [
        f"{', '.join(map(_samples, findings.scene.volumes))}, "
        f"{'×'.join(map(str, findings.size))} pixels; {markdown(findings.fingerprint['GL_RENDERER'])}, "
        f"{markdown(findings.fingerprint['processor'])}. Time of a warm frame, rms discretisation error, and rms total "
        f"error where that is another; the model error of `slab` and `extinction` is {rms_of(model)}.",
        "",
        "| slabs per voxel | " + " | ".join(f"{rate:g}" for rate in rates) + " |",
        "|---" * (len(rates) + 1) + "|",
    ]
    for name in names:
        lines.append(f"| {markdown(name)} | " + " | ".join(cells.get((name, rate), "–") for rate in rates) + " |")
    lines += ["", "| error | fastest for the maximum error | fastest for the rms error |", "|---|---|---|"]
    for limit in LIMITS:
        chosen = (recommendation(findings.ours, error_of, limit, findings.asked) for error_of in (total_max, total_rms))
        lines.append(f"| {limit:g} | " + " | ".join(map(markdown, chosen)) + " |")
    return "\n".join(lines) + "\n"


def _samples(volume: Volume) -> str:
    return f"{markdown(Path(volume.name).name)}, {'×'.join(map(str, volume.dimensions))} {volume.dtype}"


def _cell(each: Measurement) -> str:
    if each.skipped:
        return "–"
    numbers = [seconds(each.seconds), rms_of(each.discretisation)]
    if each.total != each.discretisation:
        numbers.append(rms_of(each.total))
    return " · ".join(numbers)


def _row(each: Measurement, model: Difference | None) -> dict[str, Any]:
    setting = each.setting
    row: dict[str, Any] = {
        "renderer": setting.renderer,
        "classification": setting.classification,
        "texture_refinement": setting.texture_refinement if setting.renderer == OURS else "",
        "slicing": setting.slicing if setting.renderer == OURS else "",
        "sampling_rate": setting.sampling_rate,
        "slab_thickness": each.slab_thickness,
        "slabs": each.slabs,
        "texture_format": each.texture_format or setting.texture_format,
        "target_format": each.target_format or setting.target_format,
        "frames": each.frames or None,
        "seconds": each.seconds,
        "bake_seconds": each.bake_seconds,
        "upload_seconds": each.upload_seconds,
    }
    for name, difference in (("discretisation", each.discretisation), ("total", each.total), ("model", model)):
        row |= {f"{name}_{error}": difference and getattr(difference, error) for error in ("max_error", "rms_error")}
    estimates = {"estimated_error": each.estimated_error, "estimated_model_error": each.estimated_model_error}
    return row | estimates
