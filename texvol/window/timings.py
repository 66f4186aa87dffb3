"""Table of frame times, one line for each frame."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields

from texvol.util import writing


@dataclass(frozen=True)
class Frame:
    """Frame of the window; times are in seconds.

    Attributes
    ----------
    time : float
        Time since the first frame.
    seconds : float
        Time since the last frame.
    work : float
        Time to make the frame, without waiting.
    picture : int
        Number of pictures received so far.
    picture_seconds : float
        Time since the last picture, or after a rest since the first change, if the frame shows a new picture; else 0.
    delay : float
        Time from the first change that the picture shows until it is shown; 0 without a new picture.
    state : str
        "moving", "refining" or "rest".
    """

    time: float
    seconds: float
    work: float
    picture: int
    picture_seconds: float
    delay: float
    state: str
    width: int
    height: int
    sampling_rate: float
    mark: str = ""


def write(path: str | os.PathLike[str], frames: Iterable[Frame]) -> None:
    """Write a table of frames as CSV."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(field.name for field in fields(Frame))
    for frame in frames:
        table.writerow(f"{cell:.6g}" if isinstance(cell, float) else cell for cell in astuple(frame))
    writing.write_files({path: text.getvalue().encode()})
