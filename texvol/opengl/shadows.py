"""Shadows: how much of each light reaches the nodes of the box, see `texvol.scene.lighting`.

The rays from all nodes to a light are walked on the device, a pixel for each node, through the post-classified medium,
whatever the classification of the picture; bricks add up. What is found is kept until the medium or the lights change.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import Context
from texvol.opengl.filtering import COARSE, weights_error
from texvol.opengl.shaders import FOLDER, WHOLE_TARGET, Programs, bind, draw_triangles, release_target
from texvol.opengl.texture_store import TextureStore, same
from texvol.opengl.uniforms import NOTHING_SPECIAL, box_matrices, brick_uniforms, half_spaces_in_box
from texvol.scene.cutting import Cutting
from texvol.scene.lighting import SHADOW_NODES, Light, Lighting, casts_shadows, position_of, shadow_nodes, unit
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.textures.shaded_samples import LightTransmittance
from texvol.textures.value_texture import ValueTexture, bake_values
from texvol.util.errors import NoRoomError

_MOST_PARTS = 2048  # of a path through the box: more would take seconds
_MOST_ROWS = 8192  # of nodes that are drawn at once: as many as every device has in a target
_NODE_BYTES = 4  # of a light at a node

Nodes = tuple[int, int, int]  # numbers along x, y, z


class Shadow(NamedTuple):
    """Transmittance from the nodes of a volume's box to each light that casts shadows."""

    transmittance: LightTransmittance
    texture: moderngl.Texture3D


class Shadows:
    """Light transmittance of at most four lights, as textures; methods need the context to be current.

    The textures of the medium that casts the shadows take at most `budget` bytes.
    """

    def __init__(self, context: Context, budget: int) -> None:
        self._context, self._budget = context, budget
        self._gl = context.gl
        self._programs = Programs(context.gl, FOLDER)
        self._cast_for: tuple[Any, ...] | None = None
        self._shadows: list[Shadow] = []

    def prepare(
        self, scenes: Sequence[CompleteScene], thickness: float, most_nodes: int = SHADOW_NODES
    ) -> Sequence[Shadow | None]:
        """Find the shadow in each volume, by steps of about a slab's thickness; None where no shadows are cast.

        `scenes` are those of one volume each, see `CompleteScene.each_alone`; `most_nodes` is the number of nodes along
        the longest edge of a box.

        Raises
        ------
        NoRoomError
            If there are more nodes than usual, and they take more than textures may.
        """
        scene, lighting = scenes[0], scenes[0].lighting
        if lighting is None or not casts_shadows(lighting) or scene.mode != "composite":
            return [None] * len(scenes)
        volumes = [each.volume for each in scenes]
        part = max(thickness, 2 * max(volume.radius for volume in volumes) / _MOST_PARTS)
        estimators = [scene.gradient if each.medium.needs_gradient else None for each in scenes]
        asked: tuple[Any, ...] = (part, most_nodes, repr(lighting.casting), repr(estimators), repr(scene.cutting))
        asked += tuple(thing for each in scenes for thing in (each.volume, each.mask, each.medium))
        if self._cast_for is None or not same(self._cast_for, asked):
            self._cast_for = None
            self._release_textures()
            nodes = [shadow_nodes(volume, most_nodes) for volume in volumes]
            if most_nodes > SHADOW_NODES:
                self._check_room(nodes, len(lighting.casting))
            cast = self._cast(lighting, scenes, nodes, part)
            self._shadows = [Shadow(each, self._uploaded(each)) for each in cast]
            self._cast_for = asked
        return self._shadows

    def _check_room(self, nodes: Sequence[Nodes], lights: int) -> None:
        needed = sum(math.prod(each) for each in nodes) * lights * _NODE_BYTES
        if needed > self._budget:
            raise NoRoomError(
                f"shadows at {max(map(max, nodes))} nodes need {needed / 1e6:.0f} MB of textures, got "
                f"{self._budget / 1e6:.0f} MB: allow more by --texture-memory, or take fewer by --shadow-nodes"
            )

    def _cast(
        self, lighting: Lighting, scenes: Sequence[CompleteScene], nodes: Sequence[Nodes], part_length: float
    ) -> list[LightTransmittance]:
        depths = [np.zeros((len(lighting.casting), *each[::-1]), np.float32) for each in nodes]
        for scene in scenes:
            estimator = scene.gradient if scene.medium.needs_gradient else None
            baked = bake_values(scene.volume, scene.medium, "post", "exact", estimator, scene.mask)
            textures = TextureStore(self._context, self._budget)
            try:
                textures.prepare(baked, scene.volume, (baked,), (1, 1, 1))
                for receiving, each, depth in zip(scenes, nodes, depths, strict=True):
                    for number, light in enumerate(lighting.casting):
                        casting = _Casting(
                            light, baked, receiving.volume, each, part_length, scene.cutting, self._is_coarse
                        )
                        self._add_depths(casting, textures, depth[number])
            finally:
                textures.release()
        return [np.ascontiguousarray(np.moveaxis(np.exp(-depth), 0, -1)) for depth in depths]

    @cached_property
    def _is_coarse(self) -> bool:
        """True if the driver's weights have too few digits; what is kept for many pictures is always made exactly."""
        return weights_error(self._context) > COARSE

    def _add_depths(self, casting: _Casting, textures: TextureStore, depth: NDArray[np.float32]) -> None:
        """Add the optical depth between the nodes (z, y, x) of a volume and a light, some layers of nodes at a time."""
        nx, ny, nz = casting.nodes
        layers = min(max(_MOST_ROWS // ny, 1), nz)
        target = self._gl.framebuffer([self._gl.texture((nx, ny * layers), 1, dtype="f4")])
        drawn = np.zeros((layers, ny, nx), np.float32)
        try:
            for first in range(0, nz, layers):
                target.use()
                target.clear()
                self._gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
                self._gl.enable(moderngl.BLEND)
                self._gl.blend_equation = (moderngl.FUNC_ADD, moderngl.FUNC_ADD)
                self._gl.blend_func = (moderngl.ONE, moderngl.ONE)
                for brick in textures.bricks:
                    program = self._programs.program("shadow", casting.switches(brick), "corner.vert")
                    bind(program, textures.resources(brick), casting.uniforms(brick) | {"first_layer": first})
                    draw_triangles(self._gl, program, WHOLE_TARGET, "2f", "in_position")
                target.read_into(drawn, components=1, dtype="f4", alignment=1)
                depth[first : first + layers] += drawn[: nz - first]
        finally:
            release_target(self._gl, target)

    def release(self) -> None:
        """Release everything on the device."""
        self._programs.release()
        self._release_textures()
        self._cast_for = None

    def _uploaded(self, light_transmittance: LightTransmittance) -> moderngl.Texture3D:
        nz, ny, nx, lights = light_transmittance.shape
        texture = self._gl.texture3d((nx, ny, nz), lights, light_transmittance, alignment=1, dtype="f4")
        texture.repeat_x = texture.repeat_y = texture.repeat_z = False
        texture.filter = moderngl.LINEAR, moderngl.LINEAR
        return texture

    def _release_textures(self) -> None:
        for shadow in self._shadows:
            shadow.texture.release()
        self._shadows = []


class _Casting(NamedTuple):
    """One light, the medium of one volume that casts shadows, and the volume that receives them."""

    light: Light
    baked: ValueTexture
    receiving: Volume
    nodes: Nodes  # of the receiving volume
    part_length: float
    cutting: Cutting
    fetched: bool  # True if the shader interpolates texels

    def switches(self, brick: Brick) -> dict[str, int]:
        """Switches of shadow.frag."""
        switches = NOTHING_SPECIAL | self.baked.switches(math.inf, 1.0)
        for other in ("CLASSIFICATION", "WHOLE_SLABS"):
            switches.pop(other)
        elsewhere = self.receiving is not self.baked.volume
        switches |= {"POINT": int(self.light.kind == "point"), "BRICKS": int(not brick.is_whole)}
        fetched = self.fetched and not self.baked.volume.nearest
        return switches | {"HALF_SPACES": len(self.cutting), "ELSEWHERE": int(elsewhere), "FETCHED": int(fetched)}

    def uniforms(self, brick: Brick) -> dict[str, Any]:
        """Uniforms of shadow.frag."""
        light, volume = self.light, self.baked.volume
        position_from_box, box_from_position = box_matrices(volume)
        assert light.vector is not None
        to_light = position_of(light, volume) / volume.radius if light.kind == "point" else unit(light.vector)
        uniforms: dict[str, Any] = {
            "nodes": self.nodes,
            "to_light": tuple(to_light),
            "box_from_position": tuple(box_from_position.T.reshape(-1)),
            "part_length": self.part_length / volume.radius,
            "length_per_unit": volume.radius / self.baked.length_unit,
        }
        if light.kind == "point":
            uniforms["position_from_box"] = tuple(position_from_box.T.reshape(-1))
        if not brick.is_whole:
            uniforms |= brick_uniforms(brick, brick.own_range)
        if self.receiving is not volume:
            uniforms |= _from_other_box(volume, self.receiving)
        if self.cutting:
            uniforms["half_spaces"] = half_spaces_in_box(self.cutting, volume)
        medium = self.baked.uniforms(1.0)
        medium.pop("slab_length")
        return uniforms | medium


def _from_other_box(volume: Volume, other: Volume) -> dict[str, Any]:
    """Uniforms of the transformation from another volume's box to this volume's box, both in fractions of the edges."""
    to_box = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    matrix = to_box @ other.box_edges
    corner = 0.5 + to_box @ (other.centre - volume.centre) - matrix.sum(axis=1) / 2
    return {"box_from_other": tuple(matrix.T.reshape(-1)), "other_corner": tuple(corner)}
