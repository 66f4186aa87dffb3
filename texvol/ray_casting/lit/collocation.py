"""Integral over an interval of a ray in which emission and extinction are smooth, but no polynomials.

Both are evaluated at Gauss-Legendre nodes. The polynomial through the extinctions gives the optical depth at each node
and of the interval (collocation); Σ w q exp(-depth) is the light. The interval is halved until it agrees with its two
halves.

Most intervals need no halves. Let c_n be the Legendre coefficients of the whole's τ and q, times the length. Where all
is analytic they fall like r^n with r² = max(c3, c4) / max(c1, c2), and are known at the nodes for n < 5. The whole is
then off by less than c8 = c4 r^4, as the quadrature is exact up to c9, and by c5 = c4 r of the optical depth at the
nodes times what of q exp(-depth) is not orthogonal to it: c4, and the D^4 / 1680 of exp(-D t). If these are under a
thousandth of the agreement, the whole holds.
"""

from __future__ import annotations

from math import exp, sqrt

import numpy as np

from texvol.ray_casting.common.bernstein import value_at
from texvol.ray_casting.common.cells import fill
from texvol.ray_casting.common.compiling import ZERO, compiled, inlined, woven_in
from texvol.ray_casting.common.medium import OPAQUE_DEPTH, cued
from texvol.ray_casting.lit.arrays import INTERVAL, MOST_LEVELS, NODE_COUNT, position_at
from texvol.ray_casting.lit.shading import FACING, NO_PANEL, cue_at, dot, lit, medium_at, panel_at

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(NODE_COUNT)
NODES, WEIGHTS = (1 + _POINTS) / 2, _WEIGHTS / 2  # over 0 … 1
# Row i: weights of the values at the nodes in the integral from 0 to node i of the polynomial through them.
_POWERS = np.arange(NODE_COUNT)
TO_NODES = (NODES[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ np.linalg.inv(NODES[:, None] ** _POWERS)
# Legendre coefficients of the polynomial through the values at the nodes: row n has the weights for number n.
LEGENDRE = np.array(
    [(2 * n + 1) * _WEIGHTS / 2 * np.polynomial.legendre.Legendre.basis(n)(_POINTS) for n in range(NODE_COUNT)]
)
FOURTH_OF_EXPONENTIAL = 1 / 1680  # Legendre coefficient 4 of exp(-D t), over D^4
SHALLOW = 0.5  # optical depth up to which exp(-depth) itself adds nothing at ten nodes: D^10 / 10! / 2^19
AGREEMENT = 1e-10  # of the picture; the halves are more exact than the whole, at a kink by a factor of 4
MOST_HALVINGS = 20  # until the halves agree: a kink or jump that no cut marks is found to a millionth
MOST_TURNS = 10  # halvings until no highlight is missed
DEEP = 4.0  # optical depth of an interval whose front may lie between the nodes
# A highlight falls to e^(-p θ²/2) at the angle θ from its middle: 2 p (1 - cos θ) is the square of the distance of two
# nodes in widths 1/√p of the highlight. At two widths, no highlight is missed.
WIDEST_TURN = 4.0
CERTAIN = AGREEMENT / 1000  # bound of the error at which the whole is not halved


@woven_in
def add_interval(collocate, analytic, scene, ray, workspace, start, end, here, length, depth, light):
    """Add the part from `start` to `end` of a cell whose fields are in `workspace`; return the optical depth behind it.

    `here` is the s at which the ray enters the cell, and `length` the distance to where it leaves. `collocate` is the
    function of that name, or another with its parameters. `analytic` is True if no kink is left inside of parts.
    """
    stack, halves = workspace.intervals.stack, workspace.intervals.halves
    first, second = halves[0], halves[1]
    top, whole = 0, end - start
    stack[0, 0], stack[0, 1] = start, -1  # the whole is not yet integrated
    while top >= 0 and depth < OPAQUE_DEPTH:
        start, level = stack[top, 0], int(stack[top, 1])
        half = whole * 0.5 ** (level + 1)
        turn = 0.0
        # A loop, so that there is one call of `collocate`, which is compiled in here with all that it calls.
        for k in range(2 if level >= 0 else 1):
            turn = max(turn, collocate(scene, ray, workspace, start + k * half, half, here, length, halves[k]))
        if level < 0:
            if analytic and turn <= WIDEST_TURN and is_certain(workspace.intervals.glows, whole * length, depth):
                for channel in range(3):
                    light[channel] += exp(-depth) * first[1 + channel]
                return depth + max(first[0], 0.0)
            _put(stack[0], start, ZERO, first)
            continue
        seen, through = exp(-depth), exp(-first[0])
        reached = first[0] + second[0]
        off, brightest = abs(reached - stack[top, 2]), 1.0
        for channel in range(1, 4):
            sum_of_halves = first[channel] + through * second[channel]
            off = max(off, abs(sum_of_halves - stack[top, 2 + channel]))
            brightest = max(brightest, sum_of_halves)
        narrower = level < MOST_HALVINGS and seen * off > AGREEMENT * brightest
        narrower = narrower or (level < MOST_LEVELS and reached > DEEP) or (level < MOST_TURNS and turn > WIDEST_TURN)
        if narrower:
            _put(stack[top], start + half, level + 1, second)
            top += 1
            _put(stack[top], start, level + 1, first)
        else:
            for channel in range(3):
                light[channel] += seen * (first[1 + channel] + through * second[1 + channel])
            depth += max(reached, 0.0)
            top -= 1
    return depth


@compiled
def _put(row, start, level, result):
    """Write an interval to a row of the stack."""
    row[0], row[1] = start, level
    for k in range(INTERVAL):
        row[2 + k] = result[k]


@compiled
def is_certain(glows, length, depth):
    """Return True if an interval behind `depth`, by its emission and extinction at the nodes, needs no halves."""
    reached, seen = 0.0, exp(-depth)
    for node in range(NODE_COUNT):
        reached += length * WEIGHTS[node] * glows[node, 3]
    if reached > SHALLOW:
        return False
    exponential = FOURTH_OF_EXPONENTIAL * reached**4
    high_depth, low_depth = _high_and_low(glows[:, 3], length)
    fall = min(high_depth / low_depth, 1.0) if low_depth > 0.0 else 1.0
    left_of_depth = high_depth * sqrt(fall)
    if seen * (high_depth * fall**2 + left_of_depth * exponential) > CERTAIN:
        return False
    for channel in range(3):
        high, low = _high_and_low(glows[:, channel], length)
        fall = min(high / low, 1.0) if low > 0.0 else 1.0
        mean = 0.0
        for node in range(NODE_COUNT):
            mean += length * WEIGHTS[node] * abs(glows[node, channel])
        if seen * (high * fall**2 + left_of_depth * (high + mean * exponential)) > CERTAIN:
            return False
    return True


@compiled
def _high_and_low(values, length):
    """Return the largest of Legendre coefficients 3 and 4, and of 1 and 2, times the length."""
    high = low = 0.0
    for n in range(1, NODE_COUNT):
        coefficient = 0.0
        for node in range(NODE_COUNT):
            coefficient += LEGENDRE[n, node] * values[node]
        if n < NODE_COUNT - 2:
            low = max(low, length * abs(coefficient))
        else:
            high = max(high, length * abs(coefficient))
    return high, low


@inlined
def collocate(scene, ray, workspace, start, width, here, length, result):
    """Write optical depth and light (3) of an interval to `result`; return the normal's turn, see WIDEST_TURN."""
    for node in range(NODE_COUNT):
        fill(workspace.intervals.glows[node], 0.0)
    turn = add_glows(scene, ray, workspace, start, width, here, length)
    integrate(workspace.intervals.glows, width * length, result)
    return turn


@inlined
def add_glows(scene, ray, workspace, start, width, here, length):
    """Add lit emission and extinction to `workspace.intervals`; return the normal's turn, see WIDEST_TURN."""
    glows = workspace.intervals.glows
    turn, before = 0.0, (0.0, 0.0, 0.0)
    for node in range(NODE_COUNT):
        t = start + width * NODES[node]
        s = here + t * length
        glow, gradient, m = glow_at(scene, ray, workspace, t, s)
        weight = value_at(workspace.weight, t) if scene.masked else 1.0
        for channel in range(4):
            glows[node, channel] += weight * glow[channel]
        if scene.lit and m > 0.0:
            normal = gradient[0] / m, gradient[1] / m, gradient[2] / m
            if before != (0.0, 0.0, 0.0):
                turn = max(turn, 1 - dot(normal, before))
            before = normal
    return 2 * scene.lights.shininess * turn if scene.lights.specular > 0.0 else 0.0


@compiled
def integrate(glows, length, result):
    """Write optical depth and light (3) of an interval to `result`, from emission and extinction at its nodes."""
    fill(result, 0.0)
    for node in range(NODE_COUNT):
        result[0] += length * WEIGHTS[node] * glows[node, 3]
        depth = 0.0
        for other in range(NODE_COUNT):
            depth += TO_NODES[node, other] * glows[other, 3]
        seen = length * WEIGHTS[node] * exp(-length * depth)
        for channel in range(3):
            result[1 + channel] += seen * glows[node, channel]


@woven_in
def glow_at(scene, ray, workspace, t, s):
    """Return lit emission (3) and extinction at parameter t of a cell, the gradient there and its magnitude."""
    value, gradient, m = fields_at(workspace, t)
    red, green, blue, extinction = medium_at(scene, workspace.chosen, value, m)
    color = shown(scene, ray, (red, green, blue), extinction, gradient, m, workspace.chosen[FACING], s)
    return (color[0], color[1], color[2], extinction), gradient, m


@woven_in
def fields_at(workspace, t):
    """Return value, gradient and the gradient's magnitude at parameter t of a cell."""
    field = workspace.field
    gradient = value_at(field[1], t), value_at(field[2], t), value_at(field[3], t)
    return value_at(field[0], t), gradient, sqrt(dot(gradient, gradient))


@inlined
def shown(scene, ray, color, extinction, gradient, m, side, s):
    """Return the emission at s of the ray, lit and cued; the straight colour if the extinction is 1."""
    if scene.lit:
        position = position_at(ray, s)
        panel = panel_at(scene.lights, ray, s) if scene.lights.column >= 0 else NO_PANEL
        color = lit(scene.lights, color, extinction, gradient, m, side, ray.toward_eye, position, panel)
    if scene.cued:
        color = cued(scene.cue, color, extinction, cue_at(scene.cue, (s - ray.eye) * ray.along))
    return color
