"""`texvol raycast --exact-cells`: the oracle's picture of an unstructured grid, by its own cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.magnitude import MAGNITUDE
from texvol.scene.scene import Scene
from texvol.util.errors import InputError

_READING = ("variable", "channel", "time", "missing")


def raycast_cells(scene: Scene, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the exact picture of the file of a scene's volume, on the tetrahedra that its cells are split into.

    Camera, transfer function and background are those of the scene, whose volume is resampled.

    Raises
    ------
    InputError
        If the volume was not an unstructured grid, or the scene has a part that tetrahedra do not have.
    """
    from texvol.formats.readers import load_tetrahedra
    from texvol.ray_casting.tetrahedra import raycast_tetrahedra

    _check(scene)
    source = scene.volume.source
    told = {name: source[name] for name in _READING if name in source}
    completed = scene.completed(size)
    grid = load_tetrahedra(source["path"], **told)
    return raycast_tetrahedra(grid, completed.medium, completed.camera, size, background=completed.background)


def _check(scene: Scene) -> None:
    about = scene.volume.resampling or {}
    if about.get("grid") != "unstructured":
        raise InputError("--exact-cells is for unstructured grids, got a volume of another kind")
    if {"transform", "spacing"} & set(scene.volume.source):
        raise InputError("--exact-cells does not go with --transform and --spacing")
    if scene.lighting is not None:
        raise InputError("--exact-cells has no light: give --light none")
    parts = {
        "a mode other than composite": scene.mode != "composite",
        "a depth cue": scene.depth_cue is not None,
        "labels or blocks": scene.volume.nearest,
        "--channel magnitude": scene.volume.source.get("channel") == MAGNITUDE,
        "--depth-in": scene.depth is not None,
        "a mask": scene.mask is not None,
        "added volumes": bool(scene.added),
        "clip planes and a crop box": bool(scene.clip) or scene.crop is not None,
        "meshes and lines": bool(scene.geometry),
    }
    for name, given in parts.items():
        if given:
            raise InputError(f"--exact-cells does not go with {name}")
