"""A Renderer keeps what pictures have in common: the context, the programs, the textures; and says what it did."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol import accuracy, error_control, slab_texture, slicing
from texvol.compositor import Compositor, Drawing
from texvol.contexts import Context, open_context
from texvol.display import NUMBER_MODES
from texvol.error_search import ErrorSearch, smaller
from texvol.errors import InputError, NoRoomError
from texvol.geometry.drawn import DrawnGeometry
from texvol.hidden_samples import without_hidden
from texvol.matter_on_device import MatterOnDevice, check_room
from texvol.modelled import modelled
from texvol.projection import depth_of, projection_of
from texvol.ranks import median
from texvol.recipe import Settings, color_scale_of, most_light_of, stored_scene
from texvol.render import Part, draw, over_background
from texvol.scene import Scene
from texvol.shadows import Shadows
from texvol.texture_memory import default_budget
from texvol.value_texture import ValueTexture

Size = tuple[int, int]
_REFERENCE_BYTES = 64 << 20  # of textures for a picture that an estimate is drawn from, at most


class Renderer:
    """Draws scenes on one OpenGL context; keeps the context, the programs and the textures of the last volume.

    Parameters
    ----------
    backend : "auto", "egl" or "osmesa"
    texture_memory : float, optional
        Megabytes (10⁶ bytes) that textures may take; half of what is free unless told. A volume whose texture is
        larger, or too large for the driver, is drawn in bricks.
    compositor : callable, optional
        Makes what composites, of the context: a Compositor of one's own.

    Raises
    ------
    ContextError
        If no OpenGL context can be made; the message holds each back end's reason.
    InputError
        If the texture memory is not positive.
    """

    def __init__(
        self,
        backend: str = "auto",
        *,
        texture_memory: float | None = None,
        compositor: Callable[[Context], Compositor] | None = None,
    ) -> None:
        if texture_memory is not None and not 0 < texture_memory < np.inf:
            raise InputError(f"texture memory must be positive and finite, and is {texture_memory:g} MB")
        self._context = open_context(backend)
        with self._context:
            self._compositor = (compositor or Compositor)(self._context)
            self._budget = int(texture_memory * 1e6) if texture_memory else default_budget(self._context)
            self._matter = [MatterOnDevice(self._context, self._budget)]
            self._shadows = Shadows(self._context, self._budget)
            self._geometry = DrawnGeometry(self._context)
            self._bricks_drawn = 0
        self._seconds: dict[str, float] = {}
        self._last: tuple[Scene, Size, Settings] | None = None
        self._stats: dict[str, Any] = {}
        self._estimate: float | None = None  # of the last picture's error, where it has been worked out
        self._notes: dict[float, tuple[dict[str, float], int]] = {}  # of pictures that may be chosen, by thickness
        self._error_search = ErrorSearch(self._noted, self._exactly)

    def render(
        self,
        scene: Scene,
        size: Size = (512, 512),
        *,
        slab_thickness: float | None = None,
        sampling_rate: float | None = None,
        max_error: float | None = None,
        texture_format: str = "auto",
        target_format: str = "auto",
        early_termination: float | None = None,
        skip_empty: bool = True,
        repeat: int = 1,
    ) -> NDArray[np.float32]:
        """The scene's picture: (height, width, 4) float32, premultiplied, linear, top row first.

        Parameters
        ----------
        size : (width, height)
            Pixels.
        slab_thickness : float
            World units; or `sampling_rate`, in slabs per smallest spacing (default 1); or
        max_error : float
            Maximum absolute error that is wanted of the linear picture against the integral of its classification:
            the thickness is chosen by drawing the scene at several. Where it can't be reached there is an
            AccuracyWarning, and `stats` says what was.
        texture_format, target_format : "auto", "rgba8", "rgba16f" or "rgba32f"
            `auto` is the smallest texture whose rounding does not show beside the discretisation error, in `post` of
            a halved volume where that hardly does either, and a float32 target.
        early_termination : float, optional
            A ray ends where it lets no more light through than this, which is the largest error that comes of it.
            2^-22 unless told; 0: never.
        skip_empty : bool
            Whether cells in which nothing shows are leapt over; the picture is the same.
        repeat : int
            How often to draw; `stats` has the median time.

        Raises
        ------
        InputError
            If an argument is out of range, or the volume or the picture too large for the driver.
        """
        size = self._compositor.checked_size(size)
        scene.check_unchanged()
        if scene.mask is not None:
            scene = without_hidden(scene)
        if texture_format not in ("auto", *slab_texture.TEXEL_FORMATS):
            raise InputError(f"texture format is auto, rgba8, rgba16f or rgba32f, and not {texture_format!r}")
        wanted = accuracy.checked(scene, slab_thickness, sampling_rate, max_error)
        termination = accuracy.checked_termination(early_termination, max_error)
        settings = Settings(wanted, texture_format, accuracy.checked_target(target_format), termination, skip_empty)
        self._seconds, self._stats, self._notes, self._estimate = {}, {}, {}, None
        with self._context:
            if max_error is not None:
                # Any rounding of texels would hide in the differences that the choice goes by.
                settings = replace(settings, texture_format="rgba32f") if texture_format == "auto" else settings
                choice = self._error_search.choose(scene, size, settings, max_error)
                settings = replace(settings, slab_thickness=choice.slab_thickness)
                picture, self._estimate = choice.picture, choice.estimated_error
                self._seconds, self._bricks_drawn = self._notes[choice.slab_thickness]
            if max_error is None or repeat > 1:
                picture = self._draw(scene, size, settings, repeat)
        self._last = (scene, size, settings)
        return picture if scene.mode in NUMBER_MODES else over_background(picture, scene.background)

    def foresee(self, scene: Scene, size: Size, max_error: float) -> error_control.Choice:
        """Where `render` will begin to look for that error: what a picture of a sixteenth of the pixels asks for."""
        termination, target = accuracy.checked_termination(None, max_error), accuracy.checked_target("auto")
        settings = Settings(0.0, "rgba32f", target, termination, skip_empty=True)
        scene = without_hidden(scene) if scene.mask is not None else scene
        with self._context:
            return self._error_search.foresee(scene, self._compositor.checked_size(size), settings, max_error)

    def depth(self) -> NDArray[np.float64]:
        """Depth of the last picture's isosurface, shape (height, width): along the view from the plane of the eye.

        In world units; infinite where a ray meets no surface. Geometry that stands in front of it does not count.

        Raises
        ------
        InputError
            If the last picture is not one of mode isosurface.
        """
        if self._last is None or self._last[0].mode != "isosurface":
            raise InputError("a depth is that of an isosurface, and the last picture has none")
        scene, size, settings = self._last
        with self._context:
            drawn = self._draw(scene, size, settings, depth=True)
        return depth_of(drawn, scene.volume, scene.camera_for(size), settings.slab_thickness)

    @property
    def stats(self) -> dict[str, Any]:
        """What the last `render` did, JSON-able, as `--stats` writes it.

        `estimated_error` is the maximum absolute error that is to be expected of the linear picture against the
        integral of its classification; it is worked out when first asked for, from two small pictures. So are
        `samples`, the slabs that were sampled, and `samples_total`, those that the rays cross in the box.
        """
        if self._last is None:
            return {}
        if not self._stats:
            self._stats = self._facts(*self._last)
        return self._stats

    @property
    def estimate(self) -> float | None:
        """Of the last picture's error, where that was wanted; unlike in `stats` nothing is drawn to know it."""
        return error_control.if_finite(self._estimate)

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments with which `render` draws the last picture again, every choice of accuracy made."""
        return asdict(self._last[2]) if self._last else {}

    @property
    def seconds(self) -> dict[str, float]:
        """What `stats` has under the same name, at once: `bake`, `upload`, `draw`, `read` of the last `render`."""
        return dict(self._seconds)

    @property
    def renderer_name(self) -> str:
        """What the driver calls itself (GL_RENDERER)."""
        return self._context.renderer

    @property
    def backend(self) -> str:
        """Where the context came from: "egl" or "osmesa"."""
        return self._context.backend

    def close(self) -> None:
        """Give everything back; closing twice is fine."""
        if self._context.released:
            return
        with self._context:
            for matter in self._matter:
                matter.release()
            self._shadows.release()
            self._geometry.release()
            self._compositor.release()
        self._context.release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _parts(self, scene: Scene, size: Size, settings: Settings, depth: bool = False) -> list[Part]:
        """The scene's volumes as they are drawn, each with its textures."""
        scenes = scene.each_alone(scene.camera_for(size))
        self._have_matter(len(scenes))
        with self._timed("bake"):
            each_with = zip(self._matter, scenes, strict=True)
            scenes = tuple(matter.drawn_scene(alone, scene, size, settings) for matter, alone in each_with)
        matters = [(each, matter.transfer_function(each)) for each, matter in zip(scenes, self._matter, strict=True)]
        scale = color_scale_of(matters)
        with self._timed("bake"):
            arriving = self._shadows.prepare(matters, settings.slab_thickness)
        surfaces = None if depth else self._geometry.prepare(scene, size, settings.slab_thickness)
        parts = []
        for number, (alone, matter) in enumerate(zip(scenes, self._matter, strict=True)):
            stored = stored_scene(alone)
            with self._timed("bake"):
                baked = matter.prepare(stored, size, settings, arriving[number] if arriving else None)
            leaps = matter.empty_space.leaps if settings.skips(alone) else None
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
                settings.early_termination / most_light_of(matters),
                leaps,
                matter.empty_space.cells_per_box if leaps else (1.0, 1.0, 1.0),
                lighting=projection.lighting if projection else lighting,
                depth_cue=alone.depth_cue if not projection or projection.lighting else None,
                projection=projection,
                arriving=self._shadows.textures[number] if arriving and lit_when_drawn else None,
                cutting=scene.cutting,
                surfaces=surfaces,
                origin=scene.volume.centre,
            )
            parts.append(Part(drawing, matter.textures, matter.visible_part(alone, settings)))
        return parts

    def _have_matter(self, count: int) -> None:
        """As many as a scene has volumes."""
        while len(self._matter) > count:
            self._matter.pop().release()
        while len(self._matter) < count:
            self._matter.append(MatterOnDevice(self._context, self._budget))

    def _draw(
        self, scene: Scene, size: Size, settings: Settings, repeat: int = 1, depth: bool = False
    ) -> NDArray[np.float32]:
        """The picture, without background; or where its surface is."""
        with self._baking():
            parts = self._parts(scene, size, settings, depth)
            check_room(parts, self._budget)
            for _, textures, visible_part in parts:
                if len(textures.bricks) == 1 and visible_part(textures.bricks[0]) is not None:
                    textures.resources(textures.bricks[0])
        times = []
        for _ in range(max(repeat, 1)):
            start, spent = time.perf_counter(), self._texture_seconds()
            with self._baking():
                self._bricks_drawn = draw(self._compositor, parts, settings.target_format)
            times.append(time.perf_counter() - start - (self._texture_seconds() - spent))
        # The first draw compiles the programs: warm draws are the others.
        self._seconds["draw"] = median(times[1:] or times)
        drawing = parts[0].drawing
        with self._timed("read"):
            drawn = self._compositor.picture(drawing.color_scale)
            if drawing.projection is None:
                return drawn
            assert isinstance(drawing.baked, ValueTexture), "values are projected"
            return drawing.projection.numbers(drawn, drawing.baked, settings.slab_thickness)

    def _noted(self, scene: Scene, size: Size, settings: Settings) -> NDArray[np.float32]:
        """The picture; what is said of it is kept for the case that it is chosen."""
        picture = self._draw(scene, size, settings)
        self._notes[settings.slab_thickness] = dict(self._seconds), self._bricks_drawn
        return picture

    def _exactly(self, scene: Scene, size: Size, settings: Settings) -> NDArray[np.float32]:
        """What stands for the integral: float32 throughout and no ray ended, so that their cost counts as error."""
        exact = replace(settings, texture_format="rgba32f", target_format="rgba32f", early_termination=0.0)
        return self._draw(scene, size, exact)

    def _facts(self, scene: Scene, size: Size, settings: Settings) -> dict[str, Any]:
        seconds, drawn = dict(self._seconds), self._bricks_drawn
        counts = [matter.empty_space.counts for matter in self._matter] if settings.skips(scene) else [(0, 0)]
        textures = [matter.textures for matter in self._matter]
        cells, visible_cells = map(sum, zip(*counts, strict=True))
        camera = scene.camera_for(size)
        facts = {
            "renderer": self._context.renderer,
            "backend": self._context.backend,
            "size": list(size),
            "slab_thickness": settings.slab_thickness,
            "slabs": slicing.slab_stacks(scene.box, camera, settings.slab_thickness, size).slab_count,
            "classification": scene.classification,
            "texture_format": ", ".join(matter.baked[1].texel_format for matter in self._matter if matter.baked),
            "halvings": self._matter[0].halvings(scene.volume),
            "target_format": settings.target_format,
            "bricks_total": sum(len(each.bricks) for each in textures),
            "bricks_drawn": drawn,
            "texture_bytes": sum(each.bytes for each in textures),
            "cells_total": cells,
            "cells_drawn": visible_cells,
            "early_termination": settings.early_termination,
            "modelled": modelled(scene, camera),
            "seconds": seconds,
        }
        facts["samples"], facts["samples_total"] = self._samples(scene, size, settings)
        facts["estimated_error"] = error_control.if_finite(self._estimated_error(scene, size, settings))
        return facts

    def _samples(self, scene: Scene, size: Size, settings: Settings) -> tuple[int | None, int | None]:
        """Slabs that were sampled, and slabs that the rays cross in the box; counted by drawing once more."""
        if self._context.released:
            return None, None
        if scene.mode in NUMBER_MODES:
            every = slicing.slabs_crossed(scene.volume, scene.camera_for(size), settings.slab_thickness, size)
            return every, every
        with self._context:
            drawn = self._counted(scene, size, settings)
            if scene.added:
                return drawn, self._counted(scene, size, replace(settings, skip_empty=False, early_termination=0.0))
        return drawn, slicing.slabs_crossed(scene.volume, scene.camera_for(size), settings.slab_thickness, size)

    def _counted(self, scene: Scene, size: Size, settings: Settings) -> int:
        parts = self._parts(scene, size, settings)
        draw(self._compositor, [part.counting() for part in parts], "rgba32f")
        return int(self._compositor.picture()[..., 0].sum(dtype=np.float64))

    def _estimated_error(self, scene: Scene, size: Size, settings: Settings) -> float | None:
        """What the choice of thickness found, or what thinner slabs change in a sixteenth of the pixels."""
        if self._estimate is not None or self._context.released:
            return self._estimate
        with self._context, suppress(NoRoomError):  # another size may see more obliquely
            small = smaller(size)
            picture = self._draw(scene, small, settings)
            with ExitStack() as aside:
                for matter in self._matter:
                    aside.enter_context(matter.set_aside(None if scene.added else _REFERENCE_BYTES))
                self._estimate = error_control.estimate_by_finer(
                    scene,
                    picture,
                    settings.slab_thickness,
                    lambda other, thickness: self._exactly(other, small, replace(settings, slab_thickness=thickness)),
                )
        return self._estimate

    @contextmanager
    def _baking(self) -> Iterator[None]:
        """Add what the textures take inside to the seconds of this picture."""
        before = {id(matter.textures): dict(matter.textures.seconds) for matter in self._matter}
        yield
        for matter in self._matter:
            earlier = before.get(id(matter.textures), {})
            for what, seconds in matter.textures.seconds.items():
                if seconds > earlier.get(what, 0.0):
                    self._seconds[what] = self._seconds.get(what, 0.0) + seconds - earlier.get(what, 0.0)

    def _texture_seconds(self) -> float:
        return sum(sum(matter.textures.seconds.values()) for matter in self._matter)

    @contextmanager
    def _timed(self, what: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self._seconds[what] = self._seconds.get(what, 0.0) + time.perf_counter() - start
