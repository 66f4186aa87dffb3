"""Labels that hide the others: the outermost ones, as skin or fluid around a brain, or an organ around its tumour.

Rays along the axes of the grid, from both ends, tell which label is met first on the way to each other one. Where at
least half of the labels are hidden, those that most rays meet first are taken away one after the other, skin and then
the fluid under it, for as long as one label alone is met by a large part of the rays. The first few without which most
others are seen are covering.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.label_counts import label_counts
from texvol.scene.volume import Volume

_LOOKED_AT = 1 << 20  # samples
_SEEN = 0.1  # least fraction of the rays through a label that meet it first, where it is not hidden
_HIDDEN = 0.5  # least fraction of the labels that are hidden where some are covering
_OUTER = 0.25  # least fraction of the rays that meet a covering label first
_MOST_LABELS = 1024


class Covering(NamedTuple):
    """A label that hides most others, and its mean length along rays that meet it, world units."""

    label: int
    thickness: float


def covering_labels(volume: Volume, clear: Sequence[int] = (0,)) -> list[Covering]:
    """Return the labels that hide most of the others, outermost first; those that are `clear` hide nothing."""
    labels = label_counts(volume).labels
    if labels.size > _MOST_LABELS:
        return []
    step = max(int(np.ceil((volume.size / _LOOKED_AT) ** (1 / 3))), 1)
    few = volume.values[tuple(slice(None, None, min(step, max(count // 8, 1))) for count in volume.shape)]
    ranks = np.searchsorted(labels, few)
    ranks_found = _covering(ranks, np.isin(labels, list(clear)))
    return [Covering(int(labels[rank]), _thickness(volume, ranks == rank)) for rank in ranks_found]


def _covering(ranks: NDArray[np.intp], gone: NDArray[np.bool_]) -> list[int]:
    """Return the ranks of the labels without which most others are seen, outermost first; none if half are anyway."""
    first = _met_first(ranks, gone)
    seen = _seen(first)
    there = int(first.any(axis=0).sum())
    if not there or 1 - int(seen.sum()) / there < _HIDDEN:
        return []
    outer: list[int] = []
    gone, best, most = gone.copy(), 0, 0
    while (total := int(np.diagonal(first).sum())) and np.diagonal(first).max() >= _OUTER * total:
        outer.append(int(np.diagonal(first).argmax()))
        gone[outer[-1]] = True
        first = _met_first(ranks, gone)
        uncovered = int(_seen(first).sum())
        if uncovered > max(most, 2 * int((seen & ~gone).sum())):
            best, most = len(outer), uncovered
    return outer[:best]


def _seen(first: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which labels are not hidden."""
    through = first.sum(axis=0)
    return (through > 0) & (np.diagonal(first) >= _SEEN * through)


def _met_first(ranks: NDArray[np.intp], gone: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return numbers of rays [i, k] through label k that meet label i before all others, itself if i is k."""
    count = gone.size
    met = np.zeros((count, count), np.intp)
    for axis in range(3):
        lines = np.moveaxis(ranks, axis, -1).reshape(-1, ranks.shape[axis])
        shows = ~gone[lines]
        rays = np.flatnonzero(shows.any(axis=1))
        lines, shows = lines[rays], shows[rays]
        there = np.zeros((rays.size, count), np.bool_)
        ray, place = np.nonzero(shows)
        there[ray, lines[ray, place]] = True
        ray, label = np.nonzero(there)
        last = lines.shape[1] - 1
        for place in (shows.argmax(axis=1), last - shows[:, ::-1].argmax(axis=1)):
            outer = lines[np.arange(rays.size), place]
            met += np.bincount(outer[ray] * count + label, minlength=count * count).reshape(count, count)
    return met


def _thickness(volume: Volume, inside: NDArray[np.bool_]) -> float:
    """Return the mean length of a label along rays of the three axes that meet it."""
    lengths = []
    for axis, count, edge in zip(range(3), inside.shape, np.linalg.norm(volume.box_edges, axis=0)[::-1], strict=True):
        on_rays = inside.sum(axis=axis)
        lengths.append(float(on_rays[on_rays > 0].mean()) * float(edge) / count)
    return float(np.mean(lengths))
