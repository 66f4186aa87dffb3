"""Materials (Drebin, Carpenter, Hanrahan 1988): a value is a mixture, and each material has a fraction of it.

A material's fraction rises from 0 at a to 1 at b and falls from 1 at c to 0 at d. With the colour c_i and the
extinction τ_i of material i, a value v has

    extinction  Σ share_i(v) τ_i          emission  Σ share_i(v) τ_i c_i

Both are piecewise linear in v, so that premultiplied points at all a, b, c, d hold them exactly. Where the fraction
of an opaque material is above 0, all is opaque and shows the mean colour of the opaque ones, weighted by their
fractions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from texvol.scene.transfer import pieces
from texvol.scene.transfer.graded import Graded
from texvol.scene.transfer.pieces import LARGEST_VALUE, Numbers
from texvol.util.errors import InputError

Triple = tuple[float, float, float]
Pair = tuple[float, float]
# Straight points of another colour and extinction at either end have an emission that is a parabola. As 32 lines it is
# off by at most (change of colour) (change of extinction) / 4 / 32²: 2.4e-4 of the most that it could be.
_LINES_PER_PARABOLA = 32
# How far after its position an opaque ramp begins, in fractions of its width and of the values: float32 tells the two
# apart.
_AFTER = 2.0**-18


# Part of a mixture: values, shape (n,), and rows of emission (3), extinction, opaque fraction and opaque fraction times
# colour (3), shape (n, 8).
_Part = tuple[Numbers, Numbers]


@dataclass(frozen=True)
class Material:
    """A named range of values with a colour and an extinction, data and world units.

    Equal values of a ramp make a step, whose right side holds at the value itself.
    """

    name: str
    rises: Pair | None  # values between which its fraction rises from 0 to 1; None where it has no lower end
    falls: Pair | None  # values between which its fraction falls again; None where it has no upper end
    color: Triple  # linear and straight, in [0, 1]
    extinction: float  # per world unit, from 0 to infinity; finite with a gradient
    gradient: Pair | None = None  # gradient magnitudes between which it appears, see `Graded`

    def fractions(self, values: ArrayLike) -> Numbers:
        """Its fraction of each value, from 0 to 1."""
        knots, fractions = self._corners
        return pieces.sides(knots, fractions[:, np.newaxis], np.asarray(values, np.float64))[..., 0]

    @property
    def typical(self) -> float:
        """The middle of the values that it has for itself, or their end where one is open; InputError if both are."""
        if self.rises and self.falls:
            return self.rises[1] / 2 + self.falls[0] / 2
        if self.rises or self.falls:
            return self.rises[1] if self.rises else self.falls[0]  # type: ignore[index]
        raise InputError(f"material {self.name!r} must have from or to, or no typical value is known")

    @property
    def _corners(self) -> tuple[Numbers, Numbers]:
        knots = [*(self.rises or ()), *(self.falls or ())]
        fractions = [*((0.0, 1.0) if self.rises else ()), *((1.0, 0.0) if self.falls else ())]
        return np.array(knots or [0.0]), np.array(fractions or [1.0])

    @property
    def emission(self) -> Numbers:
        """Colour times extinction, where that is finite."""
        return np.array(self.color) * self.extinction

    def graded(self) -> Graded:
        """The material as a medium that depends on the gradient."""
        assert self.gradient is not None
        knots, fractions = self._corners
        # An open end holds as far as values go.
        knots = np.concatenate([[] if self.rises else [-LARGEST_VALUE], knots, [] if self.falls else [LARGEST_VALUE]])
        fractions = np.concatenate([[] if self.rises else [1.0], fractions, [] if self.falls else [1.0]])
        return Graded(knots, fractions[:, np.newaxis] * self.emission, fractions * self.extinction, *self.gradient)

    def part(self) -> _Part:
        """The material as a part of a mixture."""
        knots, fractions = self._corners
        opaque = bool(np.isinf(self.extinction))
        row = [0, 0, 0, 0, 1, *self.color] if opaque else [*self.emission, self.extinction, 0, 0, 0, 0]
        return knots, fractions[:, np.newaxis] * np.array(row)


def boundary(materials: Sequence[Material], magnitude: float) -> Graded:
    """Levoy's region boundary (1988): from one material's typical value to the next's, times |∇f| / magnitude up to 1.

    Raises
    ------
    InputError
        If a material is opaque, or they don't go from low to high values.
    """
    for each in materials:
        if np.isinf(each.extinction):
            raise InputError(f"material {each.name!r} must not be opaque, since it depends on the gradient")
    values = np.array([each.typical for each in materials])
    fallen = np.flatnonzero(np.diff(values) < 0)
    if fallen.size:
        before, after = materials[fallen[0]], materials[fallen[0] + 1]
        raise InputError(
            f"the materials must go from low to high values, got {after.name!r} ({after.typical:g}) after "
            f"{before.name!r} ({before.typical:g})"
        )
    emissions = np.array([each.emission for each in materials])
    return Graded(values, emissions, np.array([each.extinction for each in materials]), 0.0, magnitude)


class Points(Protocol):
    """Control points of a transfer function."""

    @property
    def values(self) -> Numbers: ...
    @property
    def colors(self) -> Numbers: ...
    @property
    def extinctions(self) -> Numbers: ...
    @property
    def emissive(self) -> bool: ...
    @property
    def premultiplied(self) -> bool: ...
    @property
    def numbers(self) -> Numbers: ...
    def at(self, values: ArrayLike) -> Numbers: ...


def mixture(materials: Sequence[Material], points: Points | None = None) -> tuple[Numbers, Numbers, Numbers]:
    """Values, emissions and extinctions of premultiplied points: what materials, and other points, add up to.

    Straight `points` of another colour and extinction at either end of a line are taken as 32 lines.
    """
    parts = [each.part() for each in materials] + ([_part_of(points)] if points else [])
    if not parts:
        return np.zeros(1), np.zeros((1, 3)), np.zeros(1)
    positions = np.unique(np.concatenate([knots for knots, _ in parts]))
    before, after = (
        np.sum([pieces.sides(*part, positions, right) for part in parts], axis=0) for right in (False, True)
    )
    opaque_here = np.array([_opaque_at(position, materials, points) for position in positions])
    found: list[tuple[float, Numbers]] = []
    for number, position in enumerate(positions):
        left = _looks(before[number], after[number - 1] if number else before[number])
        right = _looks(after[number], before[number + 1] if number + 1 < len(positions) else after[number])
        here = right if opaque_here[number] else after[number, :4]
        found.append((position, left))
        if not np.array_equal(here, left):
            found.append((position, here))
        if not np.array_equal(right, here):
            # The ramp of an opaque material has its fraction of 0 still at its position, and is opaque from there on.
            width = positions[number + 1] - position
            found.append((position + min(_AFTER * max(width, abs(position)), width / 2), right))
    values, numbers = np.array([position for position, _ in found]), np.array([numbers for _, numbers in found])
    return values, numbers[:, :3], numbers[:, 3]


def _looks(row: Numbers, other_end: Numbers) -> Numbers:
    """Emission and extinction at one end of a line, or colour and infinity where the line is opaque."""
    if not (row[4] > 0 or other_end[4] > 0):
        return row[:4]
    # From a fraction of 0 on, the fractions of all that is opaque keep their ratios.
    opaque = row if row[4] > 0 else other_end
    return np.append(opaque[5:] / opaque[4], np.inf)


def _opaque_at(position: float, materials: Sequence[Material], points: Points | None) -> bool:
    if points is not None and np.isinf(points.at(position)[3]):
        return True
    return any(np.isinf(each.extinction) and each.fractions(position) > 0 for each in materials)


def _part_of(points: Points) -> _Part:
    """The points of a transfer function; the outer ones by themselves, too, for what lies beyond them."""
    knots, rows = [float(points.values[0])], [_row(points, 0)]
    for left, right in zip(range(len(points.values) - 1), range(1, len(points.values)), strict=True):
        if points.values[right] == points.values[left]:
            continue
        opaque = bool(np.isinf(points.extinctions[[left, right]]).any())
        for fraction in np.linspace(0, 1, _lines_of(points, left, right, opaque) + 1):
            knots.append(float(points.values[left] * (1 - fraction) + points.values[right] * fraction))
            rows.append(_row_between(points, left, right, float(fraction), opaque))
    return np.array([*knots, points.values[-1]]), np.array([*rows, _row(points, len(points.values) - 1)])


def _lines_of(points: Points, left: int, right: int, opaque: bool) -> int:
    extinctions, colors = points.extinctions[[left, right]], points.colors[[left, right]]
    straight = points.premultiplied or opaque or extinctions[0] == extinctions[1] or np.array_equal(*colors)
    return 1 if straight else _LINES_PER_PARABOLA


def _row(points: Points, number: int) -> Numbers:
    return _row_between(points, number, number, 0.0, bool(np.isinf(points.extinctions[number])))


def _row_between(points: Points, left: int, right: int, fraction: float, opaque: bool) -> Numbers:
    color = points.colors[left] * (1 - fraction) + points.colors[right] * fraction
    numbers = points.numbers[:, 3]
    extinction = numbers[left] * (1 - fraction) + numbers[right] * fraction
    finite = not opaque or bool(np.isfinite(points.extinctions[left if fraction == 0 else right]))
    emission = color if points.premultiplied else color * extinction
    row = np.zeros(8)
    if finite:
        row[:4] = [*emission, extinction]
    if opaque:
        row[4:] = [1, *color]
    return row
