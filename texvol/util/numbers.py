"""Numbers that people give: of Python, of numpy, or text as on the command line."""

from __future__ import annotations

from typing import SupportsFloat

import numpy as np

from texvol.util.errors import InputError

AnyNumber = SupportsFloat | str  # float, int, Fraction, Decimal, numpy's, or text such as "1/255"


def number_of(text: str) -> float:
    """Return the number of a text, which may be a fraction such as 1/255.

    Raises
    ------
    ValueError
        If it is none.
    """
    above, is_fraction, below = text.partition("/")
    try:
        return float(above) / (float(below) if is_fraction else 1.0)
    except ZeroDivisionError:
        raise ValueError("division by zero") from None


def checked_number(name: str, value: AnyNumber | None) -> float | None:
    """Return a number as float, and None as it is.

    Raises
    ------
    InputError
        If it is no real number; the message begins with `name`.
    """
    if value is None or type(value) is float:
        return value
    try:
        if isinstance(value, str):
            return number_of(value)
        if isinstance(value, bool | np.bool_ | bytes) or np.ndim(value) > 0:  # type: ignore[arg-type]
            raise ValueError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} must be a number, or a fraction such as '1/255', got {value!r}") from None


def checked_count(name: str, value: int) -> int:
    """Return a whole number of at least 1.

    Raises
    ------
    InputError
        If it is none; the message begins with `name`.
    """
    whole = not isinstance(value, bool) and hasattr(value, "__index__") and np.ndim(value) == 0
    if not whole or value.__index__() < 1:
        raise InputError(f"{name} must be a whole number of at least 1, got {value!r}")
    return value.__index__()
