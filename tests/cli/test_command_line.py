"""The command line as a user meets it: what it writes, and one line for everything that is wrong."""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from texvol.__main__ import main
from texvol.cli import command_line
from texvol.comparison import compare
from texvol.formats.pictures import image

TRANSFER = {
    "points": [
        {"value": 0, "color": [0.1, 0.2, 0.9], "extinction": 0},
        {"value": 1, "color": [1, 0.9, 0.5], "extinction": 0.3},
    ]
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume and a transfer function."""
    values = np.random.default_rng(0).random((12, 10, 8)).astype(np.float32)
    np.save(tmp_path / "v.npy", values)
    (tmp_path / "tf.json").write_text(json.dumps(TRANSFER))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*line: str) -> int:
    return main(list(line))


def test_a_picture_and_its_oracle(folder: Path) -> None:
    scene = ["v.npy", "--tf", "tf.json", "--size", "64x48", "--eye", "-20,-15,9", "--projection", "perspective"]
    assert run("render", *scene, "--sampling-rate", "8", "--classification", "extinction", "-o", "a.exr") == 0
    assert run("raycast", *scene, "--classification", "extinction", "-o", "b.exr") == 0
    picture, truth = image.read("a.exr"), image.read("b.exr")
    assert picture.shape == (48, 64, 4)
    assert picture[..., 3].max() > 0.5
    assert compare(picture, truth).max_error < 2e-3


def test_the_picture_remembers_its_scene(folder: Path) -> None:
    assert run("render", "v.npy", "--tf", "tf.json", "--size", "8x8", "-o", "a.exr") == 0
    source = oiio.ImageInput.open("a.exr")
    metadata = json.loads(source.spec().get_string_attribute("texvol:scene"))
    assert metadata["volume"] == "v.npy"
    assert metadata["transfer_function"] == TRANSFER
    assert metadata["camera"]["projection"] == "orthographic"
    assert source.spec().get_string_attribute("texvol:renderer")
    source.close()


def test_stats_hold_what_is_promised(folder: Path) -> None:
    assert run("render", "v.npy", "-o", "a.png", "--stats", "s.json", "--repeat", "3", "--size", "32x32") == 0
    stats = json.loads(Path("s.json").read_text())
    assert set(stats) == {
        "renderer", "backend", "size", "slab_thickness", "slabs", "samples", "samples_total", "classification",
        "texture_format", "halvings", "target_format", "texture_bytes", "bricks_total", "bricks_drawn", "cells_total",
        "cells_drawn", "early_termination", "modelled", "seconds", "estimated_error",
        "slicing", "pipeline", "interpolation", "adaptive", "texture_refinement", "estimated_model_error",
        "classification_reason", "shadow_nodes", "estimated_shadow_error",
    }  # fmt: skip
    assert set(stats["seconds"]) == {"load", "choose", "bake", "upload", "draw", "read"}


def test_device_options_reach_the_renderer(folder: Path) -> None:
    """What they change is in the stats, and the picture is the same to what each is said to cost."""
    values = np.zeros((40, 40, 40), np.uint8)
    values[20:30, 20:30, 20:30] = 200
    np.save("block.npy", values)
    points = [{"value": v, "color": [1, 0.8, 0.5], "extinction": e} for v, e in ((0, 0), (200, 2))]
    Path("block.json").write_text(json.dumps({"points": points}))
    stats, pictures = {}, {}
    for name, options in {
        "default": [],
        "bricks": ["--texture-memory", "0.05"],
        "early": ["--early-termination", "0.25"],
        "never": ["--early-termination", "0"],
        "everywhere": ["--no-skip-empty"],
        "skipped": ["--skip-empty"],
    }.items():
        scene = ["--tf", "block.json", "--fit", "box", "--sampling-rate", "1", "--size", "40x40"]
        line = ["block.npy", *scene, *options, "-o", "a.exr", "--stats", "s.json"]
        assert run("render", *line) == 0
        stats[name], pictures[name] = json.loads(Path("s.json").read_text()), image.read("a.exr")
    assert stats["default"]["bricks_total"] == 1 < stats["bricks"]["bricks_total"]
    assert stats["bricks"]["texture_bytes"] <= 5e4
    assert (stats["early"]["early_termination"], stats["never"]["early_termination"]) == (0.25, 0)
    assert stats["early"]["samples"] < stats["default"]["samples"] < stats["never"]["samples"]
    assert stats["everywhere"]["samples"] > stats["default"]["samples"] == stats["skipped"]["samples"]
    for name, most in {"bricks": 1e-5, "early": 0.25, "never": 2**-21, "everywhere": 1e-6, "skipped": 0}.items():
        assert np.abs(pictures[name] - pictures["default"]).max() <= most


def test_a_scene_file_may_stand_in_the_place_of_the_volume(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scene.toml").write_text('volume = "v.npy"\ntf = "tf.json"\nsize = "20x10"\nclassification = "extinction"\n')
    assert run("render", "scene.toml", "-o", "a.exr") == 0
    assert run("render", "--scene", "scene.toml", "-o", "b.exr") == 0
    np.testing.assert_array_equal(image.read("a.exr"), image.read("b.exr"))
    assert run("raycast", "scene.toml", "-o", "a.exr") == 0
    capsys.readouterr()
    assert run("render", "scene.toml", "--scene", "scene.toml", "-o", "a.exr") == 2
    assert "scene.toml: is a scene file, and --scene names one as well" in capsys.readouterr().err
    assert run("info", "scene.toml") == 2
    assert "scene.toml: has an unknown format" in capsys.readouterr().err


def test_the_line_wins_over_the_scene_file(folder: Path) -> None:
    Path("sub").mkdir()
    Path("sub/scene.toml").write_text(
        'tf = "../tf.json"\nsize = [40, 30]\nbackground = "0.5,0,0"\nprojection = "perspective"\nfov = 30\n'
        'eye = [30, -10, 5]\nclassification = "extinction"\nspacing = [1, 2, 1.5]\n'
    )
    assert run("render", "v.npy", "--scene", "sub/scene.toml", "-o", "a.exr") == 0
    assert run(
        "render", "v.npy", "--tf", "tf.json", "--size", "40x30", "--background", "0.5,0,0", "--projection",
        "perspective", "--fov", "30", "--eye", "30,-10,5", "--classification", "extinction", "--spacing", "1,2,1.5",
        "-o", "b.exr",
    ) == 0  # fmt: skip
    np.testing.assert_array_equal(image.read("a.exr"), image.read("b.exr"))
    assert run("render", "v.npy", "--scene", "sub/scene.toml", "--size", "10x20", "-o", "c.exr") == 0
    assert image.read("c.exr").shape == (20, 10, 4)


def test_a_transparent_png_has_opacity_and_others_have_none(folder: Path) -> None:
    assert run("render", "v.npy", "--size", "16x16", "--background", "transparent", "-o", "a.png") == 0
    assert run("render", "v.npy", "--size", "16x16", "-o", "b.png") == 0
    assert image.read("a.png").shape[2] == 4
    assert image.read("b.png").shape[2] == 3


def test_info_for_people_and_machines(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("info", "v.npy") == 0
    assert "8 x 10 x 12" in capsys.readouterr().out.replace("×", "x")
    assert run("info", "v.npy", "--json") == 0
    assert json.loads(capsys.readouterr().out)["dimensions"] == [8, 10, 12]


def test_spacing_on_the_line_overrides(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("info", "v.npy", "--spacing", "1,2,3.5", "--json") == 0
    assert json.loads(capsys.readouterr().out)["spacing"] == [1, 2, 3.5]


WRONG = [
    (["render"], "required"),
    (["paint", "v.npy"], "invalid choice"),
    (["render", "v.npy", "--method", "cuberille"], "; render has no such option"),
    (["render", "v.npy", "--siez", "3"], "did you mean '--size'?"),
    (["render", "v.npy"], "required: -o/--output"),
    (["render", "missing.npy", "-o", "a.png"], "missing.npy"),
    (["render", "v.npy", "-o", "a.bmp"], "a.bmp: the name of a picture must end with"),
    (["render", "v.npy", "-o", "no/a.png"], "folder no does not exist"),
    (["render", "v.npy", "-o", "a.png", "--stats", "no/s.json"], "no/s.json"),
    (["render", "v.npy", "-o", "a.png", "--size", "0x10"], "size must be at least 1x1, got 0x10"),
    (["render", "v.npy", "-o", "a.png", "--size", "10x"], "must be WIDTHxHEIGHT"),
    (["render", "v.npy", "-o", "a.png", "--size", "-3x4"], "must be WIDTHxHEIGHT"),
    (["render", "v.npy", "-o", "a.png", "--size", "999999x4"], "this driver draws 1 to"),
    (["render", "v.npy", "-o", "a.png", "--eye", "1,2,3", "--target", "1,2,3"], "eye and target must differ"),
    (["render", "v.npy", "-o", "a.png", "--eye", "1,2"], "three numbers"),
    (["render", "v.npy", "-o", "a.png", "--eye", "0,0,50", "--target", "0,0,0", "--up", "0,0,1"], "parallel"),
    (["render", "v.npy", "-o", "a.png", "--up", "0,0,0"], "up must not be zero"),
    (["render", "v.npy", "-o", "a.png", "--projection", "perspective", "--fov", "180"], "fov must be an angle"),
    (["render", "v.npy", "-o", "a.png", "--height", "-1"], "height must be positive"),
    (["render", "v.npy", "-o", "a.png", "--projection", "fisheye"], "orthographic, perspective"),
    (["render", "v.npy", "-o", "a.png", "--background", "0,nan,0"], "must be three numbers of at least 0"),
    (
        ["render", "v.npy", "-o", "a.png", "--tf", "nothing"],
        "must be a file such as .json or .toml, the name of a colour map",
    ),
    (["render", "v.npy", "-o", "a.png", "--tf", "nothing.json"], "nothing.json: cannot be read"),
    (["render", "v.npy", "-o", "a.png", "--slab-thickness", "0"], "slab thickness must be positive"),
    (["render", "v.npy", "-o", "a.png", "--slab-thickness", "1e-12"], "at most 1048576 can be drawn"),
    (["render", "v.npy", "-o", "a.png", "--sampling-rate", "nan"], "sampling rate must be positive"),
    (["render", "v.npy", "-o", "a.png", "--sampling-rate", "1", "--slab-thickness", "1"], "not allowed with"),
    (["render", "v.npy", "-o", "a.png", "--texture-memory", "0"], "must be a number of megabytes over 0"),
    (["render", "v.npy", "-o", "a.png", "--texture-memory", "nan"], "must be a number of megabytes over 0"),
    (["render", "v.npy", "-o", "a.png", "--texture-memory", "1e308"], "must be a number of megabytes over 0"),
    (["render", "v.npy", "-o", "a.png", "--texture-memory", "-1"], "must be a number of megabytes over 0"),
    (["render", "v.npy", "-o", "a.png", "--texture-memory", "much"], "must be a number"),
    (["render", "v.npy", "-o", "a.png", "--early-termination", "1"], "transmittance of at least 0 and under 1"),
    (["render", "v.npy", "-o", "a.png", "--early-termination", "-0.1"], "transmittance of at least 0 and under 1"),
    (["render", "v.npy", "-o", "a.png", "--early-termination", "nan"], "transmittance of at least 0 and under 1"),
    (["render", "v.npy", "-o", "a.png", "--repeat", "0"], "--repeat must be at least 1"),
    (["render", "v.npy", "-o", "a.png", "--max-error", "-1"], "maximum error must be positive"),
    (["render", "v.npy", "-o", "a.png", "--max-error", "1", "--sampling-rate", "1"], "not allowed with"),
    (["render", "v.npy", "-o", "a.png", "--stats", "."], "must be a file, got a folder"),
    (["render", "v.npy", "-o", "x" * 252 + ".png"], "File name too long"),
    (["render", "v.npy", "-o", "a.png", "--spacing", "1e200,1,1"], "from 1e-90 to 1e90"),
    (["render", "v.npy", "-o", "a.png", "--eye", "1e160,0,0"], "eye must be at most 1e100"),
    (["render", "v.npy", "-o", "a.png", "--slab-thickness", "1e-320"], "at most 1048576 can be drawn"),
    (
        ["render", "v.npy", "-o", "a.png", "--size", "16384x16384", "--target-format", "rgba32f"],
        "no memory for a picture",
    ),
    (["render", "v.npy", "-o", "a.png", "--scene", "typed.toml"], "tf must be text, a number or an array"),
    (["render", "v.npy", "-o", "a.png", "--texture-format", "r8"], "invalid choice"),
    (["render", "v.npy", "-o", "a.png", "--backend", "metal"], "invalid choice"),
    (["render", "v.npy", "-o", "a.png", "--spacing", "1,-1,1"], "spacing must be positive"),
    (["render", "v.npy", "-o", "a.png", "--spacing", "1,0,1"], "spacing must be positive"),
    (["render", "v.npy", "-o", "a.png", "--spacing", "1,nan,1"], "spacing must be finite"),
    (["render", "v.npy", "-o", "a.png", "--scene", "missing.toml"], "missing.toml: cannot be read"),
    (["render", "v.npy", "-o", "a.png", "--scene", "tf.json"], "tf.json: is not TOML"),
    (["render", "v.npy", "-o", "a.png", "--scene", "unknown.toml"], "unknown scene option 'colour'"),
    (["render", "v.npy", "-o", "a.png", "--scene", "wrong.toml"], "wrong.toml: size: must be"),
    (["raycast", "v.npy", "-o", "a.png", "--size", "0x0"], "size must be at least 1x1, got 0x0"),
    (["demo", "-o", "no/a.png"], "folder no does not exist"),
    (["demo", "-o", "a.txt"], "a.txt: the name of a picture must end with"),
]


@pytest.mark.parametrize("line, message", WRONG, ids=[" ".join(line) for line, _ in WRONG])
def test_what_is_wrong_is_said_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], line: list[str], message: str
) -> None:
    Path("unknown.toml").write_text("colour = 1\n")
    Path("wrong.toml").write_text('size = "big"\n')
    Path("typed.toml").write_text("tf = true\n")
    before = sorted(os.listdir("."))
    assert run(*line) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("texvol: error: ")
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert captured.out == ""
    assert sorted(os.listdir(".")) == before


def test_a_folder_that_cannot_be_written_to_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if os.geteuid() == 0:
        path = "/proc/a.png"  # root may write to any real folder
    else:
        Path("locked").mkdir(mode=0o500)
        path = "locked/a.png"
    assert run("render", "v.npy", "-o", path) == 2
    assert path in capsys.readouterr().err


def test_a_reader_that_goes_away_is_no_error(folder: Path) -> None:
    process = subprocess.run(
        f"{sys.executable} -m texvol info v.npy | head -c 1", shell=True, capture_output=True, text=True, check=False
    )
    assert process.stderr == ""


def test_help_names_every_scene_option(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        run("render", "--help")
    assert caught.value.code == 0
    text = capsys.readouterr().out
    names = "tf size background projection eye target up fov height classification spacing stats scene"
    others = (
        "sampling-rate slab-thickness max-error early-termination skip-empty no-skip-empty texture-memory orbit fps"
    )
    for option in (f"--{name}" for name in [*names.split(), *others.split()]):
        assert option in text


def test_an_error_that_is_asked_for_is_kept(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = ["v.npy", "--tf", "tf.json", "--size", "40x40", "--classification", "extinction"]
    assert run("raycast", *scene, "-o", "truth.exr") == 0
    thickness = []
    for wanted in ("0.1", "0.01", "0.001"):
        line = ["render", *scene, "--max-error", wanted, "--strict", "-o", "a.exr", "--stats", "s.json"]
        assert run(*line) == 0
        stats = json.loads(Path("s.json").read_text())
        true = compare(image.read("a.exr"), image.read("truth.exr")).max_error
        assert true <= stats["estimated_error"] <= float(wanted)
        thickness.append(stats["slab_thickness"])
    assert thickness[0] > thickness[1] > thickness[2]
    assert capsys.readouterr().err == ""


def test_an_error_that_cannot_be_kept_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["render", "v.npy", "--size", "9x9", "--max-error", "1e-9", "-o", "a.png"]
    assert run(*line) == 0
    assert capsys.readouterr().err.startswith("texvol: warning: requested error of 1e-09 not reached")
    assert run(*line, "--strict") == 1
    assert Path("a.png").exists()


@pytest.mark.parametrize(
    "redirection, message",
    [(">/dev/full", "standard output: cannot be written: No space left"), (">&-", "standard output is closed")],
)
def test_output_that_goes_nowhere_is_said(folder: Path, redirection: str, message: str) -> None:
    command = f"{sys.executable} -m texvol info v.npy {redirection}"
    process = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert process.returncode == 2
    assert message in process.stderr
    assert process.stderr.count("\n") == 1


def test_a_terminal_without_block_characters_gets_something(folder: Path) -> None:
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    process = subprocess.run(
        [sys.executable, "-m", "texvol", "info", "v.npy"], env=environment, capture_output=True, text=True, check=False
    )
    assert process.returncode == 0
    assert "8 x 10 x 12" in process.stdout


def test_picture_and_stats_are_written_both_or_not_at_all(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("old.json").write_text("old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, limits[1]))
    try:
        assert run("render", "v.npy", "--size", "1x1", "-o", "a.png", "--stats", "old.json") == 2
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert "cannot be written: File too large" in capsys.readouterr().err
    assert Path("old.json").read_text() == "old"
    assert sorted(os.listdir(".")) == ["old.json", "tf.json", "v.npy"]


def test_a_link_stays_a_link(folder: Path) -> None:
    Path("sub").mkdir()
    os.symlink("sub/real.png", "a.png")
    assert run("render", "v.npy", "--size", "8x8", "-o", "a.png") == 0
    assert Path("a.png").is_symlink()
    assert image.read("sub/real.png").shape == (8, 8, 3)


def test_values_and_extinctions_of_any_size_are_drawn_without_a_word(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    signs = np.where(np.random.default_rng(1).random((5, 5, 5)) < 0.5, -1, 1)
    np.save("huge.npy", np.random.default_rng(2).random((5, 5, 5)) * 1e308 * signs)
    points = [{"value": v, "color": [1, 1, 1], "extinction": e} for v, e in ((-8e307, 0), (8e307, 1e308))]
    Path("huge.json").write_text(json.dumps({"points": points}))
    # The colours of a transfer function are of any classification; extinctions are scaled by each in its own way.
    for options, classifications in {
        (): ("slab", "post"),
        ("--tf", "viridis"): ("extinction", "integrated"),
        ("--tf", "huge.json"): ("slab", "extinction", "post", "integrated"),
    }.items():
        for classification in classifications:
            line = ["render", "huge.npy", *options, "--classification", classification, "--size", "9x9", "-o", "h.exr"]
            assert run(*line) == 0
            assert np.isfinite(image.read("h.exr")).all()
    assert capsys.readouterr().err == ""


def test_a_parser_of_one_command_is_that_of_all() -> None:
    def commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
        (found,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
        return dict(found.choices)

    together = commands(command_line._parser())
    assert list(together) == list(command_line._COMMANDS)
    for name in set(together) - set(command_line._OF_ALL):
        alone = commands(command_line._parser(name))
        assert list(alone) == [name]
        assert alone[name].format_help() == together[name].format_help()
