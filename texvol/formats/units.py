"""Units of lengths and times, as files and stores name them (UDUNITS words), and their common one."""

from __future__ import annotations

from collections.abc import Sequence

# Word, short name, and metres.
_LENGTHS = (
    ("angstrom", "Å", 1e-10),
    ("nanometer", "nm", 1e-9),
    ("micrometer", "µm", 1e-6),
    ("millimeter", "mm", 1e-3),
    ("centimeter", "cm", 1e-2),
    ("meter", "m", 1.0),
    ("kilometer", "km", 1e3),
    ("inch", "in", 0.0254),
)
_SHORT = {word: short for word, short, _ in _LENGTHS}
_SHORT |= {word.replace("meter", "metre"): short for word, short, _ in _LENGTHS if "meter" in word}
_SHORT |= {"um": "µm", "μm": "µm", "\\u00b5m": "µm", "micron": "µm", "inche": "in", "pixel": "", "index": "", "1": ""}
_SHORTEST_PLURAL = 4  # letters: "mms" is no word
_METRES = {short: metres for _, short, metres in _LENGTHS}
_TIMES = {"second": "s", "seconds": "s", "sec": "s", "millisecond": "ms", "microsecond": "µs", "minute": "min"}
_TIMES |= {"hour": "h", "day": "d", "milliseconds": "ms", "microseconds": "µs", "minutes": "min", "hours": "h"}
_TIMES |= {"days": "d"}


def length_unit(word: str) -> str:
    """Return the short name of a unit of length, also of its plural; a word that is not known stays."""
    word = word.strip()
    lower = word.lower()
    return _SHORT.get(lower, _SHORT.get(lower.removesuffix("s"), word) if len(lower) > _SHORTEST_PLURAL else word)


def metres_of(short: str) -> float | None:
    """Return the metres of a unit of length by its short name; None for one that is not known."""
    return _METRES.get(short)


def time_unit(word: str) -> str:
    """Return the short name of a unit of time; a word that is not known stays."""
    return _TIMES.get(word.strip().lower(), word.strip())


def common_length(units: Sequence[str]) -> tuple[str, list[float], tuple[str, ...]]:
    """Return the unit of the last of the axes z, y, x, the factors that take the others to it, and notes."""
    wanted = units[-1] or next((each for each in units if each), "")
    if all(each in ("", wanted) for each in units):
        return wanted, [1.0] * len(units), ()
    if all(each in _METRES for each in units):
        return wanted, [_METRES[each] / _METRES[wanted] for each in units], ()
    listed = ", ".join(each or "no unit" for each in units[::-1])
    note = f"its axes have different units ({listed}); --spacing X,Y,Z makes them comparable"
    return "", [1.0] * len(units), (note,)


def time_word(short: str) -> str:
    """Return the word of a unit of time for OME metadata, that of "hours since 2001-01-01" too; else empty."""
    words = short.split()
    first = words[0] if words and (len(words) == 1 or words[1] == "since") else ""
    known = _TIMES.get(first.lower(), first)
    return next((word for word, each in _TIMES.items() if each == known), "")


def unit_word(short: str) -> str:
    """Return the word of a unit of length for OME metadata; empty for one that is not known."""
    return next((word for word, known, _ in _LENGTHS if short in (word, known)), "")
