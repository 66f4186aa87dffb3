"""File browser: folders are listed on a thread, because some file systems respond slowly."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

_MOST = 5000  # entries of a listing: each is drawn in every frame


@dataclass(frozen=True)
class Entry:
    """Folder or file in a listing."""

    name: str
    is_folder: bool


@dataclass
class Listing:
    """Entries of a folder; `entries` is None until the folder has been read."""

    folder: Path
    entries: list[Entry] | None = None
    fault: str = ""

    def read(self) -> None:
        """Read the folder: folders first, then files, each sorted by name without regard to case; no hidden entries."""
        try:
            with os.scandir(self.folder) as found:
                kept = [_entry(each) for each, _ in zip(found, range(_MOST), strict=False)]
        except OSError as error:
            self.entries, self.fault = [], f"{self.folder}: {error.strerror or error}"
            return
        entries = [each for each in kept if each is not None]
        self.entries = sorted(entries, key=lambda each: (not each.is_folder, each.name.casefold(), each.name))


def _entry(found: os.DirEntry[str]) -> Entry | None:
    if found.name.startswith("."):
        return None
    try:
        return Entry(found.name, found.is_dir()) if found.is_dir() or found.is_file() else None
    except OSError:
        return None


@dataclass
class Browser:
    """State of the file browser, which chooses a file to open or a path to write to.

    Attributes
    ----------
    title : str
        Title of the browser's window.
    done : callable
        Called with the chosen path.
    saves : bool
        True if the file is to be written; it need not exist.
    name : str
        Name of the chosen entry in the folder.
    words : str
        Command-line options that say how to read the file; shown if `takes_words` is True.
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
    listing: Listing = field(init=False)

    def __post_init__(self) -> None:
        self.go(self.folder)

    def go(self, folder: Path) -> None:
        """List another folder."""
        self.folder = Path(os.path.abspath(folder))
        listing = self.listing = Listing(self.folder)

        def read() -> None:
            listing.read()
            self.wake()

        threading.Thread(target=read, daemon=True, name="texvol browsing").start()

    @property
    def replaces(self) -> bool:
        """True if a file of that name exists already and would be replaced."""
        return self.saves and any(each.name == self.name for each in self.listing.entries or () if not each.is_folder)

    def enter(self, text: str) -> None:
        """Go to a typed path: list a folder, or choose a file."""
        path = Path(os.path.abspath(self.folder / os.path.expanduser(text)))
        if path.is_dir():
            self.go(path)
        elif self.saves or path.exists():
            self.go(path.parent) if self.saves else self.choose(path)
            self.name = path.name
        else:
            self.listing.fault = f"{path}: file not found"

    def pick(self, entry: Entry) -> None:
        """Open a double-clicked entry: list a folder, or choose a file."""
        if entry.is_folder:
            self.go(self.folder / entry.name)
        else:
            self.name = entry.name
            self.choose(self.folder / entry.name)

    def accept(self) -> None:
        """Choose the file of the entered name."""
        if self.name:
            self.choose(self.folder / self.name)

    def choose(self, path: Path) -> None:
        """Choose a path and close the browser; a folder may hold an image series."""
        self.over = True
        self.done(str(path))
