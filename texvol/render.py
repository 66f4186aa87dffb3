"""The method, on one screen.

    volume + transfer function + slab thickness ─► texture:     colour and opacity of a slab, in 3D
    volume + camera + slab thickness            ─► slab stacks: view-aligned polygons, front to back
    texture + slab stacks + camera              ─► picture:     drawn, composited, read back

for a volume that is too large for one texture brick by brick, in visibility order

after Wilson, Van Gelder, Wilhelms (1994): classify once, integrate over a slab, draw textured polygons, composite.
`Renderer` (renderer.py) goes through these steps, and keeps between pictures what they have in common.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol import bricks, slab_texture, slicing, value_texture
from texvol.camera import Camera
from texvol.compositor import Compositor, Drawing
from texvol.scene import Scene
from texvol.shaded_samples import Arriving, matter_of_samples
from texvol.texture_store import BakedTexture, TextureStore
from texvol.transfer import TransferFunction

VisiblePart = Callable[[bricks.Brick], "NDArray[np.float64] | None"]  # its corners in shares of the box; None: nothing


def render(
    scene: Scene, size: tuple[int, int] = (512, 512), *, backend: str = "auto", **accuracy: Any
) -> NDArray[np.float32]:
    """The scene's picture, from a renderer of its own; arguments as for `Renderer.render`."""
    from texvol.renderer import Renderer

    with Renderer(backend) as renderer:
        return renderer.render(scene, size, **accuracy)


def bake(
    scene: Scene,
    transfer_function: TransferFunction,
    camera: Camera,
    slab_thickness: float,
    texel_format: str,
    arriving: Arriving | None = None,
) -> BakedTexture:
    """Classify the volume and integrate over a slab; or leave the values, to be classified when they are drawn.

    `arriving` is what shadows leave of the lights.
    """
    volume, classification = scene.volume, scene.classification
    if classification in ("post", "integrated"):
        estimator = scene.gradient if scene.needs_gradient else None
        return value_texture.bake_values(volume, transfer_function, classification, texel_format, estimator)
    recipe = volume, transfer_function, classification, slab_thickness, texel_format
    if not scene.needs_gradient:
        return slab_texture.bake(*recipe)
    samples = partial(matter_of_samples, scene, transfer_function, camera, arriving)
    return slab_texture.bake(*recipe, samples, scene.lighting)


def draw(
    compositor: Compositor,
    textures: TextureStore,
    drawing: Drawing,
    target_format: str,
    visible_part: VisiblePart,
) -> int:
    """Cut what of the bricks shows anything into slabs across the view, draw and composite them; their number."""
    compositor.begin(drawing, target_format)
    volume, camera = drawing.volume, drawing.camera
    per_stack = drawing.baked.slabs_per_stack
    parts = {brick: part for brick in textures.bricks if (part := visible_part(brick)) is not None}
    # Surfaces cut the rays into stretches, and stand between one and the next.
    for stretch in drawing.surfaces.stretches(drawing, compositor) if drawing.surfaces else (drawing,):
        for brick in bricks.visibility_order(parts, volume, camera):
            stacks = slicing.slab_stacks(volume, camera, drawing.slab_thickness, drawing.size, per_stack, parts[brick])
            compositor.draw(stretch, brick, stacks, textures.resources(brick))
    compositor.finish()
    return len(parts)


def over_background(picture: NDArray[np.float32], background: tuple[float, float, float]) -> NDArray[np.float32]:
    """The picture over light from behind, which enters as (1 - opacity) times itself; opacity stays."""
    if any(background):
        picture[..., :3] += (1 - picture[..., 3:]) * np.asarray(background, np.float32)
    return picture
