"""Remarks that a command makes when it has ended, since only then their numbers are known."""

from __future__ import annotations

from collections.abc import Callable, Iterable

Remark = Callable[[], Iterable[str]]
_LATE: list[Remark] = []


def make_at_end(remark: Remark) -> None:
    """Keep a remark, which is called when the command has ended."""
    _LATE.append(remark)


def taken() -> list[str]:
    """Return the sentences of all remarks, each once, and forget them."""
    found = [sentence for remark in _LATE for sentence in remark()]
    _LATE.clear()
    return list(dict.fromkeys(found))
