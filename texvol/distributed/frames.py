"""Frames of a sequence over workers: each draws whole frames, different ones at a time, and they come back in order.

A frame that is drawn whole is that of one process to the last bit. A few frames are on their way at once, two for each
worker: the one that it draws, and one that waits, so that it is never idle. No more than these are held in memory,
drawn or not.
"""

from __future__ import annotations

import warnings
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import CancelledError
from dataclasses import dataclass
from typing import Any

from texvol.distributed.drawing import DrawnFrame, FrameOrder
from texvol.distributed.workers import Workers
from texvol.rendering.frames import Kept
from texvol.rendering.streaming.plan import in_bytes
from texvol.scene.scene import Scene

_OF_EACH = 2  # frames on their way: one that is drawn, and one that waits


@dataclass(frozen=True)
class Division:
    """Division of pictures among workers, and the reason for it in words."""

    divided: str  # "frames" or "blocks"
    divided_because: str


SINGLE = Division("blocks", "a single picture")


def division_of(frames: int | None, workers: int, blocks: int | None) -> Division:
    """Return how a number of frames is divided, of many if None; `blocks` is what each is to be cut into, if given."""
    if blocks is not None:
        return Division("blocks", f"{blocks} blocks were asked for")
    if frames is None:
        return Division("frames", f"nobody told the number of frames for {_counted(workers, 'worker')}")
    kind = "frames" if frames >= workers else "blocks"
    return Division(kind, f"{_counted(frames, 'frame')} for {_counted(workers, 'worker')}")


def reason_for_blocks(frame: DrawnFrame, workers: int) -> str | None:
    """Return why frames like one that was drawn are to be cut into blocks: only so a worker holds what it draws.

    What a worker does not hold it would read or upload anew for each frame.
    """
    if not frame.room < frame.needed <= frame.room * workers:
        return None
    return f"a whole frame takes {in_bytes(frame.needed)} of memory, a worker has {in_bytes(frame.room)} for it"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


@dataclass
class _Sent:
    scene: Scene
    report: bool = False  # True if the report of `--stats` is wanted as well
    address: str = ""
    coming: Any = None


class FramesOverWorkers:
    """Frames that workers draw, each of them whole.

    Parameters
    ----------
    workers : Workers
    size : (width, height)
        Pixels.
    views : int
        Number of pictures of each scene, from different sides.
    accuracy : dict
        Arguments of `Renderer.render` for the first frame, whose choices hold for all.
    """

    def __init__(self, workers: Workers, size: tuple[int, int], views: int, accuracy: dict[str, Any]) -> None:
        self._workers, self._size, self._views, self._accuracy = workers, size, views, accuracy
        self._kept: Kept | None = None
        self._sent: deque[_Sent] = deque()
        self._last: Scene | None = None
        self._stops = False
        self._preparing: list[Any] = []  # workers, while the first frame is drawn
        self.stats: list[dict[str, Any]] = []  # of each frame

    def drawn(
        self, scenes: Iterable[Scene], reason_to_stop: Callable[[Scene, DrawnFrame], str | None]
    ) -> Generator[tuple[Scene, DrawnFrame], None, None]:
        """Yield each scene with its frame; only the first one if there is a reason to stop after it."""
        remaining = iter(scenes)
        try:
            while not self._stops:
                self._send_more(remaining)
                if not self._sent:
                    return
                sent = self._sent.popleft()
                frame = self._frame_of(sent)
                if self._kept is None:
                    self._kept, self._stops = frame.kept, reason_to_stop(sent.scene, frame) is not None
                if not self._stops:
                    self._send_more(remaining)  # before this one is written
                self._last = sent.scene
                self.stats.append({"number": len(self.stats)} | frame.stats)
                for category, message in frame.warnings:
                    warnings.warn(message, category, stacklevel=3)
                yield sent.scene, frame
        finally:
            for coming in (*(sent.coming for sent in self._sent), *self._preparing):
                coming.cancel()
            self._sent.clear()
            self._preparing.clear()

    def report(self) -> dict[str, Any]:
        """Return what `--stats` says of the last frame as one process draws it; it is drawn once more for that."""
        assert self._last is not None
        sent = _Sent(self._last, report=True)
        self._send(sent)
        report = self._frame_of(sent).report
        assert report is not None
        return report

    def _send_more(self, scenes: Any) -> None:
        """Send scenes until enough are on their way; only the first one before its choices are known."""
        most = 1 if self._kept is None else _OF_EACH * self._workers.count
        while len(self._sent) < most:
            scene = next(scenes, None)
            if scene is None:
                return
            sent = _Sent(scene)
            self._send(sent)
            self._sent.append(sent)
            if self._kept is None and self._views > 1:
                self._prepare_others(sent)

    def _prepare_others(self, first: _Sent) -> None:
        """Let the other workers open their contexts and unpack the scene while one draws the first frame."""
        others = [each for each in self._workers.addresses() if each != first.address]
        self._preparing = self._workers.again_if_lost(lambda: self._workers.prepare(first.scene, others))

    def _send(self, sent: _Sent) -> None:
        """Send a scene to the worker that has least to do."""
        kept = self._kept
        scene = sent.scene if kept is None else sent.scene.classified_as(kept.classification)
        order = FrameOrder(self._size, self._views, self._accuracy, kept, sent.report)
        busy = Counter(each.address for each in self._sent if not each.coming.done())

        def begin() -> None:
            addresses = self._workers.addresses()
            if not addresses:
                raise CancelledError  # all workers are being replaced
            sent.address = min(addresses, key=lambda address: busy[address])
            sent.coming = self._workers.begin_frame(scene, order, sent.address)

        self._workers.again_if_lost(begin)

    def _frame_of(self, sent: _Sent) -> DrawnFrame:
        """Wait for a frame, and send it again if what it needs is lost."""

        def wait() -> DrawnFrame:
            try:
                return self._workers.drawn_frame(sent.coming)
            except CancelledError:
                self._send(sent)
                raise

        return self._workers.again_if_lost(wait)
