"""Options for light, gradients, materials and projection modes: on the line, in a scene file, both, and wrong."""

from __future__ import annotations

import argparse
import itertools
import os
from pathlib import Path

import numpy as np
import pytest

from texvol import InputError, Volume
from texvol.__main__ import main
from texvol.options import groups as scene_groups
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.options.scene_options import SceneOptions
from texvol.scene import transfer
from texvol.scene.gradient import CENTRAL, Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.looks import EXPOSED
from texvol.scene.scene import Scene
from texvol.scene.transfer import presets

VOLUME = Volume(np.linspace(-1000, 1000, 4 * 5 * 6, dtype=np.float32).reshape(4, 5, 6))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume."""
    np.save(tmp_path / "v.npy", VOLUME.values)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def chosen(*line: str, file: str | None = None) -> SceneOptions:
    """Scene options of a line and the text of a scene file."""
    parser = argparse.ArgumentParser(exit_on_error=False)
    reading_options.add_volume_options(parser)
    options.add_scene_options(parser)
    if file is not None:
        Path("scene.toml").write_text(file, encoding="utf-8")
        line = (*line, "--scene", "scene.toml")
    return SceneOptions(parser.parse_args(texts.with_negative_values(["v.npy", *line])))


def scene(*line: str, file: str | None = None) -> Scene:
    return chosen(*line, file=file).scene(VOLUME)


HEAD = Light()
SUN = Light("directional", (-1, 0, 2))
LAMP = Light("point", (5, -6, 7.5), (1, 0.5, 0))
ISO = ["--mode", "isosurface", "--isovalue"]

# What the line says, what a file says in its place, the field of the scene, and what stands in it.
SAME = [
    (["--light", "head"], 'light = "head"', "lighting", Lighting((HEAD,))),
    (["--light", "head:0.5"], 'light = "head:0.5"', "lighting", Lighting((Light(color=(0.5, 0.5, 0.5)),))),
    (["--light", "head:1,2,3"], 'light = ["head:1,2,3"]', "lighting", Lighting((Light(color=(1, 2, 3)),))),
    (["--light", "-1,0,2"], "light = [-1, 0, 2]", "lighting", Lighting((SUN,))),
    (["--light", "directional:-1,0,2"], 'light = "directional:-1,0,2"', "lighting", Lighting((SUN,))),
    (
        ["--light", "directional: -1, 0, 2 : 2"],
        'light = {kind = "directional", direction = [-1, 0, 2], color = 2}',
        "lighting",
        Lighting((Light("directional", (-1, 0, 2), (2, 2, 2)),)),
    ),
    (
        ["--light", "-1,0,2:0,0.5,1"],
        'light = {kind = "directional", color = [0, 0.5, 1], direction = "-1,0,2"}',
        "lighting",
        Lighting((Light("directional", (-1, 0, 2), (0, 0.5, 1)),)),
    ),
    (
        ["--light", "point:5,-6,7.5:1,.5,0", "--light", "-1,0,2", "--light", "head"],
        '[[light]]\nkind = "point"\nposition = [5, -6, 7.5]\ncolor = [1, 0.5, 0]\n'
        '[[light]]\nkind = "directional"\ndirection = [-1, 0, 2]\n[[light]]\nkind = "head"\n',
        "lighting",
        Lighting((LAMP, SUN, HEAD)),
    ),
    (
        ["--light", "head", "--light", "-1,0,2", "--light", "point:5,-6,7.5:1,0.5,0"],
        'light = ["head", [-1, 0, 2], {kind = "point", position = [5, -6, 7.5], color = [1, 0.5, 0]}]',
        "lighting",
        Lighting((HEAD, SUN, LAMP)),
    ),
    (["--light", "none"], 'light = "none"', "lighting", None),
    (["--light", "ambient"], 'light = "ambient"', "lighting", Lighting(())),
    (["--light", "ambient", "--ambient", "0.5"], 'light = "ambient"\nambient = 0.5', "lighting", Lighting((), 0.5)),
    (["--light", "ambient"], 'light = {kind = "ambient"}', "lighting", Lighting(())),
    (["--light", "depth"], 'light = {kind = "depth"}', "lighting", None),
    (["--light", "depth"], 'light = ["depth"]', "depth_cue", DepthCue(1.0, (0, 0, 0))),
    (["--light", "head"], 'light = "head"', "depth_cue", None),
    # Each of these alone stands for a head light.
    (["--ambient", "0"], "ambient = 0", "lighting", Lighting(ambient=0)),
    (["--diffuse", "1.5"], "diffuse = 1.5", "lighting", Lighting(diffuse=1.5)),
    (["--specular", "0.4"], "specular = 0.4", "lighting", Lighting(specular=0.4)),
    (["--shininess", "1e3"], "shininess = 1e3", "lighting", Lighting(shininess=1000)),
    (["--fade", "12"], "fade = 12", "lighting", Lighting(fade=12)),
    (["--two-sided"], "two-sided = true", "lighting", Lighting(two_sided=True)),
    (["--no-two-sided"], "two_sided = false", "lighting", Lighting(two_sided=False)),
    (["--shadows"], "shadows = true", "lighting", Lighting(shadows=True)),
    (["--no-shadows"], "shadows = false", "lighting", EXPOSED),
    (
        ["--light", "-1,0,2", "--ambient", "0.1", "--fade", "3", "--no-two-sided"],
        'ambient = 0.1\nfade = 3\ntwo-sided = false\nlight = "-1,0,2"',
        "lighting",
        Lighting((SUN,), ambient=0.1, fade=3, two_sided=False),
    ),
    (["--gradient", "central"], 'gradient = "central"', "gradient", CENTRAL),
    (["--gradient", "zucker-hummel"], 'gradient = "zucker-hummel"', "gradient", Estimator("zucker-hummel")),
    (["--gradient", "gaussian"], 'gradient = "gaussian"', "gradient", Estimator("gaussian", 1.0)),
    (["--gradient", "gaussian:2.5"], 'gradient = "gaussian:2.5"', "gradient", Estimator("gaussian", 2.5)),
    (["--depth-cue", "0.4"], "depth-cue = 0.4", "depth_cue", DepthCue(0.4)),
    (["--depth-cue", "0.4,1,0,2"], "depth_cue = [0.4, 1, 0, 2]", "depth_cue", DepthCue(0.4, (1, 0, 2))),
    (["--depth-cue", "0"], "depth-cue = 0", "depth_cue", None),
    (
        ["--light", "depth", "--depth-cue", "0.5,1,1,1"],
        'light = "depth"\ndepth-cue = "0.5,1,1,1"',
        "depth_cue",
        DepthCue(0.5, (1, 1, 1)),
    ),
    *(
        (["--mode", name], f'mode = "{name}"', "mode", name)
        for name in ("composite", "xray", "mip", "minip", "average")
    ),
    ([*ISO, "-300"], 'mode = "isosurface"\nisovalue = -300', "mode", "isosurface"),
    ([*ISO, "-300"], 'mode = "isosurface"\nisovalue = "-300"', "isovalue", -300.0),
]


@pytest.mark.parametrize("line, file, field, wanted", SAME, ids=[f"{case[2]} {' '.join(case[0])}" for case in SAME])
def test_line_and_file_say_the_same(line: list[str], file: str, field: str, wanted: object) -> None:
    assert getattr(scene(*line), field) == wanted
    assert getattr(scene(file=file), field) == wanted


def test_without_options_nothing_is_modelled() -> None:
    plain = scene("--light", "none")
    assert (plain.lighting, plain.depth_cue, plain.mode, plain.isovalue) == (None, None, "composite", None)
    assert plain.gradient is CENTRAL
    assert not plain.needs_gradient
    assert not scene("--light", "depth", "--depth-cue", "1,1,1,1").needs_gradient
    assert chosen().window is None
    assert chosen().coloring == "grey"


FILE = 'light = ["head", "0,0,1"]\nambient = 0.5\nshadows = true\ngradient = "zucker-hummel"\ndepth-cue = 0.2\n'


@pytest.mark.parametrize(
    "line, field, wanted",
    [
        (["--light", "-1,0,2"], "lighting", Lighting((SUN,), ambient=0.5, shadows=True)),
        (["--light", "none"], "lighting", None),
        (["--light", "depth"], "lighting", None),
        (["--ambient", "0"], "lighting", Lighting((HEAD, Light("directional", (0, 0, 1))), ambient=0, shadows=True)),
        (["--no-shadows"], "lighting", Lighting((HEAD, Light("directional", (0, 0, 1))), ambient=0.5)),
        (["--gradient", "gaussian:3"], "gradient", Estimator("gaussian", 3)),
        (["--depth-cue", "0.9"], "depth_cue", DepthCue(0.9)),
        (["--depth-cue", "0"], "depth_cue", None),
    ],
)
def test_the_line_wins(line: list[str], field: str, wanted: object) -> None:
    assert getattr(scene(*line, file=FILE), field) == wanted


def test_a_head_light_that_a_file_stands_for_stays_without_its_shadows() -> None:
    assert scene("--no-shadows", file="shadows = true").lighting == Lighting()


def test_a_mode_on_the_line_drops_what_the_file_says_for_another() -> None:
    iso, ct = 'mode = "isosurface"\nisovalue = 5', 'mode = "mip"\nwindow = [40, 400]'
    assert scene("--mode", "composite", file=iso).isovalue is None
    assert chosen("--mode", "composite", file=ct).window is None
    assert chosen("--mode", "xray", file=ct).window == (40, 400)
    assert scene("--mode", "isosurface", file=iso).isovalue == 5
    with pytest.raises(InputError, match="--window needs --mode xray or mip or minip or average, got --mode comp"):
        chosen("--mode", "composite", "--window", "1,2", file=ct)


@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average"])
def test_a_window_is_for_modes_of_numbers(mode: str) -> None:
    assert chosen("--mode", mode, "--window", "-600,1500").window == (-600, 1500)
    assert chosen(file=f'mode = "{mode}"\nwindow = [-600, 1500]').window == (-600, 1500)


@pytest.mark.parametrize("mode", [["--mode", "mip"], ["--mode", "xray"], [*ISO, "0"]])
def test_what_classifies_nothing_needs_no_transfer_function(mode: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transfer, "proposed_for", lambda volume: pytest.fail("nobody needs a proposal"))
    assert scene(*mode).transfer_function is None
    with_colors = chosen(*mode, "--tf", "viridis")
    assert with_colors.coloring == "tf"
    assert with_colors.scene(VOLUME).transfer_function.name == "viridis"


def test_an_isosurface_without_light_shows_its_own_colour() -> None:
    """None would be its head light; ambient 1 alone takes c to c · 1 + 0, whatever the gradient is."""
    assert scene(*ISO, "0").lighting is None
    for word in ("none", "depth"):
        own = scene(*ISO, "0", "--light", word, "--diffuse", "3").lighting
        assert (own.lights, own.ambient) == ((), 1)


@pytest.mark.parametrize("tf, loader", [("table-5-1", "preset"), ("tf.json", "load")])
def test_materials_go_to_the_transfer_function(tf: str, loader: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def loaded(
        name: str, volume: Volume, materials: object = None, unit: float | None = None
    ) -> transfer.TransferFunction:
        asked.append((os.path.basename(name), materials))
        return transfer.proposed_for(volume)

    Path("tf.json").write_text("{}")
    monkeypatch.setattr(presets if loader == "preset" else transfer, loader, loaded)
    scene("--tf", tf, "--materials", "bone, soft tissue")
    scene("--tf", tf)
    scene(file=f'tf = "{tf}"\nmaterials = ["bone", "soft tissue"]')
    scene("--materials", "fat", file=f'tf = "{tf}"\nmaterials = "bone"')
    both = ("bone", "soft tissue")
    assert asked == [(tf, both), (tf, None), (tf, both), (tf, ("fat",))]


def test_a_negative_value_after_each_option_that_takes_numbers() -> None:
    """Out of range is said by the option; argparse would say that there is no value."""
    for name in ("light", "ambient", "diffuse", "specular", "shininess", "fade", "depth-cue", "isovalue", "window"):
        assert texts.with_negative_values([f"--{name}", "-1"]) == [f"--{name}=-1"]
    assert scene("--light", "-.5,-1e-3,-2").lighting == Lighting((Light("directional", (-0.5, -1e-3, -2)),))


COLOUR = "colour must be three numbers of at least 0"
WRONG = [
    (["--light", "sun"], "--light: must be head, directional:X,Y,Z, X,Y,Z, point:X,Y,Z"),
    (["--light", ""], "must be head"),
    (["--light", "3"], "must be head"),
    (["--light", "depth:1"], "must be head"),
    (["--light", "head:1:2"], "must be head"),
    (["--light", "point:1,2,3:1:2:3"], "must be head"),
    (["--light", "point:1,2,3:1:far"], "must be a fall-off K, a distance"),
    (["--light", "point:1,2,3:1:0"], "fall-off must be a positive distance, got 0.0"),
    (["--light", "directional"], "--light: a directional light needs a direction, three numbers x, y, z"),
    (["--light", "directional:"], "a directional light needs a direction"),
    (["--light", "point"], "a point light needs a position, three numbers x, y, z"),
    (["--light", "point::1,1,1"], "a point light needs a position"),
    (["--light", "directional:0,0,0"], "direction must not be 0, 0, 0"),
    (["--light", "0,-0,0"], "direction must not be 0, 0, 0"),
    (["--light", "1,2"], "must be a direction X,Y,Z, got '1,2'"),
    (["--light", "directional:1,nan,0"], "must be a direction X,Y,Z, got '1,nan,0'"),
    (["--light", "point:inf,0,0"], "must be a position X,Y,Z, got 'inf,0,0'"),
    (["--light", "head:-1"], COLOUR),
    (["--light", "0,0,1:1,-0.5,1"], COLOUR),
    (["--light", "head:"], "must be a colour R,G,B or a brightness I, got ''"),
    (["--light", "head:1,2"], "must be a colour R,G,B or a brightness I, got '1,2'"),
    (["--light", "head:nan"], "must be a colour R,G,B or a brightness I, got 'nan'"),
    (["--light", "none", "--light", "head"], "light: none must be the only light, got 2 lights"),
    (["--light", "head", "--light", "depth"], "light: depth must be the only light, got 2 lights"),
    *(
        ([f"--{name}", text], f"--{name}: must be a number of at least 0, got {text!r}")
        for name, text in itertools.product(
            ("ambient", "diffuse", "specular", "shininess", "fade"), ("-1", "nan", "inf", "much", "1,2", "")
        )
    ),
    (["--two-sided=yes"], "--two-sided"),
    (["--gradient", "sobel"], "kind must be one of central, zucker-hummel, gaussian, adaptive, got 'sobel'"),
    (["--gradient", "central:2"], "must be central, zucker-hummel, adaptive or gaussian[:SCALE], got 'central:2'"),
    (["--gradient", "gaussian:"], "must be gaussian:SCALE, with SCALE a number of samples, got ''"),
    (["--gradient", "gaussian:-1"], "scale must be from 0.1 to 100 samples, got -1.0"),
    (["--gradient", "gaussian:nan"], "must be gaussian:SCALE, with SCALE a number of samples, got 'nan'"),
    (["--depth-cue", "1.5"], "--depth-cue: strength must be from 0 to 1, got 1.5"),
    (["--depth-cue", "-0.5"], "strength must be from 0 to 1, got -0.5"),
    (["--depth-cue", "1,0,0"], "must be a strength S, or S,R,G,B, got '1,0,0'"),
    (["--depth-cue", "1,-1,0,0"], COLOUR),
    (["--materials", "bone"], "--materials needs --tf, a transfer function that has these materials"),
    (["--tf", "table-5-1", "--materials", "bone,"], "--materials: must be names separated by commas, got 'bone,'"),
    (["--tf", "table-5-1", "--materials", "bone,gold"], "material 'gold' not found"),
    (["--tf", "viridis", "--materials", "bone"], "the preset viridis has none"),
    (["--mode", "mop"], "--mode: must be one of composite, xray, mip, minip, average, isosurface, got 'mop'"),
    (["--mode", "isosurface"], "--mode isosurface needs --isovalue V"),
    (["--isovalue", "3"], "--isovalue needs --mode isosurface, got --mode composite"),
    (["--mode", "mip", "--isovalue", "-3"], "--isovalue needs --mode isosurface, got --mode mip"),
    ([*ISO, "nan"], "--isovalue: must be a finite number, got 'nan'"),
    ([*ISO, "bone"], "--isovalue: must be a finite number, got 'bone'"),
    (["--window", "40,400"], "--window needs --mode xray or mip or minip or average, got --mode composite"),
    ([*ISO, "1", "--window", "40,400"], "--window needs --mode xray or mip or minip or average, got --mode isos"),
    (["--mode", "mip", "--window", "-40,0"], "--window: width must be positive, got 0"),
    (["--mode", "mip", "--window", "40,-400"], "--window: width must be positive, got -400"),
    (["--mode", "mip", "--window", "40"], "--window: CENTRE,WIDTH must be two finite numbers, got '40'"),
    (["--mode", "mip", "--window", "nan,1"], "--window: CENTRE,WIDTH must be two finite numbers, got 'nan,1'"),
    (["--mode", "mip", "--window", "1,inf"], "--window: CENTRE,WIDTH must be two finite numbers, got '1,inf'"),
]

KINDS = "kind must be one of head, directional, point, ambient, depth, none, three-point, studio"
WRONG_FILES = [
    ('light = "sun"', "scene.toml: light: must be head"),
    ("light = []", "scene.toml: light: must be head"),
    ("light = true", "scene.toml: light must be text, a number or an array"),
    ("light = [-1, 2]", "scene.toml: light: must be a direction X,Y,Z, got '-1,2'"),
    ('light = ["head", "none"]', "light: none must be the only light"),
    ('light = {kind = "point"}', "scene.toml: light: a point light needs a position, three numbers x, y, z"),
    ('light = {kind = "directional", color = 2}', "a directional light needs a direction"),
    ('light = {kind = "directional", direction = []}', "a directional light needs a direction"),
    ('light = {kind = "point", direction = [1, 2, 3]}', "unknown key 'direction' for kind point"),
    ('light = {kind = "head", position = [1, 2, 3]}', "unknown key 'position' for kind head"),
    ('light = {kind = "head", colour = 1}', "unknown key 'colour' for kind head"),
    ('light = {kind = "none", color = 1}', "unknown key 'color' for kind none"),
    ('light = {kind = "head", color = [1, true, 1]}', "must be a colour R,G,B or a brightness I, got '1,True,1'"),
    ('light = {kind = "head", color = -1}', COLOUR),
    ('light = {kind = "sun"}', f"{KINDS}, got 'sun'"),
    ('light = {kind = ["head"]}', f"{KINDS}, got ['head']"),
    ("light = {direction = [1, 2, 3]}", f"{KINDS}, got 'nothing'"),
    ("ambient = -0.1", "scene.toml: ambient: must be a number of at least 0, got '-0.1'"),
    ("ambient = nan", "scene.toml: ambient: must be a number of at least 0, got 'nan'"),
    ("ambient = true", "scene.toml: ambient must be text, a number or an array"),
    ("ambient = {a = 1}", "scene.toml: ambient must be text, a number or an array"),
    ("shadows = 1", "scene.toml: shadows must be true or false, got 1"),
    ('two-sided = "yes"', "scene.toml: two-sided must be true or false, got 'yes'"),
    ("depth-cue = [0.5, 1]", "scene.toml: depth-cue: must be a strength S, or S,R,G,B, got '0.5,1'"),
    ('gradient = "gaussian:1000"', "scene.toml: gradient: scale must be from 0.1 to 100 samples, got 1000.0"),
    ("window = [1, 2]", "--window needs --mode xray or mip or minip or average, got --mode composite"),
    ('mode = "mip"\nwindow = [1, 0]', "scene.toml: window: width must be positive, got 0"),
    ('mode = "isosurface"\nisovalue = inf', "scene.toml: isovalue: must be a finite number, got 'inf'"),
    ('materials = ["bone"]', "--materials needs --tf"),
]


def refused(capsys: pytest.CaptureFixture[str], *line: str) -> str:
    """What the command says in the one line that it ends with; it writes no picture."""
    before = sorted(os.listdir("."))
    assert main(["render", "v.npy", "-o", "a.png", *line]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("texvol: error: ")
    assert captured.err.count("\n") == 1
    assert sorted(os.listdir(".")) == before
    return captured.err


@pytest.mark.parametrize("line, message", WRONG, ids=[" ".join(line) for line, _ in WRONG])
def test_what_is_wrong_on_the_line(line: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert message in refused(capsys, *line)


@pytest.mark.parametrize("file, message", WRONG_FILES, ids=[file for file, _ in WRONG_FILES])
def test_what_is_wrong_in_a_file(file: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scene.toml").write_text(file, encoding="utf-8")
    assert message in refused(capsys, "--scene", "scene.toml")


def test_a_wrong_option_is_found_before_the_volume_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    Path("v.npy").unlink()
    for line in (["--mode", "isosurface"], ["--light", "depth", "--light", "head"], ["--materials", "bone"]):
        assert "v.npy" not in refused(capsys, *line)


@pytest.mark.parametrize("command", ["render", "raycast", "report"])
def test_help_lists_every_option_once_in_its_group(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    titles = (
        "scene:",
        "further volumes:",
        "camera:",
        "light:",
        "cutting:",
        "geometry:",
        "annotation:",
        "projection mode:",
    )
    at = {title: lines.index(title) for title in titles}
    assert sorted(titles, key=at.__getitem__) == list(titles)
    own = "tf unit-distance materials range opacity label-look hidden unit spacing transform mask"
    further = " ".join(f"add-{name}" for name in (*own.split(), *reading_options.READING))
    groups = {
        "scene:": "scene tf unit-distance materials range opacity label-look hidden classification unit "
        "spacing transform mask space size background gradient",
        "further volumes:": f"add {further}",
        "camera:": "projection eye target up fov height view azimuth elevation zoom fit",
        "light:": "light ambient diffuse specular shininess two-sided fade shadows depth-cue",
        "cutting:": "clip crop caps",
        "geometry:": "mesh depth-in",
        "annotation:": "annotate title value-name font measure",
        "projection mode:": "mode isovalue air window coloring",
    }
    for title, names in groups.items():
        first = at[title] + 1
        last = next((i for i in range(first, len(lines)) if lines[i].endswith(":") and lines[i][0] != " "), len(lines))
        after_its_description = "\n".join(lines[first:last]).strip("\n").split("\n\n")[-1].splitlines()
        listed = [line.split()[0].rstrip(",") for line in after_its_description if line.startswith("  --")]
        assert listed == [f"--{name}" for name in names.split()]
    in_scene_files = set(" ".join(groups.values()).split()) - set(further.split())
    assert in_scene_files == {"scene", *scene_groups.SCENE_OPTIONS}
    assert any("--no-two-sided" in line for line in lines)
