"""Regions of a picture that don't count in a comparison: rectangles and masks, each with the reason.

    ignore = [
        {rectangle = [8, 8, 120, 16], reason = "the date of the run"},      # x, y, width, height; from the top left
        {mask = "hair.png", reason = "strands are placed at random"},       # what is not black does not count
    ]

Measures are those of the other pixels. In the regions the candidate is taken as the reference: nothing there is seen as
a difference, and neighbours that a measure looks at have none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.pictures import Picture, read_picture
from texvol.util.errors import InputError

# Shorter texts are no reasons: "flaky", "TODO", "see above".
FEWEST_WORDS = 3
_KEYS = {"rectangle", "mask", "reason"}
_LARGEST = 1 << 20


def is_reason(reason: object) -> bool:
    """True if a text has the words of a reason."""
    return isinstance(reason, str) and len(re.findall(r"\w*[^\W\d_]{2,}\w*", reason)) >= FEWEST_WORDS


@dataclass(frozen=True)
class Region:
    """A region that doesn't count: a rectangle (x, y, width, height) in pixels, or the path of a mask."""

    reason: str
    rectangle: tuple[int, int, int, int] | None = None
    mask: Path | None = None

    @classmethod
    def of(cls, given: object, folder: Path, where: str) -> Region:
        """Return the region of a table {rectangle or mask, reason}; masks are relative to `folder`.

        Raises
        ------
        InputError
            If a key is missing or unknown, or a value is not valid; it begins with `where`.
        """
        if not isinstance(given, Mapping) or not set(given) <= _KEYS or ("rectangle" in given) == ("mask" in given):
            raise InputError(f"{where}: a region must have a rectangle or a mask, and a reason, got {given!r}")
        if not is_reason(given.get("reason")):
            raise InputError(f'{where}: a region needs reason = "…" of at least {FEWEST_WORDS} words, got {given!r}')
        if "rectangle" in given:
            return cls(given["reason"], _rectangle(given["rectangle"], where))
        if not isinstance(given["mask"], str) or not given["mask"]:
            raise InputError(f"{where}: mask must be the name of a picture file, got {given['mask']!r}")
        return cls(given["reason"], mask=folder / given["mask"])

    @property
    def words(self) -> str:
        """The region without its reason."""
        if self.rectangle is None:
            return f"mask {self.mask.name if self.mask else ''}"
        x, y, width, height = self.rectangle
        return f"{width} × {height} pixels at column {x}, row {y}"

    def pixels(self, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Return the pixels (height, width) in the region.

        Raises
        ------
        InputError
            If the rectangle is not in the picture, or the mask is no mask of that size.
        """
        if self.mask is not None:
            return _read_mask(self.mask, shape)
        assert self.rectangle is not None
        x, y, width, height = self.rectangle
        if x + width > shape[1] or y + height > shape[0]:
            raise InputError(f"region must be in the picture of {shape[1]} × {shape[0]} pixels, got {self.words}")
        found = np.zeros(shape, bool)
        found[y : y + height, x : x + width] = True
        return found


@dataclass(frozen=True)
class Ignored:
    """All pixels (height, width) that don't count, and sentences on them; `pixels` is None if all pixels count."""

    pixels: NDArray[np.bool_] | None = None
    words: tuple[str, ...] = ()

    @classmethod
    def of(cls, regions: Sequence[Region], picture: Picture) -> Ignored:
        """Return the pixels of the regions in a picture.

        Raises
        ------
        InputError
            If a region does not fit the picture, holds no pixel, or the regions leave no pixel to compare.
        """
        if not regions:
            return cls()
        height, width = picture.pixels.shape[:2]
        each = [region.pixels((height, width)) for region in regions]
        for region, pixels in zip(regions, each, strict=True):
            if not pixels.any():
                raise InputError(f"region must hold a pixel, got an empty {region.words}")
        everything = np.logical_or.reduce(each)
        if everything.all():
            raise InputError("regions that don't count must leave pixels to compare, and these cover the whole picture")
        words = tuple(
            f"not compared: {region.words} ({100 * pixels.mean():.3g}% of the picture): {region.reason}"
            for region, pixels in zip(regions, each, strict=True)
        )
        return cls(everything, words)

    @property
    def counted(self) -> NDArray[np.bool_] | None:
        """The pixels that count; None for all."""
        return None if self.pixels is None else ~self.pixels

    def quiet(self, picture: Picture) -> Picture:
        """Return the picture with finite numbers in the regions, so that a NaN there breaks nothing."""
        if self.pixels is None or np.isfinite(picture.pixels[self.pixels]).all():
            return picture
        pixels = picture.pixels.copy()
        pixels[self.pixels] = np.nan_to_num(pixels[self.pixels], nan=0.0, posinf=0.0, neginf=0.0)
        return replace(picture, pixels=pixels)

    def like(self, candidate: Picture, reference: Picture) -> Picture:
        """Return the candidate with the reference's pixels in the regions."""
        if self.pixels is None:
            return candidate
        where = self.pixels[..., np.newaxis]
        return replace(candidate, pixels=np.where(where, reference.pixels, candidate.pixels))


NOTHING = Ignored()


def _rectangle(given: object, where: str) -> tuple[int, int, int, int]:
    if (
        not isinstance(given, list | tuple)
        or len(given) != 4
        or not all(isinstance(each, int) and not isinstance(each, bool) and 0 <= each <= _LARGEST for each in given)
        or not (given[2] and given[3])
    ):
        raise InputError(f"{where}: rectangle must be [x, y, width, height] in whole pixels, got {given!r}")
    x, y, width, height = given
    return x, y, width, height


def _read_mask(path: Path, shape: tuple[int, int]) -> NDArray[np.bool_]:
    picture = read_picture(path)
    if picture.lossy:
        raise InputError(f"{path}: a mask must be a PNG, TIFF or EXR, got a JPEG, whose black is not black")
    if picture.pixels.shape[:2] != shape:
        size = f"{shape[1]} × {shape[0]}"
        raise InputError(f"{path}: the mask must have the picture's size, {size} pixels, got {picture.size_in_words}")
    return np.asarray((picture.pixels[..., :3] > 0).any(axis=2))
