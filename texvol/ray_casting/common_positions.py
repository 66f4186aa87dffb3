"""Places that several volumes have in common: world units, relative to the centre of the first of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]


def middle_of(volume: Volume) -> Numbers:
    """Index of the centre of the volume."""
    return (np.array(volume.dimensions) - 1) / 2


def centre_from(first: Volume, volume: Volume) -> Numbers:
    """The centre of a volume relative to that of the first.

    Not the difference of where these are in the world: far from its origin that would keep few digits.
    """
    own, other = (each.world_from_index @ middle_of(each) for each in (volume, first))
    return (volume.origin - first.origin) + (own - other)


def rays_in(volume: Volume, first: Volume, nearest: Numbers, directions: Numbers) -> tuple[Numbers, Numbers]:
    """Starts and steps, in the index space of a volume, of rays `nearest` + s `directions`."""
    to_index = volume.index_from_world.T
    return (nearest - centre_from(first, volume)) @ to_index + middle_of(volume), directions @ to_index
