"""Text of others, names and headers and what libraries say, made safe to show: on a terminal, in HTML and in Markdown.

A terminal obeys characters of control (ECMA-48: C0, DEL, C1), and everything that lays out Unicode those that turn the
direction of writing around (UAX #9), so that a text may look like another. Each is shown by its number: `\\x1b`. So is
what a file's name has of bytes that are no UTF-8.
"""

from __future__ import annotations

import html
import re

_CONTROLS = r"\x00-\x1f\x7f-\x9f"
_NO_LETTERS = "\ud800-\udfff"  # bytes of a name that is not UTF-8 (PEP 383), which can't be written
_DIRECTIONS = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
_OBEYED = re.compile(f"[{_CONTROLS}{_DIRECTIONS}{_NO_LETTERS}]")
_OBEYED_IN_LINES = re.compile(f"(?![\n\t])[{_CONTROLS}{_DIRECTIONS}{_NO_LETTERS}]")
_MARKDOWN = re.compile(r"([\\`*_\[\]<>|#&~])")


def shown(text: object) -> str:
    """The text with characters of control, but for the ends of lines and tabs, by their numbers."""
    return _OBEYED_IN_LINES.sub(_by_number, str(text))


def shown_line(text: object) -> str:
    """The same, ends of lines included: it is one line."""
    return _OBEYED.sub(_by_number, str(text))


def one_line(text: object) -> str:
    """The text as one line: ends of lines and runs of blanks are a blank, other characters of control their numbers."""
    return shown_line(" ".join(str(text).split()))


def escaped(text: object) -> str:
    """The text as HTML."""
    return html.escape(shown(text))


def markdown(text: object) -> str:
    """The text as Markdown, in which nothing of it means anything, nor in HTML; one line, fit for a table."""
    return _MARKDOWN.sub(lambda found: f"&#{ord(found[1])};", one_line(text))


def _by_number(found: re.Match[str]) -> str:
    number = ord(found[0])
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"
