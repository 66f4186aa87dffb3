"""The survey's other methods, to be compared with: small, each beside its section of the text, speed against error.

`METHODS` has a class for each, by name, see `method.Method`; `draw` is one call for one picture.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

from texvol.methods.method import Method, Numbers, Size
from texvol.scene.picture_size import checked_size
from texvol.scene.scene import Scene
from texvol.util.suggestions import check_one_of

__all__ = ["METHODS", "Method", "draw", "method_of"]

# Module and class of each method, in the order of the survey's sections.
METHODS: dict[str, tuple[str, str]] = {
    "bresenham": ("voxel_walk", "Bresenham"),
    "bresenham-true": ("voxel_walk", "BresenhamTrue"),
    "tripod": ("voxel_walk", "Tripod"),
    "tripod-true": ("voxel_walk", "TripodTrue"),
    "equal-steps": ("equal_steps", "EqualSteps"),
    "equal-steps-before": ("equal_steps", "EqualStepsBefore"),
    "equal-steps-nearest": ("equal_steps", "EqualStepsNearest"),
    "splatting": ("splatting", "Splatting"),
    "v-buffer": ("v_buffer", "VBuffer"),
    "coherent-projection": ("coherent_projection", "CoherentProjection"),
    "shear-warp": ("shear_warp", "ShearWarp"),
    "volume-transformation": ("volume_transformation", "VolumeTransformation"),
    "fourier": ("fourier", "Fourier"),
    "fourier-padded": ("fourier", "FourierPadded"),
    "fourier-cubic": ("fourier", "FourierCubic"),
    "fourier-blocks": ("fourier_blocks", "FourierBlocks"),
    "wavelets": ("wavelets", "Wavelets"),
    "dct": ("dct", "Cosines"),
}


def method_of(name: str) -> type[Method]:
    """Return the class of a method.

    Raises
    ------
    InputError
        If there is no method of that name.
    """
    check_one_of("method", name, METHODS)
    module, kind = METHODS[name]
    found: type[Method] = getattr(import_module(f"texvol.methods.{module}"), kind)
    return found


def draw(name: str, scene: Scene, size: Size = (512, 512), **settings: Any) -> Numbers:
    """Return a picture by one method, shape (height, width, 4): linear, premultiplied, row 0 on top.

    Methods of order "projection" return the integral of the value along each ray, shape (height, width).

    Parameters
    ----------
    name : str
        One of `METHODS`.
    size : (width, height)
        In pixels.
    **settings
        Of the method's constructor, such as `sampling_rate`.

    Raises
    ------
    InputError
        If there is no such method, or if it cannot draw the scene; the message says which can.
    """
    size = checked_size(size)
    if scene.transfer_function is None:  # the look of its data has light, which no method draws
        scene = replace(scene, lighting="none")  # type: ignore[arg-type]
    scene = scene.completed(size)
    return method_of(name)(scene, **settings).picture(scene.camera, size)
