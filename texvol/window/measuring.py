"""State of measuring in the window: the tool in hand, points that are placed, the selected measure."""

from __future__ import annotations

from dataclasses import dataclass, field
from weakref import ReferenceType, ref

from texvol.window.counting import Counting
from texvol.window.document import Document

STEPS = {
    "ruler": ("one end", "the other end"),
    "angle": ("the end of one arm", "the vertex", "the end of the other arm"),
    "box": ("its middle",),
    "profile": ("its start", "its end"),
}


@dataclass
class Measuring:
    """State of measuring.

    Attributes
    ----------
    tool : str
        Kind of the measure whose points are placed by clicks; "" without one.
    placed : tuple of points
        Points that have been placed so far.
    selected : int, optional
        Number of the measure whose values are shown.
    counting : Counting
        Values that are worked out on a thread.
    """

    tool: str = ""
    placed: tuple[tuple[float, float, float], ...] = ()
    selected: int | None = None
    counting: Counting = field(default_factory=Counting)
    _of: ReferenceType[Document] | None = None

    def follow(self, document: Document | None) -> None:
        """Forget what belongs to another document than the open one."""
        before = self._of() if self._of is not None else None
        if before is not document:
            self.tool, self.placed, self.selected = "", (), None
            self.counting.forget()
            self._of = None if document is None else ref(document)
        count = len(document.measures) if document is not None else 0
        if self.selected is not None and self.selected >= count:
            self.selected = count - 1 if count else None

    @property
    def hint(self) -> str:
        """Request of the next click; "" without a tool."""
        if not self.tool:
            return ""
        return f"{self.tool}: click {STEPS[self.tool][len(self.placed)]}"
