"""Rectilinear grids: three axes of coordinates, each increasing or decreasing; even axes make a regular grid.

Uneven axes are resampled between their first and last coordinate. The field in a cell is trilinear, also in the index
space of the source, where the index along an axis is piecewise linear in the coordinate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.resampling import Difference, Floats, nearest, resolution_for, slices_at, type_between
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size

# Tolerances of even coordinates, in fractions of a spacing: for numbers of six digits, as in text, and the limit of the
# tolerance for the rounding of the stored type (a hundredth is invisible).
_SAME_POSITION, _MOST_ROUNDING = 1e-6, 1e-2


class Axis(NamedTuple):
    """Coordinates of the samples along an axis, and the axis' name in messages.

    `rounding` is the rounding error of the file's type; `width` is the width of a single sample.
    """

    coordinates: Floats
    name: str
    rounding: float = 0.0
    width: float | None = None

    def scaled(self, factor: float) -> Axis:
        """Return the axis with all lengths times a factor."""
        width = None if self.width is None else self.width * factor
        return Axis(self.coordinates * factor, self.name, self.rounding * factor, width)

    @property
    def step(self) -> float:
        """Mean distance of the samples, signed; 0 for a single sample."""
        count = len(self.coordinates)
        return float(self.coordinates[-1] - self.coordinates[0]) / (count - 1) if count > 1 else 0.0

    @property
    def is_even(self) -> bool:
        """True if the coordinates are even, to rounding."""
        count, step = len(self.coordinates), self.step
        even = self.coordinates[0] + step * np.arange(count)
        return bool(np.abs(self.coordinates - even).max() <= tolerance(self.rounding, abs(step)))


def tolerance(rounding: float, step: float) -> float:
    """Return the distance from an even coordinate up to which a coordinate counts as even."""
    return max(min(rounding, _MOST_ROUNDING * step), _SAME_POSITION * step)


def rounding_of(stored: NDArray) -> float:
    """Return the largest rounding error of stored coordinates: a step of the type at the largest coordinate.

    Half a step is the coordinate's own, and half that of the line through the first and the last coordinate.
    """
    if stored.dtype.kind != "f" or not stored.size:
        return 0.0
    largest = np.abs(stored).max()
    return float(np.spacing(largest)) if np.isfinite(largest) else 0.0


def axis_of(stored: NDArray, name: str) -> Axis:
    """Return the axis of a file's coordinates; raise FileFault unless they are finite and monotonic."""
    coordinates = stored.astype(np.float64)
    wrong = np.flatnonzero(~np.isfinite(coordinates))
    if wrong.size:
        raise FileFault(f"coordinate {wrong[0]} of its axis {name} must be finite, got {coordinates[wrong[0]]}")
    steps = np.diff(coordinates)
    if not np.isfinite(steps).all() or np.abs(coordinates).max() > 1e150:
        raise FileFault(f"coordinates of its axis {name} must be at most 1e150")
    same = np.flatnonzero(steps == 0)
    if same.size:
        at = same[0]
        raise FileFault(f"its axis {name} repeats a coordinate: samples {at} and {at + 1} are at {coordinates[at]:g}")
    turned = np.flatnonzero((steps > 0) != (steps[0] > 0)) if steps.size else same
    if turned.size:
        at = turned[0]
        numbers = ", ".join(f"{number:g}" for number in coordinates[at - 1 : at + 2])
        raise FileFault(f"its axis {name} is not monotonic: samples {at - 1}..{at + 1} are at {numbers}")
    return Axis(coordinates, name, rounding_of(stored))


def axis_between(stored: NDArray, name: str) -> Axis:
    """Return the axis of samples in the middles between coordinates; a single coordinate stays where it is."""
    axis = axis_of(stored, name)
    edges = axis.coordinates
    if len(edges) == 1:
        return axis
    middles = edges[:-1] + np.diff(edges) / 2
    return Axis(middles, name, axis.rounding, abs(float(edges[1] - edges[0])) if len(middles) == 1 else None)


def on_axes(values: NDArray, axes: Sequence[Axis], choice: Choice) -> Samples:
    """Return samples on a regular grid of a field on a rectilinear grid.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
    axes : three Axis, x, y, z
    choice : Choice
        `resolution` (mx, my, mz) of the regular grid; without it an even grid stays as it is. Labels get the nearest
        sample's value.
    """
    resolution = choice.resolution
    sizes = [len(axis.coordinates) for axis in axes]
    if resolution is None and all(axis.is_even for axis in axes):
        return Samples(values, **_grid(axes, sizes))
    wanted = _resolution(axes, resolution)
    to_source = [_index_in_source(axis, count) for axis, count in zip(axes, wanted, strict=True)]
    to_made = [_index_in_made(axis, count) for axis, count in zip(axes, wanted, strict=True)]
    made, lost = _named(values, to_source, to_made) if choice.labels else _between(values, to_source, to_made)
    metadata: dict[str, Any] = {"grid": "rectilinear", "samples": sizes, "dimensions": wanted}
    metadata["chosen_by"] = chosen_by(resolution)
    return Samples(made, **_grid(axes, wanted), resampling=metadata | lost)


def _between(values: NDArray, to_source: Sequence[Floats], to_made: Sequence[Floats]) -> tuple[NDArray, dict[str, Any]]:
    """Return values on the regular grid, and their error at the source's samples."""
    sizes, dtype = [len(each) for each in to_source], type_between(values.dtype)
    check_size(sizes, dtype.itemsize)
    made = np.empty(sizes[::-1], dtype)
    for slot, plane in zip(made, slices_at(values, to_source), strict=True):
        slot[...] = plane
    difference = Difference()
    for source, plane in zip(values, slices_at(made, to_made), strict=True):
        difference.add(source, plane)
    return made, difference.metadata()


def _named(values: NDArray, to_source: Sequence[Floats], to_made: Sequence[Floats]) -> tuple[NDArray, dict[str, Any]]:
    """Return labels on the regular grid, and the number of the source's samples whose label differs there."""
    check_size([len(each) for each in to_source], values.dtype.itemsize)
    there, back = ([nearest(each) for each in index[::-1]] for index in (to_source, to_made))
    made = values[np.ix_(*there)]
    changed = sum(int((made[k][np.ix_(*back[1:])] != source).sum()) for k, source in zip(back[0], values, strict=True))
    return made, {"changed": changed, "compared": values.size}


def chosen_by(resolution: Sequence[int] | None) -> str:
    """Return a phrase for who chose the samples of a regular grid."""
    return "by its finest spacing; --resolution NX,NY,NZ overrides" if resolution is None else "by --resolution"


def check_resolution(resolution: Sequence[int], sizes: Sequence[int]) -> list[int]:
    """Return `resolution` as a list; raise FileFault unless it has three numbers that are large enough."""
    wanted = [int(count) for count in resolution]
    if len(wanted) != 3 or any(count != given for count, given in zip(wanted, resolution, strict=True)):
        raise FileFault(f"--resolution must be three whole numbers NX,NY,NZ, got {by(resolution)}")
    for name, count, size in zip("xyz", wanted, sizes, strict=True):
        if size == 1 and count != 1:
            raise FileFault(f"--resolution must be 1 along axis {name}, which has one sample, got {by(wanted)}")
        if size > 1 and count < 2:
            raise FileFault(f"--resolution must be at least 2 along axis {name}, got {by(wanted)}")
    return wanted


def _resolution(axes: Sequence[Axis], resolution: Sequence[int] | None) -> list[int]:
    sizes = [len(axis.coordinates) for axis in axes]
    if resolution is not None:
        return check_resolution(resolution, sizes)
    return [
        count if axis.is_even else _count(np.abs(axis.coordinates - axis.coordinates[0]))
        for axis, count in zip(axes, sizes, strict=True)
    ]


def _count(positions: Floats) -> int:
    """Return samples along an uneven axis: as many as its finest spacing needs, or up to twice as many if these fit.

    Between two samples of the source the field is linear, with a kink k at each sample. A kink at a fraction t of the
    new spacing h beyond a new sample causes an error of k t (1 - t) h. The least count is chosen for which the mean of
    t (1 - t) h is within a twentieth of its minimum.
    """
    extent, finest = float(positions[-1]), float(np.diff(positions).min())
    most = resolution_for(2 * extent, finest, len(positions))
    counts = np.arange(min(resolution_for(extent - finest / 2, finest, len(positions)), most), most + 1)
    missed = []
    for count in counts:
        fraction = positions / extent * (count - 1) % 1.0
        missed.append(float((fraction * (1 - fraction)).mean()) / (count - 1))
    return int(counts[np.argmax(missed <= 1.05 * min(missed) + _SAME_POSITION / len(positions))])


def _index_in_source(axis: Axis, count: int) -> Floats:
    """Return the index in the source of `count` even points from the first to the last coordinate."""
    old = len(axis.coordinates)
    if axis.is_even:
        return np.linspace(0.0, old - 1.0, count)
    first, last = axis.coordinates[0], axis.coordinates[-1]
    # Increasing from 0 to 1 for np.interp, also for a decreasing axis.
    return np.interp(np.linspace(0.0, 1.0, count), (axis.coordinates - first) / (last - first), np.arange(old))


def _index_in_made(axis: Axis, count: int) -> Floats:
    """Return the index of the axis' own samples among `count` even points from the first to the last sample."""
    old = len(axis.coordinates)
    if axis.is_even:
        return np.linspace(0.0, count - 1.0, old)
    first, last = axis.coordinates[0], axis.coordinates[-1]
    return (axis.coordinates - first) / (last - first) * (count - 1)


def _grid(axes: Sequence[Axis], counts: Sequence[int]) -> dict[str, Any]:
    """Return spacing, origin and direction of even samples from the first to the last coordinate of each axis."""
    steps = [
        axis.step * (len(axis.coordinates) - 1) / (count - 1) if count > 1 else 0.0
        for axis, count in zip(axes, counts, strict=True)
    ]
    # A single sample has its cell's width if known, else the smallest spacing of the other axes.
    smallest = min((abs(step) for step in steps if step), default=1.0)
    spacing = [abs(step) or axis.width or smallest for axis, step in zip(axes, steps, strict=True)]
    direction = np.diag([-1.0 if step < 0 else 1.0 for step in steps])
    return {"spacing": spacing, "origin": [axis.coordinates[0] for axis in axes], "direction": direction}
