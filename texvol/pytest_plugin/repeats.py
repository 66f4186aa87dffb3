"""Noise and systematic difference of a picture that was made several times, told apart.

Of N pictures p_i with mean m, held against a reference r:

    noise        σ² = Σ |p_i - m|² / (N - 1), what one picture has
    of the mean  σ / √N, what is left of it in m
    systematic   √(|m - r|² - σ² / N), what of the mean's difference no noise explains
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from texvol.comparison.pictures import Picture


@dataclass(frozen=True)
class Repeats:
    """What the repeats say; all are of linear light."""

    count: int
    noise_rms: float
    noise_max: float
    difference_rms: float  # of the mean from the reference
    systematic_rms: float

    @property
    def words(self) -> str:
        """In a sentence."""
        if self.noise_max == 0:
            return f"all {self.count} repeats are the same: whatever difference there is, is systematic"
        noise = f"the {self.count} repeats differ by rms {self.noise_rms:.2g} (at most {self.noise_max:.2g}): noise"
        # The squared noise of the mean is itself known only roughly; twice its size no noise explains.
        if self.difference_rms**2 > 2 * self.noise_rms**2 / self.count:
            return (
                f"{noise}; their mean is off by {self.difference_rms:.2g}, {self.systematic_rms:.2g} of it systematic"
            )
        return f"{noise}; their mean is off by {self.difference_rms:.2g}, no more than that explains"

    def as_json(self) -> dict[str, Any]:
        return asdict(self) | {"words": self.words}


def repeats_of(pictures: Sequence[Picture], mean: Picture, reference: Picture) -> Repeats | None:
    """What the repeats say; None where there are none, or nothing to hold them against."""
    if len(pictures) < 2 or mean.pixels.shape != reference.pixels.shape:
        return None
    middle = mean.pixels.astype(np.float64)
    off = [np.abs(each.pixels - middle) for each in pictures]
    noise = float(np.sqrt(np.sum([np.square(each).mean() for each in off]) / (len(pictures) - 1)))
    square = float(np.square(middle - reference.pixels).mean())
    return Repeats(
        len(pictures),
        noise,
        float(max(each.max() for each in off)),
        float(np.sqrt(square)),
        float(np.sqrt(max(square - noise**2 / len(pictures), 0.0))),
    )
