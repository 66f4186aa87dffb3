"""HDF5: a dataset named in the path, and what its attributes say of the grid and of missing samples."""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from support import marked

from texvol import InputError, load


def written(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file["a/first"], file["a/second"] = marked.marked() * 0, marked.marked()
    return path


def test_a_dataset_is_named_behind_the_file(tmp_path: Path) -> None:
    path = written(tmp_path / "v.h5")
    for name in (f"{path}::/a/second", f"{path}::a/second"):
        volume = load(name)
        np.testing.assert_array_equal(volume.values, marked.marked())
        assert volume.name == name
        again = load(volume.source["path"])
        np.testing.assert_array_equal(again.values, marked.marked())
    with pytest.raises(InputError, match=r"v\.h5::/b: has no dataset /b"):
        load(f"{path}::/b")
    with pytest.raises(InputError, match="names the variable /a/first, and --variable another, a"):
        load(f"{path}::/a/first", variable="a")
    with pytest.raises(InputError, match="no such file"):
        load(f"{tmp_path}/w.h5::/a")


def test_a_file_may_have_colons_in_its_name(tmp_path: Path) -> None:
    written(tmp_path / "v.h5")
    os.rename(tmp_path / "v.h5", tmp_path / "v::2.h5")
    assert load(tmp_path / "v::2.h5", variable="a/second").values.max() == marked.MARK_VALUE
    assert load(f"{tmp_path}/v::2.h5::a/second").values.max() == marked.MARK_VALUE


def test_sizes_of_elements_and_coordinates_are_spacing(tmp_path: Path) -> None:
    path = tmp_path / "v.h5"
    with h5py.File(path, "w") as file:
        file["v"] = marked.marked()
        file["v"].attrs["element_size_um"] = [4.0, 3.0, 2.0]
        file["v"].attrs["units"] = np.bytes_("kg m-3")
    volume = load(path)
    assert volume.spacing.tolist() == [2, 3, 4] and volume.unit == "µm"
    assert volume.value_unit == "kg m-3"
    path = tmp_path / "scales.h5"
    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("v", data=marked.marked())
        for axis, name in enumerate("zyx"):
            values = marked.ORIGIN[2 - axis] + marked.SPACING[2 - axis] * np.arange(marked.marked().shape[axis])
            file[name] = values
            file[name].make_scale(name)
            file[name].attrs["units"] = "mm"
            dataset.dims[axis].attach_scale(file[name])
    volume = load(path)
    marked.check(volume, position=np.array(marked.ORIGIN) + np.multiply(marked.SPACING, marked.MARK))
    assert (volume.unit, volume.value_unit) == ("mm", "")
    (tmp_path / "uneven.h5").write_bytes(path.read_bytes())
    with h5py.File(tmp_path / "uneven.h5", "a") as file:
        file["x"][2] += 0.5
    volume = load(tmp_path / "uneven.h5")
    assert volume.spacing.tolist() == [1, 3, 4]
    assert any("axis x are not even" in note for note in volume.notes)


def test_values_that_mark_missing_samples(tmp_path: Path) -> None:
    path = tmp_path / "v.h5"
    with h5py.File(path, "w") as file:
        file["v"] = marked.marked()
        file["v"].attrs["_FillValue"] = np.int16(marked.MARK_VALUE)
    values = load(path).values
    assert np.isnan(values).sum() == 1 and np.isnan(values[marked.MARK[::-1]])
    assert load(path, labels=True).values.max() == marked.MARK_VALUE


def test_a_dataset_without_axes_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file["number"], file["nothing"] = 7.0, h5py.Empty("f4")
    for name, reason in (("number", "a single value"), ("nothing", "nothing")):
        with pytest.raises(InputError, match=rf"v\.h5::{name}: must have axes, got {reason}"):
            load(f"{tmp_path}/v.h5::{name}")
