"""Scene files for `texvol render --scene`: TOML, with each transfer function as a JSON file beside it.

Numbers are written with all digits that are needed to read the same number again, so that the scene is the same when
it is read. A scene that a scene file can't describe raises an error.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from texvol.annotation import Annotation
from texvol.annotation.request import PARTS
from texvol.options.light import AMBIENT
from texvol.scene import spaces
from texvol.scene.camera import Camera
from texvol.scene.gradient import CENTRAL, Estimator
from texvol.scene.lighting import DepthCue
from texvol.scene.mask import Mask
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.shapes import Mesh
from texvol.scene.transfer import TransferFunction
from texvol.util.errors import InputError
from texvol.window.jobs import Showing

_NOT_READING_OPTIONS = ("path", "absolute", "transform", "built_in", "fade")


def scene_files(
    path: str | os.PathLike[str], scene: Scene, size: tuple[int, int], showing: Showing
) -> dict[Path, bytes]:
    """Return the contents of the scene file and of the transfer function files, by path.

    Raises
    ------
    InputError
        If a scene file can't describe the scene.
    """
    path = Path(path)
    first = volume_table(scene, 0, path.parent)
    content: dict[str, Any] = {"volume": first.pop("file")} | first
    files: dict[Path, bytes] = {}
    content |= _transfer_function(scene.transfer_function, path.with_name(f"{path.stem}.tf.json"), files)
    content["size"] = f"{size[0]}x{size[1]}"
    content["classification"] = scene.classification
    content["background"] = "transparent" if showing.transparent else list(scene.background)
    if scene.gradient != CENTRAL:
        content["gradient"] = _gradient(scene.gradient)
    content |= _camera(scene.camera) | _light(scene) | _cutting(scene) | _mode(scene, showing)
    content |= _annotation(showing.annotation) | _geometry(scene, path.parent)
    if scene.added:
        content["add"] = [_added(scene, number, path, files) for number in range(len(scene.added))]
    files[path] = "".join(f"{key} = {_toml(value)}\n" for key, value in content.items()).encode()
    return files


def volume_table(scene: Scene, number: int, folder: Path | None = None) -> dict[str, Any]:
    """Return a volume's file, reading options, position and mask; paths are relative to a folder, or absolute.

    Raises
    ------
    InputError
        If the volume or its mask was not read from a file.
    """
    volume = scene.volumes[number]
    source = volume.source
    found: dict[str, Any] = {"file": _file(source, folder, "further volume" if number else "volume")}
    found |= _reading(source)
    own = source.get("transform")
    # The rotation into the first volume's world is repeated whenever the scene is read.
    turn = spaces.turn(volume.own_space, volume.space)
    if own is not None and turn is not None:
        own = np.asarray(own) @ turn.T  # its inverse
        own = None if np.array_equal(own, np.eye(4)) else own
    mask = scene.added[number - 1].mask if number else scene.mask
    placed = {} if own is None else {"transform": np.asarray(own, np.float64).tolist()}
    return found | placed | _mask(mask, folder)


def _file(source: Mapping[str, Any], folder: Path | None, what: str) -> str:
    """Return the file of a volume or a mask, relative to a folder."""
    if "absolute" not in source:
        raise InputError(f"the scene's {what} was not read from a file, so that a scene file can't name it")
    return source["absolute"] if folder is None else os.path.relpath(source["absolute"], folder)


def _reading(source: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options with which a file was read."""
    return {
        key: list(value) if isinstance(value, tuple | list) else value
        for key, value in source.items()
        if key not in _NOT_READING_OPTIONS and value is not None
    }


def _mask(mask: Mask | None, folder: Path | None) -> dict[str, Any]:
    if mask is None:
        return {}
    found: dict[str, Any] = {"file": _file(mask.source, folder, "mask")}
    if "fade" in mask.source:
        found["fade"] = [float(end) for end in mask.source["fade"]]
    return {"mask": found}


def _transfer_function(medium: TransferFunction | None, path: Path, files: dict[Path, bytes]) -> dict[str, Any]:
    """Return the table entry of a transfer function, and add its file to `files`."""
    if medium is None:
        return {}
    files[path] = (json.dumps(medium.as_json(), indent=1) + "\n").encode()
    return {"tf": path.name}


def _added(scene: Scene, number: int, path: Path, files: dict[Path, bytes]) -> dict[str, Any]:
    """Return the table of an added volume."""
    medium = scene.added[number].transfer_function
    name = path.with_name(f"{path.stem}.tf{number + 2}.json")
    return volume_table(scene, number + 1, path.parent) | _transfer_function(medium, name, files)


def _geometry(scene: Scene, folder: Path) -> dict[str, Any]:
    tables = []
    for each in scene.geometry:
        # The name of a mesh from a file is its path.
        if not (isinstance(each, Mesh) and each.lit and each.cut and os.path.isfile(each.name)):
            raise InputError("the scene has geometry that was not read from a file, so that a scene file can't name it")
        look = {"color": [float(part) for part in each.color], "opacity": float(each.opacity)}
        tables.append({"file": os.path.relpath(each.name, folder), **look})
    return {"mesh": tables} if tables else {}


def _camera(camera: Camera | None) -> dict[str, Any]:
    if camera is None:
        return {}
    found = {name: list(getattr(camera, name)) for name in ("eye", "target", "up")}
    extent = {"fov": camera.fov} if camera.projection == "perspective" else {"height": camera.height}
    return {"projection": camera.projection} | found | extent


def _gradient(estimator: Estimator) -> str:
    scale = getattr(estimator, "scale", None)
    return f"{estimator.kind}:{scale!r}" if estimator.kind == "gaussian" else estimator.kind


def _light(scene: Scene) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if scene.depth_cue is not None:
        found["depth-cue"] = _depth_cue(scene.depth_cue)
    lighting = scene.lighting
    if lighting is None:
        return found
    found["light"] = [_light_table(light) for light in lighting.lights] or AMBIENT
    for name in ("ambient", "diffuse", "specular", "shininess", "fade"):
        if (number := getattr(lighting, name)) is not None:
            found[name] = number
    return found | {"two-sided": lighting.two_sided, "shadows": lighting.shadows}


def _depth_cue(cue: DepthCue) -> dict[str, Any]:
    ends = {name: float(end) for name, end in (("near", cue.near), ("far", cue.far)) if end is not None}
    return {"strength": float(cue.strength), "color": [float(part) for part in cue.color]} | ends


def _light_table(light: Any) -> dict[str, Any]:
    position = {"directional": "direction", "point": "position"}.get(light.kind)
    return {"kind": light.kind} | ({position: list(light.vector)} if position else {}) | {"color": list(light.color)}


def _cutting(scene: Scene) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if scene.clip:
        found["clip"] = [{"normal": [*map(float, each.normal)], "offset": float(each.offset)} for each in scene.clip]
    if scene.crop is not None:
        found["crop"] = [end for ends in scene.crop for end in ends]
    return found | ({"caps": True} if scene.caps else {})


def _mode(scene: Scene, showing: Showing) -> dict[str, Any]:
    found: dict[str, Any] = {"mode": scene.mode} if scene.mode != "composite" else {}
    if scene.isovalue is not None:
        found["isovalue"] = scene.isovalue
    if scene.mode == "xray":
        found["air"] = "none" if scene.air is None else scene.air
    window = showing.window if scene.mode in NUMBER_MODES else None
    found["coloring"] = scene.coloring if window is None else "grey"
    return found | ({} if window is None else {"window": list(window)})


def _annotation(annotation: Annotation) -> dict[str, Any]:
    found: dict[str, Any] = {}
    parts = [part for part in PARTS if getattr(annotation, part.replace("-", "_"))]
    if parts:
        found["annotate"] = ",".join(parts)
    for key in ("title", "value_name", "font"):
        if value := getattr(annotation, key):
            found[key.replace("_", "-")] = str(value)
    return found


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float):
        return repr(float(value))  # inf and nan, too, are written as in TOML
    if isinstance(value, int):
        return str(value)
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
