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
    measures                                kind, points and so on of each measure

Positions are those of the moved volume; `source` has its transform. Keys without a meaning for a scene are left out.
"""

from __future__ import annotations

import json
import os
import sys
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.added_volume import AddedVolume
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.large_volume import LargeVolume
from texvol.scene.mask import Mask
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.shapes import Lines, Mesh
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.version import __version__

ATTRIBUTE = "texvol:scene"
FORMAT = 2
BY_TRANSFER_FUNCTION = "transfer function"
LABELS, BLOCKS, COLORS = "labels", "blocks", "colors"  # kinds of samples, where they are not values
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
        `window`, for a picture of numbers, and `measures`.
    checksum : bool
        If True, add checksums of the values, which takes as long as reading them.
    """
    scene = scene.looked
    metadata: dict[str, Any] = {"format": FORMAT, **_volume(name, scene.volume, scene.mask, checksum)}
    if scene.added:
        metadata["added"] = [_added(each, checksum) for each in scene.added]
    metadata |= _shown(scene)
    if settings:
        metadata["settings"] = dict(settings)
    metadata |= display
    return {"Software": f"texvol {__version__}", ATTRIBUTE: json.dumps(metadata, default=_plain)}


def checksum_of(held: Volume | Mask) -> str:
    """Return the checksum of the values, and colours if any; cached while the object lives."""
    if held not in _CHECKSUMS:
        _CHECKSUMS[held] = _crc32_of(held.array) if isinstance(held, Mask) else _crc32_of(held.values, held.colors)
    return _CHECKSUMS[held]


def _crc32_of(*arrays: NDArray | None) -> str:
    """Return the CRC-32 of the little-endian values of all arrays that are not None."""
    found = 0
    for array in arrays:
        if array is not None:
            values = array if sys.byteorder == "little" else array.byteswap()
            found = zlib.crc32(np.ascontiguousarray(values).data, found)
    return f"crc32 {found:08x}"


def checksum_of_mesh(mesh: Mesh) -> str:
    """Return the checksum of vertices, triangles, and normals if any."""
    return _crc32_of(mesh.vertices, mesh.triangles, mesh.normals)


def kind_of(volume: Volume) -> str:
    """Return the kind of samples."""
    return COLORS if volume.colors is not None else LABELS if volume.labels else BLOCKS if volume.blocks else ""


def _volume(name: str, volume: Volume, mask: Mask | None, checksum: bool) -> dict[str, Any]:
    """Return name, source and position of a volume, and its mask."""
    drawn_mask = None
    in_store = isinstance(volume, LargeVolume)  # of which all samples would have to be read
    if mask is not None:
        drawn_mask = {"name": mask.name, "source": dict(mask.source)}
        drawn_mask |= {"checksum": checksum_of(mask)} if checksum else {}
    return _known(
        volume=name,
        source=dict(volume.source),
        dimensions=volume.dimensions,
        spacing=volume.spacing,
        origin=volume.origin,
        direction=volume.direction,
        type=volume.dtype.name,
        kind=kind_of(volume) or None,
        checksum=checksum_of(volume) if checksum and not in_store else None,
        mask=drawn_mask,
    )


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
    is_composite = scene.mode == "composite"
    is_colored = scene.mode in NUMBER_MODES and scene.coloring == "tf"
    medium = scene.transfer_function
    if is_composite or is_colored:
        medium = _medium(medium, scene.volume)
    return _known(
        classification=scene.classification,
        background=scene.background,
        mode=None if is_composite else scene.mode,
        isovalue=None if is_composite else scene.isovalue,
        isosurfaces=[asdict(each) for each in scene.isosurfaces] or None,
        air=None if is_composite else scene.air,
        colors=BY_TRANSFER_FUNCTION if is_colored else None,
        gradient=asdict(scene.gradient) if scene.needs_gradient or _medium_needs_gradient(scene) else None,
        lighting=scene.lighting and asdict(scene.lighting),
        depth_cue=scene.depth_cue and asdict(scene.depth_cue),
        camera=scene.camera and asdict(scene.camera),
        transfer_function=None if medium is None else medium.as_json(),
        geometry=_geometry(scene.geometry) or None,
        clip=[asdict(plane) for plane in scene.clip] or None,
        crop=scene.crop,
        caps=scene.caps or None,
        depth_in=None if scene.depth is None else depth_metadata(scene.depth),
    )


def depth_metadata(depth: DepthPicture) -> dict[str, Any]:
    """Return the header's entry for a depth picture."""
    return {"name": depth.name, "source": dict(depth.source), "checksum": _crc32_of(depth.array)}


def _geometry(geometry: Iterable[Mesh | Lines]) -> list[dict[str, Any]]:
    """Return the header's entry for each shape."""
    entries = []
    for shape in geometry:
        entry: dict[str, Any] = {"color": list(shape.color), "opacity": shape.opacity}
        if isinstance(shape, Mesh):
            entry |= {"lit": shape.lit, "cut": shape.cut, "checksum": checksum_of_mesh(shape)}
            if os.path.isfile(shape.name):
                entry |= {"path": shape.name, "absolute": os.path.abspath(shape.name)}
        entries.append(entry)
    return entries


def _known(**entries: Any) -> dict[str, Any]:
    """Return the entries that are not None."""
    return {key: content for key, content in entries.items() if content is not None}


def _medium_needs_gradient(scene: Scene) -> bool:
    """True if a transfer function of the scene, given or proposed, depends on the gradient."""
    if scene.mode != "composite":
        return False
    parts = [(scene.transfer_function, scene.volume), *((each.transfer_function, each.volume) for each in scene.added)]
    return any(_medium(*part).needs_gradient for part in parts)


def _plain(thing: Any) -> Any:
    """Return arrays and numpy numbers as lists and numbers of Python."""
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    raise TypeError(f"header can't hold {type(thing).__name__}")
