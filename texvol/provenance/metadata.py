"""A picture's header as facts: its JSON, checked, and a way to say what is wrong with it and where."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from texvol.provenance import parts
from texvol.provenance.scene_metadata import FORMAT
from texvol.util import text_files
from texvol.util.errors import InputError

MOST_CHARACTERS = 64 << 20  # as many as of a transfer function, which is the longest part

T = TypeVar("T")


class Metadata:
    """A header's object, or one within it; `where` is what messages call it."""

    def __init__(self, content: Mapping[str, Any], name: str, where: str = "the scene in its header") -> None:
        self.content, self.name, self._where = content, name, where

    @classmethod
    def of(cls, text: str, name: str, known: Mapping[str, Any], always: tuple[str, ...]) -> Metadata:
        """What a header of the picture `name` says, by keys that are known, and some that have to be there.

        Raises
        ------
        InputError
            If it is none that texvol writes.
        """
        metadata = cls({}, name)
        try:
            content = text_files.parsed_json(text, "it") if len(text) <= MOST_CHARACTERS else None
        except InputError as error:
            raise metadata.fault(str(error).removeprefix("it: ")) from None
        if not isinstance(content, dict):
            raise metadata.fault(f"is not a JSON object of at most {MOST_CHARACTERS >> 20} MB")
        version = content.get("format", 1)
        if version not in (1, FORMAT):
            raise metadata.fault(f"is of format {parts.quoted(version)}, and this texvol reads up to {FORMAT}")
        metadata.content = content
        metadata.check_keys(known, always)
        return metadata

    def inner(self, content: Any, what: str) -> Metadata:
        """The facts of an object within this one."""
        if not isinstance(content, dict):
            raise self.fault(f"has {what} that is none: an object is wanted, and not {parts.quoted(content)}")
        return Metadata(content, self.name, f"{what} of {self._where}")

    def check_keys(self, known: Mapping[str, Any], always: tuple[str, ...]) -> None:
        """Raise InputError where a key is not known, or one of `always` is not there."""
        missing = [key for key in always if self.content.get(key) is None]
        if missing:
            raise self.fault(f"lacks {', '.join(missing)}")
        self.checked(lambda: parts.check_keys(self.content, known))

    @property
    def told_how_to_read(self) -> bool:
        """Whether a volume from a file would have said how it was read: texvol 0.3 wrote its name alone."""
        return "format" in self.content or "source" in self.content

    def fault(self, reason: object) -> InputError:
        """An error on these facts."""
        return InputError(f"{self.name}: {self._where} {' '.join(str(reason).split())}")

    def checked(self, make: Callable[[], T]) -> T:
        """What `make` returns; whatever it raises says whose header it was."""
        try:
            return make()
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise self.fault(f"is none that texvol writes: {error}") from None

    def part(self, key: str, make: Callable[[Any], T]) -> T | None:
        """What stands under a key, made into what it means; None where nothing does."""
        if self.content.get(key) is None:
            return None
        return self.checked(lambda: _named(key, make, self.content[key]))


def _named(key: str, make: Callable[[Any], T], content: Any) -> T:
    """What `make` makes of a part; its error says which part."""
    try:
        return make(content)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(key.replace("_", " ")) else f"{key}: {message}") from None
