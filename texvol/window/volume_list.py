"""List of all volumes of the open scene, hidden ones included, and the changes of it.

Hidden volumes are no part of the scene, so that nothing is drawn or sent for them. They are kept in `Off` with their
positions in the list, and are part of the undo history and of scene files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from texvol.scene.added_volume import AddedVolume
from texvol.scene.scene import Scene
from texvol.scene.volume_order import CLEAR, owners_of, with_owners
from texvol.window.switched import Off


@dataclass(frozen=True)
class Entry:
    """Volume of the list, with its transfer function and mask; `shown` is False if it is hidden."""

    owner: AddedVolume
    shown: bool


def entries(scene: Scene, off: Off) -> list[Entry]:
    """Return all volumes in the order of the list."""
    found = [Entry(owner, True) for owner in owners_of(scene)]
    for position, owner in hidden(scene, off):
        found.insert(position, Entry(owner, False))
    return found


def hidden(scene: Scene, off: Off) -> tuple[tuple[int, AddedVolume], ...]:
    """Return the hidden volumes with their positions in the list, ascending."""
    if scene.transfer_function is CLEAR:
        return off.volumes
    # A transfer function that was set for a clear volume shows it.
    return tuple(each for each in off.volumes if not any(each[1].volume is volume for volume in scene.volumes))


def changed(found: Sequence[Entry], off: Off) -> dict[str, Any]:
    """Return the change after which the list has these entries.

    Raises
    ------
    InputError
        If there is none.
    """
    kept = tuple((position, each.owner) for position, each in enumerate(found) if not each.shown)
    parts = with_owners([each.owner for each in found if each.shown], [owner for _, owner in kept])
    return {**parts, "off": replace(off, volumes=kept)}


def with_entry(found: Sequence[Entry], number: int, *instead: Entry) -> list[Entry]:
    """Return the list with one entry replaced, or taken out if there is nothing `instead`."""
    return [*found[:number], *instead, *found[number + 1 :]]


def with_owner(found: Sequence[Entry], number: int, **parts: Any) -> list[Entry]:
    """Return the list with another volume, transfer function or mask of one entry."""
    entry = found[number]
    return with_entry(found, number, replace(entry, owner=replace(entry.owner, **parts)))


def number_among_shown(found: Sequence[Entry], number: int) -> int:
    """Return the number of a shown entry among the volumes of the scene."""
    return sum(each.shown for each in found[:number])
