"""Integral over an interval of a ray in which emission and extinction are smooth, but no polynomials.

Both are evaluated at Gauss-Legendre nodes. The polynomial through the extinctions gives the optical depth at each node
and of the interval (collocation); Σ w q exp(-depth) is the light. The interval is halved until it agrees with its two
halves.

Most intervals need no halves. Let c_n be the Legendre coefficients of the whole's τ and q, times the length. Where all
is analytic they fall like r^n with r^5 = max(c6, c7) / max(c1, c2), and are known at the nodes for n < 8. The whole is
then off by less than c12 = c7 r^5, as the quadrature is exact up to c15, and by less than c7 of the optical depth at
the nodes times what of q exp(-depth) is not orthogonal to it: c7, and the D^7 / 17297280 of exp(-D t). If these are
under a thousandth of the agreement, the whole holds.
"""

from __future__ import annotations

from math import exp

import numpy as np

from texvol.ray_casting.common.bernstein import value_at
from texvol.ray_casting.common.cells import fill
from texvol.ray_casting.common.compiling import ZERO, compiled, inlined, woven_in
from texvol.ray_casting.common.lanes import (
    choice,
    greatest,
    greatest_of,
    lane,
    loaded,
    magnitude,
    root,
    shifted,
    spread,
    store,
    sum_of,
    transmitted,
)
from texvol.ray_casting.common.medium import OPAQUE_DEPTH, cued
from texvol.ray_casting.lit.arrays import INTERVAL, MOST_LEVELS, NODE_COUNT, position_at
from texvol.ray_casting.lit.shading import FACING, TINY, cue_at, dot, lit, medium_at, panels_at, scaled

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(NODE_COUNT)
NODES, WEIGHTS = (1 + _POINTS) / 2, _WEIGHTS / 2  # over 0 … 1
_BASIS = [np.polynomial.legendre.Legendre.basis(n) for n in range(NODE_COUNT)]
# Legendre coefficients of the polynomial through the values at the nodes: column n has the weights for number n.
LEGENDRE = np.stack([(2 * n + 1) * WEIGHTS * each(_POINTS) for n, each in enumerate(_BASIS)], axis=1)
# Column i: weights of the values at the nodes in the integral from 0 to node i of the polynomial through them.
TO_NODES = LEGENDRE @ np.stack([each.integ(lbnd=-1)(_POINTS) / 2 for each in _BASIS])
SEVENTH_OF_EXPONENTIAL = 1 / 17297280  # Legendre coefficient 7 of exp(-D t), over D^7
SHALLOW = 2.0  # optical depth up to which exp(-depth) itself adds nothing at 16 nodes: D^16 / 16! / 2^31
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
    seen = exp(-depth)
    reached, high_of_depth, falling = _spectrum(glows[3], length)
    if reached > SHALLOW:
        return False
    exponential = SEVENTH_OF_EXPONENTIAL * reached**7
    if seen * high_of_depth * (falling + exponential) > CERTAIN:
        return False
    for channel in range(3):
        mean, high, falling = _spectrum(glows[channel], length)
        if seen * (high * falling + high_of_depth * (high + mean * exponential)) > CERTAIN:
            return False
    return True


@woven_in
def _spectrum(values, length):
    """Return Legendre coefficient 0, the largest of 6 and 7, and that over the largest of 1 and 2, at most 1.

    The coefficients are those of `values` at the nodes, times the length.
    """
    coefficients = spread(0.0)
    for node in range(NODE_COUNT):
        coefficients += loaded(LEGENDRE[node]) * values[node]
    sizes = length * magnitude(coefficients)
    low, high = max(lane(sizes, 1), lane(sizes, 2)), max(lane(sizes, 6), lane(sizes, 7))
    return lane(sizes, 0), high, min(high / low, 1.0) if low > 0.0 else 1.0


@inlined
def collocate(scene, ray, workspace, start, width, here, length, result):
    """Write optical depth and light (3) of an interval to `result`; return the normal's turn, see WIDEST_TURN."""
    for channel in range(4):
        fill(workspace.intervals.glows[channel], 0.0)
    turn = add_glows(scene, ray, workspace, start, width, here, length)
    integrate(workspace.intervals.glows, width * length, result)
    return turn


@inlined
def add_glows(scene, ray, workspace, start, width, here, length):
    """Add lit emission and extinction to `workspace.intervals`; return the normal's turn, see WIDEST_TURN."""
    t = start + width * loaded(NODES)
    value, gradient, m = fields_at(workspace, t)
    red, green, blue, extinction = medium_at(scene, workspace.chosen, value, m)
    side = float(workspace.chosen[FACING])
    red, green, blue = shown(scene, ray, (red, green, blue), extinction, gradient, m, side, here + t * length)
    weight = spread(1.0)
    if scene.masked:
        weight = value_at(workspace.weight, t)
    glows = workspace.intervals.glows
    store(loaded(glows[0]) + weight * red, glows[0])
    store(loaded(glows[1]) + weight * green, glows[1])
    store(loaded(glows[2]) + weight * blue, glows[2])
    store(loaded(glows[3]) + weight * extinction, glows[3])
    if not scene.lit or not scene.lights.specular > 0.0:
        return 0.0
    return 2 * scene.lights.shininess * _turn(gradient, m)


@woven_in
def _turn(gradient, m):
    """Return 1 - cos θ of the largest angle θ between the normals at two neighbouring nodes."""
    x, y, z = scaled(gradient, 1.0 / greatest(m, TINY))
    turn = 1 - dot((x, y, z), (shifted(x), shifted(y), shifted(z)))
    return greatest_of(choice(greatest(m, shifted(m)) > 0.0, turn, 0.0))


@compiled
def integrate(glows, length, result):
    """Write optical depth and light (3) of an interval to `result`, from emission and extinction at its nodes."""
    depth = spread(0.0)
    for node in range(NODE_COUNT):
        depth += loaded(TO_NODES[node]) * (length * glows[3, node])
    weights = length * loaded(WEIGHTS)
    seen = weights * transmitted(depth)
    result[0] = sum_of(weights * loaded(glows[3]))
    for channel in range(3):
        result[1 + channel] = sum_of(seen * loaded(glows[channel]))


@woven_in
def fields_at(workspace, t):
    """Return value, gradient and the gradient's magnitude at parameter t of a cell."""
    field = workspace.field
    gradient = value_at(field[1], t), value_at(field[2], t), value_at(field[3], t)
    return value_at(field[0], t), gradient, root(dot(gradient, gradient))


@inlined
def shown(scene, ray, color, extinction, gradient, m, side, s):
    """Return the emission at s of the ray, lit and cued; the straight colour where the extinction is 1.

    All are lanes, but for `side`, on which all of them lie.
    """
    if scene.lit:
        x, y, z = ray.toward_eye
        toward_eye = spread(x), spread(y), spread(z)
        position, panels = position_at(ray, s), panels_at(scene.lights, ray, s)
        color = lit(scene.lights, color, extinction, gradient, m, spread(side), toward_eye, position, panels)
    if scene.cued:
        color = cued(scene.cue, color, extinction, cue_at(scene.cue, (s - ray.eye) * ray.along))
    return color
