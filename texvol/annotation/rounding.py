"""Round numbers, which are 1, 2 or 5 times a power of ten, as exact decimals; and numbers as text.

Decimals keep 0.3 from being written as 0.30000000000000004, and keep the digits of steps of 1e-9 around 1e9.
"""

from __future__ import annotations

from decimal import Decimal

import numpy as np

MINUS = "\u2212"
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Powers of ten between which numbers are written without a factor.
_LEAST_WRITTEN, _MOST_WRITTEN = -4, 4
_GROUPED = 1e4, 1e9  # least and greatest value that is written in whole units, with its thousands set apart
_ON_THE_END = 1e-9  # of a step: a tick this far beyond an end is taken for rounding and stands on the end


def round_up(least: float) -> Decimal:
    """Return the smallest round number that is at least `least` > 0."""
    exponent = int(np.floor(np.log10(least))) - 1
    steps = (Decimal(digit).scaleb(exponent + power) for power in range(4) for digit in (1, 2, 5))
    return next(step for step in steps if float(step) >= least * (1 - _ON_THE_END))


def round_down(most: float) -> Decimal:
    """Return the largest round number that is at most `most` > 0."""
    exponent = int(np.floor(np.log10(most))) + 1
    steps = (Decimal(digit).scaleb(exponent - power) for power in range(4) for digit in (5, 2, 1))
    return next(step for step in steps if float(step) <= most * (1 + _ON_THE_END))


def multiples(low: float, high: float, step: Decimal) -> list[Decimal]:
    """Return all multiples of `step` from `low` to `high`."""
    first = int(np.ceil(low / float(step) - _ON_THE_END))
    last = int(np.floor(high / float(step) + _ON_THE_END))
    return [number * step for number in range(first, last + 1)]


def written(numbers: list[Decimal], step: Decimal | None = None) -> tuple[list[str], str]:
    """Return numbers as text with the decimals of `step`, or each with its own, and the factor that was divided out.

    The factor is "", or for large and small numbers a text such as "×10⁻⁹".
    """
    largest = max((abs(number) for number in numbers), default=Decimal(0))
    power = _power(largest)
    decimals = None if step is None else max(-int(step.normalize().scaleb(-power).as_tuple().exponent), 0)
    return [_text(number.scaleb(-power), decimals) for number in numbers], _factor(power)


def plain(number: float, digits: int = 6) -> str:
    """Return a number as text with at most `digits` digits, and with a power of ten if it is large or small."""
    if not np.isfinite(number):
        return "∞" if number > 0 else f"{MINUS}∞" if number < 0 else "?"
    decimal = Decimal(f"{number:.{digits - 1}e}").normalize()
    texts, factor = written([decimal])
    return texts[0] + factor


def grouped(number: float, digits: int) -> str:
    """Return a measured value as text: in whole units from 10,000 on, its thousands set apart, else as `plain`."""
    if _GROUPED[0] <= abs(number) < _GROUPED[1]:
        return f"{number:,.0f}".replace("-", MINUS)
    return plain(number, digits)


def length(number: Decimal, unit: str) -> str:
    """Return a round length with its unit."""
    texts, factor = written([number])
    return f"{texts[0]}{factor} {unit or 'world units'}"


def _power(largest: Decimal) -> int:
    if largest == 0 or _LEAST_WRITTEN <= largest.adjusted() <= _MOST_WRITTEN:
        return 0
    return largest.adjusted() // 3 * 3


def _text(number: Decimal, decimals: int | None) -> str:
    text = f"{number:f}" if decimals is None else f"{number:.{decimals}f}"
    if decimals is None and "." in text:
        text = text.rstrip("0").rstrip(".")
    is_zero = not text.strip("-0.")
    return text.lstrip("-") if is_zero else text.replace("-", MINUS)


def _factor(power: int) -> str:
    return f"×10{str(power).translate(_SUPERSCRIPTS)}" if power else ""
