"""Transfer function of fields with two signs: clear about zero, cold below and warm above.

Colours reach as far as the 99.9th percentile of the magnitudes, or less far where most of what shows is much smaller,
as currents are that are strong in a few places. Extinction is relative to the box, but where both signs take turns
along each ray it is such that the first of these layers is seen, not the mean colour of all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.noise import LEAST_NOISE, noise_of
from texvol.scene.transfer.pieces import LARGEST_VALUE
from texvol.scene.transfer.units import typical_samples
from texvol.scene.volume import Volume
from texvol.util.statistics import percentile_of_sorted

Point = tuple[float, tuple[float, float, float], float]

# In fractions of the end of the colours, linear RGB, extinction per mean edge of the box.
_COLD: list[Point] = [
    (0.06, (0.20, 0.40, 0.80), 0),
    (0.30, (0.06, 0.25, 0.80), 10),
    (1.00, (0.02, 0.06, 0.55), 60),
]
_WARM: list[Point] = [
    (0.06, (0.85, 0.40, 0.20), 0),
    (0.30, (0.85, 0.16, 0.05), 10),
    (1.00, (0.55, 0.01, 0.02), 60),
]
_CLEAR = _WARM[0][0]
_NEAR_ZERO = 0.02  # of the 99.9th percentile
_SMALL, _LOWERED = (0.03, 0.12), (0.2, 1.0)  # typical magnitude, and the end of the colours, of that percentile
_LAYERS = 4  # along a mean edge, from which on the first ones count
_OPAQUE = 1.5  # optical depth of a layer
_MOST_DENSE = 20.0  # times as dense
_LINES = 1 << 12  # that layers are counted along, of each axis


def points_of(volume: Volume) -> list[Point]:
    """Return points that are symmetric about zero: data units, linear colour, extinction per mean edge of the box."""
    magnitudes = np.minimum(np.sort(np.abs(typical_samples(volume))), LARGEST_VALUE)
    most = float(percentile_of_sorted(magnitudes, 99.9)) or 1.0
    large = magnitudes[magnitudes > _NEAR_ZERO * most] / most
    typical = float(large[large.size // 2]) if large.size else 1.0
    end = most * float(np.interp(typical, _SMALL, _LOWERED))
    dense = _density(volume, end, min(typical * most / end, 1.0))
    cold = [(-each * end, color, dense * extinction) for each, color, extinction in reversed(_COLD)]
    return [*cold, *((each * end, color, dense * extinction) for each, color, extinction in _WARM)]


def _density(volume: Volume, end: float, typical: float) -> float:
    """Return the factor of the extinction that shows the first ones of many layers of either sign."""
    layers, length = _layers(volume, end)
    if (
        layers < _LAYERS or noise_of(volume) >= LEAST_NOISE
    ):  # where it is the noise that takes turns, the structure shows through
        return 1.0
    fractions, _, extinctions = zip(*_WARM, strict=True)
    depth = length * float(np.interp(max(typical, (_CLEAR + fractions[1]) / 2), fractions, extinctions))
    return float(np.clip(_OPAQUE / depth, 1.0, _MOST_DENSE))


def _layers(volume: Volume, end: float) -> tuple[float, float]:
    """Return the mean number of layers along a mean edge of the box, and their mean length, of that edge."""
    seen = volume.overview
    edges = np.linalg.norm(seen.box_edges, axis=0)
    numbers, parts = [], []
    for axis, edge in zip(range(3), edges[::-1] / edges.mean(), strict=True):
        signs = _signs(seen.values, axis, end)
        begins = np.count_nonzero((signs[:, 1:] != signs[:, :-1]) & (signs[:, 1:] != 0))
        begins += np.count_nonzero(signs[:, 0])
        numbers.append(begins / len(signs) / float(edge))
        parts.append(float(np.count_nonzero(signs)) / signs.size)
    layers = float(np.mean(numbers))
    return layers, float(np.mean(parts)) / layers if layers else 1.0


def _signs(values: NDArray, axis: int, end: float) -> NDArray[np.int8]:
    """Return the signs of values on some lines along an axis, 0 where the colours are clear."""
    others = [count for each, count in enumerate(values.shape) if each != axis]
    step = max(int(np.sqrt(np.prod(others, dtype=float) / _LINES)), 1)
    cut = tuple(slice(None) if each == axis else slice(None, None, step) for each in range(3))
    lines = np.moveaxis(values[cut], axis, -1).reshape(-1, values.shape[axis])
    return (lines > _CLEAR * end).astype(np.int8) - (lines < -_CLEAR * end)
