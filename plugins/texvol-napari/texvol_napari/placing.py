"""Positions: napari's camera, and the grids of its layers, in texvol's world.

napari's world has the axes (z, y, x) and any handedness: by default x points right, y down and z to the eye, which is a
mirror image of a right-handed (x, y, z). texvol's camera is right-handed. Axes that napari flips are flipped in
texvol's world, too: the picture is the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import texvol
from texvol import Camera, InputError

Numbers = NDArray[np.float64]

# Of (z, y, x): orientations in which view, up and right are a right-handed (x, y, z).
_UNFLIPPED = ("away", "down", "right")


def flips_of(camera: Any) -> Numbers:
    """Return the factors 1 or -1 of texvol's (x, y, z)."""
    orientation = [str(each) for each in camera.orientation]
    return np.array([1.0 if is_ == of else -1.0 for is_, of in zip(orientation, _UNFLIPPED, strict=True)])[::-1]


def camera_of(camera: Any, size: tuple[int, int]) -> Camera:
    """Return texvol's camera.

    Parameters
    ----------
    camera : napari.components.Camera
        Its `center`, `zoom`, `perspective`, `orientation`, `view_direction` and `up_direction`.
    size : (width, height)
        Of the canvas, in its own pixels, of which `zoom` make one world unit.
    """
    flips = flips_of(camera)
    target, view, up = (
        flips * np.asarray(each, np.float64)[::-1]
        for each in (camera.center, camera.view_direction, camera.up_direction)
    )
    height = size[1] / float(camera.zoom)
    fov = float(camera.perspective)
    # Of parallel rays the eye's distance does not matter; it only has to differ from the target.
    distance = height if fov == 0 else height / 2 / np.tan(np.radians(fov) / 2)
    eye = target - distance * view / np.linalg.norm(view)
    if fov == 0:
        return Camera.orthographic(eye.tolist(), target.tolist(), up.tolist(), height)
    return Camera.perspective(eye.tolist(), target.tolist(), up.tolist(), fov)


def volume_of(
    layer: Any, values: NDArray[Any], axes: tuple[int, ...], flips: Numbers, level: int = 0, **how: Any
) -> texvol.Volume:
    """Return a volume of a layer's samples, where napari shows them.

    Parameters
    ----------
    layer : napari.layers.Layer
        Its `data_to_world`, which holds scale, translation, rotation, shear and affine.
    values : array of shape (nz, ny, nx)
    axes : (z, y, x)
        Axes of the layer's data that are shown.
    flips : array of shape (3)
        See `flips_of`.
    level : int
        Of a layer with several, whose `downsample_factors` are the steps of its samples.
    """
    zero = np.zeros(layer.ndim)
    factors = layer.downsample_factors[level] if layer.multiscale else np.ones(layer.ndim)
    origin = np.asarray(layer.data_to_world(zero), np.float64)
    columns = []
    for axis in axes[::-1]:
        step = zero.copy()
        step[axis] = factors[axis]
        columns.append((np.asarray(layer.data_to_world(step), np.float64) - origin)[list(axes[::-1])])
    matrix = flips[:, np.newaxis] * np.array(columns).T
    spacing = np.linalg.norm(matrix, axis=0)
    if not (spacing > 0).all():
        raise InputError(f"layer {layer.name!r}: its scale must not be 0")
    place = flips * origin[list(axes[::-1])]
    return texvol.Volume(values, spacing.tolist(), place.tolist(), matrix / spacing, name=layer.name, **how)
