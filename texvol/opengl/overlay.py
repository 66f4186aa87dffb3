"""Overlay: a picture drawn into a window, and lines and patches over it, composited in linear light by the device.

A patch is a small premultiplied picture, such as a word. Patches are kept in an atlas, one texture for all.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.shaders import FOLDER, Programs, bind, draw_triangles

Triple = tuple[float, float, float]
_SIDE = 1024  # texels of the atlas along each side at first
_APART = 1  # texels between patches
_AROUND = 1.5  # pixels around a line that it may cover in part
_OF_LINES = ("in_position", "in_line", "in_kind", "in_look")
_CORNERS = np.array([(0, 0), (1, 0), (0, 1), (0, 1), (1, 0), (1, 1)], np.float32)  # of two triangles
_WHOLE = np.array([[0, 0, 1, 1]], np.float32)


class Patch(NamedTuple):
    """Premultiplied linear colours, shape (height, width, 4), with their upper left pixel in the picture.

    Patches with the same key have the same colours.
    """

    key: Hashable
    colors: NDArray[np.floating]
    left: int
    top: int


class Line(NamedTuple):
    """Line between two points of the picture, in pixels from its upper left corner; `behind` the medium or over it.

    The colour is linear, the width in pixels; `under` is the opacity of the same line drawn before it, 0 if there is
    none.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    color: Triple
    width: float
    opacity: float = 1.0
    behind: bool = False
    under: float = 0.0


class Overlay:
    """Programs and the atlas on one context, which is current."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._programs = Programs(gl, FOLDER)
        self._atlas: moderngl.Texture | None = None
        self._layer: tuple[moderngl.Framebuffer, moderngl.Framebuffer] | None = None  # of parts, and of their sRGB
        self._places: dict[Hashable, tuple[int, int]] = {}
        self._free = (0, 0, 0)  # next free texel, and the row below the patches beside it

    def draw(
        self,
        picture: moderngl.Texture,
        size: tuple[int, int],
        lines: Sequence[Line],
        patches: Sequence[Patch],
        background: Triple,
        filled: NDArray[np.float32] = _WHOLE,
    ) -> None:
        """Draw a picture of sRGB and opacity, top row first, and its annotation, into a viewport of `size` pixels.

        `background` is what is behind the medium, in linear light. Lines are drawn in their order, then patches. Of the
        picture itself only the rectangles `filled` are drawn: left, top, right, bottom, from 0 to 1.
        """
        self._gl.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._picture(0, {"picture": picture}, size, filled)
        self._parts(size, lines, patches, {"picture": picture}, {"background": background})

    def layer(self, size: tuple[int, int], lines: Sequence[Line], patches: Sequence[Patch]) -> moderngl.Texture:
        """Return annotation without a picture as a texture of sRGB with straight opacity, bottom row first.

        Lines behind the medium are left out. The texture holds until the next call; another framebuffer and viewport
        are current then.
        """
        if self._layer is None or self._layer[0].size != size:
            self._release_layer()
            kinds = [self._gl.texture(size, 4, dtype=dtype) for dtype in ("f2", "f1")]
            self._layer = self._gl.framebuffer(kinds[0]), self._gl.framebuffer(kinds[1])
        parts, shown = self._layer
        self._gl.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        parts.use()
        parts.clear()
        self._parts(size, [line for line in lines if not line.behind], patches, {}, {})
        self._gl.disable(moderngl.BLEND)
        shown.use()
        (texture,) = parts.color_attachments
        assert isinstance(texture, moderngl.Texture)
        self._picture(3, {"parts": texture}, size, _WHOLE)
        (texture,) = shown.color_attachments
        assert isinstance(texture, moderngl.Texture)
        return texture

    def _picture(
        self, part: int, textures: dict[str, moderngl.Texture], size: tuple[int, int], filled: NDArray[np.float32]
    ) -> None:
        """Draw rectangles of a picture."""
        if len(filled):
            corners = filled[:, np.newaxis, :2] + _CORNERS * (filled[:, np.newaxis, 2:] - filled[:, np.newaxis, :2])
            vertices = (corners * size).astype(np.float32)
            self._part(part, textures, {"size": size}, vertices, "2f", "in_position")

    def _parts(
        self,
        size: tuple[int, int],
        lines: Sequence[Line],
        patches: Sequence[Patch],
        picture: dict[str, moderngl.Texture],
        background: dict[str, object],
    ) -> None:
        """Blend lines and patches with a picture over its background, or with each other if there is none."""
        self._gl.enable(moderngl.BLEND)
        self._gl.blend_equation = moderngl.FUNC_ADD, moderngl.FUNC_ADD
        self._gl.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        if lines:
            vertices = _vertices_of_lines(lines)
            self._part(2, picture, {"size": size, **background}, vertices, "2f 4f 4f 4f", *_OF_LINES)
        if patches:
            vertices = np.concatenate([*map(self._vertices_of, self._placed(patches))])
            assert self._atlas is not None
            textures = {**picture, "atlas": self._atlas}
            self._part(1, textures, {"size": size}, vertices, "2f 2f", "in_position", "in_texel")

    def _release_layer(self) -> None:
        """Release the framebuffers of the layer."""
        if self._layer is not None:
            self._gl.screen.use()  # moderngl binds the last framebuffer again, also one that is gone
            for each in self._layer:
                for texture in each.color_attachments:
                    texture.release()
                each.release()
            self._layer = None

    def release(self) -> None:
        """Release everything on the device."""
        self._programs.release()
        self._release_layer()
        if self._atlas is not None:
            self._atlas.release()
            self._atlas = None

    def _part(
        self,
        part: int,
        textures: dict[str, moderngl.Texture],
        uniforms: dict[str, object],
        vertices: NDArray[np.float32],
        layout: str,
        *attributes: str,
    ) -> None:
        layer = int(part in (1, 2) and "picture" not in textures)
        program = self._programs.program("overlay", {"PART": part, "LAYER": layer}, "overlay.vert")
        bind(program, textures, uniforms)
        draw_triangles(self._gl, program, vertices, layout, *attributes)

    def _placed(self, patches: Sequence[Patch]) -> Iterable[Patch]:
        """Return the patches after each has got a place in the atlas; a full atlas is begun anew."""
        if not all(self._place(patch) for patch in patches):
            self._begin(patches)
            assert all(self._place(patch) for patch in patches), "the atlas has room for all patches of a picture"
        return patches

    def _begin(self, patches: Sequence[Patch]) -> None:
        """Make an empty atlas with room for all of these patches."""
        side = self._atlas.size[0] if self._atlas is not None else _SIDE
        sizes = [(patch.colors.shape[0] + _APART, patch.colors.shape[1] + _APART) for patch in patches]
        while side < max(map(max, sizes)) or not _fit(sizes, side):
            side *= 2
        if self._atlas is None or self._atlas.size[0] != side:
            if self._atlas is not None:
                self._atlas.release()
            self._atlas = self._gl.texture((side, side), 4, dtype="f2")
        self._places, self._free = {}, (0, 0, 0)

    def _place(self, patch: Patch) -> bool:
        """Upload a patch unless it is there; return False if the atlas has no room."""
        if patch.key in self._places:
            return True
        if self._atlas is None:
            return False
        height, width, _ = patch.colors.shape
        found = _next(self._free, (height + _APART, width + _APART), self._atlas.size[0])
        if found is None:
            return False
        (left, top), self._free = found
        self._places[patch.key] = left, top
        colors = np.ascontiguousarray(patch.colors, np.float16)
        self._atlas.write(colors, viewport=(left, top, width, height), alignment=1)
        return True

    def _vertices_of(self, patch: Patch) -> NDArray[np.float32]:
        height, width, _ = patch.colors.shape
        corners, texel = _CORNERS * (width, height), self._places[patch.key]
        return np.column_stack([corners + (patch.left, patch.top), corners + texel]).astype(np.float32)


def _next(
    free: tuple[int, int, int], size: tuple[int, int], side: int
) -> tuple[tuple[int, int], tuple[int, int, int]] | None:
    """Return the place of a patch of (height, width) texels and what is free then; None if there is no room."""
    (left, top, below), (height, width) = free, size
    if left + width > side:
        left, top = 0, below
    if left + width > side or top + height > side:
        return None
    return (left, top), (left + width, top, max(below, top + height))


def _fit(sizes: Sequence[tuple[int, int]], side: int) -> bool:
    """True if patches of these sizes have room in an empty atlas."""
    free: tuple[int, int, int] = (0, 0, 0)
    for size in sizes:
        found = _next(free, size, side)
        if found is None:
            return False
        free = found[1]
    return True


def _vertices_of_lines(lines: Sequence[Line]) -> NDArray[np.float32]:
    """Return two triangles for each line: position, place on the line, its kind and its look."""
    start = np.array([line.start for line in lines], np.float64)
    span = np.array([line.end for line in lines], np.float64) - start
    length = np.linalg.norm(span, axis=1)
    along = span / np.maximum(length, 1e-9)[:, np.newaxis]
    across = along[:, ::-1] * (-1, 1)
    reach = np.array([[line.width / 2 + _AROUND] for line in lines])
    onward = _CORNERS[:, 0] * (length[:, np.newaxis] + 2 * reach) - reach
    aside = (2 * _CORNERS[:, 1] - 1) * reach
    positions = start[:, np.newaxis] + onward[..., np.newaxis] * along[:, np.newaxis]
    positions = positions + aside[..., np.newaxis] * across[:, np.newaxis]
    looks = np.array([(line.behind, line.under, *line.color, line.width) for line in lines], np.float64)
    flat = np.column_stack([length, [line.opacity for line in lines], along, looks])
    each = np.repeat(flat[:, np.newaxis], len(_CORNERS), axis=1)
    numbers = np.concatenate([positions, aside[..., np.newaxis], onward[..., np.newaxis], each], axis=2)
    return numbers.reshape(-1, 14).astype(np.float32)
