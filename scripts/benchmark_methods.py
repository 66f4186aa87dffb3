"""Time, memory and error of the survey's methods on volumes that tell them apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from benchmark_scenes import FILES, VIEW, File, built_in, real
from benchmark_timing import Run, columns, heading, row

from texvol import Camera, Renderer, Scene, TransferFunction, Volume
from texvol.methods import METHODS
from texvol.report.survey.measuring import survey
from texvol.report.survey.table import cells

SIZE = (256, 256)
_HYDROGEN = File("hydrogen", "hydrogen/hydrogen.vti", None)
_REAL = (_HYDROGEN, FILES[0], FILES[1])  # an orbital, the engine, and a CT of a chest
# Dark red below, light blue above; the extinction rises by so much over the range of values, per spacing of 64³.
_LINEAR = [(0.0, (0.6, 0.1, 0.05), 0.0), (1.0, (0.6, 0.8, 1.0), 0.06)]


def methods(run: Run) -> None:
    """Print the section on the survey's methods."""
    heading(
        "Methods of the survey",
        f"{SIZE[0]}×{SIZE[1]}: seconds of preparation and of a picture, memory of what is prepared, bits per voxel of "
        "compressed volumes; maximum and rms error against the exact integral of the method's own medium (projections: "
        "of the largest integral), and against the post-classified one.",
    )
    names = [each for each in METHODS if not run.scenes or any(part in each for part in run.scenes)]
    for name, scene in scenes(run):
        print(f"\n### {name}\n")
        columns("method", "prepare", "picture", "memory", "bits", "own max", "own rms", "post max", "post rms")
        with Renderer() as renderer:
            for each in survey(renderer, scene, SIZE, names).measurements:
                row(each.name, *(["left out: " + each.skipped] if each.skipped else cells(each)))


def scenes(run: Run) -> Iterator[tuple[str, Scene]]:
    """Yield names and scenes: three built in, and real ones where the files are there."""
    samples = 32 if run.quick else 64
    yield f"checkerboard {samples}³", checkerboard(samples)
    yield f"ramp {samples}³", ramp(samples)
    yield f"Marschner-Lobb {samples}³, bone", built_in("bone", samples)
    for file in _REAL[:1] if run.quick else _REAL:
        scene = real(file, run.data)
        if scene is not None:
            yield file.name, scene


def checkerboard(samples: int) -> Scene:
    """Cubes of four samples, alternately 0 and 1 (Kim, Wittenbrink, Pang 2000): edges everywhere."""
    k, j, i = np.indices((samples,) * 3) // 4
    return _seen(((i + j + k) % 2).astype(np.float32))


def ramp(samples: int) -> Scene:
    """Values rising along x from 0 to 1 (Kim, Wittenbrink, Pang 2000): what is left is the integration's own error."""
    along = (np.arange(samples, dtype=np.float32) + 0.5) / samples
    return _seen(np.broadcast_to(along, (samples,) * 3))


def _seen(values: np.ndarray) -> Scene:
    samples = values.shape[0]
    volume = Volume(values, name=f"{samples}³")
    at, colors, extinctions = zip(*_LINEAR, strict=True)
    transfer = TransferFunction(np.array(at), np.array(colors), np.array(extinctions) * 64 / samples)
    camera = Camera.framing(volume, eye=volume.centre - VIEW * samples * 2, target=volume.centre)
    return replace(Scene(volume, transfer, camera), classification="post")
