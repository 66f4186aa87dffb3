"""State of the window, and services on it: messages, reading files on a thread, browsing, writing files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from texvol.util import reach
from texvol.util.errors import TexvolError
from texvol.window import recent
from texvol.window.browsing import Browser
from texvol.window.clipboard import Clipboard
from texvol.window.director import Director
from texvol.window.document import Document
from texvol.window.events import Event
from texvol.window.jobs import Answer
from texvol.window.layout import Layout
from texvol.window.loading import Loading
from texvol.window.measuring import Measuring
from texvol.window.moving import Moving
from texvol.window.moving_annotation import MovingAnnotation
from texvol.window.own_files import OwnFiles, written
from texvol.window.painter import Painter
from texvol.window.probe import Found
from texvol.window.questions import Question
from texvol.window.replaced import Replaced
from texvol.window.screen import Textures
from texvol.window.stand_in import at_rest
from texvol.window.steering import Steering, Viewport
from texvol.window.switched import Off
from texvol.window.times import Times

MESSAGE_SECONDS = 8.0
PANEL_WIDTH = 360.0  # window coordinates at scale 1, as are the next three
NARROWEST_PANEL, WIDEST_PANEL = 280.0, 1400.0  # narrower: labels are cut; wider: only empty space grows
NARROW = 480.0  # of a window: that of a telephone
MOST_PANEL = 0.6  # fraction of the window's width


@dataclass
class Message:
    """Message that the window shows until a time."""

    text: str
    is_fault: bool
    until: float


@dataclass
class Preferences:
    """Choices of what the window shows beside the picture."""

    panels: bool = True
    help: bool = False
    probe: bool = False
    tab: str = ""  # name of the tab to select in the next frame
    fullscreen: bool = False
    width: float = PANEL_WIDTH  # of the panels
    details: bool = False  # of the picture, at the foot of the panels
    narrow: bool = False  # the window has no room for picture and panels side by side

    def suit(self, width: float) -> None:
        """Hide the panels when the window has become narrow; `width` is in window coordinates at scale 1."""
        narrow, before = width < NARROW, self.narrow
        self.narrow, self.panels = narrow, self.panels and (before or not narrow)


@dataclass
class Desk:
    """State of the window.

    Attributes
    ----------
    viewport : Viewport
        Rectangle of the picture in the window; `pixels` is its size in pixels.
    waiting : list of Loading
        Files to be read after the current one, in order.
    layout : Layout
        Views in the picture area; `viewport` is that of the 3D view.
    questions : list of Question
        Questions that are not yet answered; the last one is shown.
    replaced : Replaced
        Documents before and after the open one, to which undo and redo return.
    has_replaced : bool
        True if a document has been replaced, and the memory that all of them take is not yet looked at.
    own : OwnFiles
        Files that may be overwritten unasked.
    clerk : Painter, optional
        Process that writes pictures and films, started when first needed.
    writing : float, optional
        Fraction of a file that is written, from 0 to 1; None if no file is being written. `job` describes it.
    orders : list of dict
        Files to be written after the current one.
    when_written : callable, optional
        What is done as soon as no file is being written.
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
    moving : Moving
        What moves the camera beside mouse and keys.
    folder : Path
        Folder in which the last file was chosen.
    """

    director: Director
    make_painter: Callable[[], Painter]
    wake: Callable[[], None]
    copy: Callable[[str], None]
    preferences: Preferences = field(default_factory=Preferences)
    steering: Steering = field(default_factory=Steering)
    layout: Layout = field(default_factory=Layout)
    textures: Textures | None = None
    document: Document | None = None
    viewport: Viewport = field(default_factory=lambda: Viewport(0, 0, 1, 1))
    pixels: tuple[int, int] = (1, 1)
    messages: list[Message] = field(default_factory=list)
    loading: Loading | None = None
    waiting: list[Loading] = field(default_factory=list)
    times: Times = field(default_factory=Times)
    search: Any = None  # for what shows, see `texvol.window.reframing`
    questions: list[Question] = field(default_factory=list)
    replaced: Replaced = field(default_factory=Replaced)
    has_replaced: bool = False
    own: OwnFiles = field(default_factory=OwnFiles)
    measuring: Measuring = field(default_factory=Measuring)
    clerk: Painter | None = None
    writing: float | None = None
    job: dict[str, Any] = field(default_factory=dict)
    clipboard: Clipboard = field(default_factory=Clipboard)
    orders: list[dict[str, Any]] = field(default_factory=list)
    when_written: Callable[[], Any] | None = None
    wants_close: bool = False
    is_played: bool = False
    gripping: bool = False
    failed_first: str | None = None
    browser: Browser | None = None
    probed: Found | None = None
    moving: Moving = field(default_factory=Moving)
    now: float = 0.0
    panel_state: dict[str, Any] = field(default_factory=dict)
    folder: Path = field(default_factory=Path.cwd)
    annotating: MovingAnnotation = field(default_factory=MovingAnnotation)

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

    def change(self, stroke: str | None = None, off: Off | None = None, **parts: Any) -> bool:
        """Change those parts of the scene that differ; return False and show a message if they make no valid scene.

        Parameters
        ----------
        off : Off, optional
            What is switched off after the change, if that differs too.
        """
        assert self.document is not None
        document = self.document
        same = off is None or off == document.off
        if same and all(getattr(document.scene, name) == part for name, part in parts.items()):
            return True
        return self.attempt(lambda: document.change(stroke, off, **parts))

    def ask(self, question: Question) -> None:
        """Show a question, above those that are not yet answered; a question that is shown already is not repeated."""
        if self.question is None or self.question.text != question.text:
            self.questions.append(question)
        self.wake()

    @property
    def question(self) -> Question | None:
        """Question that waits for an answer."""
        return self.questions[-1] if self.questions else None

    def reply(self, words: str) -> None:
        """Answer the question; a script may give words that are no answer of it."""
        question = self.question
        if question is None or words not in question.words:
            asked = "no question is asked" if question is None else f"it must be one of: {', '.join(question.words)}"
            self.say(f"answer {words!r} is not possible: {asked}", fault=True)
            return
        self.questions.pop()
        self.attempt(lambda: question.answer(words))

    def hear(self, events: Iterable[Event], *, typing: bool) -> bool:
        """Pass events to a dialog, and return True, if one is shown; while the user is `typing`, it hears no keys."""
        if self.question is None and self.browser is None:
            return False
        for event in events if not typing else ():
            if self.question is not None:
                words = self.question.hear(event)
                if words is not None:
                    self.reply(words)
            elif self.browser is not None and not self.browser.over:
                self.browser.hear(event)
        return True

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
        return f"{document.name}{'*' if document.unsaved else ''} - texvol"

    def _take(self, name: str, document: Document) -> None:
        before = self.document
        self.own.learn(document.own.known)
        self._show(document)
        if before is not None:
            self.replaced.open(before)
            self.say(f"opened {document.name}; undo (ctrl-z) returns to {before.name}")
            self.has_replaced = True
        recent.remember(name, None if name == document.origin.scene_file else document.scene)

    def _show(self, document: Document) -> None:
        document.fit(self.pixels)
        self.layout.turn_to(document, self.document)
        self.document = document
        self.panel_state.clear()
        self.messages.clear()  # they were of the document before
        self.questions = [each for each in self.questions if not each.of_scene]

    def step(self, *, back: bool, whole: bool = False) -> None:
        """Undo or redo one step; beyond the first or the last step, return to the document before or after.

        Parameters
        ----------
        whole : bool
            True to return to another document at once, with all steps as they are.
        """
        document = self.document
        if document is None:
            return
        if (document.history.past if back else document.history.future) and not whole:
            (document.undo if back else document.redo)()
            return
        other = self.replaced.step(document, back=back)
        if other is None:
            return
        self._show(other)
        returns = f"redo returns to {document.name}" if back else f"undo returns to {document.name}"
        self.say(f"this is {other.name} again; {returns}")

    def can_step(self, *, back: bool) -> bool:
        """True if there is a step or another document to return to."""
        document, replaced = self.document, self.replaced
        if document is None:
            return False
        return bool((document.history.past or replaced.past) if back else (document.history.future or replaced.future))

    @property
    def documents(self) -> list[Document]:
        """All documents: replaced ones, the open one, and undone ones."""
        here = [] if self.document is None else [self.document]
        return [*self.replaced.past, *here, *reversed(self.replaced.future)]

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
        if not reach.holds(folder):
            folder = next(iter(recent.folders()), folder)

        def chosen(path: str) -> None:
            self.folder = Path(path).parent
            self.attempt(lambda: done(path, browser.words))

        browser = Browser(
            title, chosen, self.wake, folder, saves, typed.name, takes_words=takes_words, places=recent.folders()
        )
        self.browser = browser

    def write(self, document: Document, **job: Any) -> None:
        """Have the clerk write a file, after those that it has been told of."""
        if not self.attempt(lambda: reach.check(job["path"])):
            return
        job |= {"scene": at_rest(document.scene), "showing": document.showing, "name": document.origin.volume}
        self.orders.append(job)
        self._write_next()

    def _write_next(self) -> None:
        if self.writing is not None or not self.orders:
            return
        clerk = self.clerk = self.clerk or self.make_painter()
        self.job, self.writing = self.orders.pop(0), 0.0
        if not self.attempt(lambda: clerk.ask(**self.job)):  # it has ended, and cannot be started again
            self.stop_writing()

    def stop_writing(self) -> None:
        """Cancel writing the file, and those that wait to be written."""
        if self.clerk is not None:
            self.clerk.drop()
        self.writing = self.when_written = None
        self.orders.clear()

    def close(self) -> None:
        """End the clerk, and the reading of time steps."""
        self.times.close()
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
            self.moving.left.learn(self.writing, self.now)
            return
        self.writing = None
        for warning in answer.metadata.get("warnings", ()):
            self.say(warning)
        if answer.kind == "failed":
            self.when_written = None
            self.say(answer.text, fault=True)
        else:
            self._wrote(answer)
        self._write_next()
        if self.writing is None and self.when_written is not None:
            self.when_written()

    def _wrote(self, answer: Answer) -> None:
        for name in ("picture name", "film name", "time film name"):
            if self.panel_state.get(name) == answer.text:
                self.panel_state[name] = ""  # a new name is proposed
        files = written(answer.text, answer.metadata.get("views"))
        self.own.wrote(files)
        count = f"{len(files)} pictures: " if len(files) > 1 else ""
        self.say(f"wrote {count}{os.path.abspath(answer.text)}")
