"""Objects that are dark before a bright background, as in transmitted light and in negatives of X-ray images.

What is to be seen of them are their low values, so they are taken for what they are with the values mirrored.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.scene.distances import samples_of_sides
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.units import medium_range, typical_samples
from texvol.scene.volume import Volume

_AT_THE_ENDS = 0.9  # least fraction of the samples of the box's sides that are background
_LEAST_OBJECT = 0.002  # fraction of the samples that are not
_LOOKED_AT = 1 << 24  # samples


def mirrored(volume: Volume) -> Volume | None:
    """Return a volume of some samples with high and low values exchanged; None if there is no bright background.

    A value v becomes the sum of `ends_of(volume)` less v.
    """
    seen = volume.overview
    both = sum(ends_of(volume))
    if seen.values.ndim != 3 or volume.colors is not None or not np.isfinite(both):
        return None
    samples = typical_samples(volume)
    far = samples.size // 1000
    low, high = float(samples[far]), float(samples[-1 - far])
    sides = samples_of_sides(seen.values).astype(np.float64)
    # Nearly every volume that is no such thing ends here.
    if not high > low or np.mean(sides > low / 2 + high / 2) < _AT_THE_ENDS:
        return None
    every = max(int(np.ceil((seen.values.size / _LOOKED_AT) ** (1 / 3))), 1)
    with np.errstate(over="ignore"):  # beyond what is typical there may be anything
        values = both - seen.values[::every, ::every, ::every].astype(np.float64)
    found = Volume(values, seen.spacing * every, direction=seen.direction, space=volume.space, name=volume.name)
    edge = medium_range(found)[0]
    is_background = np.mean(both - sides <= edge) >= _AT_THE_ENDS
    return found if is_background and np.mean(values > edge) >= _LEAST_OBJECT else None


def ends_of(volume: Volume) -> tuple[float, float]:
    """Return the least and the largest typical value, which `mirrored` exchanges."""
    samples = typical_samples(volume)
    return float(samples[0]), float(samples[-1])


def as_seen(medium: TransferFunction, volume: Volume) -> TransferFunction:
    """Return a transfer function for `mirrored(volume)` as one for the volume itself."""
    parts = medium.colors[::-1], medium.extinctions[::-1]
    values: NDArray[np.float64] = sum(ends_of(volume)) - medium.values[::-1]
    return replace(medium, values=values, colors=parts[0], extinctions=parts[1])
