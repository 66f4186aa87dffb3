"""Order of a scene's volumes: the first one can be hidden or taken out, and the next one becomes the first.

Volumes of a scene lie in one world, which stays the same. A scene always has a volume: one in which all volumes are
hidden has the first of them with a transfer function that shows nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from texvol.scene.added_volume import AddedVolume
from texvol.scene.scene import Scene
from texvol.scene.transfer import NO_MEDIUM
from texvol.util.errors import InputError

CLEAR = replace(NO_MEDIUM, name="hidden")


def owners_of(scene: Scene) -> tuple[AddedVolume, ...]:
    """Return all volumes of a scene with their transfer functions and masks; none if they are hidden."""
    if scene.transfer_function is CLEAR:
        return ()
    return (AddedVolume(scene.volume, scene.transfer_function, scene.mask), *scene.added)


def with_owners(shown: Sequence[AddedVolume], hidden: Sequence[AddedVolume] = ()) -> dict[str, Any]:
    """Return the parts of a scene that shows volumes; without any, that of the first hidden one, which is clear.

    Raises
    ------
    InputError
        If there is no volume at all.
    """
    if not shown and not hidden:
        raise InputError("scene: a scene must have a volume, got none")
    if not shown:
        return {"volume": hidden[0].volume, "transfer_function": CLEAR, "mask": None, "added": ()}
    first, *others = shown
    return {
        "volume": first.volume,
        "transfer_function": first.transfer_function,
        "mask": first.mask,
        "added": tuple(others),
    }


def without_first(scene: Scene) -> Scene:
    """Return the scene with its first volume hidden."""
    first, *others = owners_of(scene)
    return replace(scene, **with_owners(others, [first]))
