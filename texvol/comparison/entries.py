"""Entries of the page of all pictures: numbers, texts and thumbnails of each picture, JSON-able."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.compared import compared_pixels, largest_finite, pixel_differences, shown_range
from texvol.comparison.limits import Limits
from texvol.comparison.measures import Measures, without_infinities
from texvol.comparison.outcome import Outcome
from texvol.comparison.pictures import Picture
from texvol.formats.pictures import image
from texvol.formats.pictures.page_pictures import color_table, data_url
from texvol.util import color

_THUMB = 128  # pixels of the longer side
_MOST_EXCESS = 1e12  # of a limit of 0; JSON has no infinity
THUMBNAIL_DECADES = 2  # of differences, below and above the limit
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
        "size": _size(outcome.candidate),
        "measures": None if measures is None else without_infinities(_few(measures)),
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
    page: str = "",
    metadata: Mapping[str, str] = {},
) -> dict[str, Any]:
    """Return the entry of a picture without a reference ("new"), or with an unreadable one ("broken")."""
    return {
        **_start(name, status, test, page, metadata),
        "excess": None,
        "size": _size(candidate) if candidate else "",
        "measures": None,
        "limits": None,
        "violations": list(violations),
        "kinds": [],
        "oracle": None,
        "notes": [],
        "thumbnails": {"candidate": _thumbnail(candidate.pixels, 1.0)} if candidate else {},
    }


def _start(name: str, status: str, test: str, page: str, metadata: Mapping[str, str]) -> dict[str, Any]:
    page = PurePath(page).as_posix() if page else ""
    return {"name": name, "status": status, "test": test, "page": page, "facts": dict(metadata)}


def _size(picture: Picture) -> str:
    height, width = picture.pixels.shape[:2]
    return f"{width} × {height}"


def _few(measures: Measures) -> dict[str, float]:
    names = ("max_error", "rms_error", "percent_over", "ssim", "flip", "beyond_rms", "beyond_max")
    return {name: float(getattr(measures, name)) for name in names}


def excess(measures: Measures | None, limits: Limits) -> float | None:
    """Return the largest measure as a multiple of its limit; None without measures."""
    if measures is None:
        return None
    # A limit of 0 % has no multiples: the largest difference takes its place.
    pairs = (
        (measures.percent_over, limits.fail_percent) if limits.fail_percent else (measures.beyond_max, limits.max_abs),
        (measures.beyond_max, limits.hard_max),
        (measures.outlier, limits.outlier),
        (measures.beyond_rms, limits.rms),
        (measures.beyond_flip, limits.flip),
    )
    fractions = [_fraction(number, limit) for number, limit in pairs if limit < np.inf]
    return max(fractions, default=0.0)


def _fraction(number: float, limit: float) -> float:
    if not number > 0:
        return 0.0 if number == 0 else _MOST_EXCESS
    return float(min(number / limit, _MOST_EXCESS)) if limit else _MOST_EXCESS


def _thumbnails(outcome: Outcome) -> dict[str, str]:
    measures = outcome.measures
    if measures is None:
        return {
            name: _thumbnail(each.pixels, 1.0)
            for name, each in (("candidate", outcome.candidate), ("reference", outcome.reference))
        }
    ours, theirs = compared_pixels(outcome)
    low, scale = shown_range(theirs, measures.scale)[0], measures.scale
    found = {"candidate": _thumbnail(ours, scale, low)}
    if measures.max_error > 0:
        differences = pixel_differences(ours, theirs)
        limit = outcome.limits.max_abs or largest_finite(differences) / scale or 1.0
        found["reference"] = _thumbnail(theirs, scale, low)
        found["difference"] = _difference_thumbnail(differences / np.float32(scale), limit)
    return found


def _blocks(size: int, most: int) -> NDArray[np.intp]:
    """Return the starts of at most `most` blocks of `size` pixels."""
    count = min(size, most)
    return np.arange(count) * size // count


def _reduced(numbers: NDArray, how: np.ufunc) -> NDArray:
    """Reduce blocks of (height, width, …) to a pixel each, by sum or maximum; the longer side has `_THUMB` blocks."""
    height, width = numbers.shape[:2]
    longer = max(height, width)
    rows, columns = (_blocks(each, max(1, each * _THUMB // longer)) for each in (height, width))
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
    if max(small.shape) < _THUMB:
        return small
    for axis in (0, 1):
        low, high = (np.roll(np.pad(small, 1), step, axis)[1:-1, 1:-1] for step in (-1, 1))
        small = np.maximum(np.maximum(small, low), high)
    return small


def _encoded(small: NDArray) -> str:
    picture = np.dstack([small, np.ones(small.shape[:2])])
    # A JPEG needs a quarter of the bytes, but blurs small pictures.
    is_tiny = picture.shape[0] * picture.shape[1] < 1024
    kind = "png" if is_tiny else "jpeg"
    return data_url(image.encoded(f"thumb.{kind}", picture, quick=True), f"image/{kind}")
