"""The file of limits: a table for each picture that needs its own, and why.

    [default]                        # for every picture here
    rms = 1e-4

    ["clouds/cumulus"]
    max-abs = 0.01
    fail-percent = 0.1
    reason = "a ray that just meets an outline may as well miss it"
    drivers = ["llvmpipe", "NVIDIA"]

Whatever is looser than the defaults needs a reason beside it. Limits of one's own hold for the driver that drew the
reference, and for others only as far as `drivers` says: "any", or parts of their names.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from texvol.comparison.limits import NAMES, ONE_DRIVER, TWO_DRIVERS, Limits, changed_limits, read_limits
from texvol.util.errors import InputError

DEFAULT = "default"
_KEYS = tuple(name.replace("_", "-") for name in NAMES)
# A word that is a reason at all has company: "flaky", "TODO" and "see above" are none.
_FEWEST_WORDS = 3


@dataclass(frozen=True)
class Tables:
    """The tables of one file, as they stand there; what they say is checked for the picture that they are for."""

    path: Path
    tables: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path) -> Tables:
        """Those of a file; none where there is none."""
        tables = read_limits(path) if os.path.lexists(path) else {}
        for name, table in tables.items():
            if not isinstance(table, dict):
                raise InputError(f"{path}: {name} is in no table; write it under [default] or a picture's name")
        return cls(path, tables)

    def rules_for(self, name: str) -> Rules:
        """What holds for a picture.

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
        return Rules(given, own.get("drivers", shared.get("drivers")), source)

    def _checked(self, name: str, table: dict[str, Any], base: Limits) -> Limits:
        where = f"{self.path}: [{name}]"
        for key, value in table.items():
            if isinstance(value, dict):
                raise InputError(f'{where} holds a table {key!r}: a name with a dot or a / stands in quotes, ["a/b"]')
            if key not in (*_KEYS, "reason", "drivers"):
                raise InputError(f"{where}: there is no {key!r}; there are {', '.join((*_KEYS, 'reason', 'drivers'))}")
        _check_drivers(table.get("drivers", "any"), where)
        try:
            limits = changed_limits(base, {key: table[key] for key in table if key in _KEYS}, where)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        looser = limits.looser_than(base)
        if looser and not _is_reason(table.get("reason")):
            raise InputError(
                f"{where} allows more than the defaults ({', '.join(looser)}) and gives no reason: "
                f'add reason = "…" that says in at least {_FEWEST_WORDS} words why the picture needs it'
            )
        return limits


@dataclass(frozen=True)
class Rules:
    """What holds for one picture, whatever drew it."""

    given: Mapping[str, float]
    drivers: str | list[str] | None
    source: str

    def limits(self, driver: str | None, reference_driver: str | None) -> Limits:
        """The limits of a pair that these two drew; None: it is not said.

        Raises
        ------
        InputError
            If there are limits, and they don't cover the driver.
        """
        known_apart = bool(driver and reference_driver and driver != reference_driver)
        base = TWO_DRIVERS if known_apart else ONE_DRIVER
        if not self.given:
            return base
        if driver != reference_driver and not self._cover(driver):
            raise InputError(
                f"the reference was drawn by {reference_driver or 'what it does not say'}, the picture by "
                f"{driver or 'what is not said'}, and the limits of {self.source} are for the former: "
                'add drivers = "any", or a part of the name, where they hold for this one too; or give the picture a '
                "reference by this driver"
            )
        return changed_limits(base, self.given, self.source)

    def _cover(self, driver: str | None) -> bool:
        if self.drivers == "any":
            return True
        return driver is not None and any(part.lower() in driver.lower() for part in self.drivers or ())


def _check_drivers(drivers: Any, where: str) -> None:
    good = isinstance(drivers, list) and drivers and all(isinstance(each, str) and each.strip() for each in drivers)
    if drivers != "any" and not good:
        raise InputError(f'{where}: drivers is "any" or a list of parts of their names, and not {drivers!r}')


def _is_reason(reason: Any) -> bool:
    return isinstance(reason, str) and len(re.findall(r"\w*[^\W\d_]{2,}\w*", reason)) >= _FEWEST_WORDS
