"""Kinds of difference between two pictures, found from the pictures alone.

Each kind is a hypothesis; a hypothesis explains a difference if undoing the hypothesis removes most of the squared
difference. `selection` tries the hypotheses, cheap ones first; each other module holds one family.

    levels, posterised      banding: 8 bits, half floats, few levels
    gamma                   encoded colour where the other picture is linear
    opacity                 other slab thickness, straight colour, other background
    light, tone_curve       brightness, exchanged channels, cut values, any curve
    geometry                shifted (by `registration`), turned or mirrored
    order                   front and back exchanged
    isolated, noise, edges, end_slabs, unexplained     recognised by their traits
"""

from __future__ import annotations

from texvol.comparison.kinds.kind import NAMES, Kind
from texvol.comparison.kinds.naming import kinds_of

__all__ = ["NAMES", "Kind", "kinds_of"]
