"""Cells of a curvilinear grid, and the location of points in them.

A cell's points are p(u) = Σ w_c(u) p_c over its 8 corners, u from 0 to 1 along each grid axis and w_c the trilinear
weights. As a polynomial, with one bit of m for each axis,

    p(u) = Σ_m b_m (u - 1/2)^m,      with the product of those components whose bit m has,

and u(p) is found by Newton's method from the cell's middle; for a parallelepiped the first step is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.resampling import Floats
from texvol.formats.readers.samples import FileFault

_CHUNK = 2**16  # cells, or trials of a point in a cell, per step: intermediates stay in the cache
_FLAT = 1e-6  # volume of a cell, relative to the product of its edges, below which `Volume` calls it flat
_FOLDED = 1e-3  # of the cell's largest Jacobian: a negative corner beyond this is not rounding
_MOST_STEPS = 30
# Newton's method squares the error: after a millionth of a cell the next step reaches rounding. The limit is some
# thousand times the rounding of float64.
_CONVERGED = 1e-12
_EDGE = 1e-9  # of a cell: points this far outside count as on the face
_REACH = 0.5  # of a cell: steps are clipped this far outside, where Newton's method may diverge
_MOST_TRIALS = 30  # per cell and point; the bounding box of an oblique cell has points of a few other cells


class Cells:
    """Cells of a grid of points, numbered along x, then y, then z.

    Parameters
    ----------
    points : array of shape (nz, ny, nx, 3)
        Finite; two or more along each axis.
    """

    def __init__(self, points: NDArray) -> None:
        self.shape = tuple(size - 1 for size in points.shape[2::-1])  # x, y, z
        self.count = int(np.prod(self.shape))
        self._points = points
        nx, ny = points.shape[2], points.shape[1]
        self._strides = (1, nx, nx * ny)

    def index(self, cells: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return indices x, y, z of the cells' first corners, shape (m, 3)."""
        x, y, _ = self.shape
        return np.stack([cells % x, cells // x % y, cells // (x * y)], axis=-1)

    def corners(self, cells: NDArray[np.intp], origin: Floats) -> Floats:
        """Return the cells' corners from `origin`, shape (8, m, 3); bit a of a corner is its side on axis a."""
        first = self.index(cells) @ np.array(self._strides)
        flat = self._points.reshape(-1, 3)
        found = np.empty((8, len(cells), 3))
        for corner in range(8):
            away = sum(stride for axis, stride in enumerate(self._strides) if corner >> axis & 1)
            found[corner] = flat[first + away]
        return found - origin

    def blocks(self) -> Iterator[NDArray[np.intp]]:
        """Yield the numbers of all cells, in chunks."""
        for begin in range(0, self.count, _CHUNK):
            yield np.arange(begin, min(begin + _CHUNK, self.count))

    def check(self, origin: Floats, extent: Floats) -> int:
        """Return the number of flat cells; raise FileFault if all are flat, or cells are folded or of mixed handedness.

        Lengths are fractions of the grid's `extent`, since its axes may have different units.
        """
        flat_cells, turned = 0, {True: -1, False: -1}
        for block in self.blocks():
            corners = self.corners(block, origin) / extent
            jacobians = np.stack([_jacobian(corners, corner) for corner in range(8)])
            edges = np.ones(len(block))
            for axis in range(3):
                steps = [corners[c | 1 << axis] - corners[c] for c in range(8) if not c >> axis & 1]
                edges *= np.max([np.linalg.norm(step, axis=1) for step in steps], axis=0)
            largest = np.abs(jacobians).max(axis=0)
            is_flat = ~(largest > _FLAT * edges)
            flat_cells += int(is_flat.sum())
            most = _FOLDED * largest
            folded = ~is_flat & (jacobians.min(axis=0) < -most) & (jacobians.max(axis=0) > most)
            if folded.any():
                where = self._name(block[np.argmax(folded)])
                raise FileFault(
                    f"cell {where} is folded: its corners have both orientations, so it covers points twice"
                )
            is_left = jacobians.sum(axis=0) < 0
            for side in (True, False):
                found = np.flatnonzero(~is_flat & (is_left == side))
                if found.size and turned[side] < 0:
                    turned[side] = int(block[found[0]])
        if flat_cells == self.count:
            raise FileFault(f"is flat: none of its {self.count} cells has a volume")
        if min(turned.values()) >= 0:
            names = " and ".join(self._name(cell) for cell in sorted(turned.values()))
            raise FileFault(f"its grid is folded: cells {names} have opposite orientations")
        return flat_cells

    def _name(self, cell: int) -> str:
        return "({}, {}, {})".format(*self.index(np.array([cell]))[0])

    def locate(self, origin: Floats, spacing: Floats, counts: list[int]) -> Iterator[tuple[NDArray[np.intp], Floats]]:
        """Yield the points of a regular grid along the world's axes that are inside cells.

        Yields
        ------
        array of shape (m,)
            The points, numbered along x, then y, then z. A point on a face may be in several cells.
        array of shape (m, 3)
            Their positions in the grid of points: index x, y, z.
        """
        trials = 0
        for block in self.blocks():
            corners = self.corners(block, origin) / spacing
            maps = _Maps(corners)
            low = np.clip(np.ceil(corners.min(axis=0) - _EDGE), 0, counts).astype(np.intp)
            high = np.clip(np.floor(corners.max(axis=0) + _EDGE), -1, np.array(counts) - 1).astype(np.intp)
            sizes = np.maximum(high - low + 1, 0)
            ends = np.cumsum(sizes.prod(axis=1))
            trials += int(ends[-1])
            most = _MOST_TRIALS * (self.count + int(np.prod(counts)))
            if trials > most:
                raise FileFault(
                    f"its cells are so oblique, or overlap so much, that finding {' x '.join(map(str, counts))} "
                    f"points in them takes more than {most} trials; choose fewer points with --resolution NX,NY,NZ"
                )
            for begin in range(0, int(ends[-1]), _CHUNK):
                number = np.arange(begin, min(begin + _CHUNK, int(ends[-1])))
                cell = np.searchsorted(ends, number, side="right")
                within = number - (ends[cell] - sizes[cell].prod(axis=1))
                x, y = sizes[cell, 0], sizes[cell, 1]
                point = low[cell] + np.stack([within % x, within // x % y, within // (x * y)], axis=-1)
                chosen, u = maps.locate(cell, point.astype(np.float64))
                numbers = point[chosen] @ np.array([1, counts[0], counts[0] * counts[1]])
                yield numbers, self.index(block[cell[chosen]]) + u


def _jacobian(corners: Floats, corner: int) -> Floats:
    """Return the volume spanned by the edges at a corner of cells, positive if right-handed, shape (m,)."""
    edges = [(corners[corner | 1 << axis] - corners[corner & ~(1 << axis)]).T for axis in range(3)]
    return _determinant(*edges)


def _determinant(a: Floats, b: Floats, c: Floats) -> Floats:
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


class _Maps:
    """Maps of the cells as polynomials around their middles, arrays of shape (…, 3, m)."""

    def __init__(self, corners: Floats) -> None:
        # b_m from half sums and differences along each axis.
        terms = np.ascontiguousarray(corners.transpose(0, 2, 1))
        for axis in range(3):
            for m in range(8):
                if m >> axis & 1:
                    low, high = terms[m & ~(1 << axis)], terms[m]
                    terms[m], terms[m & ~(1 << axis)] = high - low, (high + low) / 2
        self.terms = terms
        self.size = np.abs(terms[1:]).max(axis=(0, 1))
        columns = tuple(terms[1 << axis] for axis in range(3))
        # Bound of the terms beyond the linear ones: |u| is at most 1/2 in the cell.
        fractions = {3: 0.25, 5: 0.25, 6: 0.25, 7: 0.125}
        self.beyond = np.sum(
            [fraction * np.abs(_solved(columns, terms[m])) for m, fraction in fractions.items()], axis=0
        )

    def locate(self, cell: NDArray[np.intp], point: Floats) -> tuple[NDArray[np.intp], Floats]:
        """Return which of the points, shape (m, 3), are inside the given cells, and their positions there, 0 to 1."""
        point = point.T
        terms = self.terms[:, :, cell]
        columns = (terms[1], terms[2], terms[4])
        found = _solved(columns, point - terms[0])
        # Points that the estimate puts outside by more than its error are dropped, and so are non-finite ones.
        near = (np.abs(found) <= 0.5 + self.beyond[:, cell] + _EDGE).all(axis=0)
        trial = np.flatnonzero(near)
        cell, point, terms, found = cell[trial], point[:, trial], terms[:, :, trial], found[:, trial]
        found = np.clip(found, -0.5 - _REACH, 0.5 + _REACH)
        chosen, positions = [], []
        for _ in range(_MOST_STEPS):
            u, v, w = found
            along_u = terms[1] + v * (terms[3] + w * terms[7]) + w * terms[5]
            # Relative to the middle: far from the grid's origin the position alone would lose digits.
            missed = (point - terms[0]) - (u * along_u + v * (terms[2] + w * terms[6]) + w * terms[4])
            ends = np.abs(missed).max(axis=0) <= _CONVERGED * self.size[cell]
            chosen.append(trial[ends])
            positions.append(found[:, ends])
            along_v = terms[2] + u * (terms[3] + w * terms[7]) + w * terms[6]
            along_w = terms[4] + u * (terms[5] + v * terms[7]) + v * terms[6]
            moved = np.clip(found + _solved((along_u, along_v, along_w), missed), -0.5 - _REACH, 0.5 + _REACH)
            # A point that stays at the clipped border is outside; a point without a finite step is nowhere.
            going = ~ends & np.isfinite(moved).all(axis=0) & (moved != found).any(axis=0)
            if not going.any():
                break
            if not going.all():
                cell, trial, point, terms = cell[going], trial[going], point[:, going], terms[:, :, going]
            found = moved[:, going]
        number, position = np.concatenate(chosen), np.concatenate(positions, axis=1).T + 0.5
        inside = ((position >= -_EDGE) & (position <= 1 + _EDGE)).all(axis=1)
        return number[inside], np.clip(position[inside], 0.0, 1.0)


def _solved(columns: Sequence[Floats], right: Floats) -> Floats:
    """Return x of Σ_a columns_a x_a = right, by Cramer's rule, shape (3, m); not finite where the columns are flat."""
    a, b, c = columns
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        parts = (_determinant(right, b, c), _determinant(a, right, c), _determinant(a, b, right))
        return np.stack(parts) / _determinant(a, b, c)
