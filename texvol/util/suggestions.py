"""Suggestions for words that are not known: did you mean …?"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

from texvol.util.errors import InputError


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'ct-bone'?" for the known word that is nearest, or "" if none is near."""
    from difflib import get_close_matches

    by_lower = {each.lower(): each for each in known}
    near = get_close_matches(word.strip().lower(), by_lower, n=1, cutoff=0.6)
    return f"; did you mean {by_lower[near[0]]!r}?" if near else ""


def check_one_of(what: str, word: Any, known: Collection[str]) -> None:
    """Raise InputError with a guess where a word is none of those known; `what` begins the message."""
    if word not in known:
        near = did_you_mean(word, known) if isinstance(word, str) else ""
        raise InputError(f"{what} must be one of {', '.join(known)}, got {word!r}{near}")
