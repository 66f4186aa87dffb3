"""Random actions of mouse, keyboard and window that a window is played, and the memory that its processes hold.

`python scripts/window_actions.py` plays longer series than the tests.
"""

from __future__ import annotations

import random
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from support.windows import PATIENCE, children_of, memory_of_each, script, started
from texvol.window.commands import TABS
from texvol.window.layout import MODES
from texvol.window.navigation import AXES
from texvol.window.steering import BINDINGS

Steps = list[dict[str, Any]]

_APART = 0.015  # seconds between two of them
# Bytes that all processes together may grow by in an action; up to 2.5 MB come and go.
_MOST_GROWTH = (6 << 20) / 300
# glibc keeps what was freed between what is still used, and keeps more the larger it was: 14 MB come and go. With fixed
# limits, arrays go back to the system as soon as they are freed, and what a process holds is what it needs.
FREED_AT_ONCE = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536", "MALLOC_ARENA_MAX": "1"}
# What would end the window, or leave it for another.
_NOT_PLAYED = {"close", "fullscreen"}
_OF_TIME_AND_LIST = [
    *("play", "step +1", "step last", "eye 1", "eye 2", "eye 1", "remove 1", "undo", "undo", "as-labels 1"),
    *("opacity 2 0.5", "color 1 #ff8000", "spacing 1 1,2,1", "transform 2 none"),
]
KINDS: Mapping[str, int] = {"move": 50, "button": 18, "scroll": 8, "key": 14, "command": 6, "resize": 1, "text": 3}


def random_steps(seed: int, count: int) -> Steps:
    """So many actions, a few of them each frame."""
    chance = random.Random(seed)
    keys = ["escape", "escape"]  # so that dialogs do not stay
    keys += [chord for each in BINDINGS if each.command not in _NOT_PLAYED for chord in each.chords]
    steps: Steps = []
    held: str | None = None
    for number in range(count):
        step: dict[str, Any] = {"t": round(_APART * number, 3)}
        kind = chance.choices(tuple(KINDS), tuple(KINDS.values()))[0]
        if kind == "move":
            step |= {"kind": kind, "x": chance.randrange(-20, 600), "y": chance.randrange(-20, 420)}
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
            step |= {"kind": kind, "x": chance.randrange(200, 640), "y": chance.randrange(150, 450)}
        else:
            step |= {"kind": kind, "name": chance.choice("0123456789.-abc")}
        steps.append(step)
    return steps


def with_repeats(steps: Steps, count: int, repeats: int = 2) -> Steps:
    """The steps, and the first `count` of all actions again and again; files 1.png … say when that begins or ends."""
    start = steps[-1]["t"] + _APART
    found: Steps = [{"t": 0, "do": "rest"}, *steps]
    for number in range(1, repeats + 1):
        found.append({"t": start, "do": "screenshot", "file": f"{number}.png"})
        again = [step for step in steps if step["t"] < _APART * (count - 0.5)]
        found += [step | {"t": round(start + step["t"], 3)} for step in again]
        start += _APART * count
    return [*found, {"t": start, "do": "screenshot", "file": f"{repeats + 1}.png"}]


def channels_over_time(folder: Path) -> str:
    """Name of a file of two channels and five time steps."""
    import tifffile

    values = np.random.default_rng(4).integers(0, 200, (5, 16, 2, 18, 20)).astype(np.uint8)
    tifffile.imwrite(folder / "live.tif", values, imagej=True, metadata={"axes": "TZCYX"})
    return "live.tif"


def check_window(display: str, folder: Path, name: str, seed: int, count: int, repeated: int) -> None:
    """Play a window of a file random actions, the first of them again and again, and look at its processes.

    Libraries, programs of new kinds of scenes and caches fill at first. A repeat of the same actions finds them there:
    what it adds to what is held stays for every action, and is a leak. On a busy machine most final pictures are left
    off for newer ones, and a repeat may come to the first of a kind: then what is a leak grows in later ones as well.
    """
    most = _MOST_GROWTH * repeated
    growth = _growth(display, folder, name, random_steps(seed, count), repeated, 4)
    if sum(growth.values()) >= most:
        growth = _growth(display, folder, name, random_steps(seed, count), repeated, 8)
    assert sum(growth.values()) < most, growth


def _growth(display: str, folder: Path, name: str, steps: Steps, repeated: int, repeats: int) -> dict[int, int]:
    """Return by how many bytes each process of a window that is played steps grows in one of the last two repeats.

    What one repeat switches on the next one switches off, so that they hold alternately more and less, by 4 MB.
    """
    marks = [folder / f"{number}.png" for number in range(1, repeats + 2)]
    for each in marks:
        each.unlink(missing_ok=True)
    steps = with_repeats(steps, repeated, repeats)
    words = ["--size", "200x300", "--script", script(folder, steps), "--timings", "t.csv"]
    process = started(display, folder, name, *words)
    held: dict[int, list[list[int]]] = {}  # bytes of each process, at first and in each repeat
    painters: list[int] = []
    end = time.monotonic() + PATIENCE + 2 * _APART * len(steps)
    while process.poll() is None and time.monotonic() < end:
        time.sleep(0.1)
        repeat = sum(mark.exists() for mark in marks)
        for each, bytes_held in memory_of_each(process.pid).items() if repeat <= repeats else ():  # else it ends
            held.setdefault(each, [[] for _ in range(repeats + 1)])[repeat].append(bytes_held)
        painters.append(len(children_of(process.pid)))
    if process.poll() is None:
        process.kill()
    _, err = process.communicate()
    assert process.returncode == 0, err
    assert err == ""
    painters = painters[next(at for at, number in enumerate(painters) if number) :]  # a busy machine begins late
    quarter = len(painters) // 4
    # Mover and refiner; only the clerk, who writes pictures, comes later.
    assert max(painters[quarter:]) <= 3 and min(painters[quarter : 3 * quarter]) >= 2
    return {each: grown(sizes[0], sizes[-3], sizes[-1]) // 2 for each, sizes in held.items()}


def grown(first: list[int], before: list[int], after: list[int]) -> int:
    """By how much the least that a process holds grows from one repeat to another; 0 of one that begins in a repeat.

    What leaks stays, and raises the least as much as the most; what comes and goes is no growth. The first half of each
    repeat does not count, since a process may still load its libraries in it.
    """
    if not first or not before or not after:
        return 0
    return max(min(after[len(after) // 2 :]) - min(before[len(before) // 2 :]), 0)
