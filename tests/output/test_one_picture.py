"""`texvol.render` of whatever holds a volume: it is what the command draws."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.processes import imported_by

import texvol
from texvol.__main__ import main
from texvol.formats.pictures import image
from texvol.util.package import environment_of_child

AXIS = np.linspace(-1, 1, 20)
Z, Y, X = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij")
BALL = (1000 * np.exp(-3 * (X * X + Y * Y + Z * Z))).astype(np.int16)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "ball.npy"
    np.save(path, BALL)
    return path


@pytest.mark.parametrize(
    ("words", "how"),
    [
        ([], {}),
        (["--tf", "ct-bone", "--light", "head"], {"tf": "ct-bone", "light": "head"}),
        (["--view", "left", "--background", "white"], {"view": "left", "background": "white"}),
        (["--spacing", "1,1,2", "--clip", "1,0,0,9"], {"spacing": (1, 1, 2), "clip": "1,0,0,9"}),
        (["--mode", "mip", "--projection", "perspective"], {"mode": "mip", "projection": "perspective"}),
        (["--tf", "fog", "--shadows", "--light", "-1,0,1"], {"tf": "fog", "shadows": True, "light": [-1, 0, 1]}),
        (["--range", "100,700", "--opacity", "0.5"], {"range": (100, 700), "opacity": 0.5}),
    ],
)
def test_options_mean_what_they_mean_on_the_command_line(saved: Path, words: list[str], how: dict) -> None:
    written = saved.with_name("a.exr")
    size = ["--size", "40x30", "--sampling-rate", "1"]
    assert main(["render", str(saved), *(f"{a}" for a in words), *size, "-o", str(written)]) in (0, None)
    for what in (saved, str(saved), BALL):
        picture = texvol.render(what, (40, 30), sampling_rate=1, **how)
        np.testing.assert_array_equal(picture, image.read(written))


def test_parts_of_a_scene_win_over_options() -> None:
    camera = texvol.Camera.orthographic((100, 0, 0), (10, 10, 10), (0, 0, 1), 40)
    medium = texvol.TransferFunction.preset("viridis", texvol.Volume(BALL))
    light = texvol.Lighting()
    picture = texvol.render(BALL, 16, tf=medium, light=light, camera=camera, view="top")
    assert picture.scene is not None
    assert (picture.scene.camera, picture.scene.transfer_function) == (camera, medium)
    assert picture.scene.lighting == light
    unlit = texvol.render(BALL, 16, tf=medium)
    assert unlit.scene is not None
    assert unlit.scene.lighting is None


def test_a_scene_file_is_drawn_as_it_says(saved: Path) -> None:
    file = saved.with_name("scene.toml")
    file.write_text('volume = "ball.npy"\ntf = "magma"\nsize = "24x18"\n', encoding="utf-8")
    picture = texvol.render(file)
    assert picture.shape == (18, 24, 4)
    scene = texvol.Scene.load(file)
    assert scene.transfer_function is not None
    np.testing.assert_array_equal(texvol.render(scene, (24, 18)), picture)


def test_a_scene_is_saved_and_read_again(saved: Path) -> None:
    camera = texvol.Camera.perspective((90, 3, 40), (10, 10, 10), (0, 0, 1), 25)
    scene = texvol.Scene(texvol.load(saved), "magma", camera, background=(0.1, 0.2, 0.3), lighting="studio")
    file = saved.with_name("again.toml")
    scene.save(file, (24, 18))
    np.testing.assert_array_equal(texvol.render(file, sampling_rate=1), texvol.render(scene, (24, 18), sampling_rate=1))
    with pytest.raises(texvol.InputError, match="was not read from a file"):
        texvol.Scene(texvol.Volume(BALL)).save(saved.with_name("array.toml"))
    assert not saved.with_name("array.toml").exists()
    with pytest.raises(texvol.InputError, match=r"must end with \.toml"):
        scene.save(saved.with_name("scene.json"))


def test_a_scene_and_its_size_as_before() -> None:
    scene = texvol.Scene(texvol.Volume(BALL), "fog")
    assert texvol.render(scene).shape == (512, 512, 4)
    assert texvol.render(scene, (20, 10), sampling_rate=1).shape == (10, 20, 4)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"tff": "fog"}, "render: unknown argument 'tff'; did you mean 'tf'?"),
        ({"sampling_rates": 2}, "render: unknown argument 'sampling_rates'; did you mean 'sampling_rate'?"),
        ({"eye": "here"}, "eye: must be three numbers X,Y,Z, got 'here'"),
        ({"two_sided": 3}, "two-sided must be true or false, got 3"),
    ],
)
def test_wrong_arguments_are_named(how: dict, message: str) -> None:
    with pytest.raises(texvol.InputError) as caught:
        texvol.render(BALL, 16, **how)
    assert str(caught.value) == message


def test_a_misspelt_argument_is_one_beside_a_scene_as_well() -> None:
    scene = texvol.Scene(texvol.Volume(BALL))
    with pytest.raises(texvol.InputError, match="unknown argument 'siz'; did you mean 'size'"):
        texvol.render(scene, siz=20)
    with pytest.raises(texvol.InputError, match=r"a Scene has its parts: scene.replace\(lighting"):
        texvol.render(scene, light="head")
    with pytest.raises(texvol.InputError, match="got 'studo'; did you mean 'studio'"):
        texvol.render(texvol.Scene(scene.volume, "fog", lighting="studo"), 16)


def test_replace_names_what_it_does_not_know() -> None:
    scene = texvol.Scene(texvol.Volume(BALL))
    assert scene.replace(mode="mip").mode == "mip"
    with pytest.raises(texvol.InputError, match="unknown part 'mod'; parts are .*; did you mean 'mode'"):
        scene.replace(mod="mip")


def test_reprs_fit_a_line() -> None:
    scene = texvol.Scene(texvol.Volume(BALL, name="ball"), "ct-bone")
    for thing in (scene, scene.volume, scene.transfer_function, scene.completed((9, 9)).camera):
        assert 10 < len(repr(thing)) < 200
        assert "\n" not in repr(thing)
    assert "ct-bone" in repr(scene)


def test_cards_have_pictures_and_facts() -> None:
    volume = texvol.Volume(BALL, (1, 1, 2), unit="mm", name="<ball>")
    scene = texvol.Scene(volume, "viridis")
    assert volume._repr_html_().count("<img") == 3
    assert "<svg" in volume._repr_html_()
    assert "&lt;ball&gt;" in volume._repr_html_()
    assert "<ball>" not in volume._repr_html_() + scene._repr_html_()
    assert "20 x 20 x 20 int16" in volume._repr_html_()
    assert "1 x 1 x 2 mm" in volume._repr_html_()
    assert scene._repr_html_().count("<img") == 1
    assert scene.transfer_function is not None
    assert scene.transfer_function._repr_html_().count("<img") == 1
    nan = texvol.Volume(np.full((2, 2, 2), np.nan))
    assert "none is finite" in nan._repr_html_()
    assert "<svg" in texvol.Volume(np.ones((1, 3, 5)))._repr_html_()


def test_xarray_is_not_imported_for_its_accessor(tmp_path: Path) -> None:
    assert "xarray" not in imported_by("import texvol; texvol.Volume", tmp_path)


def test_xarray_that_is_imported_after_texvol_has_the_accessor(tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    script = """import texvol, importlib.util, sys
importlib.util.find_spec("xarray")  # others only look
assert "xarray" not in sys.modules
import xarray
print(xarray.DataArray([[[1.0]]], dims=("z", "y", "x")).texvol.volume())"""
    command = [sys.executable, "-c", script]
    environment = environment_of_child()
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("Volume('array', 1 x 1 x 1 float64, spacing 1, 1, 1)\n", "")


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"tf": "viridis", "light": "none"}, r"scene.replace\(transfer_function=…, lighting=…\) changes them"),
        ({"view": "front"}, r"texvol.render\(scene.volume, view=…\) makes another one, by options"),
    ],
)
def test_options_for_a_scene_are_refused_with_what_does_instead(how: dict, words: str) -> None:
    scene = texvol.Scene(texvol.Volume(np.zeros((3, 4, 5), np.float32)))
    with pytest.raises(texvol.InputError, match=words):
        texvol.render(scene, 16, **how)


def test_a_file_is_no_preset_and_may_be_read(tmp_path: Path) -> None:
    volume, path = texvol.Volume(np.arange(60.0).reshape(3, 4, 5)), tmp_path / "own.json"
    texvol.TransferFunction([0, 50], [[1, 0, 0], [0, 0, 1]], [0.5, 2]).save(path)
    with pytest.raises(texvol.InputError, match=r"not found: texvol.load_look\('.*own.json', volume\) reads a file"):
        texvol.Scene(volume, str(path))
    texvol.Scene(volume, texvol.load_look(str(path), volume))
