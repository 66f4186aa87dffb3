"""Checks of a scene's parts, which raise InputError, and store parts in their common form."""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.scene.air import checked_air
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane, checked_crop
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.gradient import Estimator
from texvol.scene.isosurfaces import checked_isosurfaces
from texvol.scene.lighting import DepthCue, Lighting
from texvol.scene.looks import parts_taken
from texvol.scene.mask import Mask
from texvol.scene.shapes import checked_geometry
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, check_type

# Optional parts of a scene and their types.
_PARTS: dict[str, type] = {
    "transfer_function": TransferFunction,
    "camera": Camera,
    "lighting": Lighting,
    "depth_cue": DepthCue,
    "mask": Mask,
    "depth": DepthPicture,
}


def check_types(scene: Any) -> None:
    """Store the parts that stand for a look or a light, and check the types of all parts."""
    check_type("scene: volume", scene.volume, Volume, "make one of an array by texvol.Volume(values)")
    for name, part in parts_taken(scene).items():
        object.__setattr__(scene, name, part)
    for name, kind in _PARTS.items():
        if (part := getattr(scene, name)) is not None:
            check_type(f"scene: {name}", part, kind)
    check_type("scene: gradient", scene.gradient, Estimator)


def check_isovalue(scene: Any) -> None:
    """Check isovalue and isosurfaces against the mode."""
    object.__setattr__(scene, "isosurfaces", checked_isosurfaces(scene.isosurfaces))
    if scene.isosurfaces and scene.isovalue is not None:
        raise InputError("scene: isovalue and isosurfaces are one or the other, got both")
    if scene.mode != "isosurface" and scene.isovalues:
        raise InputError(f"scene: isovalue needs mode isosurface, got mode {scene.mode}")
    if (
        scene.mode == "isosurface"
        and not scene.isosurfaces
        and not (scene.isovalue is not None and np.isfinite(scene.isovalue))
    ):
        raise InputError(f"scene: isovalue must be finite in mode isosurface, got {scene.isovalue!r}")


def check_air(scene: Any) -> None:
    """Check the value of air."""
    try:
        object.__setattr__(scene, "air", checked_air(scene.air))
    except InputError as error:
        raise InputError(f"scene: {error}") from None
    if scene.air is not None and scene.mode != "xray":
        raise InputError(f"scene: air needs mode xray, got mode {scene.mode}")


def check_cutting(scene: Any) -> None:
    """Check clip planes, crop box and caps."""
    object.__setattr__(scene, "clip", tuple(scene.clip))
    for plane in scene.clip:
        check_type("scene: each of clip", plane, ClipPlane)
    if scene.crop is not None:
        object.__setattr__(scene, "crop", checked_crop(scene.crop))
    if scene.caps and scene.mode != "composite":
        raise InputError(f"scene: caps need mode composite, got mode {scene.mode}")


def check_geometry(scene: Any) -> None:
    """Check meshes, lines and the depth picture against the mode."""
    object.__setattr__(scene, "geometry", checked_geometry(scene.geometry))
    if scene.geometry and scene.mode not in ("composite", "isosurface"):
        raise InputError(
            f"scene: geometry needs mode composite or isosurface, got mode {scene.mode}, whose pictures hold numbers"
        )
    if scene.depth is not None and scene.mode not in ("composite", "isosurface"):
        raise InputError(f"scene: depth needs mode composite or isosurface, got mode {scene.mode}")


def check_medium(scene: Any) -> None:
    """Check the transfer function against light and classification."""
    medium = scene.transfer_function
    if scene.mode == "isosurface" and scene.lighting is not None and scene.lighting.shadows:
        raise InputError("scene: shadows need mode composite, got mode isosurface")
    if medium is None or scene.mode != "composite":
        return
    if scene.lighting is not None and medium.emissive:
        raise InputError("scene: lighting needs an associated transfer function, got an emissive one")
    if scene.classification == "integrated" and (medium.graded or medium.contours):
        raise InputError(
            "scene: classification integrated needs a medium that depends on the value alone, got one that depends "
            "on the gradient: use post, extinction or slab"
        )
