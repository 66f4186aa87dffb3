"""Text as coverage, through Pillow's FreeType; the only user of Pillow.

The font is DejaVu Sans, which comes with matplotlib: Latin, Greek, Cyrillic, and the signs of units and mathematics.
A text with letters that the font lacks is refused by name, rather than drawn with gaps; so is one that is written from
right to left, which is not laid out here. Another font may be given.
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
_MOST_EMS = 256  # area of a letter in squares of the font's size; more is a broken font
_NO_LETTER = "\U0010ffff"  # that of no font, for which it draws what stands for letters that it lacks


class Box(NamedTuple):
    """How far a line of text reaches from the left end of its base line, in pixels, y downwards."""

    width: float
    above: float  # height of capital letters and figures
    below: float  # depth of letters such as p
    top: float  # how high ink reaches, accents included, or capital letters where it does not
    bottom: float  # how deep ink reaches


class Lettering:
    """A font in any size.

    Raises
    ------
    InputError
        If `font` is no font file.
    MissingExtraError
        If Pillow, or the default font, is not installed.
    """

    def __init__(self, font: str | os.PathLike[str] | None = None) -> None:
        try:
            from PIL import ImageFont, features
        except ImportError as error:
            raise missing_extra("Pillow", "annotation", "text in a picture") from error
        if not features.check("freetype2"):
            raise InputError("text in a picture needs Pillow with FreeType, and this one was built without")
        self._path = str(_default_font() if font is None else font)
        self.name = "DejaVu Sans" if font is None else str(font)
        self._library = ImageFont
        self._sized: dict[float, Any] = {}
        self._known: dict[str, bool] = {}
        self.box("", 16)  # fails now, if at all

    def box(self, text: str, size: float) -> Box:
        """How much room a line of text takes at `size` pixels per em."""
        with self._opened(size) as font:
            above, below = -font.getbbox("H", anchor="ls")[1], font.getbbox("p", anchor="ls")[3]
            _, top, right, bottom = font.getbbox(text, anchor="ls")
            return Box(max(font.getlength(text), right), above, below, max(above, -top), max(bottom, 0))

    def coverage(self, text: str, size: float, outline: int = 0) -> tuple[NDArray[np.float64], int, int]:
        """Coverage of a line of text, and where its upper left pixel lies from the left end of the base line.

        Parameters
        ----------
        outline : int
            How many pixels wider the letters are all around.
        """
        from PIL import Image, ImageDraw

        with self._opened(size) as font:
            left, top, right, bottom = font.getbbox(text, anchor="ls")
            left, top = int(np.floor(left)) - outline - 1, int(np.floor(top)) - outline - 1
            right, bottom = int(np.ceil(right)) + outline + 1, int(np.ceil(bottom)) + outline + 1
            if (right - left) * (bottom - top) > _MOST_EMS * (len(text) + 1) * (size + outline + 1) ** 2:
                raise InputError(f"{self._path}: cannot be read as a font: its letters are many times their size")
            image = Image.new("L", (right - left, bottom - top))
            ImageDraw.Draw(image).text((-left, -top), text, 255, font, anchor="ls", stroke_width=outline)
            return np.asarray(image, np.float64) / 255, left, top

    def check(self, text: str, what: str) -> None:
        """Raise InputError where the text can't be drawn."""
        for letter in one_line(text):
            if unicodedata.bidirectional(letter) in ("R", "AL"):
                raise InputError(f"{what}: {letter!r} is written from right to left, which is not laid out here")
            if not self._has(letter):
                raise InputError(
                    f"{what}: the font {self.name} has no letter {letter!r} (U+{ord(letter):04X}): give a font that has"
                )

    def fitted(self, text: str, size: float, width: float, least_fraction: float) -> tuple[str, float]:
        """The text and a size at which it is no wider than `width`: smaller, down to `least_share`, and then cut.

        Empty where not even a letter fits.
        """
        natural = self.box(text, size).width
        if natural <= width:
            return text, size
        size = max(size * width / natural, size * least_fraction)
        if self.box(text, size).width <= width:
            return text, size
        most = min(len(text), int(width))  # letters of a pixel each say nothing
        kept = bisect_right(range(1, most), width, key=lambda n: self.box(text[:n] + ELLIPSIS, size).width)
        return (text[:kept].rstrip() + ELLIPSIS if kept else ""), size

    @contextmanager
    def _opened(self, size: float) -> Iterator[Any]:
        """The font at `size` pixels per em; what is wrong with it, a letter's outline included, is an InputError."""
        try:
            if size not in self._sized:
                check_regular(self._path)
                # The basic layout is the same on every machine; the other one depends on what libraries are there.
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
            self._known[letter] = is_blank or not np.array_equal(self._drawn(letter), self._none)
        return self._known[letter]

    @cached_property
    def _none(self) -> NDArray[np.float64]:
        return self._drawn(_NO_LETTER)

    def _drawn(self, letter: str) -> NDArray[np.float64]:
        return self.coverage(letter, 32)[0]


def one_line(text: str) -> str:
    """The text on one line, letters composed where they can be: fonts have ü rather than u and two dots.

    Signs that only tell programs how to lay it out are left out.
    """
    shown = (letter for letter in unicodedata.normalize("NFC", text) if unicodedata.category(letter) != "Cf")
    return " ".join("".join(shown).split())


def _default_font() -> Path:
    """DejaVu Sans, where matplotlib keeps it."""
    try:
        import matplotlib
    except ImportError as error:
        raise missing_extra("matplotlib, whose font it is written in,", "annotation", "text in a picture") from error
    return Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
