"""Pictures of numbers: what the window shows is what `render --scene` draws of the scene that was saved."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from support.windows import ball, display, eight_bits, script, texvol, viewed  # noqa: F401 (display is a fixture)

from texvol.__main__ import main
from texvol.formats.pictures.image import read
from texvol.options.scene_options import SceneOptions
from texvol.scene.air import HOUNSFIELD
from texvol.scene.scene import COLORINGS, NUMBER_MODES
from texvol.window import editing, saving
from texvol.window.commands import is_command
from texvol.window.document import Document, opened_file
from texvol.window.jobs import Answer, Job
from texvol.window.painting import JobRunner

SIZE = (48, 40)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    z, y, x = np.mgrid[tuple(slice(-1, 1, 20j) for _ in range(3))]
    r = np.sqrt(x**2 + y**2 + z**2)
    np.save("ct.npy", np.where(r < 0.3, 700, np.where(r < 0.8, 40 + 90 * x, -1000)).astype(np.int16))
    return tmp_path


@pytest.fixture(scope="module")
def runner() -> Any:
    answers: list[Answer] = []
    drawing = JobRunner(answers.append, lambda: 0)
    yield drawing, answers
    drawing.close()


def seen(runner: Any, document: Document) -> tuple[np.ndarray, Any]:
    """Pixels that the window shows at rest, and the settings that they were drawn with."""
    drawing, answers = runner
    answers.clear()
    drawing.paint(Job(1, "rest", document.scene, SIZE, {"max_error": 0.02}, document.showing))
    assert answers[-1].final and answers[-1].pixels is not None, answers[-1].text
    return answers[-1].pixels, answers[-1].metadata["settings"]


def pixels_of(name: str) -> np.ndarray:
    """Return the pixels of a PNG file."""
    return oiio.ImageBuf(name).get_pixels(oiio.UINT8)[..., :3]


@pytest.mark.parametrize("window", [None, (100.0, 900.0)], ids=["found", "chosen"])
@pytest.mark.parametrize("coloring", COLORINGS)
@pytest.mark.parametrize("mode", NUMBER_MODES)
def test_a_saved_scene_is_drawn_as_the_window_shows_it(folder, runner, mode, coloring, window) -> None:
    document = opened_file("ct.npy", SIZE)
    assert document.scene.transfer_function is not None, "that of matter stays when the mode changes"
    document.change(**editing.with_mode(document.scene, mode))
    document.change(**editing.with_coloring(document.scene, coloring))
    document.show(window=window)
    shown, settings = seen(runner, document)
    assert (np.ptp(shown.astype(int), axis=-1).max() > 20) == (coloring == "tf" and window is None)
    words = saving.command_line(document, SIZE, settings)
    assert main(words[1:]) == 0
    np.testing.assert_array_equal(pixels_of(words[-1]), shown)
    again = opened_file(words[words.index("--scene") + 1], SIZE)
    assert again.scene.coloring == ("grey" if window else coloring) and again.showing.window == window
    assert again.scene.air == document.scene.air == (HOUNSFIELD if mode == "xray" else None)
    np.testing.assert_array_equal(seen(runner, again)[0], shown)


@pytest.mark.parametrize("air", [None, -300.5, HOUNSFIELD])
def test_air_is_saved_as_it_is(folder, runner, air) -> None:
    document = opened_file("ct.npy", SIZE)
    document.change(**editing.with_mode(document.scene, "xray"))
    document.change(air=air)
    shown, settings = seen(runner, document)
    words = saving.command_line(document, SIZE, settings)
    assert main(words[1:]) == 0
    np.testing.assert_array_equal(pixels_of(words[-1]), shown)
    assert main([*words[1:-1], "exact.exr"]) == 0
    assert opened_file(words[words.index("--scene") + 1], SIZE).scene.air == air
    numbers = read("exact.exr")
    assert (numbers[..., 0].min() < 0) == (air is None)


def test_a_mode_has_what_it_needs_and_nothing_else(folder) -> None:
    document = opened_file("ct.npy", SIZE)
    light = document.scene.lighting
    for mode in ("xray", "isosurface", "xray", "mip", "composite", "xray"):
        document.change(**editing.with_mode(document.scene, mode))
        assert (document.scene.air == HOUNSFIELD) == (mode == "xray")
    assert document.scene.lighting == light


def test_the_line_wins_over_what_was_saved(folder) -> None:
    Path("s.toml").write_text('volume = "ct.npy"\nmode = "mip"\ntf = "viridis"\ncoloring = "grey"\n')

    def chosen(*line: str, file: str = "s.toml") -> tuple[str, Any]:
        import argparse

        from texvol.options.scene_options import add_scene_options

        parser = argparse.ArgumentParser()
        add_scene_options(parser)
        options = SceneOptions(parser.parse_args(["--scene", file, *line], argparse.Namespace(volume=None)))
        return options.coloring, options.window

    assert chosen() == ("grey", None)
    assert chosen("--tf", "inferno") == ("tf", None), "who names colours wants them"
    assert chosen("--coloring", "tf") == ("tf", None)
    Path("t.toml").write_text('volume = "ct.npy"\nmode = "mip"\ntf = "viridis"\ncoloring = "tf"\n')
    assert chosen("--window", "40,400", file="t.toml") == ("grey", (40, 400))
    assert chosen("--coloring", "grey", file="t.toml") == ("grey", None)
    Path("u.toml").write_text('volume = "ct.npy"\nmode = "mip"\ntf = "viridis"\nwindow = [40, 400]\n')
    assert chosen("--coloring", "tf", file="u.toml") == ("tf", None)
    assert chosen(file="u.toml") == ("grey", (40, 400)), "as ever"


def test_commands_change_mode_and_coloring() -> None:
    for each in (*(f"mode {mode}" for mode in ("composite", *NUMBER_MODES)), "coloring grey", "coloring tf"):
        assert is_command(each)
    assert not is_command("mode gray") and not is_command("coloring")


def test_the_window_itself(display: str, tmp_path: Path) -> None:  # noqa: F811
    """Opened as matter, switched to numbers: first grey, then in colours; saved and copied each time."""
    steps: list[dict[str, Any]] = []
    for number, mode in enumerate(("xray", "average", "mip")):
        steps += [{"t": 0.1 * (number + 1), "do": "command", "name": f"mode {mode}"}]
        steps += [{"t": 0.1 * (number + 1), "do": "rest"}]
    for number, coloring in enumerate(COLORINGS):
        steps += [
            {"t": 0.5 + number, "do": "command", "name": f"coloring {coloring}"},
            {"t": 0.6 + number, "do": "rest"},
            {"t": 0.6 + number, "do": "command", "name": f"picture {coloring}.png"},
            {"t": 0.6 + number, "do": "save", "file": f"{coloring}.toml"},
            {"t": 0.7 + number, "do": "rest"},
        ]
    words = [ball(tmp_path), "--size", "96x80", "--max-error", "0.02", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, *words)
    assert done.returncode == 0, done.stderr
    for coloring in COLORINGS:
        text = (tmp_path / f"{coloring}.toml").read_text()
        assert f'coloring = "{coloring}"' in text, shlex.join(words)
        texvol(tmp_path, "render", "--scene", f"{coloring}.toml", "--max-error", "0.02", "-o", "again.png")
        shown, again = (eight_bits(tmp_path / name) for name in (f"{coloring}.png", "again.png"))
        assert np.abs(shown - again).max() <= 1, "extremes do not depend on slabs, but for rounding"
        assert (np.ptp(shown, axis=-1).max() > 20) == (coloring == "tf")
