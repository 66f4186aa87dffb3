"""Hundreds of random actions of mouse, keyboard and window: nothing breaks, and memory does not grow."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.windows import PATIENCE, ball, children_of, display, memory_of_each, script, started  # noqa: F401 (a fixture)

from texvol.window.commands import TABS
from texvol.window.layout import MODES
from texvol.window.navigation import AXES
from texvol.window.steering import BINDINGS

ACTIONS = 600
_BEGINNING = 16  # samples, of 0.25 s: in its first seconds a process loads its libraries
# What would end the window, or leave it for another.
_NOT_PLAYED = {"close", "fullscreen"}
_OF_TIME_AND_LIST = [
    *("play", "step +1", "step last", "eye 1", "eye 2", "eye 1", "remove 1", "undo", "undo", "as-labels 1"),
    *("opacity 2 0.5", "color 1 #ff8000", "spacing 1 1,2,1", "transform 2 none"),
]


def random_steps(seed: int) -> list[dict[str, Any]]:
    """So many actions, a few of them each frame."""
    chance = random.Random(seed)
    keys = ["escape", "escape"]  # so that dialogs do not stay
    keys += [chord for each in BINDINGS if each.command not in _NOT_PLAYED for chord in each.chords]
    steps: list[dict[str, Any]] = []
    held: str | None = None
    for number in range(ACTIONS):
        step: dict[str, Any] = {"t": round(0.015 * number, 3)}
        kind = chance.choices(
            ("move", "button", "scroll", "key", "command", "resize", "text"), (50, 18, 8, 14, 6, 1, 3)
        )[0]
        if kind == "move":
            step |= {"kind": kind, "x": chance.randrange(-20, 740), "y": chance.randrange(-20, 520)}
        elif kind == "button":
            down = held is None
            held = chance.choice(("left", "left", "right", "middle")) if held is None else held
            step |= {
                "kind": kind,
                "name": held,
                "down": down,
                "modifiers": chance.choice(([], [], ["shift"], ["ctrl"])),
            }
            held = held if down else None
        elif kind == "scroll":
            modifiers = chance.choice(([], [], ["shift"], ["ctrl"]))
            step |= {"kind": kind, "y": chance.uniform(-3, 3), "modifiers": modifiers}
        elif kind == "key":
            *modifiers, name = chance.choice(keys).split("+")
            steps.append(step | {"kind": kind, "name": name, "down": True, "modifiers": modifiers})
            step |= {"kind": kind, "name": name, "down": False, "modifiers": modifiers}
        elif kind == "command":
            names = [f"tab {tab}" for tab in TABS] + [f"axis {axis}" for axis in AXES] + _OF_TIME_AND_LIST
            names += [f"layout {mode}" for mode in MODES]
            step |= {"do": "command", "name": chance.choice(names)}
        elif kind == "resize":
            step |= {"kind": kind, "x": chance.randrange(200, 800), "y": chance.randrange(150, 560)}
        else:
            step |= {"kind": kind, "name": chance.choice("0123456789.-abc")}
        steps.append(step)
    return steps


def channels_over_time(folder: Path) -> str:
    """Name of a file of two channels and five time steps."""
    import tifffile

    values = np.random.default_rng(4).integers(0, 200, (5, 16, 2, 18, 20)).astype(np.uint8)
    tifffile.imwrite(folder / "live.tif", values, imagej=True, metadata={"axes": "TZCYX"})
    return "live.tif"


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "opens"), [(1, ball), (2, channels_over_time)])
def test_random_actions_leave_the_window_whole(
    display: str,  # noqa: F811
    tmp_path: Path,
    seed: int,
    opens: Callable[[Path], str],
) -> None:
    steps = [{"t": 0, "do": "rest"}, *random_steps(seed)]
    process = started(
        display,
        tmp_path,
        opens(tmp_path),
        "--size",
        "320x400",
        "--script",
        script(tmp_path, steps),
        "--timings",
        "t.csv",
    )
    held: dict[int, list[int]] = {}  # bytes, of each process
    painters: list[int] = []
    end = time.monotonic() + PATIENCE
    while process.poll() is None and time.monotonic() < end:
        time.sleep(0.25)
        for each, count in memory_of_each(process.pid).items():
            held.setdefault(each, []).append(count)
        painters.append(len(children_of(process.pid)))
    if process.poll() is None:
        process.kill()
    _, err = process.communicate()
    assert process.returncode == 0, err
    assert err == ""
    painters = painters[next(at for at, count in enumerate(painters) if count) :]  # a busy machine begins late
    quarter = len(painters) // 4
    # Mover and refiner; only the clerk, who writes pictures, comes later.
    assert max(painters[quarter:]) <= 3 and min(painters[quarter : 3 * quarter]) >= 2
    # Programs of new kinds of scenes are compiled all along; what leaks with each frame or action would be more. Each
    # process is held against its own third quarter: the clerk may come at any time.
    assert sum(map(grown, held.values())) < 64 << 20


def grown(held: list[int]) -> int:
    """Twice what the least in the last quarter is above that in the third; 0 of a process that only begins.

    In the first half a busy machine may still load the libraries of a process. What leaks stays, and raises the least
    as much as the most. What comes and goes is no growth: over 4,000 actions the most varies by 44 MB, the least of any
    process by 4 MB.
    """
    if len(held) < _BEGINNING:
        return 0
    quarter = len(held) // 4
    return 2 * (min(held[3 * quarter :]) - min(held[2 * quarter : 3 * quarter]))


def test_what_stays_is_growth_and_what_comes_and_goes_is_not() -> None:
    steady = [100 + 2 * number for number in range(40)]
    assert grown(steady) == 2 * 20
    assert grown([each + 44 * (number % 7 == 5) for number, each in enumerate(steady)]) == 2 * 20
    assert grown([100 + 44 * (number > 30 and number % 5 > 0) for number in range(40)]) == 0
    assert grown([1, 2, 3]) == 0
