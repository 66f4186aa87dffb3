"""Commands of keys, buttons and scripts, by name: "undo", "axis +x", "tab Light", "open head.nrrd"."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from texvol.scene.scene import COLORINGS, MODES
from texvol.window import editing, navigation, opening, saving
from texvol.window.desk import Desk
from texvol.window.document import Document, Home
from texvol.window.navigation import View

TABS = ("Medium", "Scene", "View", "Light", "Cut", "Slices", "File")


def run(desk: Desk, command: str) -> None:
    """Run a command; a command for a document does nothing if no document is open."""
    name, _, argument = command.partition(" ")
    if name in _OF_WINDOW:
        _OF_WINDOW[name](desk, argument)
    elif desk.document is not None and name in _OF_DOCUMENT:
        _OF_DOCUMENT[name](desk, desk.document, argument)


def is_command(command: str) -> bool:
    """True if `run` knows the command and its argument is allowed."""
    name, _, argument = command.partition(" ")
    if name in _ONE_OF:
        return argument in _ONE_OF[name]
    return name in _OF_WINDOW or name in _OF_DOCUMENT


def _toggle(name: str) -> Callable[[Desk, str], None]:
    def toggle(desk: Desk, _: str) -> None:
        setattr(desk.preferences, name, not getattr(desk.preferences, name))

    return toggle


def _turning(desk: Desk, _: str) -> None:
    desk.steering.free = not desk.steering.free
    desk.say("turning freely" if desk.steering.free else "turning on a turntable")


def _close(desk: Desk, _: str) -> None:
    desk.wants_close = True


def _bring(desk: Desk, tab: str) -> None:
    desk.preferences = replace(desk.preferences, panels=True, tab=tab)


def _open(desk: Desk, path: str) -> None:
    if path:
        opening.open_file(desk, path)
    else:
        opening.browse_to_open(desk)


def _add(desk: Desk, path: str) -> None:
    if path:
        opening.add(desk, path)
    else:
        opening.browse_to_add(desk)


_ONE_OF = {"axis": tuple(navigation.AXES), "tab": TABS, "mode": MODES, "coloring": COLORINGS}
_OF_WINDOW: dict[str, Callable[[Desk, str], None]] = {
    "help": _toggle("help"),
    "panels": _toggle("panels"),
    "probe": _toggle("probe"),
    "tab": _bring,
    "slices": lambda desk, _: _bring(desk, "Slices"),
    "fullscreen": _toggle("fullscreen"),
    "turning": _turning,
    "open": _open,
    "add": _add,
    "close": _close,
}


def _look_at_all(desk: Desk, document: Document, view: View) -> None:
    """Look at the whole box; the box is framed so that the annotation has room beside it."""
    document.look(view)
    document.go_home(Home.of(view.camera, document.scene, desk.pixels, document.showing.annotation))


def _reset(desk: Desk, document: Document, _: str) -> None:
    _look_at_all(desk, document, navigation.reset(document.view, document.scene.box, desk.viewport.aspect))


def _frame(desk: Desk, document: Document, _: str) -> None:
    _look_at_all(desk, document, navigation.framed(document.view, document.scene.box, desk.viewport.aspect))


def _axis(desk: Desk, document: Document, axis: str) -> None:
    if axis in navigation.AXES:
        view = navigation.along_axis(document.view, axis, document.scene.box, desk.viewport.aspect)
        _look_at_all(desk, document, view)


def _projection(desk: Desk, document: Document, _: str) -> None:
    other: Any = "perspective" if document.view.camera.projection == "orthographic" else "orthographic"
    document.look(navigation.with_projection(document.view, other, document.scene.box))


def _save(desk: Desk, document: Document, path: str) -> None:
    path = path or saving.scene_name(document)
    if desk.attempt(lambda: saving.save_scene(path, document, desk.pixels)):
        document.origin = replace(document.origin, scene_file=path)
        desk.say(f"saved {Path(path).resolve()}")


def _picture(desk: Desk, document: Document, path: str) -> None:
    desk.write(
        kind="file", size=desk.pixels, accuracy=desk.accuracy, path=path or saving.default_name(document, ".png")
    )


def _copy(desk: Desk, document: Document, _: str) -> None:
    def copy() -> None:
        words = saving.command_line(document, desk.pixels, desk.accuracy)
        desk.copy(shlex.join(words))
        desk.say(f"command line copied to the clipboard; its scene file is {words[words.index('--scene') + 1]}")

    desk.attempt(copy)


def _mode(desk: Desk, document: Document, mode: str) -> None:
    desk.change(**editing.with_mode(document.scene, mode))


def _coloring(desk: Desk, document: Document, coloring: str) -> None:
    desk.change(**editing.with_coloring(document.scene, coloring))


def _mask(desk: Desk, document: Document, path: str) -> None:
    if path:
        opening.mask(desk, document.scene.volume, path)
    else:
        opening.browse_for_mask(desk, document.scene.volume)


_OF_DOCUMENT: dict[str, Callable[[Desk, Document, str], None]] = {
    "reset": _reset,
    "frame": _frame,
    "axis": _axis,
    "projection": _projection,
    "mask": _mask,
    "mode": _mode,
    "coloring": _coloring,
    "undo": lambda desk, document, _: document.undo(),
    "redo": lambda desk, document, _: document.redo(),
    "save": _save,
    "picture": _picture,
    "copy": _copy,
}
