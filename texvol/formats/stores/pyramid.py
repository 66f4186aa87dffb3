"""Levels of a pyramid from the scale and translation of each, and the grid of the finest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
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


class PyramidCheck:
    """Comparison of neighbouring levels, whose content may lie elsewhere than their metadata put it.

    Samples are read when its finding or notes are first asked for, so that no picture waits for them.
    """

    def __init__(self, levels: tuple[Level, ...], *, fix: bool) -> None:
        self._levels, self._fix = levels, fix

    @cached_property
    def found(self) -> Finding:
        """Where the levels lie by their content.

        Raises
        ------
        InputError
            If what is to be fixed cannot be read.
        """
        try:
            return found_shifts(self._levels, fixed=self._fix)
        except InputError as error:
            if self._fix:
                raise
            return Finding((), (f"whether levels lie where their metadata put them was not checked: {error}",))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the levels that lie elsewhere."""
        return self.found.notes


def checked_levels(levels: tuple[Level, ...], choice: Choice) -> tuple[tuple[Level, ...], PyramidCheck | None]:
    """Return the levels, with --fix-pyramid moved to where their content puts them, and what compares them."""
    if len(levels) < 2:
        return levels, None
    check = once(choice, "shifts", lambda: PyramidCheck(levels, fix=bool(choice.fix_pyramid)))
    if choice.fix_pyramid:
        levels = tuple(replace(each, first=one) for each, one in zip(levels, check.found.first, strict=True))
    return levels, check


def _xyz(numbers: Any) -> tuple[float, float, float]:
    z, y, x = (float(each) for each in numbers)
    return x, y, z


def _by(numbers: Any) -> str:
    return " x ".join(f"{each:g}" for each in list(numbers)[::-1])
