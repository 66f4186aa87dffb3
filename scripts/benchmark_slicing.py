"""Time and error of the three ways in which slabs are drawn: stacks, polygons, and Wilson's polygons."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from benchmark_scenes import FILES, SIZE, File, built_in, real, rms
from benchmark_timing import Run, columns, frame_seconds, heading, in_turns, milliseconds, row
from numpy.typing import NDArray

from texvol import Renderer, Scene
from texvol.ray_casting import raycast
from texvol.slicing.slabs import SLICINGS

RATES = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
_TARGETS = ("rgba32f", "rgba8")
_HYDROGEN = File("hydrogen", "hydrogen/hydrogen.vti", None)
_TRUTH = (128, 128)


def slicing(run: Run) -> None:
    """Print the section on slicing."""
    heading(
        "Slicing",
        "512×512, classification `slab`, float32 texels: ms of a warm frame, and rms error from the exact integral of "
        "the same medium (of a picture of 128×128). A stack is a run of up to 2048 slabs, drawn by one polygon.",
    )
    columns("scene", "target", "slabs per voxel", *(f"`{each}` {what}" for each in SLICINGS for what in ("ms", "rms")))
    for name, scene in scenes(run):
        truth = raycast(scene, _TRUTH)
        with Renderer() as renderer:
            for target in _TARGETS:
                for rate in (1.0, 8.0) if run.quick else RATES:
                    cells = measured(renderer, scene, truth, rate, target, run.rounds)
                    row(name, target, f"{rate:g}", *cells)


def scenes(run: Run) -> Iterator[tuple[str, Scene]]:
    """Yield the names and scenes: fog, bone, and an engine and an orbital where the files are there."""
    samples = 64 if run.quick else 256
    for name in ("fog", "bone"):
        yield f"{samples}³ {name}", replace(built_in(name, samples), classification="slab")
    for file in (FILES[0], _HYDROGEN):
        scene = real(file, run.data)
        if scene is not None:
            yield file.name, replace(scene, classification="slab")


def measured(
    renderer: Renderer, scene: Scene, truth: NDArray[np.float64], rate: float, target: str, rounds: int
) -> list[str]:
    """Time and error of each way."""
    how: dict[str, dict[str, Any]] = {
        each: {"sampling_rate": rate, "texture_format": "rgba32f", "target_format": target, "slicing": each}
        for each in SLICINGS
    }
    errors = {each: rms(renderer.render(scene, _TRUTH, **arguments), truth) for each, arguments in how.items()}
    times = in_turns(
        {
            each: lambda arguments=arguments: frame_seconds(renderer, scene, SIZE, **arguments)  # type: ignore[misc]
            for each, arguments in how.items()
        },
        rounds,
    )
    return [text for each in SLICINGS for text in (milliseconds(times[each]), f"{errors[each]:.1e}")]
