"""Words that people know, on the command line: colours, ranges, units, sizes, and a guess at what was meant."""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from texvol import Scene, Volume
from texvol.__main__ import main
from texvol.formats.films.film import default_rate
from texvol.formats.pictures import image
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.options.scene_options import SceneOptions
from texvol.scene.transfer import preset
from texvol.util.color import color_of_text
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

ORANGE = (1.0, 0.21586050011389926, 0.0)  # #ff8000, linear
AXIS = np.linspace(-1, 1, 16)
BALL = 1.2 - np.sqrt(AXIS**2 + AXIS[:, None] ** 2 + AXIS[:, None, None] ** 2)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume."""
    np.save(tmp_path / "v.npy", (100 * BALL).clip(0).astype(np.float32))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def chosen(*line: str, volume: str = "v.npy") -> SceneOptions:
    parser = argparse.ArgumentParser(exit_on_error=False)
    reading_options.add_volume_options(parser)
    options.add_scene_options(parser)
    return SceneOptions(parser.parse_args(texts.with_negative_values([volume, *line])))


def scene(*line: str, volume: str = "v.npy") -> Scene:
    made = chosen(*line, volume=volume)
    return made.scene(made.load())


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("white", (1, 1, 1)), ("Black", (0, 0, 0)), ("#ff8000", ORANGE), ("#FF8000", ORANGE), ("#f80", None),
        ("no such colour", None), ("blurple", None), ("1,2,3", None), ("#ff80", None), ("transparent", None),
        ("", None),
    ],
)  # fmt: skip
def test_colours_have_names_and_digits(text: str, wanted: Any) -> None:
    found = color_of_text(text)
    if text == "#f80":
        wanted = color_of_text("#ff8800")
    assert found == (wanted if wanted is None else pytest.approx(wanted))


def test_a_key_of_a_look_that_is_misspelt_in_a_file_gets_a_guess(capsys: pytest.CaptureFixture[str]) -> None:
    point = {"value": 1, "color": "red", "extinction": 1}
    for key, meant in (("ligth", "light"), ("backgruond", "background"), ("point", "points")):
        Path("look.json").write_text(json.dumps({"points": [point], key: "head"}))
        assert main(["render", "v.npy", "--tf", "look.json", "-o", "a.png"]) == 2
        assert f"did you mean '{meant}'?" in capsys.readouterr().err


def test_a_colour_is_a_colour_everywhere() -> None:
    assert scene("--background", "#ff8000").background == pytest.approx(ORANGE)
    assert scene("--light", "head:#ff8000").lighting.lights[0].color == pytest.approx(ORANGE)
    assert scene("--light", "0,0,1:white").lighting.lights[0].color == (1, 1, 1)
    assert scene("--depth-cue", "0.5,white:10,20").depth_cue.color == (1, 1, 1)
    surfaces = scene("--mode", "isosurface", "--isovalue", "50:#ff8000:0.5").isosurfaces
    assert surfaces[0].color == pytest.approx(ORANGE) and surfaces[0].opacity == 0.5
    Path("m.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n9 0 0\n0 9 0\n3 0 1 2\n"
    )
    assert scene("--mesh", "m.ply:#ff8000:0.5").geometry[0].color == pytest.approx(ORANGE)


def test_range_and_opacity_adjust_any_preset() -> None:
    found = scene("--tf", "ct-bone", "--range", "10,90", "--opacity", "2").transfer_function
    plain = preset("ct-bone", Volume((100 * BALL).clip(0).astype(np.float32)))
    assert (found.values[0], found.values[-1]) == (10, 90)
    np.testing.assert_allclose(found.extinctions, 2 * plain.extinctions)
    assert scene("--opacity", "0").transfer_function.extinctions.max() == 0
    by_file = scene("--add", "v.npy", "--add-range", "1,2", "--add-tf", "grey").added[0].transfer_function
    assert (by_file.values[0], by_file.values[-1]) == (1, 2)


def test_unit_and_opacity_are_those_of_all_channels_of_an_image() -> None:
    from tifffile import imwrite

    channels = (1000 * np.stack([BALL, BALL], axis=1)).clip(0).astype(np.uint16)
    imwrite("cell.ome.tif", channels, metadata={"axes": "ZCYX"}, ome=True)
    plain, found = scene(volume="cell.ome.tif"), scene("--unit", "mm", "--opacity", "3", volume="cell.ome.tif")
    assert [each.unit for each in found.volumes] == ["mm", "mm"]
    for before, after in ((plain, found), (plain.added[0], found.added[0])):
        value = np.array([500.0])
        once, thrice = (each.transfer_function.classify(value).emission for each in (before, after))
        np.testing.assert_allclose(thrice, 3 * once)


def test_only_the_chosen_materials_are_left() -> None:
    assert scene("--tf", "table-5-1", "--materials", "bone,fat").transfer_function.materials == ("fat", "bone")


def test_size_may_be_one_number_and_a_unit_has_a_name() -> None:
    assert chosen("--size", "60").size == (60, 60)
    assert scene("--unit", "µm").volume.unit == "µm"


@pytest.mark.parametrize(
    "line, words",
    [
        (["--range", "9,1"], "--range: must be LOW,HIGH with LOW under HIGH, got '9,1'"),
        (["--range", "9"], "--range: must be two values LOW,HIGH, got '9'"),
        (["--opacity", "-1"], "--opacity: must be a factor from 0 to 1e6, got '-1'"),
        (["--unit", "a b"], "--unit: must be the name of a unit, such as mm, got 'a b'"),
        (["--background", "blck"], "--background: must be R,G,B, #RRGGBB, a name such as white, or transparent"),
        (["--tf", "ct-bon"], "did you mean 'ct-bone'?"),
        (["--view", "frnt"], "did you mean 'front'?"),
        (["--mode", "isosurfac"], "did you mean 'isosurface'?"),
        (["--zoom", "0"], "--zoom: must be a factor from 0.001 to 1000, got '0'"),
        (["--view", "front", "--eye", "1,2,3"], "--eye and --view both decide the view: give one of them"),
        (["--bakground", "1,1,1"], "did you mean '--background'?"),
        (["--light", "hed"], "did you mean 'head'?"),
        (["--light", "ponit:1,2,3"], "did you mean 'point'?"),
        (["--light", "studo"], "did you mean 'studio'?"),
        (["--light", "head:whit"], "did you mean 'white'?"),
        (["--background", "whit"], "did you mean 'white'?"),
        (["--depth-cue", "0.5,blak"], "did you mean 'black'?"),
        (["--mode", "isosurface", "--isovalue", "50:oragne"], "did you mean 'orange'?"),
        (["--gradient", "centrl"], "did you mean 'central'?"),
        (["--mode", "xray", "--air", "hounsfeld"], "did you mean 'hounsfield'?"),
        (["--tf", "ct-tissues", "--materials", "bon"], "did you mean 'bone'?"),
    ],
)
def test_what_is_wrong_is_said_with_a_guess(line: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "v.npy", *line, "-o", "a.png"]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1


def test_commands_and_keys_are_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rendr", "v.npy"]) == 2
    assert "did you mean 'render'?" in capsys.readouterr().err
    Path("s.toml").write_text('volume = "v.npy"\nbackgroud = "white"\n')
    assert main(["render", "--scene", "s.toml", "-o", "a.png"]) == 2
    assert "did you mean 'background'?" in capsys.readouterr().err
    assert did_you_mean("qqqq", ["render", "view"]) == ""


@pytest.mark.parametrize("pictures, rate", [(1, 0.5), (10, 5), (60, 30), (360, 30)])
def test_a_film_lasts_two_seconds(pictures: int, rate: float) -> None:
    assert default_rate(pictures) == rate


def test_render_says_what_it_drew(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "v.npy", "--size", "48", "-o", "a.png"]) == 0
    *_, why, last = capsys.readouterr().out.splitlines()
    assert why.startswith("measured, since nothing says what its values are: look proposal")
    found = re.fullmatch(r"a\.png: v\.npy, 48x48, look proposal, lit, estimated error ([\d.e-]+), [\d.]+ s", last)
    assert found and float(found[1]) < 0.1
    assert main(["render", "v.npy", "--tf", "grey", "--light", "none", "--size", "48", "-o", "a.png"]) == 0
    *before, last = capsys.readouterr().out.splitlines()
    assert "look grey, unlit" in last and not any("since nothing says" in line for line in before)


def test_an_error_above_the_limit_comes_with_what_lowers_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A limit that no picture reaches, unless it is asked for its rate."""
    monkeypatch.setattr("texvol.rendering.default_rate._FINEST", 1)
    np.save("v.npy", (100 * (BALL > 0.5)).astype(np.float32))
    line = ["render", "v.npy", "--no-labels", "--size", "48", "-o", "a.png"]
    assert main(line) == 0
    *_, last = capsys.readouterr().out.splitlines()
    assert re.search(r"estimated error [\d.]+ \(more slabs take longer: --max-error 0\.016\), [\d.]+ s$", last)
    assert main([*line, "--sampling-rate", "1"]) == 0
    *_, last = capsys.readouterr().out.splitlines()
    assert re.search(r"estimated error [\d.]+, [\d.]+ s$", last)


def test_all_looks_stand_on_one_sheet(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["presets", "v.npy", "--size", "48", "-o", "sheet.png"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("sheet.png: 21 looks: without --tf: proposal, ct-bone, ")
    sheet = image.read("sheet.png")
    assert sheet.shape[1] == 6 * 48
    tiles = [sheet[:48, left : left + 48] for left in range(0, 288, 48)]
    assert all(tile.max() > 0.2 for tile in tiles)
    assert main(["presets", "v.npy", "--size", "4", "-o", "sheet.png"]) == 2


@pytest.mark.parametrize(("text", "expected"), [("1/255", 1 / 255), ("0.01", 0.01), (" 1 / 64 ", 1 / 64)])
def test_an_error_may_be_a_fraction(text: str, expected: float) -> None:
    assert texts.error_limit(text) == expected
    for wrong in ("1/0", "1/2/3", "/", "one/2", "", "1/"):
        with pytest.raises(argparse.ArgumentTypeError, match="must be a number"):
            texts.error_limit(wrong)


def test_a_range_of_colours_is_refused_with_what_to_do() -> None:
    np.save("c.npy", np.zeros((4, 5, 6, 3), np.uint8))
    with pytest.raises(InputError, match=r"--range needs measured values, got colours .*--no-color reads them"):
        scene("--color", "--range", "1,2", volume="c.npy")
