"""Covering designs: a few rows in which every few values of switches that can occur together do occur together.

A mistake in a condition shows where the values of a few switches meet, whatever the other switches are. A covering
design of strength t has a row for every t values that occur together anywhere, so that a hundred rows stand for the
product of 27 switches. Rows are found greedily (Cohen, Dalal, Fredman and Patton 1997, "The AETG system").
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from functools import reduce

import numpy as np

Block = Mapping[str, Sequence[int]]  # values of each switch, of which any go together
_CANDIDATES = 4  # rows of which the best is taken


def covering(blocks: Sequence[Block], strength: int) -> Iterator[dict[str, int]]:
    """Yield rows of the blocks, in which every `strength` values occur together that do so in any row of any block.

    Parameters
    ----------
    blocks : sequence of mappings
        Each stands for the product of its values; all have the same switches.
    """
    items = sorted({(name, value) for block in blocks for name, values in block.items() for value in values})
    numbers = {item: number for number, item in enumerate(items)}
    columns = [[[numbers[name, value] for value in values] for name, values in block.items()] for block in blocks]
    left = _wanted([name for name, _ in items], columns, strength)
    chance = random.Random(0)
    while left.any():
        first = np.unravel_index(left.argmax(), left.shape)
        homes = [block for block in columns if {*first} <= {item for values in block for item in values}]
        candidates = [_row(chance.choice(homes), list(first), left, chance) for _ in range(_CANDIDATES)]
        best = max(candidates, key=lambda row: left[np.ix_(*[row] * strength)].sum())
        left[np.ix_(*[best] * strength)] = False
        yield dict(items[number] for number in sorted(best))


def _wanted(names: list[str], columns: list[list[list[int]]], strength: int) -> np.ndarray:
    """True at every tuple of items that has a row, in each of its orders; one axis for each item of a tuple."""
    wanted = np.zeros((len(names),) * strength, bool)
    for block in columns:
        wanted[np.ix_(*[np.concatenate(block)] * strength)] = True
    differs = np.array(names)[:, np.newaxis] != np.array(names)
    axes = range(strength)
    return reduce(
        np.logical_and,
        (
            differs.reshape([len(names) if axis in (first, second) else 1 for axis in axes])
            for second in axes
            for first in range(second)
        ),
        wanted,
    )


def _row(block: list[list[int]], row: list[int], left: np.ndarray, chance: random.Random) -> list[int]:
    """`row` with an item of each other column, of which each brings the most that is left with those before it."""
    others = [values for values in block if not {*values} & {*row}]
    for values in chance.sample(others, len(others)):
        pairs = np.ix_(*[row] * (left.ndim - 1))
        row = [*row, max(chance.sample(values, len(values)), key=lambda item: left[item][pairs].sum())]
    return row
