"""State of the window, and services on it: messages, reading files on a thread, browsing, writing files."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from texvol.util.errors import TexvolError
from texvol.window import recent
from texvol.window.browsing import Browser
from texvol.window.director import Director
from texvol.window.document import Document
from texvol.window.jobs import Answer
from texvol.window.painter import Painter
from texvol.window.probe import Found
from texvol.window.screen import Textures
from texvol.window.stand_in import at_rest
from texvol.window.steering import Steering, Viewport

MESSAGE_SECONDS = 8.0
PANEL_WIDTH = 360.0  # window coordinates at scale 1, as are the next two
NARROWEST_PANEL, WIDEST_PANEL = 280.0, 1400.0  # narrower: labels are cut; wider: only empty space grows
MOST_PANEL = 0.6  # fraction of the window's width


@dataclass
class Message:
    """Message that the window shows until a time."""

    text: str
    is_fault: bool
    until: float


@dataclass
class Loading:
    """Reading of one object on a thread; the window's thread takes it over.

    Attributes
    ----------
    make : callable
        Reads and returns the object, on the thread.
    done : callable
        Takes the object, on the window's thread.
    first : bool
        True for the document that the window was started with.
    over : bool
        True once the object is `found`, or the reading has failed because of a `fault`.
    """

    name: str
    make: Callable[[], Any]
    done: Callable[[Any], None]
    wake: Callable[[], None]
    first: bool = False
    fault: str | None = None
    warnings: list[str] = field(default_factory=list)
    over: bool = False
    found: Any = None

    def start(self) -> Loading:
        """Start the thread."""
        threading.Thread(target=self._load, daemon=True, name="texvol loading").start()
        return self

    def _load(self) -> None:
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("ignore")  # warnings of libraries about themselves
                warnings.simplefilter("always", UserWarning)
                self.found = self.make()
            self.warnings = [" ".join(str(each.message).split()) for each in said]
        except Exception as error:  # a reader may raise anything on a damaged file; the window stays open
            text = " ".join(str(error).split())
            self.fault = text if isinstance(error, TexvolError) and text else f"{self.name}: {text or error!r}"
        self.over = True
        self.wake()


@dataclass
class Preferences:
    """Choices of what the window shows beside the picture."""

    panels: bool = True
    help: bool = False
    probe: bool = False
    tab: str = ""  # name of the tab to select in the next frame
    fullscreen: bool = False
    width: float = PANEL_WIDTH  # of the panels


@dataclass
class Desk:
    """State of the window.

    Attributes
    ----------
    viewport : Viewport
        Rectangle of the picture in the window; `pixels` is its size in pixels.
    waiting : list of Loading
        Files to be read after the current one, in order.
    offered : tuple of str
        Dropped volumes; the user is asked to open or to add them.
    clerk : Painter, optional
        Process that writes pictures and films, started when first needed.
    writing : float, optional
        Fraction of a file that is written, from 0 to 1; None if no file is being written.
    is_played : bool
        True if a script is played back.
    gripping : bool
        True if the mouse is at a handle in the picture.
    failed_first : str, optional
        Reason why the document that the window was started with can't be opened.
    browser : Browser, optional
        File browser, while it is shown.
    probed : Found, optional
        Value under the cursor, if it is asked for.
    folder : Path
        Folder in which the last file was chosen.
    """

    director: Director
    make_painter: Callable[[], Painter]
    wake: Callable[[], None]
    copy: Callable[[str], None]
    preferences: Preferences = field(default_factory=Preferences)
    steering: Steering = field(default_factory=Steering)
    textures: Textures | None = None
    document: Document | None = None
    viewport: Viewport = field(default_factory=lambda: Viewport(0, 0, 1, 1))
    pixels: tuple[int, int] = (1, 1)
    messages: list[Message] = field(default_factory=list)
    loading: Loading | None = None
    waiting: list[Loading] = field(default_factory=list)
    offered: tuple[str, ...] = ()
    clerk: Painter | None = None
    writing: float | None = None
    wants_close: bool = False
    is_played: bool = False
    gripping: bool = False
    failed_first: str | None = None
    browser: Browser | None = None
    probed: Found | None = None
    now: float = 0.0
    panel_state: dict[str, Any] = field(default_factory=dict)
    folder: Path = field(default_factory=Path.cwd)

    def say(self, text: str, *, fault: bool = False) -> None:
        """Show a message; a fault is shown longer. While a script is played back, only faults are shown."""
        if self.is_played and not fault:
            return
        self.messages = [each for each in self.messages if each.text != text]
        self.messages.append(Message(text, fault, self.now + MESSAGE_SECONDS * (2 if fault else 1)))

    def attempt(self, action: Callable[[], Any]) -> bool:
        """Call `action` and return True; show the message of its error and return False if it fails."""
        try:
            action()
        except (TexvolError, OSError) as error:
            self.say(" ".join(str(error).split()), fault=True)
            return False
        return True

    def change(self, stroke: str | None = None, **parts: Any) -> bool:
        """Change those parts of the scene that differ; return False and show a message if they make no valid scene."""
        assert self.document is not None
        document = self.document
        if all(getattr(document.scene, name) == part for name, part in parts.items()):
            return True
        return self.attempt(lambda: document.change(stroke, **parts))

    def load(self, name: str, make: Callable[[], Document], *, first: bool = False) -> None:
        """Open the document that `make` returns, on a thread; if the `first` one can't be opened, the window ends."""
        self.waiting.clear()
        self.loading = Loading(name, make, lambda found: self._take(name, found), self.wake, first).start()

    def fetch(self, name: str, make: Callable[[], Any], done: Callable[[Any], Any]) -> None:
        """Read something for the open scene on a thread, and pass it to `done` if that scene is still open."""
        document = self.document

        def take(found: Any) -> None:
            if self.document is document:
                self.attempt(lambda: done(found))

        self.waiting.append(Loading(name, make, take, self.wake))
        self._read_next()

    def update(self) -> None:
        """Take over results of reading and writing, and remove old messages."""
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
            self._read_next()
        for fault in self.director.faults:
            self.say(fault, fault=True)
        self.director.faults.clear()
        for answer in self.clerk.answers() if self.clerk is not None else []:
            self._hear(answer)

    @property
    def title(self) -> str:
        """Title of the window: the name of the open file, with * if the scene has unsaved changes."""
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

    def _read_next(self) -> None:
        if self.loading is None and self.waiting:
            self.loading = self.waiting.pop(0).start()

    def browse(
        self, title: str, done: Callable[[str, str], Any], *, saves: bool = False, name: str = "",
        takes_words: bool = False,
    ) -> None:  # fmt: skip
        """Show the file browser in the folder of the last chosen file; `done` gets the path and the entered options."""
        typed = Path(name).expanduser()
        folder = typed.absolute().parent if name else self.folder

        def chosen(path: str) -> None:
            self.folder = Path(path).parent
            self.attempt(lambda: done(path, browser.words))

        browser = Browser(title, chosen, self.wake, folder, saves, typed.name, takes_words=takes_words)
        self.browser = browser

    def write(self, **job: Any) -> None:
        """Have the clerk write a file."""
        document = self.document
        assert document is not None
        if self.clerk is None or not self.clerk.alive:
            self.clerk = self.make_painter()
        clerk, self.writing = self.clerk, 0.0
        job |= {"scene": at_rest(document.scene), "showing": document.showing, "name": document.origin.volume}
        self.attempt(lambda: clerk.ask(**job))

    def stop_writing(self) -> None:
        """Cancel writing the file."""
        if self.clerk is not None:
            self.clerk.drop()
        self.writing = None

    def close(self) -> None:
        """End the clerk."""
        if self.clerk is not None:
            self.clerk.close()

    @property
    def accuracy(self) -> dict[str, Any]:
        """Accuracy of files to be written: that of the picture at rest, or the maximum error of such a picture."""
        shown = self.director.shown
        if shown is not None and shown.state == "rest" and "settings" in shown.metadata:
            return dict(shown.metadata["settings"])
        return self.director.accuracy

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
                self.panel_state[name] = ""  # a new name is proposed
        numbered = "%" in os.path.basename(answer.text) and "views" in answer.metadata
        written = f"wrote {answer.metadata['views']} pictures: " if numbered else "wrote "
        self.say(written + os.path.abspath(answer.text))
