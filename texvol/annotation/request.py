"""Requested annotation: its parts and its look."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from texvol.scene.measures.measure import Measure
from texvol.util.errors import InputError, check_type, is_number
from texvol.util.suggestions import check_one_of

Triple = tuple[float, float, float]
PARTS = ("box", "axes", "orientation", "legend", "scale-bar")  # names of parts that are on or off


@dataclass(frozen=True)
class Annotation:
    """Annotation to be drawn into a picture.

    Parameters
    ----------
    box : bool
        Outline of each volume's box. Far edges are seen through the medium.
    axes : bool
        Names, ticks and numbers along three silhouette edges of the box. A number is the world coordinate of the point
        at its tick, also for oblique and sheared boxes. With several volumes the box holds all of them; its axes are
        those of the first volume.
    orientation : bool
        Letters at the middles of the borders that give their directions in the body, such as R or RA. The volume's file
        must contain the orientation.
    legend : bool
        Colours and opacity by value; the window of modes that show numbers; the isovalue; names of materials; labels
        with their colours. Each volume has a legend if there is room; volumes with a colour for each sample have none.
    scale_bar : bool
        Bar of a round length; in perspective it holds at the depth of the camera's target, as its text says.
    title : str, optional
        One line of text; a long title is shrunk, then cut.
    color : (r, g, b), optional
        Linear colour of text and lines; by default black or white, whichever contrasts more with the background.
    font_size : float, optional
        Pixels per em; by default proportional to the picture's height.
    value_name : str
        Name of the values in the legend, such as "HU" or "CT number (HU)"; with several volumes that of the first.
    font : path, optional
        TrueType or OpenType file, for letters that DejaVu Sans lacks.
    measures : sequence of Measure
        Rulers, angles, boxes and profiles, each with its value, in front of everything.

    Raises
    ------
    InputError
        If `color` is not three numbers in [0, 1], `font_size` is not positive and finite, or a text is not a string.
    """

    box: bool = False
    axes: bool = False
    orientation: bool = False
    legend: bool = False
    scale_bar: bool = False
    title: str | None = None
    color: Triple | None = None
    font_size: float | None = None
    value_name: str = ""
    font: str | os.PathLike[str] | None = None
    measures: tuple[Measure, ...] = ()

    def __post_init__(self) -> None:
        for name in ("title", "value_name"):
            text = getattr(self, name)
            if not (isinstance(text, str) or (name == "title" and text is None)):
                raise InputError(f"annotation: {name} must be a string, got {text!r}")
        object.__setattr__(self, "measures", tuple(self.measures))
        for each in self.measures:
            check_type("annotation: measures", each, Measure)
        if self.color is not None:
            color = np.asarray(self.color)
            if color.shape != (3,) or color.dtype.kind not in "iuf" or not ((color >= 0) & (color <= 1)).all():
                raise InputError(f"annotation: color must be three numbers in [0, 1], got {self.color!r}")
        if self.font_size is not None and not (is_number(self.font_size) and 0 < self.font_size < np.inf):
            raise InputError(f"annotation: font_size must be a positive number of pixels, got {self.font_size!r}")

    @classmethod
    def of(cls, parts: Iterable[str], title: str | None = None, **further: Any) -> Annotation:
        """Return an annotation by the names of its parts; see PARTS.

        Raises
        ------
        InputError
            If a name is not in PARTS.
        """
        wanted = list(parts)
        for part in wanted:
            check_one_of("annotation: part", part, PARTS)
        chosen: dict[str, Any] = {_field(part): True for part in wanted}
        return cls(**chosen, title=title, **further)

    def __bool__(self) -> bool:
        """True if anything is to be drawn."""
        return self.needs_room or any(each.shown for each in self.measures)

    @property
    def needs_room(self) -> bool:
        """True if anything is to be drawn for which a default camera leaves room; measures lie on what is measured."""
        return any(getattr(self, _field(part)) for part in PARTS) or bool((self.title or "").strip())


def _field(part: str) -> str:
    return part.replace("-", "_")
