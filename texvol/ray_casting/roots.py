"""Where polynomials in Bernstein form change sign between 0 and 1: the places where a ray's path is cut.

A polynomial has at most as many roots as its coefficients change sign, and, counted by twos, as many (Descartes). It is
halved (de Casteljau) until one change is left; Newton in that bracket finds the root.
"""

from __future__ import annotations

from math import nan

from texvol.ray_casting.bernstein import EPSILON
from texvol.ray_casting.compiling import compiled, woven_in

HIGHEST_DEGREE = 6
START, WIDTH = HIGHEST_DEGREE + 1, HIGHEST_DEGREE + 2  # where a row of the stack keeps its interval
ROW = HIGHEST_DEGREE + 3
NARROWEST = 2.0**-30  # roots nearer to each other count as one
STACK_ROWS = 34  # one for each halving down to the narrowest, and the two halves of the last


@compiled
def add_roots(polynomial, degree, noise, stack, cuts, count):
    """Number of cuts, with the roots of the polynomial written behind the first `count`; at most `degree` of them.

    Coefficients of at most `noise` count as 0, so that a polynomial that is 0 but for rounding has no roots.
    """
    if sign_changes(polynomial, degree, noise) == 0:
        return count
    most = count + degree
    stack[0, : degree + 1] = polynomial[: degree + 1]
    stack[0, START], stack[0, WIDTH] = 0.0, 1.0
    top = 0
    while top >= 0 and count < most:
        row = stack[top]
        changes = sign_changes(row, degree, noise)
        if changes == 0:
            top -= 1
        elif changes == 1 or row[WIDTH] < NARROWEST:
            cuts[count] = row[START] + row[WIDTH] * _root(row, degree, noise)
            count, top = count + 1, top - 1
        else:
            _halve(row, stack[top + 1], degree)
            if abs(row[0]) <= noise:
                cuts[count] = row[START]
                count += 1
            top += 1
    return count


@compiled
def sign_changes(polynomial, degree, noise):
    """How often neighbouring coefficients differ in sign, those of at most `noise` left out."""
    changes, before = 0, 0.0
    for k in range(degree + 1):
        here = polynomial[k]
        if abs(here) > noise:
            if before * here < 0.0:
                changes += 1
            before = 1.0 if here > 0.0 else -1.0
    return changes


@woven_in
def _halve(row, first, degree):
    """The first half of a row into `first`; the row becomes its second half."""
    half = row[WIDTH] / 2
    first[START], first[WIDTH] = row[START], half
    row[START], row[WIDTH] = row[START] + half, half
    for k in range(degree + 1):
        first[k] = row[0]
        for j in range(degree - k):
            row[j] = (row[j] + row[j + 1]) / 2
    # What is left in the row are the last coefficients of each step: the second half.


@compiled
def _value_and_slope(row, degree, t):
    """Value and derivative of a row's polynomial at t: Horner's rule, all powers of 1 - t drawn out."""
    u, power, binomial, lower = 1 - t, 1.0, 1.0, 1.0
    value, slope = row[0], row[1] - row[0]
    for k in range(1, degree + 1):
        power *= t
        binomial *= (degree + 1 - k) / k
        value = value * u + binomial * power * row[k]
        if k < degree:
            lower *= (degree - k) / k
            slope = slope * u + lower * power * (row[k + 1] - row[k])
    return value, degree * slope


@woven_in
def _root(row, degree, noise):
    """The root of a row whose coefficients change sign once: Newton, in a bracket that shrinks."""
    rising = False
    for k in range(degree + 1):
        if abs(row[k]) > noise:
            rising = row[k] < 0.0
            break
    start, end, t = 0.0, 1.0, 0.5
    while start < t < end:
        value, slope = _value_and_slope(row, degree, t)
        if value == 0.0:
            return t
        if (value < 0.0) == rising:
            start = t
        else:
            end = t
        step = t - value / slope if slope != 0.0 else nan
        if abs(step - t) <= EPSILON:
            return step if start <= step <= end else t
        t = step if start < step < end else (start + end) / 2
    return t
