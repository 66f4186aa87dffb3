"""Numbers and settings as a reader wants them."""

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

LIMITS = (1e-2, 3e-3, 1e-3)  # errors that a setting is recommended for


def seconds(time: float | None) -> str:
    """A time in ms or s, three digits at most."""
    if time is None:
        return "–"
    if time < 0.9995:
        return f"{time * 1e3:.3g} ms" if time * 1e3 < 99.95 else f"{time * 1e3:.0f} ms"
    return f"{time:.3g} s"


def error(number: float | None) -> str:
    """An error with two digits; with more where two would say that it is within a limit that it is not."""
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
    """The fastest answer to `--max-error` whose error is at most `limit`, or None.

    The error of an answer is the maximum discretisation error: no rms error is larger, and it is the total error too of
    what is classified after interpolation.
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
    """The fastest setting within the limit, in words; else what `--max-error` reached; else the nearest."""
    found = fastest_within(measurements, error_of, limit)
    if found is not None:
        return f"{found.setting.words}, {seconds(found.seconds)}"
    answer = asking_within(asked, error_of, limit)
    if answer is not None:
        return f"{_asking(answer)}, {seconds(answer.seconds)} with the search"
    nearest = most_accurate(measurements, error_of)
    if nearest is None:
        return "not measured"
    return f"none; {nearest.setting.words} came nearest with {error(error_of(nearest))}, {seconds(nearest.seconds)}"


def sentence(measurements: list[Measurement], error_of: ErrorOf, what: str, asked: Sequence[Asked] = ()) -> str:
    """Which setting to use for which error, in one sentence; `what` names the error."""
    choices: dict[str, list[str]] = {}  # a setting in words, and the limits that it is for
    missed = []
    for limit in LIMITS:
        found, answer = fastest_within(measurements, error_of, limit), asking_within(asked, error_of, limit)
        if found is not None:
            choices.setdefault(f"{found.setting.words} ({seconds(found.seconds)} a frame)", []).append(f"{limit:g}")
        elif answer is not None:
            choices.setdefault(f"{_asking(answer)} ({seconds(answer.seconds)} with the search)", []).append(
                f"{limit:g}"
            )
        else:
            missed.append(f"{limit:g}")
    if not choices:
        nearest = most_accurate(measurements, error_of)
        reached = f"; {nearest.setting.words} came nearest with {error(error_of(nearest))}" if nearest else ""
        return f"No setting keeps {what} within {_listed(missed, 'or')}{reached}."
    parts = [f"within {_listed(limits, 'and')} use {setting}" for setting, limits in choices.items()]
    if missed:
        parts.append(f"none keeps it within {_listed(missed, 'or')}")
    return f"To keep {what} {'; '.join(parts)}."


def of_discretisation(measurements: list[Measurement], error_of: ErrorOf, asked: Sequence[Asked]) -> str:
    """A sentence on limits that no setting keeps, but for the discretisation error alone; empty if there are none."""
    kept: dict[str, list[str]] = {}
    for limit in LIMITS:
        if fastest_within(measurements, error_of, limit) or asking_within(asked, error_of, limit):
            continue
        alone = fastest_within(measurements, discretisation_max, limit)
        answer = asking_within(asked, discretisation_max, limit)
        if alone is not None:
            kept.setdefault(alone.setting.words, []).append(f"{limit:g}")
        elif answer is not None:
            kept.setdefault(_asking(answer), []).append(f"{limit:g}")
    if not kept:
        return ""
    parts = [f"within {_listed(limits, 'and')} by {setting}" for setting, limits in kept.items()]
    return f"The discretisation error alone, without the model error, is kept {'; '.join(parts)}."


def _asking(answer: Asked) -> str:
    return f"{answer.classification} with --max-error {answer.wanted:g}"


def _listed(items: list[str], last: str) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}"
