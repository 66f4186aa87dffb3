"""Compositor that draws some rows at a time, so that a picture can be ended, and its progress be told, in between.

The picture is the same bit for bit, because pixels do not depend on each other.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from texvol.opengl.compositor import Compositor, Region
from texvol.opengl.contexts import Context
from texvol.util import progress

# Seconds that a group of rows takes: a tenth of a noticeable delay.
_PIECE = 0.015
_FIRST_ROWS = 64
_FEWEST_ROWS = 16  # with fewer rows, setting up costs more than drawing


class PiecewiseCompositor(Compositor):
    """Compositor that draws groups of rows while somebody hears the progress, and in one piece otherwise."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._rows = _FIRST_ROWS

    def _pieces(self) -> Iterator[Region | None]:
        """Yield groups of rows of each region, and tell the progress once each is drawn."""
        if not progress.is_heard():
            yield from super()._pieces()
            return
        regions = ((0, 0, *self.target.size),) if self._regions is None else self._regions
        pixels = sum(width * height for _, _, width, height in regions)
        progress.advance(0)
        for x, y, width, height in regions:
            row = 0
            while row < height:
                start, rows = time.perf_counter(), min(self._rows, height - row)
                yield x, y + row, width, rows
                self.finish()
                row += rows
                seconds = time.perf_counter() - start
                if seconds > 2 * _PIECE:
                    self._rows = max(self._rows // 2, _FEWEST_ROWS)
                elif seconds < _PIECE:
                    self._rows *= 2
                progress.within(rows * width / pixels)
