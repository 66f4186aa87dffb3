"""Textures of the parts of a large volume on the device: each of one brick, from samples that are forgotten then.

A part that has been drawn is kept for the next picture while there is room. In a picture that needs more than there is
room for, parts follow each other in the same few textures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import Context
from texvol.opengl.empty_space import EmptySpace
from texvol.opengl.texture_store import (
    BakedTexture,
    Stopwatch,
    bytes_of_sample,
    new_table,
    new_textures,
    same,
    write_texels,
)
from texvol.opengl.value_bounds import Bounds, ValueBounds
from texvol.scene.scene import Classification
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick, Triple
from texvol.textures.slab_texture import SlabTexture
from texvol.textures.spread_texture import SpreadTexture
from texvol.textures.value_storage import keep_bulk
from texvol.textures.value_texture import ValueTexture

_AT_FIRST = 64 << 20  # bytes of the textures that follow each other where there is no room for all


@dataclass
class Prepared:
    """Texels and empty space of a brick, prepared without the context, by any thread."""

    baked: BakedTexture
    empty_space: EmptySpace | None  # its own; None where it has none
    shown: NDArray[np.float64] | None  # corners of what may show, in fractions of the box; None if nothing does
    texels: dict[str, NDArray] | None  # by the names of their samplers; None: made slice by slice as they are uploaded
    bounds: Bounds | None = None  # of the cells that a ray skips in modes mip and minip


@dataclass
class Part:
    """One brick on the device."""

    brick: Brick
    texels: tuple[Any, ...]  # what they are made of
    baked: BakedTexture
    textures: dict[str, moderngl.Texture3D]
    tables: dict[str, moderngl.Texture]
    empty_space: EmptySpace | None
    shown: NDArray[np.float64] | None  # corners of what may show, in fractions of the box; None if nothing does
    bytes: int
    view: str = ""  # the only one of which it holds what shows; "" if it holds all
    bounds: ValueBounds | None = None

    def resources(self, brick: Brick) -> dict[str, moderngl.Texture | moderngl.Texture3D]:
        """Return textures and tables by the names of their samplers."""
        return {**self.textures, **self.tables}

    @property
    def bricks(self) -> list[Brick]:
        """The one brick."""
        return [self.brick]

    @property
    def bytes_of_all(self) -> int:
        """Bytes of its textures."""
        return self.bytes

    @property
    def cells(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Cells per box, and where the first one lies, in cells from the corner of the box."""
        assert self.empty_space is not None
        count = np.array(self.brick.stored_last) - np.array(self.brick.stored_first)
        per_sample = np.array(self.empty_space.cells_per_box) / count
        per_box, first = per_sample * self.brick.samples_per_box, per_sample * self.brick.samples_before
        return _floats(per_box), _floats(first)


class PartStore:
    """Parts on the device, at most `budget` bytes of texels; methods need the context to be current."""

    def __init__(self, context: Context, budget: int, watch: Stopwatch) -> None:
        self._context, self._gl, self._budget, self._watch = context, context.gl, budget, watch
        self._tables = _Tables(context.gl)
        self._parts: dict[tuple[Triple, int], Part] = {}  # by position and level, the last one used last
        self._drawn: set[tuple[Triple, int]] = set()
        self.uploads = 0

    def known(
        self, brick: Brick, texels: tuple[Any, ...], classification: Classification, view: str = ""
    ) -> Part | None:
        """Return the part of a brick if it is there; values are classified in another way where that is wanted.

        Parts that hold only what one view shows are returned for that view.
        """
        part = self._parts.get((brick.position, brick.level))
        if part is None or part.brick != brick or not same(part.texels, texels) or part.view not in ("", view):
            return None
        self._parts[brick.position, brick.level] = self._parts.pop((brick.position, brick.level))
        if isinstance(part.baked, ValueTexture):
            baked = part.baked.classified(classification)
            if baked is not part.baked:
                part.baked = baked
                self._make_tables(part)
        return part

    def added(
        self,
        brick: Brick,
        texels: tuple[Any, ...],
        prepared: Prepared,
        everything: bool,
        view: str = "",
    ) -> Part:
        """Upload a brick.

        Parameters
        ----------
        texels : tuple
            Names what its texels are made of.
        prepared : Prepared
        everything : bool
            True if all parts of the picture have room.
        view : str
            Names the view which alone shows no more of the brick than was read; "" if all was.
        """
        baked = prepared.baked
        part = Part(brick, texels, baked, {}, {}, prepared.empty_space, prepared.shown, 0, view)
        if part.shown is not None:
            self._fill(part, prepared.texels, everything)
            if prepared.bounds is not None:
                part.bounds = ValueBounds(self._gl)
                part.bounds.upload(prepared.bounds)
        old = self._parts.pop((brick.position, brick.level), None)
        if old is not None:
            self._release(old)
        # Its samples are not needed any more, and texels are on the device.
        part.baked = _without_samples(baked)
        if part.empty_space is not None:
            part.empty_space.forget_samples(part.baked.volume)
        self._parts[brick.position, brick.level] = part
        return part

    @property
    def bytes(self) -> int:
        """Bytes of the texels on the device."""
        return sum(part.bytes for part in self._parts.values())

    @property
    def count(self) -> int:
        """Number of parts on the device."""
        return sum(bool(part.textures) for part in self._parts.values())

    def release(self) -> None:
        """Release everything on the device."""
        for part in self._parts.values():
            self._release(part)
        self._parts.clear()

    def _fill(self, part: Part, texels: dict[str, NDArray] | None, everything: bool) -> None:
        baked, size = part.baked, part.brick.texture_size
        part.bytes = math.prod(size) * bytes_of_sample(baked)
        key = part.brick.position, part.brick.level
        is_again = everything and key in self._drawn
        room = self._budget if is_again else min(self._budget, _AT_FIRST)
        self._drawn.add(key)
        wanted = {name: (size, *kind) for name, kind in baked.formats.items()}
        while self._parts and self.bytes + part.bytes > room:
            oldest = next(iter(self._parts))
            old = self._parts.pop(oldest)
            if not part.textures and wanted == {
                name: (texture.size, *old.baked.formats[name]) for name, texture in old.textures.items()
            }:
                part.textures, old.textures = old.textures, {}
            self._release(old)
        if not part.textures:
            part.textures = new_textures(self._context, baked, size)
        write_texels(part.textures, baked, part.brick, (0, 0, 0), self._watch, texels)
        self.uploads += 1
        self._make_tables(part)

    def _make_tables(self, part: Part) -> None:
        self._tables.release(part.tables)
        part.tables = self._tables.of(part.baked) if part.textures else {}

    def _release(self, part: Part) -> None:
        for texture in part.textures.values():
            texture.release()
        self._tables.release(part.tables)
        if part.empty_space is not None:
            part.empty_space.release()
        if part.bounds is not None:
            part.bounds.release()


class _Tables:
    """Tables on the device; parts of the same one share it."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._kept: dict[int, tuple[NDArray, moderngl.Texture, int]] = {}  # numbers, texture and users, by the numbers

    def of(self, baked: BakedTexture) -> dict[str, moderngl.Texture]:
        """Return the tables of a baked texture by the names of their samplers."""
        tables = {}
        for name, numbers in baked.tables.items():
            _, table, users = self._kept.get(id(numbers)) or (numbers, new_table(self._gl, name, numbers), 0)
            self._kept[id(numbers)] = numbers, table, users + 1
            tables[name] = table
        return tables

    def release(self, tables: dict[str, moderngl.Texture]) -> None:
        """Release those that no part uses any more."""
        for key, (numbers, table, users) in list(self._kept.items()):
            if any(table is each for each in tables.values()):
                self._kept[key] = numbers, table, users - 1
                if users == 1:
                    del self._kept[key]
                    table.release()


def shown_part(empty_space: EmptySpace, brick: Brick) -> NDArray[np.float64] | None:
    """Return the corners of what may show of a brick, in fractions of the box, (2, 3); None if nothing does."""
    part = empty_space.visible_box
    if part is None:
        return None
    count = np.array(brick.stored_last) - np.array(brick.stored_first)
    return np.clip((brick.samples_before + part * count) / brick.samples_per_box, 0.0, 1.0)


def _without_samples(baked: BakedTexture) -> BakedTexture:
    """Return what was baked with what programs ask of its values, and without these."""
    volume = baked.volume
    known = {name: getattr(volume, name) for name in ("has_missing", "finite_range", "value_range")}
    empty = Volume.__new__(Volume)
    empty.__dict__.update(volume.__dict__ | known)
    empty.values = np.broadcast_to(np.zeros((), volume.dtype), volume.shape)
    keep_bulk(volume, empty)
    if isinstance(baked, SlabTexture):
        return replace(baked, volume=empty, samples=None)
    if isinstance(baked, SpreadTexture):
        return replace(baked, volume=empty, spread=baked.spread.without_samples)
    return replace(baked, volume=empty)


def _floats(triple: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in triple)
    return x, y, z
