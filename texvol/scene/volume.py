"""A Volume is samples of a scalar field and where they lie in the world.

Sample (i, j, k), stored as `values[k, j, i]`, lies at

    origin + direction @ (spacing * (i, j, k))

and the field's box reaches half a spacing beyond the outermost samples (index -1/2 … n-1/2). Between samples
the field is trilinear; in the outer half spacing it is that of the nearest sample; outside the box nothing is.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.channel import Channel
from texvol.scene.interchanged import Interchanged
from texvol.scene.label_table import LabelTable
from texvol.util.arrays import array_of
from texvol.util.errors import InputError
from texvol.util.kept_arrays import KeepsArrays, Unchanged, read_only

LARGEST_LABEL = 1 << 24
# What is worked out of where the samples lie.
OF_PLACE = (
    "world_from_index",
    "index_from_world",
    "box_corner",
    "box_edges",
    "centre",
    "corners_from_centre",
    "radius",
)


class Volume(KeepsArrays, Interchanged):
    """A scalar field on a regular grid.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
        Any real type up to 64 bits. Held as it is, in native byte order; NaN marks a sample that is not there. It is
        not copied, and `Volume.values` is read-only: what changes is another volume, `Volume(array, …)`, for which
        nothing is copied either. That the array itself was changed is noticed when a picture is drawn, but for a few
        samples of many (see `texvol.util.kept_arrays`), and is an error then.
    spacing : (x, y, z)
        Distance of neighbouring samples in world units; positive and finite.
    origin : (x, y, z)
        World position of sample (0, 0, 0).
    direction : array of shape (3, 3)
        Column a is the world direction of grid axis a. It may mirror or shear, not be singular.
    unit : str
        Name of the world unit, such as "mm"; empty where the file does not say.
    value_unit : str
        Name of the unit of the values, such as "HU" for Hounsfield units; empty where the file does not say.
    space : str
        What the world axes point to, such as "right-anterior-superior"; empty where the file does not say.
    name : str
        What messages call the volume, usually its file.
    source : mapping
        How it can be had again, for pictures that are to say so: the arguments of `texvol.load`, with the `absolute`
        path; or what is `built_in`; and the `transform` that has moved it. Empty for an array.
    resampling : mapping, optional
        Metadata of a grid that was resampled, and the error of that: see `texvol.formats.readers.resampling`.
    notes : sequence of str
        What a reader chose, for people.
    labels : bool
        Whether values are names of what is there, whole numbers: between samples the value is the nearest one's.
    blocks : bool
        True if samples are blocks, not points of a field: the value anywhere is the nearest sample's.
    colors : array of shape (nz, ny, nx, 3), optional
        Straight colour of each sample, linear RGB from 0 to 1; the values are then how much of it there is. Matter has
        its colour times that of the transfer function, and is interpolated after it is classified, always.

    label_table : LabelTable, optional
        Names and colours of labels.

    Raises
    ------
    InputError
        If there are not three axes, no samples, a type that is not real, or no volume to speak of; if labels are not
        whole, or colours not one for each sample.
    """

    label_table: LabelTable | None = None
    channel: Channel | None = None  # of the `channels` of an image; readers set both
    channels: tuple[Channel, ...] = ()

    def __init__(
        self,
        values: ArrayLike,
        spacing: ArrayLike = (1.0, 1.0, 1.0),
        origin: ArrayLike = (0.0, 0.0, 0.0),
        direction: ArrayLike | None = None,
        *,
        unit: str = "",
        value_unit: str = "",
        space: str = "",
        name: str = "volume",
        source: Mapping[str, Any] | None = None,
        resampling: Mapping[str, Any] | None = None,
        notes: Sequence[str] = (),
        labels: bool = False,
        blocks: bool = False,
        colors: ArrayLike | None = None,
        label_table: LabelTable | None = None,
    ) -> None:
        self.name, self.label_table = name, label_table
        self.resampling = None if resampling is None else dict(resampling)
        self.values = read_only(_real_samples(values, name))
        self._place(spacing, origin, direction)
        self._describe(unit, value_unit, space, source, notes)
        self.labels, self.blocks = labels, blocks
        self.colors = None if colors is None else _sample_colors(colors, self.values, name)
        if labels:
            _check_labels(self.values, self.colors, name)
        if blocks and colors is not None:
            raise InputError(f"{name}: a volume must have blocks or colors, got both")
        # Of a file nobody else has the samples.
        self._unchanged = Unchanged(*() if source else ((self.values, values), (self.colors, colors)))

    def _place(self, spacing: ArrayLike, origin: ArrayLike, direction: ArrayLike | None) -> None:
        self.spacing = _positive(_triple(spacing, "spacing", self.name), self.name)
        self.origin = _triple(origin, "origin", self.name)
        self.direction = _regular_matrix(np.eye(3) if direction is None else direction, self.name)

    def _describe(
        self, unit: str, value_unit: str, space: str, source: Mapping[str, Any] | None, notes: Sequence[str]
    ) -> None:
        self.unit, self.value_unit = unit, value_unit
        self.space = self.own_space = space  # the latter stays what the file says, see `spaces.turned`
        self.source, self.notes = dict(source or {}), tuple(notes)

    def moved(self, matrix: ArrayLike) -> Self:
        """Return the volume moved by `matrix`, shape (4, 4), from old to new world coordinates.

        Raises
        ------
        InputError
            If that is no matrix of finite numbers with the last row 0, 0, 0, 1, or leaves no volume.
        """
        try:
            numbers = np.array(matrix, dtype=np.float64)
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if numbers.shape != (4, 4) or not np.isfinite(numbers).all() or (numbers[3] != (0, 0, 0, 1)).any():
            wanted = "a transform must be a finite 4 x 4 matrix whose last row is 0, 0, 0, 1"
            raise InputError(f"{self.name}: {wanted}, got {_rows(numbers)}")
        name = f"{self.name}, transformed"
        with np.errstate(all="ignore"):  # what is too large for float64 is refused below
            axes = numbers[:3, :3] @ self.world_from_index
            spacing = np.linalg.norm(axes, axis=0)
            direction = np.where(spacing > 0, axes / spacing, 0.0)
            origin = numbers[:3, :3] @ self.origin + numbers[:3, 3]
        _regular_matrix(direction, name)
        other = copy(self)
        for derived in OF_PLACE:
            other.__dict__.pop(derived, None)
        other.spacing, other.direction = _positive(spacing, name), direction
        other.origin = _triple(origin, "origin", name)
        if self.source:
            other.source = {**self.source, "transform": (numbers @ self.source.get("transform", np.eye(4))).tolist()}
        return other

    def with_unit(self, unit: str) -> Self:
        """Return the volume with another name of the world unit; no length changes."""
        other = copy(self)
        other.unit = unit
        return other

    def check_unchanged(self) -> None:
        """Raise InputError if the array that it was made of has been changed since something was made of its samples.

        Pictures ask for it; see `texvol.util.kept_arrays`.
        """
        self._unchanged.check(self.name, "samples")

    @property
    def nearest(self) -> bool:
        """True if values are not interpolated: between samples the value is the nearest sample's."""
        return self.labels or self.blocks

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of samples (nz, ny, nx)."""
        nz, ny, nx = self.values.shape
        return nz, ny, nx

    @property
    def dtype(self) -> np.dtype:
        """Type of the samples."""
        return self.values.dtype

    @property
    def size(self) -> int:
        """Number of samples."""
        nz, ny, nx = self.shape
        return nz * ny * nx

    @property
    def dimensions(self) -> tuple[int, int, int]:
        """Numbers of samples (nx, ny, nz)."""
        nz, ny, nx = self.shape
        return nx, ny, nz

    @property
    def whole(self) -> Volume:
        """Volume with all samples in memory: itself, unless it is a `LargeVolume`."""
        return self

    @property
    def overview(self) -> Volume:
        """Volume in memory in whose values one looks for what is there: itself, or a coarser one of a `LargeVolume`."""
        return self

    def expect_picture(self) -> None:
        """Say that a picture will be asked for."""

    @cached_property
    def world_from_index(self) -> NDArray[np.float64]:
        """Matrix of shape (3, 3) that takes a step in index space to one in the world."""
        return self.direction * self.spacing

    @cached_property
    def index_from_world(self) -> NDArray[np.float64]:
        """Inverse of `world_from_index`."""
        # Solved with unit columns, so that a spacing of 1e-9 beside one of 1e9 costs no digits.
        return np.linalg.inv(self.direction) / self.spacing[:, np.newaxis]

    @cached_property
    def box_corner(self) -> NDArray[np.float64]:
        """World position of the corner of the box at index (-1/2, -1/2, -1/2)."""
        return self.origin - self.world_from_index @ np.full(3, 0.5)

    @cached_property
    def box_edges(self) -> NDArray[np.float64]:
        """Matrix of shape (3, 3) whose column a is the edge of the box along grid axis a, in world units."""
        return self.world_from_index * np.array(self.dimensions)

    @cached_property
    def centre(self) -> NDArray[np.float64]:
        """World position of the middle of the box."""
        return self.box_corner + self.box_edges.sum(axis=1) / 2

    @cached_property
    def corners_from_centre(self) -> NDArray[np.float64]:
        """The corners of the box, shape (8, 3), relative to `centre`; corner c has bit a set on axis a's far side."""
        bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
        return (bits - 0.5) @ self.box_edges.T

    @cached_property
    def radius(self) -> float:
        """Distance of the farthest corner from the centre, in world units."""
        return float(np.sqrt((self.corners_from_centre**2).sum(axis=1)).max())

    @property
    def smallest_spacing(self) -> float:
        """The smallest of the three spacings, in world units; the measure of the sampling rate."""
        return float(self.spacing.min())

    @cached_property
    def value_range(self) -> tuple[float, float] | None:
        """Smallest and largest value, infinities included, or None where every sample is NaN."""
        self.check_unchanged()
        # fmin and fmax pass over NaN, and a whole-array minimum is several times faster where there is none.
        low, high = float(self.values.min()), float(self.values.max())
        if np.isnan(low) or np.isnan(high):
            low, high = float(np.fmin.reduce(self.values, axis=None)), float(np.fmax.reduce(self.values, axis=None))
        return None if np.isnan(low) else (low, high)

    def remember_range(self, lowest: float, highest: float) -> None:
        """Take bounds of all values, none of which is NaN, for the smallest and the largest one.

        For parts of a larger volume, of which they are known without another pass over their samples. Where a bound is
        infinite `finite_range` and `has_missing` have to be known already.
        """
        self.__dict__["value_range"] = lowest, highest

    @cached_property
    def has_missing(self) -> bool:
        """True if any sample is NaN."""
        self.check_unchanged()
        return self.values.dtype.kind == "f" and bool(np.isnan(self.values.min()))  # which NaN is the minimum of

    @cached_property
    def finite_range(self) -> tuple[float, float] | None:
        """Smallest and largest finite value, or None where no value is finite."""
        if self.value_range is None or np.isfinite(self.value_range).all():
            return self.value_range
        finite = self.values[np.isfinite(self.values)]
        return (float(finite.min()), float(finite.max())) if finite.size else None

    def __repr__(self) -> str:
        nx, ny, nz = self.dimensions
        unit = f" {self.unit}" if self.unit else ""
        return f"Volume({self.name!r}, {nx} x {ny} x {nz} {self.dtype}, spacing {_text(self.spacing)}{unit})"


def _sample_colors(colors: ArrayLike, values: NDArray, name: str) -> NDArray[np.float32]:
    straight = np.ascontiguousarray(colors, np.float32)
    if straight.shape != (*values.shape, 3):
        raise InputError(f"{name}: colors must have shape {(*values.shape, 3)}, got {straight.shape}")
    if not (straight.min() >= 0 and straight.max() <= 1):  # NaN is neither
        raise InputError(f"{name}: colors must be from 0 to 1, got {straight.min():g} to {straight.max():g}")
    return read_only(straight)


def _check_labels(values: NDArray, colors: NDArray | None, name: str) -> None:
    if colors is not None:
        raise InputError(f"{name}: a volume must have labels or colors, got both")
    if values.dtype.kind == "f" and not (np.isfinite(values).all() and (values == np.rint(values)).all()):
        raise InputError(f"{name}: labels must be whole numbers, got fractions or NaN")
    if max(abs(int(values.min())), abs(int(values.max()))) > LARGEST_LABEL:
        raise InputError(
            f"{name}: labels must be at most {LARGEST_LABEL} in size for single precision, got "
            f"{values.min()} to {values.max()}"
        )


def _real_samples(values: ArrayLike, name: str) -> NDArray:
    """`values` as a native-endian array of three axes, without a copy where none is needed."""
    # Who has a masked array has imported numpy.ma, and nobody else should wait for it.
    if "numpy.ma" in sys.modules and isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        values = np.ma.filled(values.astype(np.float64), np.nan)  # what is masked is not there
    samples = np.asarray(array_of(values))
    if samples.dtype == np.bool_:
        samples = samples.view(np.uint8)
    if samples.dtype.kind not in "iuf" or samples.dtype.itemsize > 8:
        raise InputError(f"{name}: values must be real numbers of at most 64 bits, got {samples.dtype}")
    if samples.ndim != 3:
        raise InputError(f"{name}: values must have 3 axes (z, y, x), got shape {samples.shape}")
    if samples.size == 0:
        raise InputError(f"{name}: values must have at least one sample, got shape {samples.shape}")
    return np.ascontiguousarray(samples, dtype=samples.dtype.newbyteorder("="))


def _triple(numbers: ArrayLike, what: str, name: str) -> NDArray[np.float64]:
    try:
        triple = np.array(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        triple = np.empty(0)
    if triple.shape != (3,):
        raise InputError(f"{name}: {what} must be three numbers x, y, z, got {numbers!r}")
    if not np.isfinite(triple).all():
        raise InputError(f"{name}: {what} must be finite, got {_text(triple)}")
    return read_only(triple)


def _positive(spacing: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """A spacing whose squares and cubes are numbers, too, or InputError."""
    if not (spacing > 0).all():
        raise InputError(f"{name}: spacing must be positive along every axis, got {_text(spacing)}")
    if not ((spacing > 1e-90) & (spacing < 1e90)).all():
        raise InputError(f"{name}: spacing must be from 1e-90 to 1e90, got {_text(spacing)}")
    return spacing


def _regular_matrix(numbers: ArrayLike, name: str) -> NDArray[np.float64]:
    try:
        matrix = np.array(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise InputError(f"{name}: direction must be a finite 3 x 3 matrix, got {_rows(matrix)}")
    # Relative to the columns' lengths the determinant is the volume of a unit parallelepiped: under 1e-6 two axes
    # lie within an angle of 1e-6 of each other and the box is flat.
    lengths = np.linalg.norm(matrix, axis=0)
    if not (lengths > 0).all() or not abs(np.linalg.det(matrix / lengths)) > 1e-6:
        raise InputError(f"{name}: direction must not be singular, got rows {_rows(matrix)}")
    return read_only(matrix)


def _text(triple: NDArray[np.float64]) -> str:
    return ", ".join(f"{number:g}" for number in triple)


def _rows(matrix: NDArray[np.float64]) -> str:
    """The rows of a matrix on one line; of any other array its shape."""
    return "; ".join(map(_text, matrix)) if matrix.ndim == 2 and matrix.size <= 16 else f"of shape {matrix.shape}"
