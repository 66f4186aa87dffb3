"""Classification and compositing that the ray casters share: a value, then a sample of some length behind a pixel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.methods.compiling import part
from texvol.scene.transfer import TransferFunction

# Below this optical depth, (1 - e^-x) / x is 1 to float64's digits, and 0 / 0 is not computed.
_THIN = 1e-16
_ROUNDING = 1e-9  # of a step: a path of 8 steps and an ulp is not cut into 9


class Table(NamedTuple):
    """Points of a transfer function, as numbers that compiled code takes."""

    values: NDArray[np.float64]  # (n)
    numbers: NDArray[np.float64]  # colour or emission, and extinction, (n, 4)
    associated: bool  # True if emission is colour times extinction


def table_of(medium: TransferFunction) -> Table:
    """Return the points of a transfer function that depends on the value alone, none opaque."""
    return Table(medium.values, medium.numbers, not (medium.emissive or medium.premultiplied))


@part
def steps_in(path, distance):
    """Return the number of equal steps, none longer than `distance`, that a path is cut into; at least 1."""
    return max(math.ceil(path / distance - _ROUNDING), 1)


@part
def classify(value, table, sample):
    """Write emission and extinction of a value to `sample`, as `TransferFunction.classify` defines them."""
    after = np.searchsorted(table.values, value, side="right")
    low, high = max(after - 1, 0), min(after, table.values.size - 1)
    width = table.values[high] - table.values[low]
    weight = (value - table.values[low]) / width if width > 0 else 0.0
    for channel in range(4):
        sample[channel] = table.numbers[low, channel] * (1 - weight) + table.numbers[high, channel] * weight
    if table.associated:
        for channel in range(3):
            sample[channel] *= sample[3]


@part
def add_behind(pixel, transmittance, sample, length):
    """Add a constant medium of some length behind what a pixel holds; return the transmittance of both.

    Its emission is seen as ∫ e^(-τ s) ds = (1 - e^(-τ L)) / τ.
    """
    depth = sample[3] * length
    opacity = -math.expm1(-depth)
    seen = transmittance * (length if depth < _THIN else opacity / sample[3])
    for channel in range(3):
        pixel[channel] += seen * sample[channel]
    pixel[3] += transmittance * opacity
    return transmittance * (1 - opacity)
