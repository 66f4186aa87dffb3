"""The sheet that annotation is drawn on: its pen, what room is taken already, and marks in their layers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.annotation import marks
from texvol.annotation.lettering import Box, Lettering
from texvol.annotation.marks import Mark, Point, Size

# Behind the picture's matter, and then over it in this order. Outlines of letters come before all letters, so that
# they cover no neighbour.
LAYERS = ("behind", "box", "outline", "fill", "line", "text")
_EM = 1 / 30  # of the picture's height: 17 pixels in one of 512 …
_SLIMMEST = 1.5  # … or of so many widths, where it is slimmer
_LEAST_EM = 9.0  # pixels; smaller letters can't be read, so in small pictures there are fewer
_LINE = 1 / 12  # widths of lines and of outlines, in ems
_OUTLINE = 1 / 9
_AIR = 0.35  # around what is placed, in ems
_MID_GREY = 0.18  # linear light half way between black and white to the eye
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


class Rect(NamedTuple):
    """An upright rectangle of the picture, in pixels."""

    left: float
    top: float
    right: float
    bottom: float

    def grown(self, by: float) -> Rect:
        """The rectangle with so much more on every side."""
        return Rect(self.left - by, self.top - by, self.right + by, self.bottom + by)

    def meets(self, other: Rect) -> bool:
        """Whether the two overlap."""
        return (
            self.left < other.right and other.left < self.right and self.top < other.bottom and other.top < self.bottom
        )


class Sheet:
    """What annotation of a picture of that size is drawn on."""

    def __init__(
        self,
        size: Size,
        letters: Lettering,
        background: ArrayLike,
        color: ArrayLike | None = None,
        em: float | None = None,
    ) -> None:
        self.size, self.letters = size, letters
        self.em = em_of(size, em)
        self.width = max(_LINE * self.em, 1.0)  # thinner lines would fade rather than get thinner
        behind = np.clip(np.asarray(background, np.float64), 0, 1)
        self.color = np.asarray(_contrasting(behind) if color is None else color, np.float64)
        # In the background's colour outlines show only where letters lie over matter.
        self.outline_color = behind if color is None else np.asarray(_contrasting(self.color))
        self.taken: list[Rect] = []
        self.texts: list[str] = []  # what is written,
        self.written: list[Rect] = []  # and where
        self._marks: dict[str, list[Mark]] = {layer: [] for layer in LAYERS}

    def fits(self, rect: Rect, further: list[Rect] | None = None) -> bool:
        """Whether a rectangle, with air around it, lies in the picture and meets nothing that is there."""
        air = rect.grown(_AIR * self.em)
        inside = air.left >= 0 and air.top >= 0 and air.right <= self.size[0] and air.bottom <= self.size[1]
        return inside and not any(air.meets(other) for other in [*self.taken, *(further or [])])

    def take(self, rect: Rect) -> None:
        """Keep others out of a rectangle."""
        self.taken.append(rect)

    def text_size(self, text: str, scale: float = 1.0) -> tuple[float, float]:
        """Width and height of a line of text, in pixels."""
        box = self.letters.box(text, scale * self.em)
        return box.width, box.above + box.below

    def text_rect(self, text: str, middle: Point, scale: float = 1.0, *, turned: bool = False) -> Rect:
        """What a line of text takes whose capital letters are centred at `middle`; where whole pixels put it."""
        box = self.letters.box(text, scale * self.em)
        left, base = self._start(box, middle, turned)
        if turned:
            return Rect(left - box.top, base - box.width, left + box.bottom, base)
        return Rect(left, base - box.top, left + box.width, base + box.bottom)

    def text(self, text: str, middle: Point, scale: float = 1.0, *, turned: bool = False) -> None:
        """Draw a line of text there, on whole pixels, which keeps its stems sharp; `turned` to be read upwards."""
        self.texts.append(text)
        self.written.append(self.text_rect(text, middle, scale, turned=turned))
        size = scale * self.em
        left, base = self._start(self.letters.box(text, size), middle, turned)
        for layer, color, outline in (
            ("outline", self.outline_color, max(round(_OUTLINE * size), 1)), ("text", self.color, 0)
        ):  # fmt: skip
            coverage, x, y = self.letters.coverage(text, size, outline)
            if turned:
                coverage, x, y = np.rot90(coverage), y, -x - coverage.shape[1]
            self._marks[layer].append(marks.patch(coverage, left + x, base + y, color, self.size))

    @staticmethod
    def _start(box: Box, middle: Point, turned: bool) -> tuple[int, int]:
        """The pixel at which the base line begins."""
        if turned:
            return round(middle[0] + box.above / 2), round(middle[1] + box.width / 2)
        return round(middle[0] - box.width / 2), round(middle[1] + box.above / 2)

    def line(
        self, start: ArrayLike, end: ArrayLike, layer: str = "line", width: float | None = None, opacity: float = 1.0
    ) -> None:
        """Draw a straight line in the pen's colour."""
        (x0, y0), (x1, y1) = np.asarray(start, np.float64), np.asarray(end, np.float64)
        mark = marks.line((x0, y0), (x1, y1), width or self.width, self.color, self.size, opacity)
        self._marks[layer].append(mark)

    def rectangle(self, rect: Rect, color: ArrayLike | None = None, *, outlined: bool = False) -> None:
        """Fill a rectangle with a colour, the pen's unless told."""
        if outlined:
            around = rect.grown(max(_OUTLINE * self.em, 1.0))
            self._marks["outline"].append(marks.rectangle(*around, self.outline_color, self.size))
        fill = self.color if color is None else color
        self._marks["fill"].append(marks.rectangle(*rect, fill, self.size))

    def paint(self, coverage: NDArray[np.float64], left: int, top: int, colors: ArrayLike, layer: str = "fill") -> None:
        """Put an array of coverage and colours at whole pixels."""
        self._marks[layer].append(marks.patch(coverage, left, top, colors, self.size))

    def over(self, picture: NDArray, background: ArrayLike) -> NDArray:
        """A copy of the picture with all marks laid behind and over it."""
        pixels = picture.copy()
        for mark in self._marks["behind"]:
            marks.lay_behind(pixels, mark, background)
        for layer in LAYERS[1:]:
            for mark in self._marks[layer]:
                marks.lay_over(pixels, mark)
        return pixels


def em_of(size: Size, em: float | None = None) -> float:
    """Pixels per em in a picture of that size, unless it is given."""
    return float(em) if em is not None else max(_EM * min(size[1], _SLIMMEST * size[0]), _LEAST_EM)


def _contrasting(color: ArrayLike) -> tuple[float, float, float]:
    """Black or white, whichever the eye tells better from a linear colour (Rec. 709 luminance)."""
    return BLACK if float(np.asarray(color, np.float64) @ (0.2126, 0.7152, 0.0722)) > _MID_GREY else WHITE
