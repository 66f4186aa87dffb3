"""How long frames took, as a table: one line for each frame that was shown."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import astuple, dataclass, fields

from texvol.util import writing


@dataclass(frozen=True)
class Frame:
    """One frame of the window; times in seconds.

    Attributes
    ----------
    time : float
        Since the first.
    seconds : float
        Since the frame before.
    work : float
        What it took to make, without waiting.
    picture : int
        How many pictures had come.
    picture_seconds : float
        Since the picture before, in the frame that shows a new one; else 0. After a rest since the first change.
    delay : float
        From the first change that the picture shows to its being shown; else 0.
    state : str
        moving, refining, rest.
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


class Timings:
    """Frames as they come."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []

    def add(self, frame: Frame) -> None:
        """Another one."""
        self.frames.append(frame)

    def write(self, path: str | os.PathLike[str]) -> None:
        """The table, as CSV."""
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(field.name for field in fields(Frame))
        for frame in self.frames:
            table.writerow(f"{cell:.6g}" if isinstance(cell, float) else cell for cell in astuple(frame))
        writing.write_files({path: text.getvalue().encode()})
