"""Scene files for `texvol render --scene`: TOML, with each transfer function as a JSON file beside it.

Numbers are written with all digits that are needed to read the same number again, so that the scene is the same when
it is read. A scene that a scene file can't describe raises an error.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from texvol.annotation import Annotation
from texvol.annotation.request import PARTS
from texvol.options import saved_views
from texvol.options.light import AMBIENT
from texvol.options.scene_options import DEFAULT_SIZE
from texvol.scene import spaces
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.gradient import CENTRAL, Estimator
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.lighting import Light
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.shapes import Mesh
from texvol.scene.tour import Tour
from texvol.scene.volume import Volume
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.locations import is_remote
from texvol.window import volume_list
from texvol.window.editing import owner_of
from texvol.window.jobs import Showing
from texvol.window.switched import NOTHING_OFF, Off
from texvol.window.volume_list import Entry

_NOT_READING_OPTIONS = ("path", "absolute", "transform", "built_in", "fade")


def scene_files(
    path: str | os.PathLike[str],
    scene: Scene,
    size: tuple[int, int],
    showing: Showing,
    off: Off = NOTHING_OFF,
    tour: Tour | None = None,
) -> dict[Path, bytes]:
    """Return the contents of the scene file and of the transfer function files, by path.

    Parameters
    ----------
    off : Off
        What is switched off: hidden volumes are written, too.

    Raises
    ------
    InputError
        If a scene file can't describe the scene.
    """
    path = Path(path)
    files: dict[Path, bytes] = {}
    found = volume_list.entries(scene, off)
    first, *added = (_volume(found, number, path, files) for number in range(len(found)))
    content: dict[str, Any] = {"volume": first.pop("file")} | first
    content |= {
        "size": f"{size[0]}x{size[1]}",
        "classification": scene.classification,
        "background": "transparent" if showing.transparent else scene.background,
        "gradient": None if scene.gradient == CENTRAL else _gradient(scene.gradient),
    }
    content |= _camera(scene.camera) | _light(scene) | _cutting(scene) | _mode(scene, showing)
    content |= _annotation(showing.annotation) | {"mesh": _meshes(scene, path.parent), "add": added or None}
    lines = [f"{key} = {_toml(value)}\n" for key, value in content.items() if value is not None]
    files[path] = "".join([*lines, *_tables(saved_views.tables_of(tour or Tour()))]).encode()
    return files


def write_scene(path: str | os.PathLike[str], scene: Scene, size: tuple[int, int] = DEFAULT_SIZE) -> None:
    """Write a scene that was made in Python as a scene file, and its transfer functions beside it; all or nothing.

    Parameters
    ----------
    size : (width, height)
        Pixels of the pictures of the scene file.

    Raises
    ------
    InputError
        If the name does not end with .toml, a file can't be written, or a scene file can't describe the scene: its
        volumes, masks and meshes must come from files.
    """
    if Path(path).suffix.lower() != ".toml":
        raise InputError(f"{path}: the name of a scene file must end with .toml")
    writing.check_writable(path)
    files = scene_files(path, scene.looked, size, Showing())
    writing.write_files({str(name): content for name, content in files.items()})


def transfer_function_path(path: Path, number: int) -> Path:
    """Return the file of a volume's transfer function beside the scene file at `path`."""
    return path.with_name(f"{path.stem}.tf{number + 1 if number else ''}.json")


def volume_table(scene: Scene, number: int, folder: Path | None = None) -> dict[str, Any]:
    """Return a volume's file, reading options, position and mask; paths are relative to a folder, or absolute.

    Raises
    ------
    InputError
        If the volume or its mask was not read from a file.
    """
    return _table(owner_of(scene, number), number, scene.volume, folder)


def _table(owner: Scene | AddedVolume, number: int, first: Volume, folder: Path | None) -> dict[str, Any]:
    """Return what `volume_table` does, of volume `number` in the world of the first one."""
    volume, mask, source = owner.volume, owner.mask, owner.volume.source
    found: dict[str, Any] = {"file": _file(source, folder, "further volume" if number else "volume")}
    for key, value in source.items():
        if key not in _NOT_READING_OPTIONS and value is not None:
            found[key] = list(value) if isinstance(value, tuple | list) else value
    if folder is not None and os.path.isabs(found.get("label_names", "")):
        found["label_names"] = os.path.relpath(found["label_names"], folder)
    if volume.channel is not None:  # else the other channels would be drawn with it
        found["channel"] = volume.channel.number
    own = source.get("transform")
    # The rotation into the first volume's world is repeated whenever the scene is read.
    turn = spaces.turn(volume.own_space, first.space)
    if turn is not None:
        own = (np.eye(4) if own is None else np.asarray(own)) @ turn.T  # its inverse
        own = None if np.array_equal(own, np.eye(4)) else own
    if turn is not None and number == 0:
        found["space"] = first.space
    if own is not None:
        found["transform"] = np.asarray(own, np.float64).tolist()
    if mask is not None:
        fade = {"fade": [float(end) for end in mask.source["fade"]]} if "fade" in mask.source else {}
        found["mask"] = {"file": _file(mask.source, folder, "mask")} | fade
    return found


def _file(source: Mapping[str, Any], folder: Path | None, what: str) -> str:
    """Return the file of a volume or a mask, relative to a folder."""
    if "absolute" not in source:
        raise InputError(f"the scene's {what} was not read from a file, so that a scene file can't name it")
    if folder is None or is_remote(source["absolute"]):
        return str(source["absolute"])
    return os.path.relpath(source["absolute"], folder)


def _volume(found: Sequence[Entry], number: int, path: Path, files: dict[Path, bytes]) -> dict[str, Any]:
    """Return the table of a volume in the scene file at `path`, and add its transfer function's file to `files`."""
    table = _table(found[number].owner, number, found[0].owner.volume, path.parent)
    medium = found[number].owner.transfer_function
    if not found[number].shown:
        table["hidden"] = True
    if medium is not None:
        beside = transfer_function_path(path, number)
        files[beside] = (json.dumps(medium.as_json(), indent=1) + "\n").encode()
        table["tf"] = beside.name
    return table


def _meshes(scene: Scene, folder: Path) -> list[dict[str, Any]] | None:
    for each in scene.geometry:
        # The name of a mesh from a file is its path.
        if not (isinstance(each, Mesh) and each.lit and each.cut and os.path.isfile(each.name)):
            raise InputError("the scene has geometry that was not read from a file, so that a scene file can't name it")
    return [
        {"file": os.path.relpath(each.name, folder), "color": each.color, "opacity": float(each.opacity)}
        for each in scene.geometry
    ] or None


def _camera(camera: Camera | None) -> dict[str, Any]:
    if camera is None:
        return {}
    extent = "fov" if camera.projection == "perspective" else "height"
    return {name: getattr(camera, name) for name in ("projection", "eye", "target", "up", extent)}


def _gradient(estimator: Estimator) -> str:
    return f"gaussian:{estimator.scale!r}" if estimator.kind == "gaussian" else estimator.kind


def _light(scene: Scene) -> dict[str, Any]:
    found: dict[str, Any] = {"depth-cue": None if scene.depth_cue is None else asdict(scene.depth_cue)}
    lighting = scene.lighting
    if lighting is None:
        return found
    found["light"] = [_light_table(light) for light in lighting.lights] or AMBIENT
    found |= {name: getattr(lighting, name) for name in ("ambient", "diffuse", "specular", "shininess", "fade")}
    return found | {"two-sided": lighting.two_sided, "shadows": lighting.shadows}


def _shell(surface: Isosurface) -> dict[str, Any]:
    color = {} if surface.color is None else {"color": surface.color}
    return {"value": surface.value, "opacity": surface.opacity} | color


def _light_table(light: Light) -> dict[str, Any]:
    place = "position" if light.kind == "point" else "direction"
    fall_off = {} if light.fall_off is None else {"fall-off": light.fall_off}
    return {"kind": light.kind, place: light.vector, "color": light.color} | fall_off


def _cutting(scene: Scene) -> dict[str, Any]:
    planes = [{"normal": plane.normal, "offset": float(plane.offset)} for plane in scene.clip]
    crop = None if scene.crop is None else [end for ends in scene.crop for end in ends]
    return {"clip": planes or None, "crop": crop, "caps": scene.caps or None}


def _mode(scene: Scene, showing: Showing) -> dict[str, Any]:
    window = showing.window if scene.mode in NUMBER_MODES else None
    return {
        "mode": None if scene.mode == "composite" else scene.mode,
        "isovalue": scene.isovalue
        if scene.isovalue is not None
        else [_shell(each) for each in scene.isosurfaces] or None,
        "air": None if scene.mode != "xray" else "none" if scene.air is None else scene.air,
        "coloring": scene.coloring if window is None else "grey",
        "window": window,
    }


def _annotation(annotation: Annotation) -> dict[str, Any]:
    parts = [part for part in PARTS if getattr(annotation, part.replace("-", "_"))]
    texts = {"title": annotation.title, "value-name": annotation.value_name, "font": annotation.font}
    found: dict[str, Any] = {key: str(text) if text else None for key, text in texts.items()}
    measures = [each.as_table() for each in annotation.measures]
    return {"annotate": ",".join(parts) or None} | found | {"measure": measures or None}


def _tables(content: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of tables, and of arrays of tables; they stand after all keys of the scene."""
    for key, value in content.items():
        head = f"\n[[{key}]]\n" if isinstance(value, list) else f"\n[{key}]\n"
        for table in value if isinstance(value, list) else [value]:
            yield head
            yield from (f"{name} = {_toml(each)}\n" for name, each in table.items())


def _toml(value: Any) -> str:
    """Return a value in TOML; entries that are None are left out."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items() if each is not None) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float):
        return repr(float(value))  # inf and nan, too, are written as in TOML
    if isinstance(value, int):
        return str(value)
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
