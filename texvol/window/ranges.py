"""A range with two handles on a track: which of its ends a hand takes, and where they go with it."""

from __future__ import annotations

from dataclasses import dataclass

Ends = tuple[float, float]

_MIDDLE = 1 / 3  # of a narrow range is for dragging it as a whole


@dataclass(frozen=True)
class Hold:
    """A hand at a range.

    Attributes
    ----------
    ends : (low, high)
        As they were when it was taken.
    at : float
        Where it was taken.
    low, high : bool
        Which ends go along.
    """

    ends: Ends
    at: float
    low: bool
    high: bool

    @classmethod
    def taken(cls, ends: Ends, at: float, reach: float) -> Hold:
        """A handle where one is within reach; between them both, and beside the range the nearer one, which comes."""
        low, high = ends
        within = min(reach, (high - low) * (1 - _MIDDLE) / 2)
        if low + within < at < high - within:
            return cls(ends, at, True, True)
        is_low = at - low < high - at
        handle = low if is_low else high
        return cls(ends, at if abs(at - handle) <= reach else handle, is_low, not is_low)

    def moved(self, at: float, bounds: Ends, least: float) -> Ends:
        """The ends with the hand elsewhere, no farther than the bounds, or than they were, and so far from each other.

        A range that is moved as a whole stays as wide as it is.
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
