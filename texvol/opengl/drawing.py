"""Description of a picture for the compositor: the view, the volumes on the device, and what all of them share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.projection import ValueProjection
from texvol.opengl.texture_store import BakedTexture
from texvol.opengl.value_bounds import ValueBounds
from texvol.scene.camera import Camera
from texvol.scene.cutting import NOT_CUT, Cutting
from texvol.scene.lighting import DepthCue, Lighting
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick

# Low and high corner of what a brick may show, in fractions of the box, shape (2, 3); None if it shows nothing.
VisiblePart = Callable[[Brick], "NDArray[np.float64] | None"]
AnyTexture = moderngl.Texture | moderngl.Texture3D


class Textures(Protocol):
    """Textures of the bricks of a volume."""

    def resources(self, brick: Brick) -> dict[str, AnyTexture]:
        """Return those of a brick by the names of their samplers; they are uploaded if they are not there."""

    @property
    def bricks(self) -> list[Brick]:
        """All bricks."""

    @property
    def bytes_of_all(self) -> int:
        """Bytes of the textures of all bricks together."""


@dataclass(frozen=True)
class View:
    """Rays and slabs of a picture."""

    camera: Camera
    size: tuple[int, int]  # width and height in pixels
    slab_thickness: float  # world units, plane to plane
    origin: NDArray[np.float64]  # world point at depth 0, where slab 0 begins

    @property
    def reference_depth(self) -> float:
        """Distance of the plane at depth 0 from that of the eye, world units."""
        return float(self.camera.forward @ (self.origin - self.camera.eye))


@dataclass(frozen=True)
class DrawnVolume:
    """One volume on the device."""

    volume: Volume
    baked: BakedTexture
    textures: Textures
    visible_part: VisiblePart
    skips: moderngl.Texture3D | None = None  # distances to the next change of occupancy; None where no cell is empty
    cells_per_box: tuple[float, float, float] = (1.0, 1.0, 1.0)  # number of these cells along x, y, z
    first_cell: tuple[float, float, float] = (0.0, 0.0, 0.0)  # where they begin, in cells from the corner of the box
    lighting: Lighting | None = None  # on a medium that the shader classifies; other texels are lit when baked
    light_transmittance: moderngl.Texture3D | None = None  # from the nodes of the box to each light that casts shadows
    bounds: ValueBounds | None = None  # of cells that a ray skips in modes mip and minip
    fetched: bool = False  # True if the shader interpolates texels, in place of the driver

    def samplers(self, brick: Brick) -> dict[str, AnyTexture]:
        """Return the textures of a brick by the names of their samplers; they are uploaded if they are not there."""
        own = {"skips": self.skips, "light_transmittance": self.light_transmittance}
        known = {name: texture for name, texture in own.items() if texture is not None}
        return self.textures.resources(brick) | known | (self.bounds.samplers if self.bounds else {})


@dataclass(frozen=True)
class Drawing:
    """All volumes of a picture, and what they have in common."""

    view: View
    volumes: tuple[DrawnVolume, ...]
    color_scale: float = 1.0  # factor of the colours in the target
    least_transmittance: float = 0.0  # a ray that lets this fraction or less of the light through ends
    cutting: Cutting = NOT_CUT
    depth_cue: DepthCue | None = None
    projection: ValueProjection | None = None  # drawn in place of the medium
    # Depths at which the drawn part of each ray begins and ends, by the names of their samplers; empty for whole rays.
    interval: dict[str, AnyTexture] = field(default_factory=dict)
    # Largest values that the rays have met before, by the name of the sampler; empty where nothing is known.
    known: dict[str, AnyTexture] = field(default_factory=dict)
    slicing: str = "stacks"
    least_divided: float | None = None  # optical depth from which on slabs are divided, see divided_slabs.glsl
    # Low and high corner of what is drawn, in fractions of the box of `frame`, shape (2, 3): slabs whose middles lie
    # there. None for everything.
    block: NDArray[np.float64] | None = None
    frame: Volume | None = None  # the first volume unless told; only several volumes have another one
    count: bool = False  # True if the number of sampled slabs is drawn in place of the colours

    @property
    def first(self) -> DrawnVolume:
        """The scene's own volume, to which others are added."""
        return self.volumes[0]

    def is_cut(self, brick: Brick) -> bool:
        """True if not all of the only volume is drawn with a brick."""
        return self.block is not None or not brick.is_whole

    def own_range(self, brick: Brick) -> NDArray[np.float64]:
        """Return the low and high corner of what is drawn with a brick of the only volume, shape (2, 3)."""
        low, high = brick.own_range
        if self.block is None:
            return brick.own_range
        return np.array([np.maximum(low, self.block[0]), np.minimum(high, self.block[1])])

    @property
    def is_perspective(self) -> bool:
        """True if the rays diverge."""
        return self.view.camera.projection == "perspective"
