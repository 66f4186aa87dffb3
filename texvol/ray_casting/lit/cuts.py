"""Cuts of a ray inside a cell: every position at which the integrand is not smooth.

All cuts are roots of polynomials: of the value minus a control point (degree 3), of |g|² minus the square of a
threshold (6), of g·L, g·V and g·H where light, eye or highlight pass behind the surface (4), and of the difference of
squares at the edge of a contour (6).
"""

from __future__ import annotations

from math import sqrt

from texvol.ray_casting.common.bernstein import EPSILON
from texvol.ray_casting.common.cells import fill, range_of
from texvol.ray_casting.common.compiling import compiled, woven_in
from texvol.ray_casting.common.medium import segment_of
from texvol.ray_casting.lit.arrays import position_at
from texvol.ray_casting.lit.roots import add_roots
from texvol.ray_casting.lit.shading import SQUARE, added, dot, toward, unit

_OF_3, _OF_6 = (1.0, 3.0, 3.0, 1.0), (1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0)  # binomials
NOISE = 32 * EPSILON  # rounding error of a coefficient, relative to the numbers that it is computed from


def most_cuts(scene) -> int:
    """Return an upper bound for the number of cuts in a cell."""
    points = scene.medium.points.size + scene.graded.values.size
    cuts_of_contours = (3 + 6) * scene.contours.shape[0]
    return 3 * points + cuts_of_contours + 6 * scene.thresholds.size + 4 * (2 * scene.lights.rows.shape[0] + 1) + 4


@compiled
def find_cuts(scene, ray, workspace, here, length, count):
    """Write the parameters of the cuts, 1 among them, behind the first `count` cuts; return the number of all cuts."""
    cuts = workspace.cuts
    if scene.cued and ray.along > 0.0:
        for depth in (scene.cue.near, scene.cue.far):
            cut = (ray.eye + depth / ray.along - here) / length
            if 0.0 < cut < 1.0:
                cuts[count] = cut
                count += 1
    low, high = range_of(workspace.corners)
    count = _cut_at_points(scene.medium.points, low, high, workspace, count)
    for k in range(scene.graded.start.size):
        points = scene.graded.values[scene.graded.first[k] : scene.graded.first[k + 1]]
        count = _cut_at_points(points, low, high, workspace, count)
    if scene.uses_gradient:
        _square(workspace)
        for square in scene.thresholds:
            count = _cut_at_magnitude(square, workspace, count)
        for k in range(scene.contours.shape[0]):
            count = _cut_at_contour(scene, scene.contours[k], low, high, workspace, count)
    if scene.lit:
        count = _cut_at_sides(scene, ray, workspace, here, length, count)
    cuts[count] = 1.0
    return count + 1


@compiled
def _cut_at_points(points, low, high, workspace, count):
    polynomial, field = workspace.polynomial[:4], workspace.field
    point = segment_of(points, low)
    while point < points.size and points[point] < high:
        for k in range(4):
            polynomial[k] = field[0, k] - points[point]
        noise = NOISE * max(abs(low), abs(high))
        count = add_roots(polynomial, noise, workspace.root_stack, workspace.cuts, count)
        point = segment_of(points, points[point])
    return count


@compiled
def _square(workspace):
    """Write the coefficients of |g|² to `workspace.square`."""
    field, square = workspace.field, workspace.square
    fill(square, 0.0)
    for i in range(4):
        for j in range(4):
            product = field[1, i] * field[1, j] + field[2, i] * field[2, j] + field[3, i] * field[3, j]
            square[i + j] += _OF_3[i] * _OF_3[j] / _OF_6[i + j] * product


@woven_in
def _cut_at_magnitude(threshold_squared, workspace, count):
    square, polynomial = workspace.square, workspace.polynomial
    low, high = range_of(square)
    if not low < threshold_squared < high:
        return count
    for k in range(7):
        polynomial[k] = square[k] - threshold_squared
    return add_roots(polynomial, NOISE * max(abs(low), high), workspace.root_stack, workspace.cuts, count)


@compiled
def _cut_at_contour(scene, contour, low, high, workspace, count):
    """Cut at the value of a contour, and where reach² |g|² - (value - contour value)² changes its sign."""
    field, square, polynomial = workspace.field, workspace.square, workspace.polynomial
    value, reach, unit = contour[0], contour[1] * scene.gradient_factor, scene.gradient_factor
    count = _cut_at_points(contour[:1], low, high, workspace, count)
    largest = 0.0
    for k in range(7):
        polynomial[k] = reach * reach * square[k]
        largest = max(largest, abs(polynomial[k]))
    for i in range(4):
        for j in range(4):
            product = unit * (field[0, i] - value) * (unit * (field[0, j] - value))
            polynomial[i + j] -= _OF_3[i] * _OF_3[j] / _OF_6[i + j] * product
            largest = max(largest, abs(product))
    return add_roots(polynomial, NOISE * largest, workspace.root_stack, workspace.cuts, count)


@compiled
def _cut_at_sides(scene, ray, workspace, here, length, count):
    """Cut where the surface is seen edge-on, or lit edge-on."""
    largest = sqrt(max(range_of(workspace.square)[1], 0.0))
    lights = scene.lights
    if lights.two_sided:
        count = _cut_across(ray.toward_eye, ray.toward_eye, largest, workspace, count)
    for light in range(lights.rows.shape[0]):
        at_entry = toward(lights, light, ray.toward_eye, position_at(ray, here))
        at_leave = toward(lights, light, ray.toward_eye, position_at(ray, here + length))
        count = _cut_across(at_entry, at_leave, largest, workspace, count)
        if not lights.two_sided and lights.specular > 0.0:
            # Edge of the highlight; H of a point light is not quite linear along the ray, so this cut is approximate.
            at_entry = added(unit(at_entry), ray.toward_eye)
            at_leave = added(unit(at_leave), ray.toward_eye)
            count = _cut_across(at_entry, at_leave, largest, workspace, count)
    return count


@compiled
def _cut_across(at_entry, at_leave, largest, workspace, count):
    """Cut where the gradient, at most `largest`, is perpendicular to a vector linear from `at_entry` to `at_leave`."""
    field, polynomial = workspace.field, workspace.polynomial[:5]
    length = sqrt(max(dot(at_entry, at_entry), dot(at_leave, at_leave)))
    for k in range(5):
        polynomial[k] = 0.0
    for k in range(4):
        gradient = field[1, k], field[2, k], field[3, k]
        polynomial[k] += (4 - k) / 4 * dot(gradient, at_entry)
        polynomial[k + 1] += (k + 1) / 4 * dot(gradient, at_leave)
    return add_roots(polynomial, SQUARE * largest * length, workspace.root_stack, workspace.cuts, count)


@compiled
def sort_cuts(cuts, count):
    """Sort the first `count` cuts by insertion, as they are few."""
    for k in range(1, count):
        cut, position = cuts[k], k
        while position > 0 and cuts[position - 1] > cut:
            cuts[position] = cuts[position - 1]
            position -= 1
        cuts[position] = cut
