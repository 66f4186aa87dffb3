"""Pages of documentation as plain text: Markdown without its marks, filled to the width of a terminal."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from itertools import zip_longest

_FENCE = re.compile(r"^```\w*\n(.*?)^```$\n?", re.MULTILINE | re.DOTALL)
_ITEM = re.compile(r"^(?:- |\d+\. )", re.MULTILINE)
_EMPHASIS = re.compile(r"\*\*(.+?)\*\*|(?<![\w*])\*(?!\s)([^*\n]+?)\*(?!\w)")
_LEAST_COLUMN = 12  # characters that a column of a table keeps, however narrow the terminal is


def simplified(markdown: str) -> str:
    """The page without comments, and with the descriptions of pictures in their place."""
    text = re.sub(r"^<!--.*?-->\n", "", markdown, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"!\[(.*?)\]\(.*?\)", r"[picture: \1]", text)


def as_text(markdown: str, width: int = 80) -> str:
    """Plain text of a page, in lines of at most `width` characters where words and code allow it."""
    text = simplified(markdown)
    blocks: list[str] = []
    end = 0
    for fence in _FENCE.finditer(text):
        blocks += _prose(text[end : fence.start()], width)
        blocks.append(textwrap.indent(fence[1].rstrip("\n"), "    "))
        end = fence.end()
    return "\n\n".join([*blocks, *_prose(text[end:], width)])


def _prose(text: str, width: int) -> Iterator[str]:
    """Headings, tables, lists and paragraphs, one text each."""
    for block in filter(None, (each.strip("\n") for each in re.split(r"\n\s*\n", text))):
        if block.startswith("#"):
            line = _plain(block.lstrip("# "))
            yield f"{line}\n{('=' if block.startswith('# ') else '-') * len(line)}"
        elif block.startswith("|"):
            yield _columns(block, width)
        elif _ITEM.match(block):
            yield "\n".join(_item(each, width) for each in re.split(r"\n(?=- |\d+\. )", block))
        else:
            yield _filled(_plain(block), width)


def _plain(text: str) -> str:
    """Text on one line without emphasis, code marks and targets of links."""
    text = re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", " ".join(text.split()))
    text = _EMPHASIS.sub(lambda found: found[1] or found[2], text).replace("`", "")
    return re.sub(r"\\([|<*\[])", r"\1", text)


def _filled(text: str, width: int, later: str = "") -> str:
    return textwrap.fill(text, width, subsequent_indent=later, break_long_words=False, break_on_hyphens=False)


def _item(text: str, width: int) -> str:
    """One entry of a list."""
    mark = _ITEM.match(text)
    return _filled(_plain(text), width, " " * len(mark[0] if mark else ""))


def _columns(table: str, width: int) -> str:
    """A table with aligned columns; the cells of wide columns are filled, so that it fits the width.

    A row of pictures is left out if their descriptions are the titles of the columns.
    """
    lines = [line for line in table.splitlines() if not re.fullmatch(r"[|:\- ]+", line.strip())]
    rows = [[_plain(cell) for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]] for line in lines]
    shown = [f"[picture: {title}]" for title in rows[0]]
    rows = [row for row in rows if row != shown]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    while sum(widths) + 2 * len(widths) > width and max(widths) > _LEAST_COLUMN:
        widths[widths.index(max(widths))] -= 1
    return "\n".join(_row(cells, widths) for cells in rows)


def _row(cells: list[str], widths: list[int]) -> str:
    """One row of a table, of as many lines as its longest cell needs."""
    columns = [
        textwrap.wrap(cell, width, break_long_words=False, break_on_hyphens=False)
        for cell, width in zip(cells, widths, strict=True)
    ]
    lines = zip_longest(*columns, fillvalue="")
    padded = ("".join(f"  {cell:{width}}" for cell, width in zip(line, widths, strict=True)) for line in lines)
    return "\n".join(line.rstrip() for line in padded)
