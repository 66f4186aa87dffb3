"""Every step of a time series, in numbered pictures or a film; and annotation and cutting on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import nibabel
import numpy as np
import pytest

from texvol import Scene, load
from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import image
from texvol.formats.readers import TimeSeries
from texvol.output.sequences import representative_volume
from texvol.rendering.renderer import Renderer
from texvol.scene.framing import framed
from texvol.scene.looks import look_for

STEPS = 4


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a blob that moves and grows brighter in moving.nii.gz."""
    monkeypatch.chdir(tmp_path)
    z, y, x = np.mgrid[:12, :12, :12] / 12 - 0.5
    steps = [np.exp(-30 * ((x - 0.2 * t) ** 2 + y**2 + z**2)) * (1 + 5 * t) for t in range(STEPS)]
    samples = np.moveaxis(np.stack(steps, -1), (0, 1, 2), (2, 1, 0)).astype(np.float32)
    nibabel.save(nibabel.Nifti1Image(samples, np.diag([2.0, 2, 2, 1])), "moving.nii.gz")
    return tmp_path


def run(*line: str) -> int:
    return main(["render", "moving.nii.gz", "--size", "40x30", *line])


def test_every_step_is_drawn_with_one_camera_and_one_transfer_function(folder: Path) -> None:
    assert run("--time", "all", "-o", "step_%02d.exr", "--classification", "post", "--stats", "stats.json") == 0
    assert sorted(path.name for path in folder.glob("step_*")) == [f"step_{i:02d}.exr" for i in range(STEPS)]
    assert json.loads(Path("stats.json").read_text())["time"]["views"] == STEPS
    with TimeSeries("moving.nii.gz") as series:
        stands = representative_volume(series)
        look = look_for(stands)
        camera = framed(Scene(stands, look), aspect=40 / 30)
        with Renderer() as renderer:
            for i, volume in enumerate(series):
                scene = Scene(volume, look, camera, classification="post")
                np.testing.assert_array_equal(image.read(f"step_{i:02d}.exr"), renderer.render(scene, (40, 30)))
    # Each says which step it is, so that it can be drawn again.
    metadata = json.loads(read_picture("step_02.exr").attributes["texvol:scene"])
    assert metadata["source"]["time"] == 2


def test_a_transfer_function_adapts_to_all_steps_and_not_to_the_first(folder: Path) -> None:
    with TimeSeries("moving.nii.gz") as series:
        stands = representative_volume(series)
        assert stands.finite_range == series.finite_range
        assert stands.dimensions == series[0].dimensions
        np.testing.assert_allclose(stands.box_edges, series[0].box_edges)
        found = np.quantile(stands.values, [0.5, 0.9, 0.99])
        every = np.quantile([volume.values for volume in series], [0.5, 0.9, 0.99])
        # A quarter of 1728 samples, spread evenly; the blob's flanks are steep.
        np.testing.assert_allclose(found, every, rtol=0.15)
    assert load("moving.nii.gz", time=0).finite_range != stands.finite_range


def test_a_single_step_is_a_series_of_one(folder: Path) -> None:
    np.save("still.npy", np.ones((4, 4, 4), np.float32))
    assert main(["render", "still.npy", "--time", "all", "-o", "s_%d.png", "--size", "8x8"]) == 0
    assert Path("s_0.png").exists() and len(list(folder.glob("s_*"))) == 1


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["--time", "all", "-o", "a.png"], "must have one %d"),
        (["--time", "all", "-o", "a_%d.png", "--orbit", "3"], "leave --orbit"),
        (["--time", "all", "-o", "a_%d.png", "--repeat", "3"], "--repeat"),
        (["--time", "9", "-o", "a.png"], "4 time steps"),
        (["--time", "some", "-o", "a.png"], "--time"),
        (["-o", "a_%d.png"], "--time all"),
        (["-o", "a.png", "--annotate", "box,compass"], "compass"),
        (["-o", "a.png", "--annotate", "orientation", "--time", "0", "--font", "gone.ttf"], "gone.ttf"),
        (["-o", "a.png", "--time", "0", "--clip", "1,0,0"], "NX,NY,NZ,D"),
        (["-o", "a.png", "--time", "0", "--clip", "0,0,0,1"], "0, 0, 0"),
        (["-o", "a.png", "--time", "0", "--crop", "0,1,3,2,0,1"], "y must go from less to more"),
        (["-o", "a.png", "--time", "0", "--crop", "0,1,2,3,0"], "six numbers"),
        (["-o", "a.png", "--time", "0", "--caps", "--mode", "mip"], "--caps"),
    ],
)
def test_wrong_usage_is_one_line_and_leaves_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], line: list[str], words: str
) -> None:
    assert run(*line) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1
    assert {path.name for path in folder.iterdir()} == {"moving.nii.gz"}


def test_other_commands_want_one_step(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["raycast", "moving.nii.gz", "--time", "all", "-o", "a.exr"]) == 2
    assert "--time N" in capsys.readouterr().err


def test_a_view_that_misses_the_volume_gives_an_empty_picture_and_a_warning(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--time", "0", "--eye", "500,0,0", "--target", "900,0,0", "-o", "a.exr") == 0
    assert "outside the view" in capsys.readouterr().err
    assert not image.read("a.exr").any()
    assert run("--time", "0", "--crop", "90,99,0,9,0,9", "-o", "a.exr") == 0
    assert "clip planes and crop box hide everything" in capsys.readouterr().err, "it is in view, and cut away"


def test_annotation_is_in_pictures_and_not_in_data(folder: Path) -> None:
    plain, more = ("--time", "1", "--eye", "60,-80,40"), ("--annotate", "box,scale-bar", "--title", "a blob")
    for name in ("a.exr", "a.png"):
        assert run(*plain, "-o", name) == 0
        assert run(*plain, *more, "-o", f"more-{name}") == 0
    np.testing.assert_array_equal(image.read("a.exr"), image.read("more-a.exr"))
    assert np.abs(image.read("a.png") - image.read("more-a.png")).max() > 0.5


def test_what_cuts_is_the_same_on_the_line_and_in_a_scene_file(folder: Path) -> None:
    Path("scene.toml").write_text(
        'volume = "moving.nii.gz"\ntime = 1\nsize = "40x30"\ncaps = true\ncrop = [-3, 30, 0, 11, -9, 99]\n'
        'clip = [[1, 0.5, 0, 9], {normal = [0, 0, 1], offset = 5}]\ntitle = "cut"\nannotate = ["box"]\n'
    )
    cut = ["--clip", "1,0.5,0,9", "--clip", "0,0,1,5", "--crop", "-3,30,0,11,-9,99", "--caps"]
    assert run("--time", "1", *cut, "--annotate", "box", "--title", "cut", "-o", "line.png") == 0
    assert main(["render", "--scene", "scene.toml", "-o", "file.png"]) == 0
    np.testing.assert_array_equal(image.read("line.png"), image.read("file.png"))
    assert run("--time", "1", "--annotate", "box", "--title", "cut", "-o", "whole.png") == 0
    assert np.abs(image.read("line.png") - image.read("whole.png")).max() > 0.1
