"""HDF5 and Imaris: the dataset or the pyramid that is meant, and what is wrong with it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.raised import raised
from support.refusal import refused
from support.stores import ORIGIN, SPACING, damage, field, halved, write_imaris

from texvol import InputError, load
from texvol.formats.stores.channels import load_channels
from texvol.scene.large_volume import LargeVolume


def test_the_only_dataset_is_the_volume(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file.create_dataset("run/density", data=field(), chunks=(16, 16, 16), compression="gzip")
        file["time"] = np.arange(5)
    volume = load(tmp_path / "v.h5", spacing=(1, 2, 3))
    assert isinstance(volume, LargeVolume)
    assert_array_equal(volume.values, field())
    assert_allclose(volume.spacing, (1, 2, 3))
    assert volume.notes == ("dataset /run/density",)
    assert volume.levels[0].source.chunk_shape == (16, 16, 16)
    assert 0 < volume.levels[0].source.bytes_read < (tmp_path / "v.h5").stat().st_size * 1.01


def test_several_datasets_are_listed_and_chosen(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with h5py.File(tmp_path / "v.hdf5", "w") as file:
        file["a"], file["deep/b"], file["text"] = field(), field().astype(">f4") + 0.5, "no volume"
    message = refused(tmp_path / "v.hdf5", capfd)
    assert "has 2 datasets that could be volumes: /a, /deep/b; --variable NAME chooses one" in message
    volume = load(tmp_path / "v.hdf5", variable="/deep/b")
    assert volume.dtype == np.float32
    assert_array_equal(volume.values, field() + np.float32(0.5))
    assert "has no dataset /c (--variable); it has /a, /deep/b" in refused(tmp_path / "v.hdf5", capfd, variable="/c")


def test_labels_of_axes_tell_their_order(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        made = file.create_dataset("v", data=np.stack([field(), field() + 1]).transpose(3, 1, 2, 0))
        for axis, name in zip(made.dims, "xzyc", strict=True):
            axis.label = name
    assert_array_equal(load(tmp_path / "v.h5", channel=1).values, field() + 1)


def test_further_axes_are_chosen_like_those_of_other_files(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file["v"] = np.stack([field(), field() + 1])
    assert "choose one with --channel 0..1" in refused(tmp_path / "v.h5", capfd)
    assert_array_equal(load(tmp_path / "v.h5", time=1).values, field() + 1)


def test_threads_read_one_file(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file.create_dataset("v", data=field(), chunks=(8, 8, 8), compression="gzip")
    volume = load(tmp_path / "v.h5")
    assert isinstance(volume, LargeVolume)
    with ThreadPoolExecutor(8) as pool:
        parts = pool.map(lambda z: volume.part(0, (0, 0, z), (*volume.dimensions[:2], z + 1)).values, range(48))
        assert_array_equal(np.concatenate(list(parts)), field())


def test_a_corrupt_chunk_is_named_or_missing(tmp_path: Path) -> None:
    path = tmp_path / "v.h5"
    with h5py.File(path, "w") as file:
        made = file.create_dataset("v", data=field(), chunks=(16, 16, 16), compression="gzip")
        chunk = made.id.get_chunk_info_by_coord((32, 16, 0))
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset : chunk.byte_offset + 40] = bytes(40)
    path.write_bytes(content)
    message = str(raised(InputError, lambda: load(path).values))
    assert message.startswith(f"{path}: level 0: chunk 2, 1, 0 (")
    assert "\n" not in message
    wanted = field().astype(np.float32)
    wanted[32:48, 16:32, 0:16] = np.nan
    volume = load(path, missing_chunks=True)
    assert_array_equal(volume.values, wanted)
    assert "1 chunk could not be read" in volume.notes[-1]


@pytest.mark.parametrize("content", [b"whatever", b"\x89HDF\r\n\x1a\n" + bytes(100)])
@pytest.mark.parametrize("name", ["v.h5", "v.ims"])
def test_files_that_are_none(tmp_path: Path, name: str, content: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, capfd)


def test_a_file_cut_short(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_imaris(tmp_path / "v.ims", field()[np.newaxis])
    damage(tmp_path / "v.ims")
    refused(tmp_path / "v.ims", capfd)


def test_imaris_has_levels_channels_and_places(tmp_path: Path) -> None:
    values = np.stack([field(), field()[::-1]])
    path = write_imaris(tmp_path / "v.ims", values)
    volume = load(path)
    assert isinstance(volume, LargeVolume)
    assert_array_equal(volume.values, values[0])  # without what pads it
    assert_allclose(volume.spacing, SPACING)
    assert_allclose(volume.origin, ORIGIN)
    assert volume.unit == "µm"
    assert volume.notes == ()
    assert_allclose(volume.levels[1].factor, (2, 2, 2))
    assert_allclose(volume.levels[1].first, (0.5, 0.5, 0.5), atol=1e-12)
    nz, ny, nx = halved(values[0]).shape
    assert_array_equal(volume.part(1, (0, 0, 0), (nx, ny, nz)).values, halved(values[0]))
    (_, green), (second, red) = load_channels(path)
    assert_array_equal(second.values, values[1])
    assert green.name == "stain 0"
    assert red.colors[1, 0] > red.colors[1, 1] == 0
    assert_allclose(red.values, (10, 200))


def test_imaris_without_its_groups(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with h5py.File(tmp_path / "v.ims", "w") as file:
        file["v"] = field()
    assert "is HDF5 without Imaris' groups" in refused(tmp_path / "v.ims", capfd)
