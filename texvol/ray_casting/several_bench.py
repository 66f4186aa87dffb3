"""The room in which a ray through several volumes is worked on: a `Bench` for each volume, and what they share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.compiling import inlined
from texvol.ray_casting.lit_ray import Bench, bench_for

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


class SeveralBench(NamedTuple):
    """Scratch arrays of one thread; the first axis is that of the volumes, where nothing else is said."""

    spans: Numbers  # s where the ray enters and leaves the box, (…, 2); the first is larger once nothing is left
    inside: NDArray[np.bool_]
    cells: Indices  # (…, 3)
    faces: Numbers  # s where it leaves that along each axis, (…, 3)
    fresh: NDArray[np.bool_]  # whether the cell is a new one
    visible: NDArray[np.bool_]  # whether there may be something in the cell
    opaque: NDArray[np.bool_]  # whether a sample of the cell is
    values: Numbers  # of a cell, (…, 8)
    weights: Numbers  # of its mask, (…, 8)
    channels: Numbers  # emission and extinction of its samples, (…, 4, 8)
    corners: Numbers  # the values of a piece, gaps mended, (…, 8)
    slopes: Numbers  # (…, 3, 8)
    field: Numbers  # (…, 4, 4)
    weight: Numbers  # (…, 4)
    chosen: Indices
    margins: Numbers
    posts: Indices  # which volumes a piece has that are classified after interpolation
    seen: Indices  # which of these are seen in a part of it
    counts: Indices  # how many `seen` has
    cubics: Numbers  # emission and extinction of all others together, of no volume: (4, 4)
    mixed: Numbers  # colour of what is opaque, and its weight, of no volume: (4)
    mended: Numbers  # channels of a piece, of no volume: (4, 8)
    square: Numbers  # from here on as in `Bench`, of no volume
    polynomial: Numbers
    root_stack: Numbers
    cuts: Numbers
    glows: Numbers
    halves: Numbers
    stack: Numbers


def several_bench(volumes: int, most_cuts: int, most_chosen: int) -> SeveralBench:
    """Room for a scene."""

    def numbers(*shape: int) -> Numbers:
        return np.zeros((volumes, *shape))

    def flags() -> NDArray[np.bool_]:
        return np.zeros(volumes, np.bool_)

    def indices(*shape: int) -> Indices:
        return np.zeros((volumes, *shape), np.int64)

    one = bench_for(most_cuts, most_chosen)
    return SeveralBench(
        *(numbers(2), flags(), indices(3), numbers(3), flags(), flags(), flags()),
        *(numbers(8), numbers(8), numbers(4, 8), numbers(8), numbers(3, 8), numbers(4, 4), numbers(4)),
        *(indices(most_chosen), numbers(), indices(), indices(), np.zeros(1, np.int64)),
        *(np.zeros((4, 4)), np.zeros(4), np.zeros((4, 8))),
        *(one.square, one.polynomial, one.root_stack, one.cuts, one.glows, one.halves, one.stack),
    )


@inlined
def bench_of(bench, v, first_cut):
    """The `Bench` of volume v; its cuts are written behind those that there are."""
    return Bench(
        bench.corners[v],
        bench.slopes[v],
        bench.channels[v],
        bench.field[v],
        bench.weight[v],
        bench.square,
        bench.polynomial,
        bench.root_stack,
        bench.cuts[first_cut:],
        bench.chosen[v],
        bench.glows,
        bench.halves,
        bench.stack,
    )
