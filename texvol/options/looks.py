"""Look of a volume by its options: of a preset, of a transfer-function file that holds one, or by the kind of data.

A transfer-function file, JSON or TOML, may hold the keys of a scene file for light, gradient and background
beside those of the transfer function:

    light = ["head:0.8"]
    specular = 0.1
    background = "#102030"
    [[points]]
    value = 150
    …

A file without them is unlit. `gradient` is a modulation where it is a list, and the estimator where it is a text.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from texvol.options import light as lit
from texvol.options import volumes as volume_options
from texvol.scene import transfer
from texvol.scene.camera import Camera
from texvol.scene.gradient import CENTRAL
from texvol.scene.looks import EXPOSED, Look, look_as_is, look_of
from texvol.scene.transfer.files import read_content
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_FRONT = Camera.orthographic((0, -1, 0), (0, 0, 0), (0, 0, 1), 1)  # without a volume
_SHOWN_BY = ("light", *lit.SHADING, "gradient", "background")


def look_by(chosen: Mapping[str, Any], volume: Volume) -> Look:
    """Return the look of a volume by its options, without those for light and background.

    Raises
    ------
    InputError
        If a transfer function is not found, or does not fit the volume.
    """
    look = _look_by(chosen, volume)
    return replace(look, transfer_function=volume_options.adjusted(chosen, look.transfer_function, volume))


def _look_by(chosen: Mapping[str, Any], volume: Volume) -> Look:
    volume_options.check_look(chosen)
    if "label-look" in chosen:
        return Look(volume_options.medium_of(chosen, volume), EXPOSED, look_as_is(volume).gradient, name="label-look")  # type: ignore[arg-type]
    if "tf" not in chosen:
        return look_as_is(volume)
    return load_look(chosen["tf"], volume, chosen.get("materials"), chosen.get("unit-distance"))


def load_look(
    name: str, volume: Volume | None, materials: Sequence[str] | None = None, unit_distance: float | None = None
) -> Look:
    """Return the look of a preset or colour map, or of a transfer-function file; a file without light is unlit.

    Raises
    ------
    InputError
        If it is not found, or does not fit the volume.
    """
    if volume is not None and unit_distance is None and not volume_options.is_file(name) and transfer.is_named(name):
        return look_of(name, volume, materials)
    medium = volume_options.transfer_function(name, volume, tuple(materials) if materials else None, unit_distance)
    camera = _FRONT if volume is None else Camera.framing(volume)
    return _of_file(name, medium, unit_distance, camera)


def _of_file(path: str, medium: transfer.TransferFunction, unit_distance: float | None, camera: Camera) -> Look:
    """Return the look of a file whose transfer function is known; a set of lights is placed by the camera."""
    from texvol.options.groups import SCENE_OPTIONS

    chosen: dict[str, Any] = {}
    for key, value in read_content(path, unit_distance).items():
        name = key.replace("_", "-")
        if name not in _SHOWN_BY or (name == "gradient" and not isinstance(value, str)):
            continue
        try:
            chosen[name] = SCENE_OPTIONS[name].from_file(value)
        except (argparse.ArgumentTypeError, InputError) as error:
            raise InputError(f"{path}: {key}: {error}") from None
    lighting = lit.lighting(lit.with_head_light(chosen), camera)
    if lighting is not None and medium.emissive:
        raise InputError(f"{path}: light needs an associated transfer function, got an emissive one")
    name = os.path.basename(path)
    return Look(medium, lighting, chosen.get("gradient", CENTRAL), chosen.get("background"), name=name)
