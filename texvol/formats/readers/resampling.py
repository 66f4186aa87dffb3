"""Resampling of fields from irregular to regular grids, and its error at the field's own samples.

Both grids are related by index space. With u the index of a point in a grid of n samples along each axis,

    f(u) = Σ w_c(u) f_c,        w_c the trilinear weights of the 8 samples around u,

clamped to the outermost samples as in `Volume`. A sample that is not finite is missing: the weights of the others are
scaled to 1, and if they add up to less than half, the point is missing too, so that a field with holes keeps its
extent on average.

The error of a resampling is f - f' at all samples of the source, where f' is the field that texvol draws, interpolated
between the new samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_SAMPLES = 512  # along an axis, unless the source has more
MOST_REFINED = 4  # times the source's samples along an axis; finer grids show only the interpolation

_LEAST_WEIGHT = 0.5 - 1e-9  # of finite samples; halfway between a finite and a missing sample the field is finite
_CHUNK = 2**16  # points per step: intermediates stay in the cache
_SNAP = 1e-9  # of a sample: an index this close to a whole number is that number, due to rounding


class Weights:
    """Interpolation weights of points along an axis of a grid.

    Parameters
    ----------
    index : array of shape (m,)
        Positions in samples from 0; clamped to the outermost samples.
    count : int
        Samples of the grid along the axis.
    """

    def __init__(self, index: Floats, count: int) -> None:
        index = np.clip(index, 0.0, count - 1.0)
        whole = np.round(index)
        index = np.where(np.abs(index - whole) < _SNAP, whole, index)
        self.first = np.minimum(index.astype(np.intp), max(count - 2, 0))
        self.second = np.minimum(self.first + 1, count - 1)
        self.upper = index - self.first
        self.lower = 1.0 - self.upper


def slices_at(values: NDArray, index: Sequence[Floats]) -> Iterator[Floats]:
    """Yield the field, slice by slice, on a grid of points along its own axes.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
    index : three arrays
        Indices x, y, z of the points; those along z do not decrease.

    Yields
    ------
    array of shape (my, mx)
        For each index along z; NaN where the field is missing.
    """
    x, y, z = (Weights(each, count) for each, count in zip(index, values.shape[::-1], strict=True))
    held: dict[int, tuple[Floats, Floats | None]] = {}

    def plane(k: int) -> tuple[Floats, Floats | None]:
        """Return the weighted sum of finite samples, and the sum of their weights or None if all are finite."""
        if k not in held:
            source = values[k].astype(np.float64)
            there = np.isfinite(source)
            if there.all():
                held[k] = _across(source, x, y), None
            else:
                held[k] = _across(np.where(there, source, 0.0), x, y), _across(there.astype(np.float64), x, y)
        return held[k]

    for first, second, lower, upper in zip(z.first, z.second, z.lower, z.upper, strict=True):
        for k in [k for k in held if k not in (first, second)]:
            del held[k]
        (total, weight), (other_total, other_weight) = plane(int(first)), plane(int(second))
        result = lower * total + upper * other_total
        if weight is not None or other_weight is not None:
            present = lower * (1.0 if weight is None else weight) + upper * (
                1.0 if other_weight is None else other_weight
            )
            result = _normalised(result, present)
        yield result


def _across(plane: Floats, x: Weights, y: Weights) -> Floats:
    rows = plane[y.first] * y.lower[:, np.newaxis] + plane[y.second] * y.upper[:, np.newaxis]
    return rows[:, x.first] * x.lower + rows[:, x.second] * x.upper


def _normalised(total: Floats, present: Floats) -> Floats:
    return np.where(present >= _LEAST_WEIGHT, total / np.maximum(present, _LEAST_WEIGHT), np.nan)


def nearest(index: Floats) -> NDArray[np.intp]:
    """Return the samples nearest to points, the upper one halfway between two."""
    return np.floor(index + 0.5).astype(np.intp)


def labels_at(values: NDArray, index: Floats) -> NDArray:
    """Return the labels at any points; `index`, shape (m, 3), is clamped to the outermost samples."""
    x, y, z = (np.clip(nearest(index[:, axis]), 0, values.shape[2 - axis] - 1) for axis in range(3))
    found: NDArray = values[z, y, x]
    return found


def sampled_at(values: NDArray, index: Floats) -> Floats:
    """Return the field at any points.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
    index : array of shape (m, 3)
        Indices x, y, z of the points.

    Returns
    -------
    array of shape (m,)
        NaN where the field is missing.
    """
    result = np.empty(len(index))
    for begin in range(0, len(index), _CHUNK):
        part = index[begin : begin + _CHUNK]
        axes = [Weights(part[:, axis], values.shape[2 - axis]) for axis in range(3)]
        total, present = np.zeros(len(part)), np.zeros(len(part))
        for corner in range(8):
            at, weight = [], np.ones(len(part))
            for axis, each in enumerate(axes):
                is_upper = corner >> axis & 1
                at.append(each.second if is_upper else each.first)
                weight = weight * (each.upper if is_upper else each.lower)
            sample = values[at[2], at[1], at[0]].astype(np.float64)
            there = np.isfinite(sample)
            total += np.where(there, sample, 0.0) * weight
            present += there * weight
        result[begin : begin + _CHUNK] = _normalised(total, present)
    return result


class Difference:
    """Error of a resampling at the source's samples, accumulated part by part."""

    def __init__(self) -> None:
        self._largest = self._rms = 0.0
        self._compared = self._lost = self._filled = 0
        self._low, self._high = np.inf, -np.inf

    def add(self, source: NDArray, field: Floats) -> None:
        """Add some of the source's samples, and the new field at their positions."""
        there, drawn = np.isfinite(source), np.isfinite(field)
        both = there & drawn
        self._lost += int((there & ~drawn).sum())
        self._filled += int((drawn & ~there).sum())
        if there.any():
            finite = source[there]
            self._low, self._high = min(self._low, float(finite.min())), max(self._high, float(finite.max()))
        if both.any():
            errors = np.abs(source[both].astype(np.float64) - field[both])
            self._compared += errors.size
            self._largest = max(self._largest, float(errors.max()))
            # Divided before it is squared, and never kept as a square: those of values near 1e200 would be infinite.
            scale = float(errors.max()) or 1.0
            rms = float(np.sqrt(((errors / scale) ** 2).mean())) * scale
            weight = errors.size / self._compared
            self._rms = float(np.hypot(self._rms * np.sqrt(1 - weight), rms * np.sqrt(weight)))

    def metadata(self) -> dict[str, Any]:
        """Return the error in data units and as a fraction of the source's range, and the numbers of samples."""
        extent = self._high - self._low
        is_known = self._compared > 0
        largest, rms = self._largest, self._rms
        return {
            "max_error": largest if is_known else None,
            "rms_error": rms if is_known else None,
            "max_error_share": largest / extent if is_known and extent > 0 else None,
            "rms_error_share": rms / extent if is_known and extent > 0 else None,
            "compared": self._compared,
            "lost": self._lost,
            "filled": self._filled,
        }


def type_between(dtype: np.dtype) -> np.dtype:
    """Return the type of interpolated values: float32 for samples of up to 16 bits or float32, else float64."""
    return np.dtype(np.float32 if dtype.itemsize <= (4 if dtype.kind == "f" else 2) else np.float64)


def resolution_for(extent: float, finest: float, samples: int) -> int:
    """Return the default number of samples of an axis: as many as its finest spacing needs, within bounds."""
    needed = extent / finest if finest > 0 else np.inf
    # Rounding must not add a sample.
    wanted = int(np.ceil(min(needed, 2.0**31) - 1e-6)) + 1
    return max(2, min(wanted, MOST_REFINED * samples, max(MOST_SAMPLES, samples)))


def text(metadata: dict[str, Any]) -> list[str]:
    """Return lines of text about a volume's `resampling`."""
    made = " x ".join(map(str, metadata["dimensions"]))
    lines = [f"from {_grid_in_words(metadata)} to a regular one of {made} ({metadata['chosen_by']})"]
    own = metadata.get("compared_at", "the source's samples")
    if "changed" in metadata:
        changed, compared = metadata["changed"], metadata["compared"]
        what = "cells" if "tetrahedra" in metadata else "samples"
        lines.append(f"{changed} of {compared} {what} of the source have another label on the new grid")
    elif metadata["max_error"] is None:
        lines.append("error unknown: no sample of the source is where the new field has a value")
    else:
        lines.append(f"error at {own}: max {_amount(metadata, 'max_error')}, rms {_amount(metadata, 'rms_error')}")
    nothing = "0" if "changed" in metadata else "NaN"
    counted = (
        ("lost", "samples of the source are where the new field is missing"),
        ("filled", "missing samples of the source are where the new field has a value"),
        ("outside", f"of the new samples are outside of the source's grid and are {nothing}"),
        ("flat_cells", "cells of the source have no volume and are left out"),
    )
    return lines + [f"{metadata[key]} {what}" for key, what in counted if metadata.get(key)]


def _grid_in_words(metadata: dict[str, Any]) -> str:
    if "tetrahedra" in metadata:
        return f"an unstructured grid of {metadata['points']} points and {metadata['tetrahedra']} tetrahedra"
    return f"a {metadata['grid']} grid of {' x '.join(map(str, metadata['samples']))} samples"


def _amount(metadata: dict[str, Any], key: str) -> str:
    fraction = metadata[f"{key}_share"]
    return f"{metadata[key]:.4g}" + ("" if fraction is None else f" ({100 * fraction:.3g} % of the range)")
