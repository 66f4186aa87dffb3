"""Names of pictures: where a test's references are, which names there may be, and whose a name is.

A name has letters, digits, - _ . and / for subfolders, all ASCII, so that it is the same file on every system. It is
one test's: two tests that share a name would share a reference by mistake. One test with several parameters may share
it with itself, as a picture that has to be the same by two drivers does. Names that differ by case alone are one name.
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
_MOST_CHARACTERS = 200  # of a name with its folders: file systems end at 255, and a suffix is added
# Windows keeps them for devices, whatever the suffix.
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")


def checked(name: object) -> str:
    """The name, or InputError where it is none."""
    if not isinstance(name, str):
        kind = type(name).__name__
        raise InputError(f"the name of a picture is a text, and not {kind}: check_picture(picture, name)")
    parts = name.split("/")
    good = all(_PART.fullmatch(part) and not _RESERVED.fullmatch(part) and not part.endswith(".") for part in parts)
    if name == "default":
        raise InputError("picture 'default': that is what the file of limits calls the table for all pictures")
    if not good or len(name) > _MOST_CHARACTERS:
        raise InputError(
            f"picture {name!r}: a name has letters a-z, digits, - _ . and / for subfolders, "
            f"begins with a letter, a digit or _ in each, and has at most {_MOST_CHARACTERS} characters"
        )
    return name


def references_of(path: Path, config: pytest.Config) -> Path:
    """The folder of references of the tests in the file `path`."""
    return path.parent / str(config.getini("texvol_references") or _DEFAULT_FOLDER)


def limits_of(references: Path, config: pytest.Config) -> Path:
    """The file of limits that holds for a folder of references."""
    given = str(config.getini("texvol_limits"))
    base = config.inipath.parent if config.inipath else config.rootpath
    return base / given if given else references / "limits.toml"


class SharedNameError(InputError):
    """Two tests that have one name for their pictures."""


def name_key(folder: Path, name: str) -> str:
    """Key of a reference's name in a run: the same for the same file, on whatever system."""
    return f"{os.path.realpath(folder)}/{name.lower()}"


class Claims:
    """Whose a name is, in this process and, through files that say so, in the others of the same run.

    Parameters
    ----------
    shared : path or None
        A folder for those files, which need not be there yet.
    """

    def __init__(self, shared: Path | None = None) -> None:
        self._shared = shared
        self._owners: dict[str, str] = {}
        self._pages: dict[str, int] = {}

    def claim(self, folder: Path, name: str, test: str) -> str:
        """Make a reference's name the test's; the key that it has in this run.

        Names that differ by case alone are one, as they are one file on some systems; so are folders by any path.

        Raises
        ------
        SharedNameError
            If it is another test's, or the same test's in another spelling.
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
                f"pictures {spelled!r} and {name!r} differ by case alone, and are one file on some systems "
                f"({owner} and {function}): rename one"
            )
        if owner != function:
            raise SharedNameError(f"picture {name!r} is checked by two tests, {owner} and {function}: rename one")
        return key

    def first(self, key: str) -> bool:
        """Whether nobody in the run has asked for that key yet."""
        mine = f"{os.getpid()} {id(self)}"
        fresh = key not in self._owners and self._owner_elsewhere(key, mine) == mine
        self._owners.setdefault(key, mine)
        return fresh

    def page(self, test: str, name: str) -> str:
        """Path of the page of a check, without suffix: the test's folder and the picture's name.

        Where one test checks a name again, with other parameters or in a loop, numbers set its pages apart.
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
            file.hardlink_to(scratch.name)  # whole, and only once
        except FileExistsError:
            return file.read_text("utf-8")
        finally:
            Path(scratch.name).unlink()
        return function
