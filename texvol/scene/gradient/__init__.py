"""Gradients of a volume at its samples, in world directions; a scene that has no use for them computes none.

With d the derivative along the grid's axes, per step of the index, the gradient is index_from_world^T d. It is counted
per smallest spacing, so that a world of 1e-9 or 1e9 gives the same numbers. How d is found is the estimator's:

    central         (f[i+1] - f[i-1]) / 2                                                             `differences`
    zucker-hummel   its mean over the nine lines through the 26 neighbours    (Zucker, Hummel 1981)   `differences`
    adaptive        zucker-hummel where the local variance is that of noise, central elsewhere        `adaptive`
    gaussian        slope of the plane that fits all samples within three scales best                 `fits`

All are exact on linear fields, up to the border, where they use the samples that there are, and one-sided differences.
Missing samples (NaN) and infinite ones are left out in the same way; a derivative that nothing is left for is 0, and so
is the one along an axis of one sample. A sample that is missing itself has the gradient of what surrounds it. All
gradients are finite; one too large for its type is as large as the type can say.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from itertools import product
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from texvol.scene.gradient.adaptive import NO_NOISE, Noise, adaptive
from texvol.scene.gradient.differences import central, zucker_hummel
from texvol.scene.gradient.fits import gaussian, reach_of
from texvol.scene.gradient.neighbourhood import Neighbourhood
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.suggestions import check_one_of
from texvol.util.threads import in_threads

EstimatorKind = Literal["central", "zucker-hummel", "gaussian", "adaptive"]
ESTIMATOR_KINDS: tuple[str, ...] = get_args(EstimatorKind)
Box = tuple[slice, slice, slice]  # of samples, along z, y, x
_Interval = tuple[int, int]  # of samples along one axis: first, and one past the last
_CHUNK = 1 << 16  # samples estimated at once: few enough for the cache, many enough for threads
_DEEPEST_CHUNK = 64  # samples along z and y, or wide windows would have chunks that fit no cache
# Of a sample, on two cores; a Gaussian's window of three samples stands for wider ones.
_SECONDS = {"central": 7e-9, "zucker-hummel": 3e-8, "gaussian": 3e-8, "adaptive": 8e-8}
# Sums of differences, weights and the matrix's rows together make no more than 2^6 of the largest value.
_HEADROOM = 2.0**-8


@dataclass(frozen=True)
class Estimator:
    """Method of gradient estimation: "central" differences, "zucker-hummel" (26 neighbours), "gaussian" or "adaptive".

    `scale` is for "gaussian": the standard deviation of its weights, in samples along each axis.
    """

    kind: EstimatorKind = "central"
    scale: float = 1.0

    def __post_init__(self) -> None:
        check_one_of("gradient: kind", self.kind, ESTIMATOR_KINDS)
        if not isinstance(self.scale, int | float) or not 0.1 <= self.scale <= 100:
            raise InputError(f"gradient: scale must be from 0.1 to 100 samples, got {self.scale!r}")

    @property
    def reach(self) -> int:
        """Number of samples to each side that a gradient depends on."""
        return 1 if self.kind != "gaussian" else reach_of(self.scale)


CENTRAL = Estimator()


def gradients(volume: Volume, estimator: Estimator, box: Box = (slice(None),) * 3) -> NDArray[np.floating]:
    """Gradients at a box of samples, shape (nz, ny, nx, 3): x, y, z of the world, data units per smallest spacing.

    They do not depend on the box: its neighbours are read from the volume. float32, or float64 where the volume holds
    float64, or integers beyond 2^24.
    """
    field = _Field(volume, estimator)
    intervals = _intervals(volume, box)
    found = np.empty((*(stop - start for start, stop in intervals), 3), field.dtype)

    def estimate(part: tuple[_Interval, ...]) -> None:
        start = [first for first, _ in intervals]
        where = tuple(slice(low - shift, high - shift) for (low, high), shift in zip(part, start, strict=True))
        field.estimate(part, found[where])

    in_threads(estimate, _chunks(intervals, field.reach))
    return found


def largest_component(volume: Volume, estimator: Estimator) -> float:
    """The largest absolute component of all gradients, data units per smallest spacing; 0 where none is finite.

    The gradients are made chunk by chunk, and never held together.
    """
    field = _Field(volume, estimator)

    def largest(part: tuple[_Interval, ...]) -> float:
        found = np.empty((*(stop - start for start, stop in part), 3), field.dtype)
        field.estimate(part, found)
        return float(max(found.max(), -found.min()))

    chunks = _chunks(_intervals(volume, (slice(None),) * 3), field.reach)
    return max(in_threads(largest, chunks, seconds_of(volume, estimator)), default=0.0)


def seconds_of(volume: Volume, estimator: Estimator) -> float:
    """Return about how long the gradients of a volume take on two cores."""
    window = (2 * estimator.reach + 1) if estimator.kind == "gaussian" else 3
    return volume.size * _SECONDS[estimator.kind] * window / 3


class _Field:
    """Inputs that all chunks of a volume's gradients share."""

    def __init__(self, volume: Volume, estimator: Estimator) -> None:
        # Numbers of labels have no slope: what has a surface is all that is something.
        self._values, self._labels = volume.values, volume.labels
        self._estimator = estimator
        self.reach = estimator.reach
        self.dtype = _work_type(volume)
        largest = float(np.finfo(self.dtype).max)
        # Halfway to the largest number a difference would be infinite: such values are counted in larger units.
        low, high = (volume.value_range or (0.0, 0.0)) if volume.dtype.kind == "f" else (0.0, 0.0)
        self._scale = _HEADROOM if max(-low, high) > largest * _HEADROOM else 1.0
        # Not by way of index_from_world: the ratio of spacings has no unit, and is 1 where they are equal.
        matrix = np.linalg.inv(volume.direction) * (volume.smallest_spacing / volume.spacing)[:, np.newaxis]
        # A power of two, so that no digit changes.
        exponent = math.ceil(math.log2(np.abs(matrix).max()))
        self._index_from_world = np.ldexp(matrix, -exponent)
        self._noise = NO_NOISE
        if estimator.kind == "adaptive":
            self._noise = Noise.of(volume.values != 0 if volume.labels else volume.values, self._scale)
        self._unit = min(math.ldexp(1 / self._scale, min(exponent, 1000)), largest)

    def estimate(self, box: tuple[_Interval, ...], out: NDArray) -> None:
        """Write the gradients of a box of samples to `out`, shape (nz, ny, nx, 3)."""
        block = Neighbourhood.of(self._values, box, self.reach, self.dtype, self._scale, self._labels)
        found: dict[str, Callable[[Neighbourhood], list[NDArray]]] = {
            "central": central,
            "zucker-hummel": zucker_hummel,
            "gaussian": partial(gaussian, scale=self._estimator.scale),
            "adaptive": partial(adaptive, noise=self._noise),
        }
        derivatives = found[self._estimator.kind](block)
        for component in range(3):
            # A column is a row of the transpose. Its numbers are for x, y, z, and the derivatives along z, y, x.
            column = self._index_from_world[::-1, component]
            terms = [along * float(fraction) for fraction, along in zip(column, derivatives, strict=True) if fraction]
            out[..., component] = reduce(np.add, terms) if terms else 0
        if self._unit != 1:
            largest = np.finfo(self.dtype).max
            with np.errstate(over="ignore"):
                out *= self._unit
            np.clip(out, -largest, largest, out=out)


def _work_type(volume: Volume) -> np.dtype:
    """float32 where it holds every value of the volume, float64 elsewhere."""
    dtype = np.dtype(np.uint8) if volume.labels else volume.dtype
    if dtype.kind in "iu" and dtype.itemsize > 2:
        low, high = volume.value_range or (0.0, 0.0)
        return np.dtype(np.float32 if max(-low, high) <= 2**24 else np.float64)
    return np.result_type(dtype, np.float32)


def _intervals(volume: Volume, box: Box) -> tuple[_Interval, ...]:
    ends = (part.indices(count)[:2] for part, count in zip(box, volume.shape, strict=True))
    return tuple((start, max(start, stop)) for start, stop in ends)


def _chunks(intervals: Sequence[_Interval], reach: int) -> list[tuple[_Interval, ...]]:
    """Boxes that fill a box of samples: whole rows where they are not too long, and about as deep as high.

    A chunk is four times as deep as its window reaches, where that is not too much: what it reads of its neighbours is
    then no more than it has itself.
    """
    lengths = [stop - start for start, stop in intervals]
    width = max(1, min(lengths[2], _CHUNK))
    rows = _CHUNK // width
    side = max(1, math.isqrt(rows), min(4 * reach, _DEEPEST_CHUNK))
    height = max(1, min(lengths[1], side))
    depth = max(side, rows // height)
    pieces = [
        [(low, min(low + step, stop)) for low in range(start, stop, step)]
        for (start, stop), step in zip(intervals, (depth, height, width), strict=True)
    ]
    return list(product(*pieces))
