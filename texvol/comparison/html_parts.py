"""What the pages of a comparison share: their frame, the signs of a verdict, lists of facts."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from string import Template
from typing import Any

from texvol.util.shown_text import escaped

# Each has a sign besides its colour, which not everybody sees.
SIGNS = {"broken": "✕", "different": "≠", "new": "+", "same": "✓"}
STATUSES = tuple(SIGNS)  # worst first


@cache
def part(name: str) -> str:
    """The text of a file beside this module."""
    return (files("texvol.comparison") / "pages" / name).read_text("utf-8")


def document(title: str, body: str, styles: Iterable[str], scripts: Iterable[str], data: str = "") -> str:
    """A whole page that needs nothing else, and is not allowed to ask for anything."""
    return Template(part("page.html")).substitute(
        title=escaped(title),
        style="\n".join(map(part, styles)),
        body=body,
        data=data,
        script="\n".join(map(part, scripts)),
    )


def data_element(name: str, content: Any) -> str:
    """JSON for the page's script; nothing in it can end the element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>'


def status_sign(status: str) -> str:
    """The verdict as a word with a sign."""
    known = status if status in SIGNS else "broken"
    return f'<span class="status {known}" data-sign="{SIGNS[known]}">{escaped(status)}</span>'


def listed(sentences: Iterable[str]) -> str:
    """A list of sentences, or nothing."""
    items = "".join(f"<li>{escaped(each)}</li>" for each in sentences)
    return f"<ul>{items}</ul>" if items else ""


def fact_list(metadata: Mapping[str, str]) -> str:
    """Names with what they are, or nothing."""
    items = "".join(f"<dt>{escaped(str(name))}</dt><dd>{escaped(str(fact))}</dd>" for name, fact in metadata.items())
    return f"<dl>{items}</dl>" if items else ""


def number(value: float | None, digits: int = 4) -> str:
    """A number with few digits; a dash where there is none."""
    if value is None:
        return "–"
    if value != value:
        return "NaN"
    if abs(value) == float("inf"):
        return "∞" if value > 0 else "−∞"
    return f"{value:.{digits}g}".replace("-", "−")
