"""A depth cue with a range of its own: what the line and a scene file say of it, and what of that is refused."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest

from texvol.options import scene_options as options
from texvol.options import texts
from texvol.options.scene_options import SceneOptions
from texvol.scene.lighting import DepthCue
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

VOLUME = Volume(np.zeros((2, 2, 2)))


def cue(*line: str, file: str = "") -> DepthCue | None:
    """That of the scene which they make."""
    Path("scene.toml").write_text(file, encoding="utf-8")
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("volume")
    options.add_scene_options(parser)
    words = texts.with_negative_values(["v.npy", *line, "--scene", "scene.toml"])
    return SceneOptions(parser.parse_args(words)).scene(VOLUME).depth_cue


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    "text, value, wanted",
    [
        ("0.4:-1,7.5", '"0.4:-1,7.5"', DepthCue(0.4, near=-1, far=7.5)),
        ("0.4,1,0,2:,9", "{strength = 0.4, color = [1, 0, 2], far = 9}", DepthCue(0.4, (1, 0, 2), far=9)),
        ("0.4:3,", "{strength = 0.4, near = 3}", DepthCue(0.4, near=3)),
        ("1", "{strength = 1}", DepthCue(1)),
    ],
)
def test_line_and_file_say_the_same(text: str, value: str, wanted: DepthCue) -> None:
    assert cue("--depth-cue", text) == cue(file=f"depth-cue = {value}") == wanted
    assert cue("--depth-cue", text, file="depth-cue = {strength = 0.9, near = 1, far = 2}") == wanted, "the line wins"


@pytest.mark.parametrize("text", ["0.4:", "0.4:,", "0.4:1", "0.4:1,2,3", "0.4:a,2", "0.4:1,nan", "0.4:5,4", ":1,2"])
def test_what_is_no_range_is_refused_on_the_line(text: str) -> None:
    with pytest.raises(SystemExit):
        cue("--depth-cue", text)


@pytest.mark.parametrize(
    "value, reason",
    [
        ("true", "a strength S"),
        ("{near = 1}", "keys must be strength, color, near and far"),
        ("{strength = 0.5, end = 1}", "keys must be strength, color, near and far"),
        ("{strength = 0.5, near = 4, far = 4}", "near must be less than far"),
        ('{strength = "0.5:1,2"}', "a strength S"),
        ('{strength = 0.5, near = "1,2"}', "a depth in world units"),
    ],
)
def test_what_is_none_is_refused_in_a_file(value: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason) as caught:
        cue(file=f"depth-cue = {value}")
    assert str(caught.value).startswith("scene.toml: depth-cue: ")
