"""Colours between two colours as VTK interpolates them: in RGB, HSV, Lab, or diverging from white (Moreland 2009).

Colours are sRGB, in [0, 1]; VTK's Lab has the white (0.9505, 1, 1.089).
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from math import acos, atan2, cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from texvol.util.color import linear_from_srgb

Color = NDArray[np.float64]
_WHITE = np.array([0.9505, 1.0, 1.089])
_XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_RGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_SATURATED, _APART, _LIGHTEST = 0.05, 0.33 * pi, 88.0  # Moreland 2009
_NOTHING = 1e-3


def in_rgb(first: Color, second: Color, fraction: float) -> Color:
    """Return the colour at a fraction between two, linear in RGB."""
    return (1 - fraction) * first + fraction * second


def in_hsv(first: Color, second: Color, fraction: float, *, wrap: bool = False) -> Color:
    """Return the colour at a fraction between two, linear in HSV; with `wrap` the hue goes the shorter way."""
    one, other = (np.array(colorsys.rgb_to_hsv(*color)) for color in (first, second))
    if wrap and abs(one[0] - other[0]) > 0.5:
        (one if one[0] > other[0] else other)[0] -= 1.0
    mixed = in_rgb(one, other, fraction)
    return np.array(colorsys.hsv_to_rgb(mixed[0] % 1.0 if mixed[0] < 0 else mixed[0], mixed[1], mixed[2]))


def in_wrapped_hsv(first: Color, second: Color, fraction: float) -> Color:
    """Return the colour at a fraction between two, linear in HSV, the hue the shorter way."""
    return in_hsv(first, second, fraction, wrap=True)


def in_lab(first: Color, second: Color, fraction: float) -> Color:
    """Return the colour at a fraction between two, linear in Lab."""
    return _rgb_of(in_rgb(_lab_of(first), _lab_of(second), fraction))


def diverging(first: Color, second: Color, fraction: float) -> Color:
    """Return the colour at a fraction between two, over white in the middle if they are saturated and differ in hue."""
    one, other = _polar(_lab_of(first)), _polar(_lab_of(second))
    apart = abs(one[2] - other[2]) % (2 * pi)
    if min(one[1], other[1]) > _SATURATED and min(apart, 2 * pi - apart) > _APART:
        white = np.array([max(one[0], other[0], _LIGHTEST), 0.0, 0.0])
        one, other = (one, white) if fraction < 0.5 else (white, other)
        fraction = 2 * fraction if fraction < 0.5 else 2 * fraction - 1
    if one[1] < _SATURATED < other[1]:
        one[2] = _hue_beside(other, one[0])
    elif other[1] < _SATURATED < one[1]:
        other[2] = _hue_beside(one, other[0])
    if (turned := abs(other[2] - one[2])) > pi:  # VTK's way around, with its sign
        other[2] = one[2] + 2 * pi - turned
    length, angle, hue = in_rgb(one, other, fraction)
    return _rgb_of(np.array([length * cos(angle), length * sin(angle) * cos(hue), length * sin(angle) * sin(hue)]))


def stepped(first: Color, second: Color, fraction: float) -> Color:
    """Return the second colour, which VTK's steps have from the first point on."""
    return second


SPACES: dict[str, Callable[[Color, Color, float], Color]] = {
    "RGB": in_rgb,
    "HSV": in_hsv,
    "HSV wrapped": in_wrapped_hsv,
    "Lab": in_lab,
    "CIELAB": in_lab,
    "Diverging": diverging,
    "Step": stepped,
}


def _lab_of(color: Color) -> Color:
    x, y, z = np.array([_root(each) for each in _XYZ_FROM_RGB @ linear_from_srgb(color) / _WHITE])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def _root(number: float) -> float:
    return float(number ** (1 / 3) if number > 0.008856 else 7.787 * number + 16 / 116)


def _rgb_of(lab: Color) -> Color:
    y = (lab[0] + 16) / 116
    cubes = np.array([lab[1] / 500 + y, y, y - lab[2] / 200])
    xyz = np.where(cubes**3 > 0.008856, cubes**3, (cubes - 16 / 116) / 7.787) * _WHITE
    linear = _RGB_FROM_XYZ @ xyz
    bright = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    encoded = np.where(linear > 0.0031308, bright, 12.92 * linear)
    # Colours that no screen has become darker, not paler, as VTK's do.
    return np.asarray(np.maximum(encoded / max(float(encoded.max()), 1.0), 0.0))


def _polar(lab: Color) -> Color:
    """Return length, angle from the grey axis, and hue of a colour in Lab."""
    length = sqrt(float(lab @ lab))
    angle = acos(max(-1.0, min(1.0, lab[0] / length))) if length > _NOTHING else 0.0
    return np.array([length, angle, atan2(lab[2], lab[1]) if angle > _NOTHING else 0.0])


def _hue_beside(saturated: Color, length: float) -> float:
    """Return the hue of a grey beside a saturated colour, for which the way between both is even."""
    if saturated[0] >= length - 0.1:
        return float(saturated[2])
    spin = saturated[1] * sqrt(length**2 - saturated[0] ** 2) / (saturated[0] * sin(saturated[1]))
    return float(saturated[2] + spin if saturated[2] > -0.3 * pi else saturated[2] - spin)
