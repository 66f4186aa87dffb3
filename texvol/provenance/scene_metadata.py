"""Metadata of a picture's header from which its scene can be drawn again; `stored_scene` reads them.

The attribute "texvol:scene" is a JSON object, as exact as the scene: Python writes floats with all their digits.

    format                                  2; pictures of texvol 0.3 have none
    volume, source                          name of the volume, and arguments to read it again: see `Volume`
    dimensions, spacing, origin, direction, type, kind, checksum
    mask                                    name, source and checksum of the mask
    added                                   further volumes, each an object with these and a transfer_function
    classification, background, mode, isovalue, air, gradient, lighting, depth_cue, camera, transfer_function
    clip, crop, caps, geometry
    colors                                  "transfer function" if 8 bits show numbers in its colours
    settings                                arguments of `Renderer.render`; none from the oracle
    window                                  (centre, width) in which 8 bits show numbers as grey

Positions are those of the moved volume; `source` has its transform. Keys without a meaning for a scene are left out.
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
    """Return attributes for the picture's header that describe the scene.

    Parameters
    ----------
    name : str
        Name of the volume, usually its path as given.
    settings : mapping
        `Renderer.settings`: arguments with which `Renderer.render` draws the picture again.
    display : mapping
        `window`, for a picture of numbers.
    checksum : bool
        If True, add checksums of the values, which takes as long as reading them.
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
    """Return the CRC-32 of the little-endian values, and colours if any; cached while the object lives."""
    if held not in _CHECKSUMS:
        arrays = [held.array] if isinstance(held, Mask) else [held.values, held.colors]
        found = 0
        for array in (each for each in arrays if each is not None):
            values = array if sys.byteorder == "little" else array.byteswap()
            found = zlib.crc32(values.data.cast("B"), found)
        _CHECKSUMS[held] = f"crc32 {found:08x}"
    return _CHECKSUMS[held]


def kind_of(volume: Volume) -> str:
    """Return the kind of samples."""
    return COLORS if volume.colors is not None else LABELS if volume.labels else ""


def _volume(name: str, volume: Volume, mask: Mask | None, checksum: bool) -> dict[str, Any]:
    """Return name, source and position of a volume, and its mask."""
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
    """Return a further volume and its transfer function."""
    metadata = _volume(added.volume.name, added.volume, added.mask, checksum)
    return metadata | {"transfer_function": _medium(added.transfer_function, added.volume).as_json()}


def _medium(transfer_function: TransferFunction | None, volume: Volume) -> TransferFunction:
    """Return the transfer function or the proposed one: another version of texvol may propose another."""
    if transfer_function is None:
        from texvol.scene.transfer import proposed_for

        return proposed_for(volume)
    return transfer_function


def _shown(scene: Scene) -> dict[str, Any]:
    """Return the looks of the scene: everything but volumes and masks."""
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
    """True if a transfer function of the scene, given or proposed, depends on the gradient."""
    if scene.mode != "composite":
        return False
    parts = [(scene.transfer_function, scene.volume), *((each.transfer_function, each.volume) for each in scene.added)]
    return any(_medium(*part).needs_gradient for part in parts)


def _cutting(scene: Scene) -> dict[str, Any]:
    """Return clip planes, crop box and caps."""
    metadata: dict[str, Any] = {"clip": [asdict(plane) for plane in scene.clip]} if scene.clip else {}
    return metadata | ({"crop": scene.crop} if scene.crop else {}) | ({"caps": True} if scene.caps else {})


def _plain(thing: Any) -> Any:
    """Return arrays and numpy numbers as lists and numbers of Python."""
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    raise TypeError(f"header can't hold {type(thing).__name__}")
