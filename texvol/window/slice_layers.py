"""Pictures of all volumes in the plane of a slice, one over the other.

The first volume's picture is a layer of its samples as they are. A further volume whose grid axes are parallel to the
plane is a layer of its own samples as well, interpolated between two layers; one that lies obliquely is sampled at
points of the plane, at its own spacing. Only the samples near the plane are read, and no volume is copied. Colours are
looked up in a table of a few thousand values; labels, and samples that are blocks, are never interpolated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.display import straight_colors
from texvol.scene.label_counts import label_counts
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.color import srgb_from_linear
from texvol.window.slice_views import Corners, Plane, cut_of, layer_corners
from texvol.window.slices import Slice, grey
from texvol.window.tinting import Color, tint_of

FINE, COARSE = 512, 192  # points along each side of the samples of an oblique volume: at rest, and while it moves
_ENTRIES = 2048  # of a table of measured values
_WIDEST = 1 << 16  # range of whole numbers with an entry each
_PARALLEL = 1e-6  # largest part of a step along the plane by which an axis that is perpendicular to it may change


@dataclass(frozen=True)
class Layer:
    """Picture of a volume in the plane of a slice.

    Attributes
    ----------
    key : tuple
        What the picture depends on.
    make : callable
        Returns the picture: levels of grey, shape (h, w), or sRGB with straight opacity, shape (h, w, 4), uint8.
    corners : tuple
        Positions of its corners in the plane, around it from the upper left one.
    nearest : bool
        True if samples are not interpolated.
    """

    key: tuple[Any, ...]
    make: Callable[[], NDArray[np.uint8]]
    corners: Corners
    nearest: bool


class Colors:
    """Colours of a volume's values by its transfer function, as a table; alpha is opacity, at most 255."""

    def __init__(self, volume: Volume, medium: TransferFunction) -> None:
        self.medium = medium
        self._labels: NDArray[np.int64] | None = None
        low, high = volume.finite_range or (0.0, 1.0)
        entries: NDArray[Any]
        if volume.labels:
            self._labels = entries = label_counts(volume).labels
        elif volume.dtype.kind in "iu" and high - low < _WIDEST:
            entries = np.arange(int(low), int(high) + 1)
        else:
            entries = np.linspace(low, high, _ENTRIES)
        if self._labels is not None and entries[-1] - entries[0] < _WIDEST:  # looked up without a search
            entries, self._labels = np.arange(entries[0], entries[-1] + 1), None
        self._low, self._count = float(low), len(entries)
        self._per_value = (self._count - 1) / (high - low) if high > low else 0.0
        self._table = _table(entries.astype(np.float64), medium, labels=volume.labels)

    def of(self, values: NDArray) -> NDArray[np.uint8]:
        """Return the colours of values, shape (…, 4); transparent where a value is NaN."""
        if self._labels is not None:
            places = np.searchsorted(self._labels, values.astype(np.int64))
        elif values.dtype.kind in "iu" and self._per_value in (0.0, 1.0):
            places = np.subtract(values, int(self._low), dtype=np.int64)
        else:
            with np.errstate(invalid="ignore", over="ignore"):
                scaled = (values.astype(np.float64) - self._low) * self._per_value
            nearest = np.clip(np.nan_to_num(scaled), 0, self._count - 1) + 0.5
            places = np.where(np.isnan(scaled), self._count, nearest).astype(np.intp)
        found = np.take(self._table, np.clip(places, 0, self._count))
        return found.view(np.uint8).reshape(*values.shape, 4)


def _table(values: NDArray[np.float64], medium: TransferFunction, *, labels: bool) -> NDArray[np.uint32]:
    """Return sRGB and opacity of values as numbers of 32 bits, and one more that is transparent.

    Labels that show are opaque. The opacity of other values is that over the length in which the densest finite one has
    an opacity of nine tenths, so that a further volume shows as it does in a fog of moderate depth.
    """
    magnitudes = np.full(values.shape, np.finfo(np.float64).max ** 0.25) if medium.needs_gradient else None
    extinction = np.nan_to_num(medium.classify(values, magnitudes).extinction, nan=0.0)
    finite = extinction[np.isfinite(extinction)]
    densest = float(finite.max(initial=0.0))
    with np.errstate(over="ignore", invalid="ignore"):
        depth = np.where(extinction > 0, extinction / max(densest, 1e-300) * np.log(10), 0.0)
    opacity = (extinction > 0).astype(np.float64) if labels else -np.expm1(-depth)
    shown = np.zeros((len(values) + 1, 4))
    shown[:-1, :3] = srgb_from_linear(straight_colors(medium, values))
    shown[:-1, 3] = opacity
    return np.ascontiguousarray(np.rint(np.clip(shown, 0, 1) * 255).astype(np.uint8)).view(np.uint32)[:, 0]


def hue_of(scene: Scene) -> Color | None:
    """Return the linear colour of the first volume if it is one of several channels that are shown, else None."""
    medium = scene.transfer_function
    if scene.volume.channel is None or medium is None or all(each.volume.channel is None for each in scene.added):
        return None
    return tint_of(medium).shown_color


def first_layer(
    volume: Volume,
    colors: Colors | None,
    slice_: Slice,
    number: int,
    window: tuple[float, float],
    hue: Color | None = None,
) -> Layer:
    """Return the picture of the first volume: labels in colour, other values in grey or in the samples' colours.

    Grey values are shades of the linear colour `hue` if there is one.
    """

    def make() -> NDArray[np.uint8]:
        values = slice_.values(volume, number)
        if volume.labels and colors is not None:
            return colors.of(values)
        levels = grey(values, window)
        if volume.colors is not None:
            return _own_colors(volume, slice_, number, levels)
        return levels if hue is None else _shades(levels, hue)

    how: Any = colors if volume.labels else (window, hue)
    corners = layer_corners(volume, slice_, Plane.of(volume, slice_, number))
    return Layer((id(volume), slice_, number, how), make, corners, volume.nearest)


def further_layer(volume: Volume, colors: Colors, plane: Plane, *, fine: bool) -> Layer | None:
    """Return the picture of a further volume in a plane; None if the plane does not meet its box."""
    cut = cut_of(volume, plane)
    if cut is None:
        return None
    key = (id(volume), volume.origin.tobytes(), plane.origin.tobytes(), plane.right.tobytes(), colors)
    parallel = _parallel(volume, plane)
    if parallel is not None:
        slice_, depth = parallel
        corners = layer_corners(volume, slice_, plane)
        return Layer((*key, depth), lambda: _of_samples(volume, colors, slice_, depth), corners, volume.nearest)
    left, top, right, bottom = cut
    most = FINE if fine else COARSE
    spacing = float(volume.spacing.min()) / (2 if volume.nearest else 1)
    columns, rows = (int(np.clip(np.ceil(length / spacing), 2, most)) for length in (right - left, bottom - top))

    def make() -> NDArray[np.uint8]:
        return _oblique(volume, colors, plane, cut, (rows, columns))

    corners = (left, top), (right, top), (right, bottom), (left, bottom)
    return Layer((*key, rows, columns), make, corners, volume.nearest)


def _parallel(volume: Volume, plane: Plane) -> tuple[Slice, float] | None:
    """Return the slice of a volume that lies in a plane, and its index on the axis; None if the volume is oblique."""
    steps = volume.index_from_world @ np.stack([plane.right, plane.down], axis=1) * volume.smallest_spacing
    moves = np.abs(steps) > _PARALLEL
    if moves.sum() != 2 or not moves.any(axis=0).all():
        return None
    axes = [int(np.flatnonzero(moves[:, column])[0]) for column in (0, 1)]
    if axes[0] == axes[1]:
        return None
    across, down = ((axis, 1 if steps[axis, column] > 0 else -1) for column, axis in enumerate(axes))
    axis = 3 - axes[0] - axes[1]
    depth = float(volume.index_from_world[axis] @ (plane.origin - volume.origin))
    return Slice(axis, across, down), depth


def _of_samples(volume: Volume, colors: Colors, slice_: Slice, depth: float) -> NDArray[np.uint8]:
    """Return the picture of a layer of samples, or of the mixture of the two layers beside it."""
    last = volume.dimensions[slice_.axis] - 1
    depth = float(np.clip(depth, 0, last))
    below = int(depth)
    if volume.nearest or volume.colors is not None or depth == below:
        number = round(depth)
        values = slice_.values(volume, number)
    else:
        one, other = (slice_.values(volume, each).astype(np.float32) for each in (below, below + 1))
        values = one + np.float32(depth - below) * (other - one)
    found = colors.of(values)
    if volume.colors is not None:
        found[..., :3] = _own_colors(volume, slice_, number, found[..., 3])[..., :3]
    return found


def _shades(levels: NDArray[np.uint8], hue: Color) -> NDArray[np.uint8]:
    """Return grey levels as opaque shades of a linear colour."""
    table = np.full((256, 4), 255, np.uint8)
    table[:, :3] = np.rint(np.arange(256)[:, np.newaxis] * srgb_from_linear(np.array(hue)))
    return table[levels]


def _own_colors(volume: Volume, slice_: Slice, number: int, opacity: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the own colours of a layer of samples, with an opacity."""
    assert volume.colors is not None
    shown = np.empty((*opacity.shape, 4), np.uint8)
    for channel in range(3):
        linear = slice_.of(volume.colors[..., channel], number)
        shown[..., channel] = np.rint(srgb_from_linear(linear) * 255)
    shown[..., 3] = opacity
    return shown


def _oblique(
    volume: Volume, colors: Colors, plane: Plane, cut: tuple[float, float, float, float], shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """Return the picture of a volume in a rectangle of a plane, sampled in the middle of each pixel."""
    left, top, right, bottom = cut
    rows, columns = shape
    across = left + (np.arange(columns) + 0.5) * (right - left) / columns
    along = top + (np.arange(rows) + 0.5) * (bottom - top) / rows
    start = volume.index_from_world @ (plane.origin - volume.origin)
    index = [
        (start[axis] + volume.index_from_world[axis] @ plane.right * across)[np.newaxis]
        + (volume.index_from_world[axis] @ plane.down * along)[:, np.newaxis]
        for axis in range(3)
    ]
    counts = volume.dimensions
    inside = np.ones(shape, bool)
    for axis in range(3):
        inside &= (index[axis] >= -0.5) & (index[axis] <= counts[axis] - 0.5)
    index = [np.clip(index[axis], 0, counts[axis] - 1) for axis in range(3)]
    nearest = volume.nearest or volume.colors is not None
    found = colors.of(_nearest(volume.values, index) if nearest else _trilinear(volume.values, index))
    if volume.colors is not None:
        for channel in range(3):
            found[..., channel] = np.rint(srgb_from_linear(_nearest(volume.colors[..., channel], index)) * 255)
    found[..., 3] *= inside
    return found


def _nearest(values: NDArray, index: list[NDArray[np.float64]]) -> NDArray:
    x, y, z = (np.rint(each).astype(np.intp) for each in index)
    return values[z, y, x]


def _trilinear(values: NDArray, index: list[NDArray[np.float64]]) -> NDArray[np.float32]:
    """Return interpolated values at grid indices (x, y, z) within the grid."""
    nz, ny, nx = values.shape
    flat = values.reshape(-1)
    low = [np.minimum(each.astype(np.intp), max(count - 2, 0)) for each, count in zip(index, (nx, ny, nz), strict=True)]
    x, y, z = ((each - start).astype(np.float32) for each, start in zip(index, low, strict=True))
    corner = (low[2] * ny + low[1]) * nx + low[0]
    right, down, deep = (int(count > 1) * step for count, step in ((nx, 1), (ny, nx), (nz, nx * ny)))
    planes = []
    for behind in (0, deep):
        lines = []
        for below in (0, down):
            first = flat.take(corner + (behind + below)).astype(np.float32)
            other = flat.take(corner + (behind + below + right)).astype(np.float32)
            lines.append(first + x * (other - first))
        planes.append(lines[0] + y * (lines[1] - lines[0]))
    return planes[0] + z * (planes[1] - planes[0])
