"""Limits put to the test: mistakes planted in a scene, and which of them the limits catch.

A limit that passes a dropped slab is no limit, and one that refuses the same picture drawn again is noise. So there are
controls beside the mistakes: nothing planted, and the same by another back end where there is one. What a mistake does
not change can't be caught in that scene, and what has no meaning there is not asked of it: neither counts.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.limits import NONE, Limits, violations
from texvol.comparison.measures import Measures, without_infinities
from texvol.comparison.mistakes import Bench, drawn
from texvol.comparison.outcome import Outcome, examine
from texvol.comparison.pictures import Picture
from texvol.comparison.planting import PlantedRenderer
from texvol.provenance.scene_metadata import scene_metadata
from texvol.provenance.stored_scene import AnyVolume, StoredScene
from texvol.rendering.renderer import Renderer
from texvol.util.errors import ContextError
from texvol.util.shown_text import shown_line

DEFAULT_SIZE = (256, 256)
CAUGHT, MISSED, NOTHING, NO_MEANING = "caught", "missed", "changes nothing here", "does not apply"
SAME, FALSE_ALARM, NOT_THERE = "same", "false alarm", "not available"
_COLUMNS = ("mistake", "outcome", "by", "max", "rms", "FLIP", "% over", "told from the pictures as")


@dataclass(frozen=True)
class Row:
    """What became of one mistake, or of a control.

    Attributes
    ----------
    status : str
        Of a mistake "caught", "missed", "changes nothing here" or "does not apply"; of a control "same", "false alarm"
        or "not available".
    reason : str
        Why it does not apply, or is not available.
    caught_by : tuple of str
        The limits that it breaks, by their names on the command line.
    outcome : Outcome, optional
        Where there is a picture.
    picture : array, optional
        What of it 8 bits show.
    """

    name: str
    words: str
    status: str
    reason: str = ""
    caught_by: tuple[str, ...] = ()
    outcome: Outcome | None = None
    picture: NDArray[np.float64] | None = field(default=None, repr=False)

    @property
    def is_control(self) -> bool:
        """Whether nothing is planted in it."""
        return self.status in (SAME, FALSE_ALARM, NOT_THERE)

    @property
    def measures(self) -> Measures | None:
        """How far it is from the right picture."""
        return None if self.outcome is None else self.outcome.measures

    @property
    def told(self) -> str:
        """Names of the kinds of difference that the pictures alone tell."""
        return ", ".join(each.name for each in self.outcome.kinds) if self.outcome else ""

    def as_json(self) -> dict[str, Any]:
        """All of it but the pixels."""
        measures, outcome = self.measures, self.outcome
        numbers = {} if measures is None else _numbers(measures)
        return {
            "name": self.name,
            "words": self.words,
            "status": self.status,
            "reason": self.reason,
            "caught_by": list(self.caught_by),
            "violations": list(outcome.violations) if outcome else [],
            "kinds": [{"name": each.name, "words": each.words} for each in outcome.kinds] if outcome else [],
        } | {name: without_infinities(number) for name, number in numbers.items()}


@dataclass(frozen=True)
class SelfTest:
    """Controls and mistakes of a scene, held against limits."""

    name: str
    size: tuple[int, int]
    limits: Limits
    driver: str
    rows: tuple[Row, ...]
    right: NDArray[np.float64] = field(repr=False)  # what of the right picture 8 bits show

    @property
    def passed(self) -> bool:
        """Whether every mistake that shows is caught, and no control."""
        return not any(row.status in (MISSED, FALSE_ALARM) for row in self.rows)

    @property
    def words(self) -> str:
        """What came of it, in a line."""
        count = {status: sum(row.status == status for row in self.rows) for status in (CAUGHT, MISSED, FALSE_ALARM)}
        shown = count[CAUGHT] + count[MISSED]
        alarms = f", and {count[FALSE_ALARM]} false alarms" if count[FALSE_ALARM] else ""
        return f"{count[CAUGHT]} of {shown} mistakes that show are caught{alarms}"

    def as_json(self) -> dict[str, Any]:
        """All of it but the pixels."""
        return {
            "scene": self.name,
            "size": list(self.size),
            "driver": self.driver,
            "limits": self.limits.as_json(),
            "passed": self.passed,
            "words": self.words,
            "rows": [row.as_json() for row in self.rows],
        }

    def as_text(self) -> str:
        """A table for a terminal."""
        width, height = self.size
        cells = [_COLUMNS, *map(_cells, self.rows)]
        widths = [max(len(row[column]) for row in cells) for column in range(len(_COLUMNS))]
        table = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells
        ]
        heading = f"{self.name}, {width}x{height}, drawn by {self.driver}, limits {self.limits.source}"
        reasons = [f"{row.name}: {row.reason}" for row in self.rows if row.reason]
        return "\n".join(map(shown_line, [heading, "", *table, "", *reasons, self.words]))

    def page(self) -> str:
        """A page of its own with the table, small pictures of every mistake, and what it changes."""
        from texvol.comparison.self_test_page import page

        return page(self)


def self_test_of(
    path: str | os.PathLike[str],
    limits: Limits,
    *,
    size: tuple[int, int] | None = None,
    volume: AnyVolume = None,
    backend: str = "auto",
) -> SelfTest:
    """What limits catch in the scene that a file stands for; see `scene_source` and `self_test`."""
    from texvol.comparison.scene_source import scene_of

    stored, found_size = scene_of(path, volume=volume)
    return self_test(stored, size or found_size or DEFAULT_SIZE, limits, backend=backend)


def self_test(
    stored: StoredScene, size: tuple[int, int], limits: Limits, *, backend: str = "auto", controls: bool = True
) -> SelfTest:
    """Plant every mistake in a scene, and hold each picture against the right one.

    Parameters
    ----------
    size : (width, height)
    controls : bool
        Whether to try other back ends as well.
    """
    with PlantedRenderer(backend) as renderer:
        bench = Bench(renderer, stored, size)
        judge = _Judge(bench, limits)
        rows = [judge.control("no mistake", "the same picture, drawn again", bench.draw())]
        if controls:
            rows += _other_back_ends(judge, renderer.backend)
        for mistake, picture in drawn(bench):
            rows.append(judge.row(mistake.name, mistake.words, picture))
        name, driver = Path(stored.name).name, f"{renderer.renderer_name} ({renderer.backend})"
        return SelfTest(name, size, limits, driver, tuple(rows), judge.shown(bench.right))


class _Judge:
    """Holds pictures against the right one."""

    def __init__(self, bench: Bench, limits: Limits) -> None:
        self.bench = bench
        self._limits = limits
        self._attributes = scene_metadata(bench.stored.name, bench.scene)  # says whether pixels are numbers
        self._reference = self._picture(bench.right, "right picture")

    def _picture(self, pixels: NDArray, name: str) -> Picture:
        return Picture.of_array(np.asarray(pixels, np.float32), name, self._attributes)

    def shown(self, pixels: NDArray) -> NDArray[np.float64]:
        """What 8 bits show."""
        return self.bench.stored.in_eight_bits(np.nan_to_num(pixels))

    def row(self, name: str, words: str, picture: NDArray | str) -> Row:
        """The row of a mistake, or of why it has no meaning."""
        if isinstance(picture, str):
            return Row(name, words, NO_MEANING, picture)
        shown = self.shown(picture)
        outcome = examine(self._picture(picture, name), self._reference, self._limits, name=name)
        if self.bench.is_right(picture):
            return Row(name, words, NOTHING, outcome=outcome, picture=shown)
        status = MISSED if outcome.passed else CAUGHT
        return Row(name, words, status, "", _caught_by(outcome), outcome, shown)

    def control(self, name: str, words: str, picture: NDArray) -> Row:
        """The row of a picture without a mistake."""
        row = self.row(name, words, picture)
        refused = row.outcome is not None and not row.outcome.passed
        return replace(row, status=FALSE_ALARM if refused else SAME)


def _other_back_ends(judge: _Judge, used: str) -> Iterator[Row]:
    bench = judge.bench
    for backend in ("egl", "osmesa"):
        if backend == used:
            continue
        name, words = f"no mistake, {backend}", "the same scene by another way to OpenGL"
        try:
            with Renderer(backend) as renderer:
                picture = renderer.render(bench.scene, bench.size, **bench.settings)
                yield judge.control(name, f"{words}, {renderer.renderer_name}", picture)
        except ContextError:
            yield Row(name, words, NOT_THERE, f"{backend} does not open here")


def _caught_by(outcome: Outcome) -> tuple[str, ...]:
    """The limits that a pair breaks, one by one."""
    if outcome.status == "broken":
        return ("not finite",)
    limits, measures = outcome.limits, outcome.measures
    assert measures is not None
    without = replace(NONE, fail_percent=100.0)
    alone = {"max-abs": replace(NONE, max_abs=limits.max_abs, fail_percent=limits.fail_percent)}
    for name in ("hard_max", "outlier", "rms", "flip"):
        alone[name.replace("_", "-")] = replace(without, **{name: getattr(limits, name)})
    return tuple(name for name, each in alone.items() if violations(measures, each))


def _numbers(measures: Measures) -> dict[str, float]:
    return {
        "max_error": measures.max_error,
        "rms_error": measures.rms_error,
        "flip": measures.flip,
        "percent_over": measures.percent_over,
    }


def _cells(row: Row) -> tuple[str, ...]:
    numbers = [f"{each:.2g}" for each in _numbers(row.measures).values()] if row.measures else [""] * 4
    by = ", ".join(row.caught_by)
    return (row.name, row.status, by, *numbers, row.told)
