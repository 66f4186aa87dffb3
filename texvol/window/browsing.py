"""Looking for a file: what is in a folder, found on a thread of its own, since some folders take their time."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

_MOST = 5000  # entries: nobody looks through more, and each is drawn


@dataclass(frozen=True)
class Entry:
    """A folder or a file; nothing else can be opened."""

    name: str
    is_folder: bool


@dataclass
class Listing:
    """What is in a folder, once it is known."""

    folder: Path
    entries: list[Entry] | None = None
    fault: str = ""

    def read(self) -> None:
        """Folders first, each kind by name, whatever its case; hidden ones are left out."""
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
    """Somebody looks for a file to open, or for a place to write one.

    Attributes
    ----------
    title : str
        What it is for.
    done : callable
        Takes the path that was chosen.
    saves : bool
        Whether it is a file to be written, which need not be there.
    name : str
        Of the file, in the folder.
    words : str
        How it is to be read, in words of the command line, where `takes_words`.
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
        """Look into another folder."""
        self.folder = Path(os.path.abspath(folder))
        listing = self.listing = Listing(self.folder)

        def read() -> None:
            listing.read()
            self.wake()

        threading.Thread(target=read, daemon=True, name="texvol browsing").start()

    @property
    def replaces(self) -> bool:
        """Whether a file of that name is there already."""
        return self.saves and any(each.name == self.name for each in self.listing.entries or () if not each.is_folder)

    def enter(self, text: str) -> None:
        """A path was typed: a folder to look into, or a file."""
        path = Path(os.path.abspath(self.folder / os.path.expanduser(text)))
        if path.is_dir():
            self.go(path)
        elif self.saves or path.exists():
            self.go(path.parent) if self.saves else self.choose(path)
            self.name = path.name
        else:
            self.listing.fault = f"{path}: no such file"

    def pick(self, entry: Entry) -> None:
        """An entry was clicked twice."""
        if entry.is_folder:
            self.go(self.folder / entry.name)
        else:
            self.name = entry.name
            self.choose(self.folder / entry.name)

    def accept(self) -> None:
        """The file whose name is there."""
        if self.name:
            self.choose(self.folder / self.name)

    def choose(self, path: Path) -> None:
        """This one it is; a folder may hold a series."""
        self.over = True
        self.done(str(path))
