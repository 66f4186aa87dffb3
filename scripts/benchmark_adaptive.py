"""Time to reach an error with slabs that are divided where they are not nearly transparent, and with equal ones.

    python scripts/benchmark_adaptive.py DATA [--only NAME,NAME] [--size 512] [--rounds 3]

DATA is the folder of the real volumes (`real_volumes.py` lists them), each drawn by `post` as it looks without a word.
The error is held against `integrated` at 32 slabs per sample. Both kinds are drawn in turns, at rates that take some
of the same time; the processor time of an error is interpolated between those of the rates beside it, in logarithms.
"""

from __future__ import annotations

import argparse
import shlex
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmark_timing import columns, in_turns, machine, row
from numpy.typing import NDArray
from real_volumes import VOLUMES, volume_path

import texvol
from texvol import Renderer, Scene
from texvol.options import texts
from texvol.options.reading import add_volume_options, load_volume

RATES = {"off": (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0), "on": (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)}
_REFERENCE_RATE = 32
_LARGEST, _RMS = (1 / 32, 1 / 64, 1 / 128), (3e-3, 1e-3)
_TERMINATION = 2.0**-14  # the default rate's 1/1024 would be in the errors


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", default="", help="names of volumes (all)")
    parser.add_argument("--size", type=int, default=512, help="pixels along a side (512)")
    parser.add_argument("--rounds", type=int, default=3, help="turns that each rate gets (3)")
    arguments = parser.parse_args()
    names = [each for each in arguments.only.split(",") if each]
    print(machine() + "\n")
    columns("volume", "light", *(f"largest {each:.4f}" for each in _LARGEST), *(f"rms {each:g}" for each in _RMS))
    for name, file, reading, _ in VOLUMES:
        path = volume_path(arguments.data, name, file)
        if path is not None and (not names or name in names):
            scene = Scene(_loaded(path, reading))
            if not scene.completed((8, 8)).volume.nearest:  # labels have no slabs to divide
                row(name, *_cells(replace(scene, classification="post"), arguments.size, arguments.rounds))


def _loaded(path: Path, reading: str) -> texvol.Volume:
    """Return a volume that is read as options of the command line say."""
    parser = argparse.ArgumentParser()
    add_volume_options(parser)
    parser.add_argument("--spacing", type=texts.triple)
    arguments = parser.parse_args([str(path), *shlex.split(reading)])
    return load_volume(arguments, arguments.spacing)


def _cells(scene: Scene, size: int, rounds: int) -> list[str]:
    lit = "lit" if scene.completed((size, size)).lighting is not None else "none"
    with Renderer() as renderer:
        fine = renderer.render(replace(scene, classification="integrated"), size, sampling_rate=_REFERENCE_RATE)
        found = {kind: _measured(renderer, scene, size, kind, fine, rounds) for kind in RATES}
    cells = []
    for column, errors in enumerate((_LARGEST, _RMS)):
        for error in errors:
            times = {kind: _time_of(table[:, 0], table[:, 1 + column], error) for kind, table in found.items()}
            cells.append(f"{times['off']:.0f} → {times['on']:.0f} ({times['off'] / times['on']:.2f})")
    return [lit, *cells]


def _measured(
    renderer: Renderer, scene: Scene, size: int, adaptive: str, fine: NDArray[np.float32], rounds: int
) -> NDArray[np.float64]:
    """Return processor milliseconds, largest and rms errors at each rate, shape (n, 3)."""
    errors: dict[float, tuple[float, float]] = {}

    def drawn(rate: float) -> float:
        start = time.process_time()
        picture = renderer.render(scene, size, sampling_rate=rate, adaptive=adaptive, early_termination=_TERMINATION)
        spent = time.process_time() - start
        off = np.abs(np.asarray(picture, np.float64) - fine).max(axis=-1)
        errors[rate] = float(off.max()), float(np.sqrt((off**2).mean()))
        return 1e3 * spent

    times = in_turns({rate: lambda rate=rate: drawn(rate) for rate in RATES[adaptive]}, rounds)  # type: ignore[misc]
    return np.array([(times[rate], *errors[rate]) for rate in RATES[adaptive]])


def _time_of(times: NDArray[np.float64], errors: NDArray[np.float64], error: float) -> float:
    """Return the time from which on errors are no larger, NaN if they are so at all rates or at none."""
    beyond = np.flatnonzero(errors > error)
    if not beyond.size or beyond[-1] + 1 == len(errors):
        return float("nan")
    pair = slice(beyond[-1], beyond[-1] + 2)
    return float(np.exp(np.interp(-np.log(error), -np.log(errors[pair]), np.log(times[pair]))))


if __name__ == "__main__":
    main()
