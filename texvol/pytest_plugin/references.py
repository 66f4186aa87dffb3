"""Reference pictures: found by name in their folder, read, and written as small EXR files that say what made them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.limits import DRIVER_ATTRIBUTE
from texvol.comparison.pictures import Picture, read_picture
from texvol.formats.pictures import image
from texvol.pytest_plugin import repeats
from texvol.util import fingerprint
from texvol.util.errors import InputError
from texvol.util.text_files import parsed_json

SUFFIXES = (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg")
FINGERPRINT_ATTRIBUTE = "texvol:fingerprint"
CONTAINER_ATTRIBUTE = "texvol:container"  # of the picture that the reference was made of, before it was stored
_KEPT = ("Software", "texvol:scene", DRIVER_ATTRIBUTE, repeats.ATTRIBUTE)


@dataclass(frozen=True)
class Reference:
    """Where a picture's reference is, or is to be."""

    path: Path
    exists: bool

    def read(self) -> Picture:
        """The picture; InputError where it can't be read."""
        picture = read_picture(self.path)
        return replace(picture, container=picture.attributes.get(CONTAINER_ATTRIBUTE, picture.container))


def find(folder: Path, name: str) -> Reference:
    """The reference of that name; an EXR that is to be written where there is none.

    Raises
    ------
    InputError
        If there are two of them.
    """
    there = [path for suffix in SUFFIXES if os.path.lexists(path := folder / f"{name}{suffix}")]
    if len(there) > 1:
        names = " and ".join(path.name for path in there)
        raise InputError(f"picture {name!r} has several references in {there[0].parent}: {names}; keep one")
    return Reference(there[0], True) if there else Reference(folder / f"{name}.exr", False)


def position_of(reference: Reference, picture: Picture) -> Path:
    """Where the picture is the reference.

    A PNG of colours stays one; of every other format the EXR takes the place, which holds all that there is.
    """
    path = reference.path
    if path.suffix.lower() == ".png" and picture.channels >= 3:
        return path
    return path.with_suffix(".exr") if path.suffix.lower() in SUFFIXES else path


def encoded(path: Path, picture: Picture) -> bytes:
    """A picture file with as many channels as the picture has, and its fingerprint."""
    transparent = path.suffix.lower() == ".png" and picture.has_opacity
    pixels = picture.pixels if path.suffix.lower() == ".png" else _channels(picture)
    return image.encoded(path, pixels, attributes_of(picture), transparent=transparent)


def attributes_of(picture: Picture) -> dict[str, str]:
    """What a header is to say: scene and driver where they are known, and the fingerprint."""
    kept = {name: picture.attributes[name] for name in _KEPT if name in picture.attributes}
    return kept | {
        FINGERPRINT_ATTRIBUTE: json.dumps(fingerprint_of(picture)),
        CONTAINER_ATTRIBUTE: picture.container,
    }


def fingerprint_of(picture: Picture) -> dict[str, str]:
    """The picture's own fingerprint, or that of what makes pictures now."""
    with suppress(KeyError, ValueError):
        found = parsed_json(picture.attributes[FINGERPRINT_ATTRIBUTE], "the fingerprint")
        if isinstance(found, dict):
            return {str(name): str(fact) for name, fact in found.items()}
    return fingerprint.of_picture(driver_of(picture.attributes))


def like_stored(picture: Picture, stored: Picture) -> Picture:
    """The picture as it is when it has been stored: grey with opacity is RGBA then."""
    return replace(picture, channels=4) if (picture.channels, stored.channels) == (2, 4) else picture


def driver_of(attributes: Mapping[str, str]) -> str | None:
    """What drew a picture, where its header says so."""
    return attributes.get(DRIVER_ATTRIBUTE) or None


def _channels(picture: Picture) -> NDArray[np.float32]:
    """The pixels in the channels that the picture came with; grey with opacity, which EXR has no names for, as RGBA."""
    chosen = {1: [0], 2: [0, 1, 2, 3], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[picture.channels]
    return np.ascontiguousarray(picture.pixels[..., chosen])
