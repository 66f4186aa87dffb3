"""Numbers in the letters that the window's font has: powers of ten have no raised figures there, but for 1, 2 and 3."""

from __future__ import annotations

import re

_POWER = re.compile("×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_PLAIN = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def in_letters(text: str) -> str:
    """Return a text with powers of ten as "e6" in place of "×10⁶"."""
    return _POWER.sub(lambda power: "e" + power[1].translate(_PLAIN), text)
