"""Compositor: draws slab stacks of bricks into a target, composites them there, and reads the picture back.

Bricks and their stacks are drawn front to back and blended *under* the picture so far, so that a pixel holds the
premultiplied colour and opacity of everything in front of the next stack:

    picture ← picture + (1 - picture.a) stack
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import Context
from texvol.opengl.drawing import AnyTexture, Drawing
from texvol.opengl.filtering import COARSE, weights_error
from texvol.opengl.pieces import Pieces, Region
from texvol.opengl.pipelines import StackDraw, covered, draw_rays, faster, has_compute
from texvol.opengl.shaders import FOLDER, WHOLE_TARGET, Programs, bind, draw_triangles, release_target
from texvol.opengl.texture_store import MODERNGL_TYPES, is_software
from texvol.opengl.uniforms import picture_uniforms, single_switches, skip_uniforms, volume_uniforms
from texvol.scene.picture_size import AnySize, checked_size
from texvol.slicing.bricks import Brick
from texvol.slicing.slabs import SlabStacks
from texvol.util.errors import InputError

Target = moderngl.Framebuffer
Layers = tuple[Target, list[moderngl.Texture]]


class Compositor:
    """Programs and targets on one context; every method needs the context to be current.

    `shaders` is the folder of the programs' files.
    """

    under = (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE)  # factors of what is drawn, and of what is there already

    def __init__(self, context: Context, shaders: Path = FOLDER) -> None:
        self._context, self._gl = context, context.gl
        self._shaders, self._programs = shaders, Programs(context.gl, shaders)
        self._target: moderngl.Framebuffer | None = None
        self._target_key: tuple[tuple[int, int], str] | None = None
        self._regions: tuple[Region, ...] | None = None  # that are drawn into; None: all
        self._frame = Pieces(context.gl.finish)
        self.pipeline = "auto"  # see pipelines.py
        self.drawn_by = "fragment"  # pipeline of the last picture
        self._faster: str | None = None  # pipeline that "auto" takes
        self._layers: dict[tuple[int, ...], Layers] = {}  # of the target's size, by the components of each

    def checked_size(self, size: AnySize) -> tuple[int, int]:
        """(width, height) of a picture that the driver has room for, or InputError."""
        width, height = checked_size(size)
        info = self._gl.info
        largest = int(min(info["GL_MAX_TEXTURE_SIZE"], *info["GL_MAX_VIEWPORT_DIMS"]))
        if not (width <= largest and height <= largest):
            raise InputError(f"size {width}x{height}: this driver draws 1 to {largest} pixels along each side")
        return width, height

    @property
    def most_textures(self) -> int:
        """Largest number of textures of a drawing."""
        return int(self._gl.info["GL_MAX_TEXTURE_IMAGE_UNITS"])

    @cached_property
    def weights_error(self) -> float:
        """Largest error of the weights with which the driver interpolates textures."""
        return weights_error(self._context, self._shaders)

    @property
    def has_coarse_weights(self) -> bool:
        """True if the weights have too few digits for a fine picture, as on most graphics cards."""
        return self.weights_error > COARSE

    @property
    def target(self) -> moderngl.Framebuffer:
        """Framebuffer that the picture is drawn into."""
        assert self._target is not None, "a picture has to be begun"
        return self._target

    def begin(self, drawing: Drawing, target_format: str = "rgba32f") -> None:
        """Clear the target for a new picture."""
        self.drawn_by = "fragment"
        self._frame.begin()
        target = self._target_of(drawing.view.size, target_format)
        target.use()
        nothing = drawing.projection.nothing if drawing.projection and not drawing.count else (0.0, 0.0, 0.0, 0.0)
        target.clear(*nothing)

    def draw(self, drawing: Drawing, brick: Brick, stacks: SlabStacks) -> None:
        """Composite the stacks of a brick of the only volume behind the picture so far."""
        if not stacks.first.size:
            return
        drawn = drawing.first
        units = drawn.samplers(brick) | drawing.interval | drawing.known
        uniforms = picture_uniforms(drawing, stacks) | volume_uniforms(drawing, drawn, brick)
        if drawn.skips is not None:
            uniforms |= skip_uniforms(drawing, brick)
        blending = "add" if drawing.count else drawing.projection.blending if drawing.projection else "under"
        name = "projection" if drawing.projection else "slab_stack"
        self.draw_polygons(name, single_switches(drawing, brick), stacks, units, uniforms, blending)

    def draw_polygons(
        self,
        name: str,
        switches: dict[str, int],
        stacks: SlabStacks,
        units: Mapping[str, AnyTexture],
        uniforms: Mapping[str, Any],
        blending: str,
    ) -> None:
        """Draw the polygons of slab stacks by the program of that name; `units` are textures by their samplers."""
        draw = StackDraw(name, switches, stacks, units, uniforms, blending)
        self.drawn_by = self._pipeline_for(draw)
        self._draw_by(self.drawn_by, draw)

    def _draw_by(self, pipeline: str, draw: StackDraw) -> None:
        if pipeline == "compute":
            draw_rays(self._gl, self._programs, self.target, draw, self._pieces((pipeline, *draw.kind), draw.slabs))
            return
        program = self.program(draw.name, draw.switches, "slab_stack.vert")
        bind(program, draw.units, draw.uniforms)
        self.blend(program, draw.blending, *triangles_of(draw.stacks), kind=draw.kind, slabs=draw.slabs)

    def _pipeline_for(self, draw: StackDraw) -> str:
        """Return the pipeline that was asked for, or the one that drew the first stacks faster."""
        if self.pipeline != "auto":
            return self.pipeline
        if self._faster is None:
            # A software driver does both on the same cores, and compiling takes longer than it could save.
            is_fixed = is_software(self._context) or not has_compute(self._context)
            self._faster = "fragment" if is_fixed else self._probed(draw)
        return self._faster

    def _probed(self, draw: StackDraw) -> str:
        """Return the faster pipeline for stacks, by drawing some of their pixels into another target."""
        whole, regions = self._target, self._regions
        self._target, _ = self._cleared_layers((4,))

        def draw_by(pipeline: str, region: Region) -> None:
            self._regions = (region,)
            self._draw_by(pipeline, draw)
            self._gl.finish()

        try:
            return faster(draw_by, covered(draw.stacks, self.target.size))
        finally:
            self._target, self._regions = whole, regions

    def program(self, name: str, switches: Mapping[str, int], vertex: str) -> moderngl.Program:
        """Return the program of `name`.frag and a vertex shader."""
        return self._programs.program(name, switches, vertex)

    def blend(
        self,
        program: moderngl.Program,
        blending: str,
        vertices: NDArray[np.float32],
        layout: str,
        *attributes: str,
        kind: Hashable = "",
        slabs: float = 1.0,
    ) -> None:
        """Draw triangles, each behind what is there ("under"); or "add" them to it, or keep the "largest" numbers.

        Pixels of one `kind`, of up to so many `slabs`, take about as long.
        """
        gl = self._gl
        gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        gl.enable(moderngl.BLEND)
        equation = moderngl.MAX if blending == "largest" else moderngl.FUNC_ADD
        gl.blend_equation = (equation, equation)
        gl.blend_func = self.under if blending == "under" else (moderngl.ONE, moderngl.ONE)
        target = self.target
        try:
            for piece in self._pieces(kind, slabs):
                target.scissor = piece  # type: ignore[assignment]
                target.use()
                draw_triangles(gl, program, vertices, layout, *attributes)
        finally:
            target.scissor = None  # type: ignore[assignment]
            target.use()

    @contextmanager
    def within(self, regions: tuple[Region, ...] | None) -> Iterator[None]:
        """Draw into some regions of the picture only; elsewhere it then means nothing."""
        self._regions = regions
        try:
            yield
        finally:
            self._regions = None

    def _pieces(self, kind: Hashable, slabs: float) -> Iterator[Region | None]:
        """Yield what is drawn into, one after the other; None is the whole target."""
        return self._frame.of(self._regions, self.target.size, kind, slabs)

    def composite(
        self, layer: moderngl.Texture, blending: str = "under", factor: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    ) -> None:
        """Composite a picture of the target's size, times a factor, behind the picture so far."""
        program = self.program("texels", {}, "corner.vert")
        bind(program, {"source": layer}, {"factor": factor})
        self.blend(program, blending, WHOLE_TARGET, "2f", "in_position")

    def layers(
        self,
        components: tuple[int, ...],
        program: moderngl.Program,
        vertices: NDArray[np.float32],
        layout: str,
        *attributes: str,
    ) -> list[moderngl.Texture]:
        """Draw triangles into textures of the target's size, of so many float32 components each, and 0 elsewhere."""
        framebuffer, textures = self._cleared_layers(components)
        framebuffer.use()
        self._gl.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        draw_triangles(self._gl, program, vertices, layout, *attributes)
        return textures

    @contextmanager
    def apart(self, blending: str = "under") -> Iterator[None]:
        """Draw what follows into an empty picture, and composite that: sums of few numbers keep more digits.

        A target of fewer bits than float32 has none to keep: it is drawn into as it is.
        """
        whole, key = self.target, self._target_key
        if key is None or key[1] != "rgba32f":
            yield
            return
        self._target, textures = self._cleared_layers((4,))
        try:
            yield
        finally:
            self._target = whole
        self.composite(textures[0], blending)

    def empty_target(self, size: tuple[int, int]) -> Target:
        """Return a float32 target of a size to draw `into`, with nothing in it; whoever has it releases it."""
        made = self._gl.framebuffer([self._gl.texture(size, 4, dtype="f4")])
        made.clear()
        return made

    def release_target(self, target: Target) -> None:
        """Release a target of `empty_target`."""
        release_target(self._gl, target)

    @contextmanager
    def into(self, target: Target) -> Iterator[None]:
        """Draw what follows into another float32 target, which may have another size."""
        whole = self._target, self._target_key, self._layers
        self._target, self._target_key, self._layers = target, (target.size, "rgba32f"), {}
        target.use()
        try:
            yield
        finally:
            self._release_layers()
            self._target, self._target_key, self._layers = whole
            self.target.use()

    def finish(self) -> None:
        """Wait until everything asked for is drawn."""
        self._gl.finish()
        self._frame.end()

    def picture(self, color_scale: float = 1.0) -> NDArray[np.float32]:
        """Read the picture back: (height, width, 4), premultiplied, linear, top row first, without `color_scale`."""
        width, height = self.target.size
        picture = np.ascontiguousarray(self.pixels(slice(0, height), slice(0, width)))
        if color_scale != 1.0:
            picture[..., :3] /= color_scale
        return picture

    def opacity(self, rows: slice, columns: slice) -> NDArray[np.float32]:
        """Read the opacity of a box of the picture so far back, shape (rows, columns), top row first."""
        return self.pixels(rows, columns)[..., 3]

    def pixels(self, rows: slice, columns: slice) -> NDArray[np.float32]:
        """Read a box of the picture so far back, shape (rows, columns, 4), top row first."""
        width, height = columns.stop - columns.start, rows.stop - rows.start
        pixels = np.empty((height, width, 4), np.float32)
        where = columns.start, self.target.height - rows.stop, width, height
        self.target.read_into(pixels, where, components=4, dtype="f4", alignment=1)
        return pixels[::-1]

    def release(self) -> None:
        """Release programs and targets."""
        self._programs.release()
        self._release_target()

    def _target_of(self, size: tuple[int, int], target_format: str) -> moderngl.Framebuffer:
        key = (size, target_format)
        if self._target is None or self._target_key != key:
            self._release_target()
            try:
                texture = self._gl.texture(size, 4, dtype=MODERNGL_TYPES[target_format])
                self._target = self._gl.framebuffer([texture])
            except moderngl.Error:
                raise InputError(
                    f"size {size[0]}x{size[1]}: this driver has no memory for a picture of that size"
                ) from None
            self._target_key = key
        return self._target

    def _release_target(self) -> None:
        self._release_layers()
        if self._target is not None:
            release_target(self._gl, self._target)
        self._target = self._target_key = None

    def _release_layers(self) -> None:
        for framebuffer, _ in self._layers.values():
            release_target(self._gl, framebuffer)
        self._layers = {}

    def _cleared_layers(self, components: tuple[int, ...]) -> Layers:
        if components not in self._layers:
            textures = [self._gl.texture(self.target.size, count, dtype="f4") for count in components]
            self._layers[components] = self._gl.framebuffer(textures), textures
        self._layers[components][0].clear()
        return self._layers[components]


def triangles_of(stacks: SlabStacks) -> tuple[NDArray[np.float32], str, str, str]:
    """Every polygon as a fan of triangles, front to back, and the attributes of slab_stack.vert in its vertices."""
    count, sides, _ = stacks.polygons.shape
    fan = np.array([(0, i, i + 1) for i in range(1, sides - 1)]).reshape(-1)
    vertices = np.empty((count, fan.size, 4), np.float32)
    vertices[..., :2] = stacks.polygons[:, fan]
    vertices[..., 2] = stacks.first[:, np.newaxis]
    vertices[..., 3] = stacks.last[:, np.newaxis]
    return vertices, "2f 2f", "in_position", "in_slab_range"
