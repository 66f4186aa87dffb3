"""Choice of `auto`: the slab texture wherever it is as good as needed and no dearer, else `post`.

The slab texture is the source's method. Its whole error, of slabs and of the medium that it interpolates, is measured
against the integral of `post`, in pictures of a sixteenth of the pixels, at most 128 along a side; so is the error of
`post` at the same thickness. `slab` is taken if

    rms(slab - E) <= max(1/255, 2 rms(post - E)),    E: post with four slabs in one

and if its texels cost no time that anybody notices. `auto` stands for the picture of the medium of `post`: with a
maximum error it is `post`, and so it is for the oracle.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from texvol.opengl.texture_store import Stopwatch, same
from texvol.rendering.error_control import DrawScene, Size, smaller
from texvol.rendering.model_error import AskedOfModel, Classified
from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.picture_size import shrunk
from texvol.scene.refinement import refined_scene
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.slabs import slabs_crossed_about
from texvol.textures.shaded_samples import depends_on_eye
from texvol.util.errors import NoRoomError
from texvol.util.statistics import rms

GOOD_ENOUGH = 1 / 255  # rms: one step of the 8 bits of a screen
_TIMES_POST = 2.0
_FINER = 4  # slabs in one for what stands for the integral
# Seconds on two cores, from scripts/benchmark.py --only bake; and what nobody notices.
_OF_A_TEXEL, _OF_A_LIT_TEXEL = 1 / 30e6, 1 / 12e6
_OF_A_LIT_SAMPLE = 5e-9  # that `post` takes longer for: it interpolates a gradient as well
_UNNOTICED = 0.1
_MOST_PIXELS = 128  # along a side; more would not change an rms error, and take time


class ClassificationChooser:
    """Choices of `auto`; a choice holds while nothing but the camera changes, so that an orbit does not flicker."""

    def __init__(self, draw: DrawScene, draw_exactly: DrawScene, budget: int, watch: Stopwatch) -> None:
        self._draw, self._draw_exactly, self._budget, self._watch = draw, draw_exactly, budget, watch
        self._last: tuple[tuple[Any, ...], Classified] | None = None

    def settled(
        self, scene: Scene, size: Size, settings: Settings, asked: AskedOfModel, views: int
    ) -> tuple[Scene, Classified | None]:
        """Return the scene in a classification other than auto, and the choice if there was one.

        The stopwatch begins anew, with the seconds of the choice.

        Parameters
        ----------
        settings : Settings
            Slab thickness NaN if a maximum error is to decide it.
        views : int
            Number of pictures from different sides that are asked for.
        """
        self._watch.seconds = {}
        if scene.classification != "auto":
            return scene, None
        with self._watch.timed("choose"):
            choice = self._choice(scene, size, settings, asked, views)
        self._watch.seconds = {"choose": self._watch.seconds["choose"]}
        return scene.classified_as(choice.classification), choice

    def _choice(self, scene: Scene, size: Size, settings: Settings, asked: AskedOfModel, views: int) -> Classified:
        if obvious := _obvious(scene, settings, asked):
            return obvious
        parts = (scene.volume, scene.transfer_function, scene.lighting, scene.gradient, scene.mask, scene.depth_cue)
        key = (*parts, settings.slab_thickness, f"{asked.texture_refinement} {views}")
        if self._last is None or not same(self._last[0], key):
            self._last = key, self._measured(scene, size, settings, asked, views)
        return self._last[1]

    def _measured(self, scene: Scene, size: Size, settings: Settings, asked: AskedOfModel, views: int) -> Classified:
        post, slab = (scene.classified_as(each).completed(size) for each in ("post", "slab"))
        wanted = asked.texture_refinement
        best = wanted if isinstance(wanted, int) else asked.shown(slab, settings.slab_thickness, self._budget)
        seconds = {each: _extra_seconds(slab, size, settings, each, views) for each in (best, 1)}
        cheap = [factor for factor, extra in seconds.items() if extra <= _UNNOTICED]
        if not cheap:
            return Classified("post", reason=f"texels of slab would take {seconds[1]:.1f} s longer")
        small = _small(size)
        try:
            fine = replace(settings, slab_thickness=settings.slab_thickness / _FINER)
            truth = self._draw_exactly(post, small, fine)
            of_post = rms(self._draw(post, small, settings) - truth)
            refined = replace(settings, texture_refinement=cheap[0])
            of_slab = rms(self._draw(refined_scene(slab, cheap[0]), small, refined) - truth)
        except NoRoomError:
            return Classified("post", reason="its textures take less room")
        if of_slab <= GOOD_ENOUGH:
            return Classified("slab", cheap[0], f"its error of {of_slab:.1e} rms is at most 1/255")
        if of_slab <= _TIMES_POST * of_post:
            return Classified("slab", cheap[0], f"its error of {of_slab:.1e} rms is at most twice that of post")
        words = f"the error of slab, {of_slab:.1e} rms, is more than twice its {of_post:.1e} and 1/255"
        return Classified("post", reason=words)


def _small(size: Size) -> Size:
    """Return the size of the pictures that are compared."""
    return shrunk(smaller(size), _MOST_PIXELS)


def _obvious(scene: Scene, settings: Settings, asked: AskedOfModel) -> Classified | None:
    """Return the choice where nothing has to be measured."""
    if settings.slicing == "wilson":
        return Classified("slab", _factor(asked), "slicing wilson draws its texture")
    if isinstance(scene.volume, LargeVolume):
        return Classified("post", reason="the volume is read in parts")
    if scene.mode != "composite":
        return Classified("post", reason=f"mode {scene.mode} shows values")
    if scene.volume.nearest or scene.volume.colors is not None:
        what = "labels" if scene.volume.labels else "blocks" if scene.volume.blocks else "colours"
        return Classified("slab", reason=f"{what} belong to samples")
    if scene.added:
        return Classified("post", reason="of several volumes extinctions add up, and opacities do not")
    if np.isnan(settings.slab_thickness):
        return Classified("post", reason="a maximum error is of its integral")
    if isinstance(asked.texture_refinement, int) and asked.texture_refinement > 1:
        return Classified("slab", asked.texture_refinement, "its texels are to be refined")
    return None


def _factor(asked: AskedOfModel) -> int:
    return asked.texture_refinement if isinstance(asked.texture_refinement, int) else 1


def _extra_seconds(scene: CompleteScene, size: Size, settings: Settings, factor: int, views: int) -> float:
    """Estimate by how much longer all pictures take by `slab` than by `post`."""
    texels = scene.volume.size * factor**3
    if not scene.needs_gradient:
        return texels * _OF_A_TEXEL
    baked = views if scene.lighting is not None and depends_on_eye(scene.lighting) else 1
    samples = slabs_crossed_about(scene.volume, scene.camera, settings.slab_thickness, size)
    # Lit texels are made anew for each position of the eye that matters, and once more for the choice; for `post` there
    # is a texture of gradients, which takes as long.
    return (baked + 1) * texels * _OF_A_LIT_TEXEL - views * samples * _OF_A_LIT_SAMPLE
