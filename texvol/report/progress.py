"""Progress of a long run on stderr: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
from typing import Any

from texvol.util.shown_text import one_line
from texvol.util.terminal import complain

_LONGEST_LINE = 400  # characters


class Progress:
    """Progress bar with the current step beside it; in a file or a pipe, a line for each finished step."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._task: Any = None
        self._total = self._done = 0

    def __enter__(self) -> Progress:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            words = TextColumn("{task.description}", markup=False)
            columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), words)
            self._bar = Bar(*columns, console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task("", total=None)
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def expect(self, steps: int) -> None:
        """Add to the number of steps to come."""
        self._total += steps
        if self._bar is not None:
            self._bar.update(self._task, total=self._total)

    def say(self, what: str) -> None:
        """Show the current step."""
        if self._bar is not None:
            self._bar.update(self._task, description=one_line(what, _LONGEST_LINE))
        else:
            complain(what)

    def now(self, what: str) -> None:
        """Show how far the current step is, on a terminal only."""
        if self._bar is not None:
            self._bar.update(self._task, description=one_line(what, _LONGEST_LINE))

    def step(self, what: str) -> None:
        """Count a finished step, and show its result."""
        self._done += 1
        if self._bar is not None:
            self._bar.update(self._task, advance=1, description=one_line(what, _LONGEST_LINE))
        else:
            complain(f"{self._done}/{self._total} {what}")
