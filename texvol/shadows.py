"""Shadows: how much of each light arrives at the nodes of the box, see `texvol.lighting`.

The ways from all nodes to a light are walked on the device, a pixel for each node, through the post-classified matter,
whatever the classification of the picture; bricks add up. What is found is kept until the matter or the lights change.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from texvol.bricks import Brick
from texvol.compositor import NOTHING_SPECIAL, brick_uniforms, half_spaces_in_box
from texvol.contexts import Context
from texvol.cutting import Cutting
from texvol.light_uniforms import box_matrices, casts_shadows
from texvol.lighting import Light, Lighting, shadow_nodes, unit
from texvol.scene import Scene
from texvol.shaded_samples import Arriving
from texvol.shaders import load_program, set_uniforms
from texvol.texture_store import TextureStore, same
from texvol.transfer import TransferFunction
from texvol.value_texture import ValueTexture, bake_values

_MOST_PARTS = 2048  # of a way through the box: more would take seconds


class Shadows:
    """Programs, and the texture of what arrives of at most four lights; every method needs the context to be current.

    Parameters
    ----------
    budget : int
        Bytes that the textures of the matter that casts them may take.
    """

    def __init__(self, context: Context, budget: int) -> None:
        self._context, self._budget = context, budget
        self._gl = context.gl
        self._programs: dict[tuple[Any, ...], moderngl.Program] = {}
        self._texture: moderngl.Texture3D | None = None
        self._cast_for: tuple[Any, ...] | None = None
        self._arriving: Arriving | None = None

    def prepare(self, scene: Scene, transfer_function: TransferFunction, thickness: float) -> Arriving | None:
        """Have what arrives at the nodes, as found by parts of about a slab's thickness; None where nothing is cast."""
        lighting, volume = scene.lighting, scene.volume
        if lighting is None or not casts_shadows(lighting) or scene.mode != "composite":
            return None
        part = max(thickness, 2 * volume.radius / _MOST_PARTS)
        estimator = scene.gradient if transfer_function.needs_gradient else None
        matter = volume, scene.mask, transfer_function
        asked = (*matter, part, repr(lighting.casting), repr(estimator), repr(scene.cutting))
        if self._cast_for is None or not same(self._cast_for, asked):
            self._cast_for = None
            baked = bake_values(volume, transfer_function, "post", "exact", estimator, scene.mask)
            textures = TextureStore(self._context, self._budget)
            try:
                textures.prepare(baked, volume, asked, (1, 1, 1))
                self._arriving = self._cast(lighting, baked, textures, part, scene.cutting)
            finally:
                textures.release()
            self._upload(self._arriving)
            self._cast_for = asked
        return self._arriving

    def _cast(
        self, lighting: Lighting, baked: ValueTexture, textures: TextureStore, part_length: float, cutting: Cutting
    ) -> Arriving:
        volume = baked.volume
        nx, ny, nz = nodes = shadow_nodes(volume)
        target = self._gl.framebuffer([self._gl.texture((nx, ny * nz), 1, dtype="f4")])
        depths = np.zeros((len(lighting.casting), nz, ny, nx), np.float32)
        try:
            for light, depth in zip(lighting.casting, depths, strict=True):
                target.use()
                target.clear()
                for brick in textures.bricks:
                    self._draw(light, baked, textures, brick, nodes, part_length, cutting)
                target.read_into(depth, components=1, dtype="f4", alignment=1)
        finally:
            self._gl.screen.use()
            for attachment in target.color_attachments:
                attachment.release()
            target.release()
        return np.ascontiguousarray(np.moveaxis(np.exp(-depths), 0, -1))

    @property
    def texture(self) -> moderngl.Texture3D:
        """What arrives of each light, one component each."""
        assert self._texture is not None, "no shadows have been cast"
        return self._texture

    def release(self) -> None:
        """Give everything back."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
        self._release_texture()
        self._cast_for = None

    def _draw(
        self,
        light: Light,
        baked: ValueTexture,
        textures: TextureStore,
        brick: Brick,
        nodes: tuple[int, int, int],
        part_length: float,
        cutting: Cutting,
    ) -> None:
        program = self._program(light, baked, brick, cutting)
        uniforms = _uniforms(light, baked, brick, nodes, part_length)
        if cutting:
            uniforms["half_spaces"] = half_spaces_in_box(cutting, baked.volume)
        units = textures.resources(brick)
        for unit_number, resource in enumerate(units.values()):
            resource.use(unit_number)
        set_uniforms(program, {name: number for number, name in enumerate(units)} | uniforms)
        self._gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._gl.enable(moderngl.BLEND)
        self._gl.blend_equation = (moderngl.FUNC_ADD, moderngl.FUNC_ADD)
        self._gl.blend_func = (moderngl.ONE, moderngl.ONE)
        corners = self._gl.buffer(np.array([-1, -1, 3, -1, -1, 3], np.float32))
        array = self._gl.vertex_array(program, [(corners, "2f", "in_position")])
        try:
            array.render(moderngl.TRIANGLES)
        finally:
            array.release()
            corners.release()

    def _program(self, light: Light, baked: ValueTexture, brick: Brick, cutting: Cutting) -> moderngl.Program:
        switches = NOTHING_SPECIAL | baked.switches(1.0, True)
        for other in ("CLASSIFICATION", "WHOLE_SLABS"):
            switches.pop(other)
        switches |= {"POINT": int(light.kind == "point"), "BRICKS": int(not brick.is_whole)}
        switches["HALF_SPACES"] = len(cutting)
        key = tuple(sorted(switches.items()))
        if key not in self._programs:
            self._programs[key] = load_program(self._gl, "shadow", defines=switches, vertex="corner.vert")
        return self._programs[key]

    def _upload(self, arriving: Arriving) -> None:
        self._release_texture()
        nz, ny, nx, lights = arriving.shape
        texture = self._gl.texture3d((nx, ny, nz), lights, arriving, alignment=1, dtype="f4")
        texture.repeat_x = texture.repeat_y = texture.repeat_z = False
        texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self._texture = texture

    def _release_texture(self) -> None:
        if self._texture is not None:
            self._texture.release()
        self._texture = None


def _uniforms(
    light: Light, baked: ValueTexture, brick: Brick, nodes: tuple[int, int, int], part_length: float
) -> dict[str, Any]:
    volume = baked.volume
    place_from_box, box_from_place = box_matrices(volume)
    assert light.vector is not None
    place = (np.array(light.vector) - volume.centre) / volume.radius
    uniforms: dict[str, Any] = {
        "nodes": nodes,
        "to_light": tuple(place if light.kind == "point" else unit(light.vector)),
        "box_from_place": tuple(box_from_place.T.reshape(-1)),
        "part_length": part_length / volume.radius,
        "length_per_unit": volume.radius / baked.length_unit,
    }
    if light.kind == "point":
        uniforms["place_from_box"] = tuple(place_from_box.T.reshape(-1))
    matter = baked.uniforms(1.0)
    matter.pop("slab_length")
    if not brick.is_whole:
        uniforms |= brick_uniforms(brick)
    return uniforms | matter
