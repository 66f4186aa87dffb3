"""Ask for errors on random scenes and hold what comes against the oracle; prints a table in Markdown.

    python scripts/error_control.py [--scenes N] [--data FOLDER] [--seed S] [--side PIXELS]

Scenes: noise at several scales on grids of 12 to 48 samples, and crops of the real volumes in FOLDER where it is given;
random transfer functions (smooth, steep, with steps and spikes), cameras, light and classifications. For each wanted
error: in how many scenes the true error is within it, how many halvings finer than necessary the slabs were, how many
estimates are less than the true error, and how many slabs the search drew in all per slab of the picture that it chose.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from texvol import load
from texvol.ray_casting import raycast
from texvol.rendering.error_control import Choice
from texvol.rendering.error_search import ErrorSearch
from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import Settings
from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import CLASSIFICATIONS, CompleteScene, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import AccuracyWarning

WANTED = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
SIZE = (96, 96)
FILES = ("engine/engine.nii.gz", "tooth/tooth.nhdr", "lung/3DCT_lung.mha", "hydrogen/hydrogen.vti", "flair/FLAIR.nrrd")


def noise(random: np.random.Generator) -> np.ndarray:
    """Noise between 0 and 1, smooth over 1 to 8 samples."""
    dimensions = random.integers(12, 48, 3)
    frequencies = np.meshgrid(*[np.fft.fftfreq(n) for n in dimensions], indexing="ij", sparse=True)
    wavelength = 2 ** random.uniform(0, 3)
    damping = np.exp(-((np.pi * wavelength) ** 2) * sum(f**2 for f in frequencies) / 4)
    values = np.fft.ifftn(np.fft.fftn(random.standard_normal(dimensions)) * damping).real
    return ((values - values.min()) / np.ptp(values)).astype(np.float32)


def crop(random: np.random.Generator, volume: Volume) -> np.ndarray:
    """A random part of a volume, 48 samples wide at most."""
    wide = np.minimum(volume.values.shape, random.integers(24, 49, 3))
    start = [int(random.integers(0, n - w + 1)) for n, w in zip(volume.values.shape, wide, strict=True)]
    return np.ascontiguousarray(volume.values[tuple(slice(s, s + w) for s, w in zip(start, wide, strict=True))])


def transfer_function(random: np.random.Generator, values: np.ndarray) -> TransferFunction:
    """Random points: smooth ramps of thin or bone-like matter, some with a step or a spike."""
    low, high = float(values.min()), float(values.max()) + 1e-6
    count = int(random.integers(3, 7))
    positions = np.sort(random.uniform(low, high, count))
    extinctions = random.uniform(0, 1, count) ** 3 * 10 ** random.uniform(-2.5, 0)
    extinctions[0] = 0 if random.random() < 0.7 else extinctions[0]
    if random.random() < 0.2:
        positions[1] = positions[2]
    elif random.random() < 0.2:
        positions[1] += 0.02 * (high - low) * (random.random() - 0.5)
        positions = np.sort(positions)
    return TransferFunction(positions, random.random((count, 3)), extinctions)


def camera(random: np.random.Generator, volume: Volume) -> Camera:
    """A random direction, orthographic or perspective, sometimes from the inside."""
    view = random.standard_normal(3)
    distance = volume.radius * random.choice([0.3, 2.5, 4.0], p=[0.15, 0.5, 0.35])
    eye = volume.centre - distance * view / np.linalg.norm(view)
    up = np.eye(3)[np.argmin(np.abs(view))]
    if random.random() < 0.5:
        return Camera.perspective(eye, volume.centre, up, fov=random.uniform(20, 80))
    return Camera.orthographic(eye, volume.centre, up, height=volume.radius * random.uniform(1, 2.2))


def lighting(random: np.random.Generator) -> Lighting | None:
    """Light from the eye or from a random direction for half of the scenes, on one side of their matter or both."""
    if random.random() < 0.5:
        return None
    light = Light("head") if random.random() < 0.5 else Light("directional", tuple(random.standard_normal(3)))
    shininess = float(random.choice([8, 20, 32]))
    return Lighting((light,), shininess=shininess, two_sided=bool(random.random() < 0.7))


def random_scene(random: np.random.Generator, volumes: list[Volume]) -> Scene:
    """One scene; its extinction is per smallest spacing."""
    values = (
        crop(random, volumes[random.integers(len(volumes))]) if volumes and random.random() < 0.4 else noise(random)
    )
    volume = Volume(values, random.uniform(0.7, 1.5, 3))
    classification = CLASSIFICATIONS[int(random.integers(4))]
    medium, view = transfer_function(random, values), camera(random, volume)
    return Scene(volume, medium, view, classification=classification, lighting=lighting(random))  # type: ignore[arg-type]


class Remembered:
    """Draws a scene and its references, each once; `pixels_of_slabs` counts rays times rate, as if each were drawn."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self._pictures: dict[tuple[str, tuple[int, int], float, str | None], np.ndarray] = {}
        self.pixels_of_slabs = 0.0

    def __call__(self, scene: CompleteScene, size: tuple[int, int], settings: Settings) -> np.ndarray:
        thickness = settings.slab_thickness
        pixels = size[0] * size[1]
        if settings.regions is not None:  # all of it is drawn here, and only they count
            pixels = sum(width * height for _, _, width, height in settings.regions)
        self.pixels_of_slabs += pixels * scene.smallest_spacing / thickness
        key = scene.classification, size, thickness, settings.adaptive
        if key not in self._pictures:
            exact = replace(settings, texture_format="rgba32f", early_termination=0.0, regions=None)
            with self._renderer._context:  # no argument of `render` divides the same slabs at each thickness
                self._pictures[key] = self._renderer._draw(scene, size, exact)
        return self._pictures[key]

    def count(self, scene: CompleteScene, size: tuple[int, int], settings: Settings) -> int:
        """Return the number of slabs that are sampled."""
        with self._renderer._context:
            return self._renderer._pictures_of(scene).count(scene, size, settings)

    def exactly(self, scene: CompleteScene, size: tuple[int, int], settings: Settings) -> np.ndarray:
        """Draw a reference."""
        return self(scene, size, settings.exact)


def chosen(draw: Remembered, scene: Scene, size: tuple[int, int], wanted: float) -> tuple[Choice, Settings]:
    """Return the choice for a wanted error of a picture of a size, and its settings."""
    settings = Settings(np.nan, "rgba32f", "rgba32f", 0.0, skip_empty=True, adaptive="auto")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        pictures = SimpleNamespace(rounding=lambda scene: 0.0, count=draw.count)
        search = ErrorSearch(draw, draw.exactly, lambda scene: pictures)
        return search.choose(scene.completed(size), size, settings, wanted)


def _drawn_at(
    draw: Remembered, scene: CompleteScene, size: tuple[int, int], settings: Settings, thickness: float
) -> np.ndarray:
    return draw(scene, size, replace(settings, slab_thickness=thickness))


def excess(
    draw: Callable[[float], np.ndarray],
    error: Callable[[np.ndarray], float],
    spacing: float,
    thickness: float,
    wanted: float,
) -> int:
    """How many times the chosen thickness could be doubled with the true error still within what was wanted."""
    doublings = 0
    while thickness * 2 ** (doublings + 1) <= 16 * spacing and error(draw(thickness * 2 ** (doublings + 1))) <= wanted:
        doublings += 1
    return doublings


class Outcome(NamedTuple):
    """Outcome of a search for one wanted error of a scene."""

    reached: bool
    true: float  # error
    estimated: float
    finer: int  # halvings beyond what was needed
    cost: float  # slabs that were drawn, per slab of the chosen picture


def outcomes(renderer: Renderer, scene: Scene, size: tuple[int, int], all_wanted: Sequence[float]) -> list[Outcome]:
    """Search for each wanted error, and hold the pictures against the oracle."""
    truth, draw, spacing = raycast(scene, size), Remembered(renderer), scene.volume.smallest_spacing
    complete, found = scene.completed(size), []

    def error(picture: np.ndarray) -> float:
        return float(np.abs(picture - truth).max())

    for wanted in all_wanted:
        draw.pixels_of_slabs = 0.0
        choice, settings = chosen(draw, scene, size, wanted)
        own = size[0] * size[1] * spacing / choice.slab_thickness
        cost, true = draw.pixels_of_slabs / own, error(choice.picture)
        at = partial(_drawn_at, draw, complete, size, settings)
        finer = excess(at, error, spacing, choice.slab_thickness, wanted)
        found.append(Outcome(choice.reached, true, choice.estimated_error, finer, cost))
        if choice.reached and true > wanted:
            rate = spacing / choice.slab_thickness
            found_so = f"true {true:.2g}, estimated {choice.estimated_error:.2g}, rate {rate:g}"
            print(f"<!-- {scene.classification} wanted {wanted:g}: {found_so} -->", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--side", type=int, default=SIZE[0], help="pixels along each side of the pictures")
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    paths = [arguments.data / file for file in FILES] if arguments.data else []
    volumes = [load(path) for path in paths if path.exists()]
    rows: dict[float, list[Outcome]] = {wanted: [] for wanted in WANTED}
    size = arguments.side, arguments.side
    with Renderer() as renderer:
        for _ in range(arguments.scenes):
            scene = random_scene(random, volumes)
            for wanted, outcome in zip(WANTED, outcomes(renderer, scene, size, WANTED), strict=True):
                rows[wanted].append(outcome)
    print(
        f"{arguments.scenes} scenes, {len(volumes)} real volumes, seed {arguments.seed}, {size[0]}x{size[1]} pixels\n"
    )
    print(
        "| asked for | said to be reached | of these within | at most two halvings too fine | median true / asked for "
        "| estimates below the truth | slabs drawn / of the picture, median | 90 % |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for wanted, results in rows.items():
        reached = [each for each in results if each.reached]
        within = np.mean([each.true <= wanted for each in reached])
        frugal = np.mean([each.finer <= 2 for each in reached])
        ratio = np.median([each.true / wanted for each in reached])
        below = np.mean([each.estimated < each.true for each in results])
        cost = np.quantile([each.cost for each in reached], (0.5, 0.9))
        print(
            f"| {wanted:g} | {len(reached)} | {within:.1%} | {frugal:.1%} | {ratio:.2f} | {below:.1%} "
            f"| {cost[0]:.1f} | {cost[1]:.1f} |"
        )
