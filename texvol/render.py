"""The method, on one screen.

    volume + transfer function + slab thickness ─► texture:     colour and opacity of a slab, in 3D
    volume + camera + slab thickness            ─► slab stacks: view-aligned polygons, front to back
    texture + slab stacks + camera              ─► picture:     drawn, composited, read back

after Wilson, Van Gelder, Wilhelms (1994): classify once, integrate over a slab, draw textured polygons, composite.
`Renderer` (renderer.py) goes through these steps, and keeps between pictures what they have in common.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol import slab_texture, slicing, value_texture
from texvol.camera import Camera
from texvol.compositor import BakedTexture, Compositor, DeviceTexture
from texvol.scene import Scene
from texvol.transfer import TransferFunction
from texvol.volume import Volume


def render(
    scene: Scene, size: tuple[int, int] = (512, 512), *, backend: str = "auto", **accuracy: Any
) -> NDArray[np.float32]:
    """The scene's picture, from a renderer of its own; arguments as for `Renderer.render`."""
    from texvol.renderer import Renderer

    with Renderer(backend) as renderer:
        return renderer.render(scene, size, **accuracy)


def bake(scene: Scene, transfer_function: TransferFunction, slab_thickness: float, texel_format: str) -> BakedTexture:
    """Classify the volume and integrate over a slab; or leave the values, to be classified when they are drawn."""
    if scene.classification in ("post", "integrated"):
        return value_texture.bake_values(scene.volume, transfer_function, scene.classification)
    return slab_texture.bake(scene.volume, transfer_function, scene.classification, slab_thickness, texel_format)


def draw(
    compositor: Compositor,
    texture: DeviceTexture,
    volume: Volume,
    camera: Camera,
    slab_thickness: float,
    size: tuple[int, int],
    target_format: str,
    color_scale: float,
) -> int:
    """Cut the box into slabs across the view, draw and composite them; the number of slabs."""
    stacks = slicing.slab_stacks(volume, camera, slab_thickness, size)
    compositor.draw(texture, stacks, volume, camera, size, target_format, color_scale)
    compositor.finish()
    return stacks.slab_count


def over_background(picture: NDArray[np.float32], background: tuple[float, float, float]) -> NDArray[np.float32]:
    """The picture over light from behind, which enters as (1 - opacity) times itself; opacity stays."""
    if any(background):
        picture[..., :3] += (1 - picture[..., 3:]) * np.asarray(background, np.float32)
    return picture
