"""Renderer: draws scenes, keeps the context, programs and textures between pictures, and reports what it did."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Generator, Iterable
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import partial
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context, open_context
from texvol.opengl.pipelines import checked_pipeline
from texvol.opengl.projection import depth_of
from texvol.opengl.texture_store import Stopwatch, default_budget
from texvol.rendering import checking, error_control
from texvol.rendering.any_pictures import AnyPictures
from texvol.rendering.classification import ClassificationChooser
from texvol.rendering.default_rate import PATIENCE, DefaultRate
from texvol.rendering.error_search import ErrorSearch, of_passes, searched
from texvol.rendering.frames import Frame, drawn_one_by_one
from texvol.rendering.interpolation import settled_interpolation
from texvol.rendering.last_picture import LastPicture
from texvol.rendering.late_estimate import Estimates, OwnTexels, estimates
from texvol.rendering.model_error import AskedOfModel
from texvol.rendering.picture import Drawn, Picture, drawn_again
from texvol.rendering.pictures import Pictures
from texvol.rendering.render import over_background
from texvol.rendering.settings import Settings, checked_adaptive, checked_slicing, numbers_asked_for, settings_asked_for
from texvol.rendering.shadow_error import Nodes, checked_asked, nodes_for_error
from texvol.rendering.stats import sampled_slabs
from texvol.rendering.streaming.kinds import drawable
from texvol.rendering.streaming.levels import LevelsAskedFor, with_levels_told
from texvol.rendering.streaming.without_room import in_parts_without_room
from texvol.scene.display import NUMBER_MODES
from texvol.scene.gradient import seconds_of
from texvol.scene.picture_size import AnySize
from texvol.scene.refinement import refined_scene
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.turning import views_around
from texvol.slicing.slabs import Slicing
from texvol.util.errors import InputError, NoRoomError
from texvol.util.numbers import AnyNumber, checked_count

Size = tuple[int, int]


class Renderer(LastPicture):
    """Renderer of scenes on one OpenGL context; it keeps the programs and the textures of the last scene.

    Parameters
    ----------
    backend : "auto", "egl" or "osmesa"
    device : number or part of the name of one of the devices that `texvol devices` lists, optional
    texture_memory : float, optional
        Megabytes (10⁶ bytes) for textures; half of the free memory by default. A volume whose texture is larger, or
        too large for the driver, is drawn in bricks.
    pipeline : "auto", "fragment" or "compute"
        What walks the slabs: fragments of polygons, or a compute shader, see `texvol.opengl.pipelines`; the pictures
        are the same to 2e-6. "auto" takes the faster one, by a probe at the first picture.
    compositor : callable, optional
        Makes a compositor for a context, in place of `Compositor`.

    Raises
    ------
    ContextError
        If no OpenGL context can be made; the message has the reason of each back end.
    InputError
        If the texture memory is not positive, or there is no such device or pipeline.
    """

    def __init__(
        self,
        backend: str = "auto",
        *,
        device: int | str | None = None,
        texture_memory: float | None = None,
        pipeline: str = "auto",
        compositor: Callable[[Context], Compositor] | None = None,
    ) -> None:
        if texture_memory is not None and not 0 < texture_memory < np.inf:
            raise InputError(f"texture_memory must be positive and finite, got {texture_memory:g} MB")
        super().__init__(open_context(backend, device), Stopwatch())
        with self._context:
            self._compositor = (compositor or Compositor)(self._context)
            self._compositor.pipeline = checked_pipeline(pipeline, self._context)
            self._budget = int(texture_memory * 1e6) if texture_memory else default_budget(self._context)
            self._pictures = AnyPictures(self._context, self._compositor, self._budget, self._watch)
        self._oracle: checking.Oracle | None = None  # in place of that in this process
        self._unrefined: CompleteScene | None = None  # the last scene, before its volume was refined
        self._chooser = ClassificationChooser(self._draw, self._exactly, self._budget, self._watch)
        self._notes: dict[float, tuple[dict[str, float], int]] = {}  # seconds and bricks, by thickness
        self._default_rate = DefaultRate(self._draw, lambda scene, *how: self._pictures_of(scene).count(scene, *how))
        self._error_search = ErrorSearch(self._noted, self._exactly, self._pictures_of)

    @in_parts_without_room
    def render(
        self,
        scene: Scene,
        size: AnySize = (512, 512),
        *,
        slab_thickness: AnyNumber | None = None,
        sampling_rate: AnyNumber | None = None,
        max_error: AnyNumber | None = None,
        texture_format: str = "auto",
        target_format: str = "auto",
        early_termination: AnyNumber | None = None,
        skip_empty: bool = True,
        slicing: Slicing = "stacks",
        texture_refinement: int | str | None = None,
        shadow_nodes: int | str | None = None,
        of: str = "own",
        level: int | str = "auto",
        level_error: AnyNumber | None = None,
        coarser_by_pixels: bool | None = None,
        views: int = 1,
        repeat: int = 1,
        check: int | str | None = None,
        interpolation: str = "auto",
        adaptive: str = "auto",
    ) -> Picture:
        """Return the scene's picture, (height, width, 4) float32, premultiplied, linear, top row first.

        Parameters
        ----------
        size : (width, height), or int
            Pixels.
        slab_thickness : float
            World units, plane to plane.
        sampling_rate : float
            Slabs per smallest spacing, in place of `slab_thickness`; 1 by default, or of a look or a lit scene of
            classification auto that is drawn by post what its error needs, see `default_rate`.
        max_error : float, Fraction, or text such as "1/255"
            Maximum absolute error of the linear picture against the integral of its classification, in place of
            `slab_thickness`: tiles of the picture are refined until each keeps it, or the scene is drawn at several
            thicknesses to find one. If the error cannot be reached there is an AccuracyWarning, and `stats` has the
            error that was.
        of : "own" or "post"
            Integral that `max_error` is of: that of the picture's own classification, or that of `post`. The latter
            also bounds the model error of `slab` and `extinction`, which thinner slabs leave as it is.
        texture_format, target_format : "auto", "rgba8", "rgba16f" or "rgba32f"
            "auto" takes the smallest texture whose rounding is hidden by the discretisation error (in `post` also a
            volume of half the resolution), and a float32 target.
        early_termination : float, optional
            Transmittance at which a ray ends, and the largest error of that. 2^-22 by default; 0 ends no ray.
        skip_empty : bool
            True to skip cells in which nothing shows; the picture is the same.
        slicing : "stacks", "polygons" or "wilson"
            How slabs are drawn, see `texvol.slicing.slabs`: in runs by one polygon, by a polygon for each, or by these
            polygons alone, as Wilson, Van Gelder and Wilhelms did (1994), so that slabs cut short by the box are whole.
        texture_refinement : 1, 2, 4 or "auto"
            Texels along an axis for a sample, in classifications slab and extinction: their medium comes nearer to that
            of post. "auto" refines where it shows beside the slabs' error, a quarter of the textures' memory has room,
            and texels take at most some 0.3 seconds. By default 1; "auto" if a scene of classification auto is drawn
            by slab.
        shadow_nodes : int or "auto", optional
            Nodes along the longest edge of the box, 4 to 512, between which shadows are interpolated: 64 by default.
            "auto", the default with `max_error`, doubles them, to 256 at most: see `shadow_error.nodes_for_error`.
        level : int or "auto"
            Level of a `LargeVolume` that is drawn, 0 the finest. "auto" is as fine as pixels can show, and no farther
            apart than slabs whose thickness was asked for; or by `level_error`.
        coarser_by_pixels : bool, optional
            True if regions farther off have coarser levels where pixels show no more; default if pixels decide.
        level_error : float, optional
            Error that levels of regions may have against the finest, by prediction; 3/4 of `max_error` by default.
        views : int
            Number of pictures from different sides: classification auto takes slab if baking for all is no dearer.
        repeat : int
            Number of times to draw; `stats` has the median time.
        check : int or "all", optional
            Number of random pixels to compare with the oracle; `stats` has the findings. With `max_error` a few are
            checked unasked if that takes under a tenth of a second.
        interpolation : "auto", "driver" or "shader"
            What interpolates texels: the driver, or the shader, which fetches eight of them, where weights of the
            driver's have too few digits. "auto" measures them if `max_error` is given, see `rendering.interpolation`.
        adaptive : "auto", "on" or "off"
            "on" divides slabs of `post` in three where they are not nearly transparent, so that a thickness is that of
            the thickest. "auto" does so where it takes less time for the same error, if no thickness or rate is given.

        Raises
        ------
        InputError
            If an argument is out of range, or the volume or the picture is too large for the driver.

        Warns
        -----
        AccuracyWarning
            If the requested error is not reached, by the estimate or by a checked pixel; or if single precision cannot
            hold the values at which the transfer function changes.
        """
        check, size = checking.checked_count(check), self._compositor.checked_size(size)
        views, repeat = checked_count("views", views), checked_count("repeat", repeat)
        scene = drawable(scene, size, texture_refinement, level)
        for volume in scene.volumes:
            volume.expect_picture()
        rates = numbers_asked_for(slab_thickness=slab_thickness, sampling_rate=sampling_rate, max_error=max_error)
        ending, level_error = numbers_asked_for(early_termination=early_termination, level_error=level_error)
        formats = texture_format, target_format
        settings = settings_asked_for(scene, rates, formats, ending, skip_empty, slicing, interpolation)
        asked, asked_nodes = AskedOfModel(texture_refinement, max_error := rates[2], of), checked_asked(shadow_nodes)
        with self._context:
            scene, self.chosen = self._chooser.settled(scene, size, settings, asked, views)
        pictures, complete, asked = self._pictures_of(scene), scene.completed(size), asked.settled(self.chosen)
        checked_slicing(slicing, complete, self._compositor.pipeline)
        settings = replace(settings, adaptive=checked_adaptive(adaptive, complete, settings, any(rates[:2])))
        level_asked = LevelsAskedFor(level, level_error, max_error, rates[0] or rates[1], coarser_by_pixels)
        settings = with_levels_told(complete, size, settings, level_asked)
        self._stats, self._notes, self._estimates, self._check, quick = {}, {}, Estimates(), None, None
        self._unrefined, self.drawn_scene, self._is_of_post, self._by_tiles = complete, scene, of == "post", (None, ())
        with self._context:
            factor, error = asked.refinement(complete, size, settings, self._budget, self._exactly)
            complete, settings = refined_scene(complete, factor), replace(settings, texture_refinement=factor)
            nodes = nodes_for_error(self._exactly, complete, size, settings, asked_nodes, error)
            settings = replace(settings, shadow_nodes=nodes.number)
            settings = self._default_rate.settled(complete, size, settings, None if any(rates) else self.chosen)
            if error is not None:
                choice, settings = self._chosen(complete, size, settings, nodes, interpolation)
                picture = choice.picture
                self._by_tiles = (error, choice.passes) if len(choice.passes) > 1 and repeat == 1 else (None, ())
            if max_error is None or repeat > 1:
                picture, quick = self._pictures.with_estimate(self._draw, complete, size, settings, repeat)
        self._last, self._estimates = (complete, size, settings), self._estimates._replace(quick=quick)
        picture = picture if scene.mode in NUMBER_MODES else over_background(picture, scene.background)
        checking.warn_of_lost_digits(pictures.lost_digits)
        if check is not None or max_error is not None:
            with self._watch.timed("check"):
                against = asked.truth(self._unrefined, complete), check, max_error, self._estimates.error, self._oracle
                self._check = checking.held_against_oracle(picture, *against)
        return self._known(picture, size)

    def orbit(
        self, scene: Scene, count: int, size: AnySize = (512, 512), **accuracy: Any
    ) -> Generator[Picture, None, None]:
        """Return a generator of `count` pictures once around a scene; arguments as for `render` decide the first."""
        views = views_around(scene, count, size := self._compositor.checked_size(size))
        return (frame.picture for frame in self.frames(views, size, count=count, views=count, **accuracy))

    def frames(
        self, scenes: Iterable[Scene], size: AnySize = 512, *, count: int | None = None, views: int = 1, **how: Any
    ) -> Generator[Frame, None, None]:
        """Return a generator of the frames of scenes, each drawn when it is asked for, and `count` in all if known.

        Arguments as for `render` decide the first frame; what is chosen for it holds for all.
        """
        return drawn_one_by_one(self, scenes, self._compositor.checked_size(size), views, how)

    def foresee(self, scene: Scene, size: Size, max_error: float, slicing: Slicing = "stacks") -> error_control.Choice:
        """Return the choice for a sixteenth of the pixels and half of the error: a guess at what `render` takes."""
        with self._context:
            return self._error_search.foresee(*searched(scene, self._compositor.checked_size(size), max_error, slicing))

    def depth(self) -> NDArray[np.float64]:
        """Return the depth of the last picture's isosurface, shape (height, width).

        Depth is along the view from the plane of the eye, in world units; infinite where a ray meets no surface. Meshes
        and lines in front of it do not count.

        Raises
        ------
        InputError
            If the last picture is not of mode isosurface.
        """
        if self._last is None or self._last[0].mode != "isosurface":
            raise InputError("depth needs a picture of mode isosurface before it, got none")
        scene, size, settings = self._last
        settings = replace(settings, target_format="rgba32f")  # of the picture: 8 bits would end at a depth of 1
        with self._context:
            drawn = self._pictures_of(scene).draw(scene, size, settings, depth=True)
        return depth_of(drawn, scene.volume, scene.camera, settings.slab_thickness)

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the last `render` in JSON types, as `--stats` writes it.

        `estimated_error` is the estimated maximum absolute error of the linear picture against the integral of its
        classification, from two small pictures. `samples` is the number of sampled slabs, `samples_total` the number
        of slabs that the rays cross in the box. These three are found when `stats` is first read.
        """
        if self._last is not None and not self._stats:
            self._stats = self._metadata(*self._last)
        return self._stats

    def quick_estimate(self) -> float | None:
        """Return the estimated error of the last picture, by two small pictures if need be; None if it takes long."""
        if self.estimate is not None or self._last is None or self._last[0].mode in NUMBER_MODES:
            return self.estimate
        if self._estimates.quick is None and not self._context.released:
            with self._context:
                self._estimates = self._estimates._replace(quick=self._quickly_estimated(*self._last))
        return error_control.if_finite(checking.at_least(self._estimates.quick, self._check))

    def close(self) -> None:
        """Release everything on the device; closing twice is allowed."""
        if not self._context.released:
            with self._context:
                self._pictures.release()
                self._compositor.release()
            self._context.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _draw(self, scene: CompleteScene, size: Size, settings: Settings, repeat: int = 1) -> NDArray[np.float32]:
        """Draw the picture, without background."""
        return self._pictures_of(scene).draw(scene, size, settings, repeat)

    def _known(self, array: NDArray[np.float32], size: Size) -> Picture:
        """Return the picture that was drawn last, which keeps what it was drawn from."""
        scene, settings = cast(CompleteScene, self._unrefined), self.settings
        opened = partial(Renderer, self.backend, device=self._context.device)
        again = partial(drawn_again, opened, scene, size, settings)
        self._drawn = Drawn(scene, settings, self.attributes, self._found_error, again, weakref.ref(self))
        return Picture.of(array, self._drawn)

    def _pictures_of(self, scene: Scene) -> Pictures:
        """Return what draws a scene."""
        return self._pictures.of(scene)

    def _noted(self, scene: CompleteScene, size: Size, settings: Settings) -> NDArray[np.float32]:
        """Draw a candidate picture, and keep its seconds and bricks for the case that it is chosen."""
        picture = self._draw(scene, size, settings)
        self._notes[settings.slab_thickness] = dict(self._watch.seconds), self._pictures_of(scene).bricks_drawn
        return picture

    def _chosen(
        self, scene: CompleteScene, size: Size, settings: Settings, nodes: Nodes, interpolation: str
    ) -> tuple[error_control.Choice, Settings]:
        """Choose slabs for what levels, nodes and weights leave of the error, and note what is known."""
        of_levels = settings.level_error or 0.0
        if settings.texture_format == "auto":
            # Rounding of texels would be hidden in the differences between pictures that the choice depends on.
            settings = replace(settings, texture_format="rgba32f")
        settings, left = self._interpolated(scene, size, settings, nodes.left or 0.0, interpolation)
        choice, settings = self._error_search.choose(scene, size, settings, left - of_levels)
        total = choice.estimated_error + of_levels + (nodes.error or 0.0)
        self._estimates = Estimates(error=total, of_shadows=nodes.error)
        self._watch.seconds, self._pictures_of(scene).bricks_drawn = of_passes(self._notes, choice)
        return choice, settings

    def _exactly(self, scene: CompleteScene, size: Size, settings: Settings) -> NDArray[np.float32]:
        """Draw a reference, see `Settings.exact`, interpolated by the shader where the driver's weights are coarse."""
        return self._draw(scene, size, replace(settings.exact, interpolation=self._finest_interpolation))

    def _interpolated(
        self, scene: CompleteScene, size: Size, settings: Settings, wanted: float, interpolation: str
    ) -> tuple[Settings, float]:
        """Return settings whose interpolation keeps an error, and what it leaves of it, if none was chosen."""
        if interpolation != "auto":
            return settings, wanted
        return settled_interpolation(scene, size, settings, wanted, self._draw, self._finest_interpolation)

    @property
    def _finest_interpolation(self) -> str | None:
        """Interpolation of references: by the shader where the driver's weights have too few digits."""
        return "shader" if self._compositor.has_coarse_weights else None

    def _metadata(self, scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
        pictures = self._pictures_of(scene)
        seconds, drawn = dict(self._watch.seconds), pictures.bricks_drawn
        metadata = pictures.described(scene, size, settings)
        metadata |= {"bricks_drawn": drawn, "seconds": seconds, "pipeline": self._compositor.drawn_by}
        if self.chosen is not None:
            metadata["classification_reason"] = self.chosen.sentence
        passes = self._by_tiles[1] or ((settings.slab_thickness, None),)
        with nullcontext() if (released := self._context.released) else self._context:
            metadata |= sampled_slabs(None if released else pictures.count, scene, size, settings, passes)
        if not released:
            with self._context:
                self._find_estimates(scene, size, settings)
        metadata |= {"estimated_error": self.estimate} | self._estimates.metadata
        return metadata | ({"check": self._check.metadata} if self._check else {})

    def _find_estimates(self, scene: CompleteScene, size: Size, settings: Settings) -> None:
        """Estimate the errors of the last picture, unless there is no room for what they are found by."""
        pictures = self._pictures_of(scene)
        how = self._draw, self._exactly, (scene, self._unrefined or scene), size, settings
        is_plain = settings.texture_format == "auto" and self._finest_interpolation is None
        known = self._default_rate.estimate
        by_slabs = self._pictures.in_parts.estimated if known is None else known
        own = OwnTexels(pictures.hidden_rounding if is_plain else "values", by_slabs)
        with suppress(NoRoomError):
            self._estimates = estimates(pictures, *how, self._estimates, own)

    def _quickly_estimated(self, scene: CompleteScene, size: Size, settings: Settings) -> float | None:
        if scene.mode != "isosurface" or self._pictures_of(scene).hidden_rounding == "nothing":
            return self._default_rate.estimated(scene, size, settings, sum(self.seconds.values()))
        # Two pictures of one surface are wrong alike where its gradients are rounded.
        if seconds_of(scene.volume, scene.gradient) > PATIENCE:
            return None
        self._find_estimates(scene, size, settings)
        return self._estimates.error
