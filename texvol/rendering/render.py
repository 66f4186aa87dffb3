"""The method, on one screen: bake → slice → draw → read.

    volume + transfer function + slab thickness ─► bake:  texture with the colour and opacity of a slab, in 3D
    box + camera + slab thickness               ─► slice: slab stacks, view-aligned polygons from front to back
    texture + slab stacks + camera              ─► draw:  fetched and composited on the device
    target on the device                        ─► read:  picture (height, width, 4), premultiplied, linear

after Wilson, Van Gelder and Wilhelms (1994): classify once, integrate over a slab, draw textured polygons, composite
with *over*. A volume that is too large for one texture is drawn brick by brick, in visibility order; several volumes
are drawn at once. `Renderer` (renderer.py) goes through these steps and keeps what pictures have in common.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.drawing import Drawing
from texvol.opengl.texture_store import BakedTexture
from texvol.scene.added_volume import common_box
from texvol.scene.scene import CompleteScene
from texvol.slicing import bricks
from texvol.slicing.slabs import MOST_SLABS, WHOLE_BOX, SlabStacks, slab_stacks
from texvol.textures import slab_texture, value_texture
from texvol.textures.shaded_samples import LightTransmittance, medium_of_samples, needs_samples
from texvol.textures.value_storage import features_about

if TYPE_CHECKING:
    from texvol.opengl.surfaces.surfaces import Surfaces


def bake(
    scene: CompleteScene,
    slab_thickness: float,
    texel_format: str,
    light_transmittance: LightTransmittance | None = None,
    whole_slabs: bool = False,
) -> BakedTexture:
    """Classify the samples and integrate over a slab; or keep the values, to be classified when they are drawn.

    Parameters
    ----------
    scene : CompleteScene
        Scene of one volume.
    slab_thickness : float
        World units.
    light_transmittance : array, optional
        Transmittance from the nodes of the box to each light that casts shadows.
    whole_slabs : bool
        True if texels of `slab` stand for all of a slab, however dense it is.
    """
    volume, transfer_function, classification = scene.volume, scene.medium, scene.classification
    if classification in ("post", "integrated"):
        estimator = scene.gradient if scene.needs_gradient else None
        features = None if scene.mode == "composite" else features_about(volume, scene.isovalues)
        how = classification, texel_format, estimator, scene.mask, features
        return value_texture.bake_values(volume, transfer_function, *how)
    recipe = volume, transfer_function, classification, slab_thickness, texel_format
    if not needs_samples(scene):
        hidden = scene.mask.hidden if scene.mask else None
        return slab_texture.bake(*recipe, hidden=hidden, whole_slabs=whole_slabs)
    samples = partial(medium_of_samples, scene, light_transmittance)
    return slab_texture.bake(*recipe, samples, scene.lighting, whole_slabs=whole_slabs)


def slices(drawing: Drawing, part: NDArray[np.float64]) -> SlabStacks:
    """Cut the visible part of a brick of the only volume into slab stacks; polygons have one for all slabs."""
    view, drawn = drawing.view, drawing.first
    per_stack = drawn.baked.slabs_per_stack if drawing.slicing == "stacks" else 2 * MOST_SLABS
    return slab_stacks(drawn.volume, view.camera, view.slab_thickness, view.size, per_stack, part)


def draw_brick(compositor: Compositor, drawing: Drawing, brick: bricks.Brick, part: NDArray[np.float64]) -> None:
    """Slice a brick of the only volume and draw it; `part` is what it shows, in fractions of the box, shape (2, 3)."""
    slabs = slices(drawing, part)
    if drawing.slicing == "wilson":
        from texvol.opengl import wilson

        wilson.draw(compositor, drawing, brick, part, slabs)
    elif drawing.slicing == "polygons":
        from texvol.opengl import polygons

        polygons.draw(compositor, drawing, brick, part, slabs)
    else:
        compositor.draw(drawing, brick, slabs)


def draw_together(
    compositor: Compositor, drawing: Drawing, of_each: Sequence[bricks.Brick], part: NDArray[np.float64]
) -> None:
    """Draw a brick of each volume in slab stacks that all of them have in common.

    `part` is the part of the drawing's frame, or else of the box around all volumes, that shows anything, in fractions
    of that box, shape (2, 3).
    """
    from texvol.opengl.several import draw_several

    view, count = drawing.view, len(drawing.volumes)
    # The loops of a shader are limited: in each slab there is at most one piece for each end of each box.
    per_stack = max(min(drawn.baked.slabs_per_stack for drawn in drawing.volumes) // (2 * count), 1)
    box = drawing.frame or common_box([drawn.volume for drawn in drawing.volumes])
    stacks = slab_stacks(box, view.camera, view.slab_thickness, view.size, per_stack, part, view.origin)
    draw_several(compositor, drawing, of_each, stacks)


def draw(compositor: Compositor, drawing: Drawing, surfaces: Surfaces | None, target_format: str) -> int:
    """Slice what may show anything, draw and composite it; return the number of bricks that were drawn."""
    compositor.begin(drawing, target_format)
    drawn = drawing.first
    shown = {brick: part for brick in drawn.textures.bricks if (part := _shown(drawing, brick)) is not None}
    # Surfaces cut the rays into intervals, and are composited between one interval and the next.
    for interval in surfaces.intervals(drawing, compositor) if surfaces else (drawing,):
        if len(drawing.volumes) > 1:
            whole = [each.textures.bricks[0] for each in drawing.volumes]
            draw_together(compositor, interval, whole, WHOLE_BOX)
            continue
        for brick in bricks.visibility_order(shown, drawn.volume, drawing.view.camera):
            # Labels change between samples: the program for several volumes cuts rays where they do.
            if drawn.volume.nearest:
                draw_together(compositor, interval, [brick], shown[brick])
            else:
                draw_brick(compositor, interval, brick, shown[brick])
    compositor.finish()
    return len(shown) if len(drawing.volumes) == 1 else len(drawing.volumes)


def _shown(drawing: Drawing, brick: bricks.Brick) -> NDArray[np.float64] | None:
    """Return what a brick shows in the block that is drawn, shape (2, 3); None if that is nothing."""
    drawn, view = drawing.first, drawing.view
    part = drawn.visible_part(brick)
    if part is None or drawing.block is None:
        return part
    low, high = drawing.own_range(brick)
    if (low >= high).any():
        return None
    # A slab whose middle lies in the block reaches beyond it.
    reach = np.array(bricks.margin(drawn.volume, view.camera, view.size, view.slab_thickness)) / drawn.volume.dimensions
    part = np.array([np.maximum(part[0], low - reach), np.minimum(part[1], high + reach)])
    return part if (part[0] < part[1]).all() else None


def read(compositor: Compositor, drawing: Drawing) -> NDArray[np.float32]:
    """Read the picture back, (height, width, 4), without background; of a projection its numbers."""
    picture = compositor.picture(drawing.color_scale)
    if drawing.projection is None:
        return picture
    assert isinstance(drawing.first.baked, value_texture.ValueTexture), "only values are projected"
    return drawing.projection.numbers(picture, drawing.first.baked, drawing.view.slab_thickness)


def over_background(picture: NDArray[np.float32], background: tuple[float, float, float]) -> NDArray[np.float32]:
    """Composite the picture, in place, over light from behind; its opacity stays."""
    if any(background):
        picture[..., :3] += (1 - picture[..., 3:]) * np.asarray(background, np.float32)
    return picture
