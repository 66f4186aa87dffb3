"""Painting process: it draws the jobs that a Painter sends, with a headless Renderer.

A picture at rest may take seconds, and has to be dropped when a newer job arrives. So it is drawn in groups of rows,
and whenever the work tells its progress, the number of the newest job is read from shared memory.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.output.export import PictureExport
from texvol.rendering import error_control, forecast
from texvol.rendering.error_search import may_refine_tiles, searched
from texvol.rendering.modelled import modelled
from texvol.rendering.renderer import Renderer, Size
from texvol.rendering.settings import Settings, checked_termination
from texvol.rendering.streaming.kinds import reason_for_memory
from texvol.rendering.streaming.without_room import in_parts_if_without_room
from texvol.scene.display import NUMBER_MODES, found_window
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.tour import Tour
from texvol.slicing import slabs as slicing
from texvol.util import progress, writing
from texvol.util.errors import AccuracyWarning
from texvol.window.filled import filled_part
from texvol.window.jobs import Answer, Job
from texvol.window.stand_in import StandIn
from texvol.window.transport import Receiver

_OF_ONE_PICTURE = ("rest", "file")  # of other kinds, frames are counted
_TIMED = 2  # divisor of the sides of a picture that is drawn for its time
_TOLD = 0.1  # seconds between two messages of progress
_FIRST = 0.2  # fraction of the time of a picture at rest that each step before the last takes of what is left
_OF_WRITING = 2e-7  # seconds of a pixel to be annotated, encoded and written


class Superseded(Exception):
    """A newer job has arrived."""


class PiecewiseRenderer(Renderer):
    """Renderer that can be interrupted by whoever hears the progress."""

    def __init__(self, device: int | str | None = None) -> None:
        self._kept: tuple[Scene, Size, Settings, NDArray[np.float32]] | None = None
        super().__init__(device=device)

    def in_parts_if_without_room(self, scene: Scene) -> Scene:
        """Return the scene as it is drawn, in memory or part by part, see `in_parts_if_without_room`."""
        return in_parts_if_without_room(self._pictures, scene)

    def _draw(self, scene: CompleteScene, size: Size, settings: Settings, repeat: int = 1) -> NDArray[np.float32]:
        """Draw a picture; return a copy of the last one if it had the same scene and settings."""
        kept = self._kept
        if kept is not None and kept[0] is scene and kept[1:3] == (size, settings):
            return kept[3].copy()
        picture = super()._draw(scene, size, settings, repeat)
        if settings.early_termination > 0:  # without early termination it is a reference of an estimate
            self._kept = scene, size, settings, picture.copy()
        return picture


class JobRunner:
    """Renderer, and the code that turns jobs into answers."""

    def __init__(
        self, answer: Callable[[Answer], None], newest: Callable[[], int], device: int | str | None = None
    ) -> None:
        self._answer, self._newest = answer, newest
        self._renderer = PiecewiseRenderer(device)
        self._known: tuple[Any, ...] | None = None  # what the textures of the last job are made of
        self._moved: tuple[Any, ...] | None = None  # what the last picture of a scene in motion needs on the device
        self._lit: tuple[tuple[Any, ...], Any] | None = None  # volumes and estimator of the last lit scene's gradients

    def paint(self, job: Job) -> None:
        """Do a job; send one final answer, or none if a newer job arrives."""

        # Pictures at rest are drawn for a maximum error, so that auto is post.
        if job.scene.classification == "auto":
            job = replace(job, scene=job.scene.classified_as("post"))
        do = {"move": self._move, "rest": self._rest, "file": self._file}.get(job.kind, self._film)
        try:
            if job.kind == "move":  # a small picture, drawn in one piece
                do(job)
            else:
                with progress.heard(self._hearing(job), self._forecast(job)):
                    do(job)
        except Superseded:
            pass
        except Exception as error:  # the window stays open and shows the reason
            text = " ".join(str(error).split()) or type(error).__name__
            self._answer(Answer("failed", job.number, text=text))

    def _check(self, job: Job) -> None:
        if self._newest() > job.number:
            raise Superseded

    def _hearing(self, job: Job) -> Callable[[float], None]:
        """Return what hears the progress of a job: it ends a job that is superseded, and tells the window the rest."""
        told = time.perf_counter()
        tells = job.kind in _OF_ONE_PICTURE

        def hear(done: float) -> None:
            nonlocal told
            self._check(job)
            if tells and time.perf_counter() - told >= _TOLD:
                told = time.perf_counter()
                self._answer(Answer("progress", job.number, final=False, metadata={"done": done}))

        return hear

    def _forecast(self, job: Job) -> float:
        """Return about how many seconds a job takes on a usual machine."""
        if job.kind not in _OF_ONE_PICTURE:
            return 0.0
        has_textures = self._known is not None and self._known == forecast.of_what_textures(job.scene)
        self._known = forecast.of_what_textures(job.scene)
        seconds = forecast.of_picture(job.scene, job.size, job.accuracy, has_textures=has_textures)
        return seconds + _OF_WRITING * job.size[0] * job.size[1]

    def close(self) -> None:
        """Release the OpenGL context."""
        self._renderer.close()

    def _move(self, job: Job) -> None:
        """Draw one picture; if gradients have to be computed first, send an unlit picture before it.

        The first picture of its kind also compiles programs and uploads textures, so that its seconds tell nothing of
        the pictures that follow. A smaller one is drawn after it for its time alone.
        """
        start = time.perf_counter()
        if job.scene.lighting and not self._has_gradients(job.scene):
            picture = self._renderer.render(replace(job.scene, lighting=None), job.size, **job.accuracy)
            self._send(job, picture, start, final=False)
            start = time.perf_counter()
        picture = self._renderer.render(job.scene, job.size, **job.accuracy)
        before, self._moved = self._moved, _of_motion(job.scene)
        self._send(job, picture, start, final=before == self._moved)
        if before != self._moved:
            width, height = (max(1, side // _TIMED) for side in job.size)
            start = time.perf_counter()
            self._renderer.render(job.scene, (width, height), **job.accuracy)
            timed = {"seconds": time.perf_counter() - start, "shrink": _TIMED}
            self._answer(Answer("timed", job.number, metadata=timed))

    def _has_gradients(self, scene: Scene) -> bool:
        """True if the scene's gradients have been computed for the last lit scene; remember this scene's gradients."""
        known, self._lit = self._lit, (scene.volumes, scene.gradient)
        return known == self._lit

    def _rest(self, job: Job) -> None:
        """Draw a picture of one slab per sample, and the picture that `texvol render --max-error` writes.

        If that is not found by tiles, a picture of the accuracy that a small one predicts is drawn between them.
        """
        if isinstance(job.scene.volume, LargeVolume):
            job = replace(job, scene=self._renderer.in_parts_if_without_room(job.scene))
            reason = reason_for_memory(job.scene)
            self._by_levels(job, to_the_last=reason is None)
            if reason is None:
                return
            job = replace(job, scene=job.scene.in_memory(reason))
        start, renderer = time.perf_counter(), self._renderer
        slicing = job.accuracy.get("slicing", "stacks")
        quickly = forecast.of_picture(job.scene, job.size, {})
        with progress.span(_FIRST, quickly):
            first = renderer.render(job.scene, job.size, slicing=slicing)
        self._send(job, first, start, final=False)
        wanted = job.accuracy["max_error"]
        if job.scene.mode in NUMBER_MODES:
            # The error counts as a fraction of the window from black to white.
            _, width = job.showing.window or found_window(first, job.scene)
            wanted *= width or 1.0
        if not may_refine_tiles(*searched(job.scene, job.size, wanted, slicing)):
            self._foreseen(job, wanted, start)
        with warnings.catch_warnings(record=True) as missed:
            warnings.simplefilter("always", AccuracyWarning)
            picture = renderer.render(job.scene, job.size, max_error=wanted, slicing=slicing)
        metadata = {"wanted_error": wanted, "estimated_error": renderer.estimate, "reached": not missed}
        self._send(job, picture, start, **metadata)

    def _foreseen(self, job: Job, wanted: float, start: float) -> None:
        """Draw a picture of the accuracy that a small one predicts."""
        renderer, slicing = self._renderer, job.accuracy.get("slicing", "stacks")
        with progress.span(_FIRST, forecast.of_foreseeing(job.scene.completed(job.size), job.size)):
            choice = renderer.foresee(job.scene, job.size, wanted, slicing)
        termination = checked_termination(None, wanted)
        thickness: dict[str, Any] = {"slab_thickness": choice.slab_thickness}
        with progress.span(_FIRST, forecast.of_picture(job.scene, job.size, thickness, has_textures=True)):
            quick = renderer.render(
                job.scene, job.size, **thickness, texture_format="rgba32f", early_termination=termination,
                slicing=slicing,
            )  # fmt: skip
        metadata: dict[str, Any] = {"wanted_error": wanted, "reached": choice.reached}
        metadata["estimated_error"] = error_control.if_finite(choice.estimated_error)
        self._send(job, quick, start, final=False, **metadata)

    def _by_levels(self, job: Job, *, to_the_last: bool) -> None:
        """Draw pictures from coarse levels to the one that pixels show; how far the last ones differ is their error.

        The last one is left out unless `to_the_last` is True.
        """
        from texvol.rendering.streaming.progressive import coarse_levels

        start, renderer, before = time.perf_counter(), self._renderer, None
        slicing = job.accuracy.get("slicing", "stacks")
        levels: list[int | str] = [*coarse_levels(job.scene, job.size, {})[1:], *(["auto"] if to_the_last else [])]
        for level in levels:
            picture = renderer.render(job.scene, job.size, level=level, slicing=slicing)
            metadata: dict[str, Any] = {"level": renderer.settings["level"]}
            if before is not None:
                metadata["estimated_error"] = error_control.if_finite(error_control.largest_difference(picture, before))
            before = picture
            self._send(job, picture, start, final=level == "auto", **metadata)

    def _file(self, job: Job) -> None:
        export = _export(job)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            picture = self._renderer.render(job.scene, job.size, **job.accuracy)
            shown = export.of(picture, job.scene, job.path)
        metadata = {"texvol:renderer": self._renderer.renderer_name}
        metadata |= export.metadata(job.name, job.scene, job.path, self._renderer.settings)
        content = image.encoded(job.path, shown, metadata, transparent=job.showing.transparent)
        self._check(job)  # a file that nobody wants any more is not written
        writing.write_files({job.path: content})
        warned = {"warnings": [str(each.message) for each in said]}
        self._answer(Answer("done", job.number, text=job.path, metadata=warned))

    def _film(self, job: Job) -> None:
        from texvol.output import sequences
        from texvol.window import time_frames

        if job.kind == "steps":
            frames = time_frames.frames(job.scene, job.views, job.name)
        elif isinstance(job.course, Tour):
            frames = sequences.tour(job.scene, job.course, job.views, job.name)
        else:
            frames = sequences.views(job.scene, job.views, job.name, job.course)
        counted = replace(frames, scenes=self._counted(job, frames))
        accuracy: dict[str, Any] = dict.fromkeys(("slab_thickness", "sampling_rate", "max_error")) | dict(job.accuracy)
        how: dict[str, Any] = {"transparent": job.showing.transparent, "fps": job.fps}
        sequences.draw_frames(counted, self._renderer, job.size, accuracy, _export(job), job.path, **how)
        self._answer(Answer("done", job.number, text=job.path, metadata={"views": job.views}))

    def _counted(self, job: Job, frames: Any) -> Any:
        for number, scene in enumerate(frames.scenes):
            self._check(job)
            self._answer(Answer("progress", job.number, final=False, metadata={"done": number / frames.count}))
            yield scene

    def _send(self, job: Job, picture: NDArray, start: float, final: bool = True, **metadata: Any) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a view that misses the volume is common while the camera moves
            export = _export(job)
            shown = export.of(picture, job.scene, "window.png")
        scene, settings = job.scene.completed(job.size), self._renderer.settings
        thickness = self._renderer.uniform_settings["slab_thickness"]
        stacks = slicing.slab_stacks(scene.volume, scene.camera, thickness, job.size)
        if job.kind == "rest":
            volume = job.scene.volume
            metadata = {"level": volume.level if isinstance(volume, StandIn) else 0} | metadata
        metadata |= {
            "settings": settings,
            "seconds": time.perf_counter() - start,
            "slabs": stacks.slab_count,
            "thickness": thickness,
            "modelled": modelled(scene),
            "classification": job.scene.classification,
            "renderer": self._renderer.renderer_name,
            "window": export.window,
        }
        pixels = image.eight_bits(shown)
        if job.with_opacity:
            opacity = np.rint(np.clip(np.nan_to_num(shown[..., 3:]), 0, 1) * 255).astype(np.uint8)
            pixels = np.concatenate([pixels, opacity], axis=2)
        metadata["filled"] = filled_part(pixels)
        self._answer(Answer("picture", job.number, final, pixels, metadata))


def _of_motion(scene: Scene) -> tuple[Any, ...]:
    """Return what the textures and programs of a scene in motion are made of."""
    return (*scene.volumes, bool(scene.lighting), scene.gradient, scene.mode, scene.classification)


def _export(job: Job) -> PictureExport:
    return PictureExport(cast(Any, job.showing), job.showing.annotation)


def serve(connection_descriptor: int, newest_descriptor: int, niceness: int, device: int | str | None = None) -> None:
    """Receive jobs and send answers until the window closes the connection."""
    import mmap
    from multiprocessing.connection import Connection

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the window ends this process
    os.nice(niceness)
    connection: Any = Connection(connection_descriptor)
    newest = np.frombuffer(mmap.mmap(newest_descriptor, 8), np.int64)
    _end_with(os.getppid())
    receiver = Receiver(connection)
    warnings.simplefilter("ignore")  # nobody reads this process's output; warnings for the user are caught elsewhere
    with contextlib.suppress(EOFError, ConnectionError):
        try:
            runner = JobRunner(lambda answer: connection.send(answer), lambda: int(newest[0]), device)
        except Exception as error:
            connection.send(Answer("failed", 0, text=str(error)))
            return
        with np.errstate(all="ignore"):
            while True:
                job = receiver.receive()
                if int(newest[0]) <= job.number:
                    runner.paint(job)


def _end_with(parent: int) -> None:
    """Have Linux kill this process when the window's process ends."""
    import ctypes

    pr_set_pdeathsig = 1  # linux/prctl.h
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(0)
