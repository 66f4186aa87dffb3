"""CZI (Zeiss): a scene of planes, read by Zeiss' own library pylibCZIrw; opening is tried in a process of its own."""

from __future__ import annotations

import os
import re
from typing import Any

import numpy as np

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.microscopy import chosen_image, note_on_missing, of_channel, spacing_of, stack
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_unpacked

_WHITE = (1.0, 1.0, 1.0)
_TYPES = {"Gray8": "u1", "Gray16": "u2", "Gray32Float": "f4"}


def read(path: str, choice: Choice) -> Samples:
    """Return the planes of one scene, channel and time."""
    check_survived(lambda: _described(path, choice))
    from pylibCZIrw import czi

    with czi.open_czi(path) as file:
        scene, sizes, dtype, corner = _form(file, path, choice)
        missing: list[int] = []

        def plane(time: int, channel: int, number: int) -> np.ndarray:
            place = {"T": time + corner["T"], "C": channel + corner["C"], "Z": number + corner["Z"]}
            found = np.asarray(file.read(plane=place, scene=scene))[..., 0]
            # A plane that is not in the file has the colour of the background.
            if not found.any() and np.asarray(file.read(plane=place, scene=scene, background_pixel=_WHITE)).all():
                missing.append(number)
            return found

        values, channel = stack(sizes, dtype, choice, plane)
        described = _metadata(file)
    more = of_channel(channel, sizes["C"], *_channels(described, sizes["C"]))
    notes = (*more.pop("notes", ()), *note_on_missing(missing, sizes["Z"], "this scene, channel and time"))
    return Samples(values, **_spacing(described), **more, notes=notes)


def _described(path: str, choice: Choice) -> None:
    from pylibCZIrw import czi

    with czi.open_czi(path) as file:
        _form(file, path, choice)


def _form(file: Any, path: str, choice: Choice) -> tuple[int | None, dict[str, int], np.dtype, dict[str, int]]:
    """Return the scene, sizes, type, and the first numbers of the axes."""
    box = file.total_bounding_box
    scenes = dict(file.scenes_bounding_rectangle)
    numbers = sorted(scenes)
    scene = numbers[chosen_image([f"scene {each}" for each in numbers], choice)] if numbers else None
    rectangle = scenes[scene] if scene is not None else file.total_bounding_rectangle
    kinds = set(file.pixel_types.values())
    if len(kinds) != 1 or not kinds <= set(_TYPES):
        raise FileFault(f"must have pixels of {', '.join(_TYPES)}, got {', '.join(sorted(map(str, kinds))) or 'none'}")
    for axis, (low, high) in box.items():
        if axis not in "TCZYX" and high - low > 1:
            raise FileFault(f"has {high - low} images along its axis {axis}, which texvol does not read")
    sizes = {axis: int(box[axis][1] - box[axis][0]) if axis in box else 1 for axis in "TCZ"}
    sizes |= {"Y": int(rectangle.h), "X": int(rectangle.w)}
    corner = {axis: int(box[axis][0]) if axis in box else 0 for axis in "TCZ"}
    dtype = np.dtype(_TYPES[kinds.pop()])
    check_unpacked(int(np.prod([float(each) for each in sizes.values()])) * dtype.itemsize, os.path.getsize(path))
    return scene, sizes, dtype, corner


def _metadata(file: Any) -> dict[str, Any]:
    found = file.metadata
    inner = found.get("ImageDocument", {}).get("Metadata", {}) if isinstance(found, dict) else {}
    return inner if isinstance(inner, dict) else {}


def _within(thing: Any, *keys: str) -> Any:
    """Return what lies under keys of nested dictionaries, or None."""
    for key in keys:
        thing = thing.get(key) if isinstance(thing, dict) else None
    return thing


def _listed(thing: Any) -> list[Any]:
    return thing if isinstance(thing, list) else [] if thing is None else [thing]


def _spacing(metadata: dict[str, Any]) -> dict[str, Any]:
    """Return the spacing by the metadata's distances, which are in metres."""
    found: dict[str, float] = {}
    for each in _listed(_within(metadata, "Scaling", "Items", "Distance")):
        try:
            found[str(each["@Id"])] = float(each["Value"]) * 1e6
        except (KeyError, TypeError, ValueError):
            continue
    return spacing_of([found.get(axis) for axis in "XYZ"])


def _channels(metadata: dict[str, Any], count: int) -> tuple[list[str], list[Any]]:
    """Return names and sRGB colours of the channels."""
    described = _listed(_within(metadata, "Information", "Image", "Dimensions", "Channels", "Channel"))
    shown = _listed(_within(metadata, "DisplaySetting", "Channels", "Channel"))
    names, colors = [], []
    for number in range(count):
        both = [each[number] for each in (described, shown) if number < len(each) and isinstance(each[number], dict)]
        names.append(next((str(each["@Name"]) for each in both if each.get("@Name")), ""))
        text = next((str(each["Color"]) for each in both if each.get("Color")), "")
        found = re.fullmatch(r"#(?:[0-9A-Fa-f]{2})?([0-9A-Fa-f]{6})", text)  # opacity comes first
        colors.append([byte / 255 for byte in bytes.fromhex(found[1])] if found else None)
    return names, colors
