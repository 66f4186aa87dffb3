"""What a sample costs beside a bare fetch, and where the time of a frame goes."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from benchmark_fetch import PlainFetch
from benchmark_scenes import SIZE, built_in
from benchmark_timing import Run, columns, frame_seconds, heading, in_turns, milliseconds, row

from texvol import Renderer, Scene

CLASSIFICATIONS = ("slab", "extinction", "post", "integrated")
# `integrated` has a fetch in the middle of a slab and one behind it.
FETCHES = {"slab": 1, "extinction": 1, "post": 1, "integrated": 2}
_EVERY_SAMPLE: dict[str, Any] = {"skip_empty": False, "early_termination": 0.0}
_HARDLY_ANY = 1 / 1000  # samples per voxel: a slab is as thick as the box


def samples(run: Run) -> None:
    """Print the section on the cost of a sample."""
    count = 128 if run.quick else 256
    heading(
        "What a sample costs",
        f"{count}³ float32, bone, 512×512; nothing is skipped, no ray ends early. A whole frame, drawn and read back, "
        "over the slabs that its rays cross; beside it a shader that only fetches from the same texture along the same "
        "rays, as often (`integrated` has two fetches in a slab).",
    )
    columns("classification", "projection", "rate", "texels", "ns a sample", "ns its fetches", "ratio")
    for classification in CLASSIFICATIONS:
        for projection in ("orthographic", "perspective"):
            scene = replace(built_in("bone", count, projection=projection), classification=classification)
            with Renderer() as renderer:
                for rate in (1.0, 2.0):
                    _sample_row(run, renderer, scene, rate)


def _sample_row(run: Run, renderer: Renderer, scene: Scene, rate: float) -> None:
    classification = scene.classification
    renderer.render(scene, SIZE, sampling_rate=rate, **_EVERY_SAMPLE)
    metadata = renderer.stats
    drawn, texel_format = metadata["samples"], metadata["texture_format"]
    thickness = metadata["slab_thickness"]
    with PlainFetch(scene, thickness, texel_format, SIZE) as fetch:
        times = in_turns(
            {
                "frame": lambda: frame_seconds(renderer, scene, SIZE, sampling_rate=rate, **_EVERY_SAMPLE),
                "fetch": lambda: fetch.seconds(thickness / FETCHES[classification]),
            },
            run.rounds,
        )
    each, bare = (1e9 * times[name] / drawn for name in ("frame", "fetch"))
    camera = scene.completed(SIZE).camera
    row(
        classification,
        camera.projection,
        f"{rate:g}",
        texel_format,
        f"{each:.2f}",
        f"{bare:.2f}",
        f"{each / bare:.2f}",
    )


def profile(run: Run) -> None:
    """Print the section on where the time goes."""
    count = 128 if run.quick else 256
    heading(
        "Where the time of a frame goes",
        f"{count}³ float32, fog, 512×512, one sample per voxel, nothing skipped: shares of a warm `render`. Rays and "
        "blending are a frame of one slab; fetching is the bare shader, less its own frame of one slab; classifying "
        "and compositing are the rest of the drawing.",
    )
    columns("classification", "ms", "rays, blending", "fetching", "classifying, compositing", "read-back", "Python")
    for classification in ("slab", "post"):
        scene = replace(built_in("fog", count), classification=classification)  # type: ignore[arg-type]
        row(classification, *_fractions(run, scene))


def _fractions(run: Run, scene: Scene) -> list[str]:
    seen: dict[str, float] = {}
    spacing = scene.volume.smallest_spacing

    with Renderer() as renderer, Renderer() as setting_up:
        renderer.render(scene, SIZE, **_EVERY_SAMPLE)
        texel_format = renderer.stats["texture_format"]

        def whole() -> float:
            start = time.perf_counter()
            renderer.render(scene, SIZE, **_EVERY_SAMPLE)
            seconds = time.perf_counter() - start
            seen.update(renderer.seconds)
            return seconds

        def python() -> float:
            start = time.perf_counter()
            renderer.render(scene, SIZE, **_EVERY_SAMPLE)
            parts = renderer.seconds
            return time.perf_counter() - start - parts["draw"] - parts["read"]

        def rays() -> float:
            setting_up.render(scene, SIZE, sampling_rate=_HARDLY_ANY, **_EVERY_SAMPLE)
            return setting_up.seconds["draw"]

        def fetching() -> float:
            return fetch.seconds(spacing) - fetch.seconds(2 * scene.volume.radius)

        def read() -> float:
            return seen["read"]

        with PlainFetch(scene, spacing, texel_format, SIZE) as fetch:
            parts = in_turns(
                {"whole": whole, "read": read, "python": python, "rays": rays, "fetching": fetching}, 2 * run.rounds
            )
    rest = parts["whole"] - sum(parts[name] for name in ("read", "python", "rays", "fetching"))
    fractions = (parts["rays"], parts["fetching"], rest, parts["read"], parts["python"])
    return [milliseconds(parts["whole"]), *(f"{100 * each / parts['whole']:.1f}%" for each in fractions)]
