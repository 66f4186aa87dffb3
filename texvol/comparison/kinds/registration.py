"""Registration: the shift between two pictures, to a hundredth of a pixel.

    candidate(x) = reference(x - d)

Small copies give a coarse d, the shift whose overlap differs least; Fourier transforms test all shifts at once. Then d
is refined from level to level by Gauss-Newton steps on the squared difference (Lucas, Kanade 1981): with the picture's
gradient g, (Σ g gᵀ) δ = -Σ g (candidate - shifted). Only pixels known in both pictures count, so that content that a
shift brings in at a border does no harm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_COARSE = 96  # pixels along the longer side of the coarsest copies
_FARTHEST = 0.45  # of a side; larger shifts leave too small an overlap
_LEAST_SHARED = 0.2  # of either picture's content, in the overlap
_TAPS = 8
_STEPS = 12  # each Gauss-Newton step at least halves the error of a good start
_DONE = 1e-4  # pixels
# Mean squares that count as equal: within half of the least, as noise makes them in overlaps of different sizes; or
# both below a hundredth of the mean square without a shift.
_AS_GOOD, _NEGLIGIBLE = 1.5, 0.01
_LOOKED_AT, _STARTS = 40, 4  # whole shifts that are tried, and that are refined
# Pixels along the longest side of a refined copy: half the size locates smooth content to a thousandth, too.
_LARGEST_FINE = 1024
_LEAST_SOFTENED = 32  # pixels along a side; softening removes two


def estimate(candidate: NDArray, reference: NDArray) -> tuple[float, float]:
    """Return the shift (dx, dy) of the candidate to the right and down, in pixels, from grey pictures (h, w)."""
    # Softened outlines suit interpolation and gradients better than outlines that jump from pixel to pixel.
    if min(candidate.shape) >= _LEAST_SOFTENED:
        candidate, reference = _softened(candidate), _softened(reference)
    levels = _pyramid(candidate, reference)
    # For periodic content several shifts look alike until they are refined.
    coarsest = levels[-1]
    starts = [_refined(*coarsest, *start) for start in {(0.0, 0.0): 0, **dict.fromkeys(_coarse(*coarsest))}]
    # Shifts by periods of the content fit, too: the smallest shift is chosen.
    unmoved = float(np.square(coarsest[0] - coarsest[1]).mean())
    fits = _AS_GOOD * min(starts)[0] + _NEGLIGIBLE * unmoved
    _, dx, dy = min((each for each in starts if each[0] <= fits), key=lambda each: max(abs(each[1]), abs(each[2])))
    for one, two in reversed(levels[:-1]):
        dx, dy = 2 * dx, 2 * dy
        if max(one.shape) <= _LARGEST_FINE:
            _, dx, dy = _refined(one, two, dx, dy)
    return dx, dy


def shifted(picture: NDArray, dx: float, dy: float, taps: int = _TAPS) -> tuple[NDArray, tuple[slice, slice]]:
    """Move a picture by (dx, dy); return the pixels with known sources, and their (rows, columns).

    Pixels are interpolated by polynomials through `taps` pixels along each axis (Lagrange); 2 taps are linear.
    """
    moved, rows = _shifted_along(picture, dy, taps, 0)
    moved, columns = _shifted_along(moved, dx, taps, 1)
    return moved, (rows, columns)


def taps_for(size: tuple[int, int]) -> int:
    """Number of pixels for the interpolation of a picture of that size, which loses as many at its borders."""
    return min(_TAPS, max(2, min(size) // 4 * 2))


def _shifted_along(picture: NDArray, distance: float, taps: int, axis: int) -> tuple[NDArray, slice]:
    count = picture.shape[axis]
    whole = int(np.floor(distance))
    fraction = distance - whole
    if fraction < 1e-9:
        kernel, first = np.ones(1), 0
    else:
        # moved[i] = Σ kernel[j] picture[i - whole - 1 + first + j]: the position i - distance lies between
        # i - whole - 1 and i - whole.
        kernel, first = _lagrange(1 - fraction, taps), -(taps // 2)
    lowest = whole - first
    start, stop = max(0, lowest), min(count, count + lowest - (len(kernel) - 1))
    if stop <= start:
        return np.take(picture, [], axis=axis), slice(0, 0)
    moved: NDArray | float = 0.0
    for j, weight in enumerate(kernel):
        part = slice(start - lowest + j, stop - lowest + j)
        moved = moved + picture.dtype.type(weight) * (picture[part] if axis == 0 else picture[:, part])
    return np.asarray(moved), slice(start, stop)


def _lagrange(at: float, taps: int) -> NDArray:
    """Weights of the pixels at 1 - taps/2 … taps/2 for the value at `at` in [0, 1)."""
    nodes = np.arange(taps) - (taps // 2 - 1)
    weights = np.ones(taps)
    for i, node in enumerate(nodes):
        rest = np.delete(nodes, i)
        weights[i] = np.prod((at - rest) / (node - rest))
    return weights


def _pyramid(candidate: NDArray, reference: NDArray) -> list[tuple[NDArray, NDArray]]:
    """The two pictures, and copies of half the size each, the smallest last."""
    levels = [(candidate, reference)]
    while max(levels[-1][0].shape) > _COARSE and min(levels[-1][0].shape) >= 16:
        levels.append((_halved(levels[-1][0]), _halved(levels[-1][1])))
    return levels


def _softened(picture: NDArray) -> NDArray:
    """Weighted means of 3×3 pixels, (1, 2, 1) / 4 along each axis."""
    rows = 0.25 * (picture[:-2] + picture[2:]) + 0.5 * picture[1:-1]
    return 0.25 * (rows[:, :-2] + rows[:, 2:]) + 0.5 * rows[:, 1:-1]


def _halved(picture: NDArray) -> NDArray:
    height, width = (side // 2 * 2 for side in picture.shape)
    part = picture[:height, :width]
    return 0.25 * (part[::2, ::2] + part[1::2, ::2] + part[::2, 1::2] + part[1::2, 1::2])


def _coarse(candidate: NDArray, reference: NDArray) -> list[tuple[float, float]]:
    """Whole shifts whose overlap differs least per pixel: Σ (c - r)² = Σ c² + Σ r² - 2 Σ c r over each overlap."""
    height, width = candidate.shape
    size = (2 * height, 2 * width)
    mean = 0.5 * (candidate.mean() + reference.mean())
    c, r = candidate - mean, reference - mean
    area, products, of_c, of_r = _correlations(c, r, size)
    with np.errstate(divide="ignore", invalid="ignore"):
        cost = (of_c + of_r - 2 * products) / area
    shifts = [np.fft.fftfreq(side, 1 / side) for side in size]
    near = (np.abs(shifts[0]) <= _FARTHEST * height)[:, np.newaxis] & (np.abs(shifts[1]) <= _FARTHEST * width)
    # A shift whose overlap is only empty borders proves nothing.
    near &= (of_c >= _LEAST_SHARED * (c * c).sum()) & (of_r >= _LEAST_SHARED * (r * r).sum())
    near[0, 0] = True
    cost = np.where(near, cost, np.inf)
    found: list[tuple[float, float]] = []
    for index in np.argsort(cost, axis=None)[:_LOOKED_AT]:
        row, column = divmod(int(index), size[1])
        dx, dy = float(shifts[1][column]), float(shifts[0][row])
        if np.isfinite(cost[row, column]) and all(max(abs(dx - x), abs(dy - y)) > 1 for x, y in found):
            found.append((dx, dy))
    return found[:_STARTS]


def _correlations(c: NDArray, r: NDArray, size: tuple[int, int]) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Number of pixels, Σ c r, Σ c² and Σ r² of the overlap for each shift."""
    known = np.fft.rfft2(np.ones_like(c), size)
    seen_c, seen_r = np.fft.rfft2(c, size), np.fft.rfft2(r, size)
    square_c, square_r = np.fft.rfft2(c * c, size), np.fft.rfft2(r * r, size)
    pairs = ((known, known), (seen_c, seen_r), (square_c, known), (known, square_r))
    area, products, of_c, of_r = (np.fft.irfft2(a * np.conj(b), size) for a, b in pairs)
    return np.maximum(np.rint(area), 0), products, of_c, of_r


def _refined(candidate: NDArray, reference: NDArray, dx: float, dy: float) -> tuple[float, float, float]:
    """Return (mean square, dx, dy) after Gauss-Newton steps from (dx, dy) that reduce the difference."""
    taps = min(6, taps_for(candidate.shape))
    best, best_cost = (dx, dy), float("inf")
    for _ in range(_STEPS):
        moved, (rows, columns) = shifted(reference, dx, dy, taps)
        if min(moved.shape) < 3:
            break
        off = candidate[rows, columns] - moved
        cost = float(np.square(off).mean())
        if not cost < best_cost:
            break
        best, best_cost = (dx, dy), cost
        step = _step(moved, off)
        if step is None:
            break
        step *= min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-12))  # the gradient holds for about a pixel
        dx, dy = dx + float(step[0]), dy + float(step[1])
        if np.abs(step).max() < _DONE:
            best = (dx, dy)
            break
    return best_cost, *best


def _step(moved: NDArray, off: NDArray) -> NDArray | None:
    """Return the step δ of the shift: moved(x - δ) ≈ moved - g·δ, so Σ g gᵀ δ = -Σ g off."""
    gx = 0.5 * (moved[1:-1, 2:] - moved[1:-1, :-2])
    gy = 0.5 * (moved[2:, 1:-1] - moved[:-2, 1:-1])
    inner = np.ascontiguousarray(off[1:-1, 1:-1])
    matrix = np.array([[np.vdot(gx, gx), np.vdot(gx, gy)], [np.vdot(gx, gy), np.vdot(gy, gy)]])
    largest = float(np.trace(matrix))
    if not largest > 0:
        return None
    # A shift along an edge is invisible; a fraction of the matrix's trace keeps that component unchanged.
    matrix = matrix + 1e-9 * largest * np.eye(2)
    return np.linalg.solve(matrix.astype(np.float64), -np.array([np.vdot(gx, inner), np.vdot(gy, inner)]))
