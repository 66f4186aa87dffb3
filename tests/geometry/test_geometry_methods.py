"""Methods of surfaces: order of the distance, content, Euler number, closedness and sides, on every kind of grid."""

from __future__ import annotations

from itertools import combinations
from typing import get_args

import numpy as np
import pytest
from support.surfaces import GRIDS, ball, facets, in_cube, on_grid, rms_distance, torus, two_balls

from texvol import InputError, Volume
from texvol.geometry import Mesh, enclosed_volume, euler_number, surface_of
from texvol.geometry.extraction import METHODS, MeshMethod, SurfaceMethod, ambiguous_cell_count
from texvol.geometry.measures import topology_of

MESHES: tuple[MeshMethod, ...] = get_args(MeshMethod)
MARCHING: tuple[MeshMethod, ...] = ("marching-cubes", "marching-tetrahedra")


@pytest.mark.parametrize("method", MESHES)
@pytest.mark.parametrize("grid", GRIDS)
def test_a_ball_on_any_grid_is_closed_and_faces_outward(grid: str, method: MeshMethod) -> None:
    radius = 7.0
    volume = on_grid(ball(radius), GRIDS[grid])
    mesh = surface_of(volume, 0.0, method)
    assert topology_of(mesh) == (2, True, True)
    # Along an edge, of a cell or across its face, the distance is off by h² / 8 R; the corner of a box is half a cell
    # from a sample, and that one at most a step from the surface; a cone's apex is less than a step off.
    sides = volume.world_from_index.T
    across = max(np.linalg.norm(a + sign * b) for a, b in combinations(sides, 2) for sign in (-1, 1))
    distances = np.linalg.norm(mesh.vertices - volume.centre, axis=1) - radius
    assert np.abs(distances).max() < (across**2 / 8 / radius if method in MARCHING else 0.75 * across)
    corners, normals = facets(mesh)
    if method in MARCHING:
        assert (normals * (corners.mean(axis=1) - volume.centre)).sum(axis=1).min() > 0
        assert mesh.normals is not None
        assert (mesh.normals * (mesh.vertices - volume.centre)).sum(axis=1).min() > 0.99 * distances.min() + 0.99 * 7
    # The content of facets within a sphere is short of it by less than 6 %: a sagitta of 0.05 and caps, of 7.
    assert 0.94 < enclosed_volume(mesh) / (4 / 3 * np.pi * radius**3) < 1.02


@pytest.mark.parametrize(
    ("method", "least", "most"),
    [
        # Linear along edges, flat between them: curvature × h² / 8.
        *(("marching-cubes", 1.9, 2.1), ("marching-tetrahedra", 1.9, 2.1)),
        # Faces stand half a voxel off.
        ("cuberille", 0.85, 1.15),
        # As marching cubes between slices; but cones at both ends, off by h / 4 on an area of order h.
        ("contours", 1.3, 1.9),
    ],
)
def test_the_distance_falls_in_its_order(method: MeshMethod, least: float, most: float) -> None:
    distances = [rms_distance(surface_of(in_cube(ball(0.7), count), 0.0, method), ball(0.7)) for count in (12, 24)]
    assert least < np.log2(distances[0] / distances[1]) < most


@pytest.mark.parametrize("method", MESHES)
@pytest.mark.parametrize("axis", [0, 2])
def test_a_torus_has_a_hole(axis: int, method: MeshMethod) -> None:
    mesh = surface_of(in_cube(torus(0.6, 0.25, axis), 20), 0.0, method)
    assert topology_of(mesh) == (0, True, True)
    # Facets: sagitta h² / 8 of the tube, 2 % of its radius, twice. Contours end in a ridge, flat to both sides.
    content = enclosed_volume(mesh) / (2 * np.pi**2 * 0.6 * 0.25**2)
    assert (0.86 if method == "contours" else 0.94) < content < (1.04 if method == "cuberille" else 1.0)


@pytest.mark.parametrize("method", MESHES)
def test_balls_are_two_where_they_are_apart_and_one_where_they_overlap(method: MeshMethod) -> None:
    """At ±0.1 two balls that touch are apart by 0.2, or overlap in a lens as wide as 0.6; a cell's diagonal is 0.17."""
    volume = in_cube(two_balls(0.45), 20)
    assert topology_of(surface_of(volume, 0.1, method))[:2] == (4, True)
    assert topology_of(surface_of(volume, -0.1, method))[:2] == (2, True)
    assert topology_of(surface_of(volume, 0.0, method)).is_closed


@pytest.mark.parametrize("method", MESHES)
def test_noise_is_closed(method: MeshMethod) -> None:
    """White noise has every case of a cell; ended by a layer below, its surface is closed by every method."""
    values = np.pad(np.random.default_rng(7).random((8, 9, 7)), 1)
    found = topology_of(surface_of(Volume(values, (1, 2, 3)), 0.5, method))
    assert found.is_closed
    # Boxes that touch along an edge share it, and so may strips to one vertex.
    assert found.is_manifold == (method in MARCHING)
    if method == "marching-cubes":
        return  # scikit-image drops triangles without area, and with them what is closed
    # Many samples have the value itself.
    steps = np.pad(np.random.default_rng(7).integers(0, 3, (7, 8, 9)), 1).astype("u1")
    mesh = surface_of(Volume(steps), 1.0, method)
    assert topology_of(mesh).is_closed and np.linalg.norm(facets(mesh)[1], axis=1).min() > 0


@pytest.mark.parametrize("method", MESHES)
def test_a_surface_goes_on_through_the_outer_half_spacings(method: MeshMethod) -> None:
    """A slope of 1 per sample along an axis: the plane at 4.25, or the faces at 4.5, over the whole box."""
    for axis in range(3):
        shape = [5, 6, 7]
        shape[2 - axis] = 12
        ramp = np.arange(12.0).reshape([12 if each == 2 - axis else 1 for each in range(3)])
        mesh = surface_of(Volume(np.broadcast_to(ramp, shape)), 4.25, method)
        across = [each for each in range(3) if each != axis]
        lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        counts = np.array(shape[::-1])
        np.testing.assert_array_equal(lower[across], -0.5)
        np.testing.assert_array_equal(upper[across], counts[across] - 0.5)
        _, normals = facets(mesh)
        if method == "contours":  # closed on the box; along z it begins with a pyramid from slice 5 to 4.25
            length = 11.5 - 5 + 0.75 / 3 if axis == 2 else 11.5 - 4.25
            assert enclosed_volume(mesh) == pytest.approx(length * counts[across].prod())
            continue
        np.testing.assert_allclose(mesh.vertices[:, axis], 4.5 if method == "cuberille" else 4.25, atol=1e-6)
        assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(counts[across].prod())
        assert normals[:, axis].max() < 0


def test_a_surface_is_open_at_the_box_only() -> None:
    """Marching tetrahedra of noise: edges of one triangle lie on the faces of the box."""
    values = np.random.default_rng(3).random((6, 5, 7))
    mesh = surface_of(Volume(values), 0.5, "marching-tetrahedra")
    starts, ends = mesh.triangles.reshape(-1), np.roll(mesh.triangles, -1, axis=1).reshape(-1)
    directed = set(zip(starts.tolist(), ends.tolist(), strict=True))
    alone = np.array([edge for edge in directed if edge[::-1] not in directed])
    on_box = (mesh.vertices[alone] == -0.5) | (mesh.vertices[alone] == np.array([7, 5, 6]) - 0.5)
    assert len(alone) > 10 and on_box.all(axis=1).any(axis=1).all()


def test_cuberille_encloses_the_voxels_above() -> None:
    """The content is that of the boxes, exactly; an edge of two boxes alone is in four triangles."""
    values = np.pad(np.random.default_rng(5).random((6, 7, 8)), 1)
    for direction in GRIDS.values():
        volume = Volume(values, (1, 2, 0.5), (3, 4, 5), direction)
        one = abs(np.linalg.det(volume.world_from_index))
        assert enclosed_volume(surface_of(volume, 0.6, "cuberille")) == pytest.approx((values > 0.6).sum() * one)
    pair = np.zeros((3, 4, 4))
    pair[1, 1, 1] = pair[1, 2, 2] = 1
    touching = surface_of(Volume(pair), 0.5, "cuberille")
    assert topology_of(touching) == (14 - (2 * 18 - 1) + 24, True, False)


def test_tetrahedra_are_inside_cells_without_missing_samples() -> None:
    values = np.broadcast_to(np.arange(12.0), (8, 9, 12)).copy()
    values[4, 3, 6] = np.nan
    areas = {
        each: np.linalg.norm(facets(surface_of(Volume(values), 5.5, each))[1], axis=1).sum() / 2 for each in MESHES[:3]
    }
    # 72 faces in all; four cells have the sample as a corner there, but it is in one face between voxels.
    assert areas == pytest.approx({"marching-cubes": 68, "marching-tetrahedra": 68, "cuberille": 71})
    with pytest.raises(InputError, match="^v: method contours needs all samples, and some are missing"):
        surface_of(Volume(values, name="v"), 5.5, "contours")


def test_samples_of_far_values_keep_their_digits() -> None:
    values = np.broadcast_to(1e8 + np.arange(12), (5, 6, 12))
    mesh = surface_of(Volume(values), 1e8 + 4.25, "marching-tetrahedra")
    np.testing.assert_allclose(mesh.vertices[:, 0], 4.25, atol=1e-6)


def test_the_orientation_of_contours_is_that_of_their_regions() -> None:
    """A box with a closed hollow: two surfaces, of which the inner one faces the hollow."""
    values = np.zeros((9, 9, 9))
    values[1:8, 1:8, 1:8] = 1
    values[3:6, 3:6, 3:6] = 0
    for method in MESHES:
        mesh = surface_of(Volume(values), 0.5, method)
        assert euler_number(mesh) == 4
        # Other methods cut edges off the outer box, and the hollow; contours begin and end with pyramids of 7 × 7 / 6.
        assert 0.9 * (7**3 - 3**3) < enclosed_volume(mesh) <= 7**3 - 3**3


def test_a_branch_of_contours_is_one_surface() -> None:
    """A letter Y of two boxes on one: two contours above one, joined by a bridge; upside down as well."""
    values = np.zeros((9, 7, 11))
    values[1:5, 2:5, 1:10] = values[4:8, 2:5, 1:4] = values[4:8, 2:5, 7:10] = 1
    for upside in (values, values[::-1]):
        mesh = surface_of(Volume(upside), 0.5, "contours")
        found = topology_of(mesh)
        assert (found.euler_number, found.is_closed) == (2, True)
        # Ends of 27, 9 and 9 voxels are cones, short of a third of a voxel each; corners are cut by an eighth.
        assert enclosed_volume(mesh) == pytest.approx(values.sum() - 45 / 3 - 4 * (4 + 8) / 8, rel=0.03)


@pytest.mark.parametrize("method", METHODS)
def test_infinite_samples_and_single_layers_have_surfaces(method: SurfaceMethod) -> None:
    values = np.zeros((5, 5, 5))
    values[2, 2, 2] = np.inf
    found = surface_of(Volume(values), 0.5, method)
    places = found.vertices if isinstance(found, Mesh) else found.points
    # Up to the neighbours; a box goes half as far, and points are in the middle of parts of a half.
    assert np.abs(places - 2).max() == pytest.approx(
        {"cuberille": 0.5, "dividing-cubes": 0.75}.get(method, 1), abs=1e-5
    )
    layer = surface_of(Volume(np.arange(12.0).reshape(1, 3, 4)), 5.6, method)
    heights = (layer.vertices if isinstance(layer, Mesh) else layer.points)[:, 2]
    assert heights.min() == -heights.max() and heights.max() == (0.375 if method == "dividing-cubes" else 0.5)
    assert ambiguous_cell_count(Volume(np.arange(12.0).reshape(1, 3, 4)), 5.6) == 0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("value", "words"), [(2.0, "they go from 0 to 1"), (np.nan, "finite"), (1.0, "single samples")]
)
def test_a_value_that_is_not_met_is_refused(value: float, words: str, method: str) -> None:
    values = np.zeros((4, 4, 4))
    values[2, 2, 2] = 1
    with pytest.raises(InputError, match=f"^v: .*{words}"):
        surface_of(Volume(values, name="v"), value, method)  # type: ignore[call-overload]


def test_unknown_methods_and_sizes_of_others_are_refused() -> None:
    volume = in_cube(ball(0.7), 8)
    with pytest.raises(InputError, match=r"^method must be one of marching-cubes, .*contours.*, got 'cubes'"):
        surface_of(volume, 0.0, "cubes")  # type: ignore[call-overload]
    with pytest.raises(InputError, match="^cell_size is for method dividing-cubes only, got method cuberille"):
        surface_of(volume, 0.0, "cuberille", cell_size=1.0)  # type: ignore[call-overload]
