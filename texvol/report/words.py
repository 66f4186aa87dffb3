"""Numbers and settings as a reader wants them."""

from __future__ import annotations

from texvol.comparison import Difference
from texvol.convergence import (
    ErrorOf,
    Measurement,
    fastest_within,
    most_accurate,
)

LIMITS = (1e-2, 3e-3, 1e-3)  # errors that a setting is recommended for


def seconds(time: float | None) -> str:
    """A time in ms or s, three digits at most."""
    if time is None:
        return "–"
    if time < 0.9995:
        return f"{time * 1e3:.3g} ms" if time * 1e3 < 99.95 else f"{time * 1e3:.0f} ms"
    return f"{time:.3g} s"


def error(number: float | None) -> str:
    """An error with two digits."""
    if number is None:
        return "–"
    return f"{number:.1e}".replace("e-0", "e-").replace("e+0", "e+")


def rms_of(difference: Difference | None) -> str:
    """The rms error, or a dash."""
    return error(difference.rms_error if difference else None)


def max_of(difference: Difference | None) -> str:
    """The maximum error, or a dash."""
    return error(difference.max_error if difference else None)


def recommendation(measurements: list[Measurement], error_of: ErrorOf, limit: float) -> str:
    """The fastest setting within the limit, in words; or that there is none, and the nearest."""
    found = fastest_within(measurements, error_of, limit)
    if found is not None:
        return f"{found.setting.words}, {seconds(found.seconds)}"
    nearest = most_accurate(measurements, error_of)
    if nearest is None:
        return "not measured"
    return f"none; {nearest.setting.words} came nearest with {error(error_of(nearest))}, {seconds(nearest.seconds)}"


def sentence(measurements: list[Measurement], error_of: ErrorOf, what: str) -> str:
    """Which setting to use for which error, in one sentence; `what` names the error."""
    choices: dict[str, list[str]] = {}  # a setting in words, and the limits that it is for
    missed = []
    for limit in LIMITS:
        found = fastest_within(measurements, error_of, limit)
        if found is None:
            missed.append(f"{limit:g}")
        else:
            choices.setdefault(f"{found.setting.words} ({seconds(found.seconds)} a frame)", []).append(f"{limit:g}")
    if not choices:
        nearest = most_accurate(measurements, error_of)
        reached = f"; {nearest.setting.words} came nearest with {error(error_of(nearest))}" if nearest else ""
        return f"No setting keeps {what} within {_listed(missed, 'or')}{reached}."
    parts = [f"within {_listed(limits, 'and')} use {setting}" for setting, limits in choices.items()]
    if missed:
        parts.append(f"none keeps it within {_listed(missed, 'or')}")
    return f"To keep {what} {'; '.join(parts)}."


def _listed(items: list[str], last: str) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}"
