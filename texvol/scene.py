"""A Scene is what is to be drawn, as data: no picture size, no accuracy, no device."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from texvol.camera import Camera
from texvol.errors import InputError
from texvol.transfer import TransferFunction
from texvol.volume import Volume

Classification = Literal["slab", "extinction", "post", "integrated"]
CLASSIFICATIONS: tuple[str, ...] = get_args(Classification)


@dataclass(frozen=True)
class Scene:
    """A volume, its transfer function, a camera, a background and where the transfer function is applied.

    Parameters
    ----------
    volume : Volume
    transfer_function : TransferFunction, optional
        Without one, `transfer.proposed_for(volume)`.
    camera : Camera, optional
        Without one, the whole box is framed.
    background : (r, g, b)
        Linear light that enters each ray from behind, as (1 - opacity) times itself.
    classification : "slab", "extinction", "post" or "integrated"
        What the 3D texture holds, see `slab_texture`; the oracle integrates the pre-classified medium for the first
        two, the post-classified one for the others.
    """

    volume: Volume
    transfer_function: TransferFunction | None = None
    camera: Camera | None = None
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    classification: Classification = "slab"

    def __post_init__(self) -> None:
        if not isinstance(self.volume, Volume):
            raise InputError(f"scene: a Volume is wanted, and {type(self.volume).__name__} came")
        background = np.asarray(self.background)
        if background.shape != (3,) or background.dtype.kind not in "iuf" or not (background >= 0).all():
            raise InputError(f"scene: background is three numbers from 0 upwards, and is {self.background!r}")
        if self.classification not in CLASSIFICATIONS:
            wanted = ", ".join(CLASSIFICATIONS)
            raise InputError(f"scene: classification is one of {wanted}, and not {self.classification!r}")

    def camera_for(self, size: tuple[int, int]) -> Camera:
        """The scene's camera, or the one that frames the box in a picture of (width, height) pixels."""
        return self.camera or Camera.framing(self.volume, aspect=size[0] / size[1])


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """(width, height) as whole numbers of at least 1, or InputError."""
    try:
        width, height = (operator.index(side) for side in size)
    except (TypeError, ValueError):
        raise InputError(f"size is (width, height) in whole pixels, and is {size!r}") from None
    if min(width, height) < 1:
        raise InputError(f"size {width}x{height}: a picture has at least one pixel along each side")
    return width, height
