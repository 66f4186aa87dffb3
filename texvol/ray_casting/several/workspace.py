"""Scratch memory of a ray through several volumes: a `Workspace` for each volume, and what all volumes share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.compiling import inlined
from texvol.ray_casting.common.rays import Numbers
from texvol.ray_casting.lit.workspace import Intervals, Workspace, workspace_for

Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Progress(NamedTuple):
    """How far a ray is in the grid of each volume."""

    spans: Numbers  # s where the ray enters and leaves the box, (volumes, 2); the first is larger behind the box
    inside: Flags  # True while the ray is in the box
    cells: Indices  # the cell that the ray is in, (volumes, 3)
    faces: Numbers  # s where the ray leaves the cell along each axis, (volumes, 3)
    fresh: Flags  # True if the samples of the cell have not been loaded yet


class CellSamples(NamedTuple):
    """Samples of the present cell of each volume."""

    visible: Flags  # True if the cell may show anything
    opaque: Flags  # True if any sample is opaque
    values: Numbers  # (volumes, 8)
    weights: Numbers  # of the mask, (volumes, 8)


class SeveralWorkspace(NamedTuple):
    """Scratch memory of one thread."""

    progress: Progress
    samples: CellSamples
    each: Workspace  # the arrays of a cell and its fields have a first axis of volumes; the others are shared
    intervals: Intervals  # the same as `each.intervals`
    margins: Numbers  # values nearer to each other than this may be one value before rounding, (volumes)
    posts: Indices  # volumes in a piece that are classified after interpolation
    seen: Indices  # volumes of `posts` that show in a part of the piece
    counts: Indices  # length of `seen`, (1)
    cubics: Numbers  # emission and extinction of all other volumes together, (4, 4)
    mixed: Numbers  # colour and weight of opaque volumes at one position, (4)
    mended: Numbers  # `channels` of one volume, without the opaque corners that have no weight, (4, 8)


def several_workspace(volumes: int, most_cuts: int, most_chosen: int) -> SeveralWorkspace:
    """Return a workspace for so many volumes, cuts in a piece, and indices in `chosen`."""

    def numbers(*shape: int) -> Numbers:
        return np.zeros((volumes, *shape))

    def flags() -> Flags:
        return np.zeros(volumes, np.bool_)

    def indices(*shape: int) -> Indices:
        return np.zeros((volumes, *shape), np.int64)

    one = workspace_for(most_cuts, most_chosen)
    return SeveralWorkspace(
        progress=Progress(numbers(2), flags(), indices(3), numbers(3), flags()),
        samples=CellSamples(flags(), flags(), numbers(8), numbers(8)),
        each=one._replace(
            corners=numbers(8),
            slopes=numbers(3, 8),
            channels=numbers(4, 8),
            field=numbers(4, 4),
            weight=numbers(4),
            chosen=indices(most_chosen),
        ),
        intervals=one.intervals,
        margins=numbers(),
        posts=indices(),
        seen=indices(),
        counts=np.zeros(1, np.int64),
        cubics=np.zeros((4, 4)),
        mixed=np.zeros(4),
        mended=np.zeros((4, 8)),
    )


@inlined
def workspace_of(workspace, v, first_cut):
    """Return the `Workspace` of volume v, whose cuts are written behind the first `first_cut`."""
    each = workspace.each
    return Workspace(
        each.corners[v],
        each.slopes[v],
        each.channels[v],
        each.field[v],
        each.weight[v],
        each.square,
        each.polynomial,
        each.root_stack,
        each.cuts[first_cut:],
        each.chosen[v],
        each.intervals,
    )
