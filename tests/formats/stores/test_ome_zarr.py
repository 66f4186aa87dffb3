"""OME-Zarr of other writers: samples, places, levels, channels, times, images."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ngff_zarr
import numpy as np
import pytest
import zarr
from numpy.testing import assert_allclose, assert_array_equal
from support.raised import raised
from support.real_data import real_volume
from support.refusal import refused
from support.stores import ORIGIN, SPACING, field, halved, transformations, write_ome

from texvol import TimeSeries, load, load_channels
from texvol.scene.large_volume import LargeVolume


def opened(path: Path | str, **options: Any) -> LargeVolume:
    volume = load(path, **options)
    assert isinstance(volume, LargeVolume)
    return volume


@pytest.mark.parametrize("version", ["0.4", "0.5"])
@pytest.mark.parametrize("axes", ["zyx", "xyz", "tczyx", "czyx"])
def test_samples_levels_and_places_are_those_that_were_written(tmp_path: Path, version: str, axes: str) -> None:
    values = field()
    stored = values.reshape((1,) * (len(axes) - 3) + values.shape)
    volume = opened(write_ome(tmp_path / "v.ome.zarr", stored, version=version, axes=axes))
    assert_array_equal(volume.values, values)
    assert_allclose(volume.spacing, SPACING)
    assert_allclose(volume.origin, ORIGIN)
    assert volume.unit == "µm"
    assert volume.notes == ()
    assert [each.factor for each in volume.levels] == [(1.0,) * 3, (2.0,) * 3, (4.0,) * 3]
    assert_allclose([each.first for each in volume.levels], [[0] * 3, [0.5] * 3, [1.5] * 3], atol=1e-12)
    for number, wanted in enumerate((values, halved(values), halved(halved(values)))):
        nz, ny, nx = wanted.shape
        part = volume.part(number, (3, 2, 1), (nx, ny - 1, nz - 2))
        assert_array_equal(part.values, wanted[1 : nz - 2, 2 : ny - 1, 3:])
        assert part.dtype == np.uint16


def test_shards_are_read_by_their_inner_chunks(tmp_path: Path) -> None:
    volume = opened(write_ome(tmp_path / "v.ome.zarr", field(), shard=32, levels=2))
    assert volume.levels[0].source.chunk_shape == (16, 16, 16)
    before = volume.levels[0].source.bytes_read
    assert_array_equal(volume.part(0, (0, 0, 0), (16, 16, 16)).values, field()[:16, :16, :16])
    one = volume.levels[0].source.bytes_read - before
    assert 0 < one < 16**3 * 2 + 3000  # a chunk and the index of its shard, not the shard


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_ngff_zarr_is_read(tmp_path: Path, version: str) -> None:
    values = field(64)
    image = ngff_zarr.to_ngff_image(
        values, dims=("z", "y", "x"), scale={"z": 2.0, "y": 1.0, "x": 0.5}, translation={"z": -1.0, "y": 3.0, "x": 5.0},
        axes_units=dict.fromkeys("zyx", "micrometer"),
    )  # fmt: skip
    # Any method: that of the default would first compile its library, for twenty seconds.
    method = ngff_zarr.Methods.DASK_IMAGE_MODE
    scales = ngff_zarr.to_multiscales(image, scale_factors=[2, 4], chunks=32, method=method)
    ngff_zarr.to_ngff_zarr(str(tmp_path / "v.ome.zarr"), scales, version=version)
    volume = opened(tmp_path / "v.ome.zarr")
    assert_array_equal(volume.values, values)
    assert_allclose(volume.origin, ORIGIN)
    assert_allclose(volume.spacing, SPACING)
    assert len(volume.levels) == 3
    assert volume.notes == ()


@pytest.mark.parametrize("version", ["v04", "v05"])
def test_a_nucleus_of_two_channels(version: str) -> None:
    volume = opened(real_volume(f"nucleus/dna_conf_wf_{version}.ome.zarr"))
    assert volume.dimensions == (133, 130, 45)
    assert len(volume.channels) == 2
    assert len(volume.levels) == 3
    assert not any("lies" in each for each in volume.notes)  # its translations are right
    other = opened(real_volume(f"nucleus/dna_conf_wf_{version}.ome.zarr"), channel=1)
    assert (other.values != volume.values).any()


def test_channels_have_their_colours_and_windows(tmp_path: Path) -> None:
    values = np.stack([field(), field()[::-1], field() // 2])
    omero = [
        {"label": "DNA", "color": "0000FF", "window": {"start": 20, "end": 120, "min": 0, "max": 255}, "active": True},
        {"label": "actin", "color": "#ff8000", "active": False},
        {"label": "RNA", "color": "00FF00", "window": {"start": 0, "end": 65535}},
    ]
    path = write_ome(tmp_path / "v.ome.zarr", values, axes="czyx", omero=omero, levels=1)
    (first, blue), (second, green) = load_channels(path)
    assert_array_equal(first.values, values[0])
    assert_array_equal(second.values, values[2])
    assert_allclose(blue.values, [20, 120])
    assert blue.emissive
    assert_array_equal(blue.colors[:, :2], 0)
    assert blue.colors[1, 2] > blue.colors[0, 2] == 0
    assert green.values[1] < 255  # a window as wide as the type says nothing
    assert "channel 0 DNA of 3: 0 DNA, 1 actin, 2 RNA" in first.notes[0]
    assert second.source["channel"] == 2
    assert "--channel must be in 0..2, got 3" in str(raised(ValueError, load, path, channel=3))


def test_times_are_a_series(tmp_path: Path) -> None:
    values = np.stack([field(24), field(24) + 7, field(24) + 20])
    path = write_ome(tmp_path / "v.ome.zarr", values, axes="tzyx", levels=2)
    with TimeSeries(path) as series:
        assert len(series) == 3
        assert_allclose(np.array(series.times), [10, 12.5, 15])
        assert series.time_unit == "s"
        assert_array_equal(series[2].values, values[2])
    assert_array_equal(load(path, time=1).values, values[1])


def test_an_array_of_two_axes_is_one_layer(tmp_path: Path) -> None:
    root = zarr.open_group(tmp_path / "v.ome.zarr", mode="w")
    root.create_array("0", data=field()[20])
    axes = [{"name": each, "type": "space"} for each in "yx"]
    dataset = {"path": "0", "coordinateTransformations": transformations((3, 2), None)}
    root.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": [dataset]}]}
    volume = load(tmp_path / "v.ome.zarr")
    assert_array_equal(volume.values, field()[20:21])
    assert_allclose(volume.spacing, (2, 3, 1))


def test_transformations_of_the_whole_come_after_those_of_the_level(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=2)
    root = zarr.open_group(path)
    ome = root.attrs["ome"]
    ome["multiscales"][0]["coordinateTransformations"] = transformations((10, 10, 10), (1, 2, 3))
    root.attrs["ome"] = ome
    volume = opened(path)
    assert_allclose(volume.spacing, np.array(SPACING) * 10)
    assert_allclose(volume.origin, np.array(ORIGIN) * 10 + (3, 2, 1))
    assert_allclose(volume.levels[1].first, (0.5, 0.5, 0.5))


def test_units_that_differ_become_those_of_x(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=1)
    root = zarr.open_group(path)
    ome = root.attrs["ome"]
    ome["multiscales"][0]["axes"][0]["unit"] = "nanometer"
    root.attrs["ome"] = ome
    volume = load(path)
    assert volume.unit == "µm"
    assert_allclose(volume.spacing, (0.5, 1, 0.002))


def test_images_of_one_store_are_chosen_by_name_number_or_path(tmp_path: Path) -> None:
    path = tmp_path / "v.ome.zarr"
    write_ome(path, field(20), group="0", levels=1)
    write_ome(path, field(24), group="1", levels=1)
    root = zarr.open_group(path)
    root.attrs["ome"] = {"version": "0.5", "bioformats2raw.layout": 3}
    assert load(path, image="1").shape == field(24).shape
    assert load(path, image=0).shape == field(20).shape
    message = str(raised(ValueError, load, path))
    assert "has 2 images, --image NAME chooses one: 0, 1" in message
    root.create_group("OME").attrs["ome"] = {"version": "0.5", "series": ["1", "0"]}
    assert load(path, image="1").shape == field(24).shape
    assert "has no image 'nope' (--image); it has 1, 0" in str(raised(ValueError, load, path, image="nope"))


def test_groups_without_metadata_are_listed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "v.zarr"
    write_ome(path, field(20), group="left", levels=1)
    write_ome(path, field(24), group="right", levels=1)
    assert "its groups and arrays are left, right: --image NAME" in refused(path, capfd)
    assert load(path, image="left").shape == field(20).shape


def test_labels_are_an_image_of_their_own(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=1)
    labels = (field() > 100).astype(np.uint32) * 7
    write_ome(path, labels, group="labels/nuclei", levels=2, more={"image-label": {}}, down=lambda v: v[::2, ::2, ::2])
    zarr.open_group(path)["labels"].attrs["ome"] = {"version": "0.5", "labels": ["nuclei"]}
    volume = load(path, image="labels/nuclei")
    assert volume.labels
    assert_array_equal(volume.values, labels)
    assert not load(path).labels
    assert "labels/nuclei" in load(path).notes[0]


def test_a_level_is_a_volume_of_its_own(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field())
    volume = opened(path, level=1)
    assert_array_equal(volume.values, halved(field()))
    assert_allclose(volume.spacing, np.array(SPACING) * 2)
    assert_allclose(volume.origin, np.array(ORIGIN) + np.array(SPACING) / 2)
    assert volume.source["level"] == 1
    assert len(volume.levels) == 2
    assert "level must be from 0 to 2, got 3" in str(raised(ValueError, load, path, level=3))


def test_values_beyond_the_memory_are_refused(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field())
    volume = load(path, memory=1000)
    assert "choose a coarser level by --level" in str(raised(ValueError, lambda: volume.values))


def test_transformations_are_applied_one_after_the_other() -> None:
    from texvol.formats.stores.ome import _transformation

    moved = {"type": "translation", "translation": [1, 2, 3]}
    content = [{"type": "scale", "scale": [2, 2, 2]}, moved, {"type": "scale", "scale": [10, 1, 0.5]}]
    assert _transformation(content, 3, "x") == ([20, 2, 1], [10, 2, 1.5])
