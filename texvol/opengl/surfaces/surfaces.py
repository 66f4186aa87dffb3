"""Surfaces and lines inside the medium; each ray alternates between intervals of the medium and surfaces.

    opaque shapes                ─► the position where each ray ends
    translucent ones, repeatedly ─► the next position on each ray, and what it sees there
    between two positions        ─► an interval, in which the volume is drawn as usual, with its end slabs cut

and all of it is composited front to back. The next positions are found by depth peeling (Everitt 2001), or in lists
(hit_lists.py), which are equal. Imported, compiled and allocated when a scene has geometry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import moderngl
import numpy as np

from texvol.opengl.compositor import Compositor
from texvol.opengl.drawing import Drawing
from texvol.opengl.shaders import FOLDER, WHOLE_TARGET, Programs, bind, draw_triangles
from texvol.opengl.surfaces.hit_lists import HitLists, has_lists
from texvol.opengl.surfaces.on_device import TABLE_WIDTH, Kind, OnDevice
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
from texvol.util.errors import InputError

_BEYOND = 1e30  # slabs
_MOST_BYTES = 1 << 29  # of lists of hits
# Places, see surface_hit.glsl: before and behind all others.
_BEFORE_ALL = (-1.0, -_BEYOND, 0.0, 0.0)
_BEHIND_ALL = (float(1 << 24), _BEYOND, 0.0, 0.0)


class Surfaces:
    """Programs, targets and the last scene's shapes on one context; every method needs the context to be current.

    `most_bytes` is what lists of hits may take on the device; where they need more, shapes are peeled.
    """

    def __init__(self, gl: moderngl.Context, most_bytes: int = _MOST_BYTES) -> None:
        self._gl = gl
        self._programs = Programs(gl, FOLDER)
        self._targets: _Targets | None = None
        self._shapes: OnDevice | None = None
        self._shapes_for: tuple[Any, ...] | None = None
        self._lists = HitLists(gl, self._programs, min(most_bytes, _MOST_BYTES))
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
        asked = (scene.geometry, scene.volume, camera, size, slab_thickness, self._lighting is not None)
        if not scene.geometry:
            self._release_shapes()
            self._lists.release()
        elif self._shapes is None or self._shapes_for != asked:
            self._release_shapes()
            self._shapes = OnDevice(self._gl, *asked, in_rectangles=has_lists(self._gl, scene.geometry))
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
        any_opaque = self._finder(drawing, "opaque", there)(here, last)
        finds_next = self._finder(drawing, "translucent", last)
        while finds_next(here, there):
            yield _between(drawing, here, there)
            self._composite(there, drawing, compositor)
            here, there = there, here
        yield _between(drawing, here, last)
        if any_opaque:
            self._composite(last, drawing, compositor)

    def _finder(self, drawing: Drawing, name: str, in_front_of: _Layer) -> Callable[[_Layer, _Layer], bool]:
        """Return a function that draws the next surfaces of a kind behind one layer into another, if any."""
        shapes = self._shapes
        assert shapes is not None and self._shapes_for is not None
        kind: Kind | None = getattr(shapes, name)
        if kind is None:
            return lambda behind, into: False
        uniforms = _uniforms(drawing, self._lighting, shapes.count)
        search = _Search(shapes, kind, self._switches(drawing, shapes), uniforms, in_front_of)
        if not shapes.in_rectangles:
            return partial(self._peels, search)
        if self._lists.find(shapes, kind, in_front_of.positions, search.switches, uniforms):
            return partial(self._draws_next, search)
        shapes.release()
        self._shapes = OnDevice(self._gl, *self._shapes_for, in_rectangles=False)
        return self._finder(drawing, name, in_front_of)

    def _draws_next(self, search: _Search, behind: _Layer, into: _Layer) -> bool:
        """Draw the next surfaces of lists behind a layer into another; False if none are left."""
        into.all.clear()
        self._copy(search.in_front_of.positions, into.positions_only)
        into.all.use()
        with self._query:
            self._lists.draw_next(search.shapes, search.switches, search.textures(behind), search.uniforms)
        return bool(self._query.samples)

    def _peels(self, search: _Search, behind: _Layer, into: _Layer) -> bool:
        """Find the next surfaces behind a layer and draw them into another; False if none are left."""
        assert self._targets is not None
        gl, nearest, uniforms = self._gl, self._targets.nearest, search.uniforms
        program = self._programs.program("surface", search.switches, "surface.vert")
        array = gl.vertex_array(program, [(search.kind.buffer, "2f 2f", "in_position", "in_numbers")])
        try:
            self._targets.nearest_only.clear(_BEYOND)
            self._targets.nearest_only.use()
            gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            gl.enable(moderngl.BLEND)
            gl.blend_equation = (moderngl.MIN, moderngl.MIN)
            # No texture may be read and written at once: while the nearest are found, another stands for them.
            textures = search.textures(behind)
            bind(program, textures | {"nearest": behind.positions}, uniforms | {"finds_depth": True})
            with self._query:
                array.render(moderngl.TRIANGLES)
            if not self._query.samples:
                return False
            into.all.clear()
            self._copy(search.in_front_of.positions, into.positions_only)
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

    def _switches(self, drawing: Drawing, shapes: OnDevice) -> dict[str, int]:
        switches = {
            "PERSPECTIVE": int(drawing.is_perspective),
            "HALF_SPACES": len(drawing.cutting),
            "LINES": int(shapes.any_lines),
            "CUE": int(drawing.depth_cue is not None),
            "FETCHED": 0,  # there is no texture on a surface
        }
        return NO_LIGHT | light_switches(self._lighting) | switches

    def release(self) -> None:
        """Release everything on the device."""
        self._programs.release()
        self._lists.release()
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


class _Search(NamedTuple):
    """A kind of primitives, by which program they are looked for, and the layer in front of which."""

    shapes: OnDevice
    kind: Kind
    switches: dict[str, int]
    uniforms: dict[str, Any]
    in_front_of: _Layer

    def textures(self, behind: _Layer) -> dict[str, moderngl.Texture]:
        """Return textures by their samplers, with the layer behind which primitives are looked for."""
        return {
            "table": self.shapes.table,
            "behind": behind.positions,
            "in_front_of": self.in_front_of.positions,
        }


def _between(drawing: Drawing, near: _Layer, far: _Layer) -> Drawing:
    return replace(drawing, interval={"near_positions": near.positions, "far_positions": far.positions})


def _uniforms(drawing: Drawing, lighting: Lighting | None, shapes: int) -> dict[str, Any]:
    """Uniforms of surface.frag that a whole picture has in common."""
    volume, view = drawing.first.volume, drawing.view
    camera, size, thickness = view.camera, view.size, view.slab_thickness
    middle = float(camera.forward @ (volume.centre - camera.eye))
    uniforms: dict[str, Any] = {
        "table_width": TABLE_WIDTH,
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
