"""Caps: where a half space cuts matter open, the eye meets its colour, opaque.

That is the colour of a stretch of the ray that is too short for its matter to change, divided by its opacity; of
several volumes the mixture of all matter there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common_positions import middle_of, rays_in
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]
_SHORT = 2.0**-26  # of the smallest spacing: half of float64's digits are left for what it holds


def thin_ends(scene: Scene, starts: Numbers, steps: Numbers, ends: Numbers, eyes: Numbers) -> Numbers:
    """The ends of the stretch behind each cut, as `rays_of` has them; none where a ray begins at a box or the eye."""
    first, last = ends[..., 0], ends[..., 1]
    is_cut_open = np.zeros(first.shape, np.bool_)
    for volume, start, step in _rays(scene, starts, steps):
        low, high = np.full(3, -0.5), np.array(volume.dimensions) - 0.5
        with np.errstate(divide="ignore", invalid="ignore"):
            faces = np.stack([(low - start) / step, (high - start) / step])
        enters = np.nan_to_num(faces.min(axis=0), nan=-np.inf).max(axis=-1)
        leaves = np.nan_to_num(faces.max(axis=0), nan=np.inf).min(axis=-1)
        is_cut_open |= (first > np.maximum(enters, eyes)) & (first < leaves)
    short = _SHORT * scene.smallest_spacing
    return np.stack([first, np.where(is_cut_open, np.minimum(first + short, last), -np.inf)], axis=-1)


def _rays(scene: Scene, starts: Numbers, steps: Numbers) -> Iterator[tuple[Volume, Numbers, Numbers]]:
    """Starts and steps of rays in the index space of each volume."""
    first = scene.volume
    yield first, starts, steps
    if scene.added:
        to_world = first.world_from_index.T
        nearest, directions = (starts - middle_of(first)) @ to_world, steps @ to_world
        for each in scene.added:
            yield each.volume, *rays_in(each.volume, first, nearest, directions)


def caps_within(thin: Numbers, interval: Numbers) -> Numbers:
    """Those of `thin_ends` that begin in a stretch of the ray, between its ends."""
    first, last = thin[..., 0], thin[..., 1]
    begins = (first >= interval[..., 0]) & (first < interval[..., 1])
    return np.stack([first, np.where(begins, last, -np.inf)], axis=-1)


def put_in_front(caps: Numbers, picture: Numbers) -> None:
    """Replace what lies behind caps; both hold light and, in the last channel, optical depth."""
    met = caps[..., 3] > 0
    picture[met, :3] = caps[met, :3] / -np.expm1(-caps[met, 3:])
    picture[met, 3] = np.inf
