"""Transmittance of each light in the medium: exact, or exact at the nodes of a box and trilinear between them.

A ray towards a light is traced like the ray of a pixel, through the post-classified medium. Only what lies in front of
a light inside the box counts: the optical depth of all behind a position, less the optical depth of all behind the
light; or, if that is too large for a difference, the same from the light's side.

Media that are classified before interpolation are lit at their samples: there the transmittance is found, so that the
samples are the nodes. Other media are lit where the ray of a pixel is integrated, see `panels`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.medium import OPAQUE_DEPTH
from texvol.ray_casting.common.rays import Numbers, Rays, Trace, middle_of, over_rows, rays_in, rays_of, transformed
from texvol.ray_casting.lit.panels import Panels, panels_along
from texvol.scene.lighting import Light, Lighting, casts_shadows, shadow_distance, shadow_nodes, unit
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume

# Optical depths of rays from world origins in unit directions, both of shape (n, 3).
Depths = Callable[[Numbers, Numbers], Numbers]
BY_NODES = -1  # column of a volume whose transmittance is between nodes


class LightField(NamedTuple):
    """Transmittance of the lights that cast shadows, in one volume."""

    nodes: Numbers  # transmittance in the middles of equal parts of the box, shape (lights, z, y, x)
    distance: float  # towards the light at which that is looked up, in world units
    column: int  # first of the volume's columns in `panels`, or BY_NODES


class Shadows(NamedTuple):
    """Transmittance of the lights that cast shadows, in all volumes of a scene."""

    fields: Sequence[LightField]
    along: Callable[[Rays], Panels] | None  # along rays, if a volume's is in panels


_NONE = np.ones((0, 1, 1, 1))


def shadows_in(scene: CompleteScene, most_nodes: int | None, tracer_of: Callable[[CompleteScene], Trace]) -> Shadows:
    """Return the shadows of a scene; each volume casts shadows on all.

    Parameters
    ----------
    most_nodes : int, optional
        Nodes along the longest edge of a box; shadows are exact without it.
    tracer_of : callable
        Returns the function that traces rays of a scene.
    """
    lighting = scene.lighting
    if lighting is None or not casts_shadows(lighting):
        return Shadows([LightField(_NONE, 0.0, BY_NODES) for _ in scene.volumes], None)
    depths = _depths(scene, tracer_of)
    if most_nodes is not None:
        return Shadows([at_nodes(lighting, volume, _in_threads(depths), most_nodes) for volume in scene.volumes], None)
    fields: list[LightField] = []
    receiving: list[Volume] = []
    for alone in scene.each_alone():
        if _is_lit_at_samples(alone):
            fields.append(at_samples(lighting, alone, _in_threads(depths)))
        else:
            fields.append(LightField(_NONE, 0.0, len(receiving) * len(lighting.casting)))
            receiving.append(alone.volume)
    if not receiving:
        return Shadows(fields, None)
    trace = tracer_of(replace(scene, lighting=None, depth_cue=None, geometry=()))
    return Shadows(fields, lambda rays: _along(scene, lighting, receiving, depths, trace, rays))


def _along(
    scene: CompleteScene,
    lighting: Lighting,
    receiving: Sequence[Volume],
    depths: Depths,
    trace: Trace,
    rays: Rays,
) -> Panels:
    """Return the transmittance for positions on rays in some volumes; `trace` is of the scene without light."""
    flat = Rays(*(each.reshape(-1, *each.shape[2:]) for each in rays))
    from_centre = transformed(flat.start - middle_of(scene.volume), scene.volume.world_from_index)
    nearest = from_centre + scene.volume.centre

    def view(ray: NDArray[np.int64], ends: Numbers) -> Numbers:
        picture = np.zeros((len(ray), 1, 4))
        trace(Rays(*(each[ray][:, np.newaxis] for each in flat))._replace(ends=ends[:, np.newaxis]), picture)
        return picture[:, 0]

    def transmittance(ray: NDArray[np.int64], s: Numbers) -> Numbers:
        positions = nearest[ray] + s[:, np.newaxis] * flat.direction[ray]
        columns = [
            transmittance_at(light, biased(light, volume, positions), depths)
            for volume in receiving
            for light in lighting.casting
        ]
        return np.stack(columns, axis=-1)

    spans = _in_boxes(scene, from_centre, flat)
    panels = panels_along(spans, scene.smallest_spacing, lighting.brightest, view, transmittance)
    return panels._replace(first=panels.first.reshape(rays.eye.shape), end=panels.end.reshape(rays.eye.shape))


def _in_boxes(scene: CompleteScene, from_centre: Numbers, rays: Rays) -> Numbers:
    """Return the first and last s of rays in any box, shape (n, 2); the first is larger where there are none."""
    low, high = np.full(len(from_centre), np.inf), np.full(len(from_centre), -np.inf)
    for volume in scene.volumes:
        start, step = rays_in(volume, scene.volume, from_centre, rays.direction)
        with np.errstate(divide="ignore", invalid="ignore"):
            faces = np.stack([(-0.5 - start) / step, (np.array(volume.dimensions) - 0.5 - start) / step])
        enters = np.nan_to_num(faces.min(axis=0), nan=-np.inf).max(axis=-1)
        leaves = np.nan_to_num(faces.max(axis=0), nan=np.inf).min(axis=-1)
        met = enters < leaves
        low, high = np.where(met, np.minimum(low, enters), low), np.where(met, np.maximum(high, leaves), high)
    return np.stack([np.maximum(low, rays.ends[:, 0]), np.minimum(high, rays.ends[:, 1])], axis=-1)


def _depths(scene: CompleteScene, tracer_of: Callable[[CompleteScene], Trace]) -> Depths:
    """Return the function that finds optical depths in all that casts shadows."""
    casting = casting_scene(scene)
    trace = tracer_of(casting)

    def depths(origins: Numbers, directions: Numbers) -> Numbers:
        picture, directions = np.zeros((len(origins), 1, 4)), np.ascontiguousarray(directions)
        trace(rays_of(casting, origins[:, np.newaxis], directions[:, np.newaxis]), picture)
        return picture[:, 0, 3]

    return depths


def _in_threads(depths: Depths) -> Depths:
    """Return a function that does the same in threads."""

    def of_all(origins: Numbers, directions: Numbers) -> Numbers:
        found = np.zeros(len(origins))

        def find(rows: slice) -> None:
            found[rows] = depths(origins[rows], directions[rows])

        over_rows(find, (len(origins), 1))
        return found

    return of_all


def _is_lit_at_samples(alone: CompleteScene) -> bool:
    """True if samples are classified and lit before interpolation."""
    before = alone.classification in ("slab", "extinction") or alone.volume.colors is not None
    return before and not alone.volume.nearest


def at_nodes(lighting: Lighting, volume: Volume, depths: Depths, most: int) -> LightField:
    """Return the transmittance at the nodes of a volume's box, see `texvol.scene.lighting.shadow_nodes`.

    `depths` is of all that casts shadows, `most` the number of nodes along the longest edge.
    """
    counts = shadow_nodes(volume, most)
    positions = _middles(volume, counts)
    transmittance = [transmittance_at(light, positions, depths) for light in lighting.casting]
    return LightField(np.stack(transmittance).reshape(-1, *counts[::-1]), shadow_distance(volume), BY_NODES)


def at_samples(lighting: Lighting, alone: CompleteScene, depths: Depths) -> LightField:
    """Return the transmittance for the samples of a scene of one volume, those that show nothing left out."""
    volume = alone.volume
    shown = _shown(alone)
    positions = _middles(volume, volume.dimensions)[shown.reshape(-1)]
    nodes = np.ones((len(lighting.casting), *shown.shape))
    for light, each in zip(lighting.casting, nodes, strict=True):
        each[shown] = transmittance_at(light, biased(light, volume, positions), depths)
    return LightField(nodes, 0.0, BY_NODES)


def biased(light: Light, volume: Volume, positions: Numbers) -> Numbers:
    """Return the positions at which the transmittance counts for positions in a volume, both (n, 3) in the world."""
    return positions + shadow_distance(volume) * _toward(light, positions)


def transmittance_at(light: Light, positions: Numbers, depths: Depths) -> Numbers:
    """Return the transmittance between positions in the world, shape (n, 3), and a light."""
    return np.exp(-_depth_to(light, positions, depths))


def casting_scene(scene: CompleteScene) -> CompleteScene:
    """Return the scene whose optical depths cast the shadows of `scene`: unlit, post-classified, without colours."""
    added = tuple(replace(each, volume=_without_colors(each.volume)) for each in scene.added)
    first = replace(scene, volume=_without_colors(scene.volume), added=added, geometry=())
    return replace(first, lighting=None, depth_cue=None, classification="post")


def _middles(volume: Volume, counts: tuple[int, int, int]) -> Numbers:
    """Return the positions in the world of the middles of equal parts of a box, in the order z, y, x, shape (n, 3)."""
    x, y, z = (((np.arange(count) + 0.5) / count) - 0.5 for count in counts)
    fractions = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).transpose(2, 1, 0, 3)
    return np.asarray((fractions @ volume.box_edges.T + volume.centre).reshape(-1, 3))


def _shown(alone: CompleteScene) -> NDArray[np.bool_]:
    """Return True for the samples that show anything, shape (z, y, x)."""
    medium, values = alone.medium, alone.volume.values
    if medium.graded or medium.contours:
        return np.ones(values.shape, np.bool_)
    emission, extinction = medium.classify(values.astype(np.float64, copy=False))
    return np.asarray((extinction > 0) | (emission > 0).any(axis=-1))


def _without_colors(volume: Volume) -> Volume:
    if volume.colors is None:
        return volume
    other = copy(volume)
    other.colors = None
    return other


def _toward(light: Light, positions: Numbers) -> Numbers:
    """Return the unit vectors from positions to a light; at a point light, any."""
    assert light.vector is not None
    if light.kind == "directional":
        return np.broadcast_to(unit(light.vector), positions.shape)
    to_light = np.array(light.vector, np.float64) - positions
    away = np.linalg.norm(to_light, axis=-1, keepdims=True)
    return np.where(away > 0, to_light / np.where(away > 0, away, 1.0), (1.0, 0.0, 0.0))


def _depth_to(light: Light, positions: Numbers, depths: Depths) -> Numbers:
    """Return the optical depth between positions and a light."""
    direction = _toward(light, positions)
    if light.kind == "directional":
        return depths(positions, direction)
    here = np.broadcast_to(np.array(light.vector, np.float64), positions.shape)
    forth, back = depths(positions, direction), depths(here, -direction)
    with np.errstate(invalid="ignore"):
        forth = np.where(forth < OPAQUE_DEPTH, forth - depths(here, direction), np.inf)
        back = np.where(back < OPAQUE_DEPTH, back - depths(positions, -direction), np.inf)
    return np.maximum(np.minimum(forth, back), 0.0)
