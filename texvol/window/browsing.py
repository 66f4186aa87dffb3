"""File browser: chooses a file to open, or a path to write to, by mouse or by keyboard."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from texvol.util import reach
from texvol.util.errors import InputError
from texvol.window.events import Event
from texvol.window.listing import HERE, Entry, Listing, Order, completed, first_fitting, ordered

_TYPED_TOGETHER = 1.0  # seconds between letters of one name
_PAGE = 12  # entries


@dataclass
class Browser:
    """State of the file browser.

    Attributes
    ----------
    title : str
        Title of the browser's window.
    done : callable
        Called with the chosen path.
    saves : bool
        True if the file is to be written; it need not exist.
    name : str
        Name of the selected entry in the folder, or of the file to be written.
    words : str
        Command-line options that say how to read the file; shown if `takes_words` is True.
    places : sequence of Path
        Folders that are offered.
    text : str
        Text of the path field.
    fault : str
        Why the path could not be entered, until another one is typed.
    wants_field : bool
        True if the path field is to get the keyboard.
    led : str
        Letters that were typed since "/" or "~" led to the path field, until the field is edited.
    held : int
        Bytes of `led` that the path field has.
    moved : bool
        True if the list is to be scrolled to the selected entry.
    """

    title: str
    done: Callable[[str], None]
    wake: Callable[[], None]
    folder: Path = field(default_factory=Path.cwd)
    saves: bool = False
    name: str = ""
    over: bool = False
    takes_words: bool = False
    words: str = ""
    places: Sequence[Path] = ()
    hidden: bool = False
    order: tuple[Order, bool] = ("name", False)  # and True if descending
    text: str = ""
    fault: str = ""
    wants_field: bool = False
    led: str = ""
    held: int = 0
    moved: bool = False
    listing: Listing = field(init=False)

    def __post_init__(self) -> None:
        self._typed, self._typed_at = "", 0.0
        # Entries as they were read, order, whether hidden ones are shown, and entries as they are shown.
        self._sorted: tuple[list[Entry], tuple[Order, bool], bool, list[Entry]] | None = None
        self._beside: Listing | None = None
        self.go(self.folder)
        self.text, self.wants_field = self.name, self.saves

    def go(self, folder: Path, selected: str = "") -> None:
        """List another folder."""
        self.folder = Path(os.path.abspath(folder))
        if not self.saves:
            self.name, self.text = selected, ""
        self._typed, self.led, self.held, self.fault = "", "", 0, ""
        self.listing = Listing(self.folder).start(self.wake)
        self.moved = True

    @property
    def entries(self) -> list[Entry] | None:
        """Entries as they are shown; None until the folder has been read."""
        found = self.listing.entries
        if found is None:
            return None
        by, descending = how = self.order
        if self._sorted is None or self._sorted[0] is not found or self._sorted[1:3] != (how, self.hidden):
            shown = ordered(found, by, descending=descending, hidden=self.hidden)
            self._sorted = found, how, self.hidden, shown
            if not self.name and shown and not self.saves:
                self.name = shown[0].name
        return self._sorted[3]

    @property
    def selected(self) -> Entry | None:
        """Selected entry."""
        return next((each for each in self.entries or () if each.name == self.name), None)

    def hear(self, event: Event) -> None:
        """Do what a key or a letter says while no field is edited."""
        if event.kind == "text" and self.led:  # the field is edited from the frame after the next one on
            self.text = self.led = self.led + event.name
        elif event.kind == "text" and event.name in "/~":
            self.text = self.led = event.name
            self.wants_field = True
        elif event.kind == "text":
            self._type_ahead(event.name)
        elif event.kind == "key" and event.down:
            chord = "+".join([*sorted(event.modifiers), event.name])
            if chord in _MOVES:
                self._move(*_MOVES[chord])
            elif chord in _KEYS:
                _KEYS[chord](self)

    def enter(self, text: str) -> None:
        """Go to a typed path: list a folder, or choose a file."""
        path = self._path(text)
        try:
            reach.check(path)
            self._enter(path)
        except InputError as error:
            self.fault = str(error)
        except OSError as error:  # a name is too long
            self.fault = error.strerror or str(error)

    def _enter(self, path: Path) -> None:
        if path.is_dir() and not (path.name.lower().endswith(".zarr") and not self.saves):
            self.go(path)
            self.text = ""
        elif self.saves and path.parent == self.folder:
            self.name = path.name
            self.accept()
        elif self.saves and path.parent.is_dir():
            self.go(path.parent)
            self.name = self.text = path.name
        elif not self.saves and path.exists():
            self.choose(path)
        else:
            self.fault = f"{path.parent if self.saves else path}: file not found"

    def typing(self, text: str) -> None:
        """Note the text of the path field: the first entry that fits is selected, and its folder is read."""
        if text != self.text:
            self.fault = ""
            found = None if self.saves else first_fitting(text, self.entries or ())
            if found is not None:
                self.name, self.moved = found.name, True
        self.text = text
        self._folder_of(text)

    def completed(self, text: str) -> str:
        """Return the text of the path field with the last name completed, as far as its folder has been read."""
        return completed(text, self._folder_of(text).entries or ())

    def pick(self, entry: Entry) -> None:
        """Open a double-clicked entry: list a folder, or choose a file."""
        if entry.is_folder:
            self.go(self.folder / entry.name)
        else:
            self.name = entry.name
            self.choose(self.folder if entry.name == HERE else self.folder / entry.name)

    def up(self) -> None:
        """List the folder above, where the folder is selected."""
        self.go(self.folder.parent, self.folder.name)

    def accept(self) -> None:
        """Choose the file of the entered name, or open the selected entry."""
        if self.saves and self.name:
            self.choose(self.folder / self.name)
        elif self.selected is not None:
            self.pick(self.selected)

    def press(self) -> None:
        """Do what the button of the dialog says: go to the typed path, or else open the selected entry."""
        typed = bool(self.text) and not self.saves
        if typed and (self.selected is None or os.path.exists(self._path(self.text))):
            self.enter(self.text)
        else:
            self.accept()

    def choose(self, path: Path) -> None:
        """Choose a path and close the browser; a folder may hold an image series."""
        self.over = True
        self.done(str(path))

    def select(self, entry: Entry) -> None:
        """Select an entry; the name of a file is proposed for writing."""
        if not self.saves or not entry.is_folder:
            self.name = entry.name
        if not self.saves:
            self.text = ""  # the button opens the entry, not a path that was typed before
        if self.saves and not entry.is_folder:
            self.text = entry.name

    def _path(self, text: str) -> Path:
        return Path(os.path.abspath(self.folder / os.path.expanduser(text)))

    def _folder_of(self, text: str) -> Listing:
        """Return the listing of a typed path's folder; it is read on a thread."""
        folder = self._path(os.path.dirname(text))
        if folder == self.folder:
            return self.listing
        if self._beside is None or self._beside.folder != folder:
            self._beside = Listing(folder).start(self.wake)
        return self._beside

    def _type_ahead(self, letter: str) -> None:
        now = time.monotonic()
        self._typed = letter if now - self._typed_at > _TYPED_TOGETHER else self._typed + letter
        self._typed_at = now
        found = first_fitting(self._typed, self.entries or ())
        if found is not None:
            self.name, self.moved = found.name, True

    def _move(self, step: int, whole: bool) -> None:
        """Select the entry some steps further, or at the end in that direction."""
        entries = self.entries
        if not entries:
            return
        here = next((number for number, each in enumerate(entries) if each.name == self.name), -1 if step > 0 else 0)
        there = (0 if step < 0 else len(entries) - 1) if whole else min(max(here + step, 0), len(entries) - 1)
        self.name, self.moved = entries[there].name, True

    def _edit(self) -> None:
        self.wants_field = True

    def _close(self) -> None:
        self.over = True

    def show_hidden(self) -> None:
        """Show or hide entries whose names begin with a dot."""
        self.hidden = not self.hidden


_MOVES = {
    "down": (1, False), "up": (-1, False), "page_down": (_PAGE, False), "page_up": (-_PAGE, False),
    "home": (-1, True), "end": (1, True),
}  # fmt: skip
_KEYS: dict[str, Callable[[Browser], None]] = {
    "enter": Browser.accept,
    "kp_enter": Browser.accept,
    "backspace": Browser.up,
    "alt+up": Browser.up,
    "ctrl+l": Browser._edit,
    "tab": Browser._edit,
    "ctrl+h": Browser.show_hidden,
    "escape": Browser._close,
}
