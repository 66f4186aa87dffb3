"""Looks to choose from, in groups, each with a sentence that says what it is for."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

OWN = "this volume"
FILES = "files used lately"
LABELS = "labels"
PROPOSED, OPENED = "proposed", "as opened"
OF_LOOK = "look "  # begins the keys of looks among those of colour maps and opacity shapes

_PRESETS: dict[str, dict[str, str]] = {
    "CT": {
        "ct-bone": "bone, light on the surface; soft tissue is clear",
        "ct-soft-tissue": "skin, muscle and vessels, with bone behind them",
        "ct-lung": "lungs, airways and what lies around them, thinly",
        "ct-tissues": "materials fat, soft tissue and bone, which can be switched",
        "ct-materials": "materials skin, fat, muscle, bone and dense bone, which can be switched",
    },
    "MR": {
        "mr": "head or body by MR, darker tissue red and thin, brighter tissue light and dense",
        "mr-materials": "fluid, grey and white matter of a T1-weighted head, which can be switched",
    },
    "microscopy": {
        "fluorescence": "light that the volume emits, without surfaces; stained channels",
        "solid": "a body with a hard surface, as scans of shells, insects and parts of engines",
    },
    "simulation": {
        "diverging": "fields with two signs: cold below zero, warm above, clear about zero",
        "fog": "thin white fog without light, denser where values are larger",
    },
    "colour maps": {
        "viridis": "from blue to yellow; equal steps of value look equal",
        "inferno": "from black by red to light yellow; equal steps of value look equal",
        "magma": "from black by purple to white; equal steps of value look equal",
        "cividis": "from blue to yellow, for people who confuse red and green as well",
        "grey": "from black to white",
    },
    "from the histogram": {
        "histogram": "a material for each peak of the histogram, with borders in the valleys",
        "contours": "surfaces between the materials of the histogram",
        "boundaries": "borders between the materials of the histogram, dense where values change fast",
        "table-5-1": "fat, tissue and bone of 8-bit CT, after Paiva, Seixas and Gattass (1999)",
    },
}
# Lists of colours of the library of colour maps, for labels.
_LABELS = {
    "glasbey": "hues that lie as far apart as they can",
    "tableau:tab20": "ten hues, each dark and light",
    "colorbrewer:Set1": "nine strong hues",
    "colorbrewer:Set3": "twelve light hues",
}
_OWN = {
    PROPOSED: "what texvol chooses by the kind of the data",
    OPENED: "what the scene was opened with",
}


@dataclass(frozen=True)
class Entry:
    """Look in the list.

    Attributes
    ----------
    key : str
        Name of a preset or of a list of colours, path of a file, `PROPOSED` or `OPENED`.
    group, name, text : str
        What is shown: the group, the name, and the sentence in the tooltip.
    """

    key: str
    group: str
    name: str
    text: str

    def matches(self, words: str) -> bool:
        """True if name, group and sentence have all of the words."""
        said = f"{self.name} {self.group} {self.text}".lower()
        return all(word in said for word in words.lower().split())


def measured(files: list[str]) -> list[Entry]:
    """Return the looks of a volume of measured values, with those of transfer-function files."""
    groups = {OWN: _OWN, FILES: {path: path for path in files}} | _PRESETS
    found = [
        Entry(key, group, os.path.basename(key) if group == FILES else key, text)
        for group, entries in groups.items()
        for key, text in entries.items()
    ]
    return found


def of_labels() -> list[Entry]:
    """Return the lists of colours for a volume of labels."""
    return [Entry(key, LABELS, key.rpartition(":")[2], text) for key, text in _LABELS.items()]


def best_match(found: Sequence[Entry], words: str) -> str | None:
    """Return the key of the entry that a search means: by its name, before one whose sentence has the words."""
    wanted = words.lower().split()
    if not wanted or not found:
        return None

    def is_elsewhere(entry: Entry) -> tuple[bool, bool]:
        name = entry.name.lower()
        return not all(word in name for word in wanted), not name.startswith(wanted[0])

    return min(found, key=is_elsewhere).key
