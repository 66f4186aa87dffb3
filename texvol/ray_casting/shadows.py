"""What is left of each light at the nodes of the box: transmittances of the post-classified matter, exact.

A ray from a node towards a light is a ray of a picture like any other, and its optical depth is found by the same walk.
Of a light inside the box only what lies in front of it counts: the depth of all behind the node, less that of all
behind the light; or, where that is too deep to be told apart, the same from the light's side.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.medium import OPAQUE_DEPTH
from texvol.scene.lighting import Light, shadow_nodes, unit
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]
Depths = Callable[[Numbers, Numbers], Numbers]  # of rays: world origins and unit directions, (rows, columns, 3)


def light_transmittance_at_nodes(
    scene: Scene, transfer: TransferFunction | None, volume: Volume | None = None
) -> Numbers:
    """Share of each casting light, shape (lights, z, y, x), see `texvol.scene.lighting`; nothing where none casts.

    `transfer` is that of the first of the scene's volumes. The nodes are those of one of them, the first unless told;
    all of them cast shadows on it.
    """
    volume, lighting = volume or scene.volume, scene.lighting
    if lighting is None or not lighting.shadows or not lighting.casting:
        return np.ones((0, 1, 1, 1))
    x, y, z = (((np.arange(count) + 0.5) / count) - 0.5 for count in shadow_nodes(volume))
    fractions = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).transpose(2, 1, 0, 3)
    positions = (fractions @ volume.box_edges.T + volume.centre).reshape(-1, len(x), 3)
    depths = _depths_of(_casting(scene, transfer))
    light_transmittance = [np.exp(-_depth_to(light, volume, positions, depths)) for light in lighting.casting]
    return np.stack(light_transmittance).reshape(len(light_transmittance), len(z), len(y), len(x))


def _casting(scene: Scene, transfer: TransferFunction | None) -> Scene:
    """All that casts shadows: by value, whatever its colours."""
    added = tuple(replace(each, volume=_without_colors(each.volume)) for each in scene.added)
    first = replace(scene, volume=_without_colors(scene.volume), transfer_function=transfer, added=added, geometry=())
    return replace(first, lighting=None, depth_cue=None, classification="post")


def _without_colors(volume: Volume) -> Volume:
    if volume.colors is None:
        return volume
    other = copy(volume)
    other.colors = None
    return other


def _depth_to(light: Light, volume: Volume, positions: Numbers, depths: Depths) -> Numbers:
    """Optical depth between places and a light."""
    assert light.vector is not None
    if light.kind == "directional":
        return depths(positions, np.broadcast_to(unit(light.vector), positions.shape))
    here = np.broadcast_to(np.array(light.vector, np.float64), positions.shape)
    away = np.linalg.norm(here - positions, axis=-1, keepdims=True)
    direction = np.where(away > 0, (here - positions) / np.where(away > 0, away, 1.0), (1.0, 0.0, 0.0))
    forth, back = depths(positions, direction), depths(here, -direction)
    with np.errstate(invalid="ignore"):
        forth = np.where(forth < OPAQUE_DEPTH, forth - depths(here, direction), np.inf)
        back = np.where(back < OPAQUE_DEPTH, back - depths(positions, -direction), np.inf)
    return np.maximum(np.minimum(forth, back), 0.0)


def _depths_of(scene: Scene) -> Depths:
    from texvol.ray_casting.raycast import _tracer_for, rays_of

    complete = scene.completed((1, 1))
    trace = _tracer_for(complete, complete.camera)

    def depths(origins: Numbers, directions: Numbers) -> Numbers:
        picture = np.zeros((*origins.shape[:2], 4))
        starts, steps, eyes, ends = rays_of(scene, origins, directions)
        trace(starts, steps, ends, eyes, np.ascontiguousarray(directions), picture)
        return picture[..., 3]

    return depths
