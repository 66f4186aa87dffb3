"""Several volumes in one scene: where they overlap, extinction adds up, and so does emission.

The first is the scene's own; each of the others has a transfer function, a grid, a position in the world and a mask
of its own. All that cuts, lights and looks is the scene's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from texvol.scene.mask import Mask
from texvol.scene.transfer import TransferFunction, preset, proposed_for
from texvol.scene.volume import Volume
from texvol.util.errors import check_type


@dataclass(frozen=True, eq=False)
class AddedVolume:
    """One more volume of a scene.

    Parameters
    ----------
    volume : Volume
        Placed by its own origin, spacing and direction; see `Volume.moved`.
    transfer_function : TransferFunction, optional
        Without one, `transfer.proposed_for(volume)`.
    mask : Mask, optional
    """

    volume: Volume
    transfer_function: TransferFunction | None = None
    mask: Mask | None = None

    def __post_init__(self) -> None:
        check_type("added volume: volume", self.volume, Volume)
        if isinstance(self.transfer_function, str):
            object.__setattr__(self, "transfer_function", preset(self.transfer_function, self.volume))
        if self.transfer_function is not None:
            check_type("added volume: transfer_function", self.transfer_function, TransferFunction)
        if self.mask is not None:
            check_type("added volume: mask", self.mask, Mask)
            self.mask.check_fits(self.volume)

    @property
    def medium(self) -> TransferFunction:
        """Transfer function of the volume, or the one that is proposed for it."""
        return self.transfer_function or proposed_for(self.volume)


def common_box(volumes: Sequence[Volume]) -> Volume:
    """A volume of one sample: the smallest box that holds all, with axes and unit of the first one; of one, itself."""
    first = volumes[0]
    if len(volumes) == 1:
        return first
    axes = first.direction / np.linalg.norm(first.direction, axis=0)
    corners = np.concatenate([each.corners_from_centre + (each.centre - first.centre) for each in volumes])
    positions = np.linalg.solve(axes, corners.T)
    low, high = positions.min(axis=1), positions.max(axis=1)
    middle = first.centre + axes @ (low / 2 + high / 2)
    return Volume(np.zeros((1, 1, 1)), high - low, middle, axes, unit=first.unit, space=first.space, name=first.name)
