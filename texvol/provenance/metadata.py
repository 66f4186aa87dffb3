"""Header of a picture: its JSON, checked, with errors that name the picture and the part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from texvol.formats.pictures.scene_metadata import FORMAT
from texvol.provenance import parts
from texvol.util import text_files
from texvol.util.errors import InputError

MOST_CHARACTERS = 64 << 20  # as of a transfer function, the longest part

T = TypeVar("T")


class Metadata:
    """An object of the header; `where` is its name in messages."""

    def __init__(self, content: Mapping[str, Any], name: str, where: str = "the scene in its header") -> None:
        self.content, self.name, self._where = content, name, where

    @classmethod
    def of(cls, text: str, name: str, known: Mapping[str, Any], always: tuple[str, ...]) -> Metadata:
        """Return the header of the picture `name`, with only `known` keys and at least those of `always`.

        Raises
        ------
        InputError
            If texvol did not write it.
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
            raise metadata.fault(f"has format {parts.quoted(version)}, and this texvol reads up to {FORMAT}")
        metadata.content = content
        metadata.check_keys(known, always)
        return metadata

    def inner(self, content: Any, what: str) -> Metadata:
        """Return an object within this one."""
        if not isinstance(content, dict):
            raise self.fault(f"has {what} that must be an object, got {parts.quoted(content)}")
        return Metadata(content, self.name, f"{what} of {self._where}")

    def check_keys(self, known: Mapping[str, Any], always: tuple[str, ...]) -> None:
        """Raise InputError if a key is unknown, or a key of `always` is missing."""
        missing = [key for key in always if self.content.get(key) is None]
        if missing:
            raise self.fault(f"lacks {', '.join(missing)}")
        self.checked(lambda: parts.check_keys(self.content, known))

    @property
    def told_how_to_read(self) -> bool:
        """True if the header says how its volume was read; that of texvol 0.3 has the volume's name only."""
        return "format" in self.content or "source" in self.content

    def fault(self, reason: object) -> InputError:
        """Return an error about this object."""
        return InputError(f"{self.name}: {self._where} {' '.join(str(reason).split())}")

    def checked(self, make: Callable[[], T]) -> T:
        """Return `make()`; its errors name the picture and the object."""
        try:
            return make()
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise self.fault(f"is not as texvol writes it: {error}") from None

    def part(self, key: str, make: Callable[[Any], T]) -> T | None:
        """Return `make` of the content of a key, or None if the key is missing."""
        content = self.content.get(key)
        return None if content is None else self.checked(lambda: _named(key, make, content))


def _named(key: str, make: Callable[[Any], T], content: Any) -> T:
    """Return `make(content)`; its error names the key."""
    try:
        return make(content)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(key.replace("_", " ")) else f"{key}: {message}") from None
