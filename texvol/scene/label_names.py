"""Names of the labels of a volume, by its table.

A table that was found beside the file, and not asked for, holds only if it has entries for at least half of the
volume's labels besides 0, of a store those of its overview: a list of other things may look like a table.
"""

from __future__ import annotations

from collections.abc import Iterable
from weakref import WeakKeyDictionary

from texvol.scene.label_counts import label_counts
from texvol.scene.label_table import LabelTable
from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume

_FITS = 0.5  # least fraction of a volume's labels of which a found table has entries
_HELD: WeakKeyDictionary[Volume, LabelTable | None] = WeakKeyDictionary()


def table_of(volume: Volume) -> LabelTable | None:
    """Return the table of a volume of labels; None if it has none that holds."""
    table: LabelTable | None = volume.label_table
    if table is None or not volume.labels:
        return None
    if not table.found:
        return table
    if volume not in _HELD:
        seen = volume.overview if isinstance(volume, LargeVolume) else volume
        labels = [label for label in label_counts(seen).labels.tolist() if label]
        known = sum(label in table.entries for label in labels)
        _HELD[volume] = table if known and known >= _FITS * len(labels) else None
    return _HELD[volume]


def names_of(volume: Volume, labels: Iterable[int]) -> dict[int, str]:
    """Return the names of those labels that have one."""
    table = table_of(volume)
    if table is None:
        return {}
    return {label: table.entries[label].name for label in labels if label in table.entries}


def name_of(volume: Volume, label: float) -> str:
    """Return the name of a label; "" if it has none."""
    table = table_of(volume)
    entry = table.entries.get(int(label)) if table is not None and label == label else None
    return entry.name if entry is not None else ""
