"""The textures of one volume on the device: baked and uploaded brick by brick, within a budget, when they are drawn.

Texels go over in slices of a few megabytes, so that beside the texture no second copy of it exists. A texture whose
texels have changed is written anew in its place. The budget is half of the free memory of the device by default, or of
the machine if the driver is software.

Memory that is touched for the first time takes longer than texels take to be made. So the bricks of a large
volume are small, and in the first picture they follow each other in the same few textures; from the second picture of
the same texels on each has one of its own, while there is room.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import Context
from texvol.scene.gradient import seconds_of
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick, Triple, cut, layered_size, texture_size, whole
from texvol.textures.slab_texture import SlabTexture
from texvol.textures.spread_texture import SMOOTHED
from texvol.textures.value_texture import ValueTexture
from texvol.util import progress
from texvol.util.errors import InputError
from texvol.util.memory import free_memory

MODERNGL_TYPES = {
    "rgba8": "f1",
    "rgba16f": "f2",
    "rgba32f": "f4",
    "rgba16": "nu2",
    "r8": "f1",
    "r16": "nu2",
    "r16f": "f2",
    "r32f": "f4",
}
BYTES = {"rgba8": 4, "rgba16f": 8, "rgba32f": 16, "rgba16": 8, "r8": 1, "r16": 2, "r16f": 2, "r32f": 4}
_SLICE_BYTES = 8 << 20
_UNKNOWN = 1 << 30  # where the driver does not tell
_SOFTWARE_TEXTURE = (1 << 30) - 1  # Mesa's software driver refuses textures of a gibibyte and more
_NVIDIA_FREE, _AMD_FREE = 0x9049, 0x87FC  # GL_NVX_gpu_memory_info, GL_ATI_meminfo: kibibytes
_LARGE = 512 << 20  # bytes of texels: more are drawn in bricks
_LARGE_BRICK = 128 << 20  # bytes of these bricks, at most
_AT_FIRST = 256 << 20  # bytes of their textures in the first picture
# A sample takes about so long on two cores to be baked and uploaded: as it is, with its gradient, and lit.
SECONDS_OF_A_SAMPLE, SECONDS_OF_A_GRADIENT, SECONDS_OF_A_LIT_SAMPLE = 8e-9, 2.5e-8, 8e-8
_BRICKS_IN_BUDGET = 4  # at least: those that are drawn first are still there for the next picture

BakedTexture = SlabTexture | ValueTexture


class Stopwatch:
    """Adds up seconds by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, what: str) -> Iterator[None]:
        """Add the time that is spent inside."""
        start = time.perf_counter()
        yield
        self.seconds[what] = self.seconds.get(what, 0.0) + time.perf_counter() - start

    @contextmanager
    def timed_textures(self) -> Iterator[None]:
        """Add to "bake" the time that is spent inside, without that of "bake" and "upload" there."""
        start, spent = time.perf_counter(), self.of_textures()
        yield
        rest = time.perf_counter() - start - (self.of_textures() - spent)
        self.seconds["bake"] = self.seconds.get("bake", 0.0) + rest

    def of_textures(self) -> float:
        """Seconds in which texels were made and uploaded."""
        return self.seconds.get("bake", 0.0) + self.seconds.get("upload", 0.0)


@dataclass
class _Held:
    textures: dict[str, moderngl.Texture3D]  # by the names of their samplers
    texels: tuple[Any, ...] | None = None  # what their texels are made of
    used: int = 0


class TextureStore:
    """Textures of the bricks of one volume, at most `budget` bytes; methods need the context to be current.

    `watch` takes the seconds of "bake" and "upload".
    """

    def __init__(self, context: Context, budget: int, watch: Stopwatch | None = None) -> None:
        self._context, self._gl = context, context.gl
        self._watch = watch or Stopwatch()
        self.budget = budget
        self._longest = int(self._gl.info["GL_MAX_3D_TEXTURE_SIZE"])
        self._largest = largest_texture(context)
        self._held: dict[Triple, _Held] = {}
        self._tables: dict[str, moderngl.Texture] = {}
        self._tables_of: BakedTexture | None = None
        self._layout: tuple[Any, ...] | None = None
        self._baked: BakedTexture | None = None
        self._texels: tuple[Any, ...] = ()
        self._clock = 0
        self._drawn: set[Triple] = set()  # positions of the bricks that have been drawn with these texels
        self.bricks: list[Brick] = []
        self.uploads = 0

    def prepare(
        self, baked: BakedTexture, volume: Volume, texels: tuple[Any, ...], margin: Triple, alone: bool = True
    ) -> None:
        """Say what is drawn next: `texels` names what its texels are made of; `margin` is what a brick needs around it.

        A volume that is not drawn `alone` is in bricks only where it must be.

        Raises
        ------
        NoRoomError
            If the budget has no room for any brick.
        """
        if not same(texels, self._texels):
            self._drawn.clear()
        layout = (volume.dimensions, baked.formats, volume.nearest)
        bricks = self._cut(volume, bytes_of_sample(baked), margin, alone)
        if layout != self._layout or bricks != self.bricks:
            self.release()
        self._layout, self.bricks, self._baked, self._texels = layout, bricks, baked, texels
        if self._tables_of is not baked:
            self._release_tables()
            self._tables = {name: new_table(self._gl, name, numbers) for name, numbers in baked.tables.items()}
            self._tables_of = baked

    def resources(self, brick: Brick) -> dict[str, moderngl.Texture | moderngl.Texture3D]:
        """The brick's texture and the tables by the names of their samplers; uploaded if they are not there."""
        held = self._held.get(brick.position)
        if held is None:
            held = self._held[brick.position] = self._held_for(brick)
        self._clock += 1
        held.used = self._clock
        if held.texels is None or not same(held.texels, self._texels):
            held.texels = None
            self._write(held, brick)
            held.texels = self._texels
        self._drawn.add(brick.position)
        return {**held.textures, **self._tables}

    @property
    def bytes(self) -> int:
        """Bytes of the textures on the device."""
        return self._bytes_of(held.textures["texels"].size for held in self._held.values())

    @property
    def bytes_of_all(self) -> int:
        """Bytes of the textures of all bricks together."""
        return self._bytes_of(brick.texture_size for brick in self.bricks)

    def release(self) -> None:
        """Release all textures."""
        for held in self._held.values():
            for texture in held.textures.values():
                texture.release()
        self._held.clear()
        self._release_tables()
        self.bricks, self._layout = [], None

    def _release_tables(self) -> None:
        for table in self._tables.values():
            table.release()
        self._tables, self._tables_of = {}, None

    def _cut(self, volume: Volume, bytes_per_sample: int, margin: Triple, alone: bool) -> list[Brick]:
        total = float(np.prod(volume.dimensions, dtype=float)) * bytes_per_sample
        is_large = alone and total > _LARGE
        if total <= min(self.budget, self._largest) and max(volume.dimensions) <= self._longest and not is_large:
            return [whole(volume)]
        most = min(self.budget / _BRICKS_IN_BUDGET, self._largest, _LARGE_BRICK if is_large else self._largest)
        size = None
        if is_large and max(volume.dimensions) <= self._longest:
            size = layered_size(volume.dimensions, margin, bytes_per_sample, most)
        size = size or texture_size(volume.dimensions, margin, bytes_per_sample, most, self._longest)
        return cut(volume.dimensions, size, margin)

    def _held_for(self, brick: Brick) -> _Held:
        """Textures for a brick: new ones while there is room, or else those of another brick."""
        baked = self._baked
        assert baked is not None, "nothing has been prepared"
        is_first = brick.position not in self._drawn
        room = min(self.budget, _AT_FIRST) if is_first else self.budget
        if self._held and self.bytes + self._bytes_of([brick.texture_size]) > room:
            # All are wanted once a picture, so that the last one used is the one not wanted for longest. In the first
            # few textures of many all follow each other, and drawing from the first one used is most likely finished.
            choose = max if room == self.budget else min
            return _Held(self._held.pop(choose(self._held, key=lambda position: self._held[position].used)).textures)
        return _Held(new_textures(self._context, baked, brick.texture_size))

    def _write(self, held: _Held, brick: Brick) -> None:
        assert self._baked is not None
        self.uploads += 1
        write_texels(held.textures, self._baked, brick, brick.stored_first, self._watch)

    def _bytes_of(self, sizes: Iterable[Triple]) -> int:
        assert self._baked is not None, "nothing has been prepared"
        return sum(math.prod(size) for size in sizes) * bytes_of_sample(self._baked)


def new_textures(context: Context, baked: BakedTexture, size: Triple) -> dict[str, moderngl.Texture3D]:
    """Textures for texels of a size, by the names of their samplers.

    Raises
    ------
    InputError
        If the driver has no room for them.
    """
    textures: dict[str, moderngl.Texture3D] = {}
    try:
        for name, (texel_format, components) in baked.formats.items():
            if baked.volume.nearest:
                textures[name] = _new_texture(context.gl, size, texel_format, components, nearest=True)
            else:
                textures[name] = interpolated_texture(context, size, texel_format, components)
    except InputError:
        for texture in textures.values():
            texture.release()
        raise
    return textures


def interpolated_texture(context: Context, size: Triple, texel_format: str, components: int) -> moderngl.Texture3D:
    """Return a texture that is interpolated between texels, as exactly as the driver can.

    Raises
    ------
    InputError
        If the driver has no room for it.
    """
    texture = _new_texture(context.gl, size, texel_format, components, nearest=False)
    if texel_format == "r8" and is_software(context):
        context.interpolate_in_single_precision(texture)
    return texture


def _new_texture(
    gl: moderngl.Context, size: Triple, texel_format: str, components: int, nearest: bool
) -> moderngl.Texture3D:
    try:
        texture = gl.texture3d(size, components, alignment=1, dtype=MODERNGL_TYPES[texel_format])
        failed = gl.error == "GL_OUT_OF_MEMORY"
    except moderngl.Error:
        failed = True
    if failed:
        nx, ny, nz = size
        megabytes = nx * ny * nz * BYTES[texel_format] / 1e6
        raise InputError(f"this driver has no room for {nx} x {ny} x {nz} texels, {megabytes:.0f} MB")
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST) if nearest else (moderngl.LINEAR, moderngl.LINEAR)
    return texture


def new_table(gl: moderngl.Context, name: str, numbers: NDArray[np.float32]) -> moderngl.Texture:
    """Return a two-dimensional texture of numbers, shape (rows, columns, 4), for a sampler of some name."""
    rows, columns, components = numbers.shape
    table = gl.texture((columns, rows), components, np.ascontiguousarray(numbers), dtype="f4")
    table.repeat_x = table.repeat_y = False
    kind = moderngl.LINEAR if name == SMOOTHED else moderngl.NEAREST
    table.filter = kind, kind
    return table


def write_texels(
    textures: Mapping[str, moderngl.Texture3D],
    baked: BakedTexture,
    brick: Brick,
    first: Triple,
    watch: Stopwatch,
    ready: Mapping[str, NDArray] | None = None,
) -> None:
    """Bake and upload slice after slice what a brick stores, which begins at the sample `first` of the baked volume.

    `ready` has its texels if they have been baked already.
    """
    nx, ny, nz = (last - before for before, last in zip(brick.stored_first, brick.stored_last, strict=True))
    x0, y0, z0 = first
    depth = max(1, _SLICE_BYTES // (nx * ny * bytes_of_sample(baked)))
    for start in range(0, nz, depth):
        end = min(start + depth, nz)
        box = (slice(z0 + start, z0 + end), slice(y0, y0 + ny), slice(x0, x0 + nx))
        with watch.timed("bake"):
            baked_texels = baked.all_texels(box) if ready is None else {name: each[box] for name, each in ready.items()}
        with watch.timed("upload"):
            for name, texels in baked_texels.items():
                _write(textures[name], texels, (0, 0, start))
                x, y, z = brick.has_room_beyond
                for edge, place in _edges(texels, (z and end == nz, y, x)):
                    _write(textures[name], edge, (place[2], place[1], start + place[0]))
        progress.advance((end - start) * ny * nx * seconds_of_sample(baked))


def seconds_of_sample(baked: BakedTexture) -> float:
    """Return about how long a sample takes on two cores to be baked and uploaded."""
    estimator = getattr(baked, "estimator", None)
    if estimator is not None:
        return SECONDS_OF_A_GRADIENT + seconds_of(baked.volume, estimator) / max(baked.volume.size, 1)
    return SECONDS_OF_A_LIT_SAMPLE if getattr(baked, "samples", None) is not None else SECONDS_OF_A_SAMPLE


def bytes_of_sample(baked: BakedTexture) -> int:
    """Return the bytes of one sample in all textures."""
    return sum(BYTES[texel_format] for texel_format, _ in baked.formats.values())


def _write(texture: moderngl.Texture3D, texels: NDArray, first: Triple) -> None:
    """Upload texels, shape (nz, ny, nx, components), to a place of a texture."""
    layers, rows, columns, _ = texels.shape
    texture.write(np.ascontiguousarray(texels), viewport=(*first, columns, rows, layers), alignment=1)


def _edges(texels: NDArray, room: Sequence[bool]) -> Iterator[tuple[NDArray, Triple]]:
    """Yield the last texels along z, y, x once more where there is `room`, and their places, along z, y, x, behind all.

    Clamping at the edge of a texture does so where the volume ends.
    """
    for axis in range(3):
        if room[axis]:
            last = [slice(None)] * 3
            last[axis] = slice(-1, None)
            pad = [(0, int(room[later] and later > axis)) for later in range(3)]
            place = [0, 0, 0]
            place[axis] = texels.shape[axis]
            yield np.pad(texels[tuple(last)], [*pad, (0, 0)], mode="edge"), (place[0], place[1], place[2])


def same(one: Sequence[Any], other: Sequence[Any]) -> bool:
    """True if two cache keys are equal: objects by identity, numbers and names by value."""
    return len(one) == len(other) and all(
        a is b or (isinstance(a, float | str) and a == b) for a, b in zip(one, other, strict=True)
    )


def largest_texture(context: Context) -> int:
    """Bytes of the largest texture that the driver makes, as far as is known."""
    return _SOFTWARE_TEXTURE if is_software(context) else 1 << 62


def default_budget(context: Context) -> int:
    """Bytes: half of what is free."""
    return _free(context) // 2


def _free(context: Context) -> int:
    if is_software(context):
        return free_memory()
    for name in (_NVIDIA_FREE, _AMD_FREE):
        kibibytes = context.integer(name)
        if kibibytes > 0:
            return kibibytes << 10
    return _UNKNOWN


def is_software(context: Context) -> bool:
    return any(name in context.renderer.lower() for name in ("llvmpipe", "softpipe", "swrast"))
