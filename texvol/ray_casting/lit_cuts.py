"""Where a ray's path through a cell is cut: at every place where what the eye sees of it is not smooth.

All these are roots of polynomials: of value minus that of a control point (degree 3), of |g|² minus the square of a
threshold (6), of g·L, g·V and g·H where light, eye or highlight pass behind the surface (4), and of the difference of
squares at the edge of a contour (6).
"""

from __future__ import annotations

from math import sqrt

from texvol.ray_casting.bernstein import EPSILON
from texvol.ray_casting.compiling import compiled, inlined, woven_in
from texvol.ray_casting.lit_ray import position_at
from texvol.ray_casting.medium import segment_of
from texvol.ray_casting.roots import add_roots
from texvol.ray_casting.shading import SQUARE, added, dot, toward, unit

_OF_3, _OF_6 = (1.0, 3.0, 3.0, 1.0), (1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0)  # binomials
NOISE = 32 * EPSILON  # what rounding leaves of a coefficient, of those that it was made of


def most_cuts(scene) -> int:
    """How many cuts there can be in a cell."""
    points = scene.medium.points.size + scene.graded.values.size
    cuts_of_contours = (3 + 6) * scene.contours.shape[0]
    return 3 * points + cuts_of_contours + 6 * scene.thresholds.size + 4 * (2 * scene.lights.rows.shape[0] + 1) + 4


@inlined
def find_cuts(scene, ray, bench, here, length):
    """Number of cuts of a cell, their shares of the way written to `bench.cuts`, ascending; the last is 1."""
    cuts, count = bench.cuts, 0
    low, high = bench.corners.min(), bench.corners.max()
    count = _cut_at_points(scene.medium.points, 0, scene.medium.points.size, low, high, bench, count)
    for k in range(scene.graded.start.size):
        first, end = scene.graded.first[k], scene.graded.first[k + 1]
        count = _cut_at_points(scene.graded.values, first, end, low, high, bench, count)
    if scene.uses_gradient:
        _square(bench)
        for square in scene.thresholds:
            count = _cut_at_magnitude(square, bench, count)
        for contour in scene.contours:
            count = _cut_at_contour(scene, contour, low, high, bench, count)
    if scene.lit:
        count = _cut_at_sides(scene, ray, bench, here, length, count)
    if scene.cued and ray.along > 0.0:
        for depth in (scene.cue.near, scene.cue.far):
            cut = (ray.eye + depth / ray.along - here) / length
            if 0.0 < cut < 1.0:
                cuts[count] = cut
                count += 1
    cuts[count] = 1.0
    count += 1
    sort_cuts(cuts, count)
    return count


@compiled
def _cut_at_points(points, first, end, low, high, bench, count):
    polynomial, field = bench.polynomial, bench.field
    point = first + segment_of(points[first:end], low)
    while point < end and points[point] < high:
        for k in range(4):
            polynomial[k] = field[0, k] - points[point]
        noise = NOISE * max(abs(low), abs(high))
        count = add_roots(polynomial, 3, noise, bench.root_stack, bench.cuts, count)
        point = first + segment_of(points[first:end], points[point])
    return count


@woven_in
def _square(bench):
    """Coefficients of |g|² to `bench.square`."""
    field, square = bench.field, bench.square
    square[:] = 0.0
    for i in range(4):
        for j in range(4):
            product = field[1, i] * field[1, j] + field[2, i] * field[2, j] + field[3, i] * field[3, j]
            square[i + j] += _OF_3[i] * _OF_3[j] / _OF_6[i + j] * product


@woven_in
def _cut_at_magnitude(threshold_squared, bench, count):
    square, polynomial = bench.square, bench.polynomial
    low, high = square.min(), square.max()
    if not low < threshold_squared < high:
        return count
    for k in range(7):
        polynomial[k] = square[k] - threshold_squared
    return add_roots(polynomial, 6, NOISE * max(abs(low), high), bench.root_stack, bench.cuts, count)


@woven_in
def _cut_at_contour(scene, contour, low, high, bench, count):
    """At the contour's value, and where reach² |g|² - (value - contour's)² has its sign changed."""
    field, square, polynomial = bench.field, bench.square, bench.polynomial
    value, reach, unit = contour[0], contour[1] * scene.gradient_factor, scene.gradient_factor
    if low < value < high:
        for k in range(4):
            polynomial[k] = field[0, k] - value
        noise = NOISE * max(abs(low), abs(high))
        count = add_roots(polynomial, 3, noise, bench.root_stack, bench.cuts, count)
    largest = 0.0
    for k in range(7):
        polynomial[k] = reach * reach * square[k]
        largest = max(largest, abs(polynomial[k]))
    for i in range(4):
        for j in range(4):
            product = unit * (field[0, i] - value) * (unit * (field[0, j] - value))
            polynomial[i + j] -= _OF_3[i] * _OF_3[j] / _OF_6[i + j] * product
            largest = max(largest, abs(product))
    return add_roots(polynomial, 6, NOISE * largest, bench.root_stack, bench.cuts, count)


@woven_in
def _cut_at_sides(scene, ray, bench, here, length, count):
    """Where the surface is seen from the side, or lit from the side."""
    largest = sqrt(max(bench.square.max(), 0.0))
    lights = scene.lights
    if lights.two_sided:
        count = _cut_across(ray.toward_eye, ray.toward_eye, largest, bench, count)
    for light in range(lights.rows.shape[0]):
        at_entry = toward(lights, light, ray.toward_eye, position_at(ray, here))
        at_leave = toward(lights, light, ray.toward_eye, position_at(ray, here + length))
        count = _cut_across(at_entry, at_leave, largest, bench, count)
        if not lights.two_sided and lights.specular > 0.0:
            # The highlight's own edge; from a point light halfway is not quite linear, and the cut as near as that is.
            at_entry = added(unit(at_entry), ray.toward_eye)
            at_leave = added(unit(at_leave), ray.toward_eye)
            count = _cut_across(at_entry, at_leave, largest, bench, count)
    return count


@compiled
def _cut_across(at_entry, at_leave, largest, bench, count):
    """Where the gradient is square to a vector that goes linearly from one to the other; `largest` is its |g|."""
    field, polynomial = bench.field, bench.polynomial
    length = sqrt(max(dot(at_entry, at_entry), dot(at_leave, at_leave)))
    for k in range(5):
        polynomial[k] = 0.0
    for k in range(4):
        gradient = field[1, k], field[2, k], field[3, k]
        polynomial[k] += (4 - k) / 4 * dot(gradient, at_entry)
        polynomial[k + 1] += (k + 1) / 4 * dot(gradient, at_leave)
    return add_roots(polynomial, 4, SQUARE * largest * length, bench.root_stack, bench.cuts, count)


@woven_in
def sort_cuts(cuts, count):
    """By insertion: there are few."""
    for k in range(1, count):
        cut, position = cuts[k], k
        while position > 0 and cuts[position - 1] > cut:
            cuts[position] = cuts[position - 1]
            position -= 1
        cuts[position] = cut
