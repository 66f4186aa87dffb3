"""Surfaces and lines inside the medium; each ray alternates between intervals of the medium and surfaces.

    opaque shapes                ─► the position where each ray ends
    translucent ones, repeatedly ─► the next position on each ray, and what it sees there (depth peeling, Everitt 2001)
    between two positions        ─► an interval, in which the volume is drawn as usual, with its end slabs cut

and all of it is composited front to back. Imported, compiled and allocated when a scene has geometry.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.drawing import Drawing
from texvol.opengl.shaders import FOLDER, WHOLE_TARGET, Programs, bind, draw_triangles
from texvol.opengl.surfaces.on_screen import Primitives, primitives_of
from texvol.opengl.uniforms import (
    NO_LIGHT,
    cue_uniforms,
    eye_uniforms,
    half_spaces_in_box,
    light_switches,
    light_uniforms,
    ray_uniforms,
)
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CompleteScene
from texvol.scene.shapes import Lines, Mesh, Shape
from texvol.util.errors import InputError

_BEYOND = 1e30  # slabs
_TABLE_WIDTH = 4096
# Translucent lines are seen once on a ray; which it has passed are bits of a float32's whole numbers.
_MOST_TRANSLUCENT_LINES = 24
# Places, see surface.frag: before and behind all others.
_BEFORE_ALL = (-1.0, -_BEYOND, 0.0, 0.0)
_BEHIND_ALL = (float(1 << 24), _BEYOND, 0.0, 0.0)


class Surfaces:
    """Programs, targets and the last scene's shapes on one context; every method needs the context to be current."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._programs = Programs(gl, FOLDER)
        self._targets: _Targets | None = None
        self._shapes: _OnDevice | None = None
        self._shapes_for: tuple[Any, ...] | None = None
        self._lighting: Lighting | None = None
        self._limit: moderngl.Texture | None = None  # positions at which rays end, of a depth picture
        self._limit_for: tuple[Any, ...] = ()
        self._query = gl.query(samples=True)

    def prepare(self, scene: CompleteScene, size: tuple[int, int], slab_thickness: float) -> None:
        """Upload the scene's shapes as they lie in a picture of (width, height) pixels, unless they are there.

        Raises
        ------
        InputError
            If there are more than the driver has room for.
        """
        self._prepare_limit(scene, size, slab_thickness)
        camera = scene.camera
        self._lighting = scene.surface_lighting
        asked = (scene.geometry, scene.volume, camera, size, slab_thickness, self._lighting is None)
        if not scene.geometry:
            self._release_shapes()
        elif self._shapes is None or self._shapes_for != asked:
            self._release_shapes()
            self._shapes = _OnDevice(self._gl, scene, size, slab_thickness)
            self._shapes_for = asked
        if self._targets is None or self._targets.size != size:
            self._release_targets()
            self._targets = _Targets(self._gl, size)

    def _prepare_limit(self, scene: CompleteScene, size: tuple[int, int], slab_thickness: float) -> None:
        """Upload the positions at which rays end by the scene's depth picture, unless they are there."""
        asked = (scene.depth, scene.volume, scene.camera, size, slab_thickness)
        if self._limit_for == asked:
            return
        self._release_limit()
        self._limit_for = asked
        if scene.depth is not None:
            from_eye = scene.depth.at_size(size)[::-1]
            middle = float(scene.camera.forward @ (scene.volume.centre - scene.camera.eye))
            slabs = np.clip((from_eye - middle) / slab_thickness, -_BEYOND, _BEYOND)
            positions = np.zeros((*from_eye.shape, 4), np.float32)
            positions[..., 0], positions[..., 1] = _BEHIND_ALL[0], slabs
            positions[..., 2] = slabs - positions[..., 1]
            self._limit = self._gl.texture(size, 4, positions, dtype="f4")

    def intervals(self, drawing: Drawing, compositor: Compositor) -> Iterator[Drawing]:
        """The drawing between places, front to back; what is at the end of each is composited behind it."""
        shapes, targets = self._shapes, self._targets
        assert targets is not None, "nothing has been prepared"
        last, here, there = targets.last, *targets.passing
        here.positions_only.clear(*_BEFORE_ALL)
        for layer in (last, there):
            if self._limit is None:
                layer.positions_only.clear(*_BEHIND_ALL)
            else:
                self._copy(self._limit, layer.positions_only)
        if shapes is None:
            yield _between(drawing, here, last)
            return
        any_opaque = self._finds_next(drawing, shapes.opaque, here, there, last)
        while self._finds_next(drawing, shapes.translucent, here, last, there):
            yield _between(drawing, here, there)
            self._composite(there, drawing, compositor)
            here, there = there, here
        yield _between(drawing, here, last)
        if any_opaque:
            self._composite(last, drawing, compositor)

    def _finds_next(
        self, drawing: Drawing, vertices: moderngl.Buffer | None, behind: _Layer, in_front_of: _Layer, into: _Layer
    ) -> bool:
        """Find the next surfaces between two layers and draw them `into` a third; return False if there are none."""
        if vertices is None:
            return False
        assert self._shapes is not None and self._targets is not None
        gl, nearest = self._gl, self._targets.nearest
        program = self._program(drawing)
        uniforms = _uniforms(drawing, self._lighting, self._shapes.count)
        textures = {"table": self._shapes.table, "behind": behind.positions, "in_front_of": in_front_of.positions}
        array = gl.vertex_array(program, [(vertices, "2f 2f", "in_position", "in_numbers")])
        try:
            self._targets.nearest_only.clear(_BEYOND)
            self._targets.nearest_only.use()
            gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            gl.enable(moderngl.BLEND)
            gl.blend_equation = (moderngl.MIN, moderngl.MIN)
            # No texture may be read and written at once: while the nearest are found, another stands for them.
            bind(program, textures | {"nearest": behind.positions}, uniforms | {"finds_depth": True})
            with self._query:
                array.render(moderngl.TRIANGLES)
            if not self._query.samples:
                return False
            into.all.clear()
            self._copy(in_front_of.positions, into.positions_only)
            # Of equally near ones the first of the scene is drawn first, and no other passes the test.
            into.all.use()
            gl.disable(moderngl.BLEND)
            gl.enable(moderngl.DEPTH_TEST)
            gl.depth_func = "<"
            bind(program, textures | {"nearest": nearest}, uniforms | {"finds_depth": False})
            array.render(moderngl.TRIANGLES)
            return True
        finally:
            gl.disable(moderngl.DEPTH_TEST)
            array.release()

    def _composite(self, layer: _Layer, drawing: Drawing, compositor: Compositor) -> None:
        """Put what rays see in a layer behind what is in the picture."""
        if not drawing.count:
            scale = drawing.color_scale
            compositor.composite(layer.color, "under", (scale, scale, scale, 1.0))

    def _copy(self, source: moderngl.Texture, target: moderngl.Framebuffer) -> None:
        gl = self._gl
        target.use()
        gl.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        program = self._programs.program("texels", {}, "corner.vert")
        bind(program, {"source": source}, {"factor": (1.0, 1.0, 1.0, 1.0)})
        draw_triangles(gl, program, WHOLE_TARGET, "2f", "in_position")

    def _program(self, drawing: Drawing) -> moderngl.Program:
        assert self._shapes is not None
        switches = {
            "PERSPECTIVE": int(drawing.is_perspective),
            "HALF_SPACES": len(drawing.cutting),
            "LINES": int(self._shapes.any_lines),
            "CUE": int(drawing.depth_cue is not None),
            "FETCHED": 0,  # there is no texture on a surface
        }
        switches = NO_LIGHT | light_switches(self._lighting) | switches
        return self._programs.program("surface", switches, "surface.vert")

    def release(self) -> None:
        """Release everything on the device."""
        self._programs.release()
        self._release_shapes()
        self._release_targets()
        self._release_limit()

    def _release_limit(self) -> None:
        if self._limit is not None:
            self._limit.release()
        self._limit, self._limit_for = None, ()

    def _release_shapes(self) -> None:
        if self._shapes is not None:
            self._shapes.release()
        self._shapes = self._shapes_for = None

    def _release_targets(self) -> None:
        if self._targets is not None:
            self._gl.screen.use()  # moderngl binds the last framebuffer again, also one that is gone
            self._targets.release()
        self._targets = None


class _Layer:
    """Layer of surfaces: colours and positions along the rays of a picture, see surface.frag, and targets for both."""

    def __init__(self, gl: moderngl.Context, size: tuple[int, int], depth: moderngl.Renderbuffer) -> None:
        self.color = gl.texture(size, 4, dtype="f4")
        self.positions = gl.texture(size, 4, dtype="f4")
        self.all = gl.framebuffer([self.color, self.positions], depth)
        self.positions_only = gl.framebuffer([self.positions])

    def release(self) -> None:
        for each in (self.all, self.positions_only, self.color, self.positions):
            each.release()


class _Targets:
    """Targets of one size: the layer that rays end at, two that they pass in turn, and the depths of the next one."""

    def __init__(self, gl: moderngl.Context, size: tuple[int, int]) -> None:
        self.size = size
        try:
            self._depth = gl.depth_renderbuffer(size)
            self.last, *self.passing = (_Layer(gl, size, self._depth) for _ in range(3))
            self.nearest = gl.texture(size, 1, dtype="f4")
            self.nearest_only = gl.framebuffer([self.nearest])
        except moderngl.Error:
            raise InputError(
                f"size {size[0]}x{size[1]}: this driver has no memory for a picture of that size"
            ) from None

    def release(self) -> None:
        for layer in (self.last, *self.passing):
            layer.release()
        for each in (self.nearest_only, self.nearest, self._depth):
            each.release()


class _OnDevice:
    """The shapes of a scene as they lie in a picture: their table, and rectangles around those of either kind."""

    def __init__(
        self, gl: moderngl.Context, scene: CompleteScene, size: tuple[int, int], slab_thickness: float
    ) -> None:
        geometry = scene.geometry
        primitives = primitives_of(geometry, scene.volume, scene.camera, size, slab_thickness)
        self.count = len(geometry)
        self.any_lines = any(isinstance(shape, Lines) for shape in geometry)
        lit = scene.surface_lighting is not None
        table = np.concatenate([_texels_of_shapes(geometry), _texels_of_primitives(primitives, lit)])
        rows = -(-len(table) // _TABLE_WIDTH)
        longest = int(gl.info["GL_MAX_TEXTURE_SIZE"])
        if rows > longest or len(primitives.shape) >= 1 << 24:
            count = len(primitives.shape)
            raise InputError(f"{count} triangles and lines are in view, more than this driver has memory for")
        padded = np.zeros((rows * _TABLE_WIDTH, 4), np.float32)
        padded[: len(table)] = table
        self.table = gl.texture((_TABLE_WIDTH, rows), 4, padded, dtype="f4")
        self.table.filter = moderngl.NEAREST, moderngl.NEAREST
        is_opaque = np.array([shape.opacity == 1 for shape in geometry])[primitives.shape]
        self.opaque, self.translucent = (
            gl.buffer(vertices) if len(vertices) else None
            for vertices in (_vertices_of(primitives, kind, size) for kind in (is_opaque, ~is_opaque))
        )

    def release(self) -> None:
        for each in (self.table, self.opaque, self.translucent):
            if each is not None:
                each.release()


def _between(drawing: Drawing, near: _Layer, far: _Layer) -> Drawing:
    return replace(drawing, interval={"near_positions": near.positions, "far_positions": far.positions})


def _texels_of_shapes(shapes: Sequence[Shape]) -> NDArray[np.float32]:
    """Return two texels for each shape: colour and opacity; 1 if it is lit, cut, lines, and the bit that it has."""
    texels = np.zeros((len(shapes), 2, 4), np.float32)
    once = [number for number, shape in enumerate(shapes) if isinstance(shape, Lines) and shape.opacity < 1]
    if len(once) > _MOST_TRANSLUCENT_LINES:
        raise InputError(f"scene: at most {_MOST_TRANSLUCENT_LINES} Lines can be translucent, got {len(once)}")
    for number, shape in enumerate(shapes):
        texels[number, 0] = *shape.color, shape.opacity
        bit = float(1 << once.index(number)) if number in once else 0.0
        texels[number, 1] = isinstance(shape, Mesh) and shape.lit, shape.cut, isinstance(shape, Lines), bit
    return texels.reshape(-1, 4)


def _texels_of_primitives(primitives: Primitives, lit: bool) -> NDArray[np.float32]:
    """Return six texels for each primitive, its numbers in float32 and what that leaves; three more for normals."""
    high = primitives.numbers.astype(np.float32)
    low = (primitives.numbers - high).astype(np.float32)
    parts = [high, low]
    if lit:
        parts.append(np.pad(primitives.normals.astype(np.float32), [(0, 0), (0, 0), (0, 1)]))
    return np.concatenate(parts, axis=1).reshape(-1, 4)


def _vertices_of(primitives: Primitives, which: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the corners of the covers of chosen primitives: x, y, number of the primitive, number of its shape."""
    vertices = np.empty((int(which.sum()), 6, 4), np.float32)
    vertices[..., :2] = primitives.covers[which] / (np.array(size) / 2)
    vertices[..., 2] = np.flatnonzero(which)[:, np.newaxis]
    vertices[..., 3] = primitives.shape[which, np.newaxis]
    return vertices


def _uniforms(drawing: Drawing, lighting: Lighting | None, shapes: int) -> dict[str, Any]:
    """Uniforms of surface.frag that a whole picture has in common."""
    volume, view = drawing.first.volume, drawing.view
    camera, size, thickness = view.camera, view.size, view.slab_thickness
    middle = float(camera.forward @ (volume.centre - camera.eye))
    uniforms: dict[str, Any] = {
        "table_width": _TABLE_WIDTH,
        "shapes": shapes,
        "picture_middle": (size[0] / 2, size[1] / 2),
        "eye_depth": -middle / thickness,
    }
    if lighting is not None:
        uniforms |= light_uniforms(lighting, volume, 1.0) | eye_uniforms(lighting, camera, size)
    if drawing.cutting:
        uniforms["half_spaces"] = half_spaces_in_box(drawing.cutting, volume)
    if drawing.cutting or "positions" in uniforms:
        uniforms |= ray_uniforms(volume, view)
    if drawing.depth_cue is not None:
        uniforms |= cue_uniforms(drawing.depth_cue, volume, camera, thickness, view.origin)
    return uniforms
