"""HTML page of one pair of pictures: the verdict, a viewer, the numbers."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.histogram import histogram
from texvol.comparison.limits import checks
from texvol.comparison.measures import flip_map, largest_finite, pixel_differences
from texvol.comparison.outcome import Outcome, shown_range
from texvol.comparison.pixel_data import candidate_data, packed_text, reference_data
from texvol.comparison.templates import rendered
from texvol.formats.pictures.page_pictures import color_table

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
    measures = outcome.measures
    ours, theirs = (each.pixels for each in outcome.in_common_form())
    scale = measures.scale if measures else 1.0
    differences = pixel_differences(ours, theirs) if measures else np.zeros((1, 1))
    return rendered(
        "comparison.html",
        outcome=outcome,
        measures=measures,
        metadata=metadata,
        index=index,
        histogram=histogram(differences / scale, outcome.limits.max_abs) if measures else "",
        checks=checks(measures, outcome.limits) if measures else (),
        infinity=float("inf"),
        viewer=_viewer_data(outcome, ours, theirs, largest_finite(differences) / scale, flip),
    )


def _viewer_data(
    outcome: Outcome, ours: NDArray[np.float32], theirs: NDArray[np.float32], largest: float, flip: bool
) -> dict[str, Any]:
    """Return the data of the page's script; `largest` is the largest finite difference."""
    measures = outcome.measures
    scale = measures.scale if measures else 1.0
    data = candidate_data(ours, theirs) if measures else reference_data(ours)
    pictures = {"oneSize": measures is not None, "reference": reference_data(theirs), "candidate": data}
    if measures:
        pictures["flip"] = None
        if flip and data:
            ours_seen, theirs_seen = (np.nan_to_num(each / np.float32(scale)) for each in (ours, theirs))
            perceived = np.clip(flip_map(ours_seen, theirs_seen), 0, 1)
            pictures["flip"] = packed_text(np.rint(255 * perceived).astype(np.uint8).tobytes())
    top = int(np.ceil(np.log10(largest))) if largest > 0 else 0
    differs = bool(measures and measures.max_error > 0)
    return {
        "pictures": pictures,
        "colors": base64.b64encode(color_table().tobytes()).decode(),
        "decades": [top - 5, top],
        "gain": int(np.clip(np.floor(-np.log2(largest)), 0, _MOST_GAIN)) if largest > 0 else 0,
        "scale": scale,
        "range": shown_range(theirs, scale),
        "limit": outcome.limits.max_abs,
        "worst": list(measures.worst_pixel) if measures and differs else None,
        "isEqual": not differs,
        "hasOpacity": any((each[..., 3] < 1).any() for each in (ours, theirs)) and scale == 1,
        "notFinite": not all(np.isfinite(each).all() for each in (ours, theirs)),
        "clipped": _clipped_words(outcome) if scale == 1 else f"Black to white is a range of {scale:.6g}.",
    }


def _clipped_words(outcome: Outcome) -> str:
    """Return a sentence on the pixels that are brighter than a screen shows; empty if there are none."""
    fraction = 0.0
    for each in (outcome.candidate.pixels, outcome.reference.pixels):
        bright = (each[..., :3] > 1) & np.isfinite(each[..., :3])
        fraction = max(fraction, float(bright.any(axis=2).mean()) if bright.any() else 0.0)
    if not fraction:
        return ""
    return f"{100 * fraction:.2g}% of the pixels are brighter than 1 and shown as 1: lower the exposure."
