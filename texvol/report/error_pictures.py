"""False-colour pictures of errors: those of the best settings and of a bad one, on one logarithmic scale."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures.page_pictures import colored, data_url, png
from texvol.report import words
from texvol.report.convergence import OURS, Measurement, Setting, discretisation_max, fastest_within, most_accurate
from texvol.report.measuring import Findings

_LEAST_DECADE = -5  # errors below 1e-5 are black


def error_pictures(findings: Findings) -> dict[str, Any] | None:
    """Return the pictures with their texts, the colour bar and its powers of ten; None if no error was measured."""
    chosen = chosen_settings(findings)
    if not chosen:
        return None
    model = findings.model_error_map
    maps = [findings.error_maps[each.setting] for _, each in chosen] + ([] if model is None else [model])
    scale = decades(max(float(np.max(each[np.isfinite(each)], initial=0)) for each in maps))
    texts = [{"role": role, "name": each.setting.words, "size": _errors_in_words(each)} for role, each in chosen]
    difference = findings.truths.model_error
    if model is not None and difference is not None:
        size = f"maximum {words.max_of(difference)}, rms {words.rms_of(difference)}"
        texts.append({"role": "Model error", "name": "the two exact integrals, slab's from post's", "size": size})
    pictures = [
        each | {"address": data_url(false_color(errors, scale))} for each, errors in zip(texts, maps, strict=True)
    ]
    return {"pictures": pictures, "bar": data_url(scale_bar()), "powers": range(scale[0], scale[1] + 1)}


def chosen_settings(findings: Findings) -> list[tuple[str, Measurement]]:
    """Return role and setting of each picture: texvol's best first, then VTK's best, then the worst."""
    ours, error = findings.ours, discretisation_max
    default = Setting(findings.scene.classification, 1.0)
    theirs = [each for each in findings.measurements if each.setting.renderer != OURS]
    measured = (each for each in ours if error(each) is not None)
    chosen = [
        ("Most accurate", most_accurate(ours, error)),
        *(
            (f"Fastest within {limit:g} of its own integral", fastest_within(ours, error, limit))
            for limit in reversed(words.LIMITS)
        ),
        ("Default", next((each for each in ours if each.setting == default), None)),
        ("VTK's most accurate", most_accurate(theirs, error)),
        ("Worst", max(measured, key=lambda each: error(each) or 0.0, default=None)),
    ]
    merged: dict[Measurement, str] = {}
    for role, each in chosen:
        if each is not None and each.setting in findings.error_maps:
            merged[each] = f"{merged[each]}, {role[0].lower()}{role[1:]}" if each in merged else role
    return [(role, each) for each, role in merged.items()]


def _errors_in_words(each: Measurement) -> str:
    error = each.discretisation
    return f"maximum {words.max_of(error)}, rms {words.rms_of(error)}, {words.seconds(each.seconds)} a frame"


def decades(largest: float) -> tuple[int, int]:
    """Powers of ten at the ends of the colour scale, for errors up to `largest`."""
    top = int(np.ceil(np.log10(largest))) if np.isfinite(largest) and largest > 0 else 0
    return _LEAST_DECADE, int(np.clip(top, _LEAST_DECADE + 2, 1))


def false_color(errors: NDArray, scale: tuple[int, int]) -> bytes:
    """PNG file of an error map (height, width), coloured by the logarithm of the error."""
    low, high = scale
    with np.errstate(divide="ignore"):
        fractions = (np.log10(errors) - low) / (high - low)
    return png(colored(np.clip(np.nan_to_num(fractions, nan=1.0, posinf=1.0, neginf=0.0), 0, 1)))


def scale_bar() -> bytes:
    """PNG file of the colours, least to largest error from left to right."""
    return png(colored(np.linspace(0, 1, 512)[np.newaxis].repeat(16, axis=0)))
