"""The oracle: emission and absorption integrated along each ray without a step length, in float64.

    I = ∫ q(s) T(s) ds + T(s1) B,    T(s) = exp(-∫ τ(s) ds),    opacity = 1 - T(s1)

q is the emission and τ the extinction per world unit, s the distance from the eye, s1 where the ray leaves the box,
B the background. Each ray is cut at every face of the trilinear cells; a cell lies between eight sample centres.
Between two faces any trilinear field is a cubic in s:

- *pre-classified* (`slab`, `extinction`): q and τ of the eight samples are interpolated, so both are cubics.
- *post-classified* (`post`, `integrated`): the value is a cubic, and is cut again where it meets a control point of
  the transfer function. In between, colour and τ are linear in the value, so they are cubics too.

The optical depth of a piece is then a quartic, in closed form; its emission is integrated by Gauss-Legendre. All
polynomials are in Bernstein form over their piece (parameter t from 0 to 1), as tuples of coefficients: no coefficient
of a cubic that trilinear filtering makes lies outside the range of the samples, so tiny depths lose no digits.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from math import ceil, copysign, exp, floor, inf, isfinite, isinf, isnan, nan, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.errors import InputError, missing_extra
from texvol.scene import Scene
from texvol.transfer import TransferFunction
from texvol.volume import Volume

try:
    from numba import njit
except ImportError as error:
    raise missing_extra("numba", "oracle", "texvol raycast") from error

ROWS_AT_ONCE = 8  # rows of a picture that one thread does in one go; Ctrl-C waits for no more than these
OPAQUE_DEPTH = 46.0  # e^-46 = 1e-20: nothing behind it changes a float64
EPSILON = float(np.finfo(np.float64).eps)
LARGEST = float(np.finfo(np.float64).max)
JUST_INSIDE = 1e-9  # of a piece; stands for the limit from inside where weights vanish on the face itself
# Eight points are exact to degree 15. Over an optical depth of 1, with q of degree 6, the rest is under 1e-10.
GAUSS_POINTS, GAUSS_WEIGHTS = ((1 + np.polynomial.legendre.leggauss(8)[0]) / 2, np.polynomial.legendre.leggauss(8)[1] / 2)

Cubic = tuple[float, float, float, float]


class Matter(NamedTuple):
    """A transfer function as arrays; segment k lies between points k - 1 and k, the outermost reach to infinity."""

    points: NDArray[np.float64]
    colors: NDArray[np.float64]
    extinctions: NDArray[np.float64]
    emissive: bool
    visible_before: NDArray[np.int64]  # how many of the segments before segment k hold anything to be seen


def raycast(scene: Scene, size: tuple[int, int] = (512, 512)) -> NDArray[np.float64]:
    """Picture of shape (height, width, 4): linear, premultiplied, row 0 on top; exact to about 1e-9.

    The background is part of it, as (1 - opacity) times itself.

    Parameters
    ----------
    scene : Scene
        `classification` decides which medium is integrated: the pre-classified one for "slab" and "extinction".
    size : (width, height)
        In pixels; one ray goes through the centre of each.

    Raises
    ------
    InputError
        If the size is not at least one pixel each way.
    """
    width, height = size
    if width < 1 or height < 1:
        raise InputError(f"a picture has at least 1x1 pixels, and its size is {width}x{height}")
    volume, camera = scene.volume, scene.camera_for(size)
    matter = _matter(scene.transfer_function or _proposed_for(volume))
    preclassified = scene.classification in ("slab", "extinction")
    values = volume.values.astype(np.float32) if volume.values.dtype == np.float16 else volume.values
    eyes, directions = camera.rays(size)
    rounding = _position_rounding(volume, camera.eye)
    picture = np.zeros((height, width, 4))

    def trace_rows(first: int) -> None:
        rows = slice(first, first + ROWS_AT_ONCE)
        rays = _rays_in_index_space(volume, eyes[rows], directions[rows])
        _trace_rays(values, matter, preclassified, *rays, rounding, picture[rows])

    threads = ThreadPoolExecutor()
    try:
        for _ in threads.map(trace_rows, range(0, height, ROWS_AT_ONCE)):
            pass
    finally:
        threads.shutdown(cancel_futures=True)
    optical_depth = picture[..., 3].copy()
    picture[..., :3] += np.exp(-optical_depth)[..., np.newaxis] * np.array(scene.background)
    picture[..., 3] = -np.expm1(-optical_depth)  # 1 - exp(-1e-17) would be 0
    return picture


def _proposed_for(volume: Volume) -> TransferFunction:
    from texvol.transfer import proposed_for

    return proposed_for(volume)


def _matter(transfer: TransferFunction) -> Matter:
    seen = transfer.extinctions > 0
    if transfer.emissive:
        seen = seen | (transfer.colors > 0).any(axis=1)
    of_segments = np.append(seen, seen[-1]) | np.append(seen[0], seen)
    visible_before = np.append(0, np.cumsum(of_segments)).astype(np.int64)
    return Matter(transfer.values, transfer.colors, transfer.extinctions, bool(transfer.emissive), visible_before)


def _rays_in_index_space(
    volume: Volume, eyes: NDArray[np.float64], directions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Rays as `start` + s `step` (index space), s in world units, and the s of the eye.

    s is 0 where the ray passes nearest to the centre of the box: neither a far eye nor a far origin costs digits.
    """
    from_centre = eyes - volume.centre
    eye = (from_centre * directions).sum(axis=-1)
    nearest = from_centre - eye[..., np.newaxis] * directions
    middle = (np.array(volume.dimensions) - 1) / 2
    to_index = volume.index_from_world.T
    return nearest @ to_index + middle, directions @ to_index, eye


def _position_rounding(volume: Volume, eye: tuple[float, float, float]) -> NDArray[np.float64]:
    """How far rounding may have moved a ray, in index space along each axis: a few ulps of the largest coordinate.

    Matters only where the picture jumps: a ray that runs this near beside a face counts as lying in it.
    """
    reach = np.abs(eye) + np.abs(volume.centre) + np.abs(volume.box_edges).sum(axis=1)
    ulps = EPSILON * (np.abs(volume.index_from_world) @ reach + np.array(volume.dimensions))
    return np.minimum(16 * ulps, 1e-6)


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """`function` compiled on first use; kept on disk where some folder for that can be written."""
    try:
        return njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:
        return njit(nogil=True, error_model="numpy")(function)


# --- polynomials in Bernstein form ---


@_compiled
def _mix(a, b, share):
    """`a` + `share` (`b` - `a`): exactly `a` where both are the same, so that a flat field stays flat."""
    return a + share * (b - a)


@_compiled
def _linear(a, b, entry, leave):
    """Between the numbers a and b, as the share goes from `entry` to `leave`."""
    return _mix(a, b, entry), _mix(a, b, leave)


@_compiled
def _quadratic(a, b, entry, leave):
    """Between the linear a and b, likewise: coefficient k of n is k/n of one and (n - k)/n of another product."""
    return (
        _mix(a[0], b[0], entry),
        _mix(_mix(a[0], b[0], leave), _mix(a[1], b[1], entry), 1 / 2),
        _mix(a[1], b[1], leave),
    )


@_compiled
def _cubic(a, b, entry, leave):
    """Between the quadratic a and b, likewise."""
    return (
        _mix(a[0], b[0], entry),
        _mix(_mix(a[0], b[0], leave), _mix(a[1], b[1], entry), 2 / 3),
        _mix(_mix(a[1], b[1], leave), _mix(a[2], b[2], entry), 1 / 3),
        _mix(a[2], b[2], leave),
    )


@_compiled
def _trilinear(corners, entry, leave):
    """The cubic that trilinear filtering of eight corners makes of the way from `entry` to `leave` (in the cell)."""
    (x0, y0, z0), (x1, y1, z1) = entry, leave
    near_low = _linear(corners[0], corners[1], x0, x1)
    near_high = _linear(corners[2], corners[3], x0, x1)
    far_low = _linear(corners[4], corners[5], x0, x1)
    far_high = _linear(corners[6], corners[7], x0, x1)
    return _cubic(_quadratic(near_low, near_high, y0, y1), _quadratic(far_low, far_high, y0, y1), z0, z1)


@_compiled
def _at(cubic, t):
    """Value and derivative at t (de Casteljau)."""
    a, b, c = _mix(cubic[0], cubic[1], t), _mix(cubic[1], cubic[2], t), _mix(cubic[2], cubic[3], t)
    a, b = _mix(a, b, t), _mix(b, c, t)
    return _mix(a, b, t), 3 * (b - a)


@_compiled
def _part(cubic, start, end):
    """The same cubic over the part of its piece from `start` to `end`."""
    if start == 0.0 and end == 1.0:
        return cubic
    (first, first_slope), (last, last_slope) = _at(cubic, start), _at(cubic, end)
    third = (end - start) / 3
    return first, first + third * first_slope, last - third * last_slope, last


@_compiled
def _turning_points(cubic):
    """Parameters 0 < t < 1 where the cubic turns, ascending; 1 where there is none."""
    a, b, c = cubic[1] - cubic[0], cubic[2] - cubic[1], cubic[3] - cubic[2]
    scale = max(abs(a), abs(b), abs(c))
    if scale == 0.0:
        return 1.0, 1.0
    a, b, c = a / scale, b / scale, c / scale
    # A third of the derivative: a (1-t)² + 2 b t (1-t) + c t² = a + 2 (b-a) t + (a-2b+c) t².
    half, square = b - a, a - 2 * b + c
    discriminant = half * half - a * square
    if discriminant <= 0.0:
        return 1.0, 1.0
    root = -half - sqrt(discriminant) if half > 0 else -half + sqrt(discriminant)  # no cancellation
    first = root / square if square != 0.0 else 1.0
    second = a / root if root != 0.0 else 1.0
    first, second = first if 0.0 < first < 1.0 else 1.0, second if 0.0 < second < 1.0 else 1.0
    return min(first, second), max(first, second)


@_compiled
def _crossing(cubic, value, start, end):
    """Where the cubic, monotone from `start` to `end`, meets a value between those at its ends: Newton in a bracket."""
    rising = _at(cubic, end)[0] > _at(cubic, start)[0]
    t = (start + end) / 2
    while start < t < end:
        height, slope = _at(cubic, t)
        if height == value:
            return t
        if (height < value) == rising:
            start = t
        else:
            end = t
        step = t - (height - value) / slope if slope != 0.0 else nan
        if abs(step - t) <= EPSILON * abs(t):
            return step if start <= step <= end else t
        # A step out of the bracket, or to no other number than its end, is replaced by halving.
        t = step if start < step < end else (start + end) / 2
    return t


# --- matter ---


@_compiled
def _segment(points, value):
    """How many control points lie at or below the value."""
    low, high = 0, points.size
    while low < high:
        middle = (low + high) // 2
        if points[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low


@_compiled
def _classified(matter, value):
    """Emission (3) and extinction of a sample, as `TransferFunction.classify` has it; straight colour if opaque."""
    if isnan(value):
        return 0.0, 0.0, 0.0, 0.0
    segment = _segment(matter.points, value)
    left, right = max(segment - 1, 0), min(segment, matter.points.size - 1)
    width = matter.points[right] - matter.points[left]
    share = (value - matter.points[left]) / width if width > 0 else 0.0
    red, green, blue = _mixed_color(matter, left, right, share)
    extinction = matter.extinctions[left]
    if share > 0:
        extinction = extinction * (1 - share) + matter.extinctions[right] * share
    factor = 1.0
    if matter.emissive and isinf(extinction):
        factor = 0.0
    elif not matter.emissive and not isinf(extinction):
        factor = extinction
    return red * factor, green * factor, blue * factor, extinction


@_compiled
def _mixed_color(matter, left, right, share):
    a, b = matter.colors[left], matter.colors[right]
    return _mix(a[0], b[0], share), _mix(a[1], b[1], share), _mix(a[2], b[2], share)


@_compiled
def _add_opaque(color, depth, light):
    """What lies behind an opaque surface of this colour: nothing."""
    for channel in range(3):
        light[channel] += exp(-depth) * color[channel]
    return inf


@_compiled
def _add_piece(color, extinction, straight, length, depth, light):
    """Optical depth at the end of a piece that begins at `depth`; its emission is added to `light`.

    `color` is three cubics: emission, or straight colour where `straight`, which times `extinction` is emission.
    """
    # The integral of a Bernstein polynomial of degree n has the running sums of its coefficients over n + 1.
    d1 = length / 4 * extinction[0]
    d2 = d1 + length / 4 * extinction[1]
    d3 = d2 + length / 4 * extinction[2]
    d4 = d3 + length / 4 * extinction[3]
    if straight and d4 <= 0.0:
        return depth
    red, green, blue = color
    start, width, reached = 0.0, 1.0, 0.0
    while start < 1.0 and depth + reached < OPAQUE_DEPTH:
        # Halve until a stretch is at most 1 deep: e^-x over it is then a polynomial of low degree, to rounding.
        following = _depth_at(d1, d2, d3, d4, start + width)
        while following - reached > 1.0 and start + width / 2 > start:
            width /= 2
            following = _depth_at(d1, d2, d3, d4, start + width)
        for point in range(GAUSS_POINTS.size):
            t = start + width * GAUSS_POINTS[point]
            seen = GAUSS_WEIGHTS[point] * width * length * exp(-depth - _depth_at(d1, d2, d3, d4, t))
            if straight:
                seen *= _height_at(extinction, t)
            light[0] += seen * _height_at(red, t)
            light[1] += seen * _height_at(green, t)
            light[2] += seen * _height_at(blue, t)
        start, reached = start + width, following
        width = min(2 * width, 1 - start)
    return depth + max(d4, 0.0)


@_compiled
def _height_at(cubic, t):
    u = 1 - t
    return u * u * (u * cubic[0] + 3 * t * cubic[1]) + t * t * (3 * u * cubic[2] + t * cubic[3])


@_compiled
def _depth_at(d1, d2, d3, d4, t):
    """The quartic with coefficients 0, d1 … d4."""
    u = 1 - t
    return t * (4 * u * u * u * d1 + t * (6 * u * u * d2 + t * (4 * u * d3 + t * d4)))


# --- a cell ---


@_compiled
def _has_weight(corner, middle, rounding):
    """Whether a corner (bits: far in x, y, z) counts along a piece through `middle`, beyond rounding."""
    for axis in range(3):
        share = middle[axis] if (corner >> axis) & 1 else 1 - middle[axis]
        if share <= rounding[axis]:
            return False
    return True


@_compiled
def _between(entry, leave, t):
    return _mix(entry[0], leave[0], t), _mix(entry[1], leave[1], t), _mix(entry[2], leave[2], t)


@_compiled
def _cross_preclassified(corners, channels, matter, entry, leave, length, rounding, depth, light):
    """Optical depth behind a cell whose corners are classified, then interpolated. `channels`: scratch, shape (4, 8)."""
    opaque = False
    for corner in range(8):
        red, green, blue, extinction = _classified(matter, corners[corner])
        channels[0, corner], channels[1, corner], channels[2, corner] = red, green, blue
        channels[3, corner] = extinction
        opaque = opaque or isinf(extinction)
    if opaque:
        color, weight = _opaque_color(channels, entry, leave, rounding)
        if weight > 0:
            return _add_opaque(color, depth, light)
    red, green = _trilinear(channels[0], entry, leave), _trilinear(channels[1], entry, leave)
    blue, extinction = _trilinear(channels[2], entry, leave), _trilinear(channels[3], entry, leave)
    return _add_piece((red, green, blue), extinction, False, length, depth, light)


@_compiled
def _opaque_color(channels, entry, leave, rounding):
    """Colour of the opaque corners where the ray enters, and their weight; those without weight are made empty.

    A corner of infinite extinction makes its cell opaque wherever it has weight, and outshines all others.
    """
    x, y, z = _between(entry, leave, JUST_INSIDE)
    middle = _between(entry, leave, 0.5)
    red, green, blue, total = 0.0, 0.0, 0.0, 0.0
    for corner in range(8):
        if isinf(channels[3, corner]):
            if _has_weight(corner, middle, rounding):
                weight = x if corner & 1 else 1 - x
                weight *= y if corner & 2 else 1 - y
                weight *= z if corner & 4 else 1 - z
                red += weight * channels[0, corner]
                green += weight * channels[1, corner]
                blue += weight * channels[2, corner]
                total += weight
            else:
                channels[:, corner] = 0.0
    if total > 0:
        red, green, blue = red / total, green / total, blue / total
    return (red, green, blue), total


@_compiled
def _cross_postclassified(corners, matter, entry, leave, length, rounding, depth, light):
    """Optical depth behind a cell whose value is interpolated, then classified."""
    low, high = corners.min(), corners.max()
    if not isfinite(low + high):
        value = _value_beside_gaps(corners, _between(entry, leave, 0.5), rounding)
        if isnan(value):
            return depth
        if value != 0.0:
            return _add_segment((value, value, value, value), 0.0, 1.0, 0.0, matter, length, depth, light)
        low, high = corners.min(), corners.max()
    # Two values that rounding could have made of one.
    margin = max(rounding[0], rounding[1], rounding[2]) * (high - low) + 4 * EPSILON * max(abs(low), abs(high))
    cubic = _trilinear(corners, entry, leave)
    turns = _turning_points(cubic)
    start = 0.0
    for span in range(3):
        end = turns[span] if span < 2 else 1.0
        if start < end:
            depth = _cross_monotone(cubic, start, end, margin, matter, length, depth, light)
            start = end
    return depth


@_compiled
def _value_beside_gaps(corners, middle, rounding):
    """NaN where a corner with weight makes the value so, ±LARGEST for ±infinity, else 0; corners without weight: 0."""
    value = 0.0
    for corner in range(8):
        if not isfinite(corners[corner]):
            if _has_weight(corner, middle, rounding):
                value += corners[corner]
            else:
                corners[corner] = 0.0
    return copysign(LARGEST, value) if isinf(value) else value


@_compiled
def _cross_monotone(cubic, start, end, margin, matter, length, depth, light):
    """Optical depth behind the part of a cell from `start` to `end`, where the value only rises or only falls."""
    first, last = _at(cubic, start)[0], _at(cubic, end)[0]
    below, above = _segment(matter.points, min(first, last)), _segment(matter.points, max(first, last))
    for crossed in range(above - below + 1):
        cut = end
        if crossed < above - below:
            point = matter.points[below + crossed if first < last else above - 1 - crossed]
            cut = _crossing(cubic, point, start, end)
        if start < cut and depth < OPAQUE_DEPTH:
            depth = _add_segment(cubic, start, cut, margin, matter, length, depth, light)
            start = cut
    return depth


@_compiled
def _add_segment(cubic, start, end, margin, matter, length, depth, light):
    """Optical depth behind the part from `start` to `end`, where the value stays between two control points."""
    points, extinctions = matter.points, matter.extinctions
    value = _at(cubic, (start + end) / 2)[0]
    segment = _segment(points, value)
    left, right = max(segment - 1, 0), min(segment, points.size - 1)
    width = points[right] - points[left]
    # The mean of a monotone cubic is at least 1/15 away from either end: a whole segment is never taken for a point.
    margin = min(margin, width / 32) if width > 0 else margin
    if segment < points.size and points[right] - value <= margin:
        left = _segment(points, points[right]) - 1  # at a point, its right side holds
        on_point = True
    else:
        on_point = width == 0 or value - points[left] <= margin
    part = (0.0, 0.0, 0.0, 0.0)
    if on_point:
        right = left
    else:
        a, b, c, d = _part(cubic, start, end)
        part = ((a - points[left]) / width, (b - points[left]) / width, (c - points[left]) / width, (d - points[left]) / width)
    if isinf(extinctions[left]) or isinf(extinctions[right]):
        red, green, blue = _mixed_color(matter, left, right, min(max(part[0], 0.0), 1.0))
        shown = 0.0 if matter.emissive else 1.0
        return _add_opaque((shown * red, shown * green, shown * blue), depth, light)
    extinction = _along(extinctions[left], extinctions[right], part)
    a, b = matter.colors[left], matter.colors[right]
    color = (_along(a[0], b[0], part), _along(a[1], b[1], part), _along(a[2], b[2], part))
    return _add_piece(color, extinction, not matter.emissive, (end - start) * length, depth, light)


@_compiled
def _along(a, b, share):
    return _mix(a, b, share[0]), _mix(a, b, share[1]), _mix(a, b, share[2]), _mix(a, b, share[3])


# --- a ray ---


@_compiled
def _trace_rays(values, matter, preclassified, starts, steps, eyes, rounding, picture):
    """Light and, in the last channel, optical depth of rays (rows, columns, 3) in index space, into `picture`."""
    corners, channels = np.empty(8), np.empty((4, 8))
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            start, step = starts[row, column], steps[row, column]
            light, eye = picture[row, column, :3], eyes[row, column]
            picture[row, column, 3] = _trace(
                values, matter, preclassified, start, step, eye, rounding, corners, channels, light
            )


@_compiled
def _trace(values, matter, preclassified, start, step, eye, rounding, corners, channels, light):
    """Optical depth of one ray, `start` + s `step` for s from `eye` on; its emission is added to `light`."""
    here, last = _clipped(start, step, values.shape, eye)
    depth = 0.0
    if not here < last:
        return depth
    (i, next_i), (j, next_j), (k, next_k) = (
        _first_cell(start[0], step[0], here), _first_cell(start[1], step[1], here), _first_cell(start[2], step[2], here)
    )
    while here < last and depth < OPAQUE_DEPTH:
        there = min(next_i, next_j, next_k, last)
        if here < there and _load_corners(values, matter, i, j, k, corners):
            entry, leave = _in_cell(start, step, here, i, j, k), _in_cell(start, step, there, i, j, k)
            length = there - here
            if preclassified:
                depth = _cross_preclassified(
                    corners, channels, matter, entry, leave, length, rounding, depth, light
                )
            else:
                depth = _cross_postclassified(corners, matter, entry, leave, length, rounding, depth, light)
        if next_i <= there:
            i, next_i = _next_cell(start[0], step[0], i)
        if next_j <= there:
            j, next_j = _next_cell(start[1], step[1], j)
        if next_k <= there:
            k, next_k = _next_cell(start[2], step[2], k)
        here = max(here, there)
    return depth


@_compiled
def _clipped(start, step, shape, eye):
    """Where the ray enters the box (index -1/2 to n - 1/2), or its eye if that is inside, and where it leaves."""
    enter, leave = eye, inf
    for axis in range(3):
        low, high = -0.5 - start[axis], shape[2 - axis] - 0.5 - start[axis]
        if step[axis] != 0.0:
            low, high = low / step[axis], high / step[axis]
            enter, leave = max(enter, min(low, high)), min(leave, max(low, high))
        elif low > 0.0 or high < 0.0:
            leave = -inf
    return enter, leave


@_compiled
def _first_cell(start, step, s):
    """Along one axis: the cell into which the ray moves at s, and where it leaves that."""
    position = start + s * step
    cell = int(ceil(position)) - 1 if step < 0.0 else int(floor(position))
    return cell, _end_of_cell(start, step, cell)


@_compiled
def _next_cell(start, step, cell):
    cell += 1 if step > 0.0 else -1
    return cell, _end_of_cell(start, step, cell)


@_compiled
def _end_of_cell(start, step, cell):
    if step == 0.0:
        return inf
    return (cell + (1 if step > 0.0 else 0) - start) / step


@_compiled
def _in_cell(start, step, s, i, j, k):
    """Where the ray is at s, as shares of the cell from 0 to 1."""
    return (
        min(max(start[0] + s * step[0] - i, 0.0), 1.0),
        min(max(start[1] + s * step[1] - j, 0.0), 1.0),
        min(max(start[2] + s * step[2] - k, 0.0), 1.0),
    )


@_compiled
def _load_corners(values, matter, i, j, k, corners):
    """Whether there may be something to be seen in cell (i, j, k); its samples, edge values repeated, in `corners`."""
    nz, ny, nx = values.shape
    i0, i1 = min(max(i, 0), nx - 1), min(max(i + 1, 0), nx - 1)
    j0, j1 = min(max(j, 0), ny - 1), min(max(j + 1, 0), ny - 1)
    k0, k1 = min(max(k, 0), nz - 1), min(max(k + 1, 0), nz - 1)
    corners[0], corners[1] = values[k0, j0, i0], values[k0, j0, i1]
    corners[2], corners[3] = values[k0, j1, i0], values[k0, j1, i1]
    corners[4], corners[5] = values[k1, j0, i0], values[k1, j0, i1]
    corners[6], corners[7] = values[k1, j1, i0], values[k1, j1, i1]
    low, high = inf, -inf
    for corner in range(8):
        if corners[corner] < low:
            low = corners[corner]
        if corners[corner] > high:  # neither holds for NaN
            high = corners[corner]
    if low > high:
        return False
    lowest, highest = _segment(matter.points, low), _segment(matter.points, high)
    return matter.visible_before[highest + 1] > matter.visible_before[lowest]
