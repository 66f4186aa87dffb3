"""What leaps over empty space and the early end of rays save, and what they change in the picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_scenes import FILES, SIZE, built_in, real
from benchmark_timing import Run, columns, frame_seconds, heading, in_turns, milliseconds, row
from numpy.typing import NDArray

from texvol import Renderer, Scene
from texvol.rendering.settings import DEFAULT_EARLY_TERMINATION

_RATE = 1.0


def empty(run: Run) -> None:
    """Print the section on empty space."""
    heading(
        "Empty space",
        "512×512, one sample per voxel; the same with leaps over what is empty and without. Samples are shares of "
        "those that the rays cross in the box.",
    )
    columns("scene", "classification", "samples", "ms with leaps", "without", "ratio", "largest difference")
    for name, scene in real_scenes(run.data, None):
        for classification in ("slab", "post"):
            _empty_row(run, name, _classified(scene, classification))
    for name in ("bone", "balls"):
        scene = built_in(name, 128 if run.quick else 256)
        _empty_row(run, f"{scene.volume.name} {name}", _classified(scene, "post"))


def _empty_row(run: Run, name: str, scene: Scene) -> None:
    with Renderer() as renderer:
        pictures, samples, total = {}, {}, 1
        for skips in (True, False):
            pictures[skips] = renderer.render(scene, SIZE, sampling_rate=_RATE, skip_empty=skips)
            metadata = renderer.stats
            samples[skips], total = metadata["samples"], metadata["samples_total"]
        times = in_turns(
            {skips: _frame(renderer, scene, sampling_rate=_RATE, skip_empty=skips) for skips in (True, False)},
            run.rounds,
        )
    row(
        name,
        scene.classification,
        f"{100 * samples[True] / total:.0f}% ({100 * samples[False] / total:.0f}% without)",
        milliseconds(times[True]),
        milliseconds(times[False]),
        f"{times[False] / times[True]:.2f}",
        _largest(pictures[True], pictures[False]),
    )


def opaque(run: Run) -> None:
    """Print the section on early termination."""
    heading(
        "Opaque matter",
        "512×512, one sample per voxel; a ray ends where it lets no more than this share of light through. Times in "
        "ms, and the largest difference from the picture whose rays go to the end.",
    )
    columns(
        "scene",
        "classification",
        "never",
        "default, 2⁻²²",
        "gain",
        "difference",
        "1/1024",
        "gain",
        "difference",
    )
    scenes = [(name, scene) for name, scene in real_scenes(run.data, "solid") if name.startswith("engine")]
    built = built_in("dense", 128 if run.quick else 256)
    for name, scene in [*scenes, (f"{built.volume.name} dense", built)]:
        for classification in ("slab", "post"):
            _opaque_row(run, name, _classified(scene, classification))


def _opaque_row(run: Run, name: str, scene: Scene) -> None:
    ends = (0.0, DEFAULT_EARLY_TERMINATION, 1 / 1024)
    with Renderer() as renderer:
        pictures = {end: renderer.render(scene, SIZE, sampling_rate=_RATE, early_termination=end) for end in ends}
        times = in_turns(
            {end: _frame(renderer, scene, sampling_rate=_RATE, early_termination=end) for end in ends}, run.rounds
        )
    cells = [milliseconds(times[0.0])]
    for end in ends[1:]:
        cells += [milliseconds(times[end]), f"{times[0.0] / times[end]:.2f}", _largest(pictures[end], pictures[0.0])]
    row(name, scene.classification, *cells)


def real_scenes(data: Path, preset: str | None) -> list[tuple[str, Scene]]:
    """Names and scenes of the real volumes that are there."""
    found = []
    for file in FILES:
        scene = real(file, data, preset)
        if scene is not None:
            found.append((f"{file.name}, {preset or file.preset or '(proposed)'}", scene))
    return found


def _classified(scene: Scene, classification: str) -> Scene:
    return replace(scene, classification=classification)  # type: ignore[arg-type]


def _frame(renderer: Renderer, scene: Scene, **accuracy: Any) -> Any:
    return lambda: frame_seconds(renderer, scene, SIZE, **accuracy)


def _largest(picture: NDArray[np.float32], other: NDArray[np.float32]) -> str:
    return f"{np.abs(picture.astype(np.float64) - other).max():.1e}"
