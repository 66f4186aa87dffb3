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
_APART = 0.015  # seconds between two of them
_MOST_GROWTH = 6 << 20  # bytes of all processes, by half of the actions: up to 2.5 MB of it come and go
# glibc keeps what was freed between what is still used, and keeps more the larger it was: 14 MB come and go. With fixed
# limits, arrays go back to the system as soon as they are freed, and what a process holds is what it needs.
_FREED_AT_ONCE = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536", "MALLOC_ARENA_MAX": "1"}
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
        step: dict[str, Any] = {"t": round(_APART * number, 3)}
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


def with_repeats(steps: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The steps, and their first half twice more; a file 1.png and a file 2.png say that a repeat begins."""
    half = _APART * ACTIONS / 2
    found = [{"t": 0, "do": "rest"}, *steps]
    for number in (1, 2):
        start = (number + 1) * half
        found.append({"t": start, "do": "screenshot", "file": f"{number}.png"})
        found += [step | {"t": round(start + step["t"], 3)} for step in steps if step["t"] < half]
    return found


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
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
    opens: Callable[[Path], str],
) -> None:
    for name, value in _FREED_AT_ONCE.items():
        monkeypatch.setenv(name, value)
    process = started(
        display,
        tmp_path,
        opens(tmp_path),
        "--size",
        "320x400",
        "--script",
        script(tmp_path, with_repeats(random_steps(seed))),
        "--timings",
        "t.csv",
    )
    held: dict[int, tuple[list[int], ...]] = {}  # bytes of each process, at first and in each repeat
    painters: list[int] = []
    end = time.monotonic() + PATIENCE
    while process.poll() is None and time.monotonic() < end:
        time.sleep(0.25)
        repeat = sum((tmp_path / f"{number}.png").exists() for number in (1, 2))
        for each, count in memory_of_each(process.pid).items():
            held.setdefault(each, ([], [], []))[repeat].append(count)
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
    # Libraries, programs of new kinds of scenes and caches fill at first, on a busy machine for a minute. A repeat of
    # the same actions finds them there: what it adds to what is held stays for every action, and is a leak.
    assert sum(grown(*each) for each in held.values()) < _MOST_GROWTH


def grown(first: list[int], before: list[int], after: list[int]) -> int:
    """By how much the least that a process holds grows from a repeat to the next; 0 of one that begins in a repeat.

    What leaks stays, and raises the least as much as the most; what comes and goes is no growth. The first half of each
    repeat does not count, since a process may still load its libraries in it.
    """
    if not first or not before or not after:
        return 0
    return max(min(after[len(after) // 2 :]) - min(before[len(before) // 2 :]), 0)


def test_what_stays_is_growth_and_what_comes_and_goes_is_not() -> None:
    steady = [100 + 2 * number for number in range(60)]
    assert grown(steady[:20], steady[20:40], steady[40:]) == 2 * 20
    rough = [each + 44 * (number % 7 == 5) for number, each in enumerate(steady)]
    assert grown(rough[:20], rough[20:40], rough[40:]) == 2 * 20
    assert grown([100], [100] * 20, [100, 144, 144, 100] * 5) == 0
    assert grown([7], [7, 20, 60, 98, 98, 98], [98] * 6) == 0, "a process that begins late"
    assert grown([], [7, 8, 9], [50, 60, 70]) == 0


def test_the_repeats_are_the_first_actions_again() -> None:
    steps = with_repeats(random_steps(1))
    begins = [number for number, step in enumerate(steps) if step.get("do") == "screenshot"]
    one, other = steps[begins[0] + 1 : begins[1]], steps[begins[1] + 1 :]
    assert [step | {"t": 0} for step in one] == [step | {"t": 0} for step in other]
    assert len(one) > ACTIONS / 2 and [step["t"] for step in steps] == sorted(step["t"] for step in steps)
