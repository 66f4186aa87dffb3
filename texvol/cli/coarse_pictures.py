"""Coarse pictures of `texvol render --progressive` that are written before the one asked for, and `--plan`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from texvol.formats.pictures import image
from texvol.util import writing
from texvol.util.terminal import say

if TYPE_CHECKING:
    from texvol.options.scene_options import SceneOptions
    from texvol.output.export import PictureExport
    from texvol.rendering.renderer import Renderer
    from texvol.scene.scene import Scene


def planned(scene: Scene, size: tuple[int, int], accuracy: dict[str, Any]) -> str:
    """Return what a picture would take, in lines; raises as `texvol.rendering.streaming.plan.plan`."""
    from texvol.rendering.streaming.plan import plan

    names = ("slab_thickness", "sampling_rate", "max_error", "level_error")
    level = {"level": accuracy["level"]} if "level" in accuracy else {}
    return plan(scene, size, **{name: accuracy[name] for name in names}, **level).text


def show_coarse_pictures(
    renderer: Renderer,
    scene: Scene,
    arguments: argparse.Namespace,
    export: PictureExport,
    scene_options: SceneOptions,
    accuracy: dict[str, Any],
) -> None:
    """Write pictures from coarse to fine, each in place of the one before it, but for the last; say what each is."""
    from texvol.rendering.streaming.progressive import coarse_pictures

    for stage in coarse_pictures(renderer, scene, scene_options.size, accuracy):
        shown = export.of(stage.picture, scene, arguments.output)
        metadata = renderer.attributes | {"texvol:stage": stage.sentence}
        transparent = scene_options.transparent
        content = image.encoded(arguments.output, shown, metadata, transparent=transparent, quick=True)
        writing.write_files({arguments.output: content})
        say(f"{arguments.output}: {stage.sentence}")
