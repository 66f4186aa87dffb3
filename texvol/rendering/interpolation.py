"""Choice of what interpolates texels, where the driver's weights have few digits.

Graphics cards interpolate textures with weights of 8 bits behind the binary point. A sample is then off by up to 1/512
of the difference of its neighbours along each axis, and thinner slabs don't help. The shader can fetch the eight texels
and interpolate them in float32, which costs more. It is not asked for unless an error is asked for, and then

- always below `ALWAYS_BELOW`, where the weights alone may be all of the error, and of volumes in stores;
- else where two small pictures, one by each, differ by more than a fraction of the error; less is taken off it.

The driver is measured, see `texvol.opengl.filtering`; its name says nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from texvol.rendering.error_control import DrawScene, Size, smaller
from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene

ALWAYS_BELOW = 1e-3
_MOST = 1 / 4  # of the error, that is left to the weights
_MARGIN = 2.0  # a small picture has a sixteenth of the pixels


def settled_interpolation(
    scene: CompleteScene, size: Size, settings: Settings, max_error: float, draw: DrawScene, finest: str | None
) -> tuple[Settings, float]:
    """Return the settings that keep an error, and what the weights leave of it to the slabs.

    `draw` draws the scene by its settings; `finest` is None where the driver's weights have digits enough.
    """
    if finest is None:
        return settings, max_error
    precise = replace(settings, interpolation=finest)
    if max_error < ALWAYS_BELOW or isinstance(scene.volume, LargeVolume):  # of which nothing is read to find out
        return precise, max_error
    small, thickness = smaller(size), scene.smallest_spacing
    by_driver, by_shader = (draw(scene, small, replace(each, slab_thickness=thickness)) for each in (settings, precise))
    off = _MARGIN * float(np.abs(by_driver - by_shader).max(initial=0.0))
    return (precise, max_error) if off > _MOST * max_error else (settings, max_error - off)
