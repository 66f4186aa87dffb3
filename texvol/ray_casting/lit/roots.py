"""Roots between 0 and 1 of polynomials in Bernstein form, at which they change sign.

The number of roots is at most the number of sign changes of the coefficients, and differs from it by an even number
(Descartes). A polynomial is halved (de Casteljau) until one sign change is left; Newton's method finds the root there.
"""

from __future__ import annotations

from math import nan

from texvol.ray_casting.common.bernstein import EPSILON
from texvol.ray_casting.common.compiling import compiled, woven_in

HIGHEST_DEGREE = 6
START, WIDTH = HIGHEST_DEGREE + 1, HIGHEST_DEGREE + 2  # indices of an interval in a row of the stack
ROW = HIGHEST_DEGREE + 3
NARROWEST = 2.0**-30  # roots nearer to each other count as one
STACK_ROWS = 34  # one for each halving down to the narrowest, and the two halves of the last


@compiled
def add_roots(polynomial, noise, stack, cuts, count):
    """Write the roots of a polynomial behind the first `count` cuts; return the number of all cuts.

    Coefficients of at most `noise` count as 0, so that a polynomial that is 0 before rounding has no roots.
    """
    degree = polynomial.size - 1
    if sign_changes(polynomial, degree, noise) == 0:
        return count
    most = count + degree
    for k in range(degree + 1):
        stack[0, k] = polynomial[k]
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
    """Return the number of sign changes between neighbouring coefficients, those of at most `noise` left out."""
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
    """Write the first half of a polynomial to `first`, and its second half to `row` itself."""
    half = row[WIDTH] / 2
    first[START], first[WIDTH] = row[START], half
    row[START], row[WIDTH] = row[START] + half, half
    for k in range(degree + 1):
        first[k] = row[0]
        for j in range(degree - k):
            row[j] = (row[j] + row[j + 1]) / 2
    # The row now holds the last coefficients of each step: the second half.


@compiled
def _value_and_slope(row, degree, t):
    """Return value and derivative of a row's polynomial at t, by Horner's rule with powers of 1 - t factored out."""
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
    """Return the root of a polynomial whose coefficients change sign once, by Newton's method in a bracket."""
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
