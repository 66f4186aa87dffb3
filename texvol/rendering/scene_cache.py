"""GPU cache of a scene: the textures of its volumes, the shadows between them, its surfaces."""

from __future__ import annotations

from texvol.opengl.compositor import Drawing
from texvol.opengl.contexts import Context
from texvol.opengl.projection import projection_of
from texvol.opengl.shadows import Shadows
from texvol.opengl.stopwatch import Stopwatch
from texvol.opengl.surfaces.cache import DrawnGeometry
from texvol.rendering.render import Part
from texvol.rendering.settings import Settings, color_scale_of, most_light_of, stored_scene
from texvol.rendering.volume_cache import MediumOnDevice
from texvol.scene.scene import Scene
from texvol.textures.value_texture import ValueTexture


class SceneOnDevice:
    """GPU cache of the scene that was drawn last; methods need the context to be current.

    Parameters
    ----------
    budget : int
        Bytes that the textures of a volume may take.
    """

    def __init__(self, context: Context, budget: int) -> None:
        self._context, self._budget = context, budget
        self.medium = [MediumOnDevice(context, budget)]
        self._shadows = Shadows(context, budget)
        self._geometry = DrawnGeometry(context)
        self.watch = Stopwatch(lambda: [medium.textures for medium in self.medium])

    @property
    def lost_digits(self) -> float:
        """`MatterOnDevice.lost_digits`, the most of all volumes."""
        return max(medium.lost_digits for medium in self.medium)

    def rounding(self, scene: Scene) -> float:
        """`MatterOnDevice.rounding` of all volumes."""
        return sum(medium.rounding(scene) for medium in self.medium)

    def parts(self, scene: Scene, size: tuple[int, int], settings: Settings, depth: bool = False) -> list[Part]:
        """The scene's volumes as they are drawn, each with its textures."""
        scenes = scene.each_alone(scene.camera_for(size))
        self._have_medium(len(scenes))
        with self.watch.timed("bake"):
            each_with = zip(self.medium, scenes, strict=True)
            scenes = tuple(medium.drawn_scene(alone, scene, size, settings) for medium, alone in each_with)
        media = [(each, medium.transfer_function(each)) for each, medium in zip(scenes, self.medium, strict=True)]
        scale = color_scale_of(media)
        with self.watch.timed("bake"):
            light_transmittance = self._shadows.prepare(media, settings.slab_thickness)
        surfaces = None if depth else self._geometry.prepare(scene, size, settings.slab_thickness)
        parts = []
        for number, (alone, medium) in enumerate(zip(scenes, self.medium, strict=True)):
            stored = stored_scene(alone)
            with self.watch.timed("bake"):
                baked = medium.prepare(
                    stored, size, settings, light_transmittance[number] if light_transmittance else None
                )
            skips = medium.empty_space.skips if settings.skips(alone) else None
            projection = projection_of(alone, depth=depth)
            lit_when_drawn = isinstance(baked, ValueTexture) and not projection
            lighting = scene.lighting if lit_when_drawn else None
            drawing = Drawing(
                baked,
                alone.volume,
                alone.camera_for(size),
                settings.slab_thickness,
                size,
                1.0 if projection else scale,
                settings.early_termination / most_light_of(media),
                skips,
                medium.empty_space.cells_per_box if skips else (1.0, 1.0, 1.0),
                lighting=projection.lighting if projection else lighting,
                depth_cue=alone.depth_cue if not projection or projection.lighting else None,
                projection=projection,
                light_transmittance=self._shadows.textures[number] if light_transmittance and lit_when_drawn else None,
                cutting=scene.cutting,
                surfaces=surfaces,
                origin=scene.volume.centre,
            )
            parts.append(Part(drawing, medium.textures, medium.visible_part(alone, settings)))
        return parts

    def _have_medium(self, count: int) -> None:
        """As many as a scene has volumes."""
        while len(self.medium) > count:
            self.medium.pop().release()
        while len(self.medium) < count:
            self.medium.append(MediumOnDevice(self._context, self._budget))

    def release(self) -> None:
        """Give everything back."""
        for medium in self.medium:
            medium.release()
        self._shadows.release()
        self._geometry.release()
