"""Derivatives from the nearest neighbours: central differences, and their mean over the 26 (Zucker, Hummel 1981)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.gradient.neighbourhood import Neighbourhood, along, vector_along

# Weights of the neighbours at distance √2 and √3 beside that at 1.
_EDGE, _CORNER = 2**-0.5, 3**-0.5


def central(block: Neighbourhood) -> list[NDArray]:
    """Derivatives along z, y, x, per step of the index, at the samples of the box."""
    return [_difference(block, axis, across=0)[0] for axis in range(3)]


def zucker_hummel(block: Neighbourhood) -> list[NDArray]:
    """Derivatives along z, y, x, per step of the index, at the samples of the box.

    The planes one step before and after a sample hold nine neighbours each, which weigh 1, 1/√2 or 1/√3 by their
    distance. Opposite ones have the same weight, so their difference is the mean of nine central differences, and that
    is how it stays exact where some of the nine are not to be had.
    """
    derivatives = []
    for axis in range(3):
        derivative, known = _difference(block, axis, across=1)
        y, x = (a for a in range(3) if a != axis)
        if known is None:
            # Beyond the border there are no lines; their weights are the same for all samples along the axis.
            inside = [block.inside(a)[block.reach - 1 : block.values.shape[a] - block.reach + 1] for a in (y, x)]
            weights = (vector_along(y, inside[0]) & vector_along(x, inside[1])).astype(derivative.dtype)
            if not weights.all():
                derivative *= weights
        else:
            weights = known.astype(derivative.dtype)
        total = _spread(weights, y, x)
        mean = _spread(derivative, y, x)
        np.divide(mean, total, out=mean, where=total > 0)  # where none is known the sum is 0, and stays it
        derivatives.append(mean)
    return derivatives


def _difference(block: Neighbourhood, axis: int, across: int) -> tuple[NDArray, NDArray[np.bool_] | None]:
    """Central difference along an axis, one-sided beside a gap, 0 in one; and where it is known, None for everywhere.

    Both go `across` samples beyond the box along the other axes.
    """
    values = _trimmed(block, block.values, axis, across)
    size = values.shape[axis]
    before, after = values[along(axis, 0, size - 2)], values[along(axis, 2, size)]
    if block.there is None:
        # Beyond the border the outermost sample stands for its neighbour: half the way.
        first = np.maximum(block.positions(axis)[block.reach : -block.reach] - 1, 0)
        last = np.minimum(block.positions(axis)[block.reach : -block.reach] + 1, block.counts[axis] - 1)
        fraction = (1 / np.maximum(last - first, 1)).astype(values.dtype)
        derivative = after - before
        derivative *= vector_along(axis, fraction)
        return derivative, None
    there = _trimmed(block, block.there, axis, across)
    is_before, is_after = there[along(axis, 0, size - 2)], there[along(axis, 2, size)]
    here, is_here = values[along(axis, 1, size - 1)], there[along(axis, 1, size - 1)]
    known = (is_before & is_after) | (is_here & (is_before | is_after))
    derivative = np.where(is_after, after, here) - np.where(is_before, before, here)
    derivative *= np.where(is_before & is_after, 0.5, 1).astype(values.dtype)
    return np.where(known, derivative, 0), known


def _trimmed(block: Neighbourhood, numbers: NDArray, axis: int, across: int) -> NDArray:
    """Return the samples of the box, widened by `across` and by one along the axis."""
    part = block.crop(numbers, across, axis)
    return part[along(axis, block.reach - 1, part.shape[axis] - block.reach + 1)]


def _spread(numbers: NDArray, y: int, x: int) -> NDArray:
    """Weighted sum over 3 × 3 neighbours along two axes; both get two shorter."""
    width, height = numbers.shape[x], numbers.shape[y]
    middle = numbers[along(x, 1, width - 1)]
    sides = numbers[along(x, 0, width - 2)] + numbers[along(x, 2, width)]
    beside = middle * _EDGE + sides * _CORNER
    total = beside[along(y, 0, height - 2)] + beside[along(y, 2, height)]
    total += (middle + sides * _EDGE)[along(y, 1, height - 1)]
    return total
