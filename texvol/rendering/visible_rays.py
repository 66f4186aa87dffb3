"""Rays of a picture, and the part of each on which a scene may show."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import CompleteScene
from texvol.textures.halving import ends_in_box

Numbers = NDArray[np.float64]


class VisibleRays(NamedTuple):
    """Rays from their points that are nearest to the middle of the volume.

    `nearest` has these points relative to the middle, `directions` unit vectors, both of shape (n, 3); `first` and
    `last` are where the box, within all cuts and before the eye, begins and ends, world units from the points. What is
    empty ends before it begins.
    """

    nearest: Numbers
    directions: Numbers
    first: Numbers
    last: Numbers


def visible_rays(scene: CompleteScene, eyes: Numbers, directions: Numbers) -> VisibleRays:
    """Return rays from their eyes, both arrays of shape (n, 3)."""
    from_centre = eyes - scene.volume.centre
    eye = (from_centre * directions).sum(axis=-1)
    nearest = from_centre - eye[:, np.newaxis] * directions
    first, last = scene.cutting.interval(scene.volume, nearest, directions)
    enters, leaves = ends_in_box(scene.volume, nearest, directions).T
    return VisibleRays(nearest, directions, np.maximum(np.maximum(first, eye), enters), np.minimum(last, leaves))
