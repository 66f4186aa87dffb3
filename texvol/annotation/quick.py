"""Annotation as lines and patches, in the place of pixels, for pictures that follow each other quickly.

The parts have the places and the letters that `annotate` gives them. Words are drawn once and kept as patches; legends
are kept as long as nothing but the camera changes. Whoever draws the lines and patches composites them in linear light.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, fields
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.annotation import marks
from texvol.annotation.drawing import place_all, place_legends
from texvol.annotation.lettering import Lettering
from texvol.annotation.request import Annotation
from texvol.annotation.sheet import LAYERS, WHITE, Rect, Sheet
from texvol.annotation.view import View
from texvol.opengl.overlay import Line, Patch
from texvol.scene.scene import Scene

Window = tuple[float, float] | None
_MOST_KEPT = 400  # words: some 10 kB each
_MOST_LEGENDS = 4  # kept, of some megabytes: their place depends on the letters of the picture's borders


@dataclass
class Parts:
    """Lines and patches of an annotation."""

    lines: list[Line]
    patches: list[Patch]


class _QuickSheet(Sheet):
    """Sheet that keeps lines as they are, and draws words into patches."""

    def __init__(self, words: dict[Hashable, tuple[NDArray[np.float16], int, int]], *how: Any) -> None:
        super().__init__(*how)
        self._lines: dict[Line, tuple[int, Line]] = {}  # with their layers, by all but their opacity
        self.patches: list[Patch] = []
        self._words = words

    def _lay_text(self, text: str, size: float, left: int, base: int, turned: bool) -> None:
        key = "word", text, size, turned, tuple(self.color), tuple(self.outline_color)
        if key not in self._words:
            if len(self._words) >= _MOST_KEPT:
                self._words.clear()
            self._words[key] = _drawn(self.text_marks(text, size, turned))
        colors, x, y = self._words[key]
        self.patches.append(Patch(key, colors, left + x, base + y))

    def line(self, start: ArrayLike, end: ArrayLike, layer: str = "line", opacity: float = 1.0) -> None:
        """Keep a straight line in the sheet's colour."""
        first, last = np.asarray(start, np.float64), np.asarray(end, np.float64)
        kept = marks.within(first, last, self.width + 2, self.size)
        if kept is not None:
            (x0, y0), (x1, y1) = kept[0].tolist(), kept[1].tolist()
            red, green, blue = self.color.tolist()
            line = Line((x0, y0), (x1, y1), (red, green, blue), self.width, opacity, layer == "behind")
            # An axis lies on an edge of the box.
            same = self._lines.pop(line._replace(opacity=1.0), None)
            under = same[1].opacity if same is not None else 0.0
            self._lines[line._replace(opacity=1.0)] = LAYERS.index(layer), line._replace(under=under)

    @property
    def lines(self) -> list[Line]:
        """Lines in the order in which they are drawn."""
        return [line for _, line in sorted(self._lines.values(), key=itemgetter(0))]


def _drawn(parts: Sequence[tuple[NDArray[np.float64], int, int, ArrayLike]]) -> tuple[NDArray[np.float16], int, int]:
    """Return premultiplied colours of arrays of coverage over each other, and their upper left pixel."""
    left, top = min(x for _, x, _, _ in parts), min(y for _, _, y, _ in parts)
    right = max(x + coverage.shape[1] for coverage, x, _, _ in parts)
    bottom = max(y + coverage.shape[0] for coverage, _, y, _ in parts)
    colors, size = np.zeros((bottom - top, right - left, 4)), (right - left, bottom - top)
    for coverage, x, y, color in parts:
        marks.lay_over(colors, marks.patch(coverage, x - left, y - top, color, size))
    return colors.astype(np.float16), left, top


def _patch_of(key: Hashable, drawn: list[marks.Mark], size: tuple[int, int]) -> Patch | None:
    """Return the patch of marks over each other; None if they cover nothing."""
    drawn = [mark for mark in drawn if mark.rows.size]
    if not drawn:
        return None
    rows, columns = (np.concatenate(each) for each in ([m.rows for m in drawn], [m.columns for m in drawn]))
    top, bottom, left, right = (int(each) for each in (rows.min(), rows.max(), columns.min(), columns.max()))
    colors = np.zeros((bottom - top + 1, right - left + 1, 4))
    for mark in drawn:
        marks.lay_over(colors, mark._replace(rows=mark.rows - top, columns=mark.columns - left))
    return Patch(key, colors.astype(np.float16), left, top)


@dataclass
class QuickAnnotation:
    """Drawer of annotation for pictures that follow each other; it keeps the font, words and legends."""

    _letters: Lettering | None = None
    _font: Any = None
    _words: dict[Hashable, tuple[NDArray[np.float16], int, int]] = field(default_factory=dict)
    _legends: dict[Hashable, tuple[list[Rect], list[Patch]]] = field(default_factory=dict)
    _legends_of: tuple[Scene, Annotation] | None = None
    _pixels: tuple[list[marks.Mark], Patch | None] = ([], None)  # all that is drawn as pixels
    _count: int = 0  # of patches with a key of their own

    def parts(
        self, scene: Scene, size: tuple[int, int], annotation: Annotation, *, transparent: bool, window: Window
    ) -> Parts:
        """Return the annotation of a picture of that size, as `annotate` draws it; arguments as there."""
        if self._letters is None or self._font != annotation.font:
            self._letters, self._font = Lettering(annotation.font), annotation.font
            self._words.clear()
            self._legends.clear()
        how = annotation.color, annotation.font_size
        background = WHITE if transparent else scene.background
        sheet = _QuickSheet(self._words, size, self._letters, background, *how)
        view = View(scene.completed(size).camera, scene.box, size)
        place_all(sheet, view, scene, annotation, window, self._place_legends)
        drawn = sheet.all_marks()
        if not _same_marks(self._pixels[0], drawn):
            self._count += 1
            self._pixels = drawn, _patch_of(("pixels", self._count), drawn, size)
        found = self._pixels[1]
        return Parts(sheet.lines, sheet.patches if found is None else [*sheet.patches, found])

    def _place_legends(self, sheet: Sheet, scene: Scene, annotation: Annotation, window: Window) -> None:
        """Place legends as `place_legends` does, from those that are kept if there are any."""
        assert isinstance(sheet, _QuickSheet)
        if self._legends_of is None or not _same_legends(self._legends_of, scene, annotation):
            self._legends_of = scene, annotation
            self._legends.clear()
        key = sheet.size, window, tuple(sheet.taken)
        if key not in self._legends:
            if len(self._legends) >= _MOST_LEGENDS:
                self._legends.clear()
            background = sheet.background
            own = Sheet(sheet.size, sheet.letters, background, annotation.color, annotation.font_size)
            own.taken = list(sheet.taken)
            place_legends(own, scene, annotation, window)
            self._count += 1
            found = _patch_of(("legend", self._count), own.all_marks(), sheet.size)
            self._legends[key] = own.taken[len(sheet.taken) :], [found] if found is not None else []
        taken, patches = self._legends[key]
        sheet.taken += taken
        sheet.patches += patches


def _same_marks(before: list[marks.Mark], drawn: list[marks.Mark]) -> bool:
    return len(before) == len(drawn) and all(
        np.array_equal(one, other)
        for each, again in zip(before, drawn, strict=True)
        for one, other in zip(each, again, strict=True)
    )


def _same_legends(before: tuple[Scene, Annotation], scene: Scene, annotation: Annotation) -> bool:
    """True if nothing but the camera has changed."""
    if before[0] is scene and before[1] is annotation:
        return True
    names = [part.name for part in fields(Scene) if part.name != "camera"]
    return before[1] == annotation and all(getattr(before[0], name) == getattr(scene, name) for name in names)
