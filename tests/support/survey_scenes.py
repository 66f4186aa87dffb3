"""Scenes that the survey's methods draw in tests, and how far a picture is from its oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from support.scenes import path_lengths, smooth_volume
from texvol.methods import draw, method_of
from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (41, 34)
# Smooth in the value, so that no method's order is spoilt by a step.
HAZE = TransferFunction(np.array([0, 1]), np.array([(0.2, 0.4, 0.9), (1, 0.7, 0.3)]), np.array([0.0, 0.12]))
CONSTANT = 0.07  # extinction, per world unit
_COLOR = np.array([0.9, 0.6, 0.3])
_SHEAR = np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]])
# Shapes and places of boxes, and views of them.
BOXES = {
    "cube": lambda: Volume(np.zeros((8, 8, 8))),
    "flat, anisotropic": lambda: Volume(np.zeros((3, 7, 12)), (1.0, 0.5, 2.5)),
    "sheared, left-handed": lambda: Volume(np.zeros((5, 6, 7)), (1, 2, 1.5), (5, -6, 7), _SHEAR),
    "one sample thin": lambda: Volume(np.zeros((1, 9, 6))),
    "tiny world": lambda: Volume(np.zeros((4, 5, 6)), (1e-7, 1e-7, 2e-7), (3e-6, 0, 0)),
}
VIEWS = {
    "slanted": lambda v: Camera.framing(v),
    "along x": lambda v: Camera.framing(v, eye=v.centre - (3 * v.radius, 0, 0), up=(0, 0, 1)),
    "along -z": lambda v: Camera.framing(v, eye=v.centre + (0, 0, 3 * v.radius), up=(0, 1, 0)),
    "along a diagonal": lambda v: Camera.framing(v, eye=v.centre - v.box_edges.sum(axis=1), up=(0, 0, 1)),
}
PERSPECTIVE = {
    "perspective": lambda v: Camera.framing(v, "perspective", fov=60),
    "eye inside": lambda v: Camera.perspective(v.centre, v.centre - v.box_edges[:, 0], v.box_edges[:, 2], fov=90),
    "eye inside, orthographic": lambda v: Camera.orthographic(
        v.centre, v.centre + v.box_edges[:, 1], v.box_edges[:, 2], height=v.radius
    ),
}


def constant_scene(box: str, view: str) -> tuple[Scene, NDArray[np.float64]]:
    """A constant medium before a background, and its picture in closed form."""
    volume = BOXES[box]()
    camera = (VIEWS | PERSPECTIVE)[view](volume)
    extinction = CONSTANT * 10 / volume.radius
    transfer = TransferFunction(np.zeros(1), _COLOR[np.newaxis], np.array([extinction]))
    scene = Scene(volume, transfer, camera, background=(0.2, 0.3, 0.4))
    opacity = -np.expm1(-extinction * path_lengths(volume, camera, SIZE))[..., np.newaxis]
    return scene, np.concatenate([opacity * _COLOR + (1 - opacity) * np.array(scene.background), opacity], axis=-1)


def inside(box: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Pixels whose neighbours all have the same medium around them as they: none at the box's outline."""
    shown = box[..., 3] > 0
    grown = np.pad(shown, 1, mode="edge")
    near = [grown[j : j + shown.shape[0], i : i + shown.shape[1]] for j in range(3) for i in range(3)]
    return np.logical_and.reduce(near)


def smooth_scene(samples: int = 24, **parts: object) -> Scene:
    """A few waves in haze, seen at an angle; the box is as large whatever the number of samples."""
    volume = smooth_volume(samples)
    edge = 24 / samples
    volume = Volume(volume.values, (edge,) * 3, (edge / 2,) * 3)
    return Scene(volume, HAZE, Camera.framing(volume), **{"classification": "post", **parts})  # type: ignore[arg-type]


def rms_error(name: str, scene: Scene, size: tuple[int, int] = SIZE, **settings: object) -> float:
    """Root mean square distance of a method's picture from the oracle that it goes to."""
    order = method_of(name).order
    if order == "projection":
        truth = raycast(replace(scene, mode="xray", transfer_function=None), size)[..., 0]
        picture = draw(name, replace(scene, mode="xray", transfer_function=None), size, **settings)
        return float(np.sqrt(np.square(picture - truth).mean()) / truth.max())
    truth = raycast(replace(scene, classification="post" if order == "after" else "extinction"), size)
    return float(np.sqrt(np.square(draw(name, scene, size, **settings) - truth).mean()))
