"""Stale tables in files of limits, those of pictures that no longer exist; reported after a run of all tests."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from texvol.util.errors import InputError

if TYPE_CHECKING:
    import pytest

    from texvol.pytest_plugin.records import Record

# Options of pytest that select tests.
_NARROWING = ("keyword", "markexpr", "lf", "failedfirst", "deselect", "ignore", "ignore_glob", "stepwise")


def stale_tables(session: pytest.Session, records: Sequence[Record]) -> list[str]:
    """Return a sentence for each table whose picture is neither checked nor stored; none if tests were left out."""
    if int(session.exitstatus) in (2, 3, 4, 5) or session.shouldstop or session.shouldfail:
        return []
    if any(getattr(session.config.option, name, None) for name in _NARROWING):
        return []
    sentences = []
    for file in sorted({record["limits"] for record in records}):
        checked = [record for record in records if record["limits"] == file]
        folders = {Path(record["folder"]) for record in checked}
        if _ran_all_of(session.config, Path(file), folders):
            names = {record["name"] for record in checked}
            stale = [name for name in _tables(Path(file)) if not _exists(name, names, folders)]
            sentences += [f"{file}: [{name}]: the picture no longer exists; remove the table" for name in stale]
    return sentences


def _tables(file: Path) -> list[str]:
    from texvol.pytest_plugin.tables import DEFAULT, Tables

    try:
        return [name for name in Tables.read(file).tables if name != DEFAULT]
    except InputError:
        return []  # the tests have reported it


def _exists(name: str, checked: set[str], folders: set[Path]) -> bool:
    from texvol.pytest_plugin.references import find

    try:
        return name in checked or any(find(folder, name).exists for folder in folders)
    except InputError:
        return True


def _ran_all_of(config: pytest.Config, file: Path, folders: set[Path]) -> bool:
    """True if all tests ran that the file of limits may apply to: those below its folder and below the references'."""
    if config.args_source.name != "ARGS":
        return True
    below = {file.parent, *(folder.parent for folder in folders)}
    given = [Path(config.invocation_params.dir / arg) for arg in config.args if "::" not in arg]
    return all(any(part == each or each in part.parents for each in given if each.is_dir()) for part in below)
