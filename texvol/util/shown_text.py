"""Untrusted text (names, headers, messages of libraries) made safe for a terminal, HTML and Markdown.

Terminals interpret control characters (ECMA-48: C0, DEL, C1), and bidirectional controls (UAX #9) make a text look like
another. Each such character is replaced by its number, such as `\\x1b`, and so is each byte of a file name that is not
UTF-8.
"""

from __future__ import annotations

import re

_CONTROLS = r"\x00-\x1f\x7f-\x9f"
_NO_LETTERS = "\ud800-\udfff"  # bytes of a name that is not UTF-8 (PEP 383), which can't be encoded
_DIRECTIONS = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
_OBEYED = re.compile(f"[{_CONTROLS}{_DIRECTIONS}{_NO_LETTERS}]")
_OBEYED_IN_LINES = re.compile(f"(?![\n\t])[{_CONTROLS}{_DIRECTIONS}{_NO_LETTERS}]")
_MARKDOWN = re.compile(r"([\\`*_\[\]<>|#&~])")


def shown(text: object) -> str:
    """Return the text with control characters, except newlines and tabs, as numbers."""
    return _OBEYED_IN_LINES.sub(_by_number, str(text))


def shown_line(text: object) -> str:
    """Return the text as one line with all control characters as numbers."""
    return _OBEYED.sub(_by_number, str(text))


def one_line(text: object, longest: int | None = None) -> str:
    """Return the text as one line: white space becomes single blanks, other control characters their numbers.

    A line of more than `longest` characters is cut and ends in an ellipsis.
    """
    line = shown_line(" ".join(str(text).split()))
    return line if longest is None or len(line) <= longest else line[:longest] + " …"


def markdown(text: object) -> str:
    """Return the text as one line of Markdown without any markup, fit for a table."""
    return _MARKDOWN.sub(lambda found: f"&#{ord(found[1])};", one_line(text))


def _by_number(found: re.Match[str]) -> str:
    number = ord(found[0])
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"
