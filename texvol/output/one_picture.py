"""Picture of whatever holds a volume, in one call."""

from __future__ import annotations

import argparse
import inspect
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

from texvol.formats.interchange import volume_of
from texvol.options import reading
from texvol.options.groups import SCENE_OPTIONS
from texvol.options.light import SHADING
from texvol.options.scene_options import SceneOptions
from texvol.rendering.picture import Picture
from texvol.rendering.renderer import Renderer
from texvol.scene.picture_size import checked_size
from texvol.scene.scene import Scene
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

_ARGUMENTS = inspect.signature(Renderer.render).parameters
ACCURACY = tuple(_ARGUMENTS)[3:]  # without self, scene and size
_ALSO = {"tf": "transfer_function", "light": "lighting"}  # names of options, for objects
_PARTS = tuple(field.name for field in fields(Scene) if field.name != "volume")


def render(
    what: Any,
    size: Any = None,
    *,
    backend: str = "auto",
    device: int | str | None = None,
    pipeline: str = "auto",
    **how: Any,
) -> Picture:
    """Return the picture of a scene, or of anything that holds a volume, drawn by a renderer of its own.

    Parameters
    ----------
    what : Scene, Volume, path, array, or image of xarray, nibabel, SimpleITK, pyvista or VTK
        A path may be that of a scene file (.toml).
    size : (width, height) or int, optional
        Pixels; that of the scene file or 512 x 512 by default.
    backend : "auto", "egl" or "osmesa"
    device : int or str, optional
        As for `Renderer`.
    pipeline : "auto", "fragment" or "compute"
        As for `Renderer`.
    how
        Arguments of `Renderer.render`, such as `max_error`. If `what` is no Scene: options of scene files, such as
        `tf="ct-bone"`, `light="head"` or `view="front"`; parts of a `Scene`, such as `camera=Camera(…)`, which win over
        options; and for a path, arguments of `load`. Names have underscores for hyphens.

    Raises
    ------
    InputError
        If a name is not known, or a value is out of range.
    """
    accuracy = {name: how.pop(name) for name in ACCURACY if name in how}
    asked = scene_of(what, size, **how)
    with Renderer(backend, device=device, pipeline=pipeline) as renderer:
        picture = renderer.render(asked.scene, asked.size, **accuracy)
    picture.transparent = asked.transparent
    return picture


class AskedScene(NamedTuple):
    """Scene that was asked for, the size of its picture, and if the picture keeps its opacity."""

    scene: Scene
    size: tuple[int, int]
    transparent: bool = False


def scene_of(what: Any, size: Any = None, **how: Any) -> AskedScene:
    """Return the scene of anything that holds a volume, and how its picture is made; see `render`."""
    _check_known(how)
    if isinstance(what, Scene):
        if how:
            raise InputError(f"a Scene has its parts: {_instead(*how)}")
        return AskedScene(what, _ARGUMENTS["size"].default if size is None else _size(size))
    asked = Asked.of(how)
    if size is not None:
        asked.chosen["size"] = _size(size)
    if isinstance(what, str | os.PathLike):
        path = os.fspath(what)
        named = {"scene": path, "volume": None} if path.lower().endswith(".toml") else {"scene": None, "volume": path}
        options = SceneOptions(argparse.Namespace(**named, **asked.chosen, **asked.told))
        volume = options.load()
    else:
        options = SceneOptions(argparse.Namespace(scene=None, volume=None, **asked.chosen))
        spacing = {} if options.spacing is None else {"spacing": options.spacing}
        volume = options.taken(volume_of(what, **spacing, **asked.told))
    scene = options.scene(volume)
    return AskedScene(scene.replace(**asked.parts) if asked.parts else scene, options.size, options.transparent)


def _check_known(names: Iterable[str]) -> None:
    """Raise InputError with a guess for the first name that is of no option and of no part of a scene."""
    known = ["size", *(each.replace("-", "_") for each in (*SCENE_OPTIONS, *reading.READING, *ACCURACY, *_PARTS))]
    for name in names:
        if name.replace("-", "_") not in known:
            raise InputError(f"render: unknown argument {name!r}{did_you_mean(name, known)}")


def _instead(*names: str) -> str:
    """Return what does for a Scene what arguments would do for its volume."""
    parts = [_ALSO.get(name, name) for name in names]
    for name, part in zip(names, parts, strict=True):
        if part not in _PARTS:
            return f"texvol.render(scene.volume, {name}=…) makes another one, by options"
    return f"scene.replace({'=…, '.join(parts)}=…) changes them"


@dataclass
class Asked:
    """Arguments of a call beside the volume.

    Attributes
    ----------
    chosen : dict
        Options of scene files.
    told : dict
        Options that say how a file is read.
    parts : dict
        Parts of a `Scene`, which win over options.
    """

    chosen: dict[str, Any]
    told: dict[str, Any]
    parts: dict[str, Any]

    @classmethod
    def of(cls, how: Mapping[str, Any]) -> Asked:
        """Return the arguments of a call, sorted; see `render` for errors."""
        chosen: dict[str, Any] = {}
        told: dict[str, Any] = {}
        parts: dict[str, Any] = {}
        for name, value in how.items():
            option = name.replace("_", "-")
            part = _ALSO.get(name, name)
            if part in _PARTS and not (option in SCENE_OPTIONS and _is_of_file(value)):
                parts[part] = value
            elif option in SCENE_OPTIONS:
                chosen[name] = _converted(option, value)
            else:
                told[name] = value
        if "camera" in parts:
            chosen.setdefault("fit", "box")  # nothing has to be looked for to frame it
        if "transfer_function" in parts and not {"light", *SHADING} & set(chosen):
            parts.setdefault("lighting", None)  # as of a Scene: a look has its own, and a function none
        return cls(chosen, told, parts)


def _is_of_file(value: Any) -> bool:
    """True if a value is one of scene files, not an object."""
    if isinstance(value, list | tuple):
        return all(isinstance(each, str | int | float | dict) for each in value)
    return isinstance(value, str | int | float | dict)


def _converted(name: str, value: Any) -> Any:
    try:
        return SCENE_OPTIONS[name].from_file(list(value) if isinstance(value, tuple) else value)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{name.replace('-', '_')}: {error}") from None


def _size(size: Any) -> tuple[int, int]:
    """Return (width, height) of a pair, of the side of a square, or of text such as "640x480"."""
    converted: tuple[int, int] = _converted("size", size) if isinstance(size, str) else checked_size(size)
    return converted
