"""Rectilinear grids: three axes of coordinates, each increasing or decreasing. Even axes make a regular grid as it is.

Uneven ones are resampled between their first and last coordinate. The field in a cell is trilinear, and so is it in
the index space of the source, where the index along an axis is piecewise linear in the coordinate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.resampling import Difference, nearest, resolution_for, slices_at, type_between
from texvol.formats.readers.samples import FileFault, Samples, by, check_size

# Shares of a spacing by which coordinates may miss an even grid and still be one: rounding of the type that they are
# stored in, but no more than the second (a hundredth moves nothing that is seen); numbers of six digits, as text has.
_SAME_POSITION, _MOST_ROUNDING = 1e-6, 1e-2


class Axis(NamedTuple):
    """Coordinates of the samples along an axis, and what a message calls them.

    `rounding` is by how much the file's type may have moved each; `width` is the sample's own where there is one only.
    """

    coordinates: NDArray[np.float64]
    name: str
    rounding: float = 0.0
    width: float | None = None

    @property
    def step(self) -> float:
        """Mean distance of the samples, signed; 0 of a single one."""
        count = len(self.coordinates)
        return float(self.coordinates[-1] - self.coordinates[0]) / (count - 1) if count > 1 else 0.0

    @property
    def is_even(self) -> bool:
        """Whether the coordinates are those of an even grid, to rounding."""
        count, step = len(self.coordinates), self.step
        even = self.coordinates[0] + step * np.arange(count)
        return bool(np.abs(self.coordinates - even).max() <= tolerance(self.rounding, abs(step)))


def tolerance(rounding: float, step: float) -> float:
    """How far a coordinate may lie from an even grid's and still be the same."""
    return max(min(rounding, _MOST_ROUNDING * step), _SAME_POSITION * step)


def rounding_of(stored: NDArray) -> float:
    """By how much the type of stored coordinates may have moved one: a step of the type at the largest of them.

    Half a step each, and as much for the line that is drawn through the first and the last.
    """
    if stored.dtype.kind != "f" or not stored.size:
        return 0.0
    largest = np.abs(stored).max()
    return float(np.spacing(largest)) if np.isfinite(largest) else 0.0


def axis_of(stored: NDArray, name: str, width: float | None = None) -> Axis:
    """The axis that a file's coordinates make; FileFault unless they are finite and run one way."""
    coordinates = stored.astype(np.float64)
    wrong = np.flatnonzero(~np.isfinite(coordinates))
    if wrong.size:
        raise FileFault(f"coordinate {wrong[0]} of its axis {name} is {coordinates[wrong[0]]}, and must be finite")
    steps = np.diff(coordinates)
    if not np.isfinite(steps).all() or np.abs(coordinates).max() > 1e150:
        raise FileFault(f"the coordinates of its axis {name} are too far apart to be reckoned with")
    same = np.flatnonzero(steps == 0)
    if same.size:
        at = same[0]
        raise FileFault(f"its axis {name} repeats a coordinate: samples {at} and {at + 1} lie at {coordinates[at]:g}")
    turned = np.flatnonzero((steps > 0) != (steps[0] > 0)) if steps.size else same
    if turned.size:
        at = turned[0]
        numbers = ", ".join(f"{number:g}" for number in coordinates[at - 1 : at + 2])
        raise FileFault(f"its axis {name} does not run one way: samples {at - 1}..{at + 1} lie at {numbers}")
    return Axis(coordinates, name, rounding_of(stored), width)


def on_axes(
    values: NDArray, axes: Sequence[Axis], resolution: Sequence[int] | None, *, labels: bool = False
) -> Samples:
    """Samples on a regular grid of a field on a rectilinear one.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
    axes : three Axis, x, y, z
    resolution : (mx, my, mz), optional
        Samples along each axis of the regular grid; unless it is given, an even grid stays as it is.
    labels : bool
        Whether values are names, which are not mixed: the nearest sample's is taken.
    """
    sizes = [len(axis.coordinates) for axis in axes]
    if resolution is None and all(axis.is_even for axis in axes):
        return Samples(values, **_grid(axes, sizes))
    wanted = _resolution(axes, resolution)
    to_source = [_index_in_source(axis, count) for axis, count in zip(axes, wanted, strict=True)]
    to_made = [_index_in_made(axis, count) for axis, count in zip(axes, wanted, strict=True)]
    made, lost = _named(values, to_source, to_made) if labels else _between(values, to_source, to_made)
    metadata: dict[str, Any] = {"grid": "rectilinear", "samples": sizes, "dimensions": wanted}
    metadata["chosen_by"] = chosen_by(resolution)
    return Samples(made, **_grid(axes, wanted), resampling=metadata | lost)


def _between(
    values: NDArray, to_source: Sequence[NDArray[np.float64]], to_made: Sequence[NDArray[np.float64]]
) -> tuple[NDArray, dict[str, Any]]:
    """Values on the regular grid, and how far they are from the source's."""
    sizes, dtype = [len(each) for each in to_source], type_between(values.dtype)
    check_size(sizes, dtype.itemsize)
    made = np.empty(sizes[::-1], dtype)
    for slot, plane in zip(made, slices_at(values, to_source), strict=True):
        slot[...] = plane
    difference = Difference()
    for source, plane in zip(values, slices_at(made, to_made), strict=True):
        difference.add(source, plane)
    return made, difference.metadata()


def _named(
    values: NDArray, to_source: Sequence[NDArray[np.float64]], to_made: Sequence[NDArray[np.float64]]
) -> tuple[NDArray, dict[str, Any]]:
    """Labels on the regular grid, and how many of the source's samples have another one there."""
    check_size([len(each) for each in to_source], values.dtype.itemsize)
    there, back = ([nearest(each) for each in index[::-1]] for index in (to_source, to_made))
    made = values[np.ix_(*there)]
    changed = sum(int((made[k][np.ix_(*back[1:])] != source).sum()) for k, source in zip(back[0], values, strict=True))
    return made, {"changed": changed, "compared": values.size}


def chosen_by(resolution: Sequence[int] | None) -> str:
    """Who chose the samples of a regular grid."""
    return "by its finest spacing; --resolution NX,NY,NZ chooses" if resolution is None else "as --resolution says"


def check_resolution(resolution: Sequence[int], sizes: Sequence[int]) -> list[int]:
    """`resolution`, if it has as many numbers as it needs, and those are large enough."""
    wanted = [int(count) for count in resolution]
    if len(wanted) != 3 or any(count != given for count, given in zip(wanted, resolution, strict=True)):
        raise FileFault(f"--resolution is three whole numbers NX,NY,NZ, and is {by(resolution)}")
    for name, count, size in zip("xyz", wanted, sizes, strict=True):
        if size == 1 and count != 1:
            raise FileFault(f"--resolution {by(wanted)}: its axis {name} has one sample, and so has the new one")
        if size > 1 and count < 2:
            raise FileFault(f"--resolution {by(wanted)}: along axis {name} 2 samples or more are needed")
    return wanted


def _resolution(axes: Sequence[Axis], resolution: Sequence[int] | None) -> list[int]:
    sizes = [len(axis.coordinates) for axis in axes]
    if resolution is not None:
        return check_resolution(resolution, sizes)
    wanted = []
    for axis, count in zip(axes, sizes, strict=True):
        if axis.is_even:
            wanted.append(count)
            continue
        wanted.append(_count(np.abs(axis.coordinates - axis.coordinates[0])))
    return wanted


def _count(positions: NDArray[np.float64]) -> int:
    """Samples along an uneven axis: as many as its finest spacing needs, or up to twice that where these fit better.

    Between two samples of the source the field is straight, and kinked by some k at each. A kink that lies a share t of
    the new spacing h beyond a new sample is missed by k t (1 - t) h: chosen is the least of the counts for which the
    mean of t (1 - t) h is, but for a twentieth, as small as it gets.
    """
    extent, finest = float(positions[-1]), float(np.diff(positions).min())
    most = resolution_for(2 * extent, finest, len(positions))
    counts = np.arange(min(resolution_for(extent - finest / 2, finest, len(positions)), most), most + 1)
    missed = []
    for count in counts:
        fraction = positions / extent * (count - 1) % 1.0
        missed.append(float((fraction * (1 - fraction)).mean()) / (count - 1))
    return int(counts[np.argmax(missed <= 1.05 * min(missed) + _SAME_POSITION / len(positions))])


def _index_in_source(axis: Axis, count: int) -> NDArray[np.float64]:
    """Where `count` evenly spaced points from the first to the last coordinate lie among them."""
    old = len(axis.coordinates)
    if axis.is_even:
        return np.linspace(0.0, old - 1.0, count)
    first, last = axis.coordinates[0], axis.coordinates[-1]
    # From 0 to 1 upwards, whichever way the axis runs; np.interp wants it so.
    return np.interp(np.linspace(0.0, 1.0, count), (axis.coordinates - first) / (last - first), np.arange(old))


def _index_in_made(axis: Axis, count: int) -> NDArray[np.float64]:
    """Where the axis' own samples lie among `count` evenly spaced ones from the first to the last of them."""
    old = len(axis.coordinates)
    if axis.is_even:
        return np.linspace(0.0, count - 1.0, old)
    first, last = axis.coordinates[0], axis.coordinates[-1]
    return (axis.coordinates - first) / (last - first) * (count - 1)


def _grid(axes: Sequence[Axis], counts: Sequence[int]) -> dict[str, Any]:
    """Spacing, origin and direction of evenly spaced samples from the first to the last coordinate of each axis."""
    steps = [
        axis.step * (len(axis.coordinates) - 1) / (count - 1) if count > 1 else 0.0
        for axis, count in zip(axes, counts, strict=True)
    ]
    # A single sample has no distance to another one: its cell's width where that is known, or as deep as it is wide.
    smallest = min((abs(step) for step in steps if step), default=1.0)
    spacing = [abs(step) or axis.width or smallest for axis, step in zip(axes, steps, strict=True)]
    direction = np.diag([-1.0 if step < 0 else 1.0 for step in steps])
    return {"spacing": spacing, "origin": [axis.coordinates[0] for axis in axes], "direction": direction}
