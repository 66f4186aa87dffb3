"""Numbers, settings and recommendations as texts."""

from __future__ import annotations

from collections.abc import Sequence

from texvol.comparison import Difference
from texvol.report.convergence import (
    PRECLASSIFIED,
    Asked,
    ErrorOf,
    Measurement,
    discretisation_max,
    discretisation_rms,
    fastest_within,
    most_accurate,
)

LIMITS = (1e-2, 3e-3, 1e-3)  # errors with a recommended setting


def seconds(time: float | None) -> str:
    """A time in ms or s, with at most three digits."""
    if time is None:
        return "–"
    if time < 0.9995:
        return f"{time * 1e3:.3g} ms" if time * 1e3 < 99.95 else f"{time * 1e3:.0f} ms"
    return f"{time:.3g} s"


def error(number: float | None) -> str:
    """An error with two digits; with more if two digits would put it within a limit that it exceeds."""
    if number is None:
        return "–"
    texts = (f"{number:.{digits}e}" for digits in range(1, 17))
    text = next((each for each in texts if not any(float(each) <= limit < number for limit in LIMITS)), repr(number))
    return text.replace("e-0", "e-").replace("e+0", "e+")


def rms_of(difference: Difference | None) -> str:
    """The rms error, or a dash."""
    return error(difference.rms_error if difference else None)


def max_of(difference: Difference | None) -> str:
    """The maximum error, or a dash."""
    return error(difference.max_error if difference else None)


def asking_within(asked: Sequence[Asked], error_of: ErrorOf, limit: float) -> Asked | None:
    """Return the fastest answer to `--max-error` whose error is at most `limit`, or None.

    The error of an answer is the maximum discretisation error. It is an upper bound of the rms error, and equal to the
    total error for post-classified settings.
    """
    is_total = error_of not in (discretisation_max, discretisation_rms)
    within = [
        each
        for each in asked
        if each.true_error is not None
        and each.true_error <= limit
        and not (is_total and each.classification in PRECLASSIFIED)
    ]
    return min(within, key=lambda each: each.seconds, default=None)


def recommendation(
    measurements: list[Measurement], error_of: ErrorOf, limit: float, asked: Sequence[Asked] = ()
) -> str:
    """Return the fastest setting within the limit; else the result of `--max-error`; else the most accurate setting."""
    choice = _choice(measurements, error_of, limit, asked)
    if choice is not None:
        return f"{choice[0]}, {choice[1]}{choice[2]}"
    nearest = most_accurate(measurements, error_of)
    if nearest is None:
        return "not measured"
    least = error(error_of(nearest))
    return f"none; the most accurate is {nearest.setting.words} with {least}, {seconds(nearest.seconds)}"


def sentence(measurements: list[Measurement], error_of: ErrorOf, what: str, asked: Sequence[Asked] = ()) -> str:
    """Return one sentence on the setting to use for each limit; `what` names the error."""
    choices: dict[str, list[str]] = {}  # setting → limits
    missed = []
    for limit in LIMITS:
        choice = _choice(measurements, error_of, limit, asked)
        if choice is None:
            missed.append(f"{limit:g}")
        else:
            words = f"{choice[0]} ({choice[1]}{choice[2] or ' a frame'})"
            choices.setdefault(words, []).append(f"{limit:g}")
    if not choices:
        nearest = most_accurate(measurements, error_of)
        reached = f"; the most accurate is {nearest.setting.words} with {error(error_of(nearest))}" if nearest else ""
        return f"No setting keeps {what} within {_listed(missed, 'or')}{reached}."
    parts = [f"within {_listed(limits, 'and')} use {setting}" for setting, limits in choices.items()]
    if missed:
        parts.append(f"none keeps it within {_listed(missed, 'or')}")
    return f"To keep {what} {'; '.join(parts)}."


def of_discretisation(measurements: list[Measurement], error_of: ErrorOf, asked: Sequence[Asked]) -> str:
    """Return a sentence on limits that are kept by the discretisation error alone; empty if there are none."""
    kept: dict[str, list[str]] = {}
    for limit in LIMITS:
        alone = _choice(measurements, discretisation_max, limit, asked)
        if alone is not None and _choice(measurements, error_of, limit, asked) is None:
            kept.setdefault(alone[0], []).append(f"{limit:g}")
    if not kept:
        return ""
    parts = [f"within {_listed(limits, 'and')} by {setting}" for setting, limits in kept.items()]
    return f"The discretisation error alone, without the model error, is kept {'; '.join(parts)}."


def _choice(
    measurements: list[Measurement], error_of: ErrorOf, limit: float, asked: Sequence[Asked]
) -> tuple[str, str, str] | None:
    """Return (setting, time, remark on the time) of the fastest setting, or else the fastest answer, within a limit."""
    found = fastest_within(measurements, error_of, limit)
    if found is not None:
        return found.setting.words, seconds(found.seconds), ""
    answer = asking_within(asked, error_of, limit)
    if answer is None:
        return None
    words = f"{answer.classification} with --max-error {answer.wanted:g}"
    return words, seconds(answer.seconds), " with the search"


def _listed(items: list[str], last: str) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}"
