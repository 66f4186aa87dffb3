"""The benchmark of turning a window: it opens one, turns it by a real mouse, and closes it."""

from __future__ import annotations

import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.windows import ball

SCRIPT = Path(__file__).parents[2] / "scripts/benchmark_window.py"


@pytest.mark.skipif(not (shutil.which("Xvfb") and shutil.which("xdotool")), reason="needs Xvfb and xdotool")
def test_a_window_is_turned_and_timed(tmp_path: Path) -> None:
    volume = str(tmp_path / ball(tmp_path, 16))
    line = [sys.executable, str(SCRIPT), volume, "--sizes=300x200", "--seconds=0.5", "--manager="]
    done = subprocess.run(line, capture_output=True, text=True, timeout=500, check=False)
    assert done.returncode == 0, done.stderr
    cells = r" \| (\d+) \| (\d+) \| (\d+) \| (\d+) \| ([\d.]+) \|$"
    rows = re.findall(r"^\| ball\.npy \| 300x200 \| 96 \| (none|all)" + cells, done.stdout, re.M)
    assert [row[0] for row in rows] == ["none", "all"], done.stdout
    for _, pictures, median, largest, processor, final in rows:
        assert int(processor) > 0
        assert int(pictures) >= 2 and 0 < int(median) <= int(largest) and float(final) >= 0


def test_pictures_of_the_opening_are_not_of_the_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SCRIPT.parent))  # it imports its neighbours
    judged = runpy.run_path(str(SCRIPT), run_name="benchmark_window")["_judged"]
    pictures = [(1.0, 900), (1.4, 400), (9.0, 80), (9.2, 40), (9.24, 40)]
    frames = [{"time": str(at), "picture_seconds": str(1e-3 * ms), "state": "moving"} for at, ms in pictures]
    found = judged(frames, 0.5, 0.15)
    assert (found.median, found.largest, found.pictures, found.final) == (
        pytest.approx(80),
        pytest.approx(200),
        3,
        None,
    )
    assert found.processor == pytest.approx(50)
    rest = {"time": "12.24", "picture_seconds": "3", "state": "rest"}
    assert judged([*frames, rest], 3.5, 0.15).final == pytest.approx(3.0)


@pytest.mark.skipif(not (shutil.which("Xvfb") and shutil.which("xrdb")), reason="needs Xvfb and xrdb")
def test_a_resolution_stays_when_no_program_is_on_the_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SCRIPT.parent))  # it imports its neighbours
    screen = runpy.run_path(str(SCRIPT), run_name="benchmark_window")["screen"]
    with screen(300, 200, 192, "") as environment:
        found = subprocess.run(["xrdb", "-query"], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["Xft.dpi:", "192"]
