"""Cache of the surfaces of a scene; nothing is imported, compiled or allocated before a scene has some."""

from __future__ import annotations

from typing import TYPE_CHECKING

from texvol.scene.scene import CompleteScene

if TYPE_CHECKING:
    from texvol.opengl.contexts import Context
    from texvol.opengl.surfaces.surfaces import Surfaces


class SurfacesCache:
    """Surfaces of a context, made when a scene first has some."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._surfaces: Surfaces | None = None

    def prepare(self, scene: CompleteScene, size: tuple[int, int], slab_thickness: float) -> Surfaces | None:
        """Return the scene's shapes, ready for a picture of (width, height) pixels; None if it has none."""
        if not scene.geometry:
            return None
        if self._surfaces is None:
            from texvol.opengl.surfaces.surfaces import Surfaces

            self._surfaces = Surfaces(self._context.gl)
        self._surfaces.prepare(scene, size, slab_thickness)
        return self._surfaces

    def release(self) -> None:
        """Release everything on the device."""
        if self._surfaces is not None:
            self._surfaces.release()
        self._surfaces = None
