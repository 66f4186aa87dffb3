"""How times grow with the volume, and what comes before the first frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from statistics import median

import numpy as np
from benchmark_scenes import SIZE, Truths, built_in, rms
from benchmark_timing import Run, columns, frame_seconds, heading, in_turns, milliseconds, row, seconds_of

from texvol import Renderer, Scene, TransferFunction
from texvol.scene.scene import Classification

_WANTED = 1e-3
_COARSEST, _FINEST = 2.0**-5, 8.0
_BAKED: tuple[Classification, ...] = ("slab", "post")


def growth(run: Run) -> None:
    """Print the section on larger volumes."""
    sizes = (64, 128, 256) if run.quick else (128, 256, 512)
    heading(
        "Larger volumes",
        f"Warm frames of the same picture, 512×512, `post`, from n³ samples. For an rms error of {_WANTED:g} the "
        "coarsest rate that is within. Growth is the time over that of the smallest; the rays' way in voxels grows as "
        "n does.",
    )
    columns("scene", "n", "rate", "samples", "ms", "growth", "growth of n")
    truths = Truths(run.folder)

    def for_error(scene: Scene) -> float:
        return coarsest_rate(scene, truths, _WANTED)

    _grow(run, f"fog, rms {_WANTED:g}", "fog", sizes, for_error)
    _grow(run, "fog, fixed rate", "fog", sizes, lambda scene: 1.0)
    _grow(run, f"balls in empty space, rms {_WANTED:g}", "balls", sizes, for_error)
    _grow(run, "balls in empty space, fixed rate", "balls", sizes, lambda scene: 1.0)


def _grow(run: Run, name: str, built: str, sizes: tuple[int, ...], rate_for: Callable[[Scene], float]) -> None:
    scenes = {samples: built_in(built, samples) for samples in sizes}
    rates = {samples: rate_for(scene) for samples, scene in scenes.items()}
    renderers = {samples: Renderer() for samples in sizes}

    def frame_of(samples: int) -> Callable[[], float]:
        return lambda: frame_seconds(renderers[samples], scenes[samples], SIZE, sampling_rate=rates[samples])

    try:
        times = in_turns({samples: frame_of(samples) for samples in sizes}, run.rounds)
        drawn = {samples: renderers[samples].stats["samples"] for samples in sizes}
    finally:
        for renderer in renderers.values():
            renderer.close()
    first = sizes[0]
    for samples in sizes:
        millions = f"{drawn[samples] / 1e6:.1f} M"
        grown = f"{times[samples] / times[first]:.2f}"
        row(name, samples, f"{rates[samples]:.3g}", millions, milliseconds(times[samples]), grown, samples / first)


def coarsest_rate(scene: Scene, truths: Truths, wanted: float) -> float:
    """The coarsest of rates by √2 whose rms error is at most `wanted`; the finest, if there is none."""
    truth, rate = truths.of(scene), _COARSEST
    with Renderer() as renderer:
        while rate < _FINEST and rms(renderer.render(scene, SIZE, sampling_rate=rate), truth) > wanted:
            rate *= float(np.sqrt(2))
    return rate


def bake(run: Run) -> None:
    """Print the section on first frames and new transfer functions."""
    samples = 128 if run.quick else 256
    heading(
        "Before the first frame",
        f"{samples}³, one sample per voxel, 512×512; milliseconds. The first picture of a fresh renderer in a process "
        "that has drawn before; then the next, from the call on, after each of two new transfer functions for the same "
        "volume: one of as many control points, and one of a point more. Drawing is in the pictures' times; what it "
        "takes alone is the last column.",
    )
    columns(
        *("values", "classification", "first: bake + upload", "picture", "new function: bake + upload", "picture"),
        *("a point more: bake + upload", "picture", "warm frame"),
    )
    with Renderer() as renderer:
        for classification in _BAKED:  # compiles what there is to compile
            renderer.render(replace(built_in("fog", 32), classification=classification), SIZE)
    for dtype in ("uint8", "uint16", "float32"):
        for classification in _BAKED:
            scene = replace(built_in("bone", samples, dtype), classification=classification)
            row(dtype, classification, *_bake_times(run, scene))


def _bake_times(run: Run, scene: Scene) -> list[str]:
    function = scene.transfer_function
    assert function is not None
    functions = {"first": function, "new": altered(function), "more": with_a_point_more(function)}
    found: dict[str, list[float]] = {}
    for _ in range(run.rounds):
        with Renderer() as renderer:
            for name, chosen in functions.items():
                asked = replace(scene, transfer_function=chosen)
                whole = seconds_of(partial(renderer.render, asked, SIZE))
                spent = renderer.seconds.get("bake", 0.0) + renderer.seconds.get("upload", 0.0)
                found.setdefault(name, []).append(spent)
                found.setdefault(f"{name}, whole", []).append(whole)
            found.setdefault("warm", []).append(frame_seconds(renderer, asked, SIZE))
    return [milliseconds(median(each)) for each in found.values()]


def altered(function: TransferFunction) -> TransferFunction:
    """Other numbers at the same values: nothing is shown that wasn't, nothing hidden that was."""
    return TransferFunction(function.values, function.colors[:, ::-1], 0.9 * function.extinctions)


def with_a_point_more(function: TransferFunction) -> TransferFunction:
    """A control point in the middle of the last segment, off its line."""
    value = (function.values[-2] + function.values[-1]) / 2
    return TransferFunction(
        np.insert(function.values, -1, value),
        np.insert(function.colors, -1, 0.9 * function.colors[-1], axis=0),
        np.insert(function.extinctions, -1, 1.1 * function.extinctions[-1]),
    )
