"""The integral over a stretch of a ray in which emission and extinction are smooth, but no polynomials.

Both are taken at Gauss-Legendre nodes. The polynomial through the extinctions gives the depth at each node and of the
whole (collocation); Σ w q exp(-depth) is the light. The stretch is halved until it agrees with its two halves.
"""

from __future__ import annotations

from math import exp, sqrt

import numpy as np

from texvol.ray_casting.bernstein import value_at
from texvol.ray_casting.compiling import compiled, inlined, woven_in
from texvol.ray_casting.lit_ray import MOST_LEVELS, NODE_COUNT, position_at
from texvol.ray_casting.medium import OPAQUE_DEPTH
from texvol.ray_casting.shading import FACING, cue_at, cued, dot, lit, medium_at

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(NODE_COUNT)
NODES, WEIGHTS = (1 + _POINTS) / 2, _WEIGHTS / 2  # over 0 … 1
# Row i: weights of the values at the nodes in the integral from 0 to node i of the polynomial through them.
_POWERS = np.arange(NODE_COUNT)
TO_NODES = (NODES[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ np.linalg.inv(NODES[:, None] ** _POWERS)
AGREEMENT = 1e-10  # of the picture; the halves are better than what they are compared with, by 4 where there is a kink
MOST_HALVINGS = 20  # for the sake of agreement: a kink or jump that nothing announced is found to a millionth
MOST_TURNS = 10  # halvings for the sake of highlights
DEEP = 4.0  # optical depth of a stretch whose front could be missed
# A highlight falls to e^(-p θ²/2) at the angle θ from its middle: 2 p (1 - cos θ) says how far nodes are apart in its
# widths 1/√p, squared. At two widths none is missed.
WIDEST_TURN = 4.0


@woven_in
def add_interval(collocate, scene, ray, bench, start, end, here, length, depth, light):
    """Optical depth behind the part from `start` to `end` of a cell of which `bench` holds the fields.

    `here` is where the ray enters the cell and `length` its way through that; the light is added to `light`.
    `collocate` is the function of that name, or one of its kind.
    """
    stack, first, second = bench.stack, bench.halves[0], bench.halves[1]
    top, whole = 0, end - start
    stack[0, 0], stack[0, 1] = start, -1  # of the whole nothing is known yet
    while top >= 0 and depth < OPAQUE_DEPTH:
        start, level = stack[top, 0], int(stack[top, 1])
        half = whole * 0.5 ** (level + 1)
        turn = 0.0
        for k in range(2 if level >= 0 else 1):  # one call: it is put in here, with all that it calls
            turn = max(turn, collocate(scene, ray, bench, start + k * half, half, here, length, bench.halves[k]))
        if level < 0:
            stack[0, 1], stack[0, 2:] = 0, first
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
            stack[top, 0], stack[top, 1], stack[top, 2:] = start + half, level + 1, second
            top += 1
            stack[top, 0], stack[top, 1], stack[top, 2:] = start, level + 1, first
        else:
            for channel in range(3):
                light[channel] += seen * (first[1 + channel] + through * second[1 + channel])
            depth += max(reached, 0.0)
            top -= 1
    return depth


@inlined
def collocate(scene, ray, bench, start, width, here, length, result):
    """Depth and light (3) of a stretch into `result`; how far the normal turns from node to node, see WIDEST_TURN."""
    bench.glows[:] = 0.0
    turn = add_glows(scene, ray, bench, start, width, here, length)
    integrate(bench.glows, width * length, result)
    return turn


@woven_in
def add_glows(scene, ray, bench, start, width, here, length):
    """Emission and extinction, as the eye sees them, are added to those at the nodes; how far the normal turns."""
    glows = bench.glows
    turn, before = 0.0, (0.0, 0.0, 0.0)
    for node in range(NODE_COUNT):
        t = start + width * NODES[node]
        s = here + t * length
        glow, gradient, m = glow_at(scene, ray, bench, t, s)
        weight = value_at(bench.weight, t) if scene.masked else 1.0
        for channel in range(4):
            glows[node, channel] += weight * glow[channel]
        if scene.lit and m > 0.0:
            normal = gradient[0] / m, gradient[1] / m, gradient[2] / m
            if before != (0.0, 0.0, 0.0):
                turn = max(turn, 1 - dot(normal, before))
            before = normal
    return 2 * scene.lights.shininess * turn if scene.lights.specular > 0.0 else 0.0


@compiled
def integrate(glows, direction, result):
    """Depth and light (3) of a stretch `way` long, of which the glows are those at the nodes, into `result`."""
    result[:] = 0.0
    for node in range(NODE_COUNT):
        result[0] += direction * WEIGHTS[node] * glows[node, 3]
        depth = 0.0
        for other in range(NODE_COUNT):
            depth += TO_NODES[node, other] * glows[other, 3]
        seen = direction * WEIGHTS[node] * exp(-direction * depth)
        for channel in range(3):
            result[1 + channel] += seen * glows[node, channel]


@woven_in
def glow_at(scene, ray, bench, t, s):
    """Emission (3) and extinction as the eye sees them `t` of the way through a cell, the gradient there and |g|."""
    value, gradient, m = fields_at(bench, t)
    red, green, blue, extinction = medium_at(scene, bench.chosen, value, m)
    color = shown(scene, ray, (red, green, blue), extinction, gradient, m, bench.chosen[FACING], s)
    return (color[0], color[1], color[2], extinction), gradient, m


@woven_in
def fields_at(bench, t):
    """Value, gradient and its magnitude `t` of the way through a cell."""
    field = bench.field
    gradient = value_at(field[1], t), value_at(field[2], t), value_at(field[3], t)
    return value_at(field[0], t), gradient, sqrt(dot(gradient, gradient))


@woven_in
def shown(scene, ray, color, extinction, gradient, m, side, s):
    """Emission, lit and cued, of a place at s of the ray; with τ = 1, straight colour."""
    if scene.lit:
        position = position_at(ray, s)
        color = lit(scene.lights, color, extinction, gradient, m, side, ray.toward_eye, position)
    if scene.cued:
        color = cued(scene.cue, color, extinction, cue_at(scene.cue, (s - ray.eye) * ray.along))
    return color
