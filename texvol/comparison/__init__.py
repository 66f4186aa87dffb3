"""How far one picture is from another, what kind of difference that is, and whether it is too much.

compare      plain absolute differences of two arrays, as tests of one's own use them
examine      everything about a candidate and its reference: measures, limits that it breaks, kinds, the oracle
"""

from __future__ import annotations

from texvol.comparison.difference import Difference, compare

__all__ = ["Difference", "compare"]
