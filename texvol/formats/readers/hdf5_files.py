"""Files that an HDF5 file names: by external links, as parts of virtual datasets, and as raw samples.

Any library that reads HDF5 follows these names. So where reach is limited they are looked up before one does.
"""

from __future__ import annotations

import glob
import json
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from texvol.formats.readers.child_process import forked
from texvol.formats.readers.samples import FileFault
from texvol.util import reach
from texvol.util.errors import missing_extra

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

_MOST_LINKS, _MOST_FILES = 10**6, 10**5
_PATIENCE = 60.0  # seconds for one file


def check(path: str) -> None:
    """Check all files that a file names, and that these name.

    Raises
    ------
    InputError
        If one is out of reach, see `texvol.util.reach`.
    FileFault
        If a file is damaged, or names too many.
    """
    if not reach.is_limited():
        return
    waiting, seen = [path], set()
    while waiting:
        file = waiting.pop()
        reach.check(file)
        if (real := os.path.realpath(file)) in seen:
            continue
        seen.add(real)
        if len(seen) > _MOST_FILES:
            raise FileFault(f"names more than {_MOST_FILES} files")
        for name in _named(real):
            waiting += _found({os.path.dirname(file), os.path.dirname(real)}, name)


def _found(folders: set[str], name: str) -> list[str]:
    """Return the files that HDF5 may open for a name: beside the file, in the working directory, or by its last part.

    In names of parts %b stands for a number.
    """
    pattern = "%".join(glob.escape(each).replace("%b", "*") for each in name.split("%%"))
    named = {os.path.join(folder, each) for folder in (*folders, ".") for each in (pattern, os.path.basename(pattern))}
    return sorted({file for each in named for file in glob.glob(each)})


def _named(path: str) -> list[str]:
    """Return the names in a file, read in a process of its own: what is damaged may end it."""
    try:
        import h5py
    except ModuleNotFoundError as error:
        raise missing_extra("h5py", "formats", path) from error
    if not os.path.isfile(path) or not h5py.is_hdf5(path):
        return []

    def work(output: Connection) -> None:
        try:
            with h5py.File(path, "r") as file:
                output.send_bytes(json.dumps(sorted(set(_names(file)))).encode())
        except Exception:
            output.send_bytes(b"null")

    with forked(work) as child:
        try:
            names = json.loads(child.take(_PATIENCE))
        except (EOFError, TimeoutError):
            names = None
    if names is None:
        raise FileFault("is corrupt or has too many parts: the files that it names can't be found out")
    return [os.fsdecode(os.fsencode(each)) for each in names]


def _names(file: Any) -> Iterator[str]:
    import h5py

    found: list[tuple[str, Any]] = []

    def look(name: str, link: Any) -> bool | None:
        found.append((name, link))
        return True if len(found) > _MOST_LINKS else None

    if file.visititems_links(look):
        raise FileFault(f"has more than {_MOST_LINKS} links")
    for name, link in found:
        if isinstance(link, h5py.ExternalLink):
            yield link.filename
        thing = file[name] if isinstance(link, h5py.HardLink) else None
        if isinstance(thing, h5py.Dataset):
            yield from (each.file_name for each in (thing.virtual_sources() if thing.is_virtual else ()))
            yield from (os.fsdecode(each[0]) for each in thing.external or ())
