"""Code blocks of the documentation's pages, each with what the comment above it says of it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "texvol" / "docs"
PAGES = {path.stem: path for path in (REPOSITORY / "README.md", *sorted(DOCS.glob("*.md")))}
_FENCE = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*?) -->\n)?^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE
)


@dataclass(frozen=True)
class Block:
    """One code block.

    Attributes
    ----------
    language, text : str
    mark, argument : str
        The comment above it: "file" and a name, "not run" and the reason, "status" and a number, or "output".
    line : int
        Where it begins.
    """

    language: str
    text: str
    mark: str
    argument: str
    line: int

    @property
    def commands(self) -> list[list[str]]:
        """Words of each command of a shell block."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [words for line in lines if (words := shlex.split(line, comments=True))]


def blocks(page: str) -> Iterator[Block]:
    """The blocks of a page in their order."""
    text = PAGES[page].read_text(encoding="utf-8")
    for found in _FENCE.finditer(text):
        mark, _, argument = (found["mark"] or "").partition(": ")
        line = text.count("\n", 0, found.start()) + 1
        yield Block(found["language"], found["text"], mark, argument, line)
