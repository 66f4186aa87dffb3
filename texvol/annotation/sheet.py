"""Sheet on which annotation is drawn: its colours, the rectangles that are taken, and marks in layers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.annotation import marks
from texvol.annotation.lettering import Box, Lettering
from texvol.annotation.marks import Mark, Point, Size

# The first layer lies behind the medium, the others over it in this order. Outlines of letters come before all letters,
# so that they cover no neighbouring letter.
LAYERS = ("behind", "box", "outline", "fill", "line", "text")
_EM = 1 / 40  # of the picture's height: 13 pixels for 512 …
_SLIMMEST = 1.5  # … or of the width times this factor, if that is smaller
_LEAST_EM = 9.0  # pixels: smaller letters can't be read; small pictures have less text instead
_LINE = 1 / 12  # width of lines, in ems
_OUTLINE = 1 / 9  # width of outlines, in ems
_AIR = 0.35  # free space around each part, in ems
_BREAK = 0.2  # ems around a part in which lines behind it are left out
_MID_GREY = 0.18  # linear light that looks half way between black and white
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


class Rect(NamedTuple):
    """Upright rectangle in the picture, in pixels."""

    left: float
    top: float
    right: float
    bottom: float

    def grown(self, by: float) -> Rect:
        """Return the rectangle enlarged by `by` pixels on every side."""
        return Rect(self.left - by, self.top - by, self.right + by, self.bottom + by)

    def meets(self, other: Rect) -> bool:
        """True if the two rectangles overlap."""
        return (
            self.left < other.right and other.left < self.right and self.top < other.bottom and other.top < self.bottom
        )


class Sheet:
    """Sheet for the annotation of a picture of a size."""

    def __init__(
        self,
        size: Size,
        letters: Lettering,
        background: ArrayLike,
        color: ArrayLike | None = None,
        em: float | None = None,
    ) -> None:
        self.size, self.letters = size, letters
        self.em = float(em) if em is not None else max(_EM * min(size[1], _SLIMMEST * size[0]), _LEAST_EM)
        self.width = max(_LINE * self.em, 1.0)  # lines below 1 pixel would become fainter, not thinner
        behind = self.background = np.clip(np.asarray(background, np.float64), 0, 1)
        self.color = np.asarray(_contrasting(behind) if color is None else color, np.float64)
        # An outline in the background's colour is visible only where letters lie over the medium.
        self.outline_color = behind if color is None else np.asarray(_contrasting(self.color))
        self.taken: list[Rect] = []
        self.texts: list[str] = []  # drawn texts
        self.written: list[Rect] = []  # their rectangles
        self._marks: dict[str, list[Mark]] = {layer: [] for layer in LAYERS}

    def fits(self, rect: Rect, further: list[Rect] | None = None) -> bool:
        """True if a rectangle with free space around it lies in the picture and overlaps nothing."""
        air = rect.grown(_AIR * self.em)
        inside = air.left >= 0 and air.top >= 0 and air.right <= self.size[0] and air.bottom <= self.size[1]
        return inside and not any(air.meets(other) for other in [*self.taken, *(further or [])])

    def text_size(self, text: str, scale: float = 1.0) -> tuple[float, float]:
        """Return the width and height of a line of text, in pixels."""
        box = self.letters.box(text, scale * self.em)
        return box.width, box.above + box.below

    def text_rect(self, text: str, middle: Point, scale: float = 1.0, *, turned: bool = False) -> Rect:
        """Return the rectangle of a line of text whose capital letters are centred at `middle`, rounded to pixels."""
        box = self.letters.box(text, scale * self.em)
        left, base = self._start(box, middle, turned)
        if turned:
            return Rect(left - box.top, base - box.width, left + box.bottom, base)
        return Rect(left, base - box.top, left + box.width, base + box.bottom)

    def text(self, text: str, middle: Point, scale: float = 1.0, *, turned: bool = False) -> None:
        """Draw a line of text at whole pixels, so that its stems stay sharp; `turned` text is read upwards."""
        self.texts.append(text)
        self.written.append(self.text_rect(text, middle, scale, turned=turned))
        size = scale * self.em
        left, base = self._start(self.letters.box(text, size), middle, turned)
        self._lay_text(text, size, left, base, turned)

    def _lay_text(self, text: str, size: float, left: int, base: int, turned: bool) -> None:
        """Draw a line of text at `size` pixels per em whose base line begins at a pixel."""
        both = self.text_marks(text, size, turned)
        for layer, (coverage, x, y, color) in zip(("outline", "text"), both, strict=True):
            self._marks[layer].append(marks.patch(coverage, left + x, base + y, color, self.size))

    def text_marks(self, text: str, size: float, turned: bool) -> list[tuple[NDArray[np.float64], int, int, NDArray]]:
        """Return the coverage of a text's outline and of its letters, with places from the base line, and colours."""
        found = []
        for color, outline in ((self.outline_color, max(round(_OUTLINE * size), 1)), (self.color, 0)):
            coverage, x, y = self.letters.coverage(text, size, outline)
            if turned:
                coverage, x, y = np.rot90(coverage), y, -x - coverage.shape[1]
            found.append((coverage, x, y, color))
        return found

    @staticmethod
    def _start(box: Box, middle: Point, turned: bool) -> tuple[int, int]:
        """Return the pixel at which the base line begins."""
        if turned:
            return round(middle[0] + box.above / 2), round(middle[1] + box.width / 2)
        return round(middle[0] - box.width / 2), round(middle[1] + box.above / 2)

    def line(self, start: ArrayLike, end: ArrayLike, layer: str = "line", opacity: float = 1.0) -> None:
        """Draw a straight line in the sheet's colour."""
        (x0, y0), (x1, y1) = np.asarray(start, np.float64), np.asarray(end, np.float64)
        mark = marks.line((x0, y0), (x1, y1), self.width, self.color, self.size, opacity)
        self._marks[layer].append(mark)

    def broken_line(self, start: ArrayLike, end: ArrayLike, layer: str = "line", opacity: float = 1.0) -> None:
        """Draw a straight line as `line`, left out where other parts have their room."""
        first, last = np.asarray(start, np.float64), np.asarray(end, np.float64)
        rooms = (marks.fractions_inside(first, last, rect.grown(_BREAK * self.em)) for rect in self.taken)
        begin = 0.0
        for enters, leaves in sorted(room for room in rooms if room[0] < room[1]):
            if enters > begin:
                self.line(first + begin * (last - first), first + enters * (last - first), layer, opacity)
            begin = max(begin, leaves)
        if begin < 1:
            self.line(first + begin * (last - first), last, layer, opacity)

    def rectangle(self, rect: Rect, color: ArrayLike | None = None, *, outlined: bool = False) -> None:
        """Fill a rectangle with a colour, by default the sheet's colour."""
        if outlined:
            around = rect.grown(max(_OUTLINE * self.em, 1.0))
            self._marks["outline"].append(marks.rectangle(*around, self.outline_color, self.size))
        fill = self.color if color is None else color
        self._marks["fill"].append(marks.rectangle(*rect, fill, self.size))

    def paint(self, coverage: NDArray[np.float64], left: int, top: int, colors: ArrayLike, layer: str = "fill") -> None:
        """Draw an array of coverage and colours at whole pixels."""
        self._marks[layer].append(marks.patch(coverage, left, top, colors, self.size))

    def all_marks(self) -> list[Mark]:
        """Return all marks over the medium, in the order in which they are composited."""
        return [mark for layer in LAYERS[1:] for mark in self._marks[layer]]

    def over(self, picture: NDArray, background: ArrayLike) -> NDArray:
        """Return a copy of the picture with all marks composited behind and over it."""
        pixels = picture.copy()
        for mark in self._marks["behind"]:
            marks.lay_behind(pixels, mark, background)
        for mark in self.all_marks():
            marks.lay_over(pixels, mark)
        return pixels


def _contrasting(color: ArrayLike) -> tuple[float, float, float]:
    """Return black or white, whichever contrasts more with a linear colour (Rec. 709 luminance)."""
    return BLACK if float(np.asarray(color, np.float64) @ (0.2126, 0.7152, 0.0722)) > _MID_GREY else WHITE
