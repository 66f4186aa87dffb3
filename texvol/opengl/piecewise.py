"""Compositor that draws some rows at a time, so that a picture can be ended, and its progress be told, in between.

The picture is the same bit for bit, because pixels do not depend on each other.
"""

from __future__ import annotations

import time
from typing import Any

from texvol.opengl.compositor import Compositor
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

    def blend(self, *triangles: Any) -> None:
        """Draw triangles, some rows at a time."""
        if not progress.is_heard():
            super().blend(*triangles)
            return
        target, row = self.target, 0
        width, height = target.size
        try:
            progress.advance(0)
            while row < height:
                start, rows = time.perf_counter(), min(self._rows, height - row)
                target.scissor = 0, row, width, rows
                super().blend(*triangles)
                self.finish()
                row += rows
                seconds = time.perf_counter() - start
                if seconds > 2 * _PIECE:
                    self._rows = max(self._rows // 2, _FEWEST_ROWS)
                elif seconds < _PIECE:
                    self._rows *= 2
                progress.within(rows / height)
        finally:
            target.scissor = None  # type: ignore[assignment]
            target.use()
