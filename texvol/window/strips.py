"""Strips: small pictures of transfer functions, colour maps and opacity shapes.

The strip of a transfer function spans its values from the first to the last. Its colours fill it faintly, and fully up
to the height of the opacity there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texvol.scene.display import straight_colors
from texvol.scene.transfer import TransferFunction, adjusting
from texvol.util.color import srgb_from_linear
from texvol.window.color_maps import Stop, color_at
from texvol.window.editing import opacity_of

WIDTH, HEIGHT = 96, 24  # pixels
_BEHIND = np.array([0.16, 0.17, 0.19])  # sRGB
_FAINT = 0.3  # of the colours where nothing shows
_GREY = 0.55  # linear
_LEAST = 0.12  # of the height, of whatever shows at all
_CONTOUR = 1 / 24  # of the range: width of a surface in a strip

Pixels = NDArray[np.uint8]


def of_medium(medium: TransferFunction, length: float) -> Pixels:
    """Return the strip of a transfer function; its height is the opacity over a length, in world units."""
    values = np.linspace(*adjusting.ends(medium), WIDTH)
    colors = np.clip(straight_colors(medium, values), 0, 1)
    depths = medium.at(values)
    heights = opacity_of(depths[:, 3], length)
    if medium.emissive:  # light shows, too
        heights = np.maximum(heights, 1 - np.exp(-depths[:, :3].max(axis=1) * length))
    for graded in medium.graded:
        _lay(colors, heights, *_graded(graded.values, graded.emissions, graded.extinctions, values), length)
    width = values[-1] - values[0] or 1.0
    for contour in medium.contours:
        near = np.clip(1 - np.abs(values - contour.value) / (_CONTOUR * width), 0, 1)
        emissions = near[:, np.newaxis] * np.array(contour.emission)
        _lay(colors, heights, emissions, near * contour.extinction, length)
    return _filled(colors, heights)


def of_stops(stops: Sequence[Stop]) -> Pixels:
    """Return the strip of a colour map, from its first to its last stop."""
    ends = stops[0][0], stops[-1][0]
    return _filled(np.array([color_at(stops, value) for value in np.linspace(*ends, WIDTH)]), np.ones(WIDTH))


def of_list(colors: Sequence[Sequence[float]]) -> Pixels:
    """Return the strip of a list of linear colours, with as many as can be told apart."""
    shown = list(colors)[:12]
    places = np.minimum(np.arange(WIDTH) * len(shown) // WIDTH, len(shown) - 1)
    return _filled(np.array(shown)[places], np.ones(WIDTH))


def of_shape(rows: Sequence[tuple[float, float]]) -> Pixels:
    """Return the strip of an opacity shape: pairs of fractions."""
    places, heights = np.array(rows).T
    steps = np.arange(len(places)) * 1e-9  # np.interp takes the right side of a step
    found = np.interp(np.linspace(0, 1, WIDTH), places + steps, heights)
    return _filled(np.full((WIDTH, 3), _GREY), found)


def of_opacity(medium: TransferFunction, length: float) -> Pixels:
    """Return the strip of the opacity of a transfer function, over a length in world units."""
    values = np.linspace(*adjusting.ends(medium), WIDTH)
    return _filled(np.full((WIDTH, 3), _GREY), opacity_of(medium.at(values)[:, 3], length))


def _graded(places: NDArray, emissions: NDArray, extinctions: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """Return emission and extinction of a part that depends on the gradient, where the gradient is large."""
    columns = [np.interp(values, places, column, left=0, right=0) for column in (*emissions.T, extinctions)]
    return np.stack(columns[:3], axis=1), columns[3]


def _lay(colors: NDArray, heights: NDArray, emissions: NDArray, extinctions: NDArray, length: float) -> None:
    """Lay a part of a medium over what shows without it, where it shows more."""
    more = opacity_of(extinctions, length)
    where = more > heights
    colors[where] = np.clip(emissions[where] / extinctions[where, np.newaxis], 0, 1)
    heights[where] = more[where]


def _filled(colors: NDArray, heights: NDArray) -> Pixels:
    """Return columns of linear colours up to their heights, 0 to 1, of the strip."""
    shown = srgb_from_linear(np.clip(colors, 0, 1))
    heights = np.where(heights > 1e-3, np.maximum(heights, _LEAST), 0.0)
    rows = 1 - (np.arange(HEIGHT)[:, np.newaxis] + 0.5) / HEIGHT
    inside = np.clip((heights[np.newaxis] - rows) * HEIGHT + 0.5, 0, 1)[..., np.newaxis]
    faint = _FAINT * shown + (1 - _FAINT) * _BEHIND
    picture = inside * shown[np.newaxis] + (1 - inside) * faint[np.newaxis]
    return np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
