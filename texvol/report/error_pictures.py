"""Where the errors are: false-colour pictures of the best settings and a bad one, on one scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.report import words
from texvol.report.convergence import OURS, Measurement, discretisation_max, fastest_within, most_accurate
from texvol.report.measuring import Findings
from texvol.report.pictures import data_url, decades, false_color, scale_bar
from texvol.util.shown_text import escaped


def error_section(findings: Findings) -> str:
    """The section's HTML; empty if no error was measured."""
    chosen = chosen_settings(findings)
    if not chosen:
        return ""
    model = findings.model_error_map
    maps = [findings.error_maps[each.setting] for _, each in chosen] + ([] if model is None else [model])
    scale = decades(max(float(np.max(each[np.isfinite(each)], initial=0)) for each in maps))
    figures = [
        _figure(findings.error_maps[each.setting], scale, role, each.setting.words, _errors_in_words(each))
        for role, each in chosen
    ]
    difference = findings.truths.model_error
    if model is not None and difference is not None:
        size = f"maximum {words.max_of(difference)}, rms {words.rms_of(difference)}"
        figures.append(_figure(model, scale, "Model error", "the two exact integrals, slab's from post's", size))
    low, high = scale
    ticks = "".join(f"<span>10<sup>{each}</sup></span>".replace("-", "−") for each in range(low, high + 1))
    return f"""<h2>Where the errors are</h2>
<p>The largest channel's error of each pixel, against the exact integral of the setting's own classification, and last
the model error. All are on one logarithmic scale:</p>
<div class="scale"><img src="{data_url(scale_bar())}" alt="Colours from small to large errors">
<div class="ticks">{ticks}</div></div>
<div class="maps">{"".join(figures)}</div>"""


def chosen_settings(findings: Findings) -> list[tuple[str, Measurement]]:
    """What each picture is for, and its setting: best first, then VTK's best, then the worst."""
    ours, error = findings.ours, discretisation_max
    chosen = [("Most accurate", most_accurate(ours, error))]
    chosen += [
        (f"Fastest within {limit:g} of its own integral", fastest_within(ours, error, limit))
        for limit in reversed(words.LIMITS)
    ]
    chosen += [("Default", next((each for each in ours if _is_default(findings, each)), None))]
    theirs = [each for each in findings.measurements if each.setting.renderer != OURS]
    chosen += [("VTK's most accurate", most_accurate(theirs, error))]
    chosen += [("Worst", max((each for each in ours if error(each) is not None), key=_error_or_zero, default=None))]
    merged: dict[Measurement, str] = {}
    for role, each in chosen:
        if each is not None and each.setting in findings.error_maps:
            merged[each] = f"{merged[each]}, {role[0].lower()}{role[1:]}" if each in merged else role
    return [(role, each) for each, role in merged.items()]


def _is_default(findings: Findings, each: Measurement) -> bool:
    setting = each.setting
    is_plain = setting.sampling_rate == 1 and not setting.formats
    return is_plain and setting.classification == findings.scene.classification


def _error_or_zero(each: Measurement) -> float:
    return discretisation_max(each) or 0.0


def _errors_in_words(each: Measurement) -> str:
    error = each.discretisation
    return f"maximum {words.max_of(error)}, rms {words.rms_of(error)}, {words.seconds(each.seconds)} a frame"


def _figure(errors: NDArray, scale: tuple[int, int], role: str, what: str, size: str) -> str:
    picture = data_url(false_color(errors, scale))
    return (
        f'<figure><img src="{picture}" alt="Errors of {escaped(what)}"><figcaption><strong>{escaped(role)}</strong><br>'
        f"{escaped(what)}<br>{escaped(size)}</figcaption></figure>"
    )
