"""Frame times of the window while a volume is turned by a real mouse, on an X server without a screen.

    python scripts/benchmark_window.py DATA [--only NAME,NAME] [--sizes 1280x800,1920x1080] [--dpi 96,192] [--seconds 4]
        [--manager openbox] [--moving]

DATA is the folder of the real volumes (`real_volumes.py` lists them) or a volume. Each window stands under a window
manager on Xvfb, with and without all annotation; when it is at rest, xdotool presses the left button and moves the
mouse 60 times a second. The times are those between two new pictures while the volume turns, the first after the press
included; the seconds to the final picture are those after the button is let go. The processor time, for each picture,
is that of the window and its painting processes. With --moving, no final picture is waited for.
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from real_volumes import VOLUMES, volume_path

_ALL = ["--annotate", "box,scale-bar,legend,axes"]
_USUAL_DPI = 96
_PATIENCE = 600.0  # seconds for a window to come, to rest and to end
_OPENING = 8.0  # seconds in which the first pictures come
_SLACK = 1.0  # seconds before the turn in which no picture comes
_QUIET = 0.08  # processor seconds per second, less than any picture takes


@dataclass(frozen=True)
class Turned:
    """Times of one window, in milliseconds but for `final`, which is in seconds; `processor` is for each picture."""

    median: float
    largest: float
    pictures: int
    processor: float
    final: float | None


@contextmanager
def screen(width: int, height: int, dpi: int, manager: str) -> Iterator[dict[str, str]]:
    """Environment of an X server with a resolution and a window manager, if one is named, while the context lasts."""
    with ExitStack() as stack:
        read, write = os.pipe()
        line = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp"]
        line.append("-noreset")  # else the server forgets the resolution when xrdb, its only client, ends
        _started(stack, line, dict(os.environ), (write,))
        os.close(write)
        with os.fdopen(read) as number:
            found = os.environ | {"DISPLAY": f":{number.readline().strip()}"}
        found.pop("WAYLAND_DISPLAY", None)
        if dpi != _USUAL_DPI:
            subprocess.run(["xrdb", "-merge"], input=f"Xft.dpi: {dpi}\n", text=True, env=found, check=True)
        if manager:
            _started(stack, [manager], found)
        yield found


def _started(stack: ExitStack, line: list[str], environment: dict[str, str], kept: tuple[int, ...] = ()) -> None:
    hidden = subprocess.DEVNULL
    process = subprocess.Popen(line, env=environment, pass_fds=kept, stdout=hidden, stderr=hidden)
    stack.callback(process.wait)
    stack.callback(process.terminate)


def turned(
    words: list[str], size: tuple[int, int], dpi: int, seconds: float, manager: str, *, moving: bool = False
) -> Turned:
    """Open a window of a size in pixels, turn the volume, and close the window."""
    with tempfile.TemporaryDirectory() as folder, screen(*size, dpi, manager) as environment:
        table = Path(folder, "frames.csv")
        environment = environment | {"XDG_STATE_HOME": folder}
        line = [sys.executable, "-m", "texvol", "view", *words, f"--size={size[0]}x{size[1]}", f"--timings={table}"]
        window = subprocess.Popen(line, env=environment, stdout=subprocess.DEVNULL)
        try:
            search = ["xdotool", "search", "--sync", "--onlyvisible", "--pid", str(window.pid), "windowfocus"]
            subprocess.run(search, env=environment, stdout=subprocess.DEVNULL, timeout=_PATIENCE, check=True)
            if moving:
                time.sleep(_OPENING)
            else:
                _rest(window)
            before, start = _used(window), time.monotonic()
            _drag(environment, size, seconds)
            spent = _used(window) - before
            if not moving:
                _rest(window)
            passed = time.monotonic() - start
            subprocess.run(["xdotool", "key", "ctrl+q"], env=environment, check=True)
            window.wait(_PATIENCE)
        finally:
            window.kill()
            window.wait()
        with table.open() as file:
            return _judged(list(csv.DictReader(file)), passed, spent)


def _drag(environment: dict[str, str], size: tuple[int, int], seconds: float) -> None:
    width, height = size
    steps = ["mousemove", f"{width * 0.35:.0f}", f"{height * 0.45:.0f}", "sleep", "0.3", "mousedown", "1"]
    for n in range(round(60 * seconds)):
        to_and_fro = abs((n / 90) % 2 - 1)
        x, y = width * (0.15 + 0.4 * to_and_fro), height * (0.45 + 0.1 * to_and_fro)
        steps += ["mousemove", f"{x:.0f}", f"{y:.0f}", "sleep", "0.0167"]
    subprocess.run(["xdotool", *steps, "mouseup", "1"], env=environment, check=True)


def _rest(window: subprocess.Popen[bytes]) -> None:
    """Wait until a window and its children hardly work for two seconds."""
    end, seen = time.monotonic() + _PATIENCE, [0.0]
    while len(seen) < 5 or seen[-1] - seen[-5] > 2 * _QUIET:  # a frame at rest, once a second, may take half of that
        assert time.monotonic() < end, "the window never came to rest"
        assert window.poll() is None, "the window has ended"
        time.sleep(0.5)
        seen.append(_used(window))


def _used(window: subprocess.Popen[bytes]) -> float:
    """Return the processor seconds of a window and its children."""
    return sum(_processor(each) for each in _family(window.pid))


def _family(process: int) -> list[int]:
    found = [process]
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        found += [each for child in task.read_text().split() for each in _family(int(child))]
    return found


def _processor(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _judged(frames: list[dict[str, str]], since_drag: float, spent: float) -> Turned:
    """Return the times of a table of frames; the drag began `since_drag` seconds before the last of them."""
    begun = float(frames[-1]["time"]) - since_drag - _SLACK
    new = [each for each in frames if each["state"] == "moving" and float(each["picture_seconds"])]
    shown = [each for each in new if float(each["time"]) > begun]
    at = [float(each["time"]) for each in shown]
    # Later ones follow each other: a late one does not count from the change that it shows.
    times = [1e3 * float(shown[0]["picture_seconds"]), *(1e3 * (after - before) for before, after in pairwise(at))]
    rests = [float(each["time"]) for each in frames if each["state"] == "rest" and float(each["time"]) > at[-1]]
    final = rests[0] - at[-1] if rests else None
    return Turned(statistics.median(times), max(times), len(times), 1e3 * spent / len(times), final)


def main() -> None:
    """Measure each window and print a table in Markdown."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", type=lambda text: text.split(","), default=[])
    parser.add_argument("--sizes", default="1280x800,1920x1080")
    parser.add_argument("--dpi", default="96")
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--manager", default="openbox", help="window manager; an empty text for none (openbox)")
    parser.add_argument("--moving", action="store_true", help="wait for no final picture")
    arguments = parser.parse_args()
    needed = ["Xvfb", "xdotool", *filter(None, [arguments.manager]), *(["xrdb"] if arguments.dpi != "96" else [])]
    missing = [each for each in needed if shutil.which(each) is None]
    if missing:
        parser.error(f"{', '.join(missing)} must be installed")
    if arguments.data.is_file():
        files = {arguments.data.name: [str(arguments.data)]}
    else:
        found = {name: (volume_path(arguments.data, name, file), told) for name, file, told, _ in VOLUMES}
        files = {name: [str(path), *told.split()] for name, (path, told) in found.items() if path}
    print("| volume | window | dpi | annotation | pictures | median ms | largest ms | processor ms | final after s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, words in files.items():
        if arguments.only and name not in arguments.only:
            continue
        for size in arguments.sizes.split(","):
            width, height = map(int, size.split("x"))
            for dpi in map(int, arguments.dpi.split(",")):
                for label, annotated in (("none", []), ("all", _ALL)):
                    how = (width, height), dpi, arguments.seconds, arguments.manager
                    one = turned([*words, *annotated], *how, moving=arguments.moving)
                    cells = [name, size, dpi, label, one.pictures, f"{one.median:.0f}", f"{one.largest:.0f}"]
                    cells += [f"{one.processor:.0f}", "" if one.final is None else f"{one.final:.1f}"]
                    print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main()
