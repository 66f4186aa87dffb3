"""Range slider with two handles: which handles a drag takes, and where it moves them."""

from __future__ import annotations

from dataclasses import dataclass

Ends = tuple[float, float]

_MIDDLE = 1 / 3  # fraction of a narrow range that drags the range as a whole


@dataclass(frozen=True)
class Hold:
    """Drag of a range or of one of its ends.

    Attributes
    ----------
    ends : (low, high)
        Ends of the range at the start of the drag.
    at : float
        Position at the start of the drag.
    low, high : bool
        True for each end that the drag moves.
    """

    ends: Ends
    at: float
    low: bool
    high: bool

    @classmethod
    def taken(cls, ends: Ends, at: float, reach: float) -> Hold:
        """Start a drag: of a handle within reach, of the whole range between the handles, else of the nearer handle."""
        low, high = ends
        within = min(reach, (high - low) * (1 - _MIDDLE) / 2)
        if low + within < at < high - within:
            return cls(ends, at, True, True)
        is_low = at - low < high - at
        handle = low if is_low else high
        return cls(ends, at if abs(at - handle) <= reach else handle, is_low, not is_low)

    def moved(self, at: float, bounds: Ends, least: float) -> Ends:
        """Return the ends with the mouse at `at`: within the bounds, and at least `least` apart.

        Ends that were outside the bounds, or closer, may stay so. A range that is dragged as a whole keeps its width.
        """
        low, high = self.ends
        lowest, highest = min(bounds[0], low), max(bounds[1], high)
        by = min(max(at - self.at, lowest - low), highest - high) if self.low and self.high else at - self.at
        if self.low and self.high:
            return low + by, high + by
        least = min(least, high - low)
        if self.low:
            return min(max(low + by, lowest), high - least), high
        return low, max(min(high + by, highest), low + least)
