"""Entries of the page of all pictures: numbers, texts and thumbnails of each picture, JSON-able."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.limits import Limits, checks
from texvol.comparison.measures import Measures, extreme_around, largest_finite, pixel_differences, without_infinities
from texvol.comparison.outcome import Outcome, shown_range
from texvol.comparison.pictures import Picture
from texvol.formats.pictures import image
from texvol.formats.pictures.page_pictures import color_table, data_url
from texvol.util import color

_THUMB = 128  # pixels of the longer side
_MOST_EXCESS = 1e12  # of a limit of 0; JSON has no infinity
THUMBNAIL_DECADES = 2  # of differences, below and above the limit
_MEASURES = ("max_error", "rms_error", "percent_over", "ssim", "flip", "beyond_rms", "beyond_max")
_MAGENTA = 1.0, 0.0, 1.0


def entry_of(outcome: Outcome, *, test: str = "", page: str = "", metadata: Mapping[str, str] = {}) -> dict[str, Any]:
    """Return the entry of a compared pair.

    Parameters
    ----------
    test : str
        Test that checks the picture.
    page : str
        Path of the pair's own page, from the page of all pictures.
    metadata : mapping
        Driver, versions and the like; shown where they are not the same for all pictures.

    Returns
    -------
    dict
        `name`, `test`, `page`, `status`, `facts` (the metadata), `excess` (largest measure as a multiple of its limit),
        `size`, `measures`, `limits`, `violations`, `kinds`, `oracle`, `notes` (texts), `thumbnails` (data: URLs of
        `candidate`, `reference` and `difference`, as far as there are).
    """
    measures = outcome.measures
    return {
        **_start(outcome.name, outcome.status, test, page, metadata),
        "excess": excess(measures, outcome.limits),
        "size": outcome.candidate.size_in_words,
        "measures": measures and without_infinities({name: getattr(measures, name) for name in _MEASURES}),
        "limits": outcome.limits.as_json(),
        "violations": list(outcome.violations),
        "kinds": [each.words for each in outcome.kinds],
        "oracle": outcome.three_way.words if outcome.three_way else None,
        "notes": [*outcome.scene_words, *outcome.notes],
        "thumbnails": _thumbnails(outcome),
    }


def entry_without_reference(
    name: str,
    candidate: Picture | None,
    violations: Sequence[str],
    *,
    status: str = "new",
    test: str = "",
    metadata: Mapping[str, str] = {},
) -> dict[str, Any]:
    """Return the entry of a picture without a reference ("new"), or with an unreadable one ("broken")."""
    found = _start(name, status, test, "", metadata) | {"violations": list(violations)}
    if candidate:
        found |= {"size": candidate.size_in_words, "thumbnails": {"candidate": _thumbnail(candidate.pixels, 1.0)}}
    return found


def _start(name: str, status: str, test: str, page: str, metadata: Mapping[str, str]) -> dict[str, Any]:
    page = page and PurePath(page).as_posix()
    return {"name": name, "status": status, "test": test, "page": page, "facts": dict(metadata)}


def excess(measures: Measures | None, limits: Limits) -> float | None:
    """Return the largest measure as a multiple of its limit; None without measures."""
    if measures is None:
        return None
    pairs = [(each.measure, each.limit) for each in checks(measures, limits)]
    if not limits.fail_percent:  # 0 % has no multiples: the largest difference takes its place
        pairs[0] = measures.beyond_max, limits.max_abs
    fractions = [0.0]
    for number, limit in pairs:
        if limit < np.inf and number != 0:
            fractions.append(number / limit if number > 0 and limit else _MOST_EXCESS)
    return float(min(max(fractions), _MOST_EXCESS))


def _thumbnails(outcome: Outcome) -> dict[str, str]:
    measures = outcome.measures
    ours, theirs = (each.pixels for each in outcome.in_common_form())
    if measures is None:
        return {"candidate": _thumbnail(ours, 1.0), "reference": _thumbnail(theirs, 1.0)}
    low, scale = shown_range(theirs, measures.scale)[0], measures.scale
    found = {"candidate": _thumbnail(ours, scale, low)}
    if measures.max_error > 0:
        differences = pixel_differences(ours, theirs)
        limit = outcome.limits.max_abs or largest_finite(differences) / scale or 1.0
        found["reference"] = _thumbnail(theirs, scale, low)
        found["difference"] = _difference_thumbnail(differences / np.float32(scale), limit)
    return found


def _reduced(numbers: NDArray, how: np.ufunc) -> NDArray:
    """Reduce blocks of (height, width, …) to a pixel each, by sum or maximum; the longer side has `_THUMB` blocks."""
    longer = max(numbers.shape[:2])
    counts = [min(side, max(1, side * _THUMB // longer)) for side in numbers.shape[:2]]
    rows, columns = (np.arange(count) * side // count for count, side in zip(counts, numbers.shape, strict=False))
    return np.asarray(how.reduceat(how.reduceat(numbers, rows, axis=0), columns, axis=1))


def _thumbnail(pixels: NDArray, scale: float, low: float = 0.0) -> str:
    """Return a small picture over black; pixels that are not finite are magenta."""
    colors = pixels[..., :3]
    has_broken = not np.isfinite(pixels).all()
    shown = np.clip(np.nan_to_num(colors) if has_broken else colors, low, low + scale)
    area = _reduced(np.ones(pixels.shape[:2], np.float32), np.add)[..., np.newaxis]
    small = (_reduced(shown, np.add) / area - np.float32(low)) / np.float32(scale)
    if has_broken:
        small[_grown(_reduced(~np.isfinite(pixels).all(axis=2), np.logical_or))] = _MAGENTA
    return _encoded(small)


def _difference_thumbnail(differences: NDArray, limit: float) -> str:
    """Return differences in false colours, relative to the limit of a pixel; a single wrong pixel stays visible."""
    reduced = _grown(_reduced(differences, np.maximum))
    with np.errstate(divide="ignore"):
        fractions = 0.5 + np.log10(reduced / limit) / (2 * THUMBNAIL_DECADES)
    entries = np.rint(255 * np.clip(np.nan_to_num(fractions), 0, 1)).astype(np.uint8)
    colors = color.linear_from_srgb(color_table()[entries] / 255)
    colors[fractions <= 0] = 0
    colors[~np.isfinite(reduced)] = _MAGENTA
    return _encoded(colors)


def _grown(small: NDArray) -> NDArray:
    """Return each pixel's largest neighbour, in thumbnails so large that a single pixel would be missed."""
    return small if max(small.shape) < _THUMB else extreme_around(np.maximum, small)


def _encoded(small: NDArray) -> str:
    picture = np.dstack([small, np.ones(small.shape[:2])])
    # A JPEG needs a quarter of the bytes, but blurs small pictures.
    is_tiny = picture.shape[0] * picture.shape[1] < 1024
    kind = "png" if is_tiny else "jpeg"
    return data_url(image.encoded(f"thumb.{kind}", picture, quick=True), f"image/{kind}")
