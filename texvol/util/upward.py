"""Numbers as text that is never less than the number: upper bounds, of which an error estimate is one."""

from __future__ import annotations

from decimal import ROUND_CEILING, Context, Decimal


def upward(number: float, digits: int = 2) -> str:
    """Return a number as text with at most `digits` digits, rounded up."""
    # Of the shortest decimal that stands for the number: 0.014 stays 0.014, though its binary is a little more.
    rounded = Context(prec=digits, rounding=ROUND_CEILING).create_decimal(Decimal(repr(float(number))))
    return f"{float(rounded):.{digits}g}"
