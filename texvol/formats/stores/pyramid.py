"""Levels of a pyramid from the scale and translation of each, and the grid of the finest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, once
from texvol.formats.stores.shifts import Finding, found_shifts
from texvol.scene.large_volume import ChunkStatistics, Level, SampleSource
from texvol.util.errors import InputError

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
    levels: list[Level] = []
    notes: list[str] = []
    for number, (source, scale, translation, known) in enumerate(
        zip(sources, scales, translations, statistics, strict=True)
    ):
        factor = np.array(scale) / base
        first = (np.array(translation) - start) / base
        if levels and (factor < np.array(levels[-1].factor[::-1]) * (1 - 1e-6)).any():
            raise FileFault(
                f"its level {number} has a smaller scale than level {number - 1}: levels go from fine to coarse"
            )
        apart = np.abs(np.array(source.shape) * factor - sources[0].shape)
        if (apart > _FITS * factor).any():
            notes.append(
                f"level {number} has another extent than level 0 by its metadata: {_by(source.shape)} samples, each of "
                f"{_by(factor)} of level 0's {_by(sources[0].shape)}"
            )
        levels.append(Level(source, _xyz(factor), _xyz(first), known))
    return tuple(levels), tuple(notes)


def checked_levels(levels: tuple[Level, ...], choice: Choice) -> tuple[tuple[Level, ...], tuple[str, ...]]:
    """Return the levels, with --fix-pyramid moved to where their content puts them, and notes on those elsewhere."""
    if len(levels) < 2:
        return levels, ()
    first, notes = once(choice, "shifts", lambda: _found(levels, fix=bool(choice.fix_pyramid)))
    if choice.fix_pyramid:
        levels = tuple(replace(each, first=one) for each, one in zip(levels, first, strict=True))
    return levels, notes


def _found(levels: tuple[Level, ...], *, fix: bool) -> Finding:
    try:
        return found_shifts(levels, fixed=fix)
    except InputError as error:
        if fix:
            raise
        return Finding((), (f"whether levels lie where their metadata put them was not checked: {error}",))


def _xyz(numbers: Any) -> tuple[float, float, float]:
    z, y, x = (float(each) for each in numbers)
    return x, y, z


def _by(numbers: Any) -> str:
    return " x ".join(f"{each:g}" for each in list(numbers)[::-1])
