"""The window itself, on a display without a screen: what it shows, what it takes, and how it ends."""

from __future__ import annotations

import contextlib
import json
import math
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.windows import (  # noqa: F401 (display is a fixture)
    PATIENCE,
    ball,
    children_of,
    display,
    display_of_all,
    eight_bits,
    environment,
    script,
    started,
    texvol,
    timings,
    until,
    viewed,
)

from texvol.__main__ import main
from texvol.window import contents, saving
from texvol.window.document import opened_file

ERROR = 1 / 255
REST: dict[str, Any] = {"do": "rest"}


def tapped(t: float, name: str, *modifiers: str) -> list[dict[str, Any]]:
    """A key, down and up."""
    key = {"kind": "key", "name": name, "modifiers": list(modifiers)}
    return [{"t": t, **key, "down": True}, {"t": t + 0.05, **key, "down": False}]


def dragged(t: float, start: tuple[int, int], end: tuple[int, int], steps: int = 10) -> list[dict[str, Any]]:
    """A drag with the left button, for half a second."""
    positions = np.linspace(start, end, steps)
    return [
        {"t": t, "kind": "move", "x": start[0], "y": start[1]},
        {"t": t + 0.05, "kind": "button", "name": "left", "down": True},
        *({"t": t + 0.05 + 0.04 * n, "kind": "move", "x": x, "y": y} for n, (x, y) in enumerate(positions.tolist(), 1)),
        {"t": t + 0.5, "kind": "button", "name": "left", "down": False},
    ]


# The first is opened by the command line, the others are dropped on the window.
SCENES = {
    "annotated": [
        *("--classification", "post", "--projection", "perspective"),
        *("--annotate", "box,scale-bar,legend", "--background", "0.2,0.2,0.2"),
    ],
    "cut": ["--light", "head", "--clip", "1,0.3,0,17", "--caps", "--classification", "extinction"],
    "surface": ["--mode", "isosurface", "--isovalue", "120", "--background", "0.1,0.2,0.3"],
}


@pytest.fixture(scope="module")
def looked_at(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of one window that shows each scene in turn, with the first panels beside it: what it has written."""
    folder = tmp_path_factory.mktemp("looked_at")
    opens, size = ball(folder, 32), (240, 180)
    steps: list[dict[str, Any]] = [
        REST,
        {"t": 0.1, "do": "mark", "name": "start"},
        *turned(0.1),
        {"t": 1.0, "do": "mark", "name": "end"},
    ]
    with contextlib.chdir(folder):
        for t, (name, options) in zip((0.6, 1.4, 2.3), SCENES.items(), strict=True):
            if name != "annotated":
                document = opened_file(opens, size, contents.of_opened(shlex.join(options)))
                saving.save_scene(f"given {name}.toml", document, size)
                steps += [{"t": t, "kind": "drop", "names": [f"given {name}.toml"]}, {"t": t + 0.05, **REST}]
                steps += dragged(t + 0.1, (120, 90), (180, 110))
            steps += [{"t": t + 0.6, "kind": "scroll", "y": 1.0}, *kept(t + 0.65, name)]
    steps += [{"t": 3.25, "do": "screenshot", "file": "later.png"}]
    steps += [*tapped(3.3, "tab"), *kept(3.5, "beside")]
    words = ["--size", "240x180", "--no-panels", "--script", script(folder, steps), "--timings", "t.csv"]
    done = viewed(display_of_all(), folder, opens, *SCENES["annotated"], *words)
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def turned(t: float) -> list[dict[str, Any]]:
    """A drag to and fro, of 0.9 seconds."""
    turn = [
        {"t": t + 0.01 * n, "kind": "move", "x": 120 + 80 * math.sin(n / 20), "y": 90 + 24 * math.cos(n / 13)}
        for n in range(90)
    ]
    button = {"kind": "button", "name": "left"}
    return [turn[0], {"t": t, **button, "down": True}, *turn[1:], {"t": t + 0.95, **button, "down": False}]


def kept(t: float, name: str) -> list[dict[str, Any]]:
    """At rest, what is seen and its scene."""
    return [
        {"t": t, **REST},
        {"t": t, "do": "screenshot", "file": f"{name}.png"},
        {"t": t, "do": "save", "file": f"{name}.toml"},
    ]


def drawn_of(folder: Path, name: str) -> np.ndarray:
    """What `texvol render` draws of a scene that was kept."""
    texvol(folder, "render", "--scene", f"{name}.toml", "--max-error", str(ERROR), "-o", f"{name} drawn.png")
    return eight_bits(folder / f"{name} drawn.png")


@pytest.mark.parametrize("name", SCENES)
def test_at_rest_one_sees_what_render_writes(looked_at: Path, name: str) -> None:
    seen, drawn = eight_bits(looked_at / f"{name}.png"), drawn_of(looked_at, name)
    assert seen.shape == drawn.shape == (180, 240, 3)
    assert (seen == drawn).all()
    assert drawn.std() > 5, "there is something to be seen"


def test_the_picture_beside_the_panels_is_that_of_its_scene(looked_at: Path) -> None:
    seen, drawn = eight_bits(looked_at / "beside.png"), drawn_of(looked_at, "beside")
    assert seen.shape == (180, 240, 3) and drawn.shape == (180, 96, 3)
    assert (seen[:, :96] == drawn).all()
    # The panels begin where the picture ends.
    assert seen[110, 97:].std() > 0


def test_what_a_script_saves_is_not_said_over_the_picture(looked_at: Path) -> None:
    assert (looked_at / "surface.toml").exists()
    assert (eight_bits(looked_at / "surface.png") == eight_bits(looked_at / "later.png")).all()


def test_a_turn_keeps_up_and_is_written_down(looked_at: Path) -> None:
    frames = timings(looked_at / "t.csv")
    marks = {frame["mark"]: number for number, frame in enumerate(frames) if frame["mark"]}
    turning = frames[marks["start"] + 1 : marks["end"]]
    pictures = [float(frame["picture_seconds"]) for frame in turning if float(frame["picture_seconds"]) > 0]
    assert {frame["state"] for frame in turning[5:]} <= {"moving", "refining"}
    # 30 a second are wanted; how many there is time for beside other things is not for a test to say.
    assert len(pictures) >= 5
    assert frames[-1]["state"] == "rest"


def test_without_a_display_the_error_points_to_render(tmp_path: Path) -> None:
    done = viewed(None, tmp_path, ball(tmp_path))
    assert done.returncode == 2
    assert done.stderr.startswith("texvol: error: cannot open a window: no display") and "texvol render" in done.stderr
    assert done.stderr.count("\n") == 1
    done = viewed(":4321", tmp_path, ball(tmp_path))
    assert done.returncode == 2 and "DISPLAY=:4321" in done.stderr


def test_what_can_not_be_opened_is_said_on_one_line(
    display: str,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def check(status: int, said: str) -> None:
        assert status == 2
        assert said.startswith("texvol: error: ") and said.count("\n") == 1 and "none" in said

    for words in (["none.nrrd"], [ball(tmp_path, 24), "--tf", "none.json"]):
        done = viewed(display, tmp_path, *words, "--size", "120x100")
        check(done.returncode, done.stderr)
    # These never come to a window.
    monkeypatch.chdir(tmp_path)
    for words in (["ball.npy", "--script", "none"], ["--frames", "none"]):
        with pytest.raises(SystemExit) as ended:
            sys.exit(main(["view", *words]))
        check(int(str(ended.value.code)), capsys.readouterr().err)


def test_a_file_that_fails_to_load_leaves_the_old_one(display: str, tmp_path: Path) -> None:  # noqa: F811
    (tmp_path / "broken.nrrd").write_text("NRRD0004\nnonsense\n")
    np.save(tmp_path / "other.npy", np.eye(8)[:, :, None] * np.ones(8))
    steps = [
        REST,
        {"do": "screenshot", "file": "before.png"},
        {"t": 0.1, "kind": "drop", "names": ["broken.nrrd"]},
        *tapped(0.25, "enter"),
        {"t": 0.5, **REST},
        {"t": 0.5, "do": "screenshot", "file": "message.png"},
        {"t": 0.5, "do": "save", "file": "kept.toml"},
        {"t": 0.6, "kind": "drop", "names": ["other.npy"]},
        *tapped(0.75, "enter"),
        {"t": 1.0, **REST},
        {"t": 1.0, "do": "save", "file": "other.toml"},
    ]
    words = ["--size", "300x240", "--no-panels", "--max-error", "0.1", "--light", "none"]
    words += ["--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, ball(tmp_path, 24), *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert 'volume = "ball.npy"' in (tmp_path / "kept.toml").read_text()
    assert 'volume = "other.npy"' in (tmp_path / "other.toml").read_text()
    before, message = (eight_bits(tmp_path / f"{name}.png")[:240, :300] for name in ("before", "message"))
    changed = (before != message).any(axis=2)
    assert changed[:100].any(), "the message is in the window"
    assert not changed[140:200].any(), "and the old picture beneath it"
    recent = json.loads((tmp_path / "state/texvol/recent.json").read_text())
    # Values that look like labels were opened as labels, which the list remembers.
    paths = [each if isinstance(each, str) else each["path"] for each in recent]
    assert [Path(each).name for each in paths] == ["other.npy", "ball.npy"]


def test_sizes_and_minimising_do_no_harm(display: str, tmp_path: Path) -> None:  # noqa: F811
    sizes = [(540, 200), (120, 90), (1, 1), (600, 60), (300, 160)]
    steps: list[dict[str, Any]] = [REST]
    steps += [{"t": 0.1 + 0.15 * n, "kind": "resize", "x": w, "y": h} for n, (w, h) in enumerate(sizes)]
    steps += [{"t": 0.9, "kind": "iconify", "down": True}, {"t": 1.2, "kind": "iconify", "down": False}]
    steps += [*tapped(1.4, "tab"), {"t": 1.6, **REST}, {"t": 1.6, "do": "screenshot", "file": "seen.png"}]
    (tmp_path / "scene.toml").write_text(f'volume = "{ball(tmp_path, 24)}"\n')
    words = ["--size", "120x100", "--max-error", "0.1", "--light", "none", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, "--scene", "scene.toml", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert eight_bits(tmp_path / "seen.png").shape == (160, 300, 3)


def test_an_empty_window_ends_as_well(display: str, tmp_path: Path) -> None:  # noqa: F811
    done = viewed(display, tmp_path, "--frames", "3", "--screenshot", "empty.png", "--size", "120x100")
    assert (done.returncode, done.stderr) == (0, "") and (tmp_path / "empty.png").exists()
    done = viewed(display, tmp_path, "--script", script(tmp_path, [{"t": 0.1, **REST}]), "--size", "120x100")
    assert (done.returncode, done.stderr) == (0, "")


# While Python itself begins there is nobody to say so; numpy is the first library that texvol loads.
@pytest.mark.parametrize(("library", "later"), [("_multiarray_umath", 0.0), ("libglfw", 0.0), ("libglfw", 1.0)])
def test_ctrl_c_at_any_moment_leaves_nothing_behind(
    display: str,  # noqa: F811
    tmp_path: Path,
    library: str,
    later: float,
) -> None:
    process = started(display, tmp_path, ball(tmp_path, 96), "--size", "300x240")
    until(lambda: library in Path(f"/proc/{process.pid}/maps").read_text())
    time.sleep(later)
    painters = children_of(process.pid)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode in (130, -signal.SIGINT)
    assert not out
    assert err.strip().endswith("texvol: interrupted")
    _gone(painters)


def test_a_window_that_is_killed_takes_its_painters_along(display: str, tmp_path: Path) -> None:  # noqa: F811
    process = started(display, tmp_path, ball(tmp_path), "--size", "300x240")
    until(lambda: len(children_of(process.pid)) >= 2)
    time.sleep(1.5)
    painters = children_of(process.pid)
    assert len(painters) == 2
    process.kill()
    process.communicate(timeout=PATIENCE)
    _gone(painters)


def _gone(processes: list[int]) -> None:
    """Whether they end soon."""
    until(lambda: not any(map(_lives, processes)))


def _lives(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def camera_of(scene: Path) -> tuple[list[float], list[float]]:
    """Eye and target of a scene file."""
    lines = scene.read_text().splitlines()
    eye, target = (json.loads(line.split("=")[1]) for line in lines if line.startswith(("eye", "target")))
    return eye, target


def test_a_real_mouse_and_keyboard_are_heard_and_recorded(display: str, tmp_path: Path) -> None:  # noqa: F811
    if not shutil.which("xdotool"):
        pytest.skip("xdotool is not installed")
    how = "--size", "200x160", "--max-error", "0.1", "--light", "none"
    process = started(display, tmp_path, ball(tmp_path, 24), *how, "--record", "heard.jsonl")

    def does(*words: str) -> None:
        subprocess.run(["xdotool", *words], env=environment(display, tmp_path), check=True, timeout=PATIENCE)

    does("search", "--sync", "--onlyvisible", "--name", "texvol")
    until((tmp_path / "state/texvol/recent.json").exists)  # the volume is open
    time.sleep(1.0)
    does("mousemove", "80", "60", "mousedown", "1", "mousemove", "--sync", "140", "80")
    time.sleep(0.3)
    does("mouseup", "1", "click", "4", "keydown", "ctrl", "click", "5", "keyup", "ctrl", "key", "x", "key", "ctrl+s")
    until((tmp_path / "ball-1.toml").exists)
    does("key", "ctrl+q")
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, err) == (0, "", "")
    heard = [json.loads(line) for line in (tmp_path / "heard.jsonl").read_text().splitlines()]
    kinds = {each["kind"] for each in heard}
    assert {"move", "button", "scroll", "key"} <= kinds
    assert [each.get("modifiers", []) for each in heard if each["kind"] == "scroll"] == [[], ["ctrl"]]
    # From +x, as x has it.
    eye, target = saved = camera_of(tmp_path / "ball-1.toml")
    assert eye[0] > target[0] and eye[1:] == pytest.approx(target[1:], abs=1e-6)
    # And the same again, played back.
    for name in ("ball-1.toml", "ball-1.tf.json"):
        (tmp_path / name).unlink()
    done = viewed(display, tmp_path, "ball.npy", *how, "--script", "heard.jsonl")
    assert (done.returncode, done.stderr) == (0, "")
    assert camera_of(tmp_path / "ball-1.toml") == saved


def test_frames_are_counted_from_the_first_picture_and_the_last_one_is_at_rest(display: str, tmp_path: Path) -> None:  # noqa: F811
    ball(tmp_path, 32)
    texvol(tmp_path, "render", "ball.npy", "--size", "80x60", "--max-error", str(ERROR), "-o", "rest.png")
    # Fewer than it takes to open and refine the volume; and more than are remembered without a table.
    for frames in ("3", "105"):
        words = ["--size", "80x60", "--no-panels", "--frames", frames, "--screenshot", f"{frames}.png"]
        done = viewed(display, tmp_path, "ball.npy", *words, "--timings", f"{frames}.csv")
        assert (done.returncode, done.stderr) == (0, "")
        assert len(timings(tmp_path / f"{frames}.csv")) == int(frames)
        assert (eight_bits(tmp_path / f"{frames}.png") == eight_bits(tmp_path / "rest.png")).all()


def test_a_scene_is_saved_where_it_came_from_and_remembered_as_it_was_read(display: str, tmp_path: Path) -> None:  # noqa: F811
    np.arange(8**3, dtype=">i2").tofile(tmp_path / "v.raw")
    steps = [
        REST,
        {"t": 0.1, "do": "command", "name": "axis +x"},
        *tapped(0.15, "s", "ctrl"),
        {"t": 0.3, "do": "command", "name": "axis +y"},
        *tapped(0.35, "s", "ctrl"),
        {"t": 0.5, **REST},
        {"t": 0.5, "kind": "drop", "names": ["v-1.toml"]},
        {"t": 0.6, **REST},
        {"t": 0.6, "do": "command", "name": "axis +z"},
        *tapped(0.65, "s", "ctrl"),
        {"t": 0.8, **REST},
    ]
    words = ["--size", "120x100", "--no-panels", "--max-error", "0.1", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, "v.raw", "--shape", "8,8,8", "--dtype", ">i2", *words)
    assert (done.returncode, done.stderr) == (0, "")
    # Saved once without a name, it has one from then on; and so has a scene that was opened.
    assert [path.name for path in tmp_path.glob("*.toml")] == ["v-1.toml"]
    eye, target = camera_of(tmp_path / "v-1.toml")
    assert eye[2] > target[2] and eye[:2] == pytest.approx(target[:2], abs=1e-6)
    recent = json.loads((tmp_path / "state/texvol/recent.json").read_text())
    assert recent[0] == str(tmp_path / "v-1.toml")
    assert recent[1] == {"path": str(tmp_path / "v.raw"), "shape": [8, 8, 8], "dtype": ">i2"}
