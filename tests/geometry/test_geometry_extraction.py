"""Isosurfaces as meshes: where they lie, which way they face, and that they have no holes but where the field ends."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support.scenes import constant, smooth_volume
from support.surfaces import GRIDS, facets, on_grid

from texvol import Camera, InputError, Renderer, Scene, Volume
from texvol.geometry import Mesh, surface_of
from texvol.ray_casting.projection import isosurface_depth
from texvol.ray_casting.surfaces.layers import surface_layers


def open_edges(mesh: Mesh) -> np.ndarray:
    """Edges (n, 2) of one triangle only; every other has two, which go along it either way."""
    edges = Counter((int(a), int(b)) for t in mesh.triangles for a, b in zip(t, np.roll(t, -1), strict=True))
    assert max(edges.values()) == 1
    return np.array([edge for edge in edges if edge[::-1] not in edges], np.int64).reshape(-1, 2)


@pytest.mark.parametrize("grid", GRIDS)
def test_a_ball_lies_where_it_is_and_faces_outward(grid: str) -> None:
    """Distance is linear but for its curve: between samples 1.2 apart its corners are off by 1.2² / 8 R at most."""
    radius = 7.0
    volume = on_grid(lambda p: radius - np.linalg.norm(p, axis=-1), GRIDS[grid])
    mesh = surface_of(volume, 0.0)
    positions = mesh.vertices - volume.centre
    # Steps of a sheared grid are longer than its spacing: 1.2 times the length of the longest column.
    step = np.linalg.norm(volume.world_from_index, axis=0).max()
    assert np.abs(np.linalg.norm(positions, axis=1) - radius).max() < step**2 / 8 / radius
    corners, normals = facets(mesh)
    assert (normals * (corners.mean(axis=1) - volume.centre)).sum(axis=1).min() > 0, "counter-clockwise from outside"
    assert mesh.normals is not None
    cosines = (mesh.normals * positions).sum(axis=1) / np.linalg.norm(positions, axis=1)
    assert cosines.min() > 0.995
    assert not len(open_edges(mesh))
    edges = len(mesh.triangles) * 3 / 2
    assert len(mesh.vertices) - edges + len(mesh.triangles) == 2, "Euler: a ball"
    # The sphere's content, short of at most a shell as thick as a facet's sagitta.
    content = (corners[:, 0] - volume.centre) * normals
    assert 0.95 < content.sum() / 6 / (4 / 3 * np.pi * radius**3) < 1


def test_the_side_of_lower_values_is_outside() -> None:
    volume = on_grid(lambda p: np.linalg.norm(p, axis=-1), np.eye(3))
    mesh = surface_of(volume, 7.0)
    corners, normals = facets(mesh)
    assert (normals * (corners.mean(axis=1) - volume.centre)).sum(axis=1).max() < 0, "the hollow is lower"
    assert mesh.normals is not None and (mesh.normals * (mesh.vertices - volume.centre)).sum(axis=1).max() < 0


def test_topology_of_noise_is_closed() -> None:
    """White noise has every case of a cube, ambiguous ones too; ended by a layer below it, the surface is closed."""
    values = np.pad(np.random.default_rng(7).random((14, 13, 12)), 1)
    mesh = surface_of(Volume(values), 0.5)
    assert not len(open_edges(mesh)) and len(mesh.triangles) > 5000
    # Integers that are met exactly leave no triangle without area behind.
    steps = surface_of(Volume(np.pad(np.random.default_rng(7).integers(0, 3, (9, 9, 9)), 1).astype("u1")), 1.0)
    assert np.linalg.norm(facets(steps)[1], axis=1).min() > 0


@pytest.mark.parametrize("dtype", ["u1", "i2", "f4", "f8"])
def test_values_keep_their_digits(dtype: str) -> None:
    """A slope of 1 per sample on an offset that float32 would round by 8 samples, where the type has room for it."""
    offset = {"u1": 3, "i2": 20000, "f4": 1000, "f8": 1e8}[dtype]
    values = np.broadcast_to((offset + np.arange(12)).astype(dtype), (5, 6, 12))
    mesh = surface_of(Volume(values), offset + 4.25)
    np.testing.assert_allclose(mesh.vertices[:, 0], 4.25, atol=1e-6)
    # Through the outer half spacings, up to the box.
    np.testing.assert_array_equal(mesh.vertices[:, 1:].min(axis=0), (-0.5, -0.5))
    np.testing.assert_array_equal(mesh.vertices[:, 1:].max(axis=0), (5.5, 4.5))
    assert np.linalg.norm(facets(mesh)[1], axis=1).sum() / 2 == pytest.approx(6 * 5)


def test_a_volume_of_one_layer_has_a_surface() -> None:
    mesh = surface_of(Volume(np.arange(12.0).reshape(1, 3, 4)), 5.5)
    assert mesh.vertices[:, 2].min() == -0.5 and mesh.vertices[:, 2].max() == 0.5


def test_missing_samples_leave_a_hole_of_their_cells() -> None:
    values = np.broadcast_to(np.arange(12.0), (8, 9, 12)).copy()
    whole = surface_of(Volume(values), 5.5)
    values[4, 3, 6] = np.nan
    mesh = surface_of(Volume(values), 5.5)
    assert np.isfinite(mesh.vertices).all() and mesh.normals is not None and np.isfinite(mesh.normals).all()
    areas = [np.linalg.norm(facets(each)[1], axis=1).sum() / 2 for each in (whole, mesh)]
    assert areas[0] == pytest.approx(72) and areas[1] == pytest.approx(68), "four cells have it as a corner there"
    middle = facets(mesh)[0].mean(axis=1)
    assert not ((np.abs(middle[:, 1] - 3) < 1) & (np.abs(middle[:, 2] - 4) < 1)).any()
    with pytest.raises(InputError, match="all are missing"):
        surface_of(Volume(np.full((3, 3, 3), np.nan), name="v"), 0.0)


@pytest.mark.parametrize("infinite", [np.inf, -np.inf])
def test_infinite_samples_push_the_surface_to_the_finite_ones(infinite: float) -> None:
    values = np.zeros((9, 9, 9))
    values[4, 4, 4] = infinite
    mesh = surface_of(Volume(values), np.copysign(0.5, infinite))
    assert np.isfinite(mesh.vertices).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices - 4, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (2.0, "no value is 2: they go from 0 to 1"),
        (-0.1, "no value is -0.1: they go from 0 to 1"),
        (np.nan, "must be finite, got nan"),
        (np.inf, "must be finite, got inf"),
    ],
)
def test_a_value_that_is_not_met_is_refused(value: float, words: str) -> None:
    values = np.zeros((4, 4, 4))
    values[2, 2, 2] = 1
    with pytest.raises(InputError, match=f"^v.nrrd: .*{words}"):
        surface_of(Volume(values, name="v.nrrd"), value)


def test_a_value_met_at_single_samples_is_refused() -> None:
    with pytest.raises(InputError, match="^v.nrrd: no surface, since only single samples are 3"):
        surface_of(Volume(np.full((4, 4, 4), 3.0), name="v.nrrd"), 3.0)


def test_it_is_the_surface_that_the_mode_shows(renderer: Renderer) -> None:
    """The mesh has its corners on the surface, and between them is flat where that bends: by c h² / 8 for curvatures c.

    In samples, the waves' curvatures are less than (2 π / 12)² / 2, so that facets are at most 0.02 samples off; seen
    at an angle more, in a hundredth of the pixels at a cosine under 0.2.
    """
    volume = smooth_volume(48)
    camera = Camera.framing(volume, "perspective", eye=volume.centre + volume.radius * np.array([1.5, -2.0, 1.2]))
    mesh, size = surface_of(volume, 0.6), (72, 64)
    scene = Scene(volume, None, camera, mode="isosurface", isovalue=0.6, classification="slab")
    of_mode = isosurface_depth(scene, size)
    [first, *_] = surface_layers(replace(scene, geometry=(mesh,)).completed(size), size, lambda array: array)
    eyes, edges = camera.rays(size)
    of_mesh = (first.s - ((eyes - volume.centre) * edges).sum(axis=-1)) * (edges @ camera.forward)
    both = np.isfinite(of_mode) & np.isfinite(of_mesh)
    assert (np.isfinite(of_mode) == np.isfinite(of_mesh)).mean() > 0.995 and both.mean() > 0.2
    assert np.quantile(np.abs(of_mode - of_mesh)[both], 0.99) < 0.02 / 0.2
    picture = renderer.render(Scene(volume, constant(0.0), camera, geometry=(mesh,), classification="slab"), size)
    assert ((picture[..., 3] == 1) == np.isfinite(of_mesh)).all()
