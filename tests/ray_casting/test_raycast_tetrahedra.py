"""The exact ray caster of tetrahedra, against closed forms and against `raycast` of fine regular grids."""

from __future__ import annotations

from math import exp
from pathlib import Path

import numpy as np
import pytest
from support.mesh_files import HEXAHEDRON, delaunay, hexahedra, unstructured, written

from texvol import (
    Camera,
    InputError,
    Scene,
    TetrahedralGrid,
    TransferFunction,
    Volume,
    load,
    load_tetrahedra,
    raycast,
    raycast_tetrahedra,
)
from texvol.formats.readers.splitting import split

SIZE = (24, 20)
# Closed forms are met to the rounding of some hundred segments.
_ROUNDING = 1e-12
INSIDE = Camera.orthographic((0.5, 0.5, -3), (0.5, 0.5, 0.5), (0, 1, 0), height=0.7)  # all rays meet the cube


def along_z(count: int = 150) -> TetrahedralGrid:
    """The unit cube, its value z."""
    points, cells = delaunay(count)
    return TetrahedralGrid(points, cells, points[:, 2].copy())


def test_linear_emission_and_constant_extinction() -> None:
    """Of the colour z at the extinction k: ∫ k z e^(-k z) dz from 0 to 1 is (1 - (1 + k) e^-k) / k."""
    k = 2.0
    picture = raycast_tetrahedra(along_z(), TransferFunction([0, 1], [[1, 0, 0], [0, 1, 0]], [k, k]), INSIDE, SIZE)
    green = (1 - (1 + k) * exp(-k)) / k
    np.testing.assert_allclose(picture[..., 1], green, rtol=0, atol=_ROUNDING)
    np.testing.assert_allclose(picture[..., 0], 1 - exp(-k) - green, rtol=0, atol=_ROUNDING)
    np.testing.assert_allclose(picture[..., 3], 1 - exp(-k), rtol=0, atol=_ROUNDING)


@pytest.mark.parametrize("background", [0.0, 0.5])
def test_linear_extinction(background: float) -> None:
    """τ = 3 z is an optical depth of 3/2, and white shows its opacity."""
    transfer = TransferFunction([0, 1], [[1, 1, 1], [1, 1, 1]], [0.0, 3.0])
    picture = raycast_tetrahedra(along_z(), transfer, INSIDE, SIZE, background=(background,) * 3)
    np.testing.assert_allclose(picture[..., 3], 1 - exp(-1.5), rtol=0, atol=_ROUNDING)
    wanted = 1 - exp(-1.5) + exp(-1.5) * background
    np.testing.assert_allclose(picture[..., :3], wanted, rtol=0, atol=_ROUNDING)


def test_a_tent_of_the_transfer_function() -> None:
    """Opacity of a tent from 0.3 over 0.4 to 0.6 of height 5: 1 - exp(-5 · 0.3 / 2), cut out of every cell it is in."""
    transfer = TransferFunction([0.3, 0.4, 0.6], [[0, 0, 0], [1, 1, 1], [0, 0, 0]], [0.0, 5.0, 0.0])
    picture = raycast_tetrahedra(along_z(), transfer, INSIDE, SIZE)
    np.testing.assert_allclose(picture[..., 3], 1 - exp(-0.75), rtol=0, atol=_ROUNDING)


def test_the_value_of_each_cell_is_its_own() -> None:
    """Two halves of a block, of extinctions 1 and 2, and an empty layer between their two cells."""
    points, cells = hexahedra((1, 1, 3), seed=3)
    tetrahedra, source = split("hexahedron", cells[[0, 2]])
    grid = TetrahedralGrid(points, tetrahedra, np.array([1.0, 2.0])[source], per_cell=True)
    transfer = TransferFunction([1, 2], [[1, 0, 0], [0, 1, 0]], [1.0, 2.0])
    picture = raycast_tetrahedra(grid, transfer, INSIDE, SIZE)
    np.testing.assert_allclose(picture[..., 0], 1 - exp(-1), rtol=0, atol=_ROUNDING)
    np.testing.assert_allclose(picture[..., 1], exp(-1) * (1 - exp(-2)), rtol=0, atol=_ROUNDING)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("eye", [(3.0, -2.0, 1.7), (0.5, 0.5, -3.0), (0.45, 0.4, 0.3)])
def test_a_linear_field_is_that_of_a_regular_grid(projection: str, eye: tuple[float, float, float]) -> None:
    """From outside, along an axis, and from within. Trilinear samples of a linear field are the field, and `raycast`
    is exact to 1e-9; its box must be that of the cube, where the samples at the border are repeated."""
    points, cells = delaunay(80)
    field = np.array([0.5, 0.3, -0.6])
    grid = TetrahedralGrid(points * 1.5 - 0.25, cells, (points * 1.5 - 0.25) @ field)
    z, y, x = np.meshgrid(*(np.linspace(-0.25, 1.25, 4),) * 3, indexing="ij")
    volume = Volume(np.stack([x, y, z], axis=-1) @ field, spacing=(0.5,) * 3, origin=(-0.25,) * 3)
    transfer = TransferFunction([-0.3, 0.1, 0.5], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [1.0, 6.0, 2.0])
    camera = Camera(projection, eye, (0.5, 0.5, 0.5), (0, 0.3, 1), height=2.5)
    whole = Scene(volume, transfer, camera, classification="post", crop=((-0.25, 1.25),) * 3)
    ours, theirs = raycast_tetrahedra(grid, transfer, camera, SIZE), raycast(whole, SIZE)
    assert theirs[..., 3].max() > 0.5
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=2e-9)


def test_resampled_grids_come_nearer_as_they_get_finer(tmp_path: Path) -> None:
    """The file resampled and drawn by `raycast`, at spacings of 1/16, 1/32, 1/64: kinks at the faces of the tetrahedra
    make an error of order 1 where they are, in a part of the volume that is of order 1 too."""
    points, cells = hexahedra((3, 3, 3), seed=1)
    inside = ((points > 0) & (points < 3)).all(axis=1)
    points[inside] += np.random.default_rng(0).uniform(-0.2, 0.2, (int(inside.sum()), 3))
    points /= 3
    path = written(tmp_path / "v.vtu", unstructured(points, [(HEXAHEDRON, cells)], np.sin(6 * points).sum(axis=1)))
    transfer = TransferFunction([-1, 0, 2], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0.0, 2.0, 4.0])
    camera = Camera.perspective((3, -2, 1.7), (0.5, 0.5, 0.5), (0, 0, 1), fov=30)
    exact = raycast_tetrahedra(load_tetrahedra(path), transfer, camera, SIZE)
    errors = []
    for count in (17, 33, 65):
        volume = load(path, resolution=(count,) * 3)
        scene = Scene(volume, transfer, camera, classification="post", crop=((0, 1),) * 3)
        errors.append(np.sqrt(((raycast(scene, SIZE) - exact) ** 2).mean()))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1).all(), (errors, orders)
    assert errors[-1] < 1e-3


def test_rays_in_faces_and_along_edges_meet_each_cell_once() -> None:
    """A block of cubes seen along its axes and its diagonal, by rays through its points: without care, rays in a face
    meet none of the cells or both."""
    points, cells = hexahedra((4, 4, 4))
    grid = TetrahedralGrid(points, split("hexahedron", cells)[0], np.ones(len(points)))
    transfer = TransferFunction([0], [[1, 1, 1]], [0.25])
    for away in ([0, 0, -9], [0, 9, 0], [-9, 0, 0]):
        camera = Camera.orthographic(np.add(2, away), (2, 2, 2), (1, 1, 1), height=3.0)
        for size in ((3, 3), (6, 6), (7, 7)):
            picture = raycast_tetrahedra(grid, transfer, camera, size)
            inside = np.abs(np.array(camera.rays(size)[0]) - camera.eye).max(axis=-1) < 2
            np.testing.assert_allclose(picture[inside, 3], 1 - exp(-1), rtol=0, atol=1e-9)
    camera = Camera.orthographic((-9, -9, -9), (2, 2, 2), (0, 0, 1), height=0.2)
    np.testing.assert_allclose(
        raycast_tetrahedra(grid, transfer, camera, (1, 1))[0, 0, 3], 1 - exp(-np.sqrt(3)), rtol=0, atol=1e-9
    )


def test_a_ray_may_leave_and_enter_again() -> None:
    """Two balls, one behind the other, and the same with the nearer one missing."""
    points, cells = delaunay(40)
    both = np.concatenate([points, points + [0, 0, 5]])
    values = np.concatenate([np.full(len(points), 1.0), np.full(len(points), 2.0)])
    grid = TetrahedralGrid(both, np.concatenate([cells, cells + len(points)]), values)
    transfer = TransferFunction([1, 2], [[1, 0, 0], [0, 1, 0]], [1.0, 2.0])
    for camera, order in (
        (INSIDE, (0, 1)),
        (Camera.orthographic((0.5, 0.5, 9), (0.5, 0.5, 0.5), (0, 1, 0), 0.7), (1, 0)),
    ):
        picture = raycast_tetrahedra(grid, transfer, camera, SIZE)
        own = [1 - exp(-1), 1 - exp(-2)]
        front, back = order
        np.testing.assert_allclose(picture[..., front], own[front], rtol=0, atol=_ROUNDING)
        np.testing.assert_allclose(picture[..., back], (1 - own[front]) * own[back], rtol=0, atol=_ROUNDING)
    values[: len(points)] = np.nan
    picture = raycast_tetrahedra(TetrahedralGrid(both, grid.tetrahedra, values), transfer, INSIDE, SIZE)
    np.testing.assert_allclose(picture[..., 3], own[1], rtol=0, atol=_ROUNDING)


def test_an_opaque_value_hides_what_is_behind() -> None:
    """Opaque red from 0.5 on: in front of it, green of an optical depth of 1/2."""
    transfer = TransferFunction([0.5, 0.5], [[0, 1, 0], [1, 0, 0]], [1.0, np.inf])
    picture = raycast_tetrahedra(along_z(), transfer, INSIDE, SIZE)
    np.testing.assert_allclose(picture[..., 1], 1 - exp(-0.5), rtol=0, atol=_ROUNDING)
    np.testing.assert_allclose(picture[..., 0], exp(-0.5), rtol=0, atol=_ROUNDING)
    assert (picture[..., 3] == 1).all()


def test_far_from_the_origin_digits_are_kept() -> None:
    points, cells = delaunay(60)
    transfer = TransferFunction([0, 1], [[1, 1, 1], [1, 1, 1]], [0.0, 3.0])
    grid = TetrahedralGrid(points + 1e6, cells, points[:, 2].copy())
    camera = Camera.orthographic(np.add((0.5, 0.5, -3), 1e6), np.add(0.5, (1e6,) * 3), (0, 1, 0), height=0.7)
    picture = raycast_tetrahedra(grid, transfer, camera, SIZE)
    np.testing.assert_allclose(picture[..., 3], 1 - exp(-1.5), rtol=0, atol=1e-9)  # positions have 1e-10


def test_nothing_behind_the_eye_and_a_frame_of_its_own() -> None:
    transfer = TransferFunction([0], [[1, 1, 1]], [1.0])
    away = Camera.perspective((0.5, 0.5, -3), (0.5, 0.5, -9), (0, 1, 0))
    assert not raycast_tetrahedra(along_z(), transfer, away, SIZE).any()
    framed = raycast_tetrahedra(along_z(), transfer, size=SIZE)[..., 3] > 0
    assert 0.2 < framed.mean() < 0.9
    assert not (framed[0].any() or framed[-1].any() or framed[:, 0].any() or framed[:, -1].any())


def test_what_tetrahedra_do_not_have_is_refused() -> None:
    transfer = TransferFunction([0], [[1, 1, 1]], [1.0])
    grid = along_z(10)
    twice = TetrahedralGrid(grid.points, np.concatenate([grid.tetrahedra, grid.tetrahedra[:1]]), grid.values)
    with pytest.raises(InputError, match="tetrahedra must not overlap, got rays of which several cover a length of"):
        raycast_tetrahedra(twice, transfer, INSIDE, SIZE)
    with pytest.raises(InputError, match="grid must be a TetrahedralGrid, got str"):
        raycast_tetrahedra("grid", transfer)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="transfer_function must be a TransferFunction, got str"):
        raycast_tetrahedra(grid, "fog")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="size"):
        raycast_tetrahedra(grid, transfer, size=(0, 5))
    with pytest.raises(InputError, match="background must be three numbers of at least 0"):
        raycast_tetrahedra(grid, transfer, background=(0, -1, 0))
    with pytest.raises(InputError, match="camera must be a Camera, got tuple"):
        raycast_tetrahedra(grid, transfer, (1, 2, 3))  # type: ignore[arg-type]
    graded = TransferFunction([0], [[1, 1, 1]], [1.0], modulation=[[0, 0], [1, 1]])
    with pytest.raises(InputError, match="must not depend on the gradient"):
        raycast_tetrahedra(grid, graded)
