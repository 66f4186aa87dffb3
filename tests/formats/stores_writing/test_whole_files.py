"""Conversion of whole files: every time step, channel and labels image of every kind of file, and what is chosen."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray
from support.large import statistics_of
from support.stores import field, halved, write_imaris, write_ome

from texvol import load
from texvol.__main__ import main
from texvol.formats.stores.writing.reducing import reduced

pytest.importorskip("tensorstore")
SMALL = ["--chunk", "8", "--shard", "16"]
OMERO: list[dict[str, Any]] = [
    {"label": "DNA", "color": "0000FF", "window": {"min": 0, "max": 9, "start": 10, "end": 200}, "active": True},
    {"label": "actin", "color": "00FF00", "window": {"min": 0, "max": 9, "start": 5, "end": 150}, "active": False},
]


def steps(times: int = 3, channels: int = 2, size: int = 20) -> NDArray[np.int16]:
    """Different samples of each time step and channel, shape (t, c, z, y, x)."""
    one = field(size, "int16")
    return np.array([[one + 7 * t + 100 * c for c in range(channels)] for t in range(times)], np.int16)


def _tiff(path: Path, values: NDArray, axes: str = "TZCYX") -> Path:
    import tifffile

    sizes = {"PhysicalSizeX": 0.5, "PhysicalSizeY": 1.0, "PhysicalSizeZ": 2.0, "TimeIncrement": 2.5}
    tifffile.imwrite(path, values.transpose(0, 2, 1, 3, 4), ome=True, metadata={"axes": axes, **sizes})
    return path


def _nifti(path: Path, values: NDArray) -> Path:
    import nibabel

    image = nibabel.Nifti1Image(values.T, np.diag([0.5, 1, 2, 1]))
    image.header.set_xyzt_units("mm", "sec")
    image.header["pixdim"][4] = 2.5
    nibabel.save(image, path)
    return path


def _nrrd(path: Path, values: NDArray) -> Path:
    import nrrd

    directions = [[np.nan] * 3, [0.5, 0, 0], [0, 1, 0], [0, 0, 2]]
    kinds = ["list", "space", "space", "space"]
    nrrd.write(
        str(path), values.transpose(0, 3, 2, 1), {"kinds": kinds, "space": "ras", "space directions": directions}
    )
    return path


def _hdf5(path: Path, values: NDArray) -> Path:
    import h5py

    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("a", data=values, chunks=(1, 1, 8, 8, 8), compression="gzip")
        for axis, letter in enumerate("tczyx"):
            dataset.dims[axis].label = letter
    return path


def _npy(path: Path, values: NDArray) -> Path:
    np.save(path, values)
    return path


SOURCES: dict[str, tuple[Callable[[Path], Path], NDArray, str]] = {
    "ome 0.4": (lambda f: write_ome(f / "v.zarr", steps(), axes="tczyx", version="0.4", levels=2), steps(), "tczyx"),
    "ome 0.5": (lambda f: write_ome(f / "v.zarr", steps(), axes="czyxt", levels=1), steps(), "tczyx"),
    "imaris": (lambda f: write_imaris(f / "v.ims", steps()[1], levels=1), steps()[1], "czyx"),
    "hdf5": (lambda f: _hdf5(f / "v.h5", steps()), steps(), "tczyx"),
    "tiff": (lambda f: _tiff(f / "v.ome.tif", steps()), steps(), "tczyx"),
    "nifti": (lambda f: _nifti(f / "v.nii", steps()[:, 0]), steps()[:, 0], "tzyx"),
    "nifti packed": (lambda f: _nifti(f / "v.nii.gz", steps()[:, 0]), steps()[:, 0], "tzyx"),
    "nrrd list": (lambda f: _nrrd(f / "v.nrrd", steps()[0]), steps()[0], "czyx"),
    "npy of four axes": (lambda f: _npy(f / "v.npy", steps()[0]), steps()[0], "czyx"),
    "npy of five axes": (lambda f: _npy(f / "v.npy", steps()), steps().swapaxes(0, 1), "tczyx"),
}


@pytest.mark.parametrize("source", SOURCES)
def test_every_time_step_and_channel_is_written(source: str, tmp_path: Path) -> None:
    """Read by zarr-python and ngff-zarr, and by texvol."""
    ngff_zarr = pytest.importorskip("ngff_zarr")
    write, values, axes = SOURCES[source]
    path, out = write(tmp_path), tmp_path / "out.ome.zarr"
    assert main(["convert", str(path), str(out), *SMALL]) == 0
    assert_array_equal(zarr.open(f"{out}/0")[:], values)
    image = ngff_zarr.from_ngff_zarr(str(out)).images[0]
    assert "".join(image.dims) == axes
    assert_array_equal(np.asarray(image.data), values)
    for place in np.ndindex(*values.shape[:-3]):
        options = {("time" if letter == "t" else "channel"): at for letter, at in zip(axes, place, strict=False)}
        found: Any = load(out, **options)
        assert_array_equal(found.values, values[place])
        truth = statistics_of(values[place], 8)
        assert_allclose(found.levels[0].statistics.maximum, truth.maximum)
        assert_allclose(found.levels[0].statistics.highest_around, truth.highest_around)
    if source in ("ome 0.4", "ome 0.5", "tiff", "nifti"):
        assert image.scale["t"] == 2.5
        assert image.axes_units["t"] == "second"
        assert_allclose(np.diff(found.times), 2.5)
        assert found.time_unit == "s"
        assert_allclose(found.spacing, (0.5, 1, 2))


def test_an_axis_without_a_name_is_time_where_the_line_says_so(tmp_path: Path) -> None:
    values = steps()[:, 0]
    np.save(tmp_path / "v.npy", values)
    assert main(["convert", f"{tmp_path}/v.npy", f"{tmp_path}/t.zarr", "--time", "all"]) == 0
    assert [each["name"] for each in ome(tmp_path / "t.zarr")["multiscales"][0]["axes"]] == list("tzyx")
    assert main(["convert", f"{tmp_path}/v.npy", f"{tmp_path}/one.zarr", "--time", "1"]) == 0
    assert_array_equal(zarr.open(f"{tmp_path}/one.zarr/0")[:], values[1])


def ome(store: Path) -> dict[str, Any]:
    """Metadata of OME of a store of version 0.5."""
    found: dict[str, Any] = json.loads((store / "zarr.json").read_text())["attributes"]["ome"]
    return found


@pytest.mark.parametrize("version", ["0.4", "0.5"])
@pytest.mark.parametrize("zarr_format", ["2", "3"])
def test_channels_keep_their_names_colours_and_windows(tmp_path: Path, version: str, zarr_format: str) -> None:
    path = write_ome(tmp_path / "v.zarr", steps(), axes="tczyx", version=version, omero=OMERO, levels=1)
    out = tmp_path / "out.zarr"
    assert main(["convert", str(path), str(out), "--zarr-format", zarr_format]) == 0
    before, after = (load(each, channel=1, time=2) for each in (path, out))
    assert after.channels == before.channels  # type: ignore[attr-defined]
    assert after.times == before.times == (10.0, 12.5, 15.0)  # type: ignore[attr-defined]
    assert (
        main(["render", str(out), "--time", "1", "--channel", "1", "-o", f"{tmp_path}/p.png", "--size", "16x16"]) == 0
    )
    assert main(["info", str(out), "--time", "1"]) == 0
    ngff_zarr = pytest.importorskip("ngff_zarr")
    told = ngff_zarr.from_ngff_zarr(str(out)).metadata.omero.channels
    assert [(each.label, each.color, each.window.start, each.window.end) for each in told] == [
        ("DNA", "0000FF", 10, 200),
        ("actin", "00FF00", 5, 150),
    ]


def test_a_channel_without_a_window_gets_its_values(tmp_path: Path) -> None:
    omero = [{"label": "DNA", "color": "0000FF"}, {"label": "actin"}]
    values = steps(2)
    path = write_ome(tmp_path / "v.zarr", values, axes="tczyx", omero=omero, levels=1)
    assert main(["convert", str(path), f"{tmp_path}/out.zarr"]) == 0
    for number, each in enumerate(ome(tmp_path / "out.zarr")["omero"]["channels"]):
        own = values[:, number]
        assert (each["window"]["start"], each["window"]["end"]) == (own.min(), own.max())


def test_only_what_is_chosen_is_written(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.zarr", steps(), axes="tczyx", omero=OMERO, levels=2)
    for options, wanted, axes in (
        (["--channel", "1"], steps()[:, 1:], "tczyx"),
        (["--time", "2"], steps()[2], "czyx"),
        (["--time", "2", "--channel", "1"], steps()[2, 1:], "czyx"),
    ):
        out = tmp_path / f"{''.join(options)}.zarr"
        assert main(["convert", str(path), str(out), *options]) == 0
        assert_array_equal(zarr.open(f"{out}/0")[:], wanted)
        told = ome(out)
        assert [each["name"] for each in told["multiscales"][0]["axes"]] == list(axes)
        assert told["omero"]["channels"][-1]["label"] == "actin"
    assert main(["convert", str(path), f"{tmp_path}/level.zarr", "--level", "1", "--channel", "0", "--time", "0"]) == 0
    assert_array_equal(load(tmp_path / "level.zarr").values, halved(steps()[0, 0]))
    assert main(["convert", str(path), f"{tmp_path}/no.zarr", "--channel", "7"]) == 2


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_labels_come_with_their_image(tmp_path: Path, version: str) -> None:
    values = steps(2, 1, 70)[:, 0]
    path = write_ome(tmp_path / "v.zarr", values, axes="tzyx", version=version, levels=1)
    named = np.where(values > 100, np.int16(5), np.int16(0))
    colors = {"colors": [{"label-value": 5, "rgba": [255, 0, 0, 255]}]}
    kind = {"group": "labels/nuclei", "version": version, "levels": 1, "more": {"image-label": colors}}
    write_ome(path, named, axes="tzyx", **kind)
    root = zarr.open_group(path / "labels", mode="a", zarr_format=2 if version == "0.4" else 3)
    told = {"labels": ["nuclei"]}
    root.attrs.update(told if version == "0.4" else {"ome": told | {"version": "0.5"}})
    out = tmp_path / "out.zarr"
    assert main(["convert", str(path), str(out), "--chunk", "32", "--shard", "64"]) == 0
    read: Any = load(out, image="labels/nuclei", time=1)
    assert read.labels and len(read.levels) > 1
    assert_array_equal(read.values, named[1])
    factor = tuple(round(each) for each in read.levels[1].factor[::-1])
    assert_array_equal(read.at_level(1).values, reduced(named[1], factor, labels=True))  # type: ignore[arg-type]
    assert json.loads((out / "labels/nuclei/zarr.json").read_text())["attributes"]["ome"]["image-label"] == colors
    assert zarr.open_group(out / "labels").attrs["ome"]["labels"] == ["nuclei"]
    assert load(out, time=1).images == ("v", "labels/nuclei")  # type: ignore[attr-defined]
    assert main(["convert", str(path), f"{tmp_path}/one.zarr", "--time", "1", "--spacing", "1,2,4"]) == 0
    assert_array_equal(zarr.open(f"{tmp_path}/one.zarr/labels/nuclei/0")[:], named[1])
    assert_allclose(load(tmp_path / "one.zarr", image="labels/nuclei").spacing, (1, 2, 4))
    assert main(["convert", str(path), f"{tmp_path}/alone.zarr", "--image", "labels/nuclei"]) == 0
    assert load(tmp_path / "alone.zarr", time=0).labels
    assert not (tmp_path / "alone.zarr/labels").exists()


def test_names_of_labels_stay_within_the_store(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ome(tmp_path / "v.zarr", field(12), levels=1)
    write_ome(path, field(12), levels=1, group="a")
    zarr.open_group(path / "labels", mode="a").attrs["ome"] = {"version": "0.5", "labels": ["../a"]}
    assert main(["convert", str(path), f"{tmp_path}/out.zarr"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (tmp_path / "out.zarr").exists()


def test_colours_become_channels(tmp_path: Path) -> None:
    import tifffile

    pixels = np.random.default_rng(1).integers(0, 255, (6, 8, 9, 3), np.uint8)
    tifffile.imwrite(tmp_path / "c.tif", pixels, photometric="rgb")
    assert main(["convert", f"{tmp_path}/c.tif", f"{tmp_path}/c.zarr"]) == 0
    assert_array_equal(zarr.open(f"{tmp_path}/c.zarr/0")[:], pixels.transpose(3, 0, 1, 2))
    told = ome(tmp_path / "c.zarr")["omero"]["channels"]
    assert [(each["label"], each["color"]) for each in told] == [
        ("red", "FF0000"),
        ("green", "00FF00"),
        ("blue", "0000FF"),
    ]
    assert main(["convert", f"{tmp_path}/c.tif", f"{tmp_path}/d.zarr", "--color"]) == 2


def test_times_that_are_uneven_are_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import netCDF4

    with netCDF4.Dataset(tmp_path / "v.nc", "w") as file:
        for name, positions in (("time", [0, 1, 5]), ("z", range(4)), ("y", range(5)), ("x", range(6))):
            file.createDimension(name, len(positions))
            file.createVariable(name, "f8", (name,))[:] = list(positions)
        file["time"].units = "hours since 2001-01-01"
        file.createVariable("v", "f4", ("time", "z", "y", "x"))[:] = np.arange(360.0).reshape(3, 4, 5, 6)
    assert main(["convert", f"{tmp_path}/v.nc", f"{tmp_path}/v.zarr"]) == 0
    assert "time steps are uneven" in capsys.readouterr().err
    read: Any = load(tmp_path / "v.zarr", time=2)
    assert read.times == (0, 1, 5)
    assert read.time_unit == "hours since 2001-01-01"
    assert_array_equal(read.values, np.arange(240.0, 360).reshape(4, 5, 6))


def test_a_step_with_missing_samples_makes_floats_of_all(tmp_path: Path) -> None:
    values = np.stack([field(10, "int16"), field(10, "int16")])
    values[1, 3, 2, 1] = -999
    _nifti(tmp_path / "v.nii", values)
    assert main(["convert", f"{tmp_path}/v.nii", f"{tmp_path}/v.zarr", "--missing=-999"]) == 0
    read = zarr.open(f"{tmp_path}/v.zarr/0")[:]
    assert_array_equal(read, np.where(values == -999, np.nan, values).astype(np.float32))


def test_channels_of_tiffs_keep_what_ome_and_imagej_say(tmp_path: Path) -> None:
    import tifffile

    values = steps(1)[0].transpose(1, 0, 2, 3).astype("u2")
    names = {"Name": ["DNA & RNA", "actin"], "Color": [int.from_bytes(b"\x00\x00\xff\xff", "big", signed=True), -1]}
    tifffile.imwrite(tmp_path / "o.ome.tif", values, ome=True, metadata={"axes": "ZCYX", "Channel": names})
    tables = [np.outer(color, np.arange(256)).astype("u1") for color in ((0, 0, 1), (1, 1, 0))]
    imagej = {"axes": "ZCYX", "LUTs": tables, "Ranges": (10.0, 200.0, 5.0, 150.0), "mode": "composite"}
    tifffile.imwrite(tmp_path / "i.tif", values, imagej=True, metadata=imagej)
    for name in ("o.ome.tif", "i.tif"):
        assert main(["convert", f"{tmp_path}/{name}", f"{tmp_path}/{name}.zarr"]) == 0
    told = [ome(tmp_path / f"{name}.zarr")["omero"]["channels"] for name in ("o.ome.tif", "i.tif")]
    assert [(each["label"], each["color"]) for each in told[0]] == [("DNA & RNA", "0000FF"), ("actin", "FFFFFF")]
    assert [each["color"] for each in told[1]] == ["0000FF", "FFFF00"]
    assert [(each["window"]["start"], each["window"]["end"]) for each in told[1]] == [(10, 200), (5, 150)]
    assert main(["convert", f"{tmp_path}/i.tif", f"{tmp_path}/one.zarr", "--channel", "1"]) == 0
    assert [each["color"] for each in ome(tmp_path / "one.zarr")["omero"]["channels"]] == ["FFFF00"]


def test_imaris_tells_its_times(tmp_path: Path) -> None:
    import h5py

    write_imaris(tmp_path / "v.ims", steps()[0], levels=1)
    with h5py.File(tmp_path / "v.ims", "a") as file:
        level = file["DataSet/ResolutionLevel 0"]
        about = file.create_group("DataSetInfo/TimeInfo")
        for step in range(3):
            if step:
                level.copy("TimePoint 0", f"TimePoint {step}")
            text = f"2011-01-01 00:00:{5 * step:02}.500"
            about.attrs[f"TimePoint{step + 1}"] = np.array([each.encode() for each in text], "S1")
        level["TimePoint 2/Channel 1/Data"][:] = 9
    assert main(["convert", f"{tmp_path}/v.ims", f"{tmp_path}/v.zarr"]) == 0
    read: Any = load(tmp_path / "v.zarr", time=2, channel=1)
    assert (read.times, read.time_unit) == ((0, 5, 10), "s")
    assert read.channels[1].name == "stain 1"
    assert (read.values == 9).all()
    assert_array_equal(load(tmp_path / "v.zarr", time=1, channel=1).values, steps()[0, 1])


def test_absurdly_many_time_steps_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ome(tmp_path / "v.zarr", steps(2, 1)[:, 0], axes="tzyx", levels=1)
    content = json.loads((path / "0/zarr.json").read_text())
    content["shape"][0] = 2**40
    (path / "0/zarr.json").write_text(json.dumps(content))
    assert main(["convert", str(path), f"{tmp_path}/out.zarr"]) == 2
    assert "must have at most 1000000 time steps and channels in all" in capsys.readouterr().err
    assert main(["convert", str(path), f"{tmp_path}/out.zarr", "--time", "1"]) == 0
