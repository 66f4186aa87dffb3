"""Meshes and lines as data, checked when they are made.

Two are the same only if they are the same object: comparing a million triangles is nobody's wish, and a renderer keeps
what it has made of one by its identity.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.color import linear_color
from texvol.util.errors import InputError, is_number
from texvol.util.kept_arrays import KeepsArrays

Triple = tuple[float, float, float]
MESH_COLOR: Triple = (0.75, 0.69, 0.6)  # as an isosurface of no transfer function
LINE_COLOR: Triple = (0.9, 0.9, 0.9)
_FARTHEST = 1e100  # products of two coordinates have to be numbers
WIDEST = 1000.0  # pixels


@dataclass(frozen=True, eq=False)
class Mesh(KeepsArrays):
    """A surface of triangles.

    Parameters
    ----------
    vertices : array of shape (n, 3)
        World units.
    triangles : array of shape (m, 3)
        Numbers of vertices, from 0.
    color : (r, g, b)
        Linear and straight, in [0, 1].
    opacity : float
        Share of the light from behind that it stops, whatever the angle: over 0, up to 1.
    normals : array of shape (n, 3), optional
        At the vertices, of any length, interpolated in between; without them triangles are flat. The side that the eye
        sees is lit, whichever way they point.
    lit : bool
        Whether it shows the scene's light, or a head light where the scene has none; or just its colour.
    cut : bool
        Whether clip planes and crop box cut it too.
    name : str
        What messages call it.

    Raises
    ------
    InputError
        If there is nothing, a number is not finite, a triangle has a corner that is not there, or a shape is wrong.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    color: Triple = MESH_COLOR
    opacity: float = 1.0
    normals: NDArray[np.float64] | None = None
    lit: bool = True
    cut: bool = True
    name: str = "mesh"

    def __post_init__(self) -> None:
        points = _points(self.vertices, "vertices", self.name)
        _put(self, "vertices", points)
        _put(self, "triangles", _indices(self.triangles, 3, len(points), ("triangle", "triangles"), self.name))
        if self.normals is not None:
            normals = _points(self.normals, "normals", self.name)
            if normals.shape != points.shape:
                raise InputError(f"{self.name}: normals must be as many as vertices, {len(points)}, got {len(normals)}")
            _put(self, "normals", normals)
        _check_look(self)

    def __repr__(self) -> str:
        return f"Mesh({self.name!r}, {len(self.vertices)} vertices, {len(self.triangles)} triangles)"


@dataclass(frozen=True, eq=False)
class Lines(KeepsArrays):
    """Straight lines between points, of one width in the picture; never lit.

    A pixel belongs to a line if its middle is no farther than half the width from it in the picture: ends and joints
    are round. Of one `Lines` a pixel shows the nearest only, so that translucent joints are no darker than the rest.

    Parameters
    ----------
    points : array of shape (n, 3)
        World units.
    segments : array of shape (m, 2), or sequence of sequences
        Numbers of points, from 0: pairs that are joined; or polylines, each joined one after the other.
    color, opacity, cut, name
        As a Mesh's.
    width : float
        Pixels.

    Raises
    ------
    InputError
        As for a Mesh.
    """

    points: NDArray[np.float64]
    segments: NDArray[np.int64]
    color: Triple = LINE_COLOR
    opacity: float = 1.0
    width: float = 1.0
    cut: bool = True
    name: str = "lines"

    def __post_init__(self) -> None:
        points = _points(self.points, "points", self.name)
        _put(self, "points", points)
        pairs = _pairs_of(self.segments, self.name)
        _put(self, "segments", _indices(pairs, 2, len(points), ("segment", "segments"), self.name))
        if not (is_number(self.width) and 0 < self.width <= WIDEST):
            raise InputError(f"{self.name}: width must be above 0 and at most {WIDEST:g} pixels, got {self.width!r}")
        _check_look(self)

    def __repr__(self) -> str:
        return f"Lines({self.name!r}, {len(self.points)} points, {len(self.segments)} segments)"


Shape = Mesh | Lines


def checked_geometry(geometry: Iterable[Any]) -> tuple[Shape, ...]:
    """Meshes and lines, or InputError."""
    try:
        shapes = tuple(geometry)
    except TypeError:
        shapes = (geometry,)  # a single one, forgotten to be put into a sequence
    for shape in shapes:
        if not isinstance(shape, Mesh | Lines):
            raise InputError(f"scene: each of geometry must be a Mesh or Lines, got {type(shape).__name__}")
    return shapes


def _put(shape: Shape, name: str, array: NDArray) -> None:
    """Keep an array that nobody else can change."""
    array.setflags(write=False)
    object.__setattr__(shape, name, array)


def _points(numbers: ArrayLike, what: str, name: str) -> NDArray[np.float64]:
    try:
        points = np.array(numbers, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {what} must be numbers x, y, z, got {type(numbers).__name__}") from None
    if points.size == 0:
        raise InputError(f"{name}: must have {what}, got none")
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"{name}: {what} must have shape (n, 3), got {points.shape}")
    bad = ~(np.abs(points) < _FARTHEST).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        position = ", ".join(f"{number:g}" for number in points[first])
        raise InputError(f"{name}: {what} must be finite and at most {_FARTHEST:g}, got {position} at number {first}")
    return points


def _indices(numbers: ArrayLike, corners: int, count: int, words: tuple[str, str], name: str) -> NDArray[np.int64]:
    one, many = words
    try:
        indices = np.array(numbers)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {many} must have shape (m, {corners})") from None
    if indices.size == 0:
        raise InputError(f"{name}: must have {many}, got none")
    if indices.ndim != 2 or indices.shape[1] != corners:
        raise InputError(f"{name}: {many} must have shape (m, {corners}), got {indices.shape}")
    if indices.dtype.kind not in "iu":
        raise InputError(f"{name}: {many} must be whole numbers, got {indices.dtype}")
    bad = ((indices < 0) | (indices >= count)).any(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        corner = next(int(index) for index in indices[first] if not 0 <= index < count)
        raise InputError(f"{name}: {one} {first} has corner {corner}, but the points are 0 to {count - 1}")
    return indices.astype(np.int64)


def _pairs_of(segments: Any, name: str) -> Any:
    """Pairs as they are; polylines as the pairs that they join."""
    if isinstance(segments, np.ndarray) and segments.ndim == 2 and segments.shape[1] == 2:
        return segments
    try:
        are_pairs = all([len(each) == 2 for each in segments])  # a list: each has to have a length
    except TypeError:
        raise InputError(f"{name}: segments must be pairs of points, or polylines of at least two") from None
    if are_pairs:
        return segments
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in map(np.asarray, segments) if len(line) > 1]
    return np.concatenate(pairs) if pairs else ()


def _check_look(shape: Shape) -> None:
    color = linear_color(shape.color, f"{shape.name}: color")
    if max(color) > 1:
        raise InputError(f"{shape.name}: color must be three numbers from 0 to 1, got {shape.color!r}")
    object.__setattr__(shape, "color", color)
    if not (is_number(shape.opacity) and 0 < shape.opacity <= 1):
        raise InputError(f"{shape.name}: opacity must be above 0 and at most 1, got {shape.opacity!r}")
