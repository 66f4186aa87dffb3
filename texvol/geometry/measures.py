"""Numbers that tell meshes apart: Euler number, content, and whether they are closed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from texvol.scene.shapes import Mesh


class Topology(NamedTuple):
    """Topology of a mesh.

    Parameters
    ----------
    euler_number : int
        Vertices - edges + triangles: 2 for each ball, 0 for a torus.
    is_closed : bool
        True if as many triangles run along each edge as against it: the mesh has an inside.
    is_manifold : bool
        True if at most one triangle runs along an edge, and one against it.
    """

    euler_number: int
    is_closed: bool
    is_manifold: bool


def topology_of(mesh: Mesh) -> Topology:
    """Return the topology of a mesh; vertices of no triangle don't count."""
    starts = mesh.triangles.reshape(-1)
    ends = np.roll(mesh.triangles, -1, axis=1).reshape(-1)
    keys = np.minimum(starts, ends) * np.int64(len(mesh.vertices)) + np.maximum(starts, ends)
    _, edges, uses = np.unique(keys, return_inverse=True, return_counts=True)
    along = np.bincount(edges, starts < ends)
    return Topology(
        len(np.unique(starts)) - len(uses) + len(mesh.triangles),
        bool((2 * along == uses).all()),
        bool(max(along.max(), (uses - along).max()) <= 1),
    )


def euler_number(mesh: Mesh) -> int:
    """Return vertices - edges + triangles: 2 for each ball, 0 for a torus."""
    return topology_of(mesh).euler_number


def enclosed_volume(mesh: Mesh) -> float:
    """Return the content of a closed mesh, cubic world units; negative if triangles are turned inwards."""
    corners = mesh.vertices[mesh.triangles] - mesh.vertices.mean(axis=0)
    return float((corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6)
