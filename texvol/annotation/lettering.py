"""Text as coverage of pixels, by Pillow's FreeType; no other module uses Pillow.

The default font is DejaVu Sans, which matplotlib contains: Latin, Greek, Cyrillic, and signs of units and mathematics.
A text raises an error if the font lacks one of its letters, or if a letter is written from right to left, because this
layout is not supported. Another font may be chosen.
"""

from __future__ import annotations

import os
import unicodedata
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import InputError, missing_extra
from texvol.util.text_files import check_regular

ELLIPSIS = "…"
_MOST_EMS = 256  # largest area of a letter, in squares of the font's size: beyond, the font is damaged
_MOST_BOXES = 4096  # remembered: numbers beside axes are measured again for each camera
_NO_LETTER = "\U0010ffff"  # no font has this letter: it is drawn as the font's sign for missing letters


class Box(NamedTuple):
    """Extent of a line of text in pixels, from the left end of its base line, y downwards."""

    width: float
    above: float  # height of capital letters and figures
    below: float  # depth of letters such as p
    top: float  # height of the ink, including accents; at least `above`
    bottom: float  # depth of the ink


class Lettering:
    """Font in any size.

    Raises
    ------
    InputError
        If `font` is not a font file.
    MissingExtraError
        If Pillow, or the default font, is not installed.
    """

    def __init__(self, font: str | os.PathLike[str] | None = None) -> None:
        try:
            from PIL import ImageFont, features
        except ImportError as error:
            raise missing_extra("Pillow", "annotation", "text in a picture") from error
        if not features.check("freetype2"):
            raise InputError("text in a picture needs Pillow with FreeType; the installed Pillow has no FreeType")
        self._path = str(_default_font() if font is None else font)
        self.name = "DejaVu Sans" if font is None else str(font)
        self._library = ImageFont
        self._sized: dict[float, Any] = {}
        self._known: dict[str, bool] = {}
        self._boxes: dict[tuple[str, float], Box] = {}
        self.box("", 16)  # raises an error early

    def box(self, text: str, size: float) -> Box:
        """Return the extent of a line of text at `size` pixels per em."""
        found = self._boxes.get((text, size))
        if found is None:
            if len(self._boxes) >= _MOST_BOXES:
                self._boxes.clear()
            found = self._boxes[text, size] = self._measured(text, size)
        return found

    def _measured(self, text: str, size: float) -> Box:
        with self._opened(size) as font:
            above, below = -font.getbbox("H", anchor="ls")[1], font.getbbox("p", anchor="ls")[3]
            _, top, right, bottom = font.getbbox(text, anchor="ls")
            return Box(max(font.getlength(text), right), above, below, max(above, -top), max(bottom, 0))

    def coverage(self, text: str, size: float, outline: int = 0) -> tuple[NDArray[np.float64], int, int]:
        """Return the coverage of a line of text, and its upper left pixel counted from the base line's left end.

        Parameters
        ----------
        outline : int
            Pixels by which letters are widened on all sides.
        """
        from PIL import Image, ImageDraw

        with self._opened(size) as font:
            left, top, right, bottom = font.getbbox(text, anchor="ls")
            left, top = int(np.floor(left)) - outline - 1, int(np.floor(top)) - outline - 1
            right, bottom = int(np.ceil(right)) + outline + 1, int(np.ceil(bottom)) + outline + 1
            if (right - left) * (bottom - top) > _MOST_EMS * (len(text) + 1) * (size + outline + 1) ** 2:
                raise InputError(
                    f"{self._path}: cannot be read as a font: its letters are many times larger than its size"
                )
            image = Image.new("L", (right - left, bottom - top))
            ImageDraw.Draw(image).text((-left, -top), text, 255, font, anchor="ls", stroke_width=outline)
            return np.asarray(image, np.float64) / 255, left, top

    def check(self, text: str, what: str) -> None:
        """Raise InputError if the text can't be drawn; `what` names the text in the error."""
        for letter in one_line(text):
            if unicodedata.bidirectional(letter) in ("R", "AL"):
                raise InputError(f"{what}: letter {letter!r} is written from right to left, which is not supported")
            if not self._has(letter):
                code = f"U+{ord(letter):04X}"
                raise InputError(f"{what}: the font {self.name} has no letter {letter!r} ({code}); choose another font")

    def fitted(self, text: str, size: float, width: float, least_fraction: float) -> tuple[str, float]:
        """Return the text and its size so that it fits `width`: shrunk to at most `least_fraction`, then cut.

        The text is empty if not even one letter fits.
        """
        natural = self.box(text, size).width
        if natural <= width:
            return text, size
        size = max(size * width / natural, size * least_fraction)
        if self.box(text, size).width <= width:
            return text, size
        most = min(len(text), int(width))  # letters are wider than a pixel
        kept = bisect_right(range(1, most), width, key=lambda n: self.box(text[:n] + ELLIPSIS, size).width)
        return (text[:kept].rstrip(" .") + ELLIPSIS if kept else ""), size

    @contextmanager
    def _opened(self, size: float) -> Iterator[Any]:
        """Provide the font at `size` pixels per em; errors of the font file raise InputError."""
        try:
            if size not in self._sized:
                check_regular(self._path)
                # The basic layout is the same on all machines; the other layout depends on installed libraries.
                basic = self._library.Layout.BASIC
                self._sized[size] = self._library.truetype(self._path, size, layout_engine=basic)
            yield self._sized[size]
        except InputError:
            raise
        except (OSError, ValueError, OverflowError, MemoryError) as error:
            raise InputError(f"{self._path}: cannot be read as a font: {error}") from None

    def _has(self, letter: str) -> bool:
        if letter not in self._known:
            is_blank = unicodedata.category(letter) == "Zs"
            self._known[letter] = is_blank or not np.array_equal(self.coverage(letter, 32)[0], self._none)
        return self._known[letter]

    @cached_property
    def _none(self) -> NDArray[np.float64]:
        return self.coverage(_NO_LETTER, 32)[0]


def one_line(text: str) -> str:
    """Return the text on one line, in Unicode's composed form, because fonts may lack combining letters.

    Invisible formatting characters are removed.
    """
    shown = (letter for letter in unicodedata.normalize("NFC", text) if unicodedata.category(letter) != "Cf")
    return " ".join("".join(shown).split())


def _default_font() -> Path:
    """Return the path of DejaVu Sans in matplotlib's data."""
    try:
        import matplotlib
    except ImportError as error:
        raise missing_extra("matplotlib (for its font)", "annotation", "text in a picture") from error
    return Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
