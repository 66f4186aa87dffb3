"""Exact shadows of the oracle: in a closed form, at a jump, at samples, and where no ray sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.scenes import random_volume

from texvol import Camera, Scene, TransferFunction, Volume, raycast
from texvol.ray_casting.lit.panels import TOLERANCE, panels_along
from texvol.scene.added_volume import AddedVolume
from texvol.scene.lighting import Light, Lighting, shadow_distance

TAU = 0.2
FOG = TransferFunction([0.0], [(1.0, 0.5, 0.25)], [TAU])
BOX = Volume(np.ones((5, 6, 8), np.uint8), (1.0, 1.3, 0.7), (3.0, -2.0, 5.0))
LIGHTS = {
    "directional": Light("directional", (1.0, -2.0, 1.5)),
    "point": Light("point", tuple(BOX.centre + (9.0, 4.0, 7.0))),  # type: ignore[arg-type]
}


def transmittance(light: Light, positions: np.ndarray) -> np.ndarray:
    """In fog, of positions (n, 3) moved by the bias: e to the minus the length in the box times the extinction."""
    vector = np.array(light.vector)
    towards = np.broadcast_to(vector, positions.shape) if light.kind == "directional" else vector - positions
    towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    moved = positions + shadow_distance(BOX) * towards
    low, high = BOX.box_corner, BOX.box_corner + np.diag(BOX.box_edges)
    faces = np.sort(np.stack([(low - moved) / towards, (high - moved) / towards]), axis=0)
    enters, leaves = np.maximum(faces[0].max(axis=1), 0.0), faces[1].min(axis=1)
    return np.exp(-TAU * np.maximum(leaves - enters, 0.0))


@pytest.mark.parametrize("light", LIGHTS.values(), ids=list(LIGHTS))
@pytest.mark.parametrize("added", [False, True], ids=["alone", "with an empty volume"])
def test_a_pixel_of_fog_is_the_integral_of_its_shadows(light: Light, added: bool) -> None:
    lighting = Lighting((light,), ambient=0.1, diffuse=0.8, specular=0.0, shadows=True)
    camera = Camera.orthographic(tuple(BOX.centre + (0, 0, 20)), tuple(BOX.centre), (0, 1, 0), 5.0)  # type: ignore[arg-type]
    scene = Scene(BOX, FOG, camera, classification="post", lighting=lighting)
    if added:  # which is drawn by other functions
        empty = Volume(np.zeros((2, 2, 2), np.uint8), (0.5, 0.5, 0.5), tuple(BOX.centre))  # type: ignore[arg-type]
        scene = replace(scene, added=(AddedVolume(empty, TransferFunction([0.0], [(0, 0, 0)], [0.0])),))
    size = (3, 3)
    depth = BOX.box_edges[2, 2]
    nodes, weights = np.polynomial.legendre.leggauss(16)
    # As many pieces as there may be kinks: where the ray to the light leaves through another face.
    s = ((np.arange(2000)[:, np.newaxis] + (1 + nodes) / 2) / 2000 * depth).reshape(-1)
    weights = np.tile(weights / 2 * depth / 2000, 2000)
    found = raycast(scene, size)
    eyes, _ = scene.completed(size).camera.rays(size)
    for row in range(3):
        for column in range(3):
            at = np.stack([*np.broadcast_arrays(*eyes[row, column, :2], BOX.centre[2] + depth / 2 - s)], axis=1)
            light_there = 0.1 + 0.8 * transmittance(light, at)
            expected = (weights * TAU * np.exp(-TAU * s) * light_there).sum()
            assert found[row, column, 0] == pytest.approx(expected, abs=TOLERANCE)


@pytest.mark.parametrize("classification", ["post", "slab"])
def test_more_nodes_come_nearer(classification: str) -> None:
    """Also where samples are lit, and the shadow is found at them."""
    volume = random_volume(5, (7, 6, 5))
    medium = TransferFunction([0.3, 1.0], [(0.8, 0.8, 0.8)] * 2, [0.0, 0.5])
    lighting = Lighting((Light("directional", (1.0, -2.0, 1.5)), LIGHTS["point"]), shadows=True)
    scene = Scene(volume, medium, Camera.framing(volume), classification=classification, lighting=lighting)  # type: ignore[arg-type]
    exact = raycast(scene, (10, 8))
    coarse, fine = (np.abs(raycast(scene, (10, 8), shadow_nodes=nodes) - exact).max() for nodes in (8, 64))
    assert fine <= coarse / 6 <= 0.01  # order 1: the outermost nodes are within the box, and count up to its faces
    unlit = raycast(replace(scene, lighting=replace(lighting, shadows=False)), (10, 8))
    assert np.abs(unlit - exact).max() > 0.02


def test_panels_are_halved_at_a_jump_and_not_where_nothing_shows() -> None:
    def view(ray: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Fog of extinction 0.5 from s = 2 on."""
        depth = 0.5 * np.maximum(ends[:, 1] - np.maximum(ends[:, 0], 2.0), 0.0)
        return np.column_stack([np.zeros((len(ray), 3)), depth])

    panels = panels_along(
        np.array([[0.0, 8.0], [1.0, -1.0]]), 1.0, 1.0, view, lambda ray, s: (s > np.pi)[:, np.newaxis].astype(float)
    )
    assert list(zip(panels.first, panels.end, strict=True)) == [(0, len(panels.rows)), (len(panels.rows),) * 2]
    first, last, low, _, high = panels.rows.T
    assert np.array_equal(first[1:], last[:-1])
    assert np.array_equal(first[last <= 2], [0, 1])
    assert np.array_equal(first[first >= 4], np.arange(4, 8, 0.5))  # looked at once
    beside = (low != high).nonzero()[0]
    assert len(beside) == 1 and (last - first)[beside[0]] <= 8 * TOLERANCE
