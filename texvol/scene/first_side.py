"""Side that what shows of a scene is seen from if none is chosen.

What is flat is seen from its broad side; where the file names directions of the body, or a field fills the box, only
what is thin. A map, of degrees east and north, is seen from above. What is long is not seen along its length. Where
noise hides the structure, the view is along the axis whose sums show most.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.kinds import kind_of
from texvol.scene.noise import clearest_axis
from texvol.scene.spaces import is_map, letters_of_space
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]

_FLAT, _ROD = 0.6, 0.5  # ratios of extents: of what is flat, least to middle; of what is long, middle to largest
_THIN = 0.25  # the former of a few slices, whose front is an edge
_SLANT = np.radians(35.0)  # between the view and the short axis of what is flat
_TILT = np.radians(1.0)  # of a view along an axis


def towards_side(camera: Camera, volume: Volume, shown: Volume) -> Camera:
    """Return the camera turned to the side that shows most, from a little beside it; `shown` is a box around that."""
    kind = kind_of(volume).name
    if kind == "noise":
        return _along(camera, volume.box_edges[:, clearest_axis(volume)], volume.box_edges[:, 1])
    edges = shown.box_edges
    extents = np.linalg.norm(edges, axis=0)
    least, middle, largest = np.argsort(extents)
    is_rod = extents[middle] < _ROD * extents[largest]
    if is_map(volume.space) and not is_rod:
        least = 2
    elif not is_rod and extents[least] > _flat(volume, kind) * extents[middle]:
        return camera
    number, angle = (largest, np.pi / 2 - _SLANT) if is_rod else (least, _SLANT)
    axis = _axis(camera, edges[:, number])
    to_eye = -np.asarray(camera.forward)
    beside = to_eye - (to_eye @ axis) * axis
    is_seen = axis @ to_eye <= np.cos(angle) if is_rod else axis @ to_eye >= np.cos(angle)
    if is_seen or not np.linalg.norm(beside) > 0:
        return camera
    return _seen_from(camera, axis, beside, angle)


def _along(camera: Camera, edge: Numbers, second: Numbers) -> Camera:
    """Return the camera seen along an edge, but for an angle that tells what is up; along z the y axis points up."""
    up = np.asarray(camera.up) / np.linalg.norm(camera.up)
    is_along_up = abs(up @ edge) > np.cos(_TILT) * np.linalg.norm(edge)
    return _seen_from(camera, _axis(camera, edge), -second if is_along_up else up, _TILT)


def _flat(volume: Volume, kind: str) -> float:
    """Return the ratio of the least extent to the middle one up to which something is flat."""
    return _THIN if kind in ("field", "signed") or letters_of_space(volume.space) is not None else _FLAT


def _axis(camera: Camera, edge: Numbers) -> Numbers:
    """Return the direction of an edge towards the eye."""
    axis = edge / np.linalg.norm(edge)
    return axis if axis @ camera.forward <= 0 else -axis


def _seen_from(camera: Camera, axis: Numbers, beside: Numbers, angle: float) -> Camera:
    """Return the camera with its eye at an angle from an axis through its target, towards what is beside the axis."""
    beside = beside - (beside @ axis) * axis
    towards = np.cos(angle) * axis + np.sin(angle) * beside / np.linalg.norm(beside)
    distance = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
    return replace(camera, eye=tuple(np.array(camera.target) + distance * towards))
