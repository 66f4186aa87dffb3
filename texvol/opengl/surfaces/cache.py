"""What draws geometry, once a scene has some: until then nothing is imported, compiled or allocated for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from texvol.scene.scene import Scene

if TYPE_CHECKING:
    from texvol.opengl.contexts import Context
    from texvol.opengl.surfaces.surfaces import Surfaces


class DrawnGeometry:
    """The `Surfaces` of a context, or none yet."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._surfaces: Surfaces | None = None

    def prepare(self, scene: Scene, size: tuple[int, int], slab_thickness: float) -> Surfaces | None:
        """The scene's shapes, ready for a picture of (width, height) pixels; None where it has none."""
        if not scene.geometry:
            return None
        if self._surfaces is None:
            from texvol.opengl.surfaces.surfaces import Surfaces

            self._surfaces = Surfaces(self._context.gl)
        self._surfaces.prepare(scene, size, slab_thickness)
        return self._surfaces

    def release(self) -> None:
        """Give everything back."""
        if self._surfaces is not None:
            self._surfaces.release()
        self._surfaces = None
