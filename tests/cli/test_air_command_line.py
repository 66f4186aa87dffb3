"""X-rays from the command line: what 8 bits show and what EXR holds, and where Hounsfield units come from."""

from __future__ import annotations

import json
from pathlib import Path

import netCDF4
import nrrd
import numpy as np
import OpenImageIO as oiio
import pytest
from support.dicom_files import written_series
from support.projected import ct

import texvol
from texvol.__main__ import main
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import ATTRIBUTE
from texvol.ray_casting.projection import project
from texvol.scene.air import HOUNSFIELD, hounsfield_by
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

SIZE = (40, 32)
LEVEL = 1 / 255
SHARED = ["--size", "40x32", "--mode", "xray"]


@pytest.fixture
def volume(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Volume:
    """A body in air, which is ct.npy in the folder to work in."""
    np.save(tmp_path / "ct.npy", ct())
    monkeypatch.chdir(tmp_path)
    return Volume(ct())


def truth(volume: Volume, air) -> np.ndarray:
    camera = Camera.framing(volume, aspect=SIZE[0] / SIZE[1])
    return project(Scene(volume, camera=camera, mode="xray", air=air, classification="slab"), SIZE)


def levels(name: str) -> np.ndarray:
    """Return the grey of a PNG from 0 to 1, shape (h, w)."""
    return oiio.ImageBuf(name).get_pixels(oiio.FLOAT)[..., 0]


def drawn(*line: str) -> None:
    assert main([line[0], "ct.npy", *SHARED, *line[1:]]) == 0


def test_eight_bits_show_attenuation_of_hounsfield_units(volume):
    """The shortest rays are darkest, and not brightest."""
    drawn("raycast", "-o", "a.png")
    expected = truth(volume, HOUNSFIELD)
    numbers, met = expected[..., 0], expected[..., 3] > 0
    low, high = numbers[met].min(), numbers[met].max()
    grey = np.where(met, (numbers - low) / (high - low), 0)
    assert np.abs(levels("a.png") - grey).max() < 0.51 * LEVEL
    plain = truth(volume, None)[..., 0]
    assert np.corrcoef(numbers[met], plain[met])[0, 1] < 0.9, "which the values themselves do not show"
    drawn("render", "--sampling-rate", "16", "-o", "b.png")
    assert np.abs(levels("b.png") - grey).max() < 0.02
    drawn("render", "--sampling-rate", "16", "--air", "hounsfield", "-o", "c.png")
    np.testing.assert_array_equal(levels("b.png"), levels("c.png"))
    drawn("render", "--sampling-rate", "16", "--air", "none", "-o", "d.png")
    assert np.abs(levels("d.png") - levels("b.png")).max() > 0.3


@pytest.mark.parametrize("command", ["render", "raycast"])
def test_exr_holds_the_plain_integral_unless_told(volume, command):
    accuracy = ["--max-error", "20"] if command == "render" else []  # of some thousands
    cases = {"none": None, "-300": -300.0, "hounsfield": HOUNSFIELD}
    for text, air in cases.items():
        expected = truth(volume, air)[..., 0]
        drawn(command, *accuracy, "--air", text, "-o", "a.exr")
        numbers = image.read("a.exr")[..., 0]
        assert np.abs(numbers - expected).max() < (20 if command == "render" else 1e-6 * np.abs(expected).max())
        assert json.loads(oiio.ImageBuf("a.exr").spec()[ATTRIBUTE]).get("air") == air
    drawn(command, *accuracy, "-o", "b.exr")
    drawn(command, *accuracy, "--air", "none", "-o", "c.exr")
    np.testing.assert_array_equal(image.read("b.exr"), image.read("c.exr"))


def test_other_data_are_shown_above_their_least_value(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = np.random.default_rng(0).normal(5, 1, (12, 12, 12))
    np.save("ct.npy", values)
    drawn("raycast", "-o", "a.png")
    drawn("raycast", "--air", repr(float(values.min())), "-o", "b.png")
    np.testing.assert_array_equal(levels("a.png"), levels("b.png"))


def test_orbits_and_scene_files_know_air(volume):
    Path("s.toml").write_text('volume = "ct.npy"\nmode = "xray"\nair = -200\nsize = "40x32"\n')
    assert main(["raycast", "--scene", "s.toml", "-o", "a.exr"]) == 0
    np.testing.assert_allclose(image.read("a.exr"), truth(volume, -200), rtol=1e-6)
    for text in ('"hounsfield"', '"none"'):
        Path("s.toml").write_text(f'volume = "ct.npy"\nmode = "xray"\nair = {text}\nsize = "40x32"\n')
        assert main(["raycast", "--scene", "s.toml", "-o", "a.exr"]) == 0
        np.testing.assert_allclose(image.read("a.exr"), truth(volume, HOUNSFIELD if "h" in text else None), rtol=1e-6)
    assert main(["raycast", "--scene", "s.toml", "--air", "-200", "-o", "a.exr"]) == 0, "the line wins"
    np.testing.assert_allclose(image.read("a.exr"), truth(volume, -200), rtol=1e-6)
    assert main(["raycast", "--scene", "s.toml", "--mode", "mip", "-o", "a.exr"]) == 0, "air is for xray"
    drawn("render", "--orbit", "2", "-o", "f%d.png")
    for name in ("f0.png", "f1.png"):
        assert json.loads(oiio.ImageBuf(name).spec()[ATTRIBUTE])["air"] == HOUNSFIELD


def test_a_series_has_the_air_of_all_its_steps(tmp_path, monkeypatch):
    nifti = pytest.importorskip("nibabel")
    monkeypatch.chdir(tmp_path)
    steps = np.random.default_rng(0).random((6, 6, 6, 3)).astype(np.float32) + [5, 3, 4]
    nifti.save(nifti.Nifti1Image(steps.astype(np.float32), np.eye(4)), "ct.nii")
    assert main(["render", "ct.nii", *SHARED, "--time", "all", "-o", "t%d.png"]) == 0
    found = {json.loads(oiio.ImageBuf(f"t{step}.png").spec()[ATTRIBUTE])["air"] for step in range(3)}
    assert found == {float(steps.astype(np.float32).min())}


@pytest.mark.parametrize(
    "options, message",
    [
        (["--air", "nan"], "finite number, hounsfield or none"),
        (["--air", "thin"], "finite number, hounsfield or none, got 'thin'"),
        (["--air", "0", "--mode", "average"], "--air needs --mode xray, got --mode average"),
        (["--air", "0", "--mode", "composite"], "--air needs --mode xray, got --mode composite"),
        (["--coloring", "tf", "--window", "1,2"], "--window needs --coloring grey"),
        (["--coloring", "gray"], "one of grey, tf"),
    ],
)
def test_wrong_use_is_one_line(volume, options, message, capsys):
    assert main(["render", "ct.npy", *SHARED, *options, "-o", "a.png"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and message in said and not Path("a.png").exists()


@pytest.mark.parametrize(
    "fields, unit",
    [
        ({"RescaleType": "HU", "RescaleIntercept": -1024, "RescaleSlope": 1}, "HU"),
        ({"RescaleIntercept": -1024, "RescaleSlope": 1}, "HU"),
        ({"RescaleType": "US", "RescaleIntercept": -1024, "RescaleSlope": 1}, ""),
        ({"RescaleType": "HU", "RescaleIntercept": 0, "RescaleSlope": 1, "Modality": "OT"}, "HU"),
        ({"RescaleIntercept": 0, "RescaleSlope": 1}, ""),
        ({}, ""),
        ({"Modality": "PT", "Units": "BQML"}, "BQML"),
        ({"Modality": "MR", "RescaleIntercept": -4096, "RescaleSlope": 2}, ""),
    ],
)
def test_dicom_says_the_unit_of_its_values(tmp_path, fields, unit):
    stored = np.arange(3 * 4 * 5).reshape(3, 4, 5).astype(np.uint16)
    read = texvol.load(str(written_series(tmp_path, stored, **fields)))
    assert read.value_unit == unit and hounsfield_by(read) == ("file" if unit == "HU" else "")


def test_nrrd_and_netcdf_say_the_unit_of_their_values(tmp_path, capsys):
    values = np.clip(ct(), 0, 50).astype(np.int16)
    nrrd.write(str(tmp_path / "a.nrrd"), values, {"sample units": "HU"})
    with netCDF4.Dataset(tmp_path / "a.nc", "w") as dataset:
        for name, size in zip("zyx", values.shape, strict=True):
            dataset.createDimension(name, size)
        dataset.createVariable("v", "i2", ("z", "y", "x"))[:] = values
        dataset["v"].units = "HU"
    for name in ("a.nrrd", "a.nc"):
        assert texvol.load(str(tmp_path / name)).value_unit == "HU"
        assert main(["info", str(tmp_path / name)]) == 0
        assert "value unit  HU, Hounsfield units" in capsys.readouterr().out
        assert main(["info", str(tmp_path / name), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["hounsfield"] == "file"


def test_info_says_what_values_are_taken_for(volume, capsys):
    assert main(["info", "ct.npy"]) == 0
    assert "assumed to be Hounsfield units" in capsys.readouterr().out
    np.save("other.npy", np.clip(ct(), 0, 50))
    assert main(["info", "other.npy"]) == 0
    assert "ounsfield" not in capsys.readouterr().out


def test_presets_of_ct_believe_the_file():
    cropped = np.clip(ct(), 0, 900)
    own = [
        texvol.scene.transfer.preset("ct-bone", Volume(cropped, value_unit=unit)).values.tolist() for unit in ("", "HU")
    ]
    assert own[1] == [150, 250, 500, 1200] and own[0] != own[1]
