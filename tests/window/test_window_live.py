"""The window itself, on a display without a screen: what it shows, what it takes, and how it ends."""

from __future__ import annotations

import json
import math
import shutil
import signal
import subprocess
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
    eight_bits,
    environment,
    script,
    started,
    texvol,
    timings,
    until,
    viewed,
)

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


SCENES = {
    "post, perspective, annotated": [
        *("--classification", "post", "--projection", "perspective"),
        *("--annotate", "box,scale-bar,legend", "--background", "0.2,0.2,0.2"),
    ],
    "lit, cut": ["--light", "head", "--clip", "1,0.3,0,25", "--caps", "--classification", "extinction"],
    "isosurface": ["--mode", "isosurface", "--isovalue", "120", "--background", "0.1,0.2,0.3"],
}


@pytest.mark.parametrize("name", SCENES)
def test_at_rest_one_sees_what_render_writes(display: str, tmp_path: Path, name: str) -> None:  # noqa: F811
    steps = [
        REST,
        *dragged(0.1, (150, 120), (220, 150)),
        {"t": 0.6, "kind": "scroll", "y": 1.0},
        {"t": 0.7, **REST},
        {"t": 0.7, "do": "screenshot", "file": "seen.png"},
        {"t": 0.7, "do": "save", "file": "saved.toml"},
    ]
    # What is said over the picture is gone before the picture is taken.
    words = [ball(tmp_path), *SCENES[name], "--size", "300x240", "--no-panels", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, *words)
    assert (done.returncode, done.stderr) == (0, "")
    texvol(tmp_path, "render", "--scene", "saved.toml", "--max-error", str(ERROR), "-o", "drawn.png")
    seen, drawn = eight_bits(tmp_path / "seen.png"), eight_bits(tmp_path / "drawn.png")
    assert seen.shape == drawn.shape == (240, 300, 3)
    assert (seen == drawn).all()
    assert drawn.std() > 5, "there is something to be seen"


def test_the_picture_beside_the_panels_is_that_of_its_scene(display: str, tmp_path: Path) -> None:  # noqa: F811
    steps = [REST, {"do": "screenshot", "file": "seen.png"}, {"do": "save", "file": "saved.toml"}]
    done = viewed(display, tmp_path, ball(tmp_path), "--size", "400x300", "--script", script(tmp_path, steps))
    assert (done.returncode, done.stderr) == (0, "")
    texvol(tmp_path, "render", "--scene", "saved.toml", "--max-error", str(ERROR), "-o", "drawn.png")
    seen, drawn = eight_bits(tmp_path / "seen.png"), eight_bits(tmp_path / "drawn.png")
    assert drawn.shape == (300, 400, 3) and seen.shape[1] > 700
    # But for what is said in its corners.
    assert (seen[:200, 200:400] == drawn[:200, 200:400]).all()
    # The panels begin where the picture ends.
    assert seen[150, 401:].std() > 0


def test_a_turn_keeps_up_and_is_written_down(display: str, tmp_path: Path) -> None:  # noqa: F811
    turn = [
        {"t": 0.1 + 0.01 * n, "kind": "move", "x": 150 + 100 * math.sin(n / 20), "y": 120 + 30 * math.cos(n / 13)}
        for n in range(200)
    ]
    steps = [
        REST,
        {"t": 0.0, "kind": "move", "x": 150, "y": 150},
        {"t": 0.05, "do": "mark", "name": "start"},
        {"t": 0.06, "kind": "button", "name": "left", "down": True},
        *turn,
        {"t": 2.15, "do": "mark", "name": "end"},
        {"t": 2.16, "kind": "button", "name": "left", "down": False},
        {"t": 2.2, **REST},
    ]
    words = ["--size", "300x240", "--no-panels", "--script", script(tmp_path, steps), "--timings", "t.csv"]
    done = viewed(display, tmp_path, ball(tmp_path), *words)
    assert (done.returncode, done.stderr) == (0, "")
    frames = timings(tmp_path / "t.csv")
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


def test_what_can_not_be_opened_is_said_on_one_line(display: str, tmp_path: Path) -> None:  # noqa: F811
    for words in (
        ["none.nrrd"],
        [ball(tmp_path), "--tf", "none.json"],
        ["ball.npy", "--script", "none"],
        ["--frames", "none"],
    ):
        done = viewed(display, tmp_path, *words)
        assert done.returncode == 2
        assert done.stderr.startswith("texvol: error: ") and done.stderr.count("\n") == 1 and "none" in done.stderr


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
    done = viewed(display, tmp_path, ball(tmp_path), "--size", "300x240", "--script", script(tmp_path, steps))
    assert (done.returncode, done.stderr) == (0, "")
    assert 'volume = "ball.npy"' in (tmp_path / "kept.toml").read_text()
    assert 'volume = "other.npy"' in (tmp_path / "other.toml").read_text()
    before, message = (eight_bits(tmp_path / f"{name}.png")[:240, :300] for name in ("before", "message"))
    changed = (before != message).any(axis=2)
    assert changed[:100].any(), "the message is in the window"
    assert not changed[140:200].any(), "and the old picture beneath it"
    recent = json.loads((tmp_path / "state/texvol/recent.json").read_text())
    assert [Path(each).name for each in recent] == ["other.npy", "ball.npy"]


def test_sizes_and_minimising_do_no_harm(display: str, tmp_path: Path) -> None:  # noqa: F811
    sizes = [(700, 500), (120, 90), (1, 1), (900, 200), (640, 480)]
    steps: list[dict[str, Any]] = [REST]
    steps += [{"t": 0.2 + 0.2 * n, "kind": "resize", "x": w, "y": h} for n, (w, h) in enumerate(sizes)]
    steps += [{"t": 1.5, "kind": "iconify", "down": True}, {"t": 1.8, "kind": "iconify", "down": False}]
    steps += [*tapped(2.0, "tab"), {"t": 2.3, **REST}, {"t": 2.3, "do": "screenshot", "file": "seen.png"}]
    done = viewed(display, tmp_path, ball(tmp_path), "--size", "300x240", "--script", script(tmp_path, steps))
    assert (done.returncode, done.stderr) == (0, "")
    assert eight_bits(tmp_path / "seen.png").shape == (480, 640, 3)


def test_an_empty_window_ends_as_well(display: str, tmp_path: Path) -> None:  # noqa: F811
    done = viewed(display, tmp_path, "--frames", "3", "--screenshot", "empty.png", "--size", "300x240")
    assert (done.returncode, done.stderr) == (0, "") and (tmp_path / "empty.png").exists()
    done = viewed(display, tmp_path, "--script", script(tmp_path, [{"t": 0.1, **REST}]), "--size", "300x240")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("moment", [0.1, 1.0])
def test_ctrl_c_at_any_moment_leaves_nothing_behind(display: str, tmp_path: Path, moment: float) -> None:  # noqa: F811
    process = started(display, tmp_path, ball(tmp_path, 96), "--size", "300x240")
    time.sleep(moment)
    painters = children_of(process.pid)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode in (130, -signal.SIGINT)  # before Python has begun there is nobody to say so
    assert not out
    assert process.returncode < 0 or err.strip().endswith("texvol: interrupted") or moment < 0.5
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


def test_a_real_mouse_and_keyboard_are_heard_and_recorded(display: str, tmp_path: Path) -> None:  # noqa: F811
    if not shutil.which("xdotool"):
        pytest.skip("xdotool is not installed")
    process = started(display, tmp_path, ball(tmp_path), "--size", "300x240", "--record", "heard.jsonl")

    def does(*words: str) -> None:
        subprocess.run(["xdotool", *words], env=environment(display, tmp_path), check=True, timeout=PATIENCE)

    does("search", "--sync", "--onlyvisible", "--name", "texvol")
    until((tmp_path / "state/texvol/recent.json").exists)  # the volume is open
    time.sleep(1.0)
    does("mousemove", "100", "100", "mousedown", "1", "mousemove", "--sync", "160", "120")
    time.sleep(0.3)
    does("mouseup", "1", "click", "4", "key", "x", "key", "ctrl+s")
    until((tmp_path / "ball-1.toml").exists)
    does("key", "ctrl+q")
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, err) == (0, "", "")
    heard = [json.loads(line) for line in (tmp_path / "heard.jsonl").read_text().splitlines()]
    kinds = {each["kind"] for each in heard}
    assert {"move", "button", "scroll", "key"} <= kinds
    # From +x, as x has it.
    saved = (tmp_path / "ball-1.toml").read_text()
    eye, target = (json.loads(line.split("=")[1]) for line in saved.splitlines() if line.startswith(("eye", "target")))
    assert eye[0] > target[0] and eye[1:] == pytest.approx(target[1:], abs=1e-6)
    # And the same again, played back.
    (tmp_path / "ball-1.toml").unlink()
    done = viewed(display, tmp_path, "ball.npy", "--size", "300x240", "--script", "heard.jsonl")
    assert (done.returncode, done.stderr) == (0, "")
    again = (tmp_path / "ball-1.toml").read_text()
    assert [line for line in again.splitlines() if line.startswith(("eye", "target"))] == [
        line for line in saved.splitlines() if line.startswith(("eye", "target"))
    ]


def test_frames_are_counted_from_the_first_picture_and_the_last_one_is_at_rest(display: str, tmp_path: Path) -> None:  # noqa: F811
    # Fewer than it takes to open and refine the volume; and more than are remembered without a table.
    for frames in ("3", "130"):
        words = ["--size", "300x240", "--no-panels", "--frames", frames, "--screenshot", f"{frames}.png"]
        done = viewed(display, tmp_path, ball(tmp_path), *words, "--timings", f"{frames}.csv")
        assert (done.returncode, done.stderr) == (0, "")
        assert len(timings(tmp_path / f"{frames}.csv")) == int(frames)
    steps = [REST, {"do": "screenshot", "file": "rest.png"}]
    viewed(display, tmp_path, "ball.npy", "--size", "300x240", "--no-panels", "--script", script(tmp_path, steps))
    at_rest = eight_bits(tmp_path / "rest.png")
    for frames in ("3", "130"):
        assert (eight_bits(tmp_path / f"{frames}.png") == at_rest).all()


def test_what_a_script_saves_is_not_said_over_the_picture(display: str, tmp_path: Path) -> None:  # noqa: F811
    steps = [
        REST,
        {"do": "screenshot", "file": "before.png"},
        {"t": 0.1, "do": "save", "file": "saved.toml"},
        {"t": 0.4, "do": "screenshot", "file": "after.png"},
    ]
    words = ["--size", "300x240", "--no-panels", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, ball(tmp_path), *words)
    assert (done.returncode, done.stderr) == (0, "") and (tmp_path / "saved.toml").exists()
    assert (eight_bits(tmp_path / "before.png") == eight_bits(tmp_path / "after.png")).all()


def test_a_scene_is_saved_where_it_came_from_and_remembered_as_it_was_read(display: str, tmp_path: Path) -> None:  # noqa: F811
    np.arange(8**3, dtype=">i2").tofile(tmp_path / "v.raw")
    steps = [
        REST,
        {"t": 0.1, "do": "command", "name": "axis +x"},
        *tapped(0.2, "s", "ctrl"),
        {"t": 0.5, "do": "command", "name": "axis +y"},
        *tapped(0.6, "s", "ctrl"),
        {"t": 0.8, **REST},
    ]
    words = ["--size", "300x240", "--no-panels", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, "v.raw", "--shape", "8,8,8", "--dtype", ">i2", *words)
    assert (done.returncode, done.stderr) == (0, "")
    # Saved once without a name, it has one from then on; and so has a scene that was opened.
    assert [path.name for path in tmp_path.glob("*.toml")] == ["v-1.toml"]
    along_y = (tmp_path / "v-1.toml").read_text()
    (tmp_path / "script.jsonl").write_text("".join(json.dumps(each) + "\n" for each in steps[:4] + steps[-1:]))
    done = viewed(display, tmp_path, "--scene", "v-1.toml", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert [path.name for path in tmp_path.glob("*.toml")] == ["v-1.toml"]
    assert (tmp_path / "v-1.toml").read_text() != along_y
    recent = json.loads((tmp_path / "state/texvol/recent.json").read_text())
    assert recent[0] == str(tmp_path / "v-1.toml")
    assert recent[1] == {"path": str(tmp_path / "v.raw"), "shape": [8, 8, 8], "dtype": ">i2"}
