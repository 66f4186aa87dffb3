"""Shifts of a pyramid's levels, by correlation of neighbours: many writers store the scale of a level and forget that
averages of f samples lie (f - 1) / 2 samples further on.

Both levels are smoothed by one Gaussian, as wide as two samples of the coarser one, so that it does not matter how that
was made of the finer one (averages, every second sample, any symmetric filter). Then the coarse samples B are fitted by
the fine ones A at their positions p moved by s,

    B ≈ a + b A(p + s),

with Gauss and Newton's steps; the standard error of s comes from the residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Box, Level

_WIDTH = 32  # coarse samples of the compared box along an axis, at most
_LEAST = 12  # and at least, else that axis is not compared
_SIGMA = 1.0  # standard deviation of the Gaussian, in coarse samples
_MARGIN = 3  # coarse samples that the Gaussian reaches
_STEPS = 6
_CORRELATION = 0.8  # squared: below it the levels show too little in common
_SURE = 6.0  # standard errors by which a shift must differ from the declared one
_NOTICED = 0.15  # of a fine sample
_NEAR = 0.1  # of a fine sample, within which an estimate is one of the usual shifts


class Finding(NamedTuple):
    """Where the samples (0, 0, 0) of the levels lie, along x, y, z in samples of level 0, by their content."""

    first: tuple[tuple[float, float, float], ...]
    notes: tuple[str, ...]


def found_shifts(levels: Sequence[Level], *, fixed: bool) -> Finding:
    """Compare each level with the one before it; the notes say what was `fixed`, or how to fix it."""
    declared = [np.array(each.first) for each in levels]
    corrected, notes = [declared[0]], []
    centre = _busiest(levels[-1])
    forgotten = False  # True once averages are found whose translation the writer forgot
    for number in range(1, len(levels)):
        fine, coarse = levels[number - 1], levels[number]
        step = np.array(coarse.factor) / fine.factor
        told = (declared[number] - declared[number - 1]) / fine.factor  # in samples of the finer level
        apart = _difference(fine, coarse, told, step, centre)
        if apart is None:  # too small or too noisy to say: as the writer has done with the levels before
            apart = (step - 1) / 2 if forgotten and not told.any() else np.zeros(3)
        else:
            forgotten = bool(not told.any() and apart.any() and np.allclose(apart, (step - 1) / 2))
        found = told + apart
        corrected.append(corrected[-1] + found * fine.factor)
        off = corrected[-1] - declared[number]
        if np.abs(off).max() > 1e-9:
            notes.append(_sentence(number, off, fixed))
    return Finding(tuple((float(x), float(y), float(z)) for x, y, z in corrected), tuple(notes))


def _sentence(number: int, off: NDArray[np.float64], fixed: bool) -> str:
    sizes: dict[str, list[str]] = {}
    for name, each in zip("xyz", off, strict=True):
        if abs(each) > 1e-9:
            sizes.setdefault(f"{each:.3g}", []).append(name)
    how = " and ".join(f"{size} samples of level 0 along {', '.join(axes)}" for size, axes in sizes.items())
    done = "corrected by --fix-pyramid" if fixed else "--fix-pyramid corrects this"
    return f"level {number} lies {how} off where its metadata put it: {done}"


def _busiest(level: Level) -> NDArray[np.float64]:
    """Return the position, as fractions of the extent along z, y, x, of the box with the most contrast."""
    shape = np.array(level.source.shape)
    if (shape <= _WIDTH).all():
        return np.full(3, 0.5)
    box, _ = _box_around(shape, np.full(3, 0.5), 4 * _WIDTH)
    values = _floats(level.source.read(box))
    half = np.maximum(np.minimum(shape, _WIDTH) // 2, 1)
    best, at = -1.0, np.full(3, 0.5)
    for place in np.ndindex(*(max(size // step, 1) for size, step in zip(values.shape, half, strict=True))):
        start = np.array(place) * half
        part = values[tuple(slice(a, a + 2 * h) for a, h in zip(start, half, strict=True))]
        contrast = float(part.var()) * part.size
        if contrast > best:
            best, at = contrast, (start + half + [each.start for each in box]) / shape
    return at


def _difference(
    fine: Level, coarse: Level, told: NDArray[np.float64], step: NDArray[np.float64], centre: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return by how many fine samples along x, y, z the coarse level lies off; None if nothing tells."""
    shape = np.array(coarse.source.shape)
    compared = shape >= _LEAST  # along z, y, x
    # Along the axes that are not halved there is nothing to forget.
    compared &= step[::-1] > 1.01
    if not compared.any():
        return None
    box, sizes = _box_around(shape, centre, _WIDTH)
    index = [np.arange(part.start, part.stop, dtype=float) for part in box]
    positions = [told[2 - axis] + step[2 - axis] * index[axis] for axis in range(3)]
    reach = [2 + (_MARGIN + 1) * float(step[2 - axis]) for axis in range(3)]
    limits = fine.source.shape
    low = [int(np.clip(each[0] - more, 0, size - 1)) for each, more, size in zip(positions, reach, limits, strict=True)]
    high = [int(np.clip(each[-1] + more + 1, a + 1, size))
            for each, more, size, a in zip(positions, reach, limits, low, strict=True)]  # fmt: skip
    part: Box = (slice(low[0], high[0]), slice(low[1], high[1]), slice(low[2], high[2]))
    below, above = _floats(fine.source.read(part)), _floats(coarse.source.read(box))
    inner = [
        slice(_MARGIN, size - _MARGIN) if each else slice(None) for size, each in zip(sizes, compared, strict=True)
    ]
    smooth = [_kernel(each[cut], each, _SIGMA)[0] if used else np.eye(len(each))
              for each, cut, used in zip(index, inner, compared, strict=True)]  # fmt: skip
    wanted = _applied(above, smooth)
    places = [each[cut] - start for each, cut, start in zip(positions, inner, low, strict=True)]
    widths = [_SIGMA * float(step[2 - axis]) for axis in range(3)]
    shift, error, alike = _fitted(below, wanted, places, widths, compared)
    if alike < _CORRELATION:
        return None
    sure = compared & (np.abs(shift) > np.maximum(_SURE * error, _NOTICED))
    if not sure.any():
        # As told, if the usual shift would have been noticed.
        noticed = (np.maximum(_SURE * error, _NOTICED) < (step[::-1] - 1) / 2) | ~compared
        return np.zeros(3) if noticed.all() else None
    known = np.where(compared, shift, 0.0)[::-1] + told
    usual = np.stack([told, (step - 1) / 2, np.zeros(3)])
    near = usual[np.abs(usual - known).argmin(axis=0), np.arange(3)]
    known = np.where(np.abs(near - known) < np.maximum(_NEAR, 3 * error[::-1]), near, known)
    return np.where(sure[::-1], known - told, 0.0)


def _fitted(
    below: NDArray[np.float64],
    wanted: NDArray[np.float64],
    places: list[NDArray[np.float64]],
    widths: list[float],
    compared: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return the shift along z, y, x in fine samples, its standard error, and the squared correlation."""
    shift, error, alike = np.zeros(3), np.full(3, np.inf), 0.0
    own = [np.arange(size, dtype=float) for size in below.shape]
    axes = np.flatnonzero(compared)
    scale = float(wanted.std())
    if scale == 0:
        return shift, error, alike
    for _ in range(_STEPS):
        each_axis = zip(places, shift, own, widths, compared, strict=True)
        kernels = [
            _kernel(place + move, at, width) if used else _nearest(place, at)
            for place, move, at, width, used in each_axis
        ]
        values = _applied(below, [each[0] for each in kernels])
        columns = [np.ones(values.size), values.reshape(-1)]
        for axis in axes:
            slopes = [kernel[1] if number == axis else kernel[0] for number, kernel in enumerate(kernels)]
            columns.append(_applied(below, slopes).reshape(-1))
        table = np.stack(columns, axis=1)
        norms = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
        found, *_ = np.linalg.lstsq(table / norms, wanted.reshape(-1), rcond=1e-10)
        found = found / norms
        if not found[1] > 0:
            return shift, error, 0.0
        rest = wanted.reshape(-1) - table @ found
        alike = 1.0 - float(np.mean(rest**2)) / scale**2
        # Smoothed samples are not independent: one of so many counts.
        together = (2 * np.sqrt(np.pi) * _SIGMA) ** len(axes)
        inverse = np.linalg.pinv((table / norms).T @ (table / norms))
        spread = np.sqrt(np.maximum(np.diag(inverse), 0) * np.mean(rest**2) * together) / norms
        error[axes] = spread[2:] / found[1]
        move = np.clip(found[2:] / found[1], -1.0, 1.0)
        shift[axes] += move
        if np.abs(move).max() < 1e-3 or np.abs(shift).max() > 4:
            break
    return shift, error, alike if np.abs(shift).max() <= 4 else 0.0


def _kernel(
    to: NDArray[np.float64], at: NDArray[np.float64], sigma: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the matrix that takes samples at `at` to Gaussian means at `to`, and its derivative by `to`."""
    distance = (at - to[:, np.newaxis]) / sigma
    weights = np.where(np.abs(distance) <= _MARGIN / _SIGMA, np.exp(-(distance**2) / 2), 0.0)
    sums = np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
    slopes = weights * distance / sigma
    return weights / sums, (slopes - weights * (slopes.sum(axis=1, keepdims=True) / sums)) / sums


def _nearest(to: NDArray[np.float64], at: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the matrix of linear interpolation at `to`; its derivative is not used."""
    place = np.clip(to, at[0], at[-1])
    weights = np.maximum(1 - np.abs(at - place[:, np.newaxis]), 0.0)
    return weights / weights.sum(axis=1, keepdims=True), np.zeros_like(weights)


def _applied(values: NDArray[np.float64], matrices: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the values with a matrix for each of the axes z, y, x applied to them.

    Layer by layer: products as small as these are computed by one thread. Several threads would wait for each other for
    seconds on a busy machine, where one takes a tenth.
    """
    z, y, x = matrices
    made = y @ (values @ x.T)
    return (z @ made.transpose(1, 0, 2)).transpose(1, 0, 2)


def _box_around(shape: NDArray[np.intp], centre: NDArray[np.float64], width: int) -> tuple[Box, tuple[int, int, int]]:
    """Return the box of at most `width` samples along each axis around a place that is given in fractions."""
    sizes = np.minimum(shape, width)
    first = np.clip((centre * shape - sizes / 2).astype(int), 0, shape - sizes)
    z, y, x = (slice(int(a), int(a + n)) for a, n in zip(first, sizes, strict=True))
    return (z, y, x), (int(sizes[0]), int(sizes[1]), int(sizes[2]))


def _floats(values: NDArray) -> NDArray[np.float64]:
    found = values.astype(np.float64)
    known = np.isfinite(found)
    if not known.all():
        found[~known] = found[known].mean() if known.any() else 0.0
    return found
