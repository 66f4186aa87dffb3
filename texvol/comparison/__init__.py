"""Differences of two pictures, their limits, and their probable causes.

compare      absolute differences of two arrays, as in tests of your own
examine      a candidate and its reference: measures, broken limits, kinds of difference, the oracle's verdict
"""

from __future__ import annotations

from texvol.comparison.difference import Difference, compare

__all__ = ["Difference", "compare"]
