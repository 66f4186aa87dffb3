"""Curvilinear grids: straight and even ones as they are, others through the inverse of their cells' maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from support import marked
from support.grid_files import PACKERS, linear, points_of, points_of_axes, smooth, structured, warped, written
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkProbeFilter

from texvol import InputError, Volume, load
from texvol.cli import information

INDEX = points_of_axes([np.arange(size) for size in marked.DIMENSIONS])
SHEAR = np.array([[1.0, 0.3, 0.0], [0.0, 1.0, 0.2], [0.1, 0.0, 1.0]])


def marked_points(matrix: np.ndarray = marked.DIRECTION) -> np.ndarray:
    return np.array(marked.ORIGIN) + (INDEX * marked.SPACING) @ matrix.T


@pytest.mark.parametrize("dtype", ["f4", "f8"])
@pytest.mark.parametrize("shear", [np.eye(3), SHEAR])
def test_a_turned_or_sheared_even_grid_is_read_as_it_is(tmp_path: Path, dtype: str, shear: np.ndarray) -> None:
    points = marked_points(shear @ marked.DIRECTION)
    path = written(tmp_path / "v.vts", structured(points, marked.marked(), dtype))
    volume = load(path)
    assert volume.resampling is None
    wanted = points[marked.MARK[::-1]]
    marked.check(volume, position=wanted, atol=1e-5 if dtype == "f4" else 1e-12)  # 30 in float32: 1e-6
    np.testing.assert_allclose(points_of(volume), points, rtol=0, atol=1e-5)


@pytest.mark.parametrize("packer", PACKERS)
@pytest.mark.parametrize(("mode", "base64"), [("ascii", 1), ("binary", 1), ("appended", 1), ("appended", 0)])
@pytest.mark.parametrize("little", [0, 1])
def test_every_form_that_vtk_writes(tmp_path: Path, mode: str, base64: int, packer: str, little: int) -> None:
    points = marked_points()
    path = written(tmp_path / "v.vts", structured(points, marked.marked()), mode, packer, base64=base64, little=little)
    marked.check(load(path), position=points[marked.MARK[::-1]])


def test_values_of_cells_lie_at_their_middles(tmp_path: Path) -> None:
    points = points_of_axes([np.arange(size + 1.0) * 2 for size in marked.DIMENSIONS]) @ SHEAR.T
    volume = load(written(tmp_path / "v.vts", structured(points, marked.marked(), cells=True)))
    marked.check(volume, position=SHEAR @ (2 * np.array(marked.MARK) + 1))


def test_one_even_layer_is_a_slab(tmp_path: Path) -> None:
    points = points_of_axes([np.arange(4.0), 2 * np.arange(3.0), [5.0]])
    volume = load(written(tmp_path / "v.vts", structured(points, np.arange(12.0))))
    np.testing.assert_allclose(volume.spacing, [1, 2, 1])
    assert volume.dimensions == (4, 3, 1)


GRIDS = {
    "warped": warped((9, 12, 7)),
    "left-handed": warped((9, 12, 7))[:, :, ::-1],
    "far away": warped((9, 12, 7)) + [1e5, -1e5, 1e5],
    "in other units": warped((9, 12, 7)) * [1e-6, 1.0, 1e6],
}


@pytest.mark.parametrize("name", GRIDS)
def test_a_linear_field_is_reproduced(tmp_path: Path, name: str) -> None:
    """To 1e-9 of what it varies by: places are found to 1e-12 of a cell, and far away float64 holds 1e-11 of one."""
    points = GRIDS[name]
    size = np.ptp(points, axis=(0, 1, 2))
    path = written(tmp_path / "v.vts", structured(points, linear(points / size)))
    volume = load(path)
    found = np.isfinite(volume.values)
    wanted = linear(points_of(volume) / size)
    assert 0.5 < found.mean() < 0.9  # the grid fills about three quarters of its box
    np.testing.assert_allclose(volume.values[found], wanted[found], rtol=0, atol=1e-9)
    assert volume.resampling["outside"] == (~found).sum()


def test_points_are_found_where_vtk_finds_them(tmp_path: Path) -> None:
    """VTK finds a cell's coordinates to 1e-6 or so; values differ by up to 1 within one."""
    points = warped((9, 12, 7))
    values = np.random.default_rng(3).random(points.shape[:3])
    grid = structured(points, values)
    volume = load(written(tmp_path / "v.vts", grid), resolution=(31, 33, 27))
    image = vtkImageData()
    image.SetDimensions(volume.dimensions)
    image.SetSpacing(*volume.spacing)
    image.SetOrigin(*volume.origin)
    probe = vtkProbeFilter()
    probe.SetInputData(image)
    probe.SetSourceData(grid)
    probe.Update()
    data = probe.GetOutput().GetPointData()
    theirs = vtk_to_numpy(data.GetArray("values")).reshape(volume.values.shape)
    inside = vtk_to_numpy(data.GetArray("vtkValidPointMask")).reshape(volume.values.shape) > 0
    ours = np.isfinite(volume.values)
    # VTK takes points that lie a little outside for inside, and none that we take is outside for it.
    assert not (ours & ~inside).any()
    assert (inside & ~ours).sum() < 0.02 * inside.sum()
    np.testing.assert_allclose(volume.values[ours], theirs[ours], rtol=0, atol=1e-4)


def test_a_smooth_field_converges_with_order_two(tmp_path: Path) -> None:
    errors = []
    for count in (9, 17, 33):
        points = warped((count, count, count))
        path = written(tmp_path / f"{count}.vts", structured(points, smooth(points)))
        volume = load(path, resolution=(20, 21, 22))
        errors.append(np.sqrt(np.nanmean((volume.values - smooth(points_of(volume))) ** 2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 1.8) & (orders < 2.2)).all(), orders


def test_every_point_of_a_closed_ring_is_found(tmp_path: Path) -> None:
    """Between the inner and the outer polygon of 60 corners, its seam and its faces included."""
    radii, angles, heights = np.linspace(1, 2, 6), np.linspace(0, 2 * np.pi, 61), np.linspace(0, 1, 3)
    z, angle, radius = np.meshgrid(heights, angles, radii, indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)
    volume = load(written(tmp_path / "v.vts", structured(points, linear(points))), resolution=(81, 79, 3))
    distance = np.hypot(*np.moveaxis(points_of(volume)[..., :2], -1, 0))
    found = np.isfinite(volume.values)
    assert found[(distance > 1) & (distance < 2 * np.cos(np.pi / 60))].all()
    assert not found[(distance < np.cos(np.pi / 60)) | (distance > 2)].any()


def test_cells_that_meet_in_an_axis_are_located(tmp_path: Path) -> None:
    """A cylinder down to radius 0, where a face of each innermost cell is a line."""
    radii, angles, heights = np.linspace(0, 1, 6), np.linspace(0, 2 * np.pi, 25), np.linspace(0, 1, 3)
    z, angle, radius = np.meshgrid(heights, angles, radii, indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)
    volume = load(written(tmp_path / "v.vts", structured(points, linear(points))), resolution=(40, 40, 3))
    distance = np.hypot(*np.moveaxis(points_of(volume)[..., :2], -1, 0))
    inside = distance < np.cos(np.pi / 24)
    np.testing.assert_allclose(volume.values[inside], linear(points_of(volume))[inside], atol=1e-9)


def test_the_error_is_the_one_at_the_files_own_samples(tmp_path: Path) -> None:
    points = warped((9, 12, 7))
    values = np.random.default_rng(3).random(points.shape[:3])
    volume = load(written(tmp_path / "v.vts", structured(points, values)), resolution=(31, 33, 27))
    index = ((points - volume.origin) / volume.spacing)[..., ::-1]
    grid = tuple(np.arange(size) for size in volume.values.shape)
    drawn = RegularGridInterpolator(grid, volume.values)(np.clip(index, 0, np.array(volume.values.shape) - 1))
    # Where all eight samples are there scipy has the field; beside NaN ours are weighted, and counted apart.
    whole = np.isfinite(drawn)
    metadata = volume.resampling
    assert metadata["max_error"] >= np.abs(drawn - values)[whole].max() > 0.1
    assert whole.sum() < metadata["compared"] < values.size
    assert metadata["compared"] + metadata["lost"] == values.size
    page = information.text(information.metadata(volume))
    assert "from a curvilinear grid of 9 x 12 x 7 samples to a regular one of 31 x 33 x 27" in page
    assert f"{metadata['outside']} of the new samples are outside" in page


def test_a_wanted_resolution_of_an_even_grid_is_given(tmp_path: Path) -> None:
    points = points_of_axes([np.arange(4.0), np.arange(5.0), np.arange(6.0)])
    volume = load(written(tmp_path / "v.vts", structured(points, linear(points))), resolution=(10, 9, 8))
    assert volume.dimensions == (10, 9, 8)
    np.testing.assert_allclose(volume.values, linear(points_of(volume)), atol=1e-11)


def spoilt(change: object, cell: tuple = (2, 3, 4)) -> np.ndarray:
    points = warped((6, 7, 8))
    points[cell] = change if not callable(change) else change(points)
    return points


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (spoilt(np.nan), r"its point \(4, 3, 2\) is not finite: \[nan, nan, nan\]"),
        (spoilt([np.inf, 0, 0]), r"is not finite: \[inf"),
        (spoilt(lambda points: points[5, 0, 0]), "is folded"),
        (spoilt([1e200, 0, 0]), "must have coordinates of at most"),
        (warped((6, 7, 8)) * [1, 0, 1], "is flat: all of its points have the same y"),
        (warped((6, 7, 8)) @ np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 1]]), "none of its 210 cells has a volume"),
        (np.zeros((3, 3, 3, 3)), "is flat: all of its points have the same x and the same y and the same z"),
        (warped((6, 7, 1)), "must have two or more layers of points, got 6 x 7 x 1"),
        (np.concatenate([warped((6, 7, 8)), warped((6, 7, 8))[-2::-1]]), "have opposite orientations"),
    ],
)
def test_points_that_make_no_grid_are_refused(tmp_path: Path, points: np.ndarray, reason: str) -> None:
    path = written(tmp_path / "v.vts", structured(points, np.arange(points[..., 0].size, dtype="f8")))
    with pytest.raises(InputError, match=rf"^{path}: .*{reason}"):
        load(path)


def test_layers_without_thickness_are_counted_and_hold_nothing(tmp_path: Path) -> None:
    points = warped((6, 7, 8))
    points[4] = points[3]
    volume = load(written(tmp_path / "v.vts", structured(points, linear(points))))
    assert volume.resampling["flat_cells"] == 5 * 6
    assert "30 cells of the source have no volume" in information.text(information.metadata(volume))
    found = np.isfinite(volume.values)
    np.testing.assert_allclose(volume.values[found], linear(points_of(volume))[found], atol=1e-9)


def test_a_grid_wound_over_itself_is_refused_before_it_takes_forever(tmp_path: Path) -> None:
    """A ring of 200 turns, so that each of 144000 points lies in 200 cells, none of them folded."""
    turns = np.linspace(0, 400 * np.pi, 6001)
    z, angle, radius = np.meshgrid([0.0, 1.0], turns, [0.2, 1.0], indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)
    path = written(tmp_path / "v.vts", structured(points, linear(points)))
    with pytest.raises(InputError, match="so oblique, or overlap so much.*--resolution"):
        load(path, resolution=(60, 60, 40))


def test_a_hostile_resolution_is_refused(tmp_path: Path) -> None:
    points = warped((4, 4, 4))
    path = written(tmp_path / "v.vts", structured(points, linear(points)))
    with pytest.raises(InputError, match="this machine has"):
        load(path, resolution=(10**5, 10**5, 10**5))
    for resolution in ((1, 5, 5), (0, 5, 5), (-3, 5, 5), (5, 5), (2.5, 5, 5)):
        with pytest.raises(InputError, match="--resolution"):
            load(path, resolution=resolution)


def test_a_regular_format_takes_no_resolution(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", marked.marked())
    with pytest.raises(InputError, match="is NPY, whose samples are on a regular grid"):
        load(tmp_path / "v.npy", resolution=(5, 5, 5))
    with pytest.raises(InputError, match="is NPY: --variable is for"):
        load(tmp_path / "v.npy", variable="t")


def test_the_box_of_the_new_grid_is_that_of_the_points(tmp_path: Path) -> None:
    points = warped((6, 7, 8))
    volume: Volume = load(written(tmp_path / "v.vts", structured(points, linear(points))))
    np.testing.assert_allclose(points_of(volume).min(axis=(0, 1, 2)), points.min(axis=(0, 1, 2)), atol=1e-12)
    np.testing.assert_allclose(points_of(volume).max(axis=(0, 1, 2)), points.max(axis=(0, 1, 2)), atol=1e-12)
