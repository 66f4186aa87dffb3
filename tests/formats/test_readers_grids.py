"""Rectilinear grids: as they are where they are even, resampled where they are not, with a measured error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from support import marked
from support.grid_files import (
    PACKERS,
    linear,
    points_of,
    points_of_axes,
    rectilinear,
    smooth,
    written,
)

from texvol import InputError, Volume, load
from texvol.cli import information

UNEVEN = (np.array([0.0, 1.0, 2.5, 3.0, 7.0]), np.array([-2.0, 0.0, 1.0, 5.0]), np.array([10.0, 11.0, 14.0]))
EVEN = tuple(
    begin + step * np.arange(size) for begin, step, size in zip(marked.ORIGIN, (2, 3, -4), (5, 4, 3), strict=True)
)


def interpolated(volume: Volume, points: np.ndarray) -> np.ndarray:
    """scipy's trilinear field between a volume's samples."""
    index = (points - volume.origin) @ volume.index_from_world.T
    grid = tuple(np.arange(size) for size in volume.values.shape)
    at = np.clip(index[..., ::-1], 0, np.array(volume.values.shape) - 1)
    return RegularGridInterpolator(grid, volume.values.astype(np.float64))(at)


@pytest.mark.parametrize("little", [0, 1])
@pytest.mark.parametrize("packer", PACKERS)
@pytest.mark.parametrize(("mode", "base64"), [("ascii", 1), ("binary", 1), ("appended", 1), ("appended", 0)])
def test_every_form_that_vtk_writes(tmp_path: Path, mode: str, base64: int, packer: str, little: int) -> None:
    grid = rectilinear(EVEN, marked.marked())
    path = written(tmp_path / "v.vtr", grid, mode, packer, base64=base64, little=little)
    position = np.array(marked.ORIGIN) + np.array([2, 3, -4]) * marked.MARK
    marked.check(load(path), position=position)


@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_an_even_grid_is_read_as_it_is(tmp_path: Path, dtype: str) -> None:
    """Far from 0 float32 moves the coordinates, by 1 in 2^24 of 5000: 3e-4, less than a hundredth of the spacing."""
    axes = [5000 + 0.1 * np.arange(40), 0.3 * np.arange(4), -0.7 * np.arange(3)]
    values = np.arange(480, dtype="u2").reshape(3, 4, 40)
    volume = load(written(tmp_path / "v.vtr", rectilinear(axes, values, dtype)))
    assert volume.resampling is None
    assert volume.values.dtype == np.uint16
    np.testing.assert_array_equal(volume.values, values)
    np.testing.assert_allclose(points_of(volume), points_of_axes(axes), rtol=0, atol=3e-4 if dtype == "f4" else 1e-12)


def test_a_grid_that_is_not_even_by_more_than_rounding_is_resampled(tmp_path: Path) -> None:
    axes = [np.array([0.0, 1.0, 2.0, 3.02]), np.arange(3.0), np.arange(2.0)]
    volume = load(written(tmp_path / "v.vtr", rectilinear(axes, linear(points_of_axes(axes)))))
    assert volume.resampling is not None


def test_values_of_cells_lie_at_their_middles(tmp_path: Path) -> None:
    axes = [np.arange(size + 1.0) for size in marked.DIMENSIONS]
    volume = load(written(tmp_path / "v.vtr", rectilinear(axes, marked.marked(), cells=True)))
    marked.check(volume, position=np.array(marked.MARK) + 0.5)


def test_one_layer_of_cells_is_as_deep_as_they_are(tmp_path: Path) -> None:
    axes = [np.arange(4.0), np.arange(3.0), np.array([2.0, 7.0])]
    volume = load(written(tmp_path / "v.vtr", rectilinear(axes, np.arange(6.0), cells=True)))
    np.testing.assert_allclose(volume.spacing, [1, 1, 5])
    np.testing.assert_allclose(volume.origin, [0.5, 0.5, 4.5])


@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, -1)])
@pytest.mark.parametrize("resolution", [None, (9, 17, 4), (3, 2, 50)])
def test_a_linear_field_is_reproduced(tmp_path: Path, signs: tuple, resolution: tuple | None) -> None:
    """To rounding: values up to 40, a dozen operations of 1.1e-16 each: 5e-14."""
    axes = [sign * axis for sign, axis in zip(signs, UNEVEN, strict=True)]
    path = written(tmp_path / "v.vtr", rectilinear(axes, linear(points_of_axes(axes))))
    volume = load(path, resolution=resolution)
    points = points_of(volume)
    np.testing.assert_allclose(volume.values, linear(points), rtol=0, atol=5e-14)
    for axis in range(3):
        ends = sorted([axes[axis][0], axes[axis][-1]])
        np.testing.assert_allclose([points[..., axis].min(), points[..., axis].max()], ends, atol=1e-12)
    assert volume.resampling["max_error"] < 5e-14
    if resolution:
        assert volume.dimensions == resolution
    for axis in range(3):  # the order of the file's samples stays
        assert volume.direction[axis, axis] == signs[axis]


def test_it_is_scipys_interpolation(tmp_path: Path) -> None:
    values = np.random.default_rng(5).random((3, 4, 5))
    path = written(tmp_path / "v.vtr", rectilinear(UNEVEN, values))
    volume = load(path, resolution=(31, 20, 13))
    wanted = RegularGridInterpolator(UNEVEN[::-1], values)(points_of(volume)[..., ::-1])
    np.testing.assert_allclose(volume.values, wanted, rtol=0, atol=1e-13)


def test_a_smooth_field_converges_with_order_two(tmp_path: Path) -> None:
    """Spacings halve where the samples double; the stretched coordinates of both lie on one smooth map."""
    errors = []
    for count in (9, 17, 33):
        fractions = np.linspace(0, 1, count)
        axes = [
            fractions + 0.15 * fractions * (1 - fractions),
            1.5 * fractions**2 + fractions,
            1 + fractions + 0.1 * np.sin(3 * fractions),
        ]
        path = written(tmp_path / f"{count}.vtr", rectilinear(axes, smooth(points_of_axes(axes))))
        volume = load(path, resolution=(2 * count, 2 * count + 1, 2 * count + 3))
        errors.append(np.sqrt(np.mean((volume.values - smooth(points_of(volume))) ** 2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 1.8) & (orders < 2.2)).all(), orders


def test_the_error_is_the_one_at_the_files_own_samples(tmp_path: Path) -> None:
    values = np.random.default_rng(7).random((3, 4, 5)) * 9 - 2
    volume = load(written(tmp_path / "v.vtr", rectilinear(UNEVEN, values)), resolution=(6, 7, 5))
    differences = interpolated(volume, points_of_axes(UNEVEN)) - values
    metadata = volume.resampling
    np.testing.assert_allclose(metadata["max_error"], np.abs(differences).max(), rtol=1e-9)
    np.testing.assert_allclose(metadata["rms_error"], np.sqrt(np.mean(differences**2)), rtol=1e-9)
    np.testing.assert_allclose(metadata["max_error_share"], np.abs(differences).max() / np.ptp(values), rtol=1e-9)
    np.testing.assert_allclose(
        metadata["rms_error_share"], np.sqrt(np.mean(differences**2)) / np.ptp(values), rtol=1e-9
    )
    assert (metadata["compared"], metadata["lost"]) == (60, 0)
    assert metadata["max_error"] > 0.1


def test_information_says_what_was_done(tmp_path: Path) -> None:
    values = np.random.default_rng(7).random((3, 4, 5))
    path = written(tmp_path / "v.vtr", rectilinear(UNEVEN, values))
    metadata = information.metadata(load(path, resolution=(6, 7, 5)))
    page = information.text(metadata)
    assert "from a rectilinear grid of 5 x 4 x 3 samples to a regular one of 6 x 7 x 5 (by --resolution)" in page
    assert f"max {metadata['resampling']['max_error']:.4g} (" in page
    assert "% of the range), rms" in page
    even = information.metadata(load(written(tmp_path / "even.vtr", rectilinear(EVEN, marked.marked()))))
    assert even["resampling"] is None
    assert "resampled" not in information.text(even)


@pytest.mark.parametrize(
    ("axis", "counts"),
    [
        ([0, 1, 2, 4, 5, 7], {8}),  # whole numbers: spacing 1 meets every sample
        ([0, 1, 1.5, 4], {9}),  # halves do
        ([0, 1, 1.001, 4], range(2, 17)),  # a finest spacing that would need 4001 samples: no more than 4 times 4
        (np.cumsum(np.r_[0, np.tile([1, 1.9], 300)]), {601}),  # its own, which are more than 512
    ],
)
def test_the_finest_spacing_decides_within_bounds(tmp_path: Path, axis: list, counts: set) -> None:
    axes = [np.asarray(axis, float), np.arange(2.0), np.arange(2.0)]
    path = written(tmp_path / "v.vtr", rectilinear(axes, linear(points_of_axes(axes))))
    found = load(path).dimensions
    assert found[0] in counts
    assert found[1:] == (2, 2)


def test_samples_that_the_new_grid_meets_are_kept(tmp_path: Path) -> None:
    axes = [np.array([0.0, 1.0, 2.0, 4.0, 5.0, 7.0]), np.arange(3.0), np.array([0.0, 2.0, 3.0])]
    values = np.random.default_rng(2).random((3, 3, 6))
    metadata = load(written(tmp_path / "v.vtr", rectilinear(axes, values))).resampling
    assert metadata["dimensions"] == [8, 3, 4]
    assert metadata["max_error"] < 1e-15


@pytest.mark.parametrize(("dtype", "made"), [("u1", "f4"), ("i2", "f4"), ("i4", "f8"), ("f4", "f4"), ("f8", "f8")])
def test_what_lies_between_samples_is_no_whole_number(tmp_path: Path, dtype: str, made: str) -> None:
    path = written(tmp_path / "v.vtr", rectilinear(UNEVEN, np.arange(60).astype(dtype)))
    assert load(path).values.dtype == np.dtype(made)


def test_a_missing_sample_leaves_a_hole_of_its_size(tmp_path: Path) -> None:
    """NaN is nearer than halfway to the missing sample, nowhere else, and what is there does not mix with it."""
    axes = [np.array([0.0, 1.0, 2.0, 3.0, 5.0]), np.arange(3.0), np.arange(3.0)]
    values = np.full((3, 3, 5), 4.0)
    values[1, 1, 2] = np.nan
    volume = load(written(tmp_path / "v.vtr", rectilinear(axes, values)), resolution=(51, 3, 3))
    x = points_of(volume)[1, 1, :, 0]
    np.testing.assert_array_equal(np.isnan(volume.values[1, 1]), np.abs(x - 2) < 0.5 - 1e-6)
    assert np.isnan(volume.values).sum() == np.isnan(volume.values[1, 1]).sum()
    np.testing.assert_allclose(volume.values[np.isfinite(volume.values)], 4.0, rtol=1e-15)
    metadata = volume.resampling
    assert (metadata["compared"], metadata["lost"], metadata["filled"]) == (44, 0, 0)


@pytest.mark.parametrize("name", ["another", "values"])
def test_an_array_is_chosen_by_name(tmp_path: Path, name: str) -> None:
    grid = rectilinear(EVEN, marked.marked())
    second = rectilinear(EVEN, np.zeros(60, "u1")).GetPointData().GetScalars()
    second.SetName("another")
    grid.GetPointData().AddArray(second)
    path = written(tmp_path / "v.vtr", grid)
    assert load(path, variable=name).values.max() == (0 if name == "another" else marked.MARK_VALUE)
    assert load(path).notes == ("array values; others: another",)
    with pytest.raises(InputError, match=r"has no array third \(--variable\); it has values, another"):
        load(path, variable="third")


def test_how_it_was_read_is_remembered(tmp_path: Path) -> None:
    path = written(tmp_path / "v.vtr", rectilinear(UNEVEN, np.arange(60.0)))
    source = load(path, resolution=(6, 7, 5), variable="values").source
    assert (source["resolution"], source["variable"]) == ((6, 7, 5), "values")


PIECES = """<VTKFile type="RectilinearGrid" version="1.0" byte_order="LittleEndian">
<RectilinearGrid WholeExtent="0 4 0 3 0 2">{}</RectilinearGrid></VTKFile>"""
PIECE = """<Piece Extent="{} {} 0 3 0 2"><PointData><DataArray type="Int16" format="ascii">{}</DataArray></PointData>
<Coordinates>{}</Coordinates></Piece>"""


def piece(first: int, last: int, x: list[float]) -> str:
    values = " ".join(map(str, marked.marked()[:, :, first : last + 1].ravel().tolist()))
    axes = (x, [0, 1, 2, 3], [0, 1, 2])
    arrays = [f'<DataArray type="Float64" format="ascii">{" ".join(map(str, axis))}</DataArray>' for axis in axes]
    return PIECE.format(first, last, values, "".join(arrays))


def test_pieces_are_put_together(tmp_path: Path) -> None:
    path = tmp_path / "v.vtr"
    path.write_text(PIECES.format(piece(0, 2, [0, 1, 2]) + piece(2, 4, [2, 3, 4])))
    marked.check(load(path), position=marked.MARK)
    path.write_text(PIECES.format(piece(0, 2, [0, 1, 2]) + piece(2, 4, [2.5, 3, 4])))
    with pytest.raises(InputError, match="coordinates x of its pieces contradict"):
        load(path)
    path.write_text(PIECES.format(piece(0, 2, [0, 1, 2])))
    with pytest.raises(InputError, match="do not cover"):
        load(path)
