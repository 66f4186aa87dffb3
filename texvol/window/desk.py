"""The desk: what is open, what is chosen, and everything that keys and panels can have done."""

from __future__ import annotations

import shlex
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.errors import TexvolError
from texvol.window import navigation, recent, saving
from texvol.window.browsing import Browser
from texvol.window.director import Director
from texvol.window.document import Document, Home, opened_file
from texvol.window.jobs import Answer
from texvol.window.naming import how_read
from texvol.window.painter import Painter
from texvol.window.probe import Found
from texvol.window.screen import Textures
from texvol.window.steering import Room, Steering

MESSAGE_SECONDS = 8.0


@dataclass
class Message:
    """Something that is said in the window for a while."""

    text: str
    is_fault: bool
    until: float


@dataclass
class Preferences:
    """What is seen beside the picture."""

    panels: bool = True
    help: bool = False
    probe: bool = False
    tab: str = ""  # to be brought to the front
    fullscreen: bool = False


class Loading:
    """A document that is being opened on a thread of its own."""

    def __init__(self, name: str, make: Callable[[], Document], wake: Callable[[], None], first: bool) -> None:
        self.name, self.first = name, first
        self.document: Document | None = None
        self.fault: str | None = None
        self._make, self._wake = make, wake
        self._thread = threading.Thread(target=self._load, daemon=True, name="texvol loading")
        self._thread.start()

    @property
    def over(self) -> bool:
        """Whether there is a document, or a fault."""
        return self.document is not None or self.fault is not None

    def _load(self) -> None:
        try:
            self.document = self._make()
        except Exception as error:  # whatever a file makes a reader raise, the window stays
            text = " ".join(str(error).split())
            self.fault = text if isinstance(error, TexvolError) and text else f"{self.name}: {text or error!r}"
        self._wake()


@dataclass
class Desk:
    """See the module.

    Attributes
    ----------
    clerk : Painter, optional
        The process that writes pictures and films; started when first wanted.
    """

    director: Director
    make_painter: Callable[[], Painter]
    wake: Callable[[], None]
    copy: Callable[[str], None]
    preferences: Preferences = field(default_factory=Preferences)
    steering: Steering = field(default_factory=Steering)
    textures: Textures | None = None
    document: Document | None = None
    room: Room = field(default_factory=lambda: Room(0, 0, 1, 1))
    pixels: tuple[int, int] = (1, 1)  # of the room
    messages: list[Message] = field(default_factory=list)
    loading: Loading | None = None
    clerk: Painter | None = None
    writing: float | None = None  # how much of a file is written
    wants_close: bool = False
    is_played: bool = False  # by a script
    gripping: bool = False  # whether the mouse is at a grip in the picture
    failed_first: str | None = None  # why the document that the window was opened for can't be
    browser: Browser | None = None  # while somebody looks for a file
    probed: Found | None = None  # what is under the cursor, where that is asked for
    now: float = 0.0
    panel_state: dict[str, Any] = field(default_factory=dict)
    folder: Path = field(default_factory=Path.cwd)  # in which a file was looked for last

    def say(self, text: str, *, fault: bool = False) -> None:
        """A message; a fault stays longer. Nothing but faults is said over what a script has drawn."""
        if self.is_played and not fault:
            return
        self.messages = [each for each in self.messages if each.text != text]
        self.messages.append(Message(text, fault, self.now + MESSAGE_SECONDS * (2 if fault else 1)))

    def attempt(self, action: Callable[[], Any]) -> bool:
        """Do it; what is wrong with it is said in the window."""
        try:
            action()
        except (TexvolError, OSError) as error:
            self.say(" ".join(str(error).split()), fault=True)
            return False
        return True

    def texture(self, name: str, key: Any, make: Callable[[], NDArray[np.uint8]]) -> int:
        """OpenGL's number of a picture with that name, made anew when the key is another."""
        assert self.textures is not None
        return self.textures.get(name, key, make)

    def change(self, stroke: str | None = None, **parts: Any) -> bool:
        """Other parts of the scene."""
        assert self.document is not None
        document = self.document
        return self.attempt(lambda: document.change(stroke, **parts))

    def open(self, path: str, how: Mapping[str, Any] | None = None) -> None:
        """Open a volume, a scene, or a transfer function into the scene; the old one stays until that is done.

        `how` are arguments of `texvol.readers.load`.
        """
        if path.lower().endswith(".json") and self.document is not None:
            from texvol import transfer

            volume = self.document.scene.volume
            self.attempt(lambda: self.change(transfer_function=transfer.load(path, volume)))
            return
        size = self.pixels
        self.load(path, lambda: opened_file(path, size, how))

    def load(self, name: str, make: Callable[[], Document], *, first: bool = False) -> None:
        """Open what `make` makes, on another thread; without the `first` one the window has no reason to be."""
        self.loading = Loading(name, make, self.wake, first)

    def update(self) -> None:
        """Take what has been loaded or written, and drop old messages."""
        self.messages = [each for each in self.messages if each.until > self.now]
        loading = self.loading
        if loading is not None and loading.over:
            self.loading = None
            if loading.document is None:
                self.say(loading.fault or "", fault=True)
                self.failed_first = loading.fault if loading.first else None
            else:
                document = self.document = loading.document
                is_scene = loading.name == document.origin.scene_file
                how = {} if is_scene else how_read(document.scene.volume.source)
                self.messages = [each for each in self.messages if not each.is_fault]
                self.panel_state.clear()
                self.attempt(lambda: recent.add(loading.name, how))
        for fault in self.director.faults:
            self.say(fault, fault=True)
        self.director.faults.clear()
        for answer in self.clerk.answers() if self.clerk is not None else []:
            self._hear(answer)

    def browse(self, title: str, done: Callable[[str], None], *, saves: bool = False, name: str = "") -> None:
        """Have somebody look for a file, where the last one was found."""
        typed = Path(name).expanduser()
        folder = typed.absolute().parent if name else self.folder

        def chosen(path: str) -> None:
            self.folder = Path(path).parent
            done(path)

        self.browser = Browser(title, chosen, self.wake, folder, saves, typed.name if name else "")

    def run(self, command: str) -> None:
        """What a key or a button asks for, by name."""
        name, _, argument = command.partition(" ")
        if name == "tab":
            _bring(argument)(self)
        elif name in _OF_WINDOW:
            _OF_WINDOW[name](self)
        elif self.document is not None and name in _OF_DOCUMENT:
            _OF_DOCUMENT[name](self, self.document, argument)

    def knows(self, command: str) -> bool:
        """Whether there is such a command."""
        name, _, argument = command.partition(" ")
        if name == "axis":
            return argument in navigation.AXES
        return name == "tab" or name in _OF_WINDOW or name in _OF_DOCUMENT

    def write(self, **job: Any) -> None:
        """Have a file written by the clerk."""
        document = self.document
        assert document is not None
        if self.clerk is None or not self.clerk.alive:
            self.clerk = self.make_painter()
        self.writing = 0.0
        clerk = self.clerk
        self.attempt(
            lambda: clerk.ask(scene=document.scene, showing=document.showing, name=document.origin.volume, **job)
        )

    def stop_writing(self) -> None:
        """Drop the file."""
        if self.clerk is not None:
            self.clerk.drop()
        self.writing = None

    def close(self) -> None:
        """End what goes on."""
        if self.clerk is not None:
            self.clerk.close()

    @property
    def accuracy(self) -> dict[str, Any]:
        """What a file is to be drawn with: as the picture at rest was, or to the same error."""
        shown = self.director.shown
        if shown is not None and shown.state == "rest" and "settings" in shown.facts:
            return dict(shown.facts["settings"])
        return {"max_error": self.director.max_error}

    def _hear(self, answer: Answer) -> None:
        if answer.kind == "progress":
            self.writing = float(answer.facts["done"])
            return
        self.writing = None
        for warning in answer.facts.get("warnings", ()):
            self.say(warning)
        self.say(answer.text if answer.kind == "failed" else f"{answer.text} is written", fault=answer.kind == "failed")


def _toggle(name: str) -> Callable[[Desk], None]:
    def toggle(desk: Desk) -> None:
        setattr(desk.preferences, name, not getattr(desk.preferences, name))

    return toggle


def _turning(desk: Desk) -> None:
    desk.steering.free = not desk.steering.free
    desk.say("turning freely" if desk.steering.free else "turning as on a turntable")


def _close(desk: Desk) -> None:
    desk.wants_close = True


def _bring(tab: str) -> Callable[[Desk], None]:
    def bring(desk: Desk) -> None:
        desk.preferences = replace(desk.preferences, panels=True, tab=tab)

    return bring


_OF_WINDOW: dict[str, Callable[[Desk], None]] = {
    "help": _toggle("help"),
    "panels": _toggle("panels"),
    "probe": _toggle("probe"),
    "slices": _bring("Slices"),
    "fullscreen": _toggle("fullscreen"),
    "turning": _turning,
    "open": lambda desk: desk.browse("Open a volume, a scene or a transfer function", desk.open),
    "close": _close,
}


def _reset(desk: Desk, document: Document, _: str) -> None:
    view = navigation.reset(document.view, document.scene.box, desk.room.aspect)
    document.look(view)
    document.go_home(Home.of(view.camera, document.scene, desk.pixels, document.showing.annotation))


def _frame(desk: Desk, document: Document, _: str) -> None:
    document.look(navigation.framed(document.view, document.scene.box, desk.room.aspect))


def _axis(desk: Desk, document: Document, axis: str) -> None:
    if axis in navigation.AXES:
        document.look(navigation.along_axis(document.view, axis, document.scene.box, desk.room.aspect))


def _projection(desk: Desk, document: Document, _: str) -> None:
    other: Any = "perspective" if document.view.camera.projection == "orthographic" else "orthographic"
    document.look(navigation.with_projection(document.view, other, document.scene.box))


def _save(desk: Desk, document: Document, path: str) -> None:
    path = path or saving.scene_name(document)
    if desk.attempt(lambda: saving.save_scene(path, document, desk.pixels)):
        document.origin = replace(document.origin, scene_file=path)
        desk.say(f"{Path(path).resolve()} is written")


def _picture(desk: Desk, document: Document, path: str) -> None:
    desk.write(
        kind="file", size=desk.pixels, accuracy=desk.accuracy, path=path or saving.default_name(document, ".png")
    )


def _copy(desk: Desk, document: Document, _: str) -> None:
    def copy() -> None:
        words = saving.command_line(document, desk.pixels, desk.accuracy)
        desk.copy(shlex.join(words))
        desk.say(
            "the command line is on the clipboard, and the scene that it draws in " + words[words.index("--scene") + 1]
        )

    desk.attempt(copy)


_OF_DOCUMENT: dict[str, Callable[[Desk, Document, str], None]] = {
    "reset": _reset,
    "frame": _frame,
    "axis": _axis,
    "projection": _projection,
    "undo": lambda desk, document, _: document.undo(),
    "redo": lambda desk, document, _: document.redo(),
    "save": _save,
    "picture": _picture,
    "copy": _copy,
}
