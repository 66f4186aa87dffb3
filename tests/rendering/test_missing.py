"""Values that stand for none: those that files mark, and those that the user names, are missing everywhere."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.dicom_files import slice_of, written_series
from support.small_fields import wave

from texvol import InputError, load
from texvol.__main__ import main
from texvol.cli import information
from texvol.comparison.pictures import read_picture
from texvol.formats.readers import TimeSeries
from texvol.provenance.stored_scene import stored_scene_of

HOLES = np.zeros((6, 6, 6), np.bool_)
HOLES[1, 2, 3] = HOLES[4, :2] = True


def marked_by(mark: float, dtype: str) -> NDArray:
    """A wave with that value where the holes are."""
    return np.where(HOLES, np.dtype(dtype).type(mark), wave(6, dtype))


def check(values: NDArray, dtype: str, made: str, of: str | None = None) -> None:
    """The holes are missing, all else is as it was."""
    assert values.dtype == np.dtype(made)
    np.testing.assert_array_equal(np.isnan(values), HOLES)
    np.testing.assert_array_equal(values[~HOLES], wave(6, of or dtype)[~HOLES])


TYPES = [
    ("u1", 255, "f4"), ("i2", -32768, "f4"), ("i4", -(2**31), "f4"), ("u4", 2**32 - 1, "f4"), ("i8", -(2**63), "f4"),
    ("f4", -3.4028235e38, "f4"), ("f4", 9.96921e36, "f4"), ("f4", -9999, "f4"), ("f8", -1.7976931348623157e308, "f8"),
    ("f8", 1e8, "f8"), ("f4", np.inf, "f4"),
]  # fmt: skip


@pytest.mark.parametrize(("dtype", "mark", "made"), TYPES)
def test_a_value_that_the_user_names(tmp_path: Path, dtype: str, mark: float, made: str) -> None:
    path = tmp_path / "v.npy"
    np.save(path, marked_by(mark, dtype))
    volume = load(path, missing=mark)
    check(volume.values, dtype, made)
    assert volume.has_missing and volume.source["missing"] == [mark]
    assert any(f"missing: {HOLES.sum()} samples" in note for note in volume.notes)
    assert not load(path, missing=[7.25, 10**30]).has_missing


def test_integers_that_single_precision_has_not_become_double(tmp_path: Path) -> None:
    values = np.where(HOLES, -1, wave(6, "i8") + 2**24)
    np.save(tmp_path / "v.npy", values)
    found = load(tmp_path / "v.npy", missing=-1).values
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found[~HOLES], values[~HOLES])


def nifti(path: Path, values: NDArray) -> None:
    import nibabel

    nibabel.save(nibabel.Nifti1Image(values.T, np.eye(4)), path)


def nrrd(path: Path, values: NDArray, *pairs: str) -> None:
    kinds = {"i2": "short", "f4": "float"}
    head = f"NRRD0004\ntype: {kinds[values.dtype.str[1:]]}\ndimension: 3\nsizes: 6 6 6\nendian: little\nencoding: raw\n"
    path.write_bytes((head + "".join(f"{pair}\n" for pair in pairs) + "\n").encode() + values.tobytes())


def metaimage(path: Path, values: NDArray) -> None:
    import SimpleITK

    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(values), path)


def tiff(path: Path, values: NDArray, **how: Any) -> None:
    import tifffile

    tifffile.imwrite(path, values, photometric="minisblack", **how)


def mrc(path: Path, values: NDArray) -> None:
    import mrcfile

    with mrcfile.new(path, values):
        pass


def netcdf(path: Path, values: NDArray, fill: float | None = None, **attributes: Any) -> None:
    import netCDF4

    with netCDF4.Dataset(path, "w") as dataset:
        for name in "zyx":
            dataset.createDimension(name, 6)
        variable = dataset.createVariable("v", values.dtype, ("z", "y", "x"), fill_value=fill)
        variable.set_auto_maskandscale(False)
        for name, value in attributes.items():
            variable.setncattr(name, values.dtype.type(value))
        variable[:] = values


def vti(path: Path, values: NDArray, more: str = "", kind: str = "PointData", to: int = 5) -> None:
    code = {"i2": "Int16", "f4": "Float32"}[values.dtype.str[1:]]
    words = " ".join(map(str, values.ravel()))
    path.write_text(
        f'<VTKFile type="ImageData"><ImageData WholeExtent="0 {to} 0 {to} 0 {to}"><Piece Extent="0 {to} 0 {to} 0 {to}">'
        f'<{kind}><DataArray type="{code}" Name="v" format="ascii">{words}</DataArray>{more}</{kind}>'
        "</Piece></ImageData></VTKFile>"
    )


def dicom(path: Path, values: NDArray, **fields: Any) -> None:
    written_series(path, values=values, **fields)


WRITERS: dict[str, Callable[..., None]] = {
    "v.nii.gz": nifti, "v.nrrd": nrrd, "v.mha": metaimage, "v.tif": tiff, "v.mrc": mrc, "v.nc": netcdf, "v.vti": vti,
}  # fmt: skip


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_knows_values_that_the_user_names(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name, marked_by(-9999, "i2"))
    check(load(tmp_path / name, missing=[-9999, 12345]).values, "i2", "f4")


def test_dicom_and_raw_know_values_that_the_user_names(tmp_path: Path) -> None:
    folder = tmp_path / "series"
    folder.mkdir()
    dicom(folder, marked_by(-2000, "i2"), RescaleSlope=1, RescaleIntercept=-24)
    found = load(folder, missing=-2024).values + 24
    check(found, "i2", "f4")
    marked_by(-9999, "i2").tofile(tmp_path / "v.raw")
    check(load(tmp_path / "v.raw", shape=(6, 6, 6), dtype="i2", missing=-9999).values, "i2", "f4")


@pytest.mark.parametrize(
    "attributes",
    [
        {"fill": -9999}, {"missing_value": -9999}, {"valid_min": 0}, {"valid_range": [0, 300]},
        {"valid_range": [-300, 300]},
    ],
)  # fmt: skip
@pytest.mark.parametrize("dtype", ["i2", "f4"])
def test_netcdf_marks(tmp_path: Path, attributes: dict[str, Any], dtype: str) -> None:
    netcdf(tmp_path / "v.nc", marked_by(-9999, dtype), **attributes)
    check(load(tmp_path / "v.nc").values, dtype, "f4")
    labels = load(tmp_path / "v.nc", labels=True, variable="v") if dtype == "i2" else None
    assert labels is None or (labels.values[HOLES] == 0).all(), "a label that is missing is none"


@pytest.mark.parametrize("pairs", [("_FillValue:=-9999",), ("missing_value:=-9999",), ("missing_value:=1e20 -9999",)])
@pytest.mark.parametrize("dtype", ["i2", "f4"])
def test_nrrd_marks(tmp_path: Path, pairs: tuple[str, ...], dtype: str) -> None:
    nrrd(tmp_path / "v.nrrd", marked_by(-9999, dtype), *pairs)
    check(load(tmp_path / "v.nrrd").values, dtype, "f4")
    nrrd(tmp_path / "w.nrrd", marked_by(-9999, dtype), "_FillValue:=none")
    assert not load(tmp_path / "w.nrrd").has_missing


@pytest.mark.parametrize("name", ["v.nii.gz", "v.nrrd", "v.mha", "v.tif", "v.mrc", "v.nc"])
def test_nan_is_missing_in_every_format(tmp_path: Path, name: str) -> None:
    """The one mark that NIfTI and NRRD have."""
    WRITERS[name](tmp_path / name, marked_by(np.nan, "f4"))
    check(load(tmp_path / name).values, "f4", "f4")


@pytest.mark.parametrize("folder", [False, True])
def test_tiff_marks(tmp_path: Path, folder: bool) -> None:
    how = {"extratags": [(42113, "s", 0, "-9999", True)]}
    values = marked_by(-9999, "i2")
    if folder:
        for number, page in enumerate(values):
            tiff(tmp_path / f"{number}.tif", page, **how)
    else:
        tiff(tmp_path / "v.tif", values, **how)
    path = tmp_path if folder else tmp_path / "v.tif"
    check(load(path).values, "i2", "f4")
    assert load(path, labels=True).values.dtype == np.int16


@pytest.mark.parametrize(
    ("fields", "mark"),
    [
        ({"PixelPaddingValue": -2000}, -2000),
        ({"PixelPaddingValue": -2000, "PixelPaddingRangeLimit": -1000}, -1500),
        ({"PixelPaddingValue": -1000, "PixelPaddingRangeLimit": -2000}, -1500),
    ],
)
@pytest.mark.parametrize("intercept", [0, 0.5, -1024])
def test_dicom_marks(tmp_path: Path, fields: dict[str, int], mark: int, intercept: float) -> None:
    dicom(tmp_path, marked_by(mark, "i2"), RescaleSlope=1, RescaleIntercept=intercept, **fields)
    volume = load(tmp_path)
    check(volume.values - np.float32(intercept), "i2", "f4")
    assert any("Pixel Padding Value" in note for note in volume.notes)


def test_dicom_without_a_padded_pixel_keeps_its_type(tmp_path: Path) -> None:
    dicom(tmp_path, wave(6, "i2"), PixelPaddingValue=-2000)
    assert load(tmp_path).values.dtype == np.int16
    padding = slice_of(0, wave(6, "i2")[0], PixelPaddingValue=-2000)["PixelPaddingValue"]
    assert padding.value == -2000


@pytest.mark.parametrize(("kind", "to", "bit"), [("PointData", 5, 2), ("CellData", 6, 32)])
def test_vti_marks(tmp_path: Path, kind: str, to: int, bit: int) -> None:
    words = " ".join(map(str, (HOLES * (bit + 1) + ~HOLES).ravel()))  # 1 is a duplicate, which is there
    ghosts = f'<DataArray type="UInt8" Name="vtkGhostType" format="ascii">{words}</DataArray>'
    vti(tmp_path / "v.vti", wave(6, "i2"), ghosts, kind, to)
    check(load(tmp_path / "v.vti").values, "i2", "f4")


def test_what_is_missing_is_left_out_before_a_grid_is_resampled(tmp_path: Path) -> None:
    """Between a value and a fill value there is none."""
    import netCDF4

    netcdf(tmp_path / "v.nc", marked_by(-9999, "f4"))
    with netCDF4.Dataset(tmp_path / "v.nc", "a") as dataset:
        dataset.createVariable("x", "f8", ("x",))[:] = [0, 1, 2, 4, 6, 9]
    volume = load(tmp_path / "v.nc", variable="v", missing=-9999)
    assert volume.resampling is not None and volume.has_missing
    assert np.nanmin(volume.values) >= 0


def test_a_mask_of_integers_hides_where_it_is_0_or_missing(tmp_path: Path) -> None:
    from texvol.scene.mask import Mask

    values = np.where(HOLES, 200, wave(6, "u1") // 100 * 255).astype(np.uint8)
    for nodata in ("200", "255", "0", "17"):
        tiff(tmp_path / "m.tif", values, extratags=[(42113, "s", 0, nodata, True)])
        mask = Mask.of(load(tmp_path / "m.tif"))
        np.testing.assert_array_equal(mask.array, (values != 0) & (values != int(nodata)))


def test_steps_of_a_series(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", np.stack([wave(6, "f4"), marked_by(-9999, "f4")]))
    with TimeSeries(tmp_path / "v.npy", missing=-9999) as series:
        assert [step.has_missing for step in series] == [False, True]
        assert series.finite_range == (0.125, 0.875)


@pytest.mark.parametrize("missing", ["7", np.nan, [1, "a"], True, [[1]]])
def test_what_is_no_value_is_refused(tmp_path: Path, missing: Any) -> None:
    np.save(tmp_path / "v.npy", wave(6, "f4"))
    with pytest.raises(InputError, match="v.npy: missing must be a number"):
        load(tmp_path / "v.npy", missing=missing)


def test_labels_and_colours_have_no_missing_value(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", wave(6, "u1"))
    with pytest.raises(InputError, match="--missing is not for labels: --label-look"):
        load(tmp_path / "v.npy", missing=1, labels=True)
    np.save(tmp_path / "c.npy", np.zeros((4, 4, 4, 3), np.uint8))
    with pytest.raises(InputError, match="--missing is for numbers, got colours"):
        load(tmp_path / "c.npy", missing=1, color=True)
    assert load(tmp_path / "c.npy", missing=0, channel=1).has_missing


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with two volumes and a scene file."""
    monkeypatch.chdir(tmp_path)
    np.save("first.npy", marked_by(-3.4028235e38, "f4"))
    np.save("second.npy", marked_by(-(2**63), "i8"))
    Path("s.toml").write_text(
        'volume = "first.npy"\nmissing = -3.4028235e38\n[[add]]\nfile = "second.npy"\n'
        "missing = [-9223372036854775808, 1e20]\n"
    )
    return tmp_path


LINE = [
    *("first.npy", "--missing", "-3.4028235e+38", "--missing", "7", "--add", "second.npy"),
    *("--add-missing", str(-(2**63)), "--add-missing", "1e20", "--size", "16x16"),
]


@pytest.mark.parametrize("command", ["render", "raycast"])
def test_a_picture_says_which_values_were_missing(folder: Path, command: str) -> None:
    assert main([command, *LINE, "-o", "p.exr"]) == 0
    assert main([command, "--scene", "s.toml", "--size", "16x16", "-o", "q.exr"]) == 0
    for name in ("p.exr", "q.exr"):
        attributes = read_picture(name).attributes
        scene = stored_scene_of(attributes, name=name).scene
        check(scene.volume.values, "f4", "f4")
        check(scene.added[0].volume.values, "i8", "f4")
    np.testing.assert_array_equal(read_picture("p.exr").pixels, read_picture("q.exr").pixels)


def test_a_saved_scene_says_which_values_are_missing(folder: Path) -> None:
    from texvol.options.scene_options import SceneOptions
    from texvol.window.recent import Recent
    from texvol.window.scene_writing import volume_table

    wanted = SceneOptions.of(scene="s.toml")
    scene = wanted.scene(wanted.load())
    first, second = (volume_table(scene, number) for number in range(2))
    assert first["missing"] == [-3.4028235e38] and second["missing"] == [-(2**63), 1e20]
    how = json.loads(json.dumps({key: value for key, value in first.items() if key != "file"}))
    assert Recent(first["file"], how).options["missing"] == [-3.4028235e38]


@pytest.mark.parametrize("value", ["x", "nan", ""])
def test_the_line_takes_numbers_only(folder: Path, value: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "first.npy", "--missing", value]) == 2
    wanted = "must be a number, got NaN" if value == "nan" else "a number is wanted"
    assert f"--missing: {wanted}" in capsys.readouterr().err


@pytest.mark.parametrize("value", ["true", '"x"', "[[1]]", "{a = 1}"])
def test_the_scene_file_takes_numbers_only(folder: Path, value: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("t.toml").write_text(f'volume = "first.npy"\nmissing = {value}\n')
    assert main(["render", "--scene", "t.toml", "-o", "p.png"]) == 2
    assert "t.toml: missing: " in capsys.readouterr().err


def test_info_names_lone_values_and_what_finds_them(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "first.npy"]) == 0
    assert f"-3.4028235e+38 in {HOLES.sum()} samples, far from all others (0.125 to 0.875)" in capsys.readouterr().out
    assert main(["info", "second.npy", "--json"]) == 0
    (lone,) = json.loads(capsys.readouterr().out)["lone_extremes"]
    assert (lone["value"], lone["samples"], lone["missing"]) == (-(2**63), HOLES.sum(), str(-(2**63)))
    for name, value in (("first.npy", "-3.4028235e+38"), ("second.npy", lone["missing"])):
        assert main(["info", name, "--json", "--missing", value]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["lone_extremes"] == [] and found["nan_count"] == HOLES.sum()
    assert information.metadata(load("first.npy"))["lone_extremes"][0]["others"] == (0.125, 0.875)
