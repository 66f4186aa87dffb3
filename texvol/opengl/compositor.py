"""The compositor draws slab stacks of bricks into a target, composites them there, and reads the picture back.

Bricks come front to back, and so do the stacks of each; they are blended *under* what is there, so that a pixel holds
the premultiplied colour and opacity of everything in front of the next:

    picture ← picture + (1 - picture.a) stack
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import Context
from texvol.opengl.light_uniforms import cue_uniforms, eye_uniforms, light_switches, light_uniforms
from texvol.opengl.projection import Projection
from texvol.opengl.shaders import FOLDER, load_program, set_uniforms
from texvol.opengl.texture_store import MODERNGL_TYPES, BakedTexture
from texvol.scene.camera import Camera
from texvol.scene.cutting import NOT_CUT, Cutting
from texvol.scene.lighting import DepthCue, Lighting
from texvol.scene.scene import checked_size
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.slabs import SlabStacks
from texvol.textures.value_texture import ValueTexture
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.opengl.surfaces.surfaces import Surfaces

_MOST_PROGRAMS = 64  # kept: some 4 MB each in Mesa's software driver; scenes that alternate use a few
NOTHING_SPECIAL = dict.fromkeys(
    ("RAMPS", "WHOLE_SLABS", "SHALLOW", "EMISSIVE", "MISSING", "GRADIENT", "WEIGHTS")
    + ("MODULATIONS", "GRADED", "CONTOURS"),
    0,
)
NO_LIGHT = dict.fromkeys(
    ("LIT", "HEAD_LIGHT", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "SPECULAR", "TWO_SIDED", "SHADOWS"), 0
)


_ENDS_AHEAD, _LEAST_AHEAD, _MOST_AHEAD = 6.0, 16.0, 64.0  # times the slabs that end a ray, and slabs

AnyTexture = moderngl.Texture | moderngl.Texture3D
Interval = tuple[moderngl.Texture, moderngl.Texture]


@dataclass(frozen=True)
class Drawing:
    """What all bricks of a picture have in common.

    `leaps` are those of `cells.Cells`, with the cells per box, or None where there is nothing to leap over; a ray that
    lets `least_transmittance` or less through is done.
    """

    baked: BakedTexture
    volume: Volume
    camera: Camera
    slab_thickness: float
    size: tuple[int, int]
    color_scale: float = 1.0
    least_transmittance: float = 0.0
    skips: moderngl.Texture3D | None = None
    cells_per_box: tuple[float, float, float] = (1.0, 1.0, 1.0)
    count: bool = False
    lighting: Lighting | None = None  # that falls on what the shader classifies
    depth_cue: DepthCue | None = None
    projection: Projection | None = None  # in place of matter
    light_transmittance: moderngl.Texture3D | None = None  # of each light that casts shadows
    cutting: Cutting = NOT_CUT
    surfaces: Surfaces | None = None  # that stand in the volume
    interval: Interval | None = None  # places between which matter is seen
    origin: NDArray[np.float64] | None = None  # world point at depth 0, where it is not the middle of the box

    @property
    def about(self) -> NDArray[np.float64]:
        """The world point at depth 0."""
        return self.volume.centre if self.origin is None else self.origin


class Compositor:
    """Programs and targets on one context; every method needs the context to be current.

    Programs are kept, the last used ones of them. `shaders` is the folder of the programs' files.
    """

    under = (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE)  # factors of what is drawn, and of what is there already

    def __init__(self, context: Context, shaders: Path = FOLDER) -> None:
        self._gl = context.gl
        self._shaders = shaders
        self._programs: dict[tuple[Any, ...], moderngl.Program] = {}
        self._target: moderngl.Framebuffer | None = None
        self._target_key: tuple[tuple[int, int], str] | None = None

    @property
    def largest_picture(self) -> int:
        """Most pixels of a picture along one side."""
        info = self._gl.info
        return int(min(info["GL_MAX_TEXTURE_SIZE"], *info["GL_MAX_VIEWPORT_DIMS"]))

    def checked_size(self, size: tuple[int, int]) -> tuple[int, int]:
        """(width, height) of a picture that the driver has room for, or InputError."""
        width, height = checked_size(size)
        largest = self.largest_picture
        if not (width <= largest and height <= largest):
            raise InputError(f"size {width}x{height}: a picture has 1 to {largest} pixels along each side here")
        return width, height

    @property
    def most_textures(self) -> int:
        """How many textures a drawing may have."""
        return int(self._gl.info["GL_MAX_TEXTURE_IMAGE_UNITS"])

    @property
    def target(self) -> moderngl.Framebuffer:
        """What the picture is drawn into."""
        assert self._target is not None, "a picture has to be begun"
        return self._target

    def begin(self, drawing: Drawing, target_format: str = "rgba32f") -> None:
        """An empty picture."""
        target = self._target_of(drawing.size, target_format)
        target.use()
        nothing = drawing.projection.nothing if drawing.projection and not drawing.count else (0.0, 0.0, 0.0, 0.0)
        target.clear(*nothing)

    def draw(
        self,
        drawing: Drawing,
        brick: Brick,
        stacks: SlabStacks,
        resources: Mapping[str, AnyTexture],
    ) -> None:
        """Composite a brick's stacks behind what is in the picture; `resources` are its texture and tables."""
        if not stacks.first.size:
            return
        units = dict(resources)
        uniforms = seen_uniforms(drawing) | picture_uniforms(drawing, stacks) | light_uniforms_of(drawing)
        uniforms |= ray_uniforms(drawing.volume, drawing.camera, drawing.size, stacks.slab_thickness, drawing.about)
        if drawing.skips is not None:
            units["skips"] = drawing.skips
            uniforms |= skip_uniforms(drawing)
        if drawing.light_transmittance is not None:
            units["light_transmittance"] = drawing.light_transmittance
        if drawing.interval is not None:
            units |= dict(zip(("near_positions", "far_positions"), drawing.interval, strict=True))
        if not brick.is_whole:
            uniforms |= brick_uniforms(brick)
        blending = "add" if drawing.count else drawing.projection.blending if drawing.projection else "under"
        name = "projection" if drawing.projection else "slab_stack"
        self.draw_polygons(name, _switches(drawing, brick), stacks, units, uniforms, blending)

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
        self.target.use()
        program = self._program(name, switches)
        for unit, resource in enumerate(units.values()):
            resource.use(unit)
        set_uniforms(program, {name: unit for unit, name in enumerate(units)} | dict(uniforms))
        self._blend(program, stacks, blending)

    def _blend(self, program: moderngl.Program, stacks: SlabStacks, blending: str) -> None:
        """Draw the polygons, each behind what is there; or add them to it, or keep the larger numbers."""
        gl = self._gl
        gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        gl.enable(moderngl.BLEND)
        equation = moderngl.MAX if blending == "largest" else moderngl.FUNC_ADD
        gl.blend_equation = (equation, equation)
        gl.blend_func = self.under if blending == "under" else (moderngl.ONE, moderngl.ONE)
        vertices = gl.buffer(_triangles(stacks))
        array = gl.vertex_array(program, [(vertices, "2f 2f", "in_position", "in_slab_range")])
        try:
            array.render(moderngl.TRIANGLES)
        finally:
            array.release()
            vertices.release()

    def finish(self) -> None:
        """Wait until everything asked for is drawn."""
        self._gl.finish()

    def picture(self, color_scale: float = 1.0) -> NDArray[np.float32]:
        """What was drawn: (height, width, 4) float32, premultiplied, linear, top row first, without `color_scale`."""
        assert self._target is not None and self._target_key is not None, "nothing has been drawn yet"
        (width, height), _ = self._target_key
        pixels = np.empty((height, width, 4), np.float32)
        self._target.read_into(pixels, components=4, dtype="f4", alignment=1)
        picture = np.ascontiguousarray(pixels[::-1])
        if color_scale != 1.0:
            picture[..., :3] /= color_scale
        return picture

    def release(self) -> None:
        """Give programs and targets back."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
        self._release_target()

    def _program(self, name: str, switches: dict[str, int]) -> moderngl.Program:
        key = (name, *sorted(switches.items()))
        program = self._programs.pop(key, None) or load_program(
            self._gl,
            name,
            defines=switches,
            vertex="slab_stack.vert",
            fragment=f"{name}.frag",
            folder=self._shaders,
        )
        self._programs[key] = program  # the last one used is the last
        if len(self._programs) > _MOST_PROGRAMS:
            self._programs.pop(next(iter(self._programs))).release()
        return program

    def _target_of(self, size: tuple[int, int], target_format: str) -> moderngl.Framebuffer:
        key = (size, target_format)
        if self._target is None or self._target_key != key:
            self._release_target()
            try:
                texture = self._gl.texture(size, 4, dtype=MODERNGL_TYPES[target_format])
                self._target = self._gl.framebuffer([texture])
            except moderngl.Error:
                raise InputError(f"size {size[0]}x{size[1]}: this driver has no room for such a picture") from None
            self._target_key = key
        return self._target

    def _release_target(self) -> None:
        if self._target is not None:
            self._gl.screen.use()  # moderngl binds the last framebuffer again, also one that is gone
            for attachment in self._target.color_attachments:
                attachment.release()
            self._target.release()
        self._target = self._target_key = None


def _switches(drawing: Drawing, brick: Brick) -> dict[str, int]:
    """Switches of the shader: what a drawing does without is not compiled."""
    parallel = drawing.camera.projection == "orthographic"
    if drawing.projection is not None:
        assert isinstance(drawing.baked, ValueTexture), "values are projected"
        special = NO_LIGHT | drawing.projection.switches(drawing.baked)
    else:
        obliquity = drawing.camera.largest_obliquity(drawing.size)
        special = NO_LIGHT | NOTHING_SPECIAL | drawing.baked.switches(drawing.slab_thickness, obliquity)
        special |= {"CAPS": int(drawing.cutting.caps), "AT_ONCE": _slabs_at_once(drawing, special)}
    return (
        special
        | light_switches(drawing.lighting)
        | {
            "PERSPECTIVE": int(not parallel),
            "BRICKS": int(not brick.is_whole),
            "SKIPS": int(drawing.skips is not None),
            "COUNT": int(drawing.count),
            "CUE": int(drawing.depth_cue is not None),
            "HALF_SPACES": len(drawing.cutting),
            "INTERVAL": int(drawing.interval is not None),
        }
    )


def _slabs_at_once(drawing: Drawing, switches: dict[str, int]) -> int:
    """How many slabs of a run are sampled at a time: more where runs are long, and little is remembered of each."""
    is_little = switches["CLASSIFICATION"] == 2 and switches["RAMPS"] and not switches["GRADIENT"] | switches["WEIGHTS"]
    runs_are_long = drawing.skips is None or drawing.slab_thickness <= drawing.volume.smallest_spacing
    return 4 if is_little and runs_are_long else 2


def _triangles(stacks: SlabStacks) -> NDArray[np.float32]:
    """Every polygon as a fan of triangles: (x, y, first slab, last slab) for each corner, front to back."""
    count, sides, _ = stacks.polygons.shape
    fan = np.array([(0, i, i + 1) for i in range(1, sides - 1)]).reshape(-1)
    vertices = np.empty((count, fan.size, 4), np.float32)
    vertices[..., :2] = stacks.polygons[:, fan]
    vertices[..., 2] = stacks.first[:, np.newaxis]
    vertices[..., 3] = stacks.last[:, np.newaxis]
    return vertices


def picture_uniforms(drawing: Drawing, stacks: SlabStacks) -> dict[str, Any]:
    """What of its rays a whole picture has in common."""
    camera, size = drawing.camera, drawing.size
    uniforms: dict[str, Any] = {"eye_depth": stacks.eye_depth, "picture_middle": (size[0] / 2, size[1] / 2)}
    if drawing.cutting:
        uniforms["half_spaces"] = half_spaces_in_box(drawing.cutting, drawing.volume)
    if camera.projection == "perspective" and (drawing.projection is None or drawing.projection.measures_rays):
        uniforms["tangent_per_pixel"] = 2 * camera.half_height / size[1]
    return uniforms


def ray_uniforms(
    volume: Volume, camera: Camera, size: tuple[int, int], slab_thickness: float, about: NDArray[np.float64]
) -> dict[str, Any]:
    """Where the rays are in the box at depth 0, and how they go on, for a depth of one slab; worked out in float64.

    Depth 0 is that of the world point `about`.
    """
    rays = camera.pixel_rays(size, about)
    box_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    per_slab = box_from_world * slab_thickness
    uniforms: dict[str, Any] = {
        "point": tuple(0.5 + box_from_world @ (rays.point + (about - volume.centre))),
        "point_per_column": tuple(box_from_world @ rays.point_per_column),
        "point_per_row": tuple(box_from_world @ rays.point_per_row),
        "velocity": tuple(per_slab @ rays.velocity),
    }
    if camera.projection == "perspective":
        uniforms["velocity_per_column"] = tuple(per_slab @ rays.velocity_per_column)
        uniforms["velocity_per_row"] = tuple(per_slab @ rays.velocity_per_row)
    return uniforms


def seen_uniforms(drawing: Drawing) -> dict[str, Any]:
    """What is seen on the way: matter, or the values themselves."""
    if drawing.projection is not None:
        assert isinstance(drawing.baked, ValueTexture), "values are projected"
        return drawing.projection.uniforms(drawing.baked)
    scales = {"color_scale": drawing.color_scale, "least_transmittance": drawing.least_transmittance}
    return scales | drawing.baked.uniforms(drawing.slab_thickness)


def skip_uniforms(drawing: Drawing) -> dict[str, Any]:
    """How the cells lie in the box, and in `post` how many slabs of matter a ray looks for before it samples them.

    A ray that ends has looked in vain for what lies behind; one that goes on waits for its neighbours each time that it
    looks again. So it looks for a few times the matter that would end it, if all were as dense as the densest.
    """
    uniforms: dict[str, Any] = {"cells_per_box": drawing.cells_per_box}
    baked = drawing.baked
    if drawing.projection is None and isinstance(baked, ValueTexture) and baked.classification == "post":
        deepest = float(baked.transfer_function.extinctions.max()) * drawing.slab_thickness
        ahead = math.inf
        if deepest > 0 and drawing.least_transmittance > 0:
            ahead = -_ENDS_AHEAD * math.log(drawing.least_transmittance) / deepest
        uniforms["slabs_ahead"] = min(max(ahead, _LEAST_AHEAD), _MOST_AHEAD)
    return uniforms


def light_uniforms_of(drawing: Drawing) -> dict[str, Any]:
    """What lights and a depth cue need; nothing where there are none."""
    uniforms: dict[str, Any] = {}
    if drawing.lighting is not None:
        assert isinstance(drawing.baked, ValueTexture), "texels of other kinds are lit already"
        uniforms |= light_uniforms(drawing.lighting, drawing.volume, drawing.baked.largest_gradient)
        uniforms |= eye_uniforms(drawing.lighting, drawing.camera, drawing.size)
    if drawing.depth_cue is not None:
        cue, camera, thickness = drawing.depth_cue, drawing.camera, drawing.slab_thickness
        uniforms |= cue_uniforms(cue, drawing.volume, camera, thickness, drawing.about)
    return uniforms


def half_spaces_in_box(cutting: Cutting, volume: Volume) -> list[tuple[float, ...]]:
    """(a, b, c, d) of each: what is kept has a x + b y + c z + d ≥ 0 in box coordinates."""
    normals, distances = cutting.half_spaces(volume)
    in_box = normals @ volume.box_edges
    offsets = -0.5 * in_box.sum(axis=1) - distances
    # In single precision, and shaders take 1e-30 for nothing: a power of two makes it about 1 in a world of any size.
    _, exponents = np.frexp(np.abs(in_box).max(axis=1, initial=0.0))
    return [tuple(each) for each in np.ldexp(np.column_stack([in_box, offsets]).T, -exponents).T.tolist()]


def brick_uniforms(brick: Brick) -> dict[str, Any]:
    """What of the box a brick's texture holds, and which part is its own."""
    low, high = brick.own_range
    samples, first, per_sample = brick.texture_from_box
    return {
        "brick_low": tuple(low),
        "brick_high": tuple(high),
        "samples_per_box": tuple(samples),
        "first_sample": tuple(first),
        "textures_per_sample": tuple(per_sample),
    }
