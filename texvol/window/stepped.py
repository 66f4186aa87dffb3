"""Scenes at another time step: the same scenes with other volumes, made without checks since a film needs many."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import fields

from texvol.scene.added_volume import AddedVolume
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

_FIELDS = frozenset(field.name for field in fields(Scene))


class Stepper:
    """Replaces volumes in scenes; what is equal in two scenes stays equal.

    Parameters
    ----------
    found : mapping
        The new volume for each old one, of the same shape.
    """

    def __init__(self, found: Mapping[Volume, Volume]) -> None:
        self._found = found
        self._added: dict[int, tuple[AddedVolume, AddedVolume]] = {}  # old, kept alive, and new; by identity

    def scene(self, scene: Scene) -> Scene:
        """Return a scene with the new volumes; itself if it has none of the old ones."""
        if not any(volume in self._found for volume in scene.volumes):
            return scene
        # `replace` would check all parts anew, of each of the 200 scenes of a history.
        other = copy(scene)
        for name in vars(scene).keys() - _FIELDS:
            del other.__dict__[name]  # what is cached of the old volumes
        vars(other).update(
            volume=self._found.get(scene.volume, scene.volume), added=tuple(map(self.added, scene.added))
        )
        return other

    def added(self, added: AddedVolume) -> AddedVolume:
        """Return an added volume with the new volume; itself if it is none of the old ones."""
        if added.volume not in self._found:
            return added
        if id(added) not in self._added:
            other = copy(added)
            vars(other).update(volume=self._found[added.volume])
            self._added[id(added)] = added, other
        return self._added[id(added)][1]
