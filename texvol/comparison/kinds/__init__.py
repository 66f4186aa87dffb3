"""What kind of difference there is between two pictures, told from the pictures alone.

Each kind is a hypothesis: undone, it takes the squared difference away. `selection` tries them, the cheap ones first;
the modules know one family of hypotheses each.

    levels        banding: 8 bits, half floats, posterised
    gamma         an encoding where the other is linear
    opacity       another thickness, straight colour, another background
    light         brightness, channels swapped, cut off, a curve of any form
    geometry      shifted (by `registration`), flipped
    order         front and back swapped
    isolated, noise, edges, unexplained     what is told by its traits
"""

from __future__ import annotations

from texvol.comparison.kinds.kind import NAMES, Kind
from texvol.comparison.kinds.naming import kinds_of

__all__ = ["NAMES", "Kind", "kinds_of"]
