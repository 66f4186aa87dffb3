"""Option of the command line that may also be a key of a scene file, with one meaning in both."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from texvol.options import texts
from texvol.util.errors import InputError


class SceneOption(NamedTuple):
    """Option of the command line and the scene file; an option that converts to bool is a switch without a value."""

    name: str
    convert: Callable[[str], Any]
    shown: str
    help: str
    table: Callable[[Mapping[str, Any]], Any] | None = None  # converter of a TOML table; such an option is repeatable
    from_value: Callable[[Any], Any] | None = None  # converter of a scene-file value other than text or numbers
    repeated: bool = False  # given several times, the values are a list

    def add_to(self, group: argparse._ArgumentGroup) -> None:
        """Add the option to a parser's group; an option that is not given leaves no name in the namespace."""
        if self.convert is bool:
            action = argparse.BooleanOptionalAction
            group.add_argument(f"--{self.name}", action=action, help=self.help, default=argparse.SUPPRESS)
            return
        group.add_argument(
            f"--{self.name}", type=self.convert, metavar=self.shown, help=self.help, default=argparse.SUPPRESS,
            action="append" if self.table or self.repeated else "store",
        )  # fmt: skip

    def from_file(self, value: Any) -> Any:
        """Return the converted value of a scene file, equal to that of the same text on the command line."""
        if self.convert is bool:
            if not isinstance(value, bool):
                raise InputError(f"{self.name} must be true or false, got {value!r}")
            return value
        if self.from_value is not None:
            return self.from_value(value)
        if self.table is None:
            return self._from_single(value)
        several = isinstance(value, list) and any(isinstance(each, str | dict | list) for each in value)
        return [self._from_single(each) for each in (value if several else [value])]

    def _from_single(self, value: Any) -> Any:
        if self.table is not None and isinstance(value, dict):
            return self.table(value)
        if isinstance(value, bool | dict):
            raise InputError(f"{self.name} must be text, a number or an array of numbers, got {value!r}")
        return self.convert(texts.as_text(value))
