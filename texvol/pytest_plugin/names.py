"""Names of pictures: the folder of a test's references, valid names, and the test that owns a name.

A name consists of ASCII letters, digits, - _ . and / for subfolders, so that it is the same file on every system. A
name belongs to one test: two tests with one name would share a reference by mistake. One test with several parameters
may share a name with itself, as for a picture that has to be the same by two drivers. Names that differ only in case
are one name.
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from texvol.util.errors import InputError

if TYPE_CHECKING:
    import pytest

_PART = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-]*")
_DEFAULT_FOLDER = "references"
_MOST_CHARACTERS = 200  # of a name with its folders; file systems allow 255, with the suffix
# Names of devices on Windows, with any suffix.
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")


def checked(name: object) -> str:
    """Return the name; raise InputError if it is not valid."""
    if not isinstance(name, str):
        kind = type(name).__name__
        raise InputError(f"name must be a str, got {kind}; call check_picture(picture, name)")
    parts = name.split("/")
    good = all(_PART.fullmatch(part) and not _RESERVED.fullmatch(part) and not part.endswith(".") for part in parts)
    if name == "default":
        raise InputError("picture 'default': the name is reserved for the table of all pictures in the file of limits")
    if not good or len(name) > _MOST_CHARACTERS:
        raise InputError(
            f"picture {name!r}: the name must consist of letters a-z, digits, - _ . and / for subfolders, "
            f"begin with a letter, a digit or _ in each folder, and have at most {_MOST_CHARACTERS} characters"
        )
    return name


def references_of(path: Path, config: pytest.Config) -> Path:
    """Return the folder of references of the tests in the file `path`."""
    return path.parent / str(config.getini("texvol_references") or _DEFAULT_FOLDER)


def limits_of(references: Path, config: pytest.Config) -> Path:
    """Return the file of limits for a folder of references."""
    given = str(config.getini("texvol_limits"))
    base = config.inipath.parent if config.inipath else config.rootpath
    return base / given if given else references / "limits.toml"


class SharedNameError(InputError):
    """Two tests use one name for their pictures."""


def name_key(folder: Path, name: str) -> str:
    """Return the key of a reference's name in a run: the same for the same file, on all systems."""
    return f"{os.path.realpath(folder)}/{name.lower()}"


class Claims:
    """Owners of names, in this process and, through files, in the other processes of the run.

    Parameters
    ----------
    shared : path or None
        Folder for the files, created when needed.
    """

    def __init__(self, shared: Path | None = None) -> None:
        self._shared = shared
        self._owners: dict[str, str] = {}
        self._pages: dict[str, int] = {}

    def claim(self, folder: Path, name: str, test: str) -> str:
        """Give a reference's name to the test, and return the name's key in this run.

        Names that differ only in case are one name, since some systems store them in one file; folders are compared by
        their real paths.

        Raises
        ------
        SharedNameError
            If another test has the name, or the same test has it in another spelling.
        """
        key = name_key(folder, name)
        path, _, rest = test.partition("::")
        function = f"{path}::{rest.split('[', 1)[0]}"
        mine = f"{function}\n{name}"
        owned = self._owners.get(key) or self._owner_elsewhere(key, mine)
        self._owners[key] = owned
        owner, _, spelled = owned.partition("\n")
        if spelled != name:
            raise SharedNameError(
                f"pictures {spelled!r} and {name!r} differ only in case, and are one file on some systems "
                f"({owner} and {function}): rename one"
            )
        if owner != function:
            raise SharedNameError(f"picture {name!r} is checked by two tests, {owner} and {function}: rename one")
        return key

    def first(self, key: str) -> bool:
        """True if no process of the run has asked for that key before."""
        mine = f"{os.getpid()} {id(self)}"
        fresh = key not in self._owners and self._owner_elsewhere(key, mine) == mine
        self._owners.setdefault(key, mine)
        return fresh

    def page(self, test: str, name: str) -> str:
        """Return the path of a check's page, without suffix: the test's folder and the picture's name.

        Pages of a test that checks a name again, with other parameters or in a loop, are numbered.
        """
        import zlib

        folder = str(Path(test.split("::", 1)[0]).parent)
        page = f"pages/{name}" if folder == "." else f"pages/{folder}/{name}"
        page = re.sub(r"[^A-Za-z0-9_./\-]|\.\.", "_", page)
        key = f"page {page}"
        owner = self._owners.get(key) or self._owner_elsewhere(key, test)
        self._owners[key] = owner
        if owner != test:
            page += f"-{zlib.crc32(test.encode()):08x}"
        self._pages[page] = self._pages.get(page, 0) + 1
        return page if self._pages[page] == 1 else f"{page}-{self._pages[page]}"

    def _owner_elsewhere(self, key: str, function: str) -> str:
        if self._shared is None:
            return function
        import hashlib

        file = self._shared / hashlib.sha256(key.encode()).hexdigest()
        self._shared.mkdir(exist_ok=True, mode=0o700)
        scratch = tempfile.NamedTemporaryFile("w", dir=self._shared, delete=False, encoding="utf-8")  # noqa: SIM115
        with scratch:
            scratch.write(function)
        try:
            file.hardlink_to(scratch.name)  # atomic, and only once
        except FileExistsError:
            return file.read_text("utf-8")
        finally:
            Path(scratch.name).unlink()
        return function
