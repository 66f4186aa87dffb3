"""Table of labels: their names, colours and visibility, as a file beside a segmentation holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple


class LabelEntry(NamedTuple):
    """Name of a label, its linear colour if the table has colours, and False if the table hides the label."""

    name: str
    color: tuple[float, float, float] | None = None
    shown: bool = True


@dataclass(frozen=True)
class LabelTable:
    """Entries by label.

    Parameters
    ----------
    entries : mapping
        From labels to their LabelEntry.
    source : str
        File of the table; empty if there is none.
    found : bool
        True if the file was found beside a volume and not asked for: it holds only if it fits the volume's labels.
    """

    entries: Mapping[int, LabelEntry]
    source: str = ""
    found: bool = False
