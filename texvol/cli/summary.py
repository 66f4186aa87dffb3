"""Sentences at the end of `texvol render`: what was drawn, in which look and why, with which error, in how long."""

from __future__ import annotations

import time

from texvol.options.scene_options import SceneOptions
from texvol.rendering.default_rate import LIMIT
from texvol.scene.kinds import kind_of
from texvol.scene.scene import Scene
from texvol.util.upward import upward


def reasons(options: SceneOptions, scene: Scene) -> list[str]:
    """Return why the scene has its look, if nobody asked for one."""
    look = options.look
    if look is None or not look.reason or scene.mode != "composite":
        return []
    advice = "--no-labels draws them as values" if look.name == "labels" else "--tf chooses another"
    return [f"{kind_of(scene.volume).name}, since {look.reason}: look {look.name} ({advice})"]


def summary(
    options: SceneOptions,
    scene: Scene,
    path: str,
    error: float | None,
    start: float,
    *,
    of: str = "",
    by_default: bool = True,
) -> str:
    """Return what was drawn, in which look, with which estimated error, and in how long since `start`.

    `of` names the picture of a sequence that the error is of. `by_default` is True if no option decides the accuracy:
    an error above the limit of the default rate then comes with the option that lowers it.
    """
    width, height = options.size
    shown = f"mode {scene.mode}"
    if scene.mode == "composite" and options.look is not None:
        light = "unlit" if scene.lighting is None else "lit"
        shown = f"look {options.look.name}, {light}"
    accuracy = "error not estimated" if error is None else f"estimated error {upward(error)}"
    if error is not None and of:
        accuracy += f" of the {of}"
    if by_default and error is not None and error > LIMIT:
        accuracy += f" (more slabs take longer: --max-error {LIMIT:.2g})"
    return f"{path}: {options.volume}, {width}x{height}, {shown}, {accuracy}, {time.perf_counter() - start:.1f} s"
