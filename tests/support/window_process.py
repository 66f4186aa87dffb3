"""Process that runs `texvol view` again and again, for windows of which the process itself is not tested.

Each window is opened as by the command line, in its folder and with its environment. What takes most of the time of a
small window is made once: Python's modules, and the two painting processes with their contexts and programs. A window
that is closed gives its painters back, and the next one has them.

It reads requests from its standard input, and writes the exit status of each to the file with the number in its first
argument. All of them write to one standard output and error, as do the painters.
"""

from __future__ import annotations

import contextlib
import gc
import itertools
import json
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any, TextIO

from texvol.__main__ import main
from texvol.window import application
from texvol.window.jobs import Job
from texvol.window.painter import Painter
from texvol.window.transport import Sender, SharedArrays

_FRAME = 1 / 20  # seconds: each frame takes time from the pictures, and none is looked at by a person
_COARSE = "--frame-rate", "1000"  # of pictures while something moves: as coarse as they get
_KEPT = 2  # painters of each window: mover and refiner; one that writes files begins in the folder of its window


class KeptPainter(Painter):
    """Painter whose process is not ended with its window."""

    def serve(self, shared: SharedArrays, wake: Callable[[], None]) -> KeptPainter:
        """Paint for another window."""
        self._shared, self._wake = shared, wake
        self._sender = Sender(self._connection, shared)
        return self

    def close(self) -> None:
        """Give the process back, with nothing to do and nothing of the window's scenes."""
        self._wake = lambda: None
        self.drop()
        self._answers.clear()
        if self.alive:
            with contextlib.suppress(OSError):
                self._sender.send(Job(0, "move", None, (1, 1)))  # type: ignore[arg-type]
            _FREE.setdefault((self._niceness, self._device), []).append(self)
        else:
            super().close()


_FREE: dict[tuple[int, Any], list[KeptPainter]] = {}


def painters() -> Callable[..., Painter]:
    """Return what makes the painters of one window."""
    made = 0

    def make(shared: SharedArrays, wake: Callable[[], None], niceness: int = 0, device: Any = None) -> Painter:
        nonlocal made
        made += 1
        if made > _KEPT:
            return Painter(shared, wake, niceness, device)
        free = _FREE.setdefault((niceness, device), [])
        while free:
            painter = free.pop()
            if painter.alive:
                return painter.serve(shared, wake)
            Painter.close(painter)
        return KeptPainter(shared, wake, niceness, device)

    return make


def view(words: list[str]) -> int:
    """Run `texvol view`, and return its exit status."""
    application.Painter = painters()  # type: ignore[assignment, misc]
    application._FRAME = _FRAME
    try:
        return main(["view", *_COARSE, *words])
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        traceback.print_exc()
        return 1


def serve(requests: TextIO, answers: int) -> None:
    """Open the windows that are asked for, one after the other."""
    for line in requests:
        request = json.loads(line)
        os.chdir(request["folder"])
        os.environ.clear()
        os.environ.update(request["environment"])
        status = view(request["words"])
        gc.collect()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os.write(answers, f"{status}\n".encode())
    for painter in itertools.chain.from_iterable(_FREE.values()):
        Painter.close(painter)


if __name__ == "__main__":
    serve(sys.stdin, int(sys.argv[1]))
