"""How things are timed on a machine that others use too: in turns, and the median of each."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from texvol import Renderer, Scene
from texvol.report.measuring import fingerprint

Key = TypeVar("Key", bound=Hashable)
_MILLISECONDS = 1e3
# Linux counts what the parent takes as the child's, until the child's program has begun: so the parent is a small one.
_WITNESS = """
import os, sys, time
silent = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
start = time.perf_counter()
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=silent)
_, status, usage = os.wait4(child, 0)
seconds = time.perf_counter() - start
print(seconds, usage.ru_maxrss, usage.ru_utime + usage.ru_stime, os.waitstatus_to_exitcode(status))
"""


@dataclass(frozen=True)
class Run:
    """What the whole run was asked for."""

    data: Path
    quick: bool
    rounds: int  # turns that everything gets
    folder: Path  # for files that are wanted for the run only
    scenes: tuple[str, ...] = ()  # parts of the names of those that `errors` and `others` are to measure; none: all
    page: bool = False  # put what `others` measures into the documentation


def in_turns(actions: Mapping[Key, Callable[[], float]], rounds: int, *, warm_up: bool = True) -> dict[Key, float]:
    """The median of what each action returns, seconds say; all have one turn before any has its next."""
    results: dict[Key, list[float]] = {key: [] for key in actions}
    for turn in range(rounds + warm_up):
        for key, action in actions.items():
            result = action()
            if turn >= warm_up:
                results[key].append(result)
    return {key: statistics.median(each) for key, each in results.items()}


def seconds_of(action: Callable[[], object]) -> float:
    """Wall seconds of one call."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def frame_seconds(renderer: Renderer, scene: Scene, size: tuple[int, int], **accuracy: object) -> float:
    """Draw and read-back of one frame; warm if it is not the first of its kind."""
    renderer.render(scene, size, **accuracy)  # type: ignore[arg-type]
    return renderer.seconds["draw"] + renderer.seconds["read"]


def process(line: Iterable[str], **environment: str) -> tuple[float, float]:
    """Wall seconds and peak megabytes (10⁶ bytes) of a process from start to end; raises as `usage`."""
    found = usage(line, **environment)
    return found.seconds, found.megabytes


@dataclass(frozen=True)
class Usage:
    """What a process took from start to end."""

    seconds: float
    megabytes: float  # of 10⁶ bytes, at the peak
    processor_seconds: float  # of all its threads


def usage(line: Iterable[str], **environment: str) -> Usage:
    """Return what a process takes.

    Raises
    ------
    RuntimeError
        If its status is not 0; with the last line that it wrote to stderr.
    """
    witness = subprocess.run(
        [sys.executable, "-I", "-S", "-c", _WITNESS, *line],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=True,
    )
    seconds, kibibytes, of_processor, status = witness.stdout.split()
    if status != "0":
        raise RuntimeError((witness.stderr.strip().splitlines() or [f"status {status}"])[-1])
    return Usage(float(seconds), float(kibibytes) * 1024 / 1e6, float(of_processor))


def texvol_line(*words: object) -> list[str]:
    """The command line of `texvol` with these words."""
    return [sys.executable, "-m", "texvol", *map(str, words)]


def milliseconds(seconds: float) -> str:
    """Seconds as milliseconds in three digits."""
    return f"{_MILLISECONDS * seconds:.3g}" if seconds < 1 else f"{_MILLISECONDS * seconds:.0f}"


def heading(title: str, explanation: str) -> None:
    """Begin a section."""
    print(f"\n## {title}\n\n{explanation}\n", flush=True)


def columns(*names: str) -> None:
    """Begin a table."""
    print(f"| {' | '.join(names)} |\n|{'---|' * len(names)}", flush=True)


def row(*cells: object) -> None:
    """A line of a table, as soon as it is known."""
    print(f"| {' | '.join(map(str, cells))} |", flush=True)


def machine() -> str:
    """What it was measured on, in one sentence; no date."""
    with Renderer() as renderer:
        metadata = fingerprint(renderer)
    return f"{metadata['GL_RENDERER']}; {metadata['processor']}; {metadata['Python']}; {metadata['libraries']}."
