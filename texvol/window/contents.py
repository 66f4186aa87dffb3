"""Reading of volumes, masks and meshes for a scene, and scenes with these parts added, changed or removed.

Files are read with the options of the command line: "--channel 1 --tf inferno" for a volume that is added means
`--add FILE --add-channel 1 --add-tf inferno`. Functions that read files are slow and run on a thread; the other
functions return at once.
"""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Iterable, Mapping
from copy import copy
from typing import Any, NoReturn

from texvol.formats.readers import load
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.options.files import MaskChoice
from texvol.options.first_choice import made
from texvol.options.scene_option import SceneOption
from texvol.options.volumes import OF_ADDED, AddedChoice
from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import foreign
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

KINDS = {".toml": "scene"} | dict.fromkeys((".json", *foreign.ENDINGS), "transfer function")
KINDS |= dict.fromkeys((".txt", ".lut", ".ctbl", ".ctab", ".label"), "names of labels")
KINDS |= dict.fromkeys((".ply", ".stl", ".obj", ".vtp"), "mesh")


class _Words(argparse.ArgumentParser):
    """Argument parser that raises InputError and never exits."""

    def error(self, message: str) -> NoReturn:
        raise InputError(message)


def kind_of(path: str) -> str:
    """Return the kind of a file by its name: "scene", "transfer function", "mesh", "names of labels" or "volume"."""
    return KINDS.get(os.path.splitext(path)[1].lower(), "volume")


def of_opened(words: str) -> dict[str, Any]:
    """Return the options of `texvol view` in a text, such as "--channel 1", as attributes for its namespace."""
    parser = _Words(add_help=False, allow_abbrev=False)
    options.add_scene_options(parser)
    return _parsed(parser, reading_options.READING.values(), words)


def of_added(words: str) -> dict[str, Any]:
    """Return the options of an added volume in a text, by the options' names without `add-`."""
    found = _parsed(_Words(add_help=False, allow_abbrev=False), [each.option for each in OF_ADDED], words)
    return {name.replace("_", "-"): value for name, value in found.items()}


def _parsed(parser: _Words, further: Iterable[SceneOption], words: str) -> dict[str, Any]:
    group = parser.add_argument_group()
    for option in further:
        option.add_to(group)
    try:
        line = shlex.split(words)
    except ValueError as error:
        raise InputError(f"{words}: {error}") from None
    found = vars(parser.parse_args(texts.with_negative_values(line)))
    return {name: value for name, value in found.items() if value is not None}


def read_volume(path: str, scene: Scene, chosen: Mapping[str, Any]) -> AddedVolume:
    """Read a volume to be added to the scene; it gets a hue of its own unless `chosen` sets its look."""

    def read(further: Mapping[str, Any]) -> AddedVolume:
        choice = AddedChoice(path, {**chosen, **further})
        return choice.added_to(scene.volume, choice.load(), len(scene.added))

    return made(read, path, reading_options.arguments_of(reading_options.chosen(chosen)))


def read_mask(path: str, volume: Volume, fade: tuple[float, float] | None = None) -> Mask:
    """Read a mask of a volume; values outside [0, 1] are mapped by `fade`, by default from their range to [0, 1]."""
    try:
        return MaskChoice(path, fade).load(volume)
    except InputError:
        ends = load(path).finite_range if fade is None else None
        if ends is None or (ends[0] >= 0 and ends[1] <= 1):  # the values are weights: the error has another cause
            raise
        return MaskChoice(path, ends).load(volume)


def with_look(scene: Scene, number: int, color: tuple[float, float, float], opacity: float) -> dict[str, Any]:
    """Return the changed parts of a scene with another colour and opacity of one mesh or line."""
    other = copy(scene.geometry[number])  # `replace` would check a million triangles anew while a slider is dragged
    vars(other).update(color=color, opacity=opacity)
    return {"geometry": (*scene.geometry[:number], other, *scene.geometry[number + 1 :])}


def named(paths: Iterable[str]) -> str:
    """Return a short name for several files, such as "head.nrrd and 2 more"."""
    names = [os.path.basename(os.path.normpath(path)) for path in paths]
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
