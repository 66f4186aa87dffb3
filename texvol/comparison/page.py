"""One pair of pictures as one HTML page: the verdict, a viewer, the numbers. It needs no network."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.compared import compared_pixels, largest_finite, pixel_differences, shown_range
from texvol.comparison.entries import entry_of
from texvol.comparison.histogram import histogram
from texvol.comparison.html_parts import (
    data_element,
    document,
    fact_list,
    listed,
    number,
    part,
    status_sign,
)
from texvol.comparison.measures import flip_map
from texvol.comparison.number_table import file_table, number_tables, worst_pixel_words
from texvol.comparison.outcome import Outcome
from texvol.comparison.pixel_data import candidate_data, level_data, reference_data
from texvol.formats.pictures.page_pictures import color_table
from texvol.util.shown_text import escaped

__all__ = ["comparison_page", "entry_of"]

_STYLES = ("style.css", "viewer.css")
_SCRIPTS = tuple(
    f"viewer/{each}.js" for each in ("pixels", "painting", "stage", "pointing", "readout", "controls", "start")
)
_MOST_GAIN = 30  # powers of two: what is below 1e-9 is no difference of float32 pictures


def comparison_page(
    outcome: Outcome, *, metadata: Mapping[str, str] = {}, index: str | None = None, flip: bool = False
) -> str:
    """The page's text.

    Parameters
    ----------
    facts : mapping
        What else to say of how the pictures were made, such as the driver and versions.
    index : str, optional
        Address of the page that this one is linked from.
    flip : bool
        Whether to show where ꟻLIP sees differences, which takes as long as all the rest.
    """
    back = f'<p><a href="{escaped(index)}">All pictures</a></p>' if index else ""
    measures = outcome.measures
    body = f"""{back}<h1>{escaped(outcome.name)}</h1>
{_verdict(outcome)}
{part("viewer.html")}
{_histogram_section(outcome)}
{number_tables(measures, outcome.limits) if measures else ""}
<h2>Files</h2>
{file_table(outcome)}
{fact_list(metadata)}"""
    title = f"{outcome.status}: {outcome.name}"
    return document(title, body, _STYLES, _SCRIPTS, data_element("facts", _viewer_metadata(outcome, flip)))


def _verdict(outcome: Outcome) -> str:
    measures = outcome.measures
    said = [f'<p class="lead">{status_sign(outcome.status)} {_lead(outcome)}</p>', listed(outcome.violations)]
    if outcome.scene_words:
        said += ["<h2>Of two scenes</h2>", listed(outcome.scene_words)]
    if outcome.kinds:
        said += ["<h2>What kind of difference</h2>", listed(each.words for each in outcome.kinds)]
    if outcome.three_way:
        said += ["<h2>The oracle's word</h2>", listed([outcome.three_way.words])]
    if measures and measures.max_error > 0:
        said += ["<h2>Where most</h2>", f'<p class="most">{escaped(worst_pixel_words(measures))}</p>']
    if outcome.notes:
        said += ["<h2>Worth knowing</h2>", listed(outcome.notes)]
    return f'<div class="verdict {escaped(outcome.status)}">{"".join(said)}</div>'


def _lead(outcome: Outcome) -> str:
    measures, broken = outcome.measures, len(outcome.violations)
    if measures is None:
        return "Pictures of two sizes can't be compared."
    if measures.max_error == 0:
        return "Every number is equal, and yet:" if broken else "Every number of every pixel is equal."
    most = f"Largest difference {number(measures.max_error)}, rms {number(measures.rms_error)}"
    return f"{most}; all limits are kept." if not broken else f"{most}. What is not as it should be:"


def _histogram_section(outcome: Outcome) -> str:
    if outcome.measures is None:
        return ""
    candidate, reference = compared_pixels(outcome)
    return "<h2>Differences</h2>" + histogram(
        pixel_differences(candidate, reference) / outcome.measures.scale, outcome.limits.max_abs
    )


def _viewer_metadata(outcome: Outcome, flip: bool) -> dict[str, Any]:
    """What the page's script has to know."""
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
        "clipped": _clipped_words(outcome) if scale == 1 else f"Shown from black to white: {scale:.6g} of numbers.",
    }


def _is_seen_through(pixels: NDArray) -> bool:
    return bool((pixels[..., 3] < 1).any())


def _clipped_words(outcome: Outcome) -> str:
    """Says that pixels are brighter than a screen shows, if they are."""
    fraction = 0.0
    for each in (outcome.candidate.pixels, outcome.reference.pixels):
        bright = (each[..., :3] > 1) & np.isfinite(each[..., :3])
        fraction = max(fraction, float(bright.any(axis=2).mean()) if bright.any() else 0.0)
    return (
        f"{100 * fraction:.2g}% of the pixels are brighter than 1 and shown as 1: lower the exposure."
        if fraction
        else ""
    )
