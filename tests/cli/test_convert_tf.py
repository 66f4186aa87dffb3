"""`texvol convert-tf`: forms by name and by --to, the length of opacities, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from texvol import TransferFunction, Volume, load
from texvol.cli.command_line import main
from texvol.options.looks import load_look

POINTS = {
    "points": [{"value": 0, "color": [1, 0, 0], "extinction": 0.5}, {"value": 50, "color": [0, 0, 1], "extinction": 2}]
}


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.json").write_text(json.dumps(POINTS))
    np.save("v.npy", np.arange(60.0).reshape(3, 4, 5))


def converted(capsys: pytest.CaptureFixture[str], *line: str) -> str:
    assert main(["convert-tf", *line]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def test_a_colour_map_of_paraview(capsys: pytest.CaptureFixture[str]) -> None:
    said = converted(capsys, "own.json", "map.json", "--to", "paraview", "--unit-distance", "2", "--name", "mine")
    assert "set its Scalar Opacity Unit Distance to 2" in said
    (content,) = json.loads(Path("map.json").read_text())
    assert content["Name"] == "mine" and content["Points"][:2] == [0, pytest.approx(1 - np.exp(-1))]
    found = TransferFunction.load("map.json", unit_distance=2).at([0, 25, 50])
    np.testing.assert_allclose(found, TransferFunction.load("own.json").at([0, 25, 50]), atol=0.005)
    assert converted(capsys, "map.json", "again.json", "--in-unit-distance", "2").startswith(
        "again.json: transfer function"
    )
    np.testing.assert_allclose(TransferFunction.load("again.json").at([0, 25, 50]), found, atol=1e-12)


def test_volume_properties_of_slicer_have_the_light_of_a_preset(capsys: pytest.CaptureFixture[str]) -> None:
    volume = load("v.npy")
    for name, more in (("bone.vp.json", ["--unit-distance", "0.5"]), ("bone.vp", [])):
        said = converted(capsys, "ct-bone", name, "--volume", "v.npy", *more)
        assert said.startswith(f"{name}: volume property of 3D Slicer")
        wanted, found = load_look("ct-bone", volume), load_look(name, volume)
        assert wanted.lighting is not None and found.lighting is not None
        assert found.lighting.diffuse == pytest.approx(wanted.lighting.diffuse)
        values = np.linspace(0, 59, 50)
        opacities = [1 - np.exp(-each.transfer_function.at(values)[:, 3]) for each in (wanted, found)]
        np.testing.assert_allclose(*opacities, atol=0.005)


def test_values_are_moved(capsys: pytest.CaptureFixture[str]) -> None:
    converted(capsys, "own.json", "moved.json", "--range", "100,200")
    found = TransferFunction.load("moved.json")
    assert found.values.tolist() == [100, 200]


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (["own.json", "x.txt"], "x.txt: the name must end with .json, .vp.json or .vp"),
        (["own.json", "x.json", "--to", "paraview"], "--unit-distance L must be given"),
        (["own.json", "x.vp.json"], "--unit-distance L must be given"),
        (["own.json", "x.vp", "--unit-distance", "2"], "--unit-distance must be 1 for .vp, which has none, got 2"),
        (["own.json", "x.json", "--unit-distance", "2"], "texvol's own files have extinctions"),
        (["own.json", "x.json", "--to", "slicer"], "--to slicer needs a name that ends with .vp.json or .vp"),
        (["own.json", "x.vp", "--to", "paraview"], "--to paraview needs a name that ends with .json"),
        (["own.json", "own.json"], "OUT must not overwrite an input"),
        (["ct-bone", "x.json"], "transfer function 'ct-bone' is relative to a volume: give --volume VOLUME"),
        (["gold", "x.json"], "'gold' must be a file such as .json or .toml"),
        (["own.json", "x.json", "--in-unit-distance", "2"], "a unit distance is for files of other programs"),
        (["ct-bone", "x.json", "--volume", "no.nrrd"], "no.nrrd: no such file"),
        (["own.json", "no/x.json"], "its folder no does not exist"),
        (["own.json", "x.json", "--unit-distance", "-1"], "--unit-distance: must be a length above 0, got '-1'"),
    ],
)
def test_what_is_refused(line: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert-tf", *line]) == 2
    error = capsys.readouterr().err
    assert reason in error and error.count("\n") == 1 and not Path("x.json").exists()


def test_a_note_says_which_length_was_taken(capsys: pytest.CaptureFixture[str]) -> None:
    converted(capsys, "own.json", "map.json", "--to", "paraview", "--unit-distance", "2")
    assert main(["convert-tf", "map.json", "own2.json", "--volume", "v.npy"]) == 0
    assert "texvol: note: map.json: its opacities are per mean edge of the volume's cells" in capsys.readouterr().err


def test_the_window_knows_the_names() -> None:
    from texvol.window.contents import kind_of

    for name in ("a.json", "a.vp", "a.vp.json", "a.itf", "a.clut", "a.1dt"):
        assert kind_of(name) == "transfer function"
    for name in ("a.nrrd", "a.HEAD", "a.mnc", "a.gipl", "a.czi", "a.fits", "a.sgy", "a.vdb"):
        assert kind_of(name) == "volume"


def test_unit_distance_is_an_option_of_scenes(capsys: pytest.CaptureFixture[str]) -> None:
    converted(capsys, "own.json", "map.json", "--to", "paraview", "--unit-distance", "2")
    volume = Volume(np.arange(60.0).reshape(3, 4, 5))
    one, two = (load_look("map.json", volume, None, unit).transfer_function for unit in (1.0, 2.0))
    np.testing.assert_allclose(one.extinctions, 2 * two.extinctions)
    assert main(["info", "v.npy"]) == 0
    capsys.readouterr()
    assert main(["render", "v.npy", "--unit-distance", "2", "-o", "p.png"]) == 2
    assert "--unit-distance needs --tf, the file of another program" in capsys.readouterr().err
