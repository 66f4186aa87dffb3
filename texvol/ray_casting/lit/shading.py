"""Emission and extinction at one position, by value and gradient, under light and depth cue.

A position has a value, a gradient g in kernel units (`arrays`) and its magnitude m = |g|. `choose` finds the segments
of the transfer function that hold there. A ray is cut wherever they change, so that `medium_at` is smooth between two
cuts; it takes one position, or those of lanes in which the same segments hold. `lit` takes lanes. The formulas of light
are those of `texvol.scene.lighting`.
"""

from __future__ import annotations

from math import isinf

from texvol.ray_casting.common.bernstein import mix
from texvol.ray_casting.common.compiling import ZERO, compiled, inlined, woven_in
from texvol.ray_casting.common.lanes import (
    LANES,
    any_of,
    choice,
    greatest,
    lane,
    least,
    like,
    magnitude,
    power,
    root,
    spread,
    with_lane,
)
from texvol.ray_casting.common.medium import mixed_color, points_around, segment_of
from texvol.ray_casting.lit.arrays import DIRECTIONAL, HEAD

# Indices in `chosen`; a point of -1 is none. Two indices for each graded medium follow, then one for each contour.
LEFT, RIGHT, MODULATION, OPAQUE, FACING, FURTHER = 0, 1, 2, 3, 4, 5
NONE = -1
TINY = 1e-300  # in place of 0 where 0 is divided by it
MOST_SQUARED = 1024.0  # exponent of a highlight up to which squares lose no more than 12 bits
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
    differ = right > left
    return least(greatest(choice(differ, value - left, 0.0) / (right - left if differ else 1.0), 0.0), 1.0)


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
    nothing = like(value, 0.0)
    glow = nothing, nothing, nothing, nothing
    if chosen[LEFT] != NONE:
        glow = _points_at(scene, chosen, value, m)
    graded, contours = scene.graded, scene.contours
    for k in range(graded.start.size):
        if chosen[FURTHER + 2 * k] != NONE:
            glow = _graded_at(graded, k, chosen, value, m, glow)
    for k in range(contours.shape[0]):
        if chosen[FURTHER + 2 * graded.start.size + k]:
            contour = contours[k]
            reach = contour[1] * m
            beside = greatest(1 - magnitude(value - contour[0]) / greatest(reach, TINY), 0.0)
            weight = choice(reach > 0.0, beside, 1.0)
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
    extinction = mix(medium.extinctions[left], medium.extinctions[right], fraction)
    factor = like(value, 1.0)
    if scene.modulation.shape[0] > 0:
        factor = _modulation(scene, chosen, m)
        extinction = factor * extinction
    weight = choice(medium.glows, factor, extinction)
    red, green, blue = mixed_color(medium, left, right, fraction)
    return weight * red, weight * green, weight * blue, extinction


@woven_in
def _graded_at(graded, k, chosen, value, m, glow):
    """Return `glow` plus emission and extinction of graded medium k."""
    left, right = chosen[FURTHER + 2 * k], chosen[FURTHER + 2 * k + 1]
    fraction = fraction_of(graded.values[left], graded.values[right], value)
    start, full = graded.start[k], graded.full[k]
    weight = choice(full > start, fraction_of(start, full, m), 1.0)
    a, b = graded.emissions[left], graded.emissions[right]
    return (
        glow[0] + weight * mix(a[0], b[0], fraction),
        glow[1] + weight * mix(a[1], b[1], fraction),
        glow[2] + weight * mix(a[2], b[2], fraction),
        glow[3] + weight * mix(graded.extinctions[left], graded.extinctions[right], fraction),
    )


@woven_in
def facing(lights, gradient, m, toward_eye):
    """Return -1 where the normal must be turned to the side of the eye, else 1."""
    behind = dot(gradient, toward_eye) > SQUARE * m  # the normal is opposite to the gradient
    return choice(behind, -1.0 if lights.two_sided else 1.0, 1.0)


@inlined
def lit(lights, color, extinction, gradient, m, side, toward_eye, position, panels):
    """Return the emission of a medium under all lights; the straight colour where the extinction is 1.

    All are lanes. `panels` is what `panels_at` found for the positions.
    """
    bright = least(m / lights.fade, 1.0)
    w = bright * bright * (3 - 2 * bright)
    outward = (0.0 - side) / greatest(m, TINY)
    normal = scaled(gradient, outward)
    nothing = spread(0.0)
    diffuse_light, shine_light = (nothing, nothing, nothing), (nothing, nothing, nothing)
    for light in range(lights.rows.shape[0]):
        toward_light, halfway = directions(lights, light, toward_eye, position)
        light_color = _color_of_light(lights, light, position, toward_light, panels)
        cosine = dot(normal, toward_light)
        diffuse_light = added(diffuse_light, scaled(light_color, (1 - w) + w * greatest(cosine, 0.0)))
        if lights.specular > 0.0:
            highlight = dot(normal, halfway)
            shines = (cosine > SQUARE) & (highlight > lights.dark)
            if any_of(shines):
                specular = choice(shines, w * raised(greatest(highlight, 0.0), lights.shininess), 0.0)
                shine_light = added(shine_light, scaled(light_color, specular))
    shine = lights.specular * extinction
    return (
        color[0] * (lights.ambient + lights.diffuse * diffuse_light[0]) + shine * shine_light[0],
        color[1] * (lights.ambient + lights.diffuse * diffuse_light[1]) + shine * shine_light[1],
        color[2] * (lights.ambient + lights.diffuse * diffuse_light[2]) + shine * shine_light[2],
    )


@woven_in
def directions(lights, light, toward_eye, position):
    """Return the unit vectors to a light, and halfway between it and the eye, of lanes."""
    row = lights.rows[light]
    if row[0] == HEAD:
        return toward_eye, toward_eye
    toward_light = spread(row[1]), spread(row[2]), spread(row[3])
    if row[0] != DIRECTIONAL:
        toward_light = unit((row[1] - position[0], row[2] - position[1], row[3] - position[2]))
    return toward_light, unit(added(toward_light, toward_eye))


@compiled
def raised(base, exponent):
    """Return a power of lanes that are not negative, by squares if the exponent is a small whole number."""
    left = int(exponent)
    if exponent > MOST_SQUARED or left != exponent:
        return power(base, exponent)
    result = spread(1.0)
    while left > 0:
        if left & 1:
            result = result * base
        base = base * base
        left >>= 1
    return result


@woven_in
def _color_of_light(lights, light, position, toward_light, panels):
    """Return the colour of a light times its transmittance to positions, and what its distance leaves of it."""
    row = lights.rows[light]
    left = spread(1.0)
    if row[8] > 0.0:
        to_light = row[1] - position[0], row[2] - position[1], row[3] - position[2]
        left = row[8] / (root(dot(to_light, to_light)) + row[8])
    if row[7] >= 0.0:
        left *= _transmittances(lights, int(row[7]), position, toward_light, panels)
    return left * row[4], left * row[5], left * row[6]


@compiled
def _transmittances(lights, number, position, toward_light, panels):
    """Return the transmittance of casting light `number` to positions."""
    found = spread(1.0)
    for k in range(LANES):
        if lights.column >= 0:
            left = _transmittance_along(lights, number, lane(panels[0], k), lane(panels[1], k))
        else:
            near = added(position, scaled(toward_light, lights.shadow_distance))
            left = transmittance_at(lights, number, (lane(near[0], k), lane(near[1], k), lane(near[2], k)))
        found = with_lane(found, k, left)
    return found


@compiled
def panels_at(lights, ray, s):
    """Return the numbers of the ray's panels at s, lanes, and the places in them, 0 to 1; -1 where there are none."""
    numbers, places = spread(-1.0), spread(0.0)
    if lights.column >= 0 and ray.first_panel != ray.last_panel:
        for k in range(LANES):
            number, place = _panel_at(lights, ray, lane(s, k))
            numbers, places = with_lane(numbers, k, float(number)), with_lane(places, k, place)
    return numbers, places


@woven_in
def no_panels():
    """Return what `panels_at` returns for a ray without panels."""
    return spread(-1.0), spread(0.0)


@woven_in
def _panel_at(lights, ray, s):
    """Return the number of the ray's panel at s, and the place in it."""
    panels, first, end = lights.panels, ray.first_panel, ray.last_panel
    while end - first > 1:
        middle = (first + end) // 2
        if panels[middle, 0] <= s:
            first = middle
        else:
            end = middle
    return first, fraction_of(panels[first, 0], panels[first, 1], s)


@woven_in
def _transmittance_along(lights, number, panel, t):
    """Return the transmittance of casting light `number` at t in a panel: the parabola through its three nodes."""
    if panel < 0.0:
        return 1.0
    row, column = lights.panels[int(panel)], 2 + lights.column + number
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
    return cue.strength * least(greatest((depth - cue.near) / (cue.far - cue.near), 0.0), 1.0)


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
    return scaled(vector, 1.0 / greatest(root(dot(vector, vector)), TINY))
