"""Projection modes on the command line: numbers and depths in EXR, what 8 bits show of them, and wrong use."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from support.projected import rounding

from texvol.__main__ import main
from texvol.formats.pictures import image
from texvol.ray_casting.projection import isosurface_depth, project
from texvol.scene.camera import Camera
from texvol.scene.orbit import framing, turned
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util import color

NUMBERS = ("xray", "average", "mip", "minip")
SIZE = (40, 32)
RED_TO_BLUE = {"points": [{"value": v, "color": c, "extinction": 0.1} for v, c in ((0, [1, 0, 0]), (1000, [0, 0, 1]))]}
VIEW = ["--size", "40x32", "--projection", "perspective"]
ISO = ["--mode", "isosurface", "--isovalue", "700"]
LEVEL = 1 / 255


@pytest.fixture
def volume(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Volume:
    """A volume of values from -200 to 1000, which is v.npy in the folder to work in."""
    values = np.random.default_rng(0).integers(-200, 1000, (12, 10, 8)).astype(np.int16)
    np.save(tmp_path / "v.npy", values)
    (tmp_path / "tf.json").write_text(json.dumps(RED_TO_BLUE))
    monkeypatch.chdir(tmp_path)
    return Volume(values)


def run(*line: str) -> int:
    return main(list(line))


def above_least(volume: Volume, mode: str) -> dict[str, float]:
    """Return the fields of a scene that nobody chose, as pictures of 8 bits have them."""
    return {"air": float(volume.finite_range[0])} if mode == "xray" else {}


def scene(volume: Volume, mode: str, **options) -> Scene:
    camera = Camera.framing(volume, "perspective", aspect=SIZE[0] / SIZE[1])
    return Scene(volume, camera=camera, mode=mode, **options)


def levels(name: str) -> np.ndarray:
    """Return the channels of a PNG from 0 to 1, shape (h, w, channels)."""
    return oiio.ImageBuf(name).get_pixels(oiio.FLOAT)


def window_of(numbers: np.ndarray, centre: float, width: float) -> np.ndarray:
    return np.clip((numbers - centre) / width + 0.5, 0, 1)


@pytest.mark.parametrize("mode", NUMBERS)
def test_exr_holds_the_numbers_themselves(volume, mode):
    assert (
        run("render", "v.npy", *VIEW, "--mode", mode, "--background", "1,0,0", "--sampling-rate", "8", "-o", "a.exr")
        == 0
    )
    assert run("raycast", "v.npy", *VIEW, "--mode", mode, "--background", "1,0,0", "-o", "b.exr") == 0
    picture, truth, expected = image.read("a.exr"), image.read("b.exr"), project(scene(volume, mode), SIZE)
    for each in (picture, truth):
        assert each.shape == (32, 40, 4)
        np.testing.assert_array_equal(each[..., 3], expected[..., 3])
        np.testing.assert_array_equal(each[..., :3], each[..., :1].repeat(3, -1))
    assert 0 < expected[..., 3].mean() < 1
    np.testing.assert_allclose(truth, expected, rtol=2.0**-23)
    # Eight slabs per sample lose (1/8)² / 8 of a change of 1200 on a way of up to 17 at most; extremes are exact.
    bound = {
        "xray": 1200 / 512 * 17,
        "average": 1200 / 64,
    }
    assert np.abs(picture - expected).max() < bound.get(mode, rounding(volume))


@pytest.mark.parametrize("command", ["render", "raycast"])
@pytest.mark.parametrize("mode", NUMBERS)
def test_eight_bits_show_a_window_or_colours_or_the_range(volume, mode, command):
    numbers = project(scene(volume, mode, **above_least(volume, mode)), SIZE)
    met, values = numbers[..., 3] > 0, numbers[..., 0]
    low, high = (values[met].min(), values[met].max()) if mode in ("xray", "average") else volume.finite_range
    centre, width = float(np.mean(values[met])), float(np.std(values[met]))
    # A number of one slab per sample is off by a few hundredths of the range; that is what the pictures may be.
    tolerance = {"xray": 0.06, "average": 0.1, "mip": 0.51 * LEVEL, "minip": 0.51 * LEVEL}[mode]
    shared = [command, "v.npy", *VIEW, "--mode", mode]
    assert run(*shared, "-o", "range.png") == 0
    assert run(*shared, "--window", f"{centre},{2 * width}", "-o", "window.png") == 0
    assert run(*shared, "--tf", "tf.json", "-o", "tf.png") == 0
    assert run(*shared, "--tf", "tf.json", "--window", f"{centre},{2 * width}", "-o", "both.png") == 0
    for name, window in (("range", ((low + high) / 2, high - low)), ("window", (centre, 2 * width))):
        shown = levels(f"{name}.png")[..., :3]
        grey = np.where(met, window_of(values, *window), 0)
        loose = tolerance if name == "range" else tolerance * max(1, (high - low) / (2 * width))
        assert np.abs(shown - grey[..., None]).max() < loose + 0.51 * LEVEL
        if command == "raycast":
            assert np.abs(shown - grey[..., None]).max() < 0.51 * LEVEL
    np.testing.assert_array_equal(levels("both.png"), levels("window.png"))
    blue = np.clip(values / 1000, 0, 1)
    colors = color.srgb_from_linear(np.stack([1 - blue, 0 * blue, blue], axis=-1)) * met[..., None]
    if command == "raycast" or mode in ("mip", "minip"):
        assert np.abs(levels("tf.png")[..., :3] - colors).max() < LEVEL


def test_a_transparent_background_stays_where_no_ray_meets_the_box(volume):
    assert run("render", "v.npy", *VIEW, "--mode", "mip", "--background", "transparent", "-o", "a.png") == 0
    expected = project(scene(volume, "mip"), SIZE)
    np.testing.assert_array_equal(levels("a.png")[..., -1], expected[..., 3])


@pytest.mark.parametrize("command", ["render", "raycast"])
def test_a_depth_is_one_channel_in_world_units(volume, command):
    assert run(command, "v.npy", *VIEW, *ISO, "--fit", "box", "-o", "a.png", "--depth", "d.exr") == 0
    source = oiio.ImageInput.open("d.exr")
    assert list(source.spec().channelnames) == ["Z"]
    depth = np.asarray(source.read_image(oiio.FLOAT))[..., 0]
    source.close()
    expected = isosurface_depth(scene(volume, "isosurface", isovalue=700.0), SIZE)
    assert (np.isfinite(depth) == np.isfinite(expected)).mean() > 0.995
    met = np.isfinite(depth) & np.isfinite(expected)
    assert met.sum() > 100
    assert (np.abs(depth[met] - expected[met]) < 1e-4).mean() > 0.99


@pytest.mark.parametrize("mode", ["xray", "mip"])
def test_an_orbit_has_one_window(volume, mode):
    assert run("render", "v.npy", "--size", "40x32", "--mode", mode, "--orbit", "3", "-o", "f%d.png") == 0
    turn = [turned(framing(volume, aspect=SIZE[0] / SIZE[1]), 120 * view) for view in range(3)]
    views = [project(Scene(volume, camera=camera, mode=mode, **above_least(volume, mode)), SIZE) for camera in turn]
    first = views[0][views[0][..., 3] > 0][:, 0]
    low, high = (first.min(), first.max()) if mode == "xray" else volume.finite_range
    for i, view in enumerate(views):
        grey = np.where(view[..., 3] > 0, window_of(view[..., 0], (low + high) / 2, high - low), 0)
        # Of each X-ray its own range would be shown otherwise.
        assert np.abs(levels(f"f{i}.png")[..., 0] - grey).max() < (0.05 if mode == "xray" else 0.51 * LEVEL)


def test_an_orbit_of_numbers_in_exr(volume):
    assert run("render", "v.npy", "--size", "40x32", "--mode", "mip", "--orbit", "2", "-o", "f%d.exr") == 0
    for i in range(2):
        camera = turned(framing(volume, aspect=SIZE[0] / SIZE[1]), 180 * i)
        expected = project(Scene(volume, camera=camera, mode="mip", classification="slab"), SIZE)
        assert np.abs(image.read(f"f{i}.exr") - expected).max() < rounding(volume)


def test_a_scene_file_has_a_mode(volume):
    Path("s.toml").write_text('mode = "mip"\nwindow = [400, 800]\nsize = "40x32"\nprojection = "perspective"\n')
    assert run("render", "v.npy", "--scene", "s.toml", "-o", "a.png") == 0
    assert run("render", "v.npy", *VIEW, "--mode", "mip", "--window", "400,800", "-o", "b.png") == 0
    np.testing.assert_array_equal(levels("a.png"), levels("b.png"))


def test_stats_name_the_mode(volume):
    for mode in (["--mode", "minip"], ISO):
        assert run("render", "v.npy", *VIEW, *mode, "-o", "a.exr", "--stats", "s.json", "--repeat", "2") == 0
        stats = json.loads(Path("s.json").read_text())
        assert mode[1] in stats["modelled"] and "perspective" in stats["modelled"]
        assert stats["estimated_error"] is not None


@pytest.mark.parametrize(
    "options, message",
    [
        (["--isovalue", "3"], "--isovalue needs --mode isosurface, got --mode composite"),
        (["--mode", "xray", "--isovalue", "3"], "--isovalue needs --mode isosurface, got --mode xray"),
        (["--mode", "isosurface"], "--mode isosurface needs --isovalue V"),
        (["--mode", "isosurface", "--isovalue", "nan"], "finite"),
        (["--window", "4,5"], "--window needs --mode xray"),
        ([*ISO, "--window", "4,5"], "--window needs --mode xray"),
        (["--mode", "mip", "--window", "4,-5"], "width must be positive"),
        (["--mode", "mip", "--window", "4"], "CENTRE,WIDTH"),
        (["--depth", "d.exr"], "--depth needs --mode isosurface, got --mode composite"),
        (["--mode", "mip", "--depth", "d.exr"], "--depth needs --mode isosurface, got --mode mip"),
        ([*ISO, "--depth", "d.png"], "depths are written as EXR"),
        ([*ISO, "--depth", "no/d.exr"], "does not exist"),
        (["--mode", "maximum"], "one of composite, xray, mip, minip, average, isosurface"),
    ],
    ids=lambda each: " ".join(each) if isinstance(each, list) else "",
)
@pytest.mark.parametrize("command", ["render", "raycast"])
def test_wrong_use_is_one_line_and_writes_nothing(volume, command, options, message, capsys):
    before = sorted(Path(".").iterdir())
    assert run(command, "v.npy", *options, "-o", "a.exr") == 2
    written, said = capsys.readouterr()
    assert not written and said.count("\n") == 1
    assert said.startswith("texvol: error: ") and message in said
    assert sorted(Path(".").iterdir()) == before


def test_a_depth_is_of_one_picture(volume, capsys):
    assert run("render", "v.npy", *ISO, "--orbit", "2", "-o", "f%d.png", "--depth", "d.exr") == 2
    assert "leave --orbit out" in capsys.readouterr().err


@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average"])
def test_a_target_that_does_not_hold_numbers_is_refused(
    tmp_path: Path, mode: str, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "v.npy", np.arange(27, dtype=np.float32).reshape(3, 3, 3) - 9)
    line = ["render", str(tmp_path / "v.npy"), "-o", str(tmp_path / "v.exr"), "--size", "8x8", "--mode", mode]
    for target in ("rgba8", "rgba16f"):
        assert main([*line, "--target-format", target]) == 2
        assert f"target format must be auto or rgba32f in mode {mode}" in capsys.readouterr().err
    assert not (tmp_path / "v.exr").exists()
    assert main([*line, "--target-format", "rgba32f"]) == 0
