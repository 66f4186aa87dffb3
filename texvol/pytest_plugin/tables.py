"""File of limits: a table for each picture that needs its own limits, with the reason.

    [default]                        # for every picture here
    rms = 1e-4

    ["clouds/cumulus"]
    max-abs = 0.01
    fail-percent = 0.1
    reason = "a ray that just meets an outline may as well miss it"
    drivers = ["llvmpipe", "NVIDIA"]
    ignore = [{rectangle = [8, 8, 120, 16], reason = "the date of the run"}]      # see comparison/regions.py

Limits that are looser than the defaults need a reason. A table's limits hold for the driver that drew the reference,
and for other drivers as far as `drivers` says: "any", or parts of their names.

Stale tables, of pictures that no longer exist, are reported after a run of all tests.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.comparison.limits import NAMES, ONE_DRIVER, TWO_DRIVERS, Limits, changed_limits
from texvol.comparison.regions import FEWEST_WORDS, Region, is_reason
from texvol.pytest_plugin.references import find
from texvol.util import text_files
from texvol.util.errors import InputError

if TYPE_CHECKING:
    import pytest

    from texvol.pytest_plugin.records import Record

DEFAULT = "default"
_KEYS = tuple(name.replace("_", "-") for name in NAMES)
_OTHER_KEYS = ("reason", "drivers", "ignore")
# Options of pytest that select tests.
_NARROWING = ("keyword", "markexpr", "lf", "failedfirst", "deselect", "ignore", "ignore_glob", "stepwise")


@dataclass(frozen=True)
class Tables:
    """Tables of one file, unchecked; a table is checked when its picture is."""

    path: Path
    tables: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path) -> Tables:
        """Read the tables of a file; none if the file does not exist."""
        tables = text_files.read_toml(path) if os.path.lexists(path) else {}
        for name, table in tables.items():
            if not isinstance(table, dict):
                raise InputError(f"{path}: {name} must be in a table: [default] or a picture's name")
        return cls(path, tables)

    def rules_for(self, name: str) -> Rules:
        """Return the rules for a picture.

        Raises
        ------
        InputError
            If a limit is unknown, or looser than the defaults without a reason.
        """
        own, shared = self.tables.get(name, {}), self.tables.get(DEFAULT, {})
        base = self._checked(DEFAULT, shared, ONE_DRIVER)
        self._checked(name, own, base)
        given = {key: value for key, value in (shared | own).items() if key in _KEYS}
        source = f"[{name if own else DEFAULT}] in {self.path.name}" if given else ""
        regions = [*self._regions(DEFAULT, shared), *(self._regions(name, own) if own is not shared else ())]
        return Rules(given, own.get("drivers", shared.get("drivers")), source, tuple(regions))

    def _regions(self, name: str, table: Mapping[str, Any]) -> list[Region]:
        """Return the regions that don't count of a table; masks are relative to the file of limits."""
        given, where = table.get("ignore", []), f"{self.path}: [{name}]"
        if not isinstance(given, list):
            raise InputError(f"{where}: ignore must be a list of regions, got {given!r}")
        return [Region.of(each, self.path.parent, f"{where}: ignore") for each in given]

    def _checked(self, name: str, table: dict[str, Any], base: Limits) -> Limits:
        where = f"{self.path}: [{name}]"
        for key, value in table.items():
            if isinstance(value, dict):
                raise InputError(f'{where} holds a table {key!r}; quote names that have a dot or a /: ["a/b"]')
            if key not in (*_KEYS, *_OTHER_KEYS):
                keys = ", ".join((*_KEYS, *_OTHER_KEYS))
                raise InputError(f"{where}: key {key!r} not found; the keys are {keys}")
        drivers = table.get("drivers", "any")
        are_parts = isinstance(drivers, list) and all(isinstance(each, str) and each.strip() for each in drivers)
        if drivers != "any" and not (drivers and are_parts):
            raise InputError(f'{where}: drivers must be "any" or a list of parts of drivers\' names, got {drivers!r}')
        try:
            limits = changed_limits(base, {key: table[key] for key in table if key in _KEYS}, where)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        looser = limits.looser_than(base)
        if looser and not is_reason(table.get("reason")):
            raise InputError(
                f"{where} allows more than the defaults ({', '.join(looser)}) without a reason; "
                f'add reason = "…" of at least {FEWEST_WORDS} words'
            )
        return limits


@dataclass(frozen=True)
class Rules:
    """Limits for one picture, for all drivers."""

    given: Mapping[str, float]
    drivers: str | list[str] | None
    source: str
    regions: tuple[Region, ...] = ()

    def limits(self, driver: str | None, reference_driver: str | None) -> Limits:
        """Return the limits of a pair drawn by these two drivers; None for an unknown driver.

        Raises
        ------
        InputError
            If there are limits, and they do not hold for the driver.
        """
        known_apart = bool(driver and reference_driver and driver != reference_driver)
        base = TWO_DRIVERS if known_apart else ONE_DRIVER
        if not self.given:
            return base
        if driver != reference_driver and not self._cover(driver):
            raise InputError(
                f"the reference was drawn by {reference_driver or 'an unknown driver'}, the picture by "
                f"{driver or 'an unknown driver'}, and the limits of {self.source} hold for the former; "
                'add drivers = "any", or a part of the name, if they hold for this driver too, or give the picture a '
                "reference by this driver"
            )
        return changed_limits(base, self.given, self.source)

    def _cover(self, driver: str | None) -> bool:
        if self.drivers == "any":
            return True
        return driver is not None and any(part.lower() in driver.lower() for part in self.drivers or ())


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
        if not _ran_all_of(session.config, Path(file), folders):
            continue
        known = {DEFAULT, *(record["name"] for record in checked)}
        with suppress(InputError):  # the tests have reported it
            stale = [name for name in Tables.read(Path(file)).tables if not _exists(name, known, folders)]
            sentences += [f"{file}: [{name}]: the picture no longer exists; remove the table" for name in stale]
    return sentences


def _exists(name: str, known: set[str], folders: set[Path]) -> bool:
    """True if a name is known, or a picture of that name is stored once or several times."""
    try:
        return name in known or any(find(folder, name).exists for folder in folders)
    except InputError:
        return True


def _ran_all_of(config: pytest.Config, file: Path, folders: set[Path]) -> bool:
    """True if all tests ran that the file of limits may apply to: those below its folder and below the references'."""
    if config.args_source.name != "ARGS":
        return True
    below = {file.parent, *(folder.parent for folder in folders)}
    given = [Path(config.invocation_params.dir / arg) for arg in config.args if "::" not in arg]
    return all(any(part == each or each in part.parents for each in given if each.is_dir()) for part in below)
