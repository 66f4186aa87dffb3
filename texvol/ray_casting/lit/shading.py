"""Emission and extinction at one position, by value and gradient, under light and depth cue.

A position has a value, a gradient g in kernel units (`arrays`) and its magnitude m = |g|. `choose` finds the segments
of the transfer function that hold there. A ray is cut wherever they change, so that `medium_at` is smooth between two
cuts. The formulas of light are those of `texvol.scene.lighting`.
"""

from __future__ import annotations

from math import isinf, sqrt

from texvol.ray_casting.common.bernstein import mix
from texvol.ray_casting.common.compiling import ZERO, inlined, woven_in
from texvol.ray_casting.common.medium import mixed_color, points_around, segment_of
from texvol.ray_casting.lit.arrays import DIRECTIONAL, HEAD

# Indices in `chosen`; a point of -1 is none. Two indices for each graded medium follow, then one for each contour.
LEFT, RIGHT, MODULATION, OPAQUE, FACING, FURTHER = 0, 1, 2, 3, 4, 5
NONE = -1
NO_PANEL = -1, 0.0  # see `panel_at`
SQUARE = 1e-12  # cosine below which a gradient is perpendicular to a direction, before rounding: on neither side


@inlined
def choose(scene, value, m, margin, chosen):
    """Return True if the medium shows a value; the segments of the transfer function that hold go to `chosen`.

    Values no farther apart than `margin` may be one value before rounding: beside a step, its right side holds.
    """
    medium, graded = scene.medium, scene.graded
    left, right = points_around(medium.points, ZERO, medium.points.size, value, margin)
    factor = 1.0
    if scene.modulation.shape[0] > 0:
        chosen[MODULATION] = segment_of(scene.modulation[:, 0], m)
        factor = _modulation(scene, chosen, m)
    if factor == 0.0 or not (_is_medium(medium, left) or _is_medium(medium, right)):
        left = NONE
    chosen[LEFT], chosen[RIGHT] = left, right
    chosen[OPAQUE] = left != NONE and (isinf(medium.extinctions[left]) or isinf(medium.extinctions[right]))
    any_medium = left != NONE
    for k in range(graded.start.size):
        first, end = graded.first[k], graded.first[k + 1]
        left = NONE
        is_in_ramp = m > graded.start[k] or (m == graded.start[k] and m == graded.full[k])
        if is_in_ramp and graded.values[first] - margin <= value <= graded.values[end - 1] + margin:
            left, right = points_around(graded.values, first, end, value, margin)
            any_medium = True
        chosen[FURTHER + 2 * k], chosen[FURTHER + 2 * k + 1] = left, right
    for k in range(scene.contours.shape[0]):
        away = abs(value - scene.contours[k, 0])
        holds = away < scene.contours[k, 1] * m or away <= margin
        chosen[FURTHER + 2 * graded.start.size + k] = holds
        any_medium = any_medium or holds
    return any_medium


@woven_in
def _is_medium(medium, point):
    color = medium.colors[point]
    return medium.extinctions[point] > 0 or (medium.glows and max(color[0], color[1], color[2]) > 0)


@woven_in
def _modulation(scene, chosen, m):
    pairs = scene.modulation
    left, right = max(chosen[MODULATION] - 1, 0), min(chosen[MODULATION], pairs.shape[0] - 1)
    return mix(pairs[left, 1], pairs[right, 1], fraction_of(pairs[left, 0], pairs[right, 0], m))


@woven_in
def fraction_of(left, right, value):
    """Return the fraction of a value between `left` and `right`, clamped to 0 … 1; 0 if the two are equal."""
    return min(max((value - left) / (right - left), 0.0), 1.0) if right > left else 0.0


@woven_in
def opaque_color(scene, chosen, value):
    """Return the straight colour of opaque points at a value."""
    medium, left, right = scene.medium, chosen[LEFT], chosen[RIGHT]
    fraction = fraction_of(medium.points[left], medium.points[right], value)
    red, green, blue = mixed_color(medium, left, right, fraction)
    shown = 0.0 if medium.emissive else 1.0
    return shown * red, shown * green, shown * blue


@inlined
def medium_at(scene, chosen, value, m):
    """Return emission (3) and extinction of the chosen segments, none of them opaque."""
    glow = _points_at(scene, chosen, value, m) if chosen[LEFT] != NONE else (0.0, 0.0, 0.0, 0.0)
    graded, contours = scene.graded, scene.contours
    for k in range(graded.start.size):
        if chosen[FURTHER + 2 * k] != NONE:
            glow = _graded_at(graded, k, chosen, value, m, glow)
    for k in range(contours.shape[0]):
        if chosen[FURTHER + 2 * graded.start.size + k]:
            contour = contours[k]
            reach = contour[1] * m
            weight = max(1 - abs(value - contour[0]) / reach, 0.0) if reach > 0 else 1.0
            glow = (
                glow[0] + weight * contour[2],
                glow[1] + weight * contour[3],
                glow[2] + weight * contour[4],
                glow[3] + weight * contour[5],
            )
    return glow


@woven_in
def _points_at(scene, chosen, value, m):
    """Return emission (3) and extinction of the chosen points, modulated by the gradient."""
    medium, left, right = scene.medium, chosen[LEFT], chosen[RIGHT]
    fraction = fraction_of(medium.points[left], medium.points[right], value)
    factor = _modulation(scene, chosen, m) if scene.modulation.shape[0] > 0 else 1.0
    extinction = factor * mix(medium.extinctions[left], medium.extinctions[right], fraction)
    weight = factor if medium.glows else extinction
    red, green, blue = mixed_color(medium, left, right, fraction)
    return weight * red, weight * green, weight * blue, extinction


@woven_in
def _graded_at(graded, k, chosen, value, m, glow):
    """Return `glow` plus emission and extinction of graded medium k."""
    left, right = chosen[FURTHER + 2 * k], chosen[FURTHER + 2 * k + 1]
    fraction = fraction_of(graded.values[left], graded.values[right], value)
    start, full = graded.start[k], graded.full[k]
    weight = fraction_of(start, full, m) if full > start else 1.0
    a, b = graded.emissions[left], graded.emissions[right]
    return (
        glow[0] + weight * mix(a[0], b[0], fraction),
        glow[1] + weight * mix(a[1], b[1], fraction),
        glow[2] + weight * mix(a[2], b[2], fraction),
        glow[3] + weight * mix(graded.extinctions[left], graded.extinctions[right], fraction),
    )


@woven_in
def facing(lights, gradient, m, toward_eye):
    """Return -1 if the normal must be turned to the side of the eye, else 1."""
    behind = dot(gradient, toward_eye) > SQUARE * m  # the normal is opposite to the gradient
    return -1 if lights.two_sided and behind else 1


@inlined
def lit(lights, color, extinction, gradient, m, side, toward_eye, position, panel):
    """Return the emission of a medium under all lights; the straight colour if the extinction is 1.

    `panel` is what `panel_at` found for the position.
    """
    bright = min(m / lights.fade, 1.0)
    w = bright * bright * (3 - 2 * bright)
    diffuse_light, shine_light = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for light in range(lights.rows.shape[0]):
        toward_light = unit(toward(lights, light, toward_eye, position))
        light_color = _color_of_light(lights, light, position, toward_light, panel)
        diffuse, specular = 1.0, 0.0
        if w > 0.0:
            cosine = -side * dot(gradient, toward_light) / m
            diffuse = (1 - w) + w * max(cosine, 0.0)
            if cosine > SQUARE and lights.specular > 0.0:
                halfway = unit(added(toward_light, toward_eye))
                highlight = -side * dot(gradient, halfway) / m
                if highlight > lights.dark:
                    specular = w * highlight**lights.shininess
        diffuse_light = added(diffuse_light, scaled(light_color, diffuse))
        shine_light = added(shine_light, scaled(light_color, specular))
    shine = lights.specular * extinction
    return (
        color[0] * (lights.ambient + lights.diffuse * diffuse_light[0]) + shine * shine_light[0],
        color[1] * (lights.ambient + lights.diffuse * diffuse_light[1]) + shine * shine_light[1],
        color[2] * (lights.ambient + lights.diffuse * diffuse_light[2]) + shine * shine_light[2],
    )


@woven_in
def _color_of_light(lights, light, position, toward_light, panel):
    """Return the colour of a light times its transmittance to a position, and what its distance leaves of it."""
    row = lights.rows[light]
    left = 1.0
    if row[8] > 0.0:
        x, y, z = row[1] - position[0], row[2] - position[1], row[3] - position[2]
        left = row[8] / (sqrt(x * x + y * y + z * z) + row[8])
    if row[7] >= 0.0:
        if lights.column >= 0:
            left *= _transmittance_along(lights, int(row[7]), panel)
        else:
            near = added(position, scaled(toward_light, lights.shadow_distance))
            left *= transmittance_at(lights, int(row[7]), near)
    return left * row[4], left * row[5], left * row[6]


@woven_in
def panel_at(lights, ray, s):
    """Return the number of the ray's panel at s, and the place in it, 0 to 1; -1 if the ray has none."""
    if ray.first_panel == ray.last_panel:
        return -1, 0.0
    panels, first, end = lights.panels, ray.first_panel, ray.last_panel
    while end - first > 1:
        middle = (first + end) // 2
        if panels[middle, 0] <= s:
            first = middle
        else:
            end = middle
    return first, fraction_of(panels[first, 0], panels[first, 1], s)


@woven_in
def _transmittance_along(lights, number, panel):
    """Return the transmittance of casting light `number` in a panel: the parabola through its three nodes."""
    if panel[0] < 0:
        return 1.0
    t, row, column = panel[1], lights.panels[panel[0]], 2 + lights.column + number
    apart = (row.size - 2) // 3
    low, middle, high = row[column], row[column + apart], row[column + 2 * apart]
    return (1 - t) * (1 - 2 * t) * low + 4 * t * (1 - t) * middle + t * (2 * t - 1) * high


@woven_in
def transmittance_at(lights, number, position):
    """Return the transmittance of casting light `number` to a position, trilinear between the nodes of the box."""
    grid = lights.transmittance[number]
    k0, k1, z = _between_nodes(lights.box_from_world[2], position, grid.shape[0])
    j0, j1, y = _between_nodes(lights.box_from_world[1], position, grid.shape[1])
    i0, i1, x = _between_nodes(lights.box_from_world[0], position, grid.shape[2])
    near = mix(mix(grid[k0, j0, i0], grid[k0, j0, i1], x), mix(grid[k0, j1, i0], grid[k0, j1, i1], x), y)
    far = mix(mix(grid[k1, j0, i0], grid[k1, j0, i1], x), mix(grid[k1, j1, i0], grid[k1, j1, i1], x), y)
    return mix(near, far, z)


@woven_in
def _between_nodes(row, position, count):
    """Return the nodes on both sides of a position along one axis, and the fraction between them, clamped."""
    fraction = row[3] + row[0] * position[0] + row[1] * position[1] + row[2] * position[2]
    index = min(max(fraction * count - 0.5, 0.0), count - 1.0)
    low = min(int(index), max(count - 2, 0))
    return low, min(low + 1, count - 1), index - low


@woven_in
def scaled(vector, factor):
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


@woven_in
def toward(lights, light, toward_eye, position):
    """Return the vector, of any length, from a position to a light."""
    row = lights.rows[light]
    if row[0] == HEAD:
        return toward_eye
    if row[0] == DIRECTIONAL:
        return row[1], row[2], row[3]
    return row[1] - position[0], row[2] - position[1], row[3] - position[2]


@woven_in
def cue_at(cue, depth):
    """Return the fraction of the cue's colour at a depth."""
    return cue.strength * min(max((depth - cue.near) / (cue.far - cue.near), 0.0), 1.0)


@woven_in
def dot(a, b):
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@woven_in
def added(a, b):
    """Return the sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@woven_in
def unit(vector):
    """Return a vector at length 1; 0 stays 0."""
    length = sqrt(dot(vector, vector))
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return vector[0] / length, vector[1] / length, vector[2] / length
