"""A desk of the window without a window: its documents, commands and questions."""

from __future__ import annotations

import time
from typing import Any, cast

from support.windows import PATIENCE
from texvol.window import freeing, opening
from texvol.window.commands import is_command, run
from texvol.window.desk import Desk
from texvol.window.steering import Viewport

SIZE = (60, 40)


def desk_with(path: str) -> Desk:
    """A desk with that file open, and nobody who draws."""
    nobody: Any = None
    desk = Desk(nobody, lambda: nobody, lambda: None, lambda text: None)
    desk.director = cast(Any, type("Quiet", (), {"faults": []})())
    desk.viewport, desk.pixels = Viewport(0, 0, *SIZE), SIZE
    opening.open_file(desk, path)
    return settled(desk)


def settled(desk: Desk) -> Desk:
    """The same, once all is read."""
    end = time.monotonic() + PATIENCE
    freeing.limit(desk)
    while desk.loading is not None or desk.waiting:
        assert time.monotonic() < end, "it was never read"
        desk.update()
        freeing.limit(desk)
        time.sleep(0.005)
    return desk


def done(desk: Desk, *commands: str) -> Any:
    """The document after commands, each when the one before is done."""
    for command in commands:
        assert is_command(command)
        run(desk, command)
        settled(desk)
    assert desk.document is not None
    return desk.document


def said(desk: Desk) -> str:
    return "\n".join(each.text for each in desk.messages)
