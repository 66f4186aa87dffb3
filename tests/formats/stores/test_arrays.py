"""Arrays that are mapped, computed or stored elsewhere, as volumes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import dask.array
import h5py
import numpy as np
import pytest
import xarray
import zarr
from numpy.testing import assert_allclose, assert_array_equal
from support.raised import raised
from support.stores import field

import texvol
from texvol import InputError, open_array


def test_a_mapped_file_is_not_read_until_it_is_asked_for(tmp_path: Path) -> None:
    field().tofile(tmp_path / "v.raw")
    mapped = np.memmap(tmp_path / "v.raw", field().dtype, "r", shape=field().shape)
    volume = open_array(mapped, spacing=(1, 2, 3), chunk_shape=(8, 9, 10))
    assert volume.levels[0].source.bytes_read == 0
    assert volume.levels[0].source.chunk_shape == (8, 9, 10)
    assert_array_equal(volume.part(0, (1, 2, 3), (5, 7, 9)).values, field()[3:9, 2:7, 1:5])
    assert volume.levels[0].source.bytes_read == 4 * 5 * 6 * 2
    assert_array_equal(volume.values, field())


def test_of_a_dask_array_only_the_part_is_computed() -> None:
    computed: list[tuple[int, ...]] = []

    def made(block: np.ndarray, block_info: Any = None) -> np.ndarray:
        if block_info:
            computed.append(block_info[None]["chunk-location"])
        return block * 2

    array = dask.array.from_array(field(), chunks=(16, 16, 16)).map_blocks(made, dtype=field().dtype)
    volume = open_array(array)
    assert volume.levels[0].source.chunk_shape == (16, 16, 16)
    assert_array_equal(volume.part(0, (0, 0, 0), (10, 10, 10)).values, 2 * field()[:10, :10, :10])
    assert set(computed) == {(0, 0, 0)}


def test_a_dask_array_that_fails_is_an_error_of_one_line() -> None:
    def fails(block: np.ndarray) -> np.ndarray:
        raise RuntimeError("the disk\nis gone")

    array = dask.array.zeros((8, 8, 8), chunks=4).map_blocks(fails, dtype=float, meta=np.zeros((0, 0, 0)))
    message = str(raised(InputError, lambda: open_array(array, name="sum").values))
    assert message.startswith("sum: array: chunk 0, 0, 0 (")
    assert "the disk is gone" in message


@pytest.mark.parametrize("order", ["zyx", "xyz", "yczx"])
def test_names_and_coordinates_of_xarray_place_the_samples(order: str) -> None:
    nz, ny, nx = field().shape
    coordinates: dict[str, Any] = {
        "z": ("z", 10 + 2.0 * np.arange(nz), {"units": "micrometer"}),
        "y": ("y", 20 + 3.0 * np.arange(ny), {"units": "micrometer"}),
        "x": ("x", 30 + 4.0 * np.arange(nx), {"units": "micrometer"}),
    }
    named = xarray.DataArray(field()[np.newaxis] + np.arange(2, dtype=np.uint16)[:, None, None, None],
                             dims=tuple("czyx"), coords=coordinates)  # fmt: skip
    named = named.isel(c=1) if "c" not in order else named
    volume = open_array(named.transpose(*order), channel=1 if "c" in order else None)
    assert_array_equal(volume.values, field() + 1)
    assert_allclose(volume.spacing, (4, 3, 2))
    assert_allclose(volume.origin, (30, 20, 10))
    assert volume.unit == "µm"


def test_uneven_coordinates_are_refused_unless_a_spacing_is_told() -> None:
    named = xarray.DataArray(np.zeros((4, 4, 4)), dims=tuple("zyx"), coords={"z": [0.0, 1, 3, 4]})
    assert "its coordinates z must be even" in str(raised(InputError, open_array, named))
    assert_allclose(open_array(named, spacing=(1, 1, 1)).spacing, 1)


def test_arrays_of_other_libraries(tmp_path: Path) -> None:
    stored = zarr.create_array(tmp_path / "v.zarr", data=field(), chunks=(10, 11, 12))
    assert open_array(stored).levels[0].source.chunk_shape == (10, 11, 12)
    assert_array_equal(open_array(stored).values, field())
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file["v"] = field()
        assert_array_equal(open_array(file["v"]).values, field())


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        ([[[1]]], "array must have shape, got list"),
        (np.zeros((3, 3, 3), complex), "must hold real numbers"),
        (np.zeros((0, 3, 3)), "every dimension must be positive"),
        (np.zeros((2, 3, 3, 3)), "choose one with --channel"),
    ],
)
def test_what_is_no_volume(array: object, reason: str) -> None:
    message = str(raised(InputError, open_array, array))
    assert reason in message
    assert "\n" not in message


def test_zarr_arrays_without_metadata_of_images(tmp_path: Path) -> None:
    for number, kind in enumerate((2, 3)):
        path = tmp_path / f"{number}.zarr"
        zarr.create_array(path, data=field(), chunks=(16, 16, 16), zarr_format=kind)  # type: ignore[arg-type]
        volume = texvol.load(path, spacing=(1, 2, 3))
        assert_array_equal(volume.values, field())
        assert_allclose(volume.spacing, (1, 2, 3))
    xarray.Dataset({"heat": (("x", "y", "z"), field().T)}).to_zarr(tmp_path / "set.zarr", zarr_format=3)
    assert_array_equal(texvol.load(tmp_path / "set.zarr", variable="heat").values, field())
    message = str(raised(InputError, texvol.load, tmp_path / "set.zarr"))
    assert "heat" in message
