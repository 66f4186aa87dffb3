"""What a picture's header says of its scene, so that it can be drawn again; `stored_scene` is what reads it.

The attribute "texvol:scene" is a JSON object. All of it is as exact as the scene itself: Python writes a float with as
many digits as it takes to read the same one.

    format                                  2; pictures of texvol 0.3 have none
    volume, source                          its name, and how it is read again: see `Volume`
    dimensions, spacing, origin, direction, type, kind, checksum
    mask                                    its name, source and checksum
    added                                   further volumes, each an object with these and a transfer_function
    classification, background, mode, isovalue, air, gradient, lighting, depth_cue, camera, transfer_function
    clip, crop, caps, geometry
    colors                                  "transfer function" where 8 bits show numbers in its colours
    settings                                how it was drawn: arguments of `Renderer.render`; none from the oracle
    window                                  in which 8 bits show numbers as grey: (centre, width)

Places are those after a volume was moved; its source says how. What has no meaning for a scene is left out.
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

from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.version import __version__

ATTRIBUTE = "texvol:scene"
FORMAT = 2
BY_TRANSFER_FUNCTION = "transfer function"
LABELS, COLORS = "labels", "colors"  # kinds of samples, where they are not values
_CHECKSUMS: WeakKeyDictionary[Volume | Mask, str] = WeakKeyDictionary()


def scene_metadata(
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
        `window`, of a picture of numbers.
    checksum : bool
        Whether to say which values the volume has, which takes as long as reading through them.
    """
    metadata: dict[str, Any] = {"format": FORMAT, **_volume(name, scene.volume, scene.mask, checksum)}
    if scene.added:
        metadata["added"] = [_added(each, checksum) for each in scene.added]
    metadata |= _shown(scene)
    if settings:
        metadata["settings"] = dict(settings)
    metadata |= display
    return {"Software": f"texvol {__version__}", ATTRIBUTE: json.dumps(metadata, default=_plain)}


def checksum_of(held: Volume | Mask) -> str:
    """What the values add up to (CRC-32 of their little-endian bytes); worked out once for as long as there are some.

    Of a volume with colours those count as well.
    """
    if held not in _CHECKSUMS:
        arrays = [held.array] if isinstance(held, Mask) else [held.values, held.colors]
        found = 0
        for array in (each for each in arrays if each is not None):
            values = array if sys.byteorder == "little" else array.byteswap()
            found = zlib.crc32(values.data.cast("B"), found)
        _CHECKSUMS[held] = f"crc32 {found:08x}"
    return _CHECKSUMS[held]


def kind_of(volume: Volume) -> str:
    """What its samples are."""
    return COLORS if volume.colors is not None else LABELS if volume.labels else ""


def _volume(name: str, volume: Volume, mask: Mask | None, checksum: bool) -> dict[str, Any]:
    """Which volume it is, and where; and its mask."""
    metadata: dict[str, Any] = {
        "volume": name,
        "source": dict(volume.source),
        "dimensions": volume.dimensions,
        "spacing": volume.spacing,
        "origin": volume.origin,
        "direction": volume.direction,
        "type": volume.values.dtype.name,
    }
    if kind_of(volume):
        metadata["kind"] = kind_of(volume)
    if checksum:
        metadata["checksum"] = checksum_of(volume)
    if mask is not None:
        metadata["mask"] = {"name": mask.name, "source": dict(mask.source)}
        metadata["mask"] |= {"checksum": checksum_of(mask)} if checksum else {}
    return metadata


def _added(added: AddedVolume, checksum: bool) -> dict[str, Any]:
    """A further volume, and its matter."""
    metadata = _volume(added.volume.name, added.volume, added.mask, checksum)
    return metadata | {"transfer_function": _medium(added.transfer_function, added.volume).as_json()}


def _medium(transfer_function: TransferFunction | None, volume: Volume) -> TransferFunction:
    """The transfer function, or the proposed one, as renderer and oracle do; another texvol may propose another."""
    if transfer_function is None:
        from texvol.scene.transfer import proposed_for

        return proposed_for(volume)
    return transfer_function


def _shown(scene: Scene) -> dict[str, Any]:
    """What is seen of the volume, and how."""
    metadata: dict[str, Any] = {"classification": scene.classification, "background": scene.background}
    if scene.mode != "composite":
        metadata |= {"mode": scene.mode} | ({"isovalue": scene.isovalue} if scene.isovalue is not None else {})
        metadata |= {"air": scene.air} if scene.air is not None else {}
    transfer_function = scene.transfer_function
    is_colored = scene.mode in NUMBER_MODES and scene.coloring == "tf"
    if scene.mode == "composite" or is_colored:
        transfer_function = _medium(transfer_function, scene.volume)
    if is_colored:
        metadata["colors"] = BY_TRANSFER_FUNCTION
    if scene.needs_gradient or _medium_needs_gradient(scene):
        metadata["gradient"] = asdict(scene.gradient)
    metadata |= {
        name: asdict(part)
        for name, part in (("lighting", scene.lighting), ("depth_cue", scene.depth_cue), ("camera", scene.camera))
        if part is not None
    }
    if transfer_function is not None:
        metadata["transfer_function"] = transfer_function.as_json()
    if scene.geometry:
        from texvol.provenance.geometry import geometry_metadata

        metadata["geometry"] = geometry_metadata(scene.geometry)
    return metadata | _cutting(scene)


def _medium_needs_gradient(scene: Scene) -> bool:
    """Whether some matter of the scene depends on the gradient, also of what is proposed for it."""
    if scene.mode != "composite":
        return False
    parts = [(scene.transfer_function, scene.volume), *((each.transfer_function, each.volume) for each in scene.added)]
    return any(_medium(*part).needs_gradient for part in parts)


def _cutting(scene: Scene) -> dict[str, Any]:
    """What is cut away."""
    metadata: dict[str, Any] = {"clip": [asdict(plane) for plane in scene.clip]} if scene.clip else {}
    return metadata | ({"crop": scene.crop} if scene.crop else {}) | ({"caps": True} if scene.caps else {})


def _plain(thing: Any) -> Any:
    """What JSON has no word for, in Python's own numbers and lists."""
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    raise TypeError(f"{type(thing).__name__} is nothing that a header can hold")
