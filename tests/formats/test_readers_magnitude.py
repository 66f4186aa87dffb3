"""Vectors read as their lengths, or by component, from every format that can hold them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from texvol import InputError, load
from texvol.cli.command_line import main
from texvol.formats.readers import TimeSeries


def vectors(dtype: Any = np.float32, count: int = 3) -> np.ndarray:
    """Vectors on 4 x 3 x 2 samples, shape (2, 3, 4, count)."""
    return (100 * np.random.default_rng(1).standard_normal((2, 3, 4, count))).astype(dtype)


def in_vti(path: Path, field: np.ndarray) -> None:
    image = vtkImageData()
    image.SetDimensions(*field.shape[2::-1])
    array = numpy_to_vtk(field.reshape(-1, field.shape[-1]))
    array.SetName("velocity")
    image.GetPointData().AddArray(array)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    assert writer.Write()


WRITERS = {
    "v.vti": in_vti,
    "v.nrrd": lambda path, field: nrrd.write(
        str(path), np.moveaxis(field, (3, 2, 1, 0), (0, 1, 2, 3)), {"kinds": ["vector", "domain", "domain", "domain"]}
    ),
    "v.mha": lambda path, field: SimpleITK.WriteImage(SimpleITK.GetImageFromArray(field, isVector=True), str(path)),
    "v.nii": lambda path, field: nibabel.Nifti1Image(
        field.transpose(2, 1, 0, 3)[..., np.newaxis, :], np.eye(4)
    ).to_filename(path),
    "v.npy": lambda path, field: np.save(path, np.moveaxis(field, -1, 0)),
}


@pytest.mark.parametrize("name", WRITERS)
def test_lengths_and_components(tmp_path: Path, name: str) -> None:
    path, field = tmp_path / name, vectors()
    WRITERS[name](path, field)
    volume = load(path, channel="magnitude")
    np.testing.assert_allclose(volume.values, np.linalg.norm(field, axis=-1), rtol=1e-6)
    assert volume.values.dtype == np.float32 and "values are lengths of 3 components" in volume.notes
    for number in range(3):
        np.testing.assert_array_equal(load(path, channel=number).values, field[..., number])


@pytest.mark.parametrize("dtype, wanted", [(np.int16, np.float32), (np.int32, np.float64), (np.float64, np.float64)])
def test_digits_are_kept(tmp_path: Path, dtype: Any, wanted: Any) -> None:
    field = vectors(dtype, 2)
    np.save(tmp_path / "v.npy", np.moveaxis(field, -1, 0))
    values = load(tmp_path / "v.npy", channel="magnitude").values
    assert values.dtype == wanted
    exact = np.hypot(field[..., 0].astype(float), field[..., 1])
    np.testing.assert_allclose(values, exact, rtol=1e-15 if wanted == np.float64 else 1e-6)


def test_large_and_missing_components(tmp_path: Path) -> None:
    field = vectors(np.float64, 2)
    field[0, 0, 0], field[0, 0, 1], field[1, 1, 1] = (3e200, 4e200), (np.nan, 1.0), (5.0, -99.0)
    np.save(tmp_path / "v.npy", np.moveaxis(field, -1, 0))
    values = load(tmp_path / "v.npy", channel="magnitude", missing=-99).values
    assert values[0, 0, 0] == pytest.approx(5e200)
    assert np.isnan(values[0, 0, 1]) and np.isnan(values[1, 1, 1]) and np.isnan(values).sum() == 2


def test_a_series_of_vectors_and_the_header(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from texvol.comparison.pictures import read_picture
    from texvol.provenance.stored_scene import stored_scene_of

    monkeypatch.chdir(tmp_path)
    steps = np.stack([np.moveaxis(vectors(), -1, 0), 2 * np.moveaxis(vectors(), -1, 0)])
    nibabel.Nifti1Image(steps.transpose(4, 3, 2, 0, 1), np.eye(4)).to_filename("v.nii")
    with TimeSeries("v.nii", channel="magnitude") as series:
        assert len(series) == 2
        np.testing.assert_allclose(series[1].values, 2 * series[0].values, rtol=1e-6)
    assert main(["render", "v.nii", "--time", "1", "--channel", "Magnitude", "--size", "16x12", "-o", "a.exr"]) == 0
    scene = stored_scene_of(read_picture("a.exr").attributes, name="a.exr").scene
    np.testing.assert_allclose(scene.volume.values, np.linalg.norm(2 * vectors(), axis=-1), rtol=1e-6)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"channel": "length"}, "channel must be a number or magnitude, got 'length'"),
        ({"channel": "magnitude", "labels": True}, "labels have no magnitude: give --labels or --channel magnitude"),
        ({"channel": "magnitude", "color": True}, "a single channel has no colour"),
        ({"channel": "magnitude"}, "--channel magnitude needs several components, and its samples have one"),
    ],
)
def test_what_has_no_length_is_refused(tmp_path: Path, options: Any, message: str) -> None:
    np.save(tmp_path / "s.npy", np.zeros((2, 3, 4)))
    with pytest.raises(InputError, match=message):
        load(tmp_path / "s.npy", **options)


def test_info_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    in_vti(tmp_path / "v.vti", vectors())
    assert main(["info", str(tmp_path / "v.vti"), "--channel", "magnitude", "--json"]) == 0
    assert "values are lengths of 3 components" in json.dumps(json.loads(capsys.readouterr().out))
    assert main(["info", str(tmp_path / "v.vti"), "--json"]) == 0
    shown, warned = capsys.readouterr()
    assert "values are lengths of 3 components" in shown and "--channel N shows one component" in warned
