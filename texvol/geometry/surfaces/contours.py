"""Contours of the slices across z, connected from slice to slice (Keppel 1975; Fuchs, Kedem and Uselton 1977).

Contours are scikit-image's marching squares; outside the box the field counts as below, so that all are closed and so
is the surface, on the faces of the box too. Two contours of neighbouring slices belong together if they separate the
same two regions: regions of two slices, above the value or below it, are one where they share a sample's place in x and
y. A contour to each side: a strip by `torus_path`. Several to a side: they are first joined by bridges over a vertex
midway between them (Christiansen, Sederberg 1978). Contours to one side only end there: one in a fan around the
farthest place where the value is met between the slices, several in a strip with a ridge where the value is met.

What it cannot do: a piece between two slices has no handle; an end is a cone, also of what is flat; strips and fans of
contours that are far from convex may cut themselves; a strip may use an edge twice where a small branch hangs at one
vertex. The surface is closed always: as many triangles run along an edge either way.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.surfaces.field import INFINITE, Facets, Field
from texvol.geometry.surfaces.torus_path import strip
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, missing_extra

_PADDING = 2  # samples around a slice: one that repeats the outermost, one that is below


class Loop(NamedTuple):
    """A closed contour: numbers of its vertices, the region above on its left; its regions in the slice, from 1."""

    vertices: NDArray[np.int64]
    above: int
    below: int
    area: float  # signed, in index space; negative around a region below


class Slice(NamedTuple):
    """Contours of one slice at a height z, its samples, and the labels of its regions; 0 is of the other kind."""

    z: float
    values: NDArray[np.float32]
    above: NDArray[np.int32]
    below: NDArray[np.int32]
    loops: list[Loop]


def contours(field: Field) -> Facets:
    """Return the closed surface; without normals.

    Raises
    ------
    InputError
        If samples are missing.
    MissingExtraError
        If scikit-image is not installed.
    """
    if field.missing is not None:
        raise InputError(f"{field.volume.name}: method contours needs all samples, and some are missing")
    try:
        import skimage.measure  # noqa: F401
    except ImportError as error:
        raise missing_extra("scikit-image", "geometry", "contours of slices") from error
    surface = _Surface(field.volume)
    before: Slice | None = None
    for number, layer in enumerate(field.decided):
        z = float(np.clip(number - 1, -0.5, field.volume.dimensions[2] - 0.5))
        after = surface.slice_of(layer, z)
        surface.connect(before or _empty(after), after, flat=before is None)
        before = after
    assert before is not None
    surface.connect(before, _empty(before), flat=True)
    return surface.facets()


def _empty(like: Slice) -> Slice:
    """Return a slice at the same height that is all below."""
    values = np.full_like(like.values, -INFINITE)
    return Slice(like.z, values, np.zeros_like(like.above), np.ones_like(like.below), [])


class _Surface:
    """Vertices in index space and triangles, growing."""

    def __init__(self, volume: Volume) -> None:
        self._volume = volume
        self._vertices = np.empty((1024, 3))  # with room for more
        self._count = 0
        self._triangles: list[NDArray[np.int64]] = []

    def facets(self) -> Facets:
        return Facets(self._vertices[: self._count], np.concatenate([np.empty((0, 3), np.int64), *self._triangles]))

    def slice_of(self, layer: NDArray[np.float32], z: float) -> Slice:
        """Return the contours of a layer of samples, their vertices added."""
        from scipy.ndimage import label
        from skimage.measure import find_contours

        values = np.pad(layer, 1, constant_values=-INFINITE)
        # On an ambiguous face the corners below are connected, in the contours and in the regions.
        above = label(values > 0)[0]
        below = label(values <= 0, np.ones((3, 3)))[0]
        found = Slice(z, values, above, below, [])
        if not above.any():
            return found
        for contour in find_contours(values, 0.0, fully_connected="low", positive_orientation="low"):
            row, column = np.floor(contour[0]).astype(int), np.ceil(contour[0]).astype(int)
            pair = (row[0], row[1]), (column[0], column[1])
            regions = [max(int(labels[each]) for each in pair) for labels in (above, below)]
            last = np.array(self._volume.dimensions[:2]) - 0.5
            flat = np.clip(contour[:-1, ::-1] - _PADDING, -0.5, last)
            flat = flat[(flat != np.roll(flat, 1, axis=0)).any(axis=1)]  # two of a corner of the box are one
            vertices = self._add(np.column_stack([flat, np.full(len(flat), z)]))
            x, y = flat.T
            area = float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)
            found.loops.append(Loop(vertices, regions[0], regions[1], area))
        return found

    def connect(self, lower: Slice, upper: Slice, *, flat: bool) -> None:
        """Add the pieces between two slices; with `flat`, those at the end of the volume."""
        for down, up in _pieces(lower, upper):
            if down and up:
                height = (lower.z + upper.z) / 2
                self._strip(self._joined(down, height), self._joined(up, height))
            elif len(down or up) == 1:
                here, there = (lower, upper) if down else (upper, lower)
                self._fan((down or up)[0], here, there, turned=bool(up), flat=flat)
            else:
                here, there = (lower, upper) if down else (upper, lower)
                self._ridge(down or up, here, here if flat else there, turned=bool(up))

    def _add(self, vertices: NDArray[np.float64]) -> NDArray[np.int64]:
        first, self._count = self._count, self._count + len(vertices)
        if self._count > len(self._vertices):
            self._vertices = np.concatenate([self._vertices[:first], np.empty((self._count, 3))])
        self._vertices[first : self._count] = vertices
        return np.arange(first, self._count)

    def _places(self, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the places of vertices in the world, but for the origin."""
        return np.asarray(self._vertices[numbers] @ self._volume.world_from_index.T)

    def _strip(self, lower: NDArray[np.int64], upper: NDArray[np.int64]) -> None:
        self._triangles.append(np.concatenate([lower, upper])[strip(self._places(lower), self._places(upper))])

    def _ridge(self, loops: list[Loop], here: Slice, there: Slice, *, turned: bool) -> None:
        """Close contours that end between two slices: a strip in `here`, the middles of its edges raised."""
        outer, *others = sorted(loops, key=lambda loop: -abs(loop.area))
        rest = self._joined(others, here.z)[::-1]
        both, count = np.concatenate([outer.vertices, rest]), len(outer.vertices)
        triangles = strip(self._places(outer.vertices), self._places(rest))
        # Two corners are of one contour, and the third, brought to the end, is of the other.
        is_outer = triangles < count
        lone = np.argmax(is_outer == (is_outer.sum(axis=1) == 1)[:, np.newaxis], axis=1)
        triangles = np.take_along_axis(triangles, (lone[:, np.newaxis] + [1, 2, 3]) % 3, axis=1)
        edges = np.sort(triangles[:, [[0, 2], [1, 2]]], axis=2)
        ends, middles = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        raised = self._vertices[both[ends]].mean(axis=1)
        raised[:, 2] += _fractions(here, there, raised[:, :2]) * (there.z - here.z)
        m, n = self._add(raised)[middles.reshape(-1, 2)].T
        a, b, c = both[triangles].T
        parts = np.stack([(a, b, n), (a, n, m), (m, n, c)]).transpose(0, 2, 1).reshape(-1, 3)
        self._triangles.append(parts[:, ::-1] if turned else parts)

    def _fan(self, loop: Loop, here: Slice, there: Slice, *, turned: bool, flat: bool) -> None:
        """Close a contour that ends between two slices."""
        apex = self._add(_apex(loop, here, there, self._vertices[loop.vertices].mean(axis=0), flat)[np.newaxis])
        ends = np.roll(loop.vertices, -1)
        triangles = np.column_stack([loop.vertices, ends, np.broadcast_to(apex, ends.shape)])
        self._triangles.append(triangles[:, ::-1] if turned else triangles)

    def _joined(self, loops: list[Loop], height: float) -> NDArray[np.int64]:
        """Return one loop of all: from the first, bridges go to the nearest of the others, until none is left."""
        from scipy.spatial import cKDTree

        joined, others = loops[0].vertices, [loop.vertices for loop in loops[1:]]
        while others:
            tree = cKDTree(self._places(joined))
            nearest = [tree.query(self._places(other)) for other in others]
            which = int(np.argmin([distances.min() for distances, _ in nearest]))
            distances, at = nearest[which]
            other = np.roll(others.pop(which), -int(distances.argmin()))
            joined = np.roll(joined, -int(at[distances.argmin()]))
            x, y, _ = self._vertices[[joined[0], other[0]]].mean(axis=0)
            (middle,) = self._add(np.array([[x, y, height]]))
            joined = np.concatenate([joined, [joined[0], middle], other, [other[0], middle]])
        return joined


def _apex(loop: Loop, here: Slice, there: Slice, middle: NDArray[np.float64], flat: bool) -> NDArray[np.float64]:
    """Return where the region within a contour ends: the farthest crossing over its samples, or its `middle`."""
    region = here.above == loop.above if loop.area > 0 else here.below == loop.below
    rows, columns = np.nonzero(region & ((there.values > 0) != (here.values > 0)))
    if flat or not len(rows):
        return middle
    own, next_ones = (each.values[rows, columns].astype(np.float64) for each in (here, there))
    fractions = own / (own - next_ones)
    best = int(np.argmax(fractions))
    z = here.z + fractions[best] * (there.z - here.z)
    last = np.array(here.values.shape[::-1]) - 2 * _PADDING - 0.5
    x, y = np.clip(np.array([columns[best], rows[best]]) - _PADDING, -0.5, last)
    return np.array([x, y, z])


def _fractions(here: Slice, there: Slice, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where the value is met at places (n, 2), from 0 `here` to 1 `there`; 0 where it is not."""
    from scipy.ndimage import map_coordinates

    at = places.T[::-1] + _PADDING
    own, other = (map_coordinates(each.values.astype(np.float64), at, order=1) for each in (here, there))
    is_met = (own > 0) != (other > 0)
    return np.divide(own, own - other, out=np.zeros_like(own), where=is_met)


def _pieces(lower: Slice, upper: Slice) -> Iterator[tuple[list[Loop], list[Loop]]]:
    """Yield lower and upper contours that bound one piece of the surface: those between the same two regions."""
    of_above, of_below = _joint(lower.above, upper.above), _joint(lower.below, upper.below)
    pieces: dict[tuple[int, int], tuple[list[Loop], list[Loop]]] = {}
    for side, loops in enumerate((lower.loops, upper.loops)):
        for loop in loops:
            key = int(of_above[side][loop.above]), int(of_below[side][loop.below])
            pieces.setdefault(key, ([], []))[side].append(loop)
    yield from pieces.values()


def _joint(lower: NDArray[np.int32], upper: NDArray[np.int32]) -> tuple[NDArray, NDArray]:
    """Return numbers of joint regions by the labels of the lower and of the upper slice."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    both = (lower > 0) & (upper > 0)
    first = int(lower.max()) + 1
    pairs = np.unique(np.stack([lower[both], first + upper[both].astype(np.int64)]), axis=1)
    count = first + int(upper.max()) + 1
    graph = coo_array((np.ones(pairs.shape[1]), (pairs[0], pairs[1])), shape=(count, count))
    joint = connected_components(graph, directed=False)[1]
    return joint[:first], joint[first:]
