"""Pictures in the window, and annotation that the window draws: over those that move, and over slices in the 3D view.

Annotation has the window's resolution, whatever that of the picture below.
"""

from __future__ import annotations

from typing import Any

from texvol.annotation.quick import Parts, QuickAnnotation
from texvol.opengl.overlay import Overlay
from texvol.window.director import Shown
from texvol.window.jobs import Size
from texvol.window.screen import Textures


class MovingAnnotation:
    """Annotation of the last picture, and the programs that draw it; the window's context is current."""

    def __init__(self) -> None:
        self._overlay: Overlay | None = None
        self._drawer = QuickAnnotation()
        self._known: tuple[Any, Parts] | None = None
        self._layer: tuple[Any, int] | None = None  # OpenGL name of the texture

    def draw(self, textures: Textures | None, corner: Size, size: Size, number: int, shown: Shown) -> None:
        """Draw a picture on its surroundings, and its annotation if it lacks that, into the window's framebuffer.

        `corner` is the upper left corner of the picture in the window, and `size` its size, in pixels; pictures with
        the same `number` are the same.
        """
        assert textures is not None and shown.wanted is not None
        gl, pixels = textures.gl, shown.pixels
        parts = self._parts(size, number, shown) if shown.lacks_annotation else Parts([], [])
        texture = textures.texture("picture", number, lambda: pixels)
        before = gl.viewport
        textures.target.use()
        gl.viewport = corner[0], before[3] - corner[1] - size[1], *size
        filled = shown.metadata["filled"]
        self._drawing(gl).draw(texture, size, parts.lines, parts.patches, shown.wanted.scene.background, filled)
        gl.viewport = before

    def layer(self, textures: Textures, size: Size, number: int, shown: Shown) -> int | None:
        """Return the OpenGL name of a texture of a picture's annotation alone; None if the picture has none.

        The texture has sRGB with straight opacity, bottom row first.
        """
        if shown.wanted is None or not shown.wanted.showing.annotation:
            return None
        if self._layer is None or self._layer[0] != (number, size):
            gl, parts = textures.gl, self._parts(size, number, shown)
            before = gl.viewport
            texture = self._drawing(gl).layer(size, parts.lines, parts.patches)
            textures.target.use()
            gl.viewport = before
            self._layer = (number, size), int(texture.glo)
        return self._layer[1]

    def _parts(self, size: Size, number: int, shown: Shown) -> Parts:
        assert shown.wanted is not None
        if self._known is None or self._known[0] != (number, size):
            showing = shown.wanted.showing
            how: dict[str, Any] = {"transparent": showing.transparent, "window": shown.metadata.get("window")}
            parts = self._drawer.parts(shown.wanted.scene, size, showing.annotation, **how)
            self._known = (number, size), parts
        return self._known[1]

    def _drawing(self, gl: Any) -> Overlay:
        if self._overlay is None:
            self._overlay = Overlay(gl)
        return self._overlay
