"""Listings of folders for the file browser; they are read on threads, because some file systems respond slowly."""

from __future__ import annotations

import os
import re
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from texvol.formats.readers.detection import FORMATS, has_preamble
from texvol.util import reach
from texvol.util.errors import InputError
from texvol.window.contents import KINDS

MOST = 20_000  # entries of a listing
_LOOKED_INTO = 8  # files without a known ending that are looked into for DICOM
_STORES = FORMATS["Zarr"]
_KNOWN = tuple(ending for endings in FORMATS.values() for ending in endings) + tuple(KINDS)
_SLICES = {ending: kind for kind in ("DICOM", "TIFF") for ending in FORMATS[kind]}
HERE = "."  # name of the entry for the listed folder itself

Order = Literal["name", "size", "date"]


@dataclass(frozen=True)
class Entry:
    """Folder or file in a listing.

    Attributes
    ----------
    size : int
        Bytes of a file; -1 for a folder or a store.
    modified : float
        Time of the last change, in seconds since 1970.
    is_known : bool
        True if the window can open files of that kind.
    what : str
        Kind of a series of slices, for the entry `HERE`.
    is_doubtful : bool
        True for the entry `HERE` if the files may be volumes of their own.
    """

    name: str
    is_folder: bool
    size: int = -1
    modified: float = 0.0
    is_known: bool = True
    what: str = ""
    is_doubtful: bool = False

    @property
    def is_hidden(self) -> bool:
        """True if the entry is not shown by default."""
        return self.name.startswith(".") and self.name != HERE


@dataclass
class Listing:
    """Entries of a folder; `entries` is None until the folder has been read."""

    folder: Path
    entries: list[Entry] | None = None
    fault: str = ""

    def start(self, wake: Callable[[], None]) -> Listing:
        """Read the folder on a thread, then call `wake`."""

        def read() -> None:
            self.read()
            wake()

        threading.Thread(target=read, daemon=True, name="texvol browsing").start()
        return self

    def read(self) -> None:
        """Read the folder, in any order."""
        try:
            reach.check(self.folder)
            with os.scandir(self.folder) as found:
                kept = [_entry(each) for each, _ in zip(found, range(MOST), strict=False)]
                self.fault = f"only {MOST:,} entries are shown" if next(found, None) is not None else ""
        except InputError as error:
            self.entries, self.fault = [], str(error)
            return
        except OSError as error:
            self.entries, self.fault = [], f"{self.folder}: {error.strerror or error}"
            return
        entries = [each for each in kept if each is not None]
        series = self._series(entries)
        doubtful = series == "TIFF" and not _is_numbered([each.name for each in entries if _is_tiff(each)])
        here = [Entry(HERE, False, what=series, is_doubtful=doubtful)] if series else []
        self.entries = here + entries

    def _series(self, entries: Sequence[Entry]) -> str:
        """Return "DICOM", "TIFF" or "Zarr" if the folder as a whole can be opened, else ""."""
        names = [each.name for each in entries if not each.is_folder]
        if {".zgroup", ".zarray", "zarr.json", ".zattrs"} & set(names):
            return "Zarr"
        counts = {kind: sum(_SLICES.get(_ending(name)) == kind for name in names) for kind in ("DICOM", "TIFF")}
        if max(counts.values()) > 1:
            return max(counts, key=lambda kind: counts[kind])
        unknown = [each.name for each in entries if not (each.is_folder or each.is_known or each.is_hidden)]
        marked = [name for name in unknown[:_LOOKED_INTO] if _is_dicom(self.folder / name)]
        return "DICOM" if marked else ""


def ordered(entries: Sequence[Entry], by: Order, *, descending: bool, hidden: bool) -> list[Entry]:
    """Return entries as they are shown: folders, files of known kinds, other files; each sorted.

    The entry for the folder itself comes first, or after the files of known kinds if it is doubtful.
    """
    keys: dict[Order, Callable[[Entry], tuple]] = {
        "name": lambda each: (),
        "size": lambda each: (each.size,),
        "date": lambda each: (each.modified,),
    }
    shown = [each for each in entries if hidden or not each.is_hidden]
    shown.sort(key=lambda each: (each.name.casefold(), each.name), reverse=descending and by == "name")
    shown.sort(key=keys[by], reverse=descending)
    return sorted(shown, key=_group)


def _group(entry: Entry) -> int:
    if entry.name == HERE:
        return 3 if entry.is_doubtful else 0
    return 1 if entry.is_folder else 2 if entry.is_known else 4


def _is_numbered(names: Sequence[str]) -> bool:
    """True if most names differ in one number alone, as those of slices do."""
    alike = Counter(
        name[: number.start()] + "#" + name[number.end() :] for name in names for number in re.finditer(r"\d+", name)
    )
    return max(alike.values(), default=0) > max(len(names) / 2, 1)


def _is_tiff(entry: Entry) -> bool:
    return not entry.is_folder and _SLICES.get(_ending(entry.name)) == "TIFF"


def completed(text: str, entries: Sequence[Entry]) -> str:
    """Return a typed path with the last name completed as far as the entries of its folder agree."""
    head, last = os.path.split(text)
    fitting = _fitting(last, entries)
    if not fitting:
        return text
    first, *others = fitting
    length = 0
    while all(each.name[length : length + 1].casefold() == first.name[length].casefold() for each in others):
        length += 1
        if length == len(first.name):
            break
    name = first.name[:length] if others else first.name
    return os.path.join(head, max(name, last, key=len)) + (os.sep if first.is_folder and not others else "")


def first_fitting(start: str, entries: Sequence[Entry]) -> Entry | None:
    """Return the first entry whose name begins with a text, else the first one that contains it."""
    fitting = _fitting(start, entries) if start else []
    inside = [each for each in entries if start and start.casefold() in each.name.casefold()]
    return next(iter([*fitting, *inside]), None)


def _fitting(start: str, entries: Sequence[Entry]) -> list[Entry]:
    fitting = [each for each in entries if each.name.casefold().startswith(start.casefold()) and each.name != HERE]
    exact = [each for each in fitting if each.name.startswith(start)]
    return [each for each in exact or fitting if start.startswith(".") or not each.is_hidden]


def size_text(size: int) -> str:
    """Return a number of bytes with three digits and a unit; "" for a folder."""
    if size < 0:
        return ""
    amount, units = float(size), iter(("B", "kB", "MB", "GB", "TB"))
    unit = next(units)
    while amount >= 999.5 and unit != "TB":
        amount, unit = amount / 1000, next(units)
    return f"{amount:.0f} {unit}" if unit == "B" or amount >= 99.5 else f"{amount:.3g} {unit}"


def _ending(name: str) -> str:
    return os.path.splitext(name)[1].lower()


def _is_dicom(path: Path) -> bool:
    try:
        return reach.holds(path) and has_preamble(str(path))
    except OSError:
        return False


def _entry(found: os.DirEntry[str]) -> Entry | None:
    """Return a folder or a regular file; None for anything else, such as a pipe or a broken link."""
    try:
        is_folder = found.is_dir()
        if not is_folder and not found.is_file():
            return None
        is_store = is_folder and found.name.lower().endswith(_STORES)
        status = found.stat()
    except OSError:
        return None
    size = -1 if is_folder else status.st_size
    is_known = is_folder or found.name.lower().endswith(_KNOWN)
    return Entry(found.name, is_folder and not is_store, size, status.st_mtime, is_known)
