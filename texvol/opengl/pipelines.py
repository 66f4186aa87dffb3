"""Two ways to draw slab stacks: by polygons and their fragments, or ray by ray in a compute shader.

Both walk the same slabs with the same includes, so that their pictures agree to rounding. A compute shader needs no
polygons and no blending: each ray has its picture in registers, from all stacks of a draw (shaders/rays.comp). Which
is faster depends on the card, so the first stacks that are drawn on a context are drawn in both ways, growing squares
of them until one takes long enough to be timed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np

from texvol.opengl.pieces import Region
from texvol.opengl.shaders import bind, load_compute
from texvol.slicing.slabs import SlabStacks
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.opengl.contexts import Context
    from texvol.opengl.shaders import Programs

PIPELINES = ("auto", "fragment", "compute")
_SINCE = 430  # OpenGL 4.3
_SIDE = 8  # of a group of invocations, pixels
_TARGETS = {"f4": 0, "f2": 1, "f1": 2}  # switch TARGET by the type of the target's components
_BLENDINGS = {"under": 0, "add": 1, "largest": 2}
# Loops of a shader end after 65535 turns in all in Mesa's software driver, see slicing/slabs.py.
_MOST_SLABS = 1 << 15
_FASTER = 0.8  # of the other one's time, to be taken in its place
_LONG_ENOUGH = 0.002  # seconds, to be timed
_PROBE = 0.010  # seconds, after which a probe ends


@dataclass(frozen=True)
class StackDraw:
    """Slab stacks to be drawn: the name and the switches of a program, textures, uniforms, and how they are blended."""

    name: str
    switches: Mapping[str, int]
    stacks: SlabStacks
    units: Mapping[str, Any]
    uniforms: Mapping[str, Any]
    blending: str

    @property
    def kind(self) -> tuple[Any, ...]:
        """Program and switches."""
        return (self.name, *sorted(self.switches.items()))

    @property
    def slabs(self) -> float:
        """Largest number of slabs on a ray."""
        return float(self.stacks.slab_count)


def has_compute(context: Context) -> bool:
    """Return True if the driver has compute shaders that write images; `context` is current."""
    gl = context.gl
    if gl.version_code >= _SINCE:
        return True
    try:
        load_compute(gl, "nothing").release()
    except Exception:  # moderngl raises more than its own where the driver lacks a function
        return False
    return True


def checked_pipeline(pipeline: str, context: Context) -> str:
    """Return the argument, if the driver has it.

    Raises
    ------
    InputError
        If there is no such pipeline, or the driver has no compute shaders.
    """
    if pipeline not in PIPELINES:
        raise InputError(f"pipeline must be auto, fragment or compute, got {pipeline!r}")
    if pipeline == "compute" and not has_compute(context):
        version = context.gl.info["GL_VERSION"]
        raise InputError(f"pipeline compute needs OpenGL 4.3 or ARB_compute_shader, got {version}")
    return pipeline


def faster(draw_by: Callable[[str, Region], None], within: Region) -> str:
    """Return the pipeline that draws some pixels faster; `draw_by` draws a region by one, and waits until it is drawn.

    It is "fragment" unless the other one is clearly faster.
    """
    x, y, width, height = within
    seconds: dict[str, float] = {}
    start, side = 0.0, _SIDE
    while True:
        across, up = min(side, width), min(side, height)
        region = x + (width - across) // 2, y + (height - up) // 2, across, up
        for pipeline in ("fragment", "compute"):
            begin = time.perf_counter()
            draw_by(pipeline, region)
            seconds[pipeline] = time.perf_counter() - begin
        start = start or time.perf_counter()  # the first time compiles
        is_known = min(seconds.values()) > _LONG_ENOUGH and side > _SIDE
        if is_known or time.perf_counter() - start > _PROBE or (across, up) == (width, height):
            return "compute" if seconds["compute"] < _FASTER * seconds["fragment"] else "fragment"
        side *= 2


def draw_rays(
    gl: moderngl.Context,
    programs: Programs,
    target: moderngl.Framebuffer,
    draw: StackDraw,
    pieces: Iterable[Region | None],
) -> None:
    """Composite stacks with a target's picture, in some pieces of it, by the compute shader; None is all of it."""
    (texture,) = target.color_attachments
    assert isinstance(texture, moderngl.Texture)
    switches = {**draw.switches, "TARGET": _TARGETS[texture.dtype], "BLENDING": _BLENDINGS[draw.blending]}
    shader = programs.compute("rays", switches, {"DRAWN": f"{draw.name}.glsl"})
    x, y, width, height = covered(draw.stacks, target.size)
    low, high = np.array([x, y]), np.array([x + width, y + height])
    bind(shader, draw.units, draw.uniforms)
    texture.bind_to_image(0, read=True, write=True)
    for piece in pieces:
        left, bottom, across, up = (0, 0, *target.size) if piece is None else piece
        first = np.maximum(low, (left, bottom))
        end = np.minimum(high, (left + across, bottom + up))
        if (first >= end).any():
            continue
        shader["first_pixel"], shader["end_pixel"] = tuple(first.tolist()), tuple(end.tolist())
        groups = [math.ceil(count / _SIDE) for count in (end - first).tolist()]
        for span in spans(draw.stacks):
            shader["slab_span"] = span
            shader.run(*groups)
            gl.memory_barrier()


def covered(stacks: SlabStacks, size: tuple[int, int]) -> Region:
    """Return the rectangle of the target in which all polygons of stacks lie."""
    corners = (np.clip(stacks.polygons.reshape(-1, 2), -1.0, 1.0) + 1) / 2 * size
    low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])


def spans(stacks: SlabStacks) -> list[tuple[float, float, float]]:
    """Return first slab, end and slabs of a stack for each run of the shader: loops are limited."""
    first, last = stacks.first.tolist(), stacks.last.tolist()
    found: list[list[int]] = []
    for begin, end in zip(first, last, strict=True):
        same = found and found[-1][1] == begin and (begin - found[-1][0]) % found[-1][2] == 0
        if same and end - begin <= found[-1][2] and end - found[-1][0] <= _MOST_SLABS:
            found[-1][1] = end
        else:
            found.append([begin, end, end - begin])
    return [(float(begin), float(end), float(each)) for begin, end, each in found]
