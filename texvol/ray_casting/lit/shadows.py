"""Transmittance of each light at the nodes of a box: exact, of the post-classified medium.

A ray from a node towards a light is traced like the ray of a pixel. Only what lies in front of a light inside the box
counts: the optical depth of all behind the node, less the optical depth of all behind the light; or, if that is too
large for a difference, the same from the light's side.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace

import numpy as np

from texvol.ray_casting.common.medium import OPAQUE_DEPTH
from texvol.ray_casting.common.rays import Numbers
from texvol.scene.lighting import Light, Lighting, shadow_nodes, unit
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume

# Optical depths of rays from world origins in unit directions, both of shape (rows, columns, 3).
Depths = Callable[[Numbers, Numbers], Numbers]
NO_LIGHTS = np.ones((0, 1, 1, 1))  # transmittance where no light casts shadows


def transmittance_at_nodes(lighting: Lighting, volume: Volume, depths: Depths) -> Numbers:
    """Return the transmittance of each casting light at the nodes of a volume's box, shape (lights, z, y, x).

    The nodes are those of `texvol.scene.lighting.shadow_nodes`; `depths` is of all that casts shadows.
    """
    x, y, z = (((np.arange(count) + 0.5) / count) - 0.5 for count in shadow_nodes(volume))
    fractions = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).transpose(2, 1, 0, 3)
    positions = (fractions @ volume.box_edges.T + volume.centre).reshape(-1, len(x), 3)
    transmittance = [np.exp(-_depth_to(light, volume, positions, depths)) for light in lighting.casting]
    return np.stack(transmittance).reshape(len(transmittance), len(z), len(y), len(x))


def casting_scene(scene: CompleteScene) -> CompleteScene:
    """Return the scene whose optical depths cast the shadows of `scene`: unlit, post-classified, without colours."""
    added = tuple(replace(each, volume=_without_colors(each.volume)) for each in scene.added)
    first = replace(scene, volume=_without_colors(scene.volume), added=added, geometry=())
    return replace(first, lighting=None, depth_cue=None, classification="post")


def _without_colors(volume: Volume) -> Volume:
    if volume.colors is None:
        return volume
    other = copy(volume)
    other.colors = None
    return other


def _depth_to(light: Light, volume: Volume, positions: Numbers, depths: Depths) -> Numbers:
    """Return the optical depth between positions and a light."""
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
