"""The other side of a painter: a process that draws what it is asked for with the headless Renderer.

A picture at rest may take seconds, and is to be dropped as soon as something newer is wanted. So it is drawn a few rows
at a time, and between them a number in shared memory is looked at: that of the newest job. Cut like this the picture is
the same to the bit: no pixel knows of another.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from operator import is_
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.output.shown_pictures import Display
from texvol.rendering import error_control
from texvol.rendering.accuracy import checked_termination
from texvol.rendering.modelled import modelled
from texvol.rendering.renderer import Renderer, Size
from texvol.rendering.settings import Settings
from texvol.scene.display import NUMBER_MODES, found_window
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing import slabs as slicing
from texvol.util import writing
from texvol.util.errors import AccuracyWarning
from texvol.window.jobs import Answer, Job
from texvol.window.parcels import Receiver

# A piece of a picture takes about so long: a tenth of what one notices as a delay.
_PIECE = 0.015
_FIRST_ROWS = 64
_FEWEST_ROWS = 16  # below, setting up costs more than drawing


class Superseded(Exception):
    """Something newer is wanted."""


class PiecewiseCompositor(Compositor):
    """A compositor that gives up in the middle of a picture when `check` raises: it draws some rows after the other."""

    check: Callable[[], None] | None = None

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._rows = _FIRST_ROWS

    def _blend(self, program: Any, stacks: slicing.SlabStacks, blending: str) -> None:
        if self.check is None:
            super()._blend(program, stacks, blending)
            return
        target, row = self.target, 0
        width, height = target.size
        try:
            while row < height:
                self.check()
                start, rows = time.perf_counter(), min(self._rows, height - row)
                target.scissor = 0, row, width, rows
                target.use()
                super()._blend(program, stacks, blending)
                self.finish()
                row += rows
                self._adapt(time.perf_counter() - start)
        finally:
            target.scissor = None  # type: ignore[assignment]
            target.use()

    def _adapt(self, seconds: float) -> None:
        if seconds > 2 * _PIECE:
            self._rows = max(self._rows // 2, _FEWEST_ROWS)
        elif seconds < _PIECE:
            self._rows *= 2


class PiecewiseRenderer(Renderer):
    """A Renderer that can be interrupted, and says how fine a picture has to be before it draws it."""

    def __init__(self) -> None:
        self._pieces: PiecewiseCompositor
        self._kept: tuple[Scene, Size, Settings, NDArray[np.float32]] | None = None
        super().__init__(compositor=self._in_pieces)

    def _in_pieces(self, context: Context) -> PiecewiseCompositor:
        self._pieces = PiecewiseCompositor(context)
        return self._pieces

    def interruptible(self, check: Callable[[], None] | None) -> None:
        """From now on drawing calls `check` several times a picture."""
        self._pieces.check = check

    def _draw(
        self, scene: CompleteScene, size: Size, settings: Settings, repeat: int = 1, depth: bool = False
    ) -> NDArray[np.float32]:
        """The last picture again, where that is asked for: what is foreseen is shown first, and then checked."""
        kept = self._kept
        if kept is not None and kept[0] is scene and kept[1:3] == (size, settings) and not depth:
            return kept[3].copy()
        picture = super()._draw(scene, size, settings, repeat, depth)
        if settings.early_termination > 0 and not depth:  # or it is what others are held against
            self._kept = scene, size, settings, picture.copy()
        return picture

    def fine_enough(self, scene: Scene, size: Size, max_error: float) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arguments of `render` for a picture of that error as a small one foresees it, and what is known of it."""
        choice = self.foresee(scene, size, max_error)
        return {
            "slab_thickness": choice.slab_thickness,
            "texture_format": "rgba32f",
            "early_termination": checked_termination(None, max_error),
        }, {
            "estimated_error": error_control.if_finite(choice.estimated_error),
            "wanted_error": max_error,
            "reached": choice.reached,
        }


class Easel:
    """A renderer, and what it takes to turn jobs into answers."""

    def __init__(self, answer: Callable[[Answer], None], newest: Callable[[], int]) -> None:
        self._answer, self._newest = answer, newest
        self._renderer = PiecewiseRenderer()
        self._lit: tuple[tuple[Any, ...], Any] | None = None  # volumes and estimator whose gradients are there

    def paint(self, job: Job) -> None:
        """Do it, with one final answer; or none, where something newer is wanted."""

        def check() -> None:
            if self._newest() > job.number:
                raise Superseded

        self._renderer.interruptible(None if job.kind == "move" else check)
        try:
            {"move": self._move, "rest": self._rest, "file": self._file, "film": self._film}[job.kind](job)
        except Superseded:
            pass
        except Exception as error:  # whatever it is, the window stays and says so
            text = " ".join(str(error).split()) or type(error).__name__
            self._answer(Answer("failed", job.number, text=text, metadata={"error": type(error).__name__}))

    def close(self) -> None:
        """Give the context back."""
        self._renderer.close()

    def _move(self, job: Job) -> None:
        """One picture; before it the same unlit, where light is new, since finding the gradients takes a while."""
        start = time.perf_counter()
        if job.scene.lighting and not self._has_gradients(job.scene):
            picture = self._renderer.render(replace(job.scene, lighting=None), job.size, **job.accuracy)
            self._send(job, picture, self._renderer.settings, start, final=False)
            start = time.perf_counter()
        picture = self._renderer.render(job.scene, job.size, **job.accuracy)
        self._send(job, picture, self._renderer.settings, start)

    def _has_gradients(self, scene: Scene) -> bool:
        """Whether they are those of the last lit scene; the next will find them."""
        known, self._lit = self._lit, (scene.volumes, scene.gradient)
        if known is None or known[1] != scene.gradient or len(known[0]) != len(scene.volumes):
            return False
        return all(map(is_, known[0], scene.volumes))

    def _rest(self, job: Job) -> None:
        """A picture of one slab per sample at once; soon one that a small picture says is fine enough; then `render`'s.

        The last is the very picture that `render` draws for this error, which takes it a few seconds to choose.
        """
        start, renderer = time.perf_counter(), self._renderer
        first = renderer.render(job.scene, job.size)
        self._send(job, first, renderer.settings, start, final=False)
        wanted = job.accuracy["max_error"]
        if job.scene.mode in NUMBER_MODES:
            # The error is wanted of what is seen: in shares of what goes from black to white.
            _, width = job.showing.window or found_window(first, job.scene)
            wanted *= width or 1.0
        chosen, metadata = renderer.fine_enough(job.scene, job.size, wanted)
        quick = renderer.render(job.scene, job.size, **chosen)
        self._send(job, quick, renderer.settings, start, final=False, **metadata)
        with warnings.catch_warnings(record=True) as missed:
            warnings.simplefilter("always", AccuracyWarning)
            picture = renderer.render(job.scene, job.size, max_error=wanted)
        metadata |= {"estimated_error": renderer.estimate, "reached": not missed}
        self._send(job, picture, renderer.settings, start, **metadata)

    def _file(self, job: Job) -> None:
        display = _display(job)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            picture = self._renderer.render(job.scene, job.size, **job.accuracy)
            shown = display.of(picture, job.scene, job.path)
        metadata = {"texvol:renderer": self._renderer.renderer_name}
        metadata |= display.metadata(job.name, job.scene, job.path, self._renderer.settings)
        content = image.encoded(job.path, shown, metadata, transparent=job.showing.transparent)
        writing.write_files({job.path: content})
        warned = {"warnings": [str(each.message) for each in said]}
        self._answer(Answer("done", job.number, text=job.path, metadata=warned))

    def _film(self, job: Job) -> None:
        from texvol.output import sequences

        frames = sequences.views(job.scene, job.views, job.name)
        told = replace(frames, scenes=self._counted(job, frames))
        accuracy: dict[str, Any] = dict.fromkeys(("slab_thickness", "sampling_rate", "max_error")) | dict(job.accuracy)
        how: dict[str, Any] = {"transparent": job.showing.transparent, "fps": job.fps}
        sequences.draw_frames(told, self._renderer, job.size, accuracy, _display(job), job.path, **how)
        self._answer(Answer("done", job.number, text=job.path, metadata={"views": job.views}))

    def _counted(self, job: Job, frames: Any) -> Any:
        for number, scene in enumerate(frames.scenes):
            if self._newest() > job.number:
                raise Superseded
            self._answer(Answer("progress", job.number, final=False, metadata={"done": number / frames.count}))
            yield scene

    def _send(
        self, job: Job, picture: NDArray, settings: Any, start: float, final: bool = True, **metadata: Any
    ) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a view that misses the volume is no surprise here
            display = _display(job)
            shown = display.of(picture, job.scene, "window.png")
        scene, thickness = job.scene.completed(job.size), settings["slab_thickness"]
        metadata |= {
            "settings": dict(settings),
            "seconds": time.perf_counter() - start,
            "slabs": slicing.slab_stacks(scene.volume, scene.camera, thickness, job.size).slab_count,
            "modelled": modelled(scene),
            "classification": job.scene.classification,
            "renderer": self._renderer.renderer_name,
            "window": display.window,
        }
        pixels = image.eight_bits(shown)
        self._answer(Answer("picture", job.number, final, pixels, metadata))


def _display(job: Job) -> Display:
    return Display(cast(Any, job.showing), job.showing.annotation)


def serve(connection_descriptor: int, newest_descriptor: int, niceness: int) -> None:
    """What the process does until nobody waits any more: take jobs, draw, answer."""
    import mmap
    from multiprocessing.connection import Connection

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the window decides when to end
    os.nice(niceness)
    connection: Any = Connection(connection_descriptor)
    newest = np.frombuffer(mmap.mmap(newest_descriptor, 8), np.int64)
    _end_with(os.getppid())
    receiver = Receiver(connection)
    warnings.simplefilter("ignore")  # nobody reads what this process prints; what has a say is caught where it is said
    with contextlib.suppress(EOFError, ConnectionError):
        try:
            easel = Easel(lambda answer: connection.send(answer), lambda: int(newest[0]))
        except Exception as error:
            connection.send(Answer("failed", 0, text=str(error), metadata={"error": "ContextError"}))
            return
        with np.errstate(all="ignore"):
            while True:
                job = receiver.receive()
                if int(newest[0]) <= job.number:
                    easel.paint(job)


def _end_with(parent: int) -> None:
    """Have the system end this process with the window's, however that ends."""
    import ctypes

    pr_set_pdeathsig = 1  # linux/prctl.h
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(0)
