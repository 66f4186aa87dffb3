"""Levels of a pyramid from the scale and translation of each, and the grid of the finest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.shifts import found_shifts
from texvol.scene.large_volume import ChunkStatistics, Level, SampleSource

_FITS = 2.0  # samples of a level by which its box may differ from that of level 0: writers round sizes up or down


def levels_of(
    sources: Sequence[SampleSource],
    scales: Sequence[Sequence[float]],
    translations: Sequence[Sequence[float]],
    statistics: Sequence[ChunkStatistics | None],
) -> tuple[tuple[Level, ...], tuple[str, ...]]:
    """Return the levels, finest first, and notes; scale and translation are along z, y, x in world units.

    Raises
    ------
    FileFault
        If a level is finer than the one before it.
    """
    base, start = np.array(scales[0]), np.array(translations[0])
    levels, notes = [], []
    for number, (source, scale, translation, known) in enumerate(
        zip(sources, scales, translations, statistics, strict=True)
    ):
        factor = np.array(scale) / base
        first = (np.array(translation) - start) / base
        if levels and (factor < np.array(levels[-1].factor[::-1]) * (1 - 1e-6)).any():
            raise FileFault(f"its level {number} has a smaller scale than level {number - 1}: levels go from fine to coarse")
        apart = np.abs(np.array(source.shape) * factor - sources[0].shape)
        if (apart > _FITS * factor).any():
            notes.append(
                f"level {number} has another extent than level 0 by its metadata: {_by(source.shape)} samples, each of "
                f"{_by(factor)} of level 0's {_by(sources[0].shape)}"
            )
        levels.append(Level(source, _xyz(factor), _xyz(first), known))
    return tuple(levels), tuple(notes)


def checked_levels(levels: tuple[Level, ...], *, fix: bool) -> tuple[tuple[Level, ...], tuple[str, ...]]:
    """Return the levels, moved to where their content puts them if `fix`, and notes on those that lie elsewhere."""
    if len(levels) < 2:
        return levels, ()
    found = found_shifts(levels, fixed=fix)
    if fix:
        levels = tuple(replace(each, first=first) for each, first in zip(levels, found.first, strict=True))
    return levels, found.notes


def _xyz(numbers: Any) -> tuple[float, float, float]:
    z, y, x = (float(each) for each in numbers)
    return x, y, z


def _by(numbers: Any) -> str:
    return " x ".join(f"{each:g}" for each in list(numbers)[::-1])
