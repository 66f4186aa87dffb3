"""Measure: ruler, angle, box or profile, given by points of the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.errors import InputError

Point = tuple[float, float, float]
# Number of points of each kind.
POINTS = {"ruler": 2, "angle": 3, "box": 2, "profile": 2}
KINDS = tuple(POINTS)
MOST_SAMPLES = 100_000  # of a profile
_FARTHEST = 1e100  # coordinates whose cubes float64 holds, as the volume of a box


@dataclass(frozen=True)
class Measure:
    """Measure of a scene.

    Parameters
    ----------
    kind : "ruler", "angle", "box" or "profile"
        Distance of two points; angle at the second of three points; box along the axes of the world, given by two
        opposite corners; values along a line.
    points : sequence of (x, y, z)
        World positions.
    name : str
        Name in pictures and tables.
    shown : bool
        True if the measure is drawn into pictures.
    samples : int, optional
        Number of points at which a profile takes values; by default as many as samples of the volume lie on such a
        length.

    Raises
    ------
    InputError
        If the kind is unknown, or the number of points is not that of the kind, or a point is not finite or too far.
    """

    kind: str
    points: tuple[Point, ...]
    name: str = ""
    shown: bool = True
    samples: int | None = None

    if TYPE_CHECKING:  # what may be given, beside what is kept

        def __init__(
            self, kind: str, points: Sequence[Sequence[float]] | NDArray[Any], name: str = "", shown: bool = True,
            samples: int | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        if self.kind not in KINDS:  # a list would have no hash
            raise InputError(f"measure: kind must be one of {', '.join(KINDS)}, got {self.kind!r}")
        object.__setattr__(self, "points", _checked_points(self.kind, self.points))
        if not isinstance(self.name, str):
            raise InputError(f"measure: name must be a string, got {self.name!r}")
        if not isinstance(self.shown, bool):
            raise InputError(f"measure: shown must be true or false, got {self.shown!r}")
        if self.samples is None:
            return
        if self.kind != "profile":
            raise InputError(f"measure: samples are of a profile, got {self.samples!r} for kind {self.kind}")
        if not isinstance(self.samples, int) or not 2 <= self.samples <= MOST_SAMPLES:
            raise InputError(f"measure: samples must be a number from 2 to {MOST_SAMPLES}, got {self.samples!r}")

    def moved(self, number: int, point: ArrayLike) -> Measure:
        """Return the measure with another position of a point."""
        x, y, z = (float(each) for each in np.asarray(point, np.float64))
        return replace(self, points=(*self.points[:number], (x, y, z), *self.points[number + 1 :]))

    def as_table(self) -> dict[str, Any]:
        """Return the fields that differ from their defaults, for scene files and headers."""
        table: dict[str, Any] = {"kind": self.kind, "points": [list(point) for point in self.points]}
        given = {"name": self.name or None, "shown": None if self.shown else False, "samples": self.samples}
        return table | {key: value for key, value in given.items() if value is not None}


def called(measures: Sequence[Measure]) -> list[str]:
    """Return a name of each measure: its own, or its kind and its number among those of the kind."""
    counts = dict.fromkeys(KINDS, 0)
    names = []
    for each in measures:
        counts[each.kind] += 1
        names.append(each.name or f"{each.kind} {counts[each.kind]}")
    return names


def _checked_points(kind: str, points: Any) -> tuple[Point, ...]:
    wanted = POINTS[kind]
    try:
        numbers = np.array(points, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (wanted, 3):
        raise InputError(f"measure: {kind} must have {wanted} points of three numbers, got {points!r}")
    if not (np.abs(numbers) < _FARTHEST).all():  # NaN is neither
        raise InputError(f"measure: points must be finite and nearer than {_FARTHEST:g}, got {points!r}")
    return tuple((float(x), float(y), float(z)) for x, y, z in numbers)
