"""What a picture's header says of its scene, so that it can be drawn again; `stored_scene` is what reads it.

The attribute "texvol:scene" is a JSON object. All of it is as exact as the scene itself: Python writes a float with as
many digits as it takes to read the same one.

    format                                  2; pictures of texvol 0.3 have none
    volume, source                          its name, and how it is read again: see `Volume`
    dimensions, spacing, origin, direction, type, checksum
    classification, background, mode, isovalue, gradient, lighting, depth_cue, camera, transfer_function
    clip, crop, caps, geometry
    settings                                how it was drawn: arguments of `Renderer.render`; none from the oracle
    window, colors                          what 8 bits show of numbers: (centre, width), or "transfer function"

What has no meaning for a scene is left out.
"""

from __future__ import annotations

import json
import sys
import zlib
from collections.abc import Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from texvol import __version__
from texvol.scene import Scene
from texvol.volume import Volume

ATTRIBUTE = "texvol:scene"
FORMAT = 2
BY_TRANSFER_FUNCTION = "transfer function"
_CHECKSUMS: WeakKeyDictionary[Volume, str] = WeakKeyDictionary()


def scene_facts(
    name: str,
    scene: Scene,
    *,
    settings: Mapping[str, Any] = MappingProxyType({}),
    display: Mapping[str, Any] = MappingProxyType({}),
    checksum: bool = False,
) -> dict[str, str]:
    """Attributes for the picture's header: what was drawn, so that it can be drawn again.

    Parameters
    ----------
    name : str
        What the volume is called, usually its path as it was given.
    settings : mapping
        Arguments with which `Renderer.render` draws the picture again: `Renderer.settings`.
    display : mapping
        `window` or `colors`, of a picture of numbers.
    checksum : bool
        Whether to say which values the volume has, which takes as long as reading through them.
    """
    volume = scene.volume
    facts: dict[str, Any] = {
        "format": FORMAT,
        "volume": name,
        "source": dict(volume.source),
        "dimensions": volume.dimensions,
        "spacing": volume.spacing,
        "origin": volume.origin,
        "direction": volume.direction,
        "type": volume.values.dtype.name,
    }
    if checksum:
        facts["checksum"] = checksum_of(volume)
    facts |= _shown(scene)
    if settings:
        facts["settings"] = dict(settings)
    facts |= display
    return {"Software": f"texvol {__version__}", ATTRIBUTE: json.dumps(facts, default=_plain)}


def checksum_of(volume: Volume) -> str:
    """What the values add up to (CRC-32 of their little-endian bytes); worked out once for as long as there is one."""
    if volume not in _CHECKSUMS:
        values = volume.values if sys.byteorder == "little" else volume.values.byteswap()
        _CHECKSUMS[volume] = f"crc32 {zlib.crc32(values.data.cast('B')):08x}"
    return _CHECKSUMS[volume]


def _shown(scene: Scene) -> dict[str, Any]:
    """What is seen of the volume, and how."""
    facts: dict[str, Any] = {"classification": scene.classification, "background": scene.background}
    if scene.mode != "composite":
        facts |= {"mode": scene.mode} | ({"isovalue": scene.isovalue} if scene.isovalue is not None else {})
    transfer_function = scene.transfer_function
    if transfer_function is None and scene.mode == "composite":
        from texvol.transfer import proposed_for

        transfer_function = proposed_for(scene.volume)  # as renderer and oracle do; another texvol may propose another
    if scene.needs_gradient or (scene.mode == "composite" and transfer_function and transfer_function.needs_gradient):
        facts["gradient"] = asdict(scene.gradient)
    facts |= {
        name: asdict(part)
        for name, part in (("lighting", scene.lighting), ("depth_cue", scene.depth_cue), ("camera", scene.camera))
        if part is not None
    }
    if transfer_function is not None:
        facts["transfer_function"] = transfer_function.as_json()
    if scene.geometry:
        from texvol.stored_geometry import geometry_facts

        facts["geometry"] = geometry_facts(scene.geometry)
    return facts | _cutting(scene)


def _cutting(scene: Scene) -> dict[str, Any]:
    """What is cut away."""
    facts: dict[str, Any] = {"clip": [asdict(plane) for plane in scene.clip]} if scene.clip else {}
    return facts | ({"crop": scene.crop} if scene.crop else {}) | ({"caps": True} if scene.caps else {})


def _plain(thing: Any) -> Any:
    """What JSON has no word for, in Python's own numbers and lists."""
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    raise TypeError(f"{type(thing).__name__} is nothing that a header can hold")
