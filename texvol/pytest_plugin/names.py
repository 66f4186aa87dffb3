"""Names of pictures: the folder of a test's references, valid names, and the test that owns a name.

A name consists of ASCII letters, digits, - _ . and / for subfolders, so that it is the same file on every system. A
name belongs to one test: two tests with one name would share a reference by mistake. One test with several parameters
may share a name with itself, as for a picture that has to be the same by two drivers. Names that differ only in case
are one name.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
import zlib
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


def check(name: object) -> None:
    """Raise InputError if the name is not valid."""
    __tracebackhide__ = True
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
    """Owners of names, kept in files that all processes of the run share; their folder is created when needed."""

    def __init__(self, shared: Path) -> None:
        self._shared = shared
        self._owners: dict[str, str] = {}
        self._pages: dict[str, int] = {}

    def claim(self, key: str, name: str, test: str) -> None:
        """Give the reference's name with that `name_key` to the test.

        Raises
        ------
        SharedNameError
            If another test has the name, or the same test has it in another spelling.
        """
        path, _, rest = test.partition("::")
        function = f"{path}::{rest.split('[', 1)[0]}"
        owner, _, spelled = self._owner(key, f"{function}\n{name}").partition("\n")
        if spelled != name:
            raise SharedNameError(
                f"pictures {spelled!r} and {name!r} differ only in case, and are one file on some systems "
                f"({owner} and {function}): rename one"
            )
        if owner != function:
            raise SharedNameError(f"picture {name!r} is checked by two tests, {owner} and {function}: rename one")

    def is_mine(self, key: str) -> bool:
        """True in the first process of the run that asks for that key."""
        mine = f"{os.getpid()} {id(self)}"
        return self._owner(key, mine) == mine

    def page(self, test: str, name: str) -> str:
        """Return the path of a check's page, without suffix: the test's folder and the picture's name.

        Pages of a test that checks a name again, with other parameters or in a loop, are numbered.
        """
        folder = str(Path(test.split("::", 1)[0]).parent)
        page = f"pages/{name}" if folder == "." else f"pages/{folder}/{name}"
        page = re.sub(r"[^A-Za-z0-9_./\-]|\.\.", "_", page)
        if self._owner(f"page {page}", test) != test:
            page += f"-{zlib.crc32(test.encode()):08x}"
        self._pages[page] = self._pages.get(page, 0) + 1
        return page if self._pages[page] == 1 else f"{page}-{self._pages[page]}"

    def _owner(self, key: str, candidate: str) -> str:
        """Return the owner of a key, which is the candidate if it has none."""
        if key not in self._owners:
            self._owners[key] = put_once(self._shared / file_name(key), candidate)
        return self._owners[key]


def file_name(key: str) -> str:
    """Return the name of the file about a key."""
    return hashlib.sha256(key.encode(errors="surrogateescape")).hexdigest()


def content_of(file: Path) -> str:
    """Return the text of a file that `put_once` wrote; empty if it does not exist."""
    return file.read_bytes().decode(errors="surrogateescape") if file.exists() else ""


def put_once(file: Path, text: str) -> str:
    """Write a file whole, unless another process has written it; return its content."""
    file.parent.mkdir(exist_ok=True, mode=0o700, parents=True)
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as scratch:
        scratch.write(text.encode(errors="surrogateescape"))  # paths may not be UTF-8
    try:
        file.hardlink_to(scratch.name)  # atomic
    except FileExistsError:
        return content_of(file)
    finally:
        Path(scratch.name).unlink()
    return text
