"""DICOM slices that are no regular grid: refused with a hint, and resampled with a known error by --resample."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support import marked
from support.dicom_files import AXES, NORMAL, slice_of

from texvol import InputError, Volume, load

COLUMNS, ROWS = 12, 10
Place = Callable[[int], NDArray[np.float64]]
PLACES: dict[str, tuple[NDArray[np.float64], str]] = {
    "a missing slice": (np.outer([0, 4, 8, 16, 20, 24], NORMAL), "unevenly apart"),
    "uneven gaps": (np.outer([0, 2, 5, 9, 14, 20], NORMAL), "unevenly apart"),
    "a slice beside": (
        np.outer([0, 4, 8, 12, 16, 20], NORMAL) + np.outer([0, 0, 3, 0, 0, 0], AXES[0]),
        "not on a line",
    ),
}
TILTED = np.outer(np.arange(6), NORMAL * 4 + AXES[1] * 1.5)


def plane_of(position: NDArray[np.float64], field: Callable[[NDArray], NDArray]) -> NDArray:
    """Pixels of a slice, the field at their places."""
    columns, rows = np.arange(COLUMNS) * marked.SPACING[0], np.arange(ROWS) * marked.SPACING[1]
    places = position + columns[np.newaxis, :, np.newaxis] * AXES[0] + rows[:, np.newaxis, np.newaxis] * AXES[1]
    return np.round(field(places)).astype("i2")


def linear(places: NDArray) -> NDArray:
    return places @ np.array([30.0, -20.0, 50.0])


def written(folder: Path, offsets: NDArray[np.float64], field: Callable[[NDArray], NDArray] = linear) -> Path:
    for number, offset in enumerate(offsets):
        position = np.array(marked.ORIGIN) + offset
        dataset = slice_of(number, plane_of(position, field))
        dataset.ImagePositionPatient = [f"{each:.12g}" for each in position]
        dataset.save_as(folder / f"s{number}.dcm", enforce_file_format=True)
    return folder


def places_of(volume: Volume) -> NDArray[np.float64]:
    """World positions of all samples, shape (nz, ny, nx, 3)."""
    k, j, i = np.meshgrid(*(np.arange(size) for size in volume.shape), indexing="ij")
    return volume.origin + np.stack([i, j, k], axis=-1) @ volume.world_from_index.T


def check_linear(volume: Volume, offsets: NDArray[np.float64]) -> None:
    """Fail unless the volume is the linear field, rounded to whole numbers, wherever pixels lie around a sample."""
    places = places_of(volume)
    along = (places - marked.ORIGIN) @ np.array([*AXES, NORMAL]).T
    depths = offsets @ NORMAL
    shifts = [np.interp(along[..., 2], depths, offsets @ axis) for axis in AXES]
    ends = (np.array([COLUMNS, ROWS]) - 1) * marked.SPACING[:2]
    inside = np.ones(volume.shape, bool)
    for axis in (0, 1):
        at = along[..., axis] - shifts[axis]
        inside &= (at > -1e-6) & (at < ends[axis] + 1e-6)
    assert np.isfinite(volume.values[inside]).all() and inside.sum() > 400
    assert np.abs(volume.values - linear(places))[inside].max() < 0.51


@pytest.mark.parametrize("name", PLACES)
def test_a_linear_field_is_kept_to_the_rounding_of_its_pixels(tmp_path: Path, name: str) -> None:
    offsets, reason = PLACES[name]
    written(tmp_path, offsets)
    with pytest.raises(InputError, match=rf"{reason}.*; --resample makes an even grid of them, with a known error"):
        load(tmp_path)
    volume = load(tmp_path, resample=True)
    assert np.isfinite(volume.values).mean() > 0.8
    check_linear(volume, offsets)
    np.testing.assert_allclose(volume.direction, np.column_stack([*AXES, NORMAL]), atol=1e-9)
    assert (volume.unit, volume.space) == ("mm", "left-posterior-superior")
    # Beside the outermost pixels the field stays as it is for half a pixel, of at most 30 for each of 2 mm.
    most = 1.01 if reason == "unevenly apart" else 30
    assert volume.resampling is not None and volume.resampling["max_error"] < most


def test_the_error_that_is_reported_is_that_at_the_pixels(tmp_path: Path) -> None:
    """A curved field is resampled on an even grid that meets only the first and the last slice."""
    random = np.random.default_rng(4)
    planes = random.integers(0, 1000, (6, ROWS, COLUMNS)).astype("i2")
    for number, offset in enumerate(PLACES["uneven gaps"][0]):
        dataset = slice_of(number, planes[number])
        dataset.ImagePositionPatient = [f"{each:.12g}" for each in np.array(marked.ORIGIN) + offset]
        dataset.save_as(tmp_path / f"s{number}.dcm", enforce_file_format=True)
    volume = load(tmp_path, resample=True, resolution=(COLUMNS, ROWS, 7))
    z = np.array([0, 2, 5, 9, 14, 20]) / 20 * 6
    low = np.minimum(z.astype(int), 5)
    weight = (z - low)[:, np.newaxis, np.newaxis]
    drawn = volume.values[low] * (1 - weight) + volume.values[low + 1] * weight
    assert volume.resampling is not None
    np.testing.assert_allclose(volume.resampling["max_error"], np.abs(drawn - planes).max(), rtol=1e-6)
    np.testing.assert_allclose(volume.resampling["rms_error"], np.sqrt(((drawn - planes) ** 2.0).mean()), rtol=1e-5)
    assert volume.dimensions == (COLUMNS, ROWS, 7)


def test_a_tilted_gantry_is_a_shear_or_a_right_angled_grid(tmp_path: Path) -> None:
    written(tmp_path, TILTED)
    sheared = load(tmp_path)
    assert sheared.resampling is None
    volume = load(tmp_path, resample=True)
    np.testing.assert_allclose(volume.direction.T @ volume.direction, np.eye(3), atol=1e-9)
    check_linear(volume, TILTED)
    there = np.isfinite(volume.values)
    # Of the pixels none is lost, and the corners that the tilt leaves are missing.
    assert volume.resampling is not None and volume.resampling["lost"] == 0
    assert 0.05 < 1 - there.mean() < 0.5


def test_labels_keep_their_names(tmp_path: Path) -> None:
    written(tmp_path, PLACES["uneven gaps"][0], lambda places: np.where(linear(places) > 2800, 7.0, 3.0))
    volume = load(tmp_path, resample=True, labels=True)
    assert set(np.unique(volume.values)) == {3, 7} and volume.values.dtype.kind in "iu"
    assert volume.resampling is not None and volume.resampling["changed"] < 0.1 * volume.resampling["compared"]


def test_missing_pixels_are_not_mixed_with_others(tmp_path: Path) -> None:
    written(tmp_path, PLACES["uneven gaps"][0], lambda places: np.where(linear(places) > 2800, -999.0, 5.0))
    values = load(tmp_path, resample=True, missing=-999).values
    assert np.isnan(values).any() and np.isfinite(values).any()
    np.testing.assert_allclose(values[np.isfinite(values)], 5)


def test_a_regular_series_stays_as_it_is(tmp_path: Path) -> None:
    written(tmp_path, np.outer(np.arange(6) * 4, NORMAL))
    plain, resampled = load(tmp_path), load(tmp_path, resample=True)
    np.testing.assert_allclose(resampled.values, plain.values)
    np.testing.assert_allclose(resampled.world_from_index, plain.world_from_index, atol=1e-9)
    assert resampled.resampling is not None and resampled.resampling["max_error"] == 0


def test_only_slices_of_dicom_are_resampled(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", marked.marked())
    with pytest.raises(InputError, match="is NPY: --resample is for slices of DICOM"):
        load(tmp_path / "v.npy", resample=True)
