"""Parts of a scene that are switched off, and are kept until they are switched on again.

A scene holds only what is on. What is off is part of the undo history, but not of the scene file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from texvol.scene.added_volume import AddedVolume
from texvol.scene.cutting import ClipPlane, Range
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene


@dataclass(frozen=True)
class Off:
    """Light, crop box and clip planes as they were when they were switched off.

    Attributes
    ----------
    planes : tuple of (int, ClipPlane)
        Clip planes, with their positions in the list of all planes; ascending.
    volumes : tuple of (int, AddedVolume)
        Hidden volumes, with their positions in the list of all volumes; ascending. See `texvol.window.volume_list`.
    """

    lighting: Lighting | None = None
    crop: tuple[Range, Range, Range] | None = None
    planes: tuple[tuple[int, ClipPlane], ...] = ()
    volumes: tuple[tuple[int, AddedVolume], ...] = ()


NOTHING_OFF = Off()


def light_switched(scene: Scene, off: Off) -> dict[str, Any]:
    """Return the change that switches the light off, or on as it was."""
    if scene.lighting is not None:
        return {"lighting": None, "off": replace(off, lighting=scene.lighting)}
    light = off.lighting or Lighting()
    # Shadows are of one volume that is composited; the mode or the number of volumes may be another now.
    if light.shadows and (scene.mode != "composite" or scene.added):
        light = replace(light, shadows=False)
    return {"lighting": light}


def crop_switched(scene: Scene, off: Off, whole: tuple[Range, Range, Range]) -> dict[str, Any]:
    """Return the change that switches the crop box off, or on as it was; at first it is the `whole` box."""
    if scene.crop is not None:
        return {"crop": None, "off": replace(off, crop=scene.crop)}
    return {"crop": off.crop or whole}


def all_planes(scene: Scene, off: Off) -> list[tuple[ClipPlane, bool]]:
    """Return all clip planes, each with True if it is on."""
    planes = [(plane, True) for plane in scene.clip]
    for position, plane in off.planes:
        planes.insert(position, (plane, False))
    return planes


def planes_changed(planes: Sequence[tuple[ClipPlane, bool]], off: Off) -> dict[str, Any]:
    """Return the change after which the scene has these planes, each with True if it is on."""
    kept = tuple((position, plane) for position, (plane, on) in enumerate(planes) if not on)
    return {"clip": tuple(plane for plane, on in planes if on), "off": replace(off, planes=kept)}
