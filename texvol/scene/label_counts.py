"""Labels of a volume and their numbers of samples, counted once for each volume."""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.statistics import chunks

_MOST_COUNTERS = 2**20  # for labels that lie so close together; others are sorted, which takes ten times as long
_LISTED = 8  # labels of each end that a message names


class LabelCounts(NamedTuple):
    """Labels, ascending, and numbers of samples; both of shape (n,)."""

    labels: NDArray[np.int64]
    counts: NDArray[np.int64]


_KNOWN: WeakKeyDictionary[Volume, LabelCounts] = WeakKeyDictionary()


def label_counts(volume: Volume) -> LabelCounts:
    """Return the labels that a volume has; InputError if its values are not labels."""
    if not volume.labels:
        raise InputError(f"{volume.name}: values must be labels, got measured values; read labels with --labels")
    if volume not in _KNOWN:
        _KNOWN[volume] = _counted(volume.values)
    return _KNOWN[volume]


def share_counts(volume: Volume, other: Volume) -> None:
    """Tell that another volume has the same samples, so that they are not counted again."""
    _KNOWN[other] = label_counts(volume)


def listed(labels: NDArray[np.int64]) -> str:
    """Labels, ascending, as a message names them: runs by their ends, and of very many the first and the last."""
    breaks = np.flatnonzero(np.diff(labels) != 1)
    firsts, lasts = labels[np.append(0, breaks + 1)], labels[np.append(breaks, labels.size - 1)]
    runs = list(zip(firsts, lasts, strict=True))
    texts = [_run(*run) for run in (runs if len(runs) <= 2 * _LISTED else runs[:_LISTED])]
    if len(runs) > 2 * _LISTED:
        texts += ["…", *(_run(*run) for run in runs[-_LISTED:])]
    return ", ".join(texts)


def _run(first: int, last: int) -> str:
    if last - first < 2:
        return f"{first}" if first == last else f"{first}, {last}"
    return f"{first} … {last}"


def _counted(values: NDArray) -> LabelCounts:
    low, high = int(values.min()), int(values.max())
    if high - low < _MOST_COUNTERS:
        counts = np.zeros(high - low + 1, np.int64)
        for chunk in chunks(values):
            counts += np.bincount(chunk.astype(np.int64) - low, minlength=counts.size)
        there = np.flatnonzero(counts)
        return LabelCounts(there + low, counts[there])
    found = [np.unique(chunk, return_counts=True) for chunk in chunks(values)]
    labels, position = np.unique(np.concatenate([each for each, _ in found]).astype(np.int64), return_inverse=True)
    counts = np.zeros(labels.size, np.int64)
    np.add.at(counts, position, np.concatenate([each for _, each in found]))
    return LabelCounts(labels, counts)
