"""A made volume larger than memory: seconds, memory and bytes of its pictures; prints Markdown, section by section.

    python scripts/benchmark_large.py --folder FOLDER [--samples 2048] [--only full,auto,first,npy,levels]

The store (8.6 GB of samples by default, 2.3 GB as it is stored) is made in FOLDER by the first run, which takes some
minutes, and stays there. Each measurement is a process of its own. Before each the system is asked to forget the files
that it has in memory, which only root may ask for; the first line says if it did. Processor seconds stand beside wall
seconds: on a machine that others use too, only they compare.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmark_timing import Usage, columns, heading, machine, row, texvol_line, usage
from large_made import made_npy, made_store

_CACHES = Path("/proc/sys/vm/drop_caches")
_CHILDREN = Path(__file__).parent / "large_children.py"
_SERVER = Path(__file__).parent / "throttled_server.py"
_ONSETS = {"opaque": 100, "translucent": 40}  # values at which something begins to show
_OF_COMMAND = ("s", "processor s", "peak MB")
_ROUNDS = 3
_COMPARED = 512  # samples along an axis of the volume that is also read from .npy


@dataclass(frozen=True)
class Large:
    """Store that is measured, and how."""

    folder: Path
    samples: int
    memory: str
    rounds: int

    @property
    def store(self) -> Path:
        """The store; it is made if it is not there."""
        return made_store(self.folder, self.samples)

    def function(self, name: str, samples: int | None = None) -> Path:
        """File of a transfer function whose extinctions are for the size of the volume."""
        extinction = {"opaque": 0.8, "translucent": 6 / (samples or self.samples)}[name]
        first, most = _ONSETS[name], 140 if name == "opaque" else 255
        points = [
            {"value": first, "color": [0.6, 0.3, 0.1], "extinction": 0},
            {"value": most, "color": [1, 0.9, 0.7], "extinction": extinction},
            {"value": 256, "color": [1, 1, 1], "extinction": extinction},
        ]
        path = self.folder / f"{name}-{samples or self.samples}.json"
        path.write_text(json.dumps({"points": points}))
        return path

    def picture(self) -> Path:
        """File of a picture, which is not there yet."""
        path = self.folder / "picture.png"
        path.unlink(missing_ok=True)
        return path


def forget_files() -> bool:
    """Ask the system to forget the files that it has in memory; return True if it does."""
    try:
        os.sync()
        _CACHES.write_text("3")
    except OSError:
        return False
    return True


def typical(line: list[str], rounds: int) -> Usage:
    """Medians of what a command takes from a cold start."""
    found = []
    for _ in range(rounds):
        forget_files()
        found.append(usage(line))
    return Usage(*(statistics.median(getattr(each, name) for each in found) for name in vars(found[0])))


def child(rounds: int, *words: object) -> dict[str, Any]:
    """Median of what `large_children.py` measures, by seconds."""
    found = []
    for _ in range(rounds):
        forget_files()
        line = [sys.executable, str(_CHILDREN), *map(str, words)]
        done = subprocess.run(line, capture_output=True, text=True, check=True)
        found.append(json.loads(done.stdout))
    return sorted(found, key=lambda each: float(each["seconds"]))[len(found) // 2]


def stats_of(large: Large, *words: object) -> dict[str, Any]:
    """`--stats` of a picture."""
    path = large.folder / "stats.json"
    line = texvol_line("render", *words, "-o", large.picture(), "--stats", path)
    subprocess.run(line, check=True, capture_output=True)
    found: dict[str, Any] = json.loads(path.read_text())
    return found


def full(large: Large) -> None:
    """Print the section on pictures at full resolution."""
    heading(
        f"Full resolution, {large.samples}³",
        f"`texvol render --level 0 --memory {large.memory}`, 512×512, start to finish, beside TensorStore alone, which "
        "reads and decodes every chunk in which something shows (without its start). Asked for: at most 1.5 times its "
        "time, and at most 4.5 GB.",
    )
    of_both = ("ratio", "of processor s")
    columns("transfer function", *_OF_COMMAND, "chunks", "TensorStore s", "processor s", "chunks", *of_both)
    for name, onset in _ONSETS.items():
        words = [large.store, "--tf", large.function(name), "--level", 0, "--memory", large.memory]
        ours = typical(texvol_line("render", *words, "-o", large.picture()), large.rounds)
        parts = stats_of(large, *words)["parts"]
        alone = child(large.rounds, "read", large.store, onset)
        row(
            name, f"{ours.seconds:.1f}", f"{ours.processor_seconds:.1f}", f"{ours.megabytes:.0f}",
            parts["chunks_decoded"], f"{alone['seconds']:.1f}", f"{alone['processor_seconds']:.1f}", alone["chunks"],
            f"{ours.seconds / alone['seconds']:.2f}",
            f"{ours.processor_seconds / alone['processor_seconds']:.2f}",
        )  # fmt: skip


def auto(large: Large) -> None:
    """Print the section on pictures at the level that pixels show."""
    heading(
        f"Level by pixels, {large.samples}³",
        "512×512 from a cold start: the whole command, and load and picture in a process after its imports. Asked for: "
        "under 3 s.",
    )
    columns("transfer function", "command s", "processor s", "peak MB", "after imports s", "processor s")
    for name in _ONSETS:
        function = large.function(name)
        line = texvol_line("render", large.store, "--tf", function, "-o", large.picture())
        whole, inside = typical(line, large.rounds), child(large.rounds, "auto", large.store, function)
        row(
            name, f"{whole.seconds:.2f}", f"{whole.processor_seconds:.2f}", f"{whole.megabytes:.0f}",
            f"{inside['seconds']:.2f}", f"{inside['processor_seconds']:.2f}",
        )  # fmt: skip


def first(large: Large) -> None:
    """Print the section on first pictures from coarse levels."""
    heading(
        f"First picture, {large.samples}³",
        "Until the first of the progressive pictures at full resolution is there: of the whole command as a file, and "
        "in a process after its imports; from a disk, and from a server that sends 10 MB/s and answers after 40 ms. "
        "Asked for: under 1 s.",
    )
    columns("from", "command s", "after imports s", "processor s", "level")
    function = large.function("opaque")
    with_server: list[tuple[str, Callable[[], str]]] = [("disk", lambda: str(large.store))]
    server = subprocess.Popen([sys.executable, str(_SERVER), str(large.folder)], stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        with_server.append(("server", lambda: f"{address}/{large.store.name}"))
        for name, where in with_server:
            whole = statistics.median(_until_first(large, where(), function) for _ in range(large.rounds))
            inside = child(large.rounds, "first", where(), function)
            row(name, f"{whole:.2f}", f"{inside['seconds']:.2f}", f"{inside['processor_seconds']:.2f}", inside["level"])
    finally:
        server.terminate()
        server.wait()


def _until_first(large: Large, store: str, function: Path) -> float:
    """Seconds until a command has written its first picture; the command is ended then."""
    forget_files()
    path = large.picture()
    line = texvol_line("render", store, "--tf", function, "--level", 0, "--progressive", "-o", path)
    start = time.perf_counter()
    command = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while not path.exists():
            if command.poll() is not None:
                raise RuntimeError(f"status {command.returncode} before there was a picture")
            time.sleep(0.005)
        return time.perf_counter() - start
    finally:
        command.kill()
        command.wait()


def npy(large: Large) -> None:
    """Print the section on a store beside an array file."""
    heading(
        f"Store beside .npy, {_COMPARED}³",
        "The whole command, `--classification post`, `--level 0`; files in the system's memory. Asked for: at "
        "most 1.25.",
    )
    beside = (f"{name}: {each}" for name in ("store", ".npy") for each in _OF_COMMAND)
    columns("transfer function", *beside, "ratio", "of processor s")
    store, array = made_store(large.folder, _COMPARED), made_npy(large.folder, _COMPARED)
    for name in _ONSETS:
        words = ["--tf", large.function(name, _COMPARED), "--classification", "post", "-o", large.picture()]
        lines = texvol_line("render", store, "--level", 0, *words), texvol_line("render", array, *words)
        found: list[list[Usage]] = [[], []]
        for _ in range(large.rounds + 1):  # in turns; the first warms the files
            for line, each in zip(lines, found, strict=True):
                each.append(usage(line))
        a, b = (
            Usage(*(statistics.median(getattr(one, name) for one in each[1:]) for name in vars(each[0])))
            for each in found
        )
        row(
            name, f"{a.seconds:.2f}", f"{a.processor_seconds:.2f}", f"{a.megabytes:.0f}", f"{b.seconds:.2f}",
            f"{b.processor_seconds:.2f}", f"{b.megabytes:.0f}", f"{a.seconds / b.seconds:.2f}",
            f"{a.processor_seconds / b.processor_seconds:.2f}",
        )  # fmt: skip


def levels(large: Large) -> None:
    """Print the section on bytes by error."""
    heading(
        f"Bytes by error, {large.samples}³",
        "Zoomed out: the box takes a quarter of the picture's height. Bytes that are read by `--max-error 0.01`, "
        "beside those at full resolution and at the level that pixels show.",
    )
    columns("transfer function", "picture", "levels of regions", "chunks", "MB", "of full resolution")
    for name in _ONSETS:
        words = [large.store, "--tf", large.function(name), "--height", 4 * large.samples, "--memory", large.memory]
        whole = None
        for kind, more in {"full": ("--level", 0), "E = 0.01": ("--max-error", 0.01), "pixels": ()}.items():
            parts = stats_of(large, *words, *more)["parts"]
            whole = whole or parts["bytes_read"]
            by_level = ", ".join(f"{count} of {level}" for level, count in parts["levels"].items())
            fraction = parts["bytes_read"] / whole
            row(name, kind, by_level, parts["chunks_decoded"], f"{parts['bytes_read'] / 1e6:.1f}", f"{fraction:.2f}")


SECTIONS = {"full": full, "auto": auto, "first": first, "npy": npy, "levels": levels}


def main() -> None:
    """Print the sections that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, required=True, help="where the stores are made")
    parser.add_argument("--samples", type=int, default=2048, help="along an axis (2048)")
    parser.add_argument("--memory", default="4GB", help="for samples (4GB)")
    parser.add_argument("--rounds", type=int, default=_ROUNDS, help=f"turns that everything gets ({_ROUNDS})")
    parser.add_argument("--only", default=",".join(SECTIONS), metavar="SECTION,…")
    arguments = parser.parse_args()
    chosen = arguments.only.split(",")
    if unknown := set(chosen) - SECTIONS.keys():
        parser.error(f"there is no section {', '.join(unknown)}; there are {', '.join(SECTIONS)}")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # modules are compiled once, as where they are installed
    arguments.folder.mkdir(parents=True, exist_ok=True)
    room = shutil.disk_usage(arguments.folder).free
    if room < 0.5 * arguments.samples**3 and not (arguments.folder / f"made-{arguments.samples}.ome.zarr").exists():
        parser.error(f"--folder has room for {room / 1e9:.1f} GB, the store needs up to half of its samples' bytes")
    print(machine())
    print(f"The system {'forgets' if forget_files() else 'keeps'} files before each measurement.")
    large = Large(arguments.folder, arguments.samples, arguments.memory, arguments.rounds)
    for name in chosen:
        SECTIONS[name](large)
        print(f"\n{os.getloadavg()[0]:.1f} processes running, on average over the last minute.", flush=True)


if __name__ == "__main__":
    main()
