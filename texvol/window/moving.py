"""Annotation over pictures that move: at the window's resolution, whatever that of the picture below it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from texvol.annotation.quick import Parts, QuickAnnotation
from texvol.opengl.overlay import Overlay
from texvol.window.director import Shown

if TYPE_CHECKING:
    from texvol.window.desk import Desk


class MovingAnnotation:
    """Annotation of the last picture, and the programs that draw it; the window's context is current."""

    def __init__(self) -> None:
        self._overlay: Overlay | None = None
        self._drawer = QuickAnnotation()
        self._known: tuple[Any, Parts] | None = None

    def draw(self, desk: Desk, shown: Shown) -> None:
        """Draw a picture that comes with its opacity, and its annotation, into the window's framebuffer."""
        assert desk.textures is not None and shown.wanted is not None
        gl, size, wanted = desk.textures.gl, desk.pixels, shown.wanted
        key = desk.director.pictures, size
        if self._known is None or self._known[0] != key:
            self._known = key, self._drawer.parts(
                wanted.scene, size, wanted.showing.annotation,
                transparent=wanted.showing.transparent, window=shown.metadata.get("window"),
            )  # fmt: skip
        if self._overlay is None:
            self._overlay = Overlay(gl)
        parts = self._known[1]
        texture = desk.textures.texture("moving", desk.director.pictures, lambda: shown.pixels)
        before = gl.viewport
        gl.screen.use()
        gl.viewport = 0, before[3] - size[1], *size
        self._overlay.draw(texture, size, parts.lines, parts.patches, parts.look)
        gl.viewport = before
