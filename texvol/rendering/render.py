"""The method, on one screen.

    volume + transfer function + slab thickness ─► texture:     colour and opacity of a slab, in 3D
    volume + camera + slab thickness            ─► slab stacks: view-aligned polygons, front to back
    texture + slab stacks + camera              ─► picture:     drawn, composited, read back

for a volume that is too large for one texture brick by brick, in visibility order; for several volumes all at once

after Wilson, Van Gelder, Wilhelms (1994): classify once, integrate over a slab, draw textured polygons, composite.
`Renderer` (renderer.py) goes through these steps, and keeps between pictures what they have in common.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor, Drawing, Interval
from texvol.opengl.texture_store import BakedTexture, TextureStore
from texvol.scene.added_volume import common_box
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.slicing import bricks
from texvol.slicing import slabs as slicing
from texvol.textures import slab_texture, value_texture
from texvol.textures.shaded_samples import LightTransmittance, medium_of_samples, needs_samples
from texvol.textures.value_storage import features_about

VisiblePart = Callable[[bricks.Brick], "NDArray[np.float64] | None"]  # its corners in shares of the box; None: nothing


def render(
    scene: Scene, size: tuple[int, int] = (512, 512), *, backend: str = "auto", **accuracy: Any
) -> NDArray[np.float32]:
    """The scene's picture, from a renderer of its own; arguments as for `Renderer.render`."""
    from texvol.rendering.renderer import Renderer

    with Renderer(backend) as renderer:
        return renderer.render(scene, size, **accuracy)


def bake(
    scene: Scene,
    transfer_function: TransferFunction,
    camera: Camera,
    slab_thickness: float,
    texel_format: str,
    light_transmittance: LightTransmittance | None = None,
) -> BakedTexture:
    """Classify the volume and integrate over a slab; or leave the values, to be classified when they are drawn.

    `arriving` is what shadows leave of the lights.
    """
    volume, classification = scene.volume, scene.classification
    if classification in ("post", "integrated"):
        estimator = scene.gradient if scene.needs_gradient else None
        features = None if scene.mode == "composite" else features_about(volume, scene.isovalue)
        how = classification, texel_format, estimator, scene.mask, features
        return value_texture.bake_values(volume, transfer_function, *how)
    recipe = volume, transfer_function, classification, slab_thickness, texel_format
    if not needs_samples(scene, transfer_function):
        return slab_texture.bake(*recipe, hidden=scene.mask.hidden if scene.mask else None)
    samples = partial(medium_of_samples, scene, transfer_function, camera, light_transmittance)
    return slab_texture.bake(*recipe, samples, scene.lighting)


class Part(NamedTuple):
    """One volume of a picture: how it is drawn, its textures, and what of a brick may show anything."""

    drawing: Drawing
    textures: TextureStore
    visible_part: VisiblePart

    def counting(self) -> Part:
        """The same, but what is drawn is how many slabs are sampled."""
        return self._replace(drawing=replace(self.drawing, count=True))


def draw(compositor: Compositor, parts: Sequence[Part], target_format: str) -> int:
    """Cut what of the bricks shows anything into slabs across the view, draw and composite them; their number."""
    drawing, textures, visible_part = parts[0]
    compositor.begin(drawing, target_format)
    volume, camera = drawing.volume, drawing.camera
    per_stack = drawing.baked.slabs_per_stack
    shown = {brick: part for brick in textures.bricks if (part := visible_part(brick)) is not None}
    # Surfaces cut the rays into stretches, and stand between one and the next.
    for interval in drawing.surfaces.intervals(drawing, compositor) if drawing.surfaces else (drawing,):
        if len(parts) > 1:
            draw_together(compositor, parts, [part.textures.bricks[0] for part in parts], interval.interval)
            continue
        for brick in bricks.visibility_order(shown, volume, camera):
            # Labels change from sample to sample: their rays are cut where they do, which is done where rays are cut
            # anyway.
            if volume.labels:
                draw_together(compositor, parts, [brick], interval.interval, shown[brick])
                continue
            stacks = slicing.slab_stacks(volume, camera, drawing.slab_thickness, drawing.size, per_stack, shown[brick])
            compositor.draw(interval, brick, stacks, textures.resources(brick))
    compositor.finish()
    return len(shown) if len(parts) == 1 else len(parts)


def draw_together(
    compositor: Compositor,
    parts: Sequence[Part],
    of_each: Sequence[bricks.Brick],
    interval: Interval | None,
    shown: NDArray[np.float64] = slicing.WHOLE_BOX,
) -> None:
    """Draw several volumes in the slabs that all of them have in common, a brick of each.

    `shown` has the corners of what is to be seen, in shares of the box around all, shape (2, 3).
    """
    from texvol.opengl.several import draw_several

    drawings = [replace(part.drawing, interval=interval) for part in parts]
    first = drawings[0]
    # Loops are limited: a piece of a slab for each end of each box, at most.
    per_stack = max(min(drawing.baked.slabs_per_stack for drawing in drawings) // (2 * len(parts)), 1)
    box = common_box([drawing.volume for drawing in drawings])
    stacks = slicing.slab_stacks(box, first.camera, first.slab_thickness, first.size, per_stack, shown, first.about)
    resources = [part.textures.resources(brick) for part, brick in zip(parts, of_each, strict=True)]
    draw_several(compositor, drawings, of_each, stacks, resources)


def over_background(picture: NDArray[np.float32], background: tuple[float, float, float]) -> NDArray[np.float32]:
    """The picture over light from behind, which enters as (1 - opacity) times itself; opacity stays."""
    if any(background):
        picture[..., :3] += (1 - picture[..., 3:]) * np.asarray(background, np.float32)
    return picture
