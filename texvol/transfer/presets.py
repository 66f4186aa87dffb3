"""Presets, and a transfer function for a volume of which nothing is known.

A preset's extinction is per mean edge of the volume's box, so that it looks the same on a tooth and on a thorax. The
CT presets are in Hounsfield units where the volume's range is that of such data; elsewhere, and in all other presets,
values are shares of the range that holds the matter: from where the background ends to the 99.9th percentile.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.errors import InputError
from texvol.transfer.files import relative_to, typical_samples
from texvol.transfer.function import LARGEST_VALUE, TransferFunction
from texvol.volume import Volume

Point = tuple[float, tuple[float, float, float], float]  # value, linear colour, extinction per mean edge of the box

# Each CT preset twice: in Hounsfield units, and in shares of the matter's range for rescaled or 8-bit CT.
_CT: dict[str, tuple[list[Point], list[Point]]] = {
    "ct-bone": (
        [
            (150, (0.45, 0.10, 0.04), 0),
            (250, (0.75, 0.42, 0.22), 12),
            (500, (0.90, 0.78, 0.58), 60),
            (1200, (1.00, 0.97, 0.90), 200),
        ],
        [
            (0.38, (0.45, 0.10, 0.04), 0),
            (0.48, (0.75, 0.42, 0.22), 12),
            (0.65, (0.90, 0.78, 0.58), 60),
            (1.00, (1.00, 0.97, 0.90), 200),
        ],
    ),
    "ct-soft-tissue": (
        [
            (-150, (0.60, 0.25, 0.10), 0),
            (-60, (0.75, 0.42, 0.20), 2),
            (20, (0.62, 0.16, 0.10), 8),
            (90, (0.80, 0.30, 0.20), 12),
            (200, (0.95, 0.80, 0.62), 40),
            (1000, (1.00, 0.97, 0.90), 120),
        ],
        [
            (0.05, (0.60, 0.25, 0.10), 0),
            (0.20, (0.75, 0.42, 0.20), 2),
            (0.30, (0.62, 0.16, 0.10), 8),
            (0.42, (0.80, 0.30, 0.20), 12),
            (0.60, (0.95, 0.80, 0.62), 40),
            (1.00, (1.00, 0.97, 0.90), 120),
        ],
    ),
    "ct-lung": (
        [
            (-950, (0.05, 0.10, 0.35), 0),
            (-850, (0.15, 0.35, 0.75), 1.5),
            (-650, (0.45, 0.70, 0.90), 4),
            (-450, (0.90, 0.55, 0.45), 10),
            (-300, (0.80, 0.25, 0.18), 1),
            (100, (0.60, 0.20, 0.15), 0.6),
            (300, (1.00, 0.95, 0.85), 25),
        ],
        [
            (0.02, (0.05, 0.10, 0.35), 0),
            (0.06, (0.15, 0.35, 0.75), 1.5),
            (0.14, (0.45, 0.70, 0.90), 4),
            (0.22, (0.90, 0.55, 0.45), 10),
            (0.28, (0.80, 0.25, 0.18), 1),
            (0.45, (0.60, 0.20, 0.15), 0.6),
            (0.70, (1.00, 0.95, 0.85), 25),
        ],
    ),
    # Air, fat, soft tissue and bone, each with its colour and opacity: the materials of the source's table 5-1.
    "table-5-1": (
        [
            (-500, (0.90, 0.70, 0.10), 0),
            (-150, (0.90, 0.70, 0.10), 0),
            (-120, (0.90, 0.70, 0.10), 3),
            (-40, (0.90, 0.70, 0.10), 3),
            (0, (0.75, 0.12, 0.10), 6),
            (100, (0.75, 0.12, 0.10), 6),
            (250, (1.00, 1.00, 1.00), 80),
            (2000, (1.00, 1.00, 1.00), 80),
        ],
        [
            (0.05, (0.90, 0.70, 0.10), 0),
            (0.12, (0.90, 0.70, 0.10), 3),
            (0.24, (0.90, 0.70, 0.10), 3),
            (0.30, (0.75, 0.12, 0.10), 6),
            (0.44, (0.75, 0.12, 0.10), 6),
            (0.60, (1.00, 1.00, 1.00), 80),
            (1.00, (1.00, 1.00, 1.00), 80),
        ],
    ),
}

_SHARES: dict[str, list[Point]] = {
    "mr": [
        (0.08, (0.20, 0.05, 0.04), 0),
        (0.25, (0.45, 0.16, 0.12), 4),
        (0.50, (0.80, 0.50, 0.40), 14),
        (0.75, (0.95, 0.82, 0.70), 30),
        (1.00, (1.00, 1.00, 0.95), 60),
    ],
    "grey": [(0.0, (0.0, 0.0, 0.0), 0), (1.0, (1.0, 1.0, 1.0), 20)],
    "fog": [(0.0, (0.85, 0.90, 1.0), 0), (1.0, (0.85, 0.90, 1.0), 4)],
    "solid": [
        (0.30, (0.55, 0.52, 0.48), 0),
        (0.36, (0.75, 0.72, 0.66), 300),
        (1.00, (0.95, 0.93, 0.88), 600),
    ],
}

# Perceptually even ramps, by the names that the library of colour maps knows them by.
_RAMPS = ("viridis", "inferno", "magma", "cividis")

_PROPOSAL: list[Point] = [
    (0.00, (0.25, 0.04, 0.02), 0),
    (0.30, (0.60, 0.16, 0.06), 3),
    (0.60, (0.90, 0.52, 0.22), 12),
    (1.00, (1.00, 0.95, 0.82), 50),
]

PRESETS: tuple[str, ...] = (*_CT, *_SHARES, *_RAMPS)


def preset(name: str, volume: Volume) -> TransferFunction:
    """The preset `name` in the units of `volume`.

    Raises
    ------
    InputError
        If there is no such preset; the message lists them.
    """
    if name in _CT:
        hounsfield, shares = _CT[name]
        if _is_hounsfield(volume):
            return _from_points(hounsfield, volume, lambda values: values, name)
        return _in_matter(shares, volume, name)
    if name in _SHARES:
        return _in_matter(_SHARES[name], volume, name)
    if name in _RAMPS:
        return _in_matter(_ramp(name), volume, name)
    raise InputError(f"there is no preset {name!r}; there are {', '.join(PRESETS)}")


def proposed_for(volume: Volume) -> TransferFunction:
    """A transfer function that shows something sensible of an unknown volume: its matter, denser where brighter."""
    return _in_matter(_PROPOSAL, volume, "proposed")


def matter_range(volume: Volume) -> tuple[float, float]:
    """Values between which the volume's matter lies: from where its background ends to its 99.9th percentile.

    The background is the value that most samples have, if it is near the low end and stands for at least a twentieth
    of them; without one the range starts at the 5th percentile.
    """
    samples = typical_samples(volume)
    largest = max(float(np.abs(samples).max()), 1e-300)
    low, high = _range_of_matter(samples / largest)  # values up to 1e308 have no range that float64 could hold
    return low * largest, high * largest


def _range_of_matter(samples: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.percentile(samples, (0.1, 99.9))
    if not high > low:
        low, high = samples[0], samples[-1]
    if not high > low:
        return low - 0.5, low + 0.5  # a constant volume lies in the middle of its range
    counts, edges = np.histogram(samples, bins=64, range=(low, high))
    mode = int(counts[:24].argmax())
    if counts[mode] < samples.size / 20:
        return float(np.percentile(samples, 5)), float(high)
    # The background ends where its peak has fallen to a twentieth of its height.
    beyond = np.flatnonzero(counts[mode:40] < counts[mode] / 20)
    end = mode + int(beyond[0]) if beyond.size else mode + 1
    return float(edges[end]), float(high)


def _is_hounsfield(volume: Volume) -> bool:
    """Whether the values look like Hounsfield units: air near -1000 and something denser than water."""
    low, high = volume.finite_range or (0.0, 0.0)
    return -4096 <= low <= -500 and 100 <= high <= 32767


def _in_matter(points: list[Point], volume: Volume, name: str) -> TransferFunction:
    low, high = matter_range(volume)
    return _from_points(points, volume, lambda shares: low * (1 - shares) + high * shares, name)


def _from_points(
    points: list[Point], volume: Volume, place: Callable[[NDArray], NDArray], name: str
) -> TransferFunction:
    values, colors, extinctions = (np.array(column, np.float64) for column in zip(*points, strict=True))
    placed = np.clip(place(values), -LARGEST_VALUE, LARGEST_VALUE)
    function = TransferFunction(placed, colors, extinctions, name=name)
    return relative_to(function, volume, length="box")


def _ramp(name: str) -> list[Point]:
    """A perceptual colour map, 17 points, with an extinction that grows with the square of the share."""
    from cmap import Colormap

    from texvol.image import linear_from_srgb

    shares = np.linspace(0, 1, 17)
    colors = linear_from_srgb(np.asarray(Colormap(name)(shares))[:, :3])
    return [(float(s), tuple(c), 30 * float(s) ** 2) for s, c in zip(shares, colors, strict=True)]
