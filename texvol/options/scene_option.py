"""An option of the command line that may stand in a scene file as well: one meaning for its text and its TOML value."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from texvol.options import light as lit
from texvol.util.errors import InputError


class SceneOption(NamedTuple):
    """An option of the line and the scene file; one that converts to bool is a switch and has no text."""

    name: str
    convert: Callable[[str], Any]
    shown: str
    help: str
    table: Callable[[Mapping[str, Any]], Any] | None = None  # of a scene file; such an option may be given repeatedly
    from_value: Callable[[Any], Any] | None = None  # of a scene file, where that is more than a text or numbers
    repeated: bool = False  # given again for further ones, which make a list

    def add_to(self, group: argparse._ArgumentGroup) -> None:
        """Let the line have it; not given, it leaves nothing in the namespace."""
        if self.convert is bool:
            action = argparse.BooleanOptionalAction
            group.add_argument(f"--{self.name}", action=action, help=self.help, default=argparse.SUPPRESS)
            return
        group.add_argument(
            f"--{self.name}", type=self.convert, metavar=self.shown, help=self.help, default=argparse.SUPPRESS,
            action="append" if self.table or self.repeated else "store",
        )  # fmt: skip

    def from_file(self, value: Any) -> Any:
        """What a scene file's value becomes: the same as what the line's text does."""
        if self.convert is bool:
            if not isinstance(value, bool):
                raise InputError(f"{self.name} is true or false, and not {value!r}")
            return value
        if self.from_value is not None:
            return self.from_value(value)
        if self.table is None:
            return self._from_one(value)
        several = isinstance(value, list) and any(isinstance(each, str | dict | list) for each in value)
        return [self._from_one(each) for each in (value if several else [value])]

    def _from_one(self, value: Any) -> Any:
        if self.table is not None and isinstance(value, dict):
            return self.table(value)
        if isinstance(value, bool | dict):
            raise InputError(f"{self.name} is text, a number or an array of numbers, and not {value!r}")
        return self.convert(lit.as_text(value))
