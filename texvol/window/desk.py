"""The desk: what is open, what is chosen, and everything that keys and panels can have done."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import TexvolError
from texvol.window import additions, commands, contents, recent
from texvol.window.browsing import Browser
from texvol.window.director import Director
from texvol.window.document import Document, opened_file
from texvol.window.jobs import Answer
from texvol.window.loading import Loading
from texvol.window.painter import Painter
from texvol.window.probe import Found
from texvol.window.screen import Textures
from texvol.window.steering import Room, Steering

MESSAGE_SECONDS = 8.0
PANEL_WIDTH = 360.0  # window coordinates at scale 1, as the next
NARROWEST_PANEL, WIDEST_PANEL = 280.0, 1400.0  # names beside their controls; beyond, only emptiness grows
MOST_PANEL = 0.6  # of the window


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
    width: float = PANEL_WIDTH  # of the panels


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
    waiting: list[Loading] = field(default_factory=list)  # to be read one after the other
    offered: tuple[str, ...] = ()  # files that came in, and may be opened or added
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
        """Open a volume, a scene, a mesh or a transfer function into the scene; the old one stays until that is done.

        `how` are options of the command line, as `contents.of_opened` has them.
        """
        kind = contents.kind_of(path)
        if kind == "transfer function" and self.document is not None:
            from texvol.scene import transfer

            volume = self.document.scene.volume
            self.attempt(lambda: self.change(transfer_function=transfer.load(path, volume)))
        elif kind == "mesh":
            self.add(path)
        else:
            size = self.pixels
            self.load(path, lambda: opened_file(path, size, how))

    def load(self, name: str, make: Callable[[], Document], *, first: bool = False) -> None:
        """Open what `make` makes, on another thread; without the `first` one the window has no reason to be."""
        self.waiting.clear()
        self.loading = Loading(name, make, lambda found: self._take(name, found), self.wake, first=first).start()

    def fetch(self, name: str, make: Callable[[], Any], done: Callable[[Any], Any]) -> None:
        """Have something read for the scene, after whatever is being read; `done` takes it if that is still open."""
        document = self.document

        def take(found: Any) -> None:
            if self.document is document:
                self.attempt(lambda: done(found))

        self.waiting.append(Loading(name, make, take, self.wake))
        self._read_on()

    def add(self, path: str, chosen: Mapping[str, Any] | None = None) -> None:
        """Add a volume or a mesh to the scene; `chosen` are options of the former, see `contents.of_added`."""
        additions.add(self, path, chosen or {})

    def drop(self, paths: Sequence[str], *, adds: bool = False) -> None:
        """Files were dropped: what may be meant in two ways is asked, unless it is to be added."""
        additions.drop(self, tuple(paths), adds=adds)

    def update(self) -> None:
        """Take what has been loaded or written, and drop old messages."""
        self.messages = [each for each in self.messages if each.until > self.now]
        loading = self.loading
        if loading is not None and loading.over:
            self.loading = None
            if loading.fault is not None:
                self.say(loading.fault, fault=True)
                self.failed_first = loading.fault if loading.first else None
            else:
                loading.done(loading.found)
            for warning in loading.warnings:
                self.say(warning)
            self._read_on()
        for fault in self.director.faults:
            self.say(fault, fault=True)
        self.director.faults.clear()
        for answer in self.clerk.answers() if self.clerk is not None else []:
            self._hear(answer)

    @property
    def title(self) -> str:
        """Of the window: what is open, with a * where that is saved in no file."""
        document = self.document
        if document is None:
            return "texvol"
        name = os.path.basename(os.path.normpath(document.origin.scene_file or document.origin.volume))
        return f"{name}{'*' if document.unsaved else ''} - texvol"

    def _take(self, name: str, document: Document) -> None:
        self.document = document
        self.messages = [each for each in self.messages if not each.is_fault]
        self.panel_state.clear()
        self.offered = ()
        self.attempt(lambda: recent.add(name, {} if name == document.origin.scene_file else recent.how(document.scene)))

    def _read_on(self) -> None:
        if self.loading is None and self.waiting:
            self.loading = self.waiting.pop(0).start()

    def browse(self, title: str, done: Callable[[str], None], *, saves: bool = False, name: str = "") -> None:
        """Have somebody look for a file, where the last one was found."""
        typed = Path(name).expanduser()
        folder = typed.absolute().parent if name else self.folder

        def chosen(path: str) -> None:
            self.folder = Path(path).parent
            done(path)

        self.browser = Browser(title, chosen, self.wake, folder, saves, typed.name if name else "")

    def browse_for_data(self, title: str, done: Callable[[str, str], None]) -> None:
        """The same of a file that is read, whose reader may have to be told how: in words of the command line."""
        self.browse(title, lambda path: done(path, self.browser.words if self.browser else ""))
        assert self.browser is not None
        self.browser.takes_words = True

    def run(self, command: str) -> None:
        """What a key or a button asks for, by name: one of `commands`."""
        commands.run(self, command)

    def knows(self, command: str) -> bool:
        """Whether there is such a command."""
        return commands.is_command(command)

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
        if shown is not None and shown.state == "rest" and "settings" in shown.metadata:
            return dict(shown.metadata["settings"])
        return {"max_error": self.director.max_error}

    def _hear(self, answer: Answer) -> None:
        if answer.kind == "progress":
            self.writing = float(answer.metadata["done"])
            return
        self.writing = None
        for warning in answer.metadata.get("warnings", ()):
            self.say(warning)
        if answer.kind == "failed":
            self.say(answer.text, fault=True)
            return
        for name in ("picture name", "film name"):
            if self.panel_state.get(name) == answer.text:
                self.panel_state[name] = ""  # another is proposed
        numbered = "%" in os.path.basename(answer.text) and "views" in answer.metadata
        written = f"{answer.metadata['views']} pictures are written: " if numbered else "written: "
        self.say(written + os.path.abspath(answer.text))
