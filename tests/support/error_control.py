"""Ask for errors on random scenes and hold what comes against the oracle; prints a table in Markdown.

    python scripts/error_control.py [--scenes N] [--data FOLDER] [--seed S]

Scenes: noise at several scales on grids of 12 to 48 samples, and crops of the real volumes in FOLDER where it is given;
random transfer functions (smooth, steep, with steps and spikes), cameras and classifications. For each wanted error: in
how many scenes the true error is within it, and how many halvings finer than necessary the slabs were.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from texvol import load
from texvol.ray_casting import raycast
from texvol.rendering.error_control import Draw, converging, thickness_for_error
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

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


def random_scene(random: np.random.Generator, volumes: list[Volume]) -> Scene:
    """One scene; its extinction is per smallest spacing."""
    values = (
        crop(random, volumes[random.integers(len(volumes))]) if volumes and random.random() < 0.4 else noise(random)
    )
    volume = Volume(values, random.uniform(0.7, 1.5, 3))
    classification = CLASSIFICATIONS[int(random.integers(4))]
    return Scene(volume, transfer_function(random, values), camera(random, volume), classification=classification)  # type: ignore[arg-type]


def remembered(renderer: Renderer, scene: Scene) -> Draw:
    """Draws the scene at a thickness, once."""
    pictures: dict[float, np.ndarray] = {}

    def draw(thickness: float) -> np.ndarray:
        if thickness not in pictures:
            pictures[thickness] = renderer.render(
                scene, SIZE, slab_thickness=thickness, texture_format="rgba32f", target_format="rgba32f"
            )
        return pictures[thickness]

    return draw


def excess(draw: Draw, truth: Callable[[np.ndarray], float], spacing: float, chosen: float, wanted: float) -> int:
    """How many times the chosen thickness could be doubled with the true error still within what was wanted."""
    doublings = 0
    while chosen * 2 ** (doublings + 1) <= 16 * spacing and truth(draw(chosen * 2 ** (doublings + 1))) <= wanted:
        doublings += 1
    return doublings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    paths = [arguments.data / file for file in FILES] if arguments.data else []
    volumes = [load(path) for path in paths if path.exists()]
    rows: dict[float, list[tuple[bool, float, int]]] = {wanted: [] for wanted in WANTED}
    with Renderer() as renderer:
        for number in range(arguments.scenes):
            scene = random_scene(random, volumes)
            spacing = scene.volume.smallest_spacing
            truth, draw = raycast(scene, SIZE), remembered(renderer, scene)
            reference = converging(scene)
            draw_reference = draw if reference is scene else remembered(renderer, reference)

            def error(picture: np.ndarray, truth: np.ndarray = truth) -> float:
                return float(np.abs(picture - truth).max())

            for wanted, results in rows.items():
                choice = thickness_for_error(
                    draw, draw_reference, spacing, wanted, converges_alone=reference is not scene
                )
                if error(choice.picture) > wanted and choice.reached:
                    print(
                        f"<!-- scene {number} {scene.classification} wanted {wanted:g}: true "
                        f"{error(choice.picture):.2g}, estimated {choice.estimated_error:.2g}, rate "
                        f"{spacing / choice.slab_thickness:g} -->",
                        flush=True,
                    )
                finer = excess(draw, error, spacing, choice.slab_thickness, wanted)
                results.append((choice.reached, error(choice.picture), finer))
    print(f"{arguments.scenes} scenes, {len(volumes)} real volumes, seed {arguments.seed}\n")
    print("| wanted | said to be reached | of these within | at most two halvings too fine | median true / wanted |")
    print("|---|---|---|---|---|")
    for wanted, results in rows.items():
        reached = [(true, finer) for said, true, finer in results if said]
        within = np.mean([true <= wanted for true, _ in reached])
        frugal = np.mean([finer <= 2 for _, finer in reached])
        ratio = np.median([true / wanted for true, _ in reached])
        print(f"| {wanted:g} | {len(reached)} | {within:.1%} | {frugal:.1%} | {ratio:.2f} |")
