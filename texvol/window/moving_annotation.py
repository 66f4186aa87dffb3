"""Annotation over pictures that move: at the window's resolution, whatever that of the picture below it."""

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

    def draw(self, textures: Textures | None, corner: Size, size: Size, number: int, shown: Shown) -> None:
        """Draw a picture that comes with its opacity, and its annotation, into the window's framebuffer.

        `corner` is the upper left corner of the picture in the window, and `size` its size, in pixels; pictures with
        the same `number` are the same.
        """
        assert textures is not None and shown.wanted is not None
        gl, showing = textures.gl, shown.wanted.showing
        if self._known is None or self._known[0] != (number, size):
            how: dict[str, Any] = {"transparent": showing.transparent, "window": shown.metadata.get("window")}
            parts = self._drawer.parts(shown.wanted.scene, size, showing.annotation, **how)
            self._known = (number, size), parts
        if self._overlay is None:
            self._overlay = Overlay(gl)
        parts = self._known[1]
        texture = textures.texture("moving", number, lambda: shown.pixels)
        before = gl.viewport
        textures.target.use()
        gl.viewport = corner[0], before[3] - corner[1] - size[1], *size
        self._overlay.draw(texture, size, parts.lines, parts.patches, shown.wanted.scene.background)
        gl.viewport = before
