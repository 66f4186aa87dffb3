"""Commands of keys, buttons and scripts, by name: "undo", "axis +x", "tab Light", "open head.nrrd"."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

from texvol.scene.framing import VIEWS
from texvol.scene.scene import COLORINGS, MODES
from texvol.scene.transfer import PRESETS
from texvol.window import (
    choosing,
    closing,
    copying,
    editing,
    exporting,
    layout,
    list_editing,
    measure_changes,
    motion,
    navigation,
    opening,
    playing,
    saved_views,
    saving,
    sides,
)
from texvol.window.color_maps import NAMES
from texvol.window.desk import Desk
from texvol.window.document import Document, Home
from texvol.window.navigation import View
from texvol.window.opacity_shapes import SHAPES

TABS = ("Medium", "Scene", "View", "Light", "Cut", "Slices", "Measure", "File")


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


def _toggle(desk: Desk, name: str) -> None:
    setattr(desk.preferences, name, not getattr(desk.preferences, name))


def _turning(desk: Desk, _: str) -> None:
    desk.steering.free = not desk.steering.free
    desk.say("turning freely" if desk.steering.free else "turning on a turntable")


def _bring(desk: Desk, tab: str) -> None:
    desk.preferences = replace(desk.preferences, panels=True, tab=tab)


_ONE_OF: dict[str, Collection[str]] = {
    "axis": tuple(navigation.AXES), "view": VIEWS, "tab": TABS, "mode": MODES, "coloring": COLORINGS,
    "look": PRESETS, "colours": NAMES, "shape": tuple(SHAPES), "layout": ("", *layout.MODES),
}  # fmt: skip
_OF_WINDOW: dict[str, Callable[[Desk, str], None]] = {
    "help": lambda desk, _: _toggle(desk, "help"),
    "cube": lambda desk, _: setattr(desk.moving, "cube", not desk.moving.cube),
    "panels": lambda desk, _: _toggle(desk, "panels"),
    "probe": lambda desk, _: _toggle(desk, "probe"),
    "details": lambda desk, _: _toggle(desk, "details"),
    "tab": _bring,
    "slices": lambda desk, _: _bring(desk, "Slices"),
    "layout": lambda desk, mode: desk.layout.become(mode),
    "fullscreen": lambda desk, _: _toggle(desk, "fullscreen"),
    "turning": _turning,
    "open": lambda desk, path: opening.open_file(desk, path) if path else opening.browse_to_open(desk),
    "add": lambda desk, path: opening.add(desk, path) if path else opening.browse_to_add(desk),
    "play": lambda desk, _: playing.play(desk),
    "step": playing.go,
    "close": lambda desk, _: closing.close(desk),
    "answer": lambda desk, words: desk.reply(words),
    "undo": lambda desk, _: desk.step(back=True),
    "redo": lambda desk, _: desk.step(back=False),
    "back": lambda desk, _: desk.step(back=True, whole=True),
    "forward": lambda desk, _: desk.step(back=False, whole=True),
}


def _look_at_all(desk: Desk, document: Document, change: Callable[..., View], *how: str) -> None:
    """Look at all that shows; it is framed so that the annotation has room beside it."""
    aspect = desk.viewport.aspect
    view = change(document.view, *how, document.scene.box, aspect)
    document.look(navigation.on_content(view, document.scene, aspect))
    document.go_home(Home.of(document.view.camera, document.scene, desk.pixels, document.showing.annotation))


def _axis(desk: Desk, document: Document, axis: str) -> None:
    if axis in navigation.AXES:
        _look_at_all(desk, document, navigation.along_axis, axis)


def _view(desk: Desk, document: Document, side: str) -> None:
    """Go to a view from a side, framed as `_look_at_all` does."""
    if side not in VIEWS:
        return
    scene, aspect = document.scene, desk.viewport.aspect
    view = navigation.on_content(sides.from_side(document.view, side, scene.box, aspect), scene, aspect)
    home = Home.of(view.camera, scene, desk.pixels, document.showing.annotation)
    motion.go(desk, document, View(home.roomy, view.pivot), lambda: document.go_home(home))


def _go(desk: Desk, document: Document, name: str) -> None:
    desk.attempt(lambda: saved_views.go(desk, document, saved_views.number_of(document.tour, name)))


def _projection(desk: Desk, document: Document, _: str) -> None:
    other: Any = "perspective" if document.view.camera.projection == "orthographic" else "orthographic"
    document.look(navigation.with_projection(document.view, other, document.scene.box))


def _copy_command(desk: Desk, document: Document, _: str) -> None:
    def copy() -> None:
        words = saving.command_line(document, desk.layout.alone(desk.pixels), desk.accuracy)
        desk.copy(shlex.join(words))
        assert document.written is not None
        exporting.wrote_scene(desk, document, document.written.path)
        desk.say(f"command line copied to the clipboard; its scene file is {words[words.index('--scene') + 1]}")

    desk.attempt(copy)


def _mask(desk: Desk, document: Document, path: str) -> None:
    volume = document.scene.volume
    if path:
        opening.mask(desk, volume, path)
    else:
        opening.browse_for_mask(desk, volume)


_OF_DOCUMENT: dict[str, Callable[[Desk, Document, str], Any]] = {
    "reset": lambda desk, document, _: _look_at_all(desk, document, navigation.reset),
    "frame": lambda desk, document, _: _look_at_all(desk, document, navigation.framed),
    "axis": _axis,
    "view": _view,
    "save-view": saved_views.save,
    "go": _go,
    "preview": lambda desk, document, _: desk.attempt(lambda: motion.preview(desk, document, document.tour)),
    "projection": _projection,
    "mask": _mask,
    "mode": lambda desk, document, mode: desk.change(**editing.with_mode(document.scene, mode)),
    "coloring": lambda desk, document, coloring: desk.change(**editing.with_coloring(document.scene, coloring)),
    "look": choosing.look,
    "colours": choosing.colors,
    "shape": choosing.shape,
    "save": exporting.scene,
    "picture": exporting.picture,
    "copy": lambda desk, document, _: copying.copy(desk),
    "copy-command": _copy_command,
    **{name: list_editing.command(name) for name in list_editing.COMMANDS},
    "measure": measure_changes.run,
}
