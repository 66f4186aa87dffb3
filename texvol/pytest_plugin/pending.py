"""References to be written, kept apart until all tests have run.

The names of all tests are known only at the end of a run. So a run with --texvol-update writes into a folder of its
own, which the workers of pytest-xdist share, and the controller moves the pictures to their places at the end. Not
moved are pictures whose name two tests share, and pictures that would replace a reference although a test with other
parameters made another picture of that name.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from texvol.pytest_plugin import names
from texvol.pytest_plugin.references import Reference
from texvol.util import writing
from texvol.util.errors import InputError

_INFO, _SHARED, _UNLIKE = ".json", ".shared", ".unlike"


class Pending:
    """Pictures that wait in the folder of a run, each under the name that its test claimed."""

    def __init__(self, shared: Path) -> None:
        self._folder = shared / "references"

    def of(self, key: str) -> Reference | None:
        """Return the waiting picture of a claimed name, or None."""
        info = names.content_of(self._file(key, _INFO))
        return Reference(Path(json.loads(info)["picture"]), True) if info else None

    def keep(self, key: str, target: Path, replaced: Path | None, content: bytes) -> bool:
        """Keep a picture for the path `target`; return False if another process has kept one already.

        Raises
        ------
        InputError
            If the target's folder can't be written to.
        """
        _check_position(target)
        self._folder.mkdir(exist_ok=True, mode=0o700, parents=True)
        picture = self._file(key, f"-{os.urandom(4).hex()}{target.suffix}")
        writing.write_files({picture: content})
        old = str(replaced) if replaced else None
        info = json.dumps({"key": key, "picture": str(picture), "target": str(target), "replaced": old})
        is_first = names.put_once(self._file(key, _INFO), info) == info
        if not is_first:
            picture.unlink()
        return is_first

    def refuse(self, key: str, reason: str) -> None:
        """Mark a name that two tests share: its picture is not written."""
        names.put_once(self._file(key, _SHARED), reason)

    def doubt(self, key: str, test: str) -> None:
        """Mark a name for which a test made another picture than the waiting one: no reference is replaced."""
        names.put_once(self._file(key, _UNLIKE), f"{test} gives another picture of that name")

    def commit(self) -> tuple[dict[str, str], bool]:
        """Move the pictures to their places.

        Returns
        -------
        dict
            Reasons why pictures were not moved, by claimed name.
        bool
            True if all others were written without an error.
        """
        refused, no_errors = {}, True
        for file in sorted(self._folder.glob(f"*{_INFO}")):
            info = json.loads(names.content_of(file))
            key, target = info["key"], Path(info["target"])
            unlike = info["replaced"] and names.content_of(self._file(key, _UNLIKE))
            if reason := names.content_of(self._file(key, _SHARED)) or unlike:
                refused[key] = reason
                continue
            try:
                _put_in_place(Path(info["picture"]), target, Path(info["replaced"]) if info["replaced"] else None)
            except InputError as error:
                refused[key], no_errors = str(error), False
        return refused, no_errors

    def _file(self, key: str, ending: str) -> Path:
        return self._folder / f"{names.file_name(key)}{ending}"


def _check_position(target: Path) -> None:
    """Raise InputError if the picture can't be written later."""
    there = next(folder for folder in target.parents if os.path.lexists(folder))
    if not there.is_dir() or not os.access(there, os.W_OK):
        reason = "is not writable" if there.is_dir() else "is not a folder"
        raise InputError(f"{target.parent}: cannot be created: {there} {reason}")
    if there == target.parent:
        writing.check_writable(target)


def _put_in_place(picture: Path, target: Path, replaced: Path | None) -> None:
    """Write the reference; remove the reference of another format that it replaces."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        writing.write_files({target: picture.read_bytes()})
        if replaced is not None and replaced != target:
            replaced.unlink()
    except OSError as error:
        raise InputError(f"{error.filename or target}: cannot be written or replaced: {error.strerror}") from None
