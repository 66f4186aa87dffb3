"""Noise and systematic difference of a picture that was made several times.

For N pictures p_i with mean m, compared with a reference r:

    noise        σ² = Σ |p_i - m|² / (N - 1), of one picture
    of the mean  σ / √N, the noise of m
    systematic   √(|m - r|² - σ² / N - σᵣ² / Nᵣ), the part of the mean's difference that noise does not explain

A reference that is itself a mean of Nᵣ pictures with noise σᵣ has both numbers in its header.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from texvol.comparison.pictures import Picture
from texvol.util.text_files import parsed_json

ATTRIBUTE = "texvol:repeats"


@dataclass(frozen=True)
class Repeats:
    """Noise and difference of the repeats, in linear light."""

    count: int
    noise_rms: float
    noise_max: float
    difference_rms: float  # of the mean and the reference
    expected_rms: float  # difference that the noise of both explains
    systematic_rms: float

    @property
    def words(self) -> str:
        """The numbers in a sentence."""
        if self.noise_max == 0:
            return f"all {self.count} repeats are the same: any difference is systematic"
        noise = f"the {self.count} repeats differ by rms {self.noise_rms:.2g} (at most {self.noise_max:.2g}): noise"
        # The squared noise of the mean is a rough estimate; noise does not explain twice its size.
        if self.difference_rms**2 > 2 * self.expected_rms**2:
            return (
                f"{noise}; their mean is off by {self.difference_rms:.2g}, {self.systematic_rms:.2g} of it systematic"
            )
        return f"{noise}; their mean is off by {self.difference_rms:.2g}, which the noise explains"


def repeats_of(pictures: Sequence[Picture], mean: Picture, reference: Picture) -> Repeats | None:
    """Return the numbers of the repeats; None without repeats, or without a reference of the same size."""
    if len(pictures) < 2 or mean.pixels.shape != reference.pixels.shape:
        return None
    middle = mean.pixels.astype(np.float64)
    noise = noise_of(pictures, mean)
    square = float(np.square(middle - reference.pixels).mean())
    expected = noise**2 / len(pictures) + _noise_of_mean(reference) ** 2
    return Repeats(
        len(pictures),
        noise,
        float(max(np.abs(each.pixels - middle).max() for each in pictures)),
        float(np.sqrt(square)),
        float(np.sqrt(expected)),
        float(np.sqrt(max(square - expected, 0.0))),
    )


def noise_of(pictures: Sequence[Picture], mean: Picture) -> float:
    """Return σ, the rms noise of one picture, from at least two."""
    middle = mean.pixels.astype(np.float64)
    squares = [np.square(each.pixels - middle).mean() for each in pictures]
    return float(np.sqrt(np.sum(squares) / (len(pictures) - 1)))


def header_of(pictures: Sequence[Picture], mean: Picture) -> dict[str, str]:
    """Return the header's attribute on the pictures of a mean."""
    return {ATTRIBUTE: json.dumps({"count": len(pictures), "noise": noise_of(pictures, mean)})}


def _noise_of_mean(reference: Picture) -> float:
    """Return the noise of a reference that is a mean; 0 if the header names none."""
    try:
        found = parsed_json(reference.attributes.get(ATTRIBUTE, ""), "the noise")
        return float(found["noise"]) / float(found["count"]) ** 0.5
    except (ValueError, TypeError, KeyError, OverflowError, ZeroDivisionError):
        return 0.0
