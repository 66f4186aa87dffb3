"""Levels with a known error on random scenes of real volumes: how often it is kept, and what is read for it.

    python scripts/benchmark_levels.py [--scenes 100] [--data FOLDER] [--seed S] [--seconds N]

The volumes, real ones and made ones, are converted to stores in a temporary folder. For each scene a volume, a
transfer function (a preset or random points), a camera (near, or so far that the box takes a fifth of the picture)
and an error E from 0.1 to 0.003 are drawn by lot. The picture with `max_error=E` is held against one of full
resolution with an error of E/4, so that what is found is off by a quarter of E at most. A view is zoomed out if
pixels are at least twice as far apart as samples of full resolution, everywhere in the box. Bytes are those that are
read from the store, statistics aside, over those that the picture of full resolution reads. The constants of the
prediction were chosen with the volumes of FITTED, and none of these scenes; the others are new to it. Prints
Markdown.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from benchmark import default_data
from benchmark_timing import columns, machine, row
from example_volumes import brain, cell
from large_made import MadeVolume

from texvol import Camera, Renderer, Scene, TransferFunction, Volume, load
from texvol.formats.stores.arrays import open_array
from texvol.formats.stores.writing.convert import Layout, convert
from texvol.rendering.streaming.levels import settled_level
from texvol.scene.large_volume import LargeVolume
from texvol.scene.transfer import presets
from texvol.util.errors import AccuracyWarning

FITTED = {
    "engine/engine.nii.gz": {}, "tooth/tooth.nhdr": {}, "lung/3DCT_lung.mha": {}, "flair/FLAIR.nrrd": {},
    "brain/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz": {}, "fly/fly_150x256x256.tif": {},
    "shell/shell_225x128x128.tif": {},
}  # fmt: skip
NEW: dict[str, dict[str, Any]] = {
    "male/male.raw.bz2": {"shape": (128, 256, 256), "dtype": "uint8", "spacing": (1.5777, 0.99586, 1.008)},
    "nucleus/dna_conf_wf.ome.tif": {"channel": 0},
    "phantom": {},
}
ERRORS = (0.1, 0.03, 0.01, 0.003)
PRESETS = ("histogram", "contours", "grey", "fog", "solid", "viridis", "inferno")
_SIZE = (96, 96)
_MADE = 256  # samples along the sides of made volumes
_FINER = 4  # times smaller an error the picture has that others are held against
_LAYOUT = Layout((32, 32, 32), (128, 128, 128))
_NEAR, _FAR = (0.4, 1.6), (4.0, 8.0)  # height of the picture in radii of the box


@dataclass(frozen=True)
class Found:
    """What one scene showed."""

    error: float  # that was asked for
    is_far: bool  # zoomed out
    is_new: bool  # of a volume with which no constants were chosen
    reached: bool  # False if the renderer said that it is not
    ratio: float  # of the true error and the one asked for
    bytes: int
    bytes_of_all: int  # that the picture of full resolution reads
    coarse: float  # fraction of the regions drawn that are of a coarse level


def stores_of(data: Path, folder: Path) -> list[tuple[Path, bool]]:
    """Convert the volumes that are there and made ones; return their stores, True with those that are new."""
    volumes: list[tuple[str, Callable[[], Volume], bool]] = [
        (Path(file).name.split(".")[0], partial(load, data / file, **how), file in NEW)
        for file, how in (FITTED | NEW).items()
        if (data / file).exists()
    ]
    volumes += [
        ("brain_made", lambda: Volume(brain(_MADE)), True),
        ("cell_made", lambda: Volume(cell(_MADE)[:, 0].copy()), True),
        ("sheets_made", lambda: open_array(MadeVolume(_MADE)), True),
    ]
    stores = []
    for name, volume, is_new in volumes:
        stores.append((folder / f"{name}.ome.zarr", is_new))
        convert(volume(), stores[-1][0], layout=_LAYOUT)
    return stores


def random_function(random: np.random.Generator, volume: Volume) -> TransferFunction:
    """Return a preset, or a few random points: thin or bone-like matter above what is seen through."""
    if random.random() < 0.4:
        return presets.preset(str(random.choice(PRESETS)), volume)
    low, high = volume.finite_range or (0.0, 1.0)
    values = np.sort(random.uniform(low, high, int(random.integers(3, 6))))
    extinctions = random.uniform(0, 1, values.size) ** 2 * 10 ** random.uniform(-2, 0) / volume.smallest_spacing
    extinctions[0] = 0
    return TransferFunction(values, random.random((values.size, 3)), extinctions)


def random_camera(random: np.random.Generator, volume: Volume, is_far: bool) -> Camera:
    """Return a camera that looks at the middle of the box from anywhere."""
    view = random.standard_normal(3)
    view /= np.linalg.norm(view)
    up = np.eye(3)[np.argmin(np.abs(view))]
    height = volume.radius * random.uniform(*(_FAR if is_far else _NEAR))
    if random.random() < 0.5:
        return Camera.orthographic(volume.centre - 4 * volume.radius * view, volume.centre, up, height=height)
    distance = height / (2 * np.tan(np.radians(20)))
    return Camera.perspective(volume.centre - distance * view, volume.centre, up, fov=40)


def bytes_read(volume: LargeVolume) -> int:
    """Return what has been read from the store of a volume."""
    return sum(level.source.bytes_read for level in volume.levels)


def measured(renderer: Renderer, store: Path, is_new: bool, seed: int) -> Found:
    """Draw a random scene by levels and at full resolution."""
    random = np.random.default_rng(seed)
    is_far, error = bool(random.random() < 0.5), float(random.choice(ERRORS))
    about = _opened(store)
    function, camera = random_function(random, about), random_camera(random, about, is_far)
    seen = Scene(about, function, camera).completed(_SIZE)
    is_far = settled_level(seen, _SIZE, "auto", None) > 0
    volumes = [_opened(store) for _ in range(2)]
    before = [bytes_read(each) for each in volumes]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", AccuracyWarning)
        picture = renderer.render(Scene(volumes[0], function, camera), _SIZE, max_error=error)
    own = bytes_read(volumes[0]) - before[0]
    levels = renderer.stats["parts"]["levels"]  # which draws again, to count samples
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        truth = renderer.render(Scene(volumes[1], function, camera), _SIZE, level=0, max_error=error / _FINER)
    true = float(np.abs(picture - truth).max())
    reached = not any(issubclass(each.category, AccuracyWarning) for each in said)
    coarse = 1 - levels.get("0", 0) / max(sum(levels.values()), 1)
    return Found(error, is_far, is_new, reached, true / error, own, bytes_read(volumes[1]) - before[1], coarse)


def _opened(store: Path) -> LargeVolume:
    volume = load(store)
    assert isinstance(volume, LargeVolume)
    return volume


def print_table(found: list[Found]) -> None:
    """Print a line for each error and kind of view, one for all and one for volumes that are new to the constants."""
    columns("E", "view", "scenes", "reached", "kept", "median error / E", "largest", "median bytes", "mean", "coarse")
    for error in ERRORS:
        for far in (False, True):
            some = [each for each in found if (each.error, each.is_far) == (error, far)]
            _print_line(f"{error:g}", "zoomed out" if far else "near", some)
    _print_line("all", "all", found)
    _print_line("all", "all, of new volumes", [each for each in found if each.is_new])


def _print_line(error: str, view: str, found: list[Found]) -> None:
    if not found:
        return
    reached = [each for each in found if each.reached]
    ratios = [each.ratio for each in reached] or [float("nan")]
    read = [each.bytes / each.bytes_of_all for each in found if each.bytes_of_all] or [float("nan")]
    row(
        error, view, len(found), len(reached), f"{np.mean([each <= 1 for each in ratios]):.0%}",
        f"{np.median(ratios):.2f}", f"{max(ratios):.2f}", f"{np.median(read):.2f}", f"{np.mean(read):.2f}",
        f"{np.mean([each.coarse for each in found]):.0%}",
    )  # fmt: skip


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--data", type=Path, default=default_data(), help="folder of real volumes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=math.inf, help="begin no scene after so many")
    arguments = parser.parse_args()
    print(machine())
    found = []
    with tempfile.TemporaryDirectory(prefix="texvol-levels-") as folder, Renderer() as renderer:
        stores, start = stores_of(arguments.data, Path(folder)), time.monotonic()
        for number in range(arguments.scenes):
            if time.monotonic() - start > arguments.seconds:
                break
            store, is_new = stores[number % len(stores)]
            found.append(one := measured(renderer, store, is_new, arguments.seed * 10**6 + number))
            if one.reached and one.ratio > 1:
                print(f"<!-- scene {number}, {store.name}: {one} -->", flush=True)
    print(f"\n{len(found)} scenes on {len(stores)} volumes, seed {arguments.seed}, {_SIZE[0]}×{_SIZE[1]} pixels.\n")
    print_table(found)


if __name__ == "__main__":
    main()
