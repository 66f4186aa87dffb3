"""HTML page of one pair of pictures: the verdict, a viewer, the numbers."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.compared import compared_pixels, largest_finite, pixel_differences, shown_range
from texvol.comparison.entries import entry_of
from texvol.comparison.histogram import histogram
from texvol.comparison.measures import flip_map
from texvol.comparison.number_table import DIFFERENCE_ROWS, file_rows, limit_rows, worst_pixel_words
from texvol.comparison.outcome import Outcome
from texvol.comparison.pixel_data import candidate_data, level_data, reference_data
from texvol.comparison.templates import number, rendered
from texvol.formats.pictures.page_pictures import color_table

__all__ = ["comparison_page", "entry_of"]

_MOST_GAIN = 30  # powers of two; float32 pictures differ by more than 1e-9, or not at all


def comparison_page(
    outcome: Outcome, *, metadata: Mapping[str, str] = {}, index: str | None = None, flip: bool = False
) -> str:
    """Return the page's HTML.

    Parameters
    ----------
    metadata : mapping
        Driver, versions and the like that the pictures were made with.
    index : str, optional
        Address of the page that links to this one.
    flip : bool
        True to show the map of ꟻLIP, which doubles the time.
    """
    measures, limits = outcome.measures, outcome.limits
    return rendered(
        "comparison.html",
        outcome=outcome,
        measures=measures,
        metadata=metadata,
        index=index,
        lead=_lead(outcome),
        worst=worst_pixel_words(measures) if measures and measures.max_error > 0 else "",
        histogram=_histogram(outcome),
        limit_rows=limit_rows(measures, limits) if measures else (),
        difference_rows=DIFFERENCE_ROWS,
        file_rows=file_rows(outcome),
        infinity=float("inf"),
        viewer=_viewer_data(outcome, flip),
    )


def _lead(outcome: Outcome) -> str:
    measures, broken = outcome.measures, len(outcome.violations)
    if measures is None:
        return "Pictures of different sizes cannot be compared."
    if measures.max_error == 0:
        return "Every number is equal, but:" if broken else "Every number of every pixel is equal."
    most = f"Largest difference {number(measures.max_error)}, rms {number(measures.rms_error)}"
    return f"{most}; all limits are kept." if not broken else f"{most}. Broken limits and faults:"


def _histogram(outcome: Outcome) -> str:
    if outcome.measures is None:
        return ""
    candidate, reference = compared_pixels(outcome)
    return histogram(pixel_differences(candidate, reference) / outcome.measures.scale, outcome.limits.max_abs)


def _viewer_data(outcome: Outcome, flip: bool) -> dict[str, Any]:
    """Return the data of the page's script."""
    measures, limits = outcome.measures, outcome.limits
    if measures is None:
        ours, theirs = outcome.candidate.pixels, outcome.reference.pixels
        pictures = {"oneSize": False, "reference": reference_data(theirs), "candidate": reference_data(ours)}
        largest, scale = 0.0, 1.0
    else:
        ours, theirs = compared_pixels(outcome)
        data = candidate_data(ours, theirs)
        pictures = {"oneSize": True, "reference": reference_data(theirs), "candidate": data, "flip": None}
        if flip and data:
            seen = (np.nan_to_num(each / np.float32(measures.scale)) for each in (ours, theirs))
            pictures["flip"] = level_data(np.rint(255 * np.clip(flip_map(*seen), 0, 1)).astype(np.uint8))
        largest, scale = largest_finite(pixel_differences(ours, theirs)) / measures.scale, measures.scale
    top = int(np.ceil(np.log10(largest))) if largest > 0 else 0
    differs = bool(measures and measures.max_error > 0)
    return {
        "pictures": pictures,
        "colors": base64.b64encode(color_table().tobytes()).decode(),
        "decades": [top - 5, top],
        "gain": int(np.clip(np.floor(-np.log2(largest)), 0, _MOST_GAIN)) if largest > 0 else 0,
        "scale": scale,
        "range": shown_range(theirs, scale),
        "limit": limits.max_abs,
        "worst": list(measures.worst_pixel) if measures and differs else None,
        "isEqual": not differs,
        "hasOpacity": any(_is_seen_through(each) for each in (ours, theirs)) and scale == 1,
        "notFinite": not all(np.isfinite(each).all() for each in (ours, theirs)),
        "clipped": _clipped_words(outcome) if scale == 1 else f"Black to white is a range of {scale:.6g}.",
    }


def _is_seen_through(pixels: NDArray) -> bool:
    return bool((pixels[..., 3] < 1).any())


def _clipped_words(outcome: Outcome) -> str:
    """Return a sentence on the pixels that are brighter than a screen shows; empty if there are none."""
    fraction = 0.0
    for each in (outcome.candidate.pixels, outcome.reference.pixels):
        bright = (each[..., :3] > 1) & np.isfinite(each[..., :3])
        fraction = max(fraction, float(bright.any(axis=2).mean()) if bright.any() else 0.0)
    return (
        f"{100 * fraction:.2g}% of the pixels are brighter than 1 and shown as 1: lower the exposure."
        if fraction
        else ""
    )
