"""Metadata of OME-Zarr (NGFF 0.1 to 0.5): axes, scale and translation of each level, channels.

A sample with index i along an axis lies at s i + t, where the transformations of the level are applied first and those
of the whole pyramid after them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import joined
from texvol.scene.channel import Channel
from texvol.util.color import linear_from_srgb

_VERSIONS = ("0.1", "0.2", "0.3", "0.4", "0.5")
_OLD_AXES = ("t", "c", "z", "y", "x")  # of 0.1 and 0.2, which name none
_KINDS = {"time": "T", "channel": "C"}
_MOST_AXES = 5


class Axis(NamedTuple):
    """Axis of a stored array: T, C, Z, Y, X, or "?" without a name; its unit is as the store writes it."""

    letter: str
    name: str
    unit: str = ""


class Dataset(NamedTuple):
    """One level: key of its array, and scale and translation along the stored axes."""

    key: str
    scale: tuple[float, ...]
    translation: tuple[float, ...]


class Image(NamedTuple):
    """One multiscale image."""

    group: str
    name: str
    axes: tuple[Axis, ...]
    datasets: tuple[Dataset, ...]
    channels: tuple[Channel, ...]
    is_label: bool
    placed: bool  # False if the metadata have no transformation


def ome_attributes(attributes: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of OME-Zarr: those below "ome" in 0.5, all of them before."""
    inner = attributes.get("ome")
    return inner if isinstance(inner, dict) else attributes


def images_of(group: str, attributes: dict[str, Any]) -> list[Image]:
    """Return the images that a group's own metadata describe.

    Raises
    ------
    FileFault
        If the metadata are malformed, or of a version that is not known.
    """
    ome = ome_attributes(attributes)
    found = ome.get("multiscales", [])
    if not isinstance(found, list):
        raise FileFault(f"its multiscales must be a list, got {type(found).__name__}")
    return [_image(group, each, ome, number) for number, each in enumerate(found)]


def _image(group: str, content: Any, ome: dict[str, Any], number: int) -> Image:
    where = f"its multiscales[{number}]"
    if not isinstance(content, dict) or not isinstance(content.get("datasets"), list) or not content["datasets"]:
        raise FileFault(f"{where} must be an object with a list of datasets")
    version = str(content.get("version", ome.get("version", "0.4")))
    if version not in _VERSIONS:
        raise FileFault(f"{where} is of version {version}; texvol reads {_VERSIONS[0]} to {_VERSIONS[-1]}")
    axes = _axes(content.get("axes", list(_OLD_AXES)), where)
    whole = _transformation(content.get("coordinateTransformations"), len(axes), where)
    datasets, placed = [], True
    for at, each in enumerate(content["datasets"]):
        if not isinstance(each, dict) or not isinstance(each.get("path"), str):
            raise FileFault(f"{where} has a dataset without a path")
        inside = f"{where}, dataset {at}"
        placed = placed and each.get("coordinateTransformations") is not None
        scale, translation = _transformation(each.get("coordinateTransformations"), len(axes), inside)
        together = [a * b for a, b in zip(whole[0], scale, strict=True)]
        moved = [a * b + c for a, b, c in zip(whole[0], translation, whole[1], strict=True)]
        datasets.append(Dataset(joined(group, each["path"]), tuple(together), tuple(moved)))
    name = content.get("name")
    return Image(group, name if isinstance(name, str) else "", axes, tuple(datasets), _channels(ome),
                 "image-label" in ome, placed)  # fmt: skip


def _axes(content: Any, where: str) -> tuple[Axis, ...]:
    """Return the axes; those of space are told apart by their names, or else by their order."""
    if not isinstance(content, list) or not 1 <= len(content) <= _MOST_AXES:
        raise FileFault(f"{where} must have a list of 2 to {_MOST_AXES} axes")
    told = [each if isinstance(each, dict) else {"name": each} for each in content]
    names = [str(each.get("name", "")) for each in told]
    kinds = [_KINDS.get(str(each.get("type", "")), "") for each in told]
    letters = [kind or (name.upper() if name in ("t", "c") else "") for kind, name in zip(kinds, names, strict=True)]
    space = [number for number, letter in enumerate(letters) if not letter]
    if not 2 <= len(space) <= 3:
        raise FileFault(f"{where} must have two or three axes of space, got axes {', '.join(names)}")
    in_order = "ZYX"[-len(space) :]
    known = [names[number].upper() for number in space]
    for number, letter in zip(space, known if set(known) == set(in_order) else in_order, strict=True):
        letters[number] = letter
    if len(set(letters)) < len(letters):
        raise FileFault(f"{where} must have different axes, got {', '.join(names)}")
    units = [str(each.get("unit") or "") for each in told]
    return tuple(Axis(*each) for each in zip(letters, names, units, strict=True))


def _transformation(content: Any, count: int, where: str) -> tuple[list[float], list[float]]:
    """Return scale and translation along each axis of transformations that are applied one after the other."""
    scale, translation = [1.0] * count, [0.0] * count
    if content is None:
        return scale, translation
    if not isinstance(content, list):
        raise FileFault(f"{where}: coordinateTransformations must be a list, got {type(content).__name__}")
    for each in content:
        kind = each.get("type") if isinstance(each, dict) else None
        if kind == "identity":
            continue
        if kind not in ("scale", "translation"):
            raise FileFault(f"{where}: a coordinateTransformation must be a scale or a translation, got {kind!r}")
        numbers = _numbers(each.get(kind), count, f"{where}: {kind}")
        if kind == "scale":
            if min(numbers) <= 0:
                raise FileFault(f"{where}: scale must be positive along every axis, got {numbers}")
            scale = [a * b for a, b in zip(scale, numbers, strict=True)]
            translation = [a * b for a, b in zip(translation, numbers, strict=True)]
        else:
            translation = [a + b for a, b in zip(translation, numbers, strict=True)]
    return scale, translation


def _numbers(content: Any, count: int, where: str) -> list[float]:
    if not isinstance(content, Sequence) or isinstance(content, str) or len(content) != count:
        raise FileFault(f"{where} must have {count} numbers, one for each axis, got {content!r}")
    if not all(
        isinstance(each, int | float) and not isinstance(each, bool) and math.isfinite(each) for each in content
    ):
        raise FileFault(f"{where} must have finite numbers, got {content!r}")
    return [float(each) for each in content]


def _channels(ome: dict[str, Any]) -> tuple[Channel, ...]:
    """Return the channels of `omero`, which is transitional: what is malformed in it is left out."""
    omero = ome.get("omero")
    told = omero.get("channels") if isinstance(omero, dict) else None
    return tuple(map(_channel, range(len(told)), told)) if isinstance(told, list) else ()


def _channel(number: int, content: Any) -> Channel:
    content = content if isinstance(content, dict) else {}
    window = content.get("window")
    window = window if isinstance(window, dict) else {}
    ends = [float(each) if isinstance(each, int | float) else math.nan for each in map(window.get, ("start", "end"))]
    known = all(map(math.isfinite, ends)) and ends[0] < ends[1]
    label = content.get("label")
    return Channel(
        number,
        label if isinstance(label, str) else "",
        _color(content.get("color")),
        (ends[0], ends[1]) if known else None,
        bool(content.get("active", True)),
    )


def _color(text: Any) -> tuple[float, float, float] | None:
    """Return linear RGB of six hexadecimal digits, or None."""
    import numpy as np

    digits = str(text or "").lstrip("#")[:6]
    try:
        parts = [int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4)] if len(digits) == 6 else []
    except ValueError:
        parts = []
    if not parts:
        return None
    red, green, blue = (float(each) for each in linear_from_srgb(np.array(parts)))
    return red, green, blue
