"""`texvol raycast --exact-cells`: the picture of a file's own cells, and what does not go with it."""

from __future__ import annotations

import json
from math import exp
from pathlib import Path

import numpy as np
import pytest
from support.mesh_files import HEXAHEDRON, hexahedra, unstructured, written

from texvol.__main__ import main
from texvol.formats.pictures import image

VIEW = ["--eye", "1,1,-9", "--target", "1,1,1", "--up", "0,1,0", "--height", "1.5", "--size", "6x5"]
WHITE = {
    "points": [{"value": 0, "color": [1, 1, 1], "extinction": 0}, {"value": 2, "color": [1, 1, 1], "extinction": 3}]
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Cubes of the edge 2 with the values z and 2 - z, v.vtu, and an array, v.npy, in the folder to work in."""
    points, cells = hexahedra((2, 2, 2), seed=1)
    grid = unstructured(points, [(HEXAHEDRON, cells)], np.stack([points[:, 2], 2 - points[:, 2]], axis=1))
    written(tmp_path / "v.vtu", grid)
    np.save(tmp_path / "v.npy", np.zeros((4, 4, 4), np.float32))
    (tmp_path / "tf.json").write_text(json.dumps(WHITE))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*line: str) -> int:
    return main(["raycast", *line, "--exact-cells", "-o", "p.exr"])


@pytest.mark.parametrize("channel", ["0", "1"])
def test_the_picture_is_that_of_the_cells(folder: Path, channel: str) -> None:
    """τ = 3/2 z from 0 to 2, or 2 to 0, is an optical depth of 3; in float32."""
    assert run("v.vtu", "--channel", channel, "--tf", "tf.json", *VIEW) == 0
    np.testing.assert_allclose(image.read("p.exr"), 1 - exp(-3), rtol=0, atol=1e-7)


def test_the_coarse_grid_of_the_scene_does_not_matter(folder: Path) -> None:
    """A tent that two samples along an axis would miss: opacity 1 - exp(-4 · 0.2 / 2)."""
    tent = [{"value": v, "color": [1, 1, 1], "extinction": e} for v, e in ((0.9, 0), (1.0, 4), (1.1, 0))]
    (folder / "tf.json").write_text(json.dumps({"points": tent}))
    assert run("v.vtu", "--channel", "0", "--tf", "tf.json", "--resolution", "2,2,2", *VIEW) == 0
    np.testing.assert_allclose(image.read("p.exr"), 1 - exp(-0.4), rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (["v.npy"], "--exact-cells is for unstructured grids, got a volume of another kind"),
        (["v.vtu", "--light", "head"], "--exact-cells has no light: give --light none"),
        (["v.vtu", "--mode", "mip"], "--exact-cells does not go with a mode other than composite"),
        (["v.vtu", "--crop", "0,1,0,1,0,1"], "--exact-cells does not go with clip planes and a crop box"),
        (["v.vtu", "--spacing", "1,1,1"], "--exact-cells does not go with --transform and --spacing"),
        (["v.vtu", "--add", "v.npy"], "--exact-cells does not go with added volumes"),
        (["v.vtu", "--depth-cue", "1"], "--exact-cells does not go with a depth cue"),
        (["v.vtu", "--texture-refinement", "2"], "--exact-cells does not go with --texture-refinement"),
    ],
)
def test_what_does_not_go_with_it_is_refused(
    folder: Path, line: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    channel = ["--channel", "0"] if "v.vtu" in line else []
    assert run(*line, *channel, "--tf", "tf.json", *VIEW) == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
    assert not (folder / "p.exr").exists()
