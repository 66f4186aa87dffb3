"""Faults of stores: one line that names the store, the level and the chunk; missing chunks where they are allowed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.testing import assert_array_equal
from support.raised import raised
from support.refusal import refused
from support.stores import damage, field, write_ome

from texvol import InputError, Volume, load
from texvol.__main__ import main
from texvol.formats.stores.writing.convert import Layout, convert


def fault_of(path: Path, **options: Any) -> str:
    """The one line with which the samples of a store are refused."""
    with pytest.raises(InputError) as caught:
        _ = load(path, **options).values
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path}: ")
    assert len(message) < len(str(path)) + 450
    return message


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return write_ome(tmp_path / "v.ome.zarr", field(), levels=1)


@pytest.mark.parametrize(("version", "chunk"), [("0.4", "0/1/0/2"), ("0.5", "0/c/1/0/2")])
def test_a_corrupt_chunk_is_named_or_missing(tmp_path: Path, version: str, chunk: str) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=1, version=version)
    damage(path / chunk)
    message = fault_of(path)
    assert "level 0: chunk 1, 0, 2 (z, y, x) cannot be read" in message
    assert "--missing-chunks" in message
    volume = load(path, missing_chunks=True)
    assert volume.dtype == np.float32
    wanted = field().astype(np.float32)
    wanted[16:32, 0:16, 32:48] = np.nan
    assert_array_equal(volume.values, wanted)
    assert "level 0: 1 chunk could not be read and count as missing; the first is chunk 1, 0, 2" in volume.notes[-1]


def test_a_corrupt_shard_is_all_its_chunks(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=1, shard=32)
    damage(path / "0/c/0/1/0")
    assert "level 0: chunk 0, 2, 0 (z, y, x) cannot be read" in fault_of(path)
    volume = load(path, missing_chunks=True)
    assert np.isnan(volume.values[:32, 32:, :32]).all()
    assert np.isnan(volume.values).sum() == 32 * 12 * 32
    assert "4 chunks could not be read" in volume.notes[-1]


def test_chunks_of_other_channels_and_times_are_named_with_them(tmp_path: Path) -> None:
    values = np.stack([np.stack([field(20), field(20)])] * 2)
    path = write_ome(tmp_path / "v.ome.zarr", values, axes="tczyx", levels=1)
    damage(path / "0/c/1/1/0/0/1")
    assert load(path, channel=1, time=0).values.shape == field(20).shape
    assert "chunk 1, 1, 0, 0, 1 (t, c, z, y, x)" in fault_of(path, channel=1, time=1)


def test_a_chunk_that_is_not_there_has_the_fill_value(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=1, fill_value=17)
    (path / "0/c/0/0/0").unlink()
    wanted = field()
    wanted[:16, :16, :16] = 17
    assert_array_equal(load(path).values, wanted)


def test_damage_in_a_coarse_level_does_not_keep_the_others_from_being_read(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(), levels=2, shift=0.5)
    damage(path / "1/c/0/0/0")
    volume = load(path)
    assert_array_equal(volume.values, field())
    assert "was not checked" in volume.notes[0]
    assert "level 1: chunk 0, 0, 0" in str(raised(InputError, load, path, fix_pyramid=True))


@pytest.mark.parametrize("option", ["--missing-chunks", None])
def test_the_command_ends_with_status_2_or_draws_the_rest(
    store: Path, tmp_path: Path, option: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    damage(store / "0/c/2/1/1")
    line = ["render", str(store), "-o", str(tmp_path / "x.png"), "--size", "32x32", "--tf", "fog"]
    status = main([*line, *([option] if option else [])])
    captured = capsys.readouterr()
    assert len(captured.err.splitlines()) == 1, captured.err
    told = captured.err
    if option:
        assert status == 0
        assert told.startswith(f"texvol: note: {store}: level 0: 1 chunk could not be read and count as missing")
    else:
        assert status == 2
        assert told.startswith(f"texvol: error: {store}: level 0: chunk 2, 1, 1 (z, y, x) cannot be read")


def _ome(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((path / "zarr.json").read_text())
    return content


def _change(path: Path, change: Any) -> None:
    content = _ome(path)
    change(content["attributes"]["ome"])
    (path / "zarr.json").write_text(json.dumps(content))


def _datasets(ome: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = ome["multiscales"][0]["datasets"]
    return found


FAULTS: dict[str, tuple[Any, str]] = {
    "no datasets": (lambda ome: ome["multiscales"][0].pop("datasets"), "must be an object with a list of datasets"),
    "other version": (lambda ome: ome.update(version="0.9"), "is of version 0.9; texvol reads 0.1 to 0.5"),
    "no such array": (lambda ome: _datasets(ome)[0].update(path="9"), "has no array '9'"),
    "path that is none": (lambda ome: _datasets(ome)[0].update(path=4), "has a dataset without a path"),
    "scale of 0": (
        lambda ome: _datasets(ome)[0]["coordinateTransformations"][0].update(scale=[1, 0, 1]),
        "scale must be positive along every axis",
    ),
    "scale of two": (
        lambda ome: _datasets(ome)[0]["coordinateTransformations"][0].update(scale=[1, 1]),
        "must have 3 numbers, one for each axis",
    ),
    "scale of text": (
        lambda ome: _datasets(ome)[0]["coordinateTransformations"][0].update(scale=["a", 1, 1]),
        "must have finite numbers",
    ),
    "affine": (
        lambda ome: _datasets(ome)[0].update(coordinateTransformations=[{"type": "affine"}]),
        "must be a scale or a translation, got 'affine'",
    ),
    "axes that are one": (lambda ome: ome["multiscales"][0].update(axes=[{"name": "x"}]), "two or three axes of space"),
    "axes that are four": (
        lambda ome: ome["multiscales"][0]["axes"].append({"name": "t", "type": "time"}),
        "must have 4 numbers",
    ),
    "axes twice": (
        lambda ome: ome["multiscales"][0].update(axes=[{"name": each, "type": "space"} for each in "xxy"]),
        "",
    ),
    "multiscales of text": (lambda ome: ome.update(multiscales="none"), "must be a list, got str"),
    "no images": (lambda ome: ome.update(multiscales=[]), "without OME metadata"),
    "a plate": (
        lambda ome: ome.update(plate={"wells": [{"path": "A/1"}]}),
        "is a plate of many wells, which texvol does not read as one volume",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_metadata_that_are_wrong(store: Path, fault: str, capfd: pytest.CaptureFixture[str]) -> None:
    change, reason = FAULTS[fault]
    _change(store, change)
    if fault == "axes twice":  # names that tell nothing: z, y, x by their order
        assert load(store).shape == field().shape
        return
    assert reason in refused(store, capfd)


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"\xff\xfe", b'{"attributes": 3}', b"[" * 100_000])
def test_metadata_that_are_no_json_object(store: Path, content: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    (store / "zarr.json").write_bytes(content)
    refused(store, capfd)


@pytest.mark.parametrize("content", [b"", b"{", b'{"zarr_format": 3, "node_type": "array"}'])
def test_arrays_that_are_none(store: Path, content: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    (store / "0/zarr.json").write_bytes(content)
    refused(store, capfd)


def test_stores_that_hold_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "empty.zarr").mkdir()
    assert "is no Zarr store" in refused(tmp_path / "empty.zarr", capfd)
    assert "no such file" in refused(tmp_path / "nothing.zarr", capfd)
    zarr.open_group(tmp_path / "group.zarr", mode="w")
    assert "without OME metadata of an image" in refused(tmp_path / "group.zarr", capfd)


@pytest.mark.parametrize("dtype", ["complex64", "bool", "float16", ">f4", "int64"])
def test_types_of_samples(tmp_path: Path, dtype: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "v.zarr"
    zarr.create_array(path, data=(field(12) > 90).astype(dtype), chunks=(5, 6, 7), zarr_format=2)
    if dtype == "complex64":
        assert "must hold real numbers of at most 64 bits, got type complex64" in refused(path, capfd)
        return
    volume = load(path)
    assert volume.dtype == (np.uint8 if dtype == "bool" else np.dtype(dtype).newbyteorder("="))
    assert_array_equal(volume.values, (field(12) > 90).astype(volume.dtype))


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"series": "1"}, "--series is for"),
        ({"shape": (1, 1, 1), "dtype": "u1"}, "--shape and --dtype are for raw files"),
        ({"channel": 2}, "--channel 2: the file has no channel axis"),
        ({"channel": "magnitude"}, "channels are no components of vectors"),
        ({"level": -1}, "level must be auto or a number from 0, got -1"),
        ({"level": "fine"}, "level must be auto or a number from 0, got 'fine'"),
        ({"color": True}, "--color is for"),
        ({"variable": "a/b"}, "has no array 'a/b'"),
    ],
)
def test_options_that_do_not_fit(
    store: Path, options: dict[str, Any], reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert reason in refused(store, capfd, **options)


@pytest.mark.parametrize("option", [{"image": "a"}, {"level": 0}, {"fix_pyramid": True}, {"missing_chunks": True}])
def test_options_of_stores_are_refused_elsewhere(
    tmp_path: Path, option: dict[str, Any], capfd: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "v.npy", field(8))
    reason = "--image is for the images of Zarr" if "image" in option else "is for stores of chunks"
    assert reason in refused(tmp_path / "v.npy", capfd, **option)


def test_samples_of_a_value_are_missing_when_they_are_read(store: Path) -> None:
    mark = int(field()[5, 6, 7])
    volume = load(store, missing=mark)
    wanted = np.where(field() == mark, np.nan, field()).astype(np.float32)
    assert_array_equal(volume.values, wanted)


def test_statistics_are_read_or_refused(store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    counts = (3, 3, 4)
    group = zarr.open_group(store).create_group("texvol-statistics/0")
    group.attrs["texvol"] = {"version": 1, "chunk_shape": [16, 16, 16]}
    wanted = {}
    for number, name in enumerate(("minimum", "maximum", "variance", "lowest_around", "highest_around")):
        wanted[name] = np.random.default_rng(number).normal(size=counts)
        group.create_array(name, data=wanted[name])
    volume: Any = load(store)
    for name, each in wanted.items():
        assert_array_equal(getattr(volume.levels[0].statistics, name), each)
    assert volume.levels[0].statistics.chunk_shape == (16, 16, 16)
    assert load(store, missing=3).levels[0].statistics is None  # type: ignore[attr-defined]
    shutil.rmtree(store / "texvol-statistics/0/variance")
    group.create_array("variance", data=np.zeros((2, 2, 2)))
    assert "must have shape (3, 3, 4), one number for each chunk" in refused(store, capfd)
    group.attrs["texvol"] = {"version": 2, "chunk_shape": [16, 16, 16]}
    assert "must be statistics of version 1, got version 2" in refused(store, capfd)


def _restored(path: Path, **told: Any) -> None:
    """Write the array of level 0 anew with zarr-python, as another tool does that leaves our statistics alone."""
    array = zarr.open_array(path / "0", mode="r")
    values = told.pop("values", array[:])
    shutil.rmtree(path / "0")
    zarr.create_array(path / "0", data=values, **{"chunks": array.chunks, **told})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"chunks": (16, 8, 16)}, "it is of chunks of 16 x 16 x 16, and the array has chunks of 16 x 8 x 16"),
        ({"shards": (32, 32, 32), "chunks": (8, 8, 8)}, "and the array has chunks of 8 x 8 x 8"),
        ({"values": field(40)}, "it is of an array of 48 x 44 x 52, and the array has 40 x 36 x 44"),
        ({"values": field().astype("u1")}, "it is of values of type uint16, and the array has uint8"),
    ],
)
def test_statistics_of_another_array_are_left_out(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    path = tmp_path / "v.zarr"
    convert(Volume(field()), path, layout=Layout((16,) * 3, (32,) * 3))
    before: Any = load(path)
    assert before.levels[0].statistics is not None and not before.notes
    _restored(path, **change)
    after: Any = load(path)
    assert after.levels[0].statistics is None
    (note,) = after.notes
    assert note.startswith("its texvol-statistics/0 is left out: ") and said in note
    # A picture needs none.
    line = ["render", str(path), "-o", str(tmp_path / "x.png"), "--size", "16x16", "--tf", "fog"]
    assert main(line) == 0


def test_statistics_without_shape_and_type_are_those_of_earlier_versions(tmp_path: Path) -> None:
    path = tmp_path / "v.zarr"
    convert(Volume(field()), path, layout=Layout((16,) * 3, (32,) * 3))
    place = path / "texvol-statistics/0/zarr.json"
    content = json.loads(place.read_text())
    for name in ("shape", "data_type"):
        del content["attributes"]["texvol"][name]
    place.write_text(json.dumps(content))
    assert load(path).levels[0].statistics is not None  # type: ignore[attr-defined]


@pytest.mark.parametrize("path", ["../other.zarr/0", "0/../../other.zarr/0"])
def test_paths_of_datasets_stay_within_the_store(tmp_path: Path, path: str, capfd: pytest.CaptureFixture[str]) -> None:
    """A store from a stranger must not show what lies beside it."""
    write_ome(tmp_path / "other.zarr", field(), levels=1)
    store = write_ome(tmp_path / "v.zarr", field(), levels=1)
    _change(store, lambda ome: _datasets(ome)[0].update(path=path))
    assert f"must lie within the store, got the path '{path}/" in refused(store, capfd)


def _declare(path: Path, **told: Any) -> None:
    """Change the metadata of the array of level 0."""
    content = json.loads((path / "0/zarr.json").read_text())
    chunk = told.pop("chunk", None)
    if chunk is not None:
        content["chunk_grid"]["configuration"]["chunk_shape"] = chunk
    (path / "0/zarr.json").write_text(json.dumps(content | told))


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"chunk": [2**40, 16, 16]}, "its chunks of 1099511627776 x 16 x 16 need 512 TiB of memory"),
        ({"shape": [48, 44, 2**40]}, "must have at most 262144 chunks along an axis"),
        ({"shape": [2**18, 2**18, 2**18], "chunk": [16, 2**8, 2**8]}, "and 268435456 in all"),
        ({"shape": [2**62, 2**62, 2**62]}, "every dimension must be positive, and not absurd"),
    ],
)
def test_gigantic_shapes_and_chunks_take_no_memory(
    tmp_path: Path, told: dict[str, Any], said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """TensorStore ends the process where it has no memory for a chunk, and a list of all chunks takes all of it."""
    path = write_ome(tmp_path / "v.zarr", field(), levels=1)
    _declare(path, **told)
    assert said in refused(path, capfd)


def test_more_regions_than_can_be_listed_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ome(tmp_path / "v.zarr", field().astype("u1"), levels=1)
    _declare(path, shape=[2**15] * 3, chunk=[2**8] * 3)
    assert main(["render", str(path), "--plan", "--memory", "64MB"]) == 2
    assert "volume must be drawn in at most 1048576 regions" in capsys.readouterr().err


def test_statistics_with_gigantic_chunks_are_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "v.zarr"
    convert(Volume(field()), path, layout=Layout((16,) * 3, (32,) * 3))
    place = path / "texvol-statistics/0/minimum/zarr.json"
    content = json.loads(place.read_text())
    content["chunk_grid"]["configuration"]["chunk_shape"] = [2**40, 2, 2]
    place.write_text(json.dumps(content))
    assert "need 32 TiB of memory" in refused(path, capfd)


def test_links_to_nothing_are_files_that_are_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ome(tmp_path / "v.zarr", field(), levels=1, fill_value=17)
    (path / "0/c/0/0/0").unlink()
    (path / "0/c/0/0/0").symlink_to("nothing")
    assert main(["info", str(path)]) == 0
    assert "17 to" in capsys.readouterr().out


def test_statistics_of_chunks_longer_than_the_array_are_of_all_of_it(tmp_path: Path) -> None:
    """Numbers beyond 64 bits, too."""
    path = tmp_path / "v.zarr"
    convert(Volume(field(12)), path, layout=Layout((16,) * 3, (32,) * 3))
    place = path / "texvol-statistics/0/zarr.json"
    content = json.loads(place.read_text())
    content["attributes"]["texvol"]["chunk_shape"][0] = 10**30
    place.write_text(json.dumps(content))
    read: Any = load(path)
    assert read.levels[0].statistics.chunk_shape == read.levels[0].source.chunk_shape
    assert main(["render", str(path), "--plan"]) == 0


def test_absurdly_many_channels_are_not_listed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = write_ome(tmp_path / "v.zarr", np.stack([field(12)] * 2), axes="czyx", levels=1)
    _declare(path, shape=[2**40, *field(12).shape])
    assert "choose one with --channel 0..1099511627775" in refused(path, capfd)
    assert_array_equal(load(path, channel=1).values, field(12))
