"""Self-test of limits: mistakes planted in a scene, and the mistakes that the limits find.

Limits that accept a dropped slab are too loose, and limits that refuse the same picture drawn again find noise. So
there are controls beside the mistakes: the unchanged scene, and the scene drawn by another back end if there is one.
Mistakes that change nothing in the scene, or do not apply to it, do not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.limits import Limits, checks
from texvol.comparison.measures import without_infinities
from texvol.comparison.mistakes import MistakeTrial, drawn
from texvol.comparison.outcome import Outcome, examine
from texvol.comparison.pictures import Picture
from texvol.comparison.planting import PlantedRenderer
from texvol.formats.pictures.scene_metadata import scene_metadata
from texvol.provenance.stored_scene import StoredScene
from texvol.rendering.renderer import Renderer
from texvol.util.errors import ContextError
from texvol.util.shown_text import shown_line

CAUGHT, MISSED, NOTHING, NO_MEANING = "caught", "missed", "changes nothing here", "does not apply"
SAME, FALSE_ALARM, NOT_THERE = "same", "false alarm", "not available"
_NUMBERS = ("max_error", "rms_error", "flip", "percent_over")
_COLUMNS = ("mistake", "outcome", "by", "max", "rms", "FLIP", "% over", "kinds told from the pictures")


@dataclass(frozen=True)
class Row:
    """Result of one mistake, or of a control.

    Attributes
    ----------
    status : str
        Of a mistake "caught", "missed", "changes nothing here" or "does not apply"; of a control "same", "false alarm"
        or "not available".
    reason : str
        Why the mistake does not apply, or the control is not available.
    caught_by : tuple of str
        Names, as on the command line, of the broken limits.
    outcome : Outcome, optional
        Outcome of the comparison, if there is a picture.
    picture : array, optional
        The picture in 8 bits.
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
        """True for a row without a planted mistake."""
        return self.status in (SAME, FALSE_ALARM, NOT_THERE)

    @property
    def numbers(self) -> dict[str, float]:
        """The measures that a table shows; empty without a picture."""
        measures = self.outcome and self.outcome.measures
        return {name: getattr(measures, name) for name in _NUMBERS} if measures else {}

    @property
    def told(self) -> str:
        """Names of the kinds of difference that the pictures alone tell."""
        return ", ".join(each.name for each in self.outcome.kinds) if self.outcome else ""

    def as_json(self) -> dict[str, Any]:
        """The row without the pixels."""
        outcome = self.outcome
        return {
            "name": self.name,
            "words": self.words,
            "status": self.status,
            "reason": self.reason,
            "caught_by": list(self.caught_by),
            "violations": list(outcome.violations) if outcome else [],
            "kinds": [{"name": each.name, "words": each.words} for each in outcome.kinds] if outcome else [],
        } | without_infinities(self.numbers)


@dataclass(frozen=True)
class SelfTest:
    """Controls and mistakes of a scene, compared with the right picture."""

    name: str
    size: tuple[int, int]
    limits: Limits
    driver: str
    rows: tuple[Row, ...]
    right: NDArray[np.float64] = field(repr=False)  # the right picture in 8 bits

    @property
    def passed(self) -> bool:
        """True if every visible mistake is caught, and no control is refused."""
        return not any(row.status in (MISSED, FALSE_ALARM) for row in self.rows)

    @property
    def reasons(self) -> list[str]:
        """Why mistakes do not apply, or controls are not available."""
        return [f"{row.name}: {row.reason}" for row in self.rows if row.reason]

    @property
    def words(self) -> str:
        """The result in a line."""
        count = {status: sum(row.status == status for row in self.rows) for status in (CAUGHT, MISSED, FALSE_ALARM)}
        shown = count[CAUGHT] + count[MISSED]
        alarms = f", and {count[FALSE_ALARM]} false alarms" if count[FALSE_ALARM] else ""
        return f"{count[CAUGHT]} of {shown} visible mistakes are caught{alarms}"

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
        """The result as a table for a terminal."""
        width, height = self.size
        cells: list[tuple[str, ...]] = [_COLUMNS]
        for row in self.rows:
            numbers = [f"{each:.2g}" for each in row.numbers.values()] or [""] * len(_NUMBERS)
            cells.append((row.name, row.status, ", ".join(row.caught_by), *numbers, row.told))
        widths = [max(len(row[column]) for row in cells) for column in range(len(_COLUMNS))]
        table = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells
        ]
        heading = f"{self.name}, {width}x{height}, drawn by {self.driver}, limits {self.limits.source}"
        return "\n".join(map(shown_line, [heading, "", *table, "", *self.reasons, self.words]))


def self_test(
    stored: StoredScene,
    size: tuple[int, int],
    limits: Limits,
    *,
    device: int | str | None = None,
    controls: bool = True,
) -> SelfTest:
    """Plant every mistake in a scene, and compare each picture with the right one.

    Parameters
    ----------
    size : (width, height)
    device : int or str, optional
        As for `Renderer`.
    controls : bool
        True to try other back ends as well.
    """
    with PlantedRenderer(device=device) as renderer:
        trial = MistakeTrial(renderer, stored, size)
        judge = _Judge(trial, limits)
        rows = [judge.control("no mistake", "the same picture, drawn again", trial.draw())]
        if controls:
            rows += _other_back_ends(judge, renderer.backend)
        rows += [judge.row(mistake.name, mistake.words, picture) for mistake, picture in drawn(trial)]
        name, driver = Path(stored.name).name, f"{renderer.renderer_name} ({renderer.backend})"
        return SelfTest(name, size, limits, driver, tuple(rows), judge.shown(trial.right))


class _Judge:
    """Comparison of pictures with the right one."""

    def __init__(self, trial: MistakeTrial, limits: Limits) -> None:
        self.trial = trial
        self._limits = limits
        self._attributes = scene_metadata(trial.stored.name, trial.scene)  # tells that pixels are numbers
        self._reference = self._picture(trial.right, "right picture")

    def _picture(self, pixels: NDArray, name: str) -> Picture:
        return Picture.of_array(np.asarray(pixels, np.float32), name, self._attributes)

    def shown(self, pixels: NDArray) -> NDArray[np.float64]:
        """Return pixels as 8 bits show them."""
        return self.trial.stored.in_eight_bits(np.nan_to_num(pixels))

    def row(self, name: str, words: str, picture: NDArray | str) -> Row:
        """Return the row of a mistake's picture, or of the reason why it does not apply."""
        if isinstance(picture, str):
            return Row(name, words, NO_MEANING, picture)
        shown = self.shown(picture)
        outcome = examine(self._picture(picture, name), self._reference, self._limits, name=name)
        if self.trial.is_right(picture):
            return Row(name, words, NOTHING, outcome=outcome, picture=shown)
        status = MISSED if outcome.passed else CAUGHT
        return Row(name, words, status, "", _caught_by(outcome), outcome, shown)

    def control(self, name: str, words: str, picture: NDArray) -> Row:
        """Return the row of a picture without a mistake."""
        row = self.row(name, words, picture)
        refused = row.outcome is not None and not row.outcome.passed
        return replace(row, status=FALSE_ALARM if refused else SAME)


def _other_back_ends(judge: _Judge, used: str) -> Iterator[Row]:
    trial = judge.trial
    for backend in ("egl", "osmesa"):
        if backend == used:
            continue
        name, words = f"no mistake, {backend}", "the same scene by another back end"
        try:
            with Renderer(backend) as renderer:
                picture = renderer.render(trial.scene, trial.size, **trial.settings)
                yield judge.control(name, f"{words}, {renderer.renderer_name}", picture)
        except ContextError:
            yield Row(name, words, NOT_THERE, f"{backend} is not available on this machine")


def _caught_by(outcome: Outcome) -> tuple[str, ...]:
    """Return the names of the limits that a pair breaks."""
    if outcome.status == "broken":
        return ("not finite",)
    assert outcome.measures is not None
    return tuple(each.key for each in checks(outcome.measures, outcome.limits) if each.is_broken)
