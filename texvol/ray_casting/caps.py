"""Caps: where a clip plane or crop box cuts a medium open, the cut is an opaque surface of the medium's colour.

The colour of a cap is the colour of an interval too short for the medium to change, divided by its opacity; where
several volumes overlap it is the colour of their sum.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from texvol.ray_casting.common.rays import Numbers, Rays, middle_of, rays_in
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

_SHORT = 2.0**-26  # length in smallest spacings: half of float64's digits are left for the optical depth


def thin_ends(scene: Scene, rays: Rays) -> Numbers:
    """Return the ends (…, 2) of a short interval behind each cut; empty where a ray begins at a box or the eye."""
    first, last = rays.ends[..., 0], rays.ends[..., 1]
    is_cut_open = np.zeros(first.shape, np.bool_)
    for volume, start, step in _rays_of_volumes(scene, rays):
        low, high = np.full(3, -0.5), np.array(volume.dimensions) - 0.5
        with np.errstate(divide="ignore", invalid="ignore"):
            faces = np.stack([(low - start) / step, (high - start) / step])
        enters = np.nan_to_num(faces.min(axis=0), nan=-np.inf).max(axis=-1)
        leaves = np.nan_to_num(faces.max(axis=0), nan=np.inf).min(axis=-1)
        is_cut_open |= (first > np.maximum(enters, rays.eye)) & (first < leaves)
    short = _SHORT * scene.smallest_spacing
    return np.stack([first, np.where(is_cut_open, np.minimum(first + short, last), -np.inf)], axis=-1)


def _rays_of_volumes(scene: Scene, rays: Rays) -> Iterator[tuple[Volume, Numbers, Numbers]]:
    """Yield each volume with starts and steps of rays in its index space."""
    first = scene.volume
    yield first, rays.start, rays.step
    if scene.added:
        to_world = first.world_from_index.T
        nearest, directions = (rays.start - middle_of(first)) @ to_world, rays.step @ to_world
        for each in scene.added:
            yield each.volume, *rays_in(each.volume, first, nearest, directions)


def caps_within(thin: Numbers, interval: Numbers) -> Numbers:
    """Return those intervals of `thin_ends` that begin in an interval of the ray, the others empty."""
    first, last = thin[..., 0], thin[..., 1]
    begins = (first >= interval[..., 0]) & (first < interval[..., 1])
    return np.stack([first, np.where(begins, last, -np.inf)], axis=-1)


def put_in_front(caps: Numbers, picture: Numbers) -> None:
    """Put opaque caps into a picture; both hold light and, in the last channel, optical depth."""
    met = caps[..., 3] > 0
    picture[met, :3] = caps[met, :3] / -np.expm1(-caps[met, 3:])
    picture[met, 3] = np.inf
