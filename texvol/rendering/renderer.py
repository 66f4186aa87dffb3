"""A Renderer keeps what pictures have in common: the context, the programs, the textures; and says what it did."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context, open_context
from texvol.opengl.projection import depth_of
from texvol.opengl.texture_memory import default_budget
from texvol.rendering import accuracy, checking, error_control
from texvol.rendering.error_search import ErrorSearch, smaller
from texvol.rendering.modelled import modelled
from texvol.rendering.render import draw, over_background, read
from texvol.rendering.scene_cache import SceneCache
from texvol.rendering.settings import Settings
from texvol.scene.display import NUMBER_MODES
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing import slabs as slicing
from texvol.textures import slab_texture
from texvol.textures.value_storage import HOPELESS, ULP
from texvol.textures.value_texture import REFERENCE
from texvol.util.errors import AccuracyWarning, InputError, NoRoomError, check_type
from texvol.util.statistics import median

Size = tuple[int, int]
_REFERENCE_BYTES = 64 << 20  # of textures for a picture that an estimate is drawn from, at most


def render(scene: Scene, size: Size = (512, 512), *, backend: str = "auto", **accuracy: Any) -> NDArray[np.float32]:
    """Return the scene's picture, drawn by a renderer of its own; arguments as for `Renderer.render`."""
    with Renderer(backend) as renderer:
        return renderer.render(scene, size, **accuracy)


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
            self._cache = SceneCache(self._context, self._budget)
            self._bricks_drawn = 0
        self._watch = self._cache.watch
        self._last: tuple[CompleteScene, Size, Settings] | None = None
        self._stats: dict[str, Any] = {}
        self._estimate: float | None = None  # of the last picture's error, where it has been worked out
        self._check: checking.Check | None = None  # of the last picture
        self._notes: dict[float, tuple[dict[str, float], int]] = {}  # of pictures that may be chosen, by thickness
        self._error_search = ErrorSearch(self._noted, self._exactly, self._cache.rounding)

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
        check: int | str | None = None,
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
        check : int or "all", optional
            Number of random pixels to hold against the oracle; `stats` has what was found, and what follows. With
            `max_error` some are checked in any case where the oracle has been at work and takes under a tenth of a
            second.

        Raises
        ------
        InputError
            If an argument is out of range, or the volume or the picture too large for the driver.

        Warns
        -----
        AccuracyWarning
            If the wanted error is not reached, by estimate or by a checked pixel; or if single precision cannot hold
            the values at which the transfer function changes.
        """
        check = checking.checked_count(check)
        size = self._compositor.checked_size(size)
        check_type("scene", scene, Scene)
        scene.check_unchanged()
        if texture_format not in ("auto", *slab_texture.TEXEL_FORMATS):
            raise InputError(f"texture format is auto, rgba8, rgba16f or rgba32f, and not {texture_format!r}")
        wanted = accuracy.checked(scene, slab_thickness, sampling_rate, max_error)
        termination = accuracy.checked_termination(early_termination, max_error)
        target = accuracy.checked_target(target_format, scene.mode)
        settings = Settings(wanted, texture_format, target, termination, skip_empty)
        complete = scene.completed(size)
        self._watch.seconds, self._stats, self._notes, self._estimate, self._check = {}, {}, {}, None, None
        with self._context:
            if max_error is not None:
                # Any rounding of texels would hide in the differences that the choice goes by.
                settings = replace(settings, texture_format="rgba32f") if texture_format == "auto" else settings
                choice = self._error_search.choose(complete, size, settings, max_error)
                settings = replace(settings, slab_thickness=choice.slab_thickness)
                picture, self._estimate = choice.picture, choice.estimated_error
                self._watch.seconds, self._bricks_drawn = self._notes[choice.slab_thickness]
            if max_error is None or repeat > 1:
                picture = self._draw(complete, size, settings, repeat)
        self._last = (complete, size, settings)
        if scene.mode not in NUMBER_MODES:
            picture = over_background(picture, scene.background)
        self._say_what_is_lost()
        if check is not None or max_error is not None:
            self._hold_against_oracle(picture, complete, check, max_error)
        return picture

    def foresee(self, scene: Scene, size: Size, max_error: float) -> error_control.Choice:
        """Where `render` will begin to look for that error: what a picture of a sixteenth of the pixels asks for."""
        termination, target = accuracy.checked_termination(None, max_error), accuracy.checked_target("auto")
        settings = Settings(0.0, "rgba32f", target, termination, skip_empty=True)
        size = self._compositor.checked_size(size)
        with self._context:
            return self._error_search.foresee(scene.completed(size), size, settings, max_error)

    def _say_what_is_lost(self) -> None:
        """Warn of values that single precision does not tell apart."""
        lost = self._cache.lost_digits
        if lost >= HOPELESS * ULP:
            warnings.warn(
                "single precision cannot hold the values at which the transfer function changes: they are so far apart "
                f"that rounding moves values by up to {lost:.2g} of its narrowest interval",
                AccuracyWarning,
                stacklevel=3,
            )

    def _hold_against_oracle(
        self, picture: NDArray[np.float32], scene: CompleteScene, count: int | str | None, wanted: float | None
    ) -> None:
        """Check some pixels, and warn where these are off by more than was wanted."""
        with self._watch.timed("check"):
            if count is not None:
                self._check = checking.check_picture(picture, scene, count, wanted)
            elif wanted is not None:
                self._check = checking.check_in_passing(picture, scene, wanted)
        found = self._check
        if wanted is None or found is None or not found.beyond:
            return
        said = "" if self._estimate is None else f", and {self._estimate:.2g} estimated"
        warnings.warn(
            f"an error of {wanted:g} was wanted{said}; of {found.pixels} checked pixels {found.beyond} are beyond, "
            f"with errors of up to {found.largest_error:.2g}",
            AccuracyWarning,
            stacklevel=3,
        )

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
        return depth_of(drawn, scene.volume, scene.camera, settings.slab_thickness)

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
            self._stats = self._metadata(*self._last)
        return self._stats

    @property
    def estimate(self) -> float | None:
        """Of the last picture's error, where that was wanted; unlike in `stats` nothing is drawn to know it."""
        return error_control.if_finite(self._at_least_as_checked(self._estimate))

    @property
    def check(self) -> checking.Check | None:
        """Check of the last picture against the oracle; None where no pixel was checked."""
        return self._check

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments with which `render` draws the last picture again, every choice of accuracy made."""
        return asdict(self._last[2]) if self._last else {}

    @property
    def seconds(self) -> dict[str, float]:
        """What `stats` has under the same name, at once: `bake`, `upload`, `draw`, `read` of the last `render`."""
        return dict(self._watch.seconds)

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
            self._cache.release()
            self._compositor.release()
        self._context.release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _draw(
        self, scene: CompleteScene, size: Size, settings: Settings, repeat: int = 1, depth: bool = False
    ) -> NDArray[np.float32]:
        """Draw the picture, without background; or the depth of its isosurface."""
        with self._watch.baking():
            drawing = self._cache.drawing(scene, size, settings, depth)
            surfaces = None if depth else self._cache.surfaces(scene, size, settings)
            self._cache.check_room(drawing)
            for drawn in drawing.volumes:
                if len(drawn.textures.bricks) == 1 and drawn.visible_part(drawn.textures.bricks[0]) is not None:
                    drawn.textures.resources(drawn.textures.bricks[0])
        times = []
        for _ in range(max(repeat, 1)):
            start, spent = time.perf_counter(), self._watch.of_textures()
            with self._watch.baking():
                self._bricks_drawn = draw(self._compositor, drawing, surfaces, settings.target_format)
            times.append(time.perf_counter() - start - (self._watch.of_textures() - spent))
        # The first draw compiles the programs: warm draws are the others.
        self._watch.seconds["draw"] = median(times[1:] or times)
        with self._watch.timed("read"):
            return read(self._compositor, drawing)

    def _noted(self, scene: CompleteScene, size: Size, settings: Settings) -> NDArray[np.float32]:
        """The picture; what is said of it is kept for the case that it is chosen."""
        picture = self._draw(scene, size, settings)
        self._notes[settings.slab_thickness] = dict(self._watch.seconds), self._bricks_drawn
        return picture

    def _exactly(self, scene: CompleteScene, size: Size, settings: Settings) -> NDArray[np.float32]:
        """Draw what stands for the integral: float32 throughout and no ray ended, so that their cost counts as error.

        Where it tells, values are rounded otherwise than in the picture itself.
        """
        exact = replace(settings, texture_format=REFERENCE, target_format="rgba32f", early_termination=0.0)
        return self._draw(scene, size, exact)

    def _metadata(self, scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
        seconds, drawn = dict(self._watch.seconds), self._bricks_drawn
        counts = [medium.empty_space.counts for medium in self._cache.volumes] if settings.skips(scene) else [(0, 0)]
        textures = [medium.textures for medium in self._cache.volumes]
        cells, visible_cells = map(sum, zip(*counts, strict=True))
        metadata = {
            "renderer": self._context.renderer,
            "backend": self._context.backend,
            "size": list(size),
            "slab_thickness": settings.slab_thickness,
            "slabs": slicing.slab_stacks(scene.box, scene.camera, settings.slab_thickness, size).slab_count,
            "classification": scene.classification,
            "texture_format": ", ".join(medium.baked[1].texel_format for medium in self._cache.volumes if medium.baked),
            "halvings": self._cache.volumes[0].halvings(scene.volume),
            "target_format": settings.target_format,
            "bricks_total": sum(len(each.bricks) for each in textures),
            "bricks_drawn": drawn,
            "texture_bytes": sum(each.bytes for each in textures),
            "cells_total": cells,
            "cells_drawn": visible_cells,
            "early_termination": settings.early_termination,
            "modelled": modelled(scene),
            "seconds": seconds,
        }
        metadata["samples"], metadata["samples_total"] = self._samples(scene, size, settings)
        estimate = self._at_least_as_checked(self._estimated_error(scene, size, settings))
        metadata["estimated_error"] = error_control.if_finite(estimate)
        return metadata | ({"check": self._check.metadata} if self._check else {})

    def _at_least_as_checked(self, estimate: float | None) -> float | None:
        """An estimate of the largest error, which is at least that of a checked pixel."""
        return estimate if estimate is None or self._check is None else max(estimate, self._check.largest_error)

    def _samples(self, scene: CompleteScene, size: Size, settings: Settings) -> tuple[int | None, int | None]:
        """Slabs that were sampled, and slabs that the rays cross in the box; counted by drawing once more."""
        if self._context.released:
            return None, None
        if scene.mode in NUMBER_MODES:
            every = slicing.slabs_crossed(scene.volume, scene.camera, settings.slab_thickness, size)
            return every, every
        with self._context:
            drawn = self._counted(scene, size, settings)
            if scene.added:
                return drawn, self._counted(scene, size, replace(settings, skip_empty=False, early_termination=0.0))
        return drawn, slicing.slabs_crossed(scene.volume, scene.camera, settings.slab_thickness, size)

    def _counted(self, scene: CompleteScene, size: Size, settings: Settings) -> int:
        drawing = self._cache.drawing(scene, size, settings).counting()
        draw(self._compositor, drawing, self._cache.surfaces(scene, size, settings), "rgba32f")
        return int(self._compositor.picture()[..., 0].sum(dtype=np.float64))

    def _estimated_error(self, scene: CompleteScene, size: Size, settings: Settings) -> float | None:
        """What the choice of thickness found, or what thinner slabs change in a sixteenth of the pixels."""
        if self._estimate is not None or self._context.released:
            return self._estimate
        with self._context, suppress(NoRoomError):  # another size may see more obliquely
            small = smaller(size)
            picture = self._draw(scene, small, settings)
            with ExitStack() as aside:
                for medium in self._cache.volumes:
                    aside.enter_context(medium.set_aside(None if scene.added else _REFERENCE_BYTES))
                self._estimate = error_control.estimate_by_finer(
                    scene,
                    picture,
                    settings.slab_thickness,
                    lambda other, thickness: self._exactly(other, small, replace(settings, slab_thickness=thickness)),
                )
            self._estimate += self._cache.rounding(scene)
        return self._estimate
