"""Reference pictures: found by name in their folder, read, and written as small EXR files with a fingerprint."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from texvol.comparison.limits import DRIVER_ATTRIBUTE
from texvol.comparison.pictures import Picture, read_picture
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import ATTRIBUTE
from texvol.pytest_plugin import repeats
from texvol.scene.refinement import REFINEMENTS
from texvol.scene.scene import CLASSIFICATIONS, Classification
from texvol.util import fingerprint
from texvol.util.errors import InputError
from texvol.util.text_files import parsed_json

SUFFIXES = (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg")
FINGERPRINT_ATTRIBUTE = "texvol:fingerprint"
CONTAINER_ATTRIBUTE = "texvol:container"  # container of the picture before it was stored as reference
_KEPT = ("Software", "texvol:scene", DRIVER_ATTRIBUTE, repeats.ATTRIBUTE)


@dataclass(frozen=True)
class Reference:
    """Path of a picture's reference, which may not exist yet."""

    path: Path
    exists: bool

    def read(self) -> Picture:
        """Read the picture; raise InputError if it can't be read."""
        picture = read_picture(self.path)
        return replace(picture, container=picture.attributes.get(CONTAINER_ATTRIBUTE, picture.container))

    @property
    def drawn_as(self) -> tuple[Classification, int] | None:
        """Classification and texture refinement in the reference's header; None if it does not say."""
        with suppress(InputError, KeyError, ValueError):
            content = parsed_json(self.read().attributes[ATTRIBUTE], "the scene") if self.exists else None
            if isinstance(content, dict) and content.get("classification") in CLASSIFICATIONS:
                refinement = (content.get("settings") or {}).get("texture_refinement")
                return content["classification"], refinement if refinement in REFINEMENTS else 1
        return None


def find(folder: Path, name: str) -> Reference:
    """Return the reference of that name; a new EXR if there is none.

    Raises
    ------
    InputError
        If there are several.
    """
    there = [path for suffix in SUFFIXES if os.path.lexists(path := folder / f"{name}{suffix}")]
    if len(there) > 1:
        names = " and ".join(path.name for path in there)
        raise InputError(f"picture {name!r} must have one reference in {there[0].parent}, got {names}; keep one")
    return Reference(there[0], True) if there else Reference(folder / f"{name}.exr", False)


def position_of(reference: Reference, picture: Picture) -> Path:
    """Return the path at which the picture becomes the reference.

    A PNG of colours stays a PNG; all other formats become an EXR, which holds all channels and digits.
    """
    path = reference.path
    if path.suffix.lower() == ".png" and picture.channels >= 3:
        return path
    return path.with_suffix(".exr") if path.suffix.lower() in SUFFIXES else path


def encoded(path: Path, picture: Picture) -> bytes:
    """Return a picture file with the picture's channels and its fingerprint."""
    if path.suffix.lower() == ".png":
        return image.encoded(path, picture.pixels, attributes_of(picture), transparent=picture.has_opacity)
    # EXR has no grey with opacity: it becomes RGBA.
    chosen = {1: [0], 3: [0, 1, 2]}.get(picture.channels, [0, 1, 2, 3])
    return image.encoded(path, np.ascontiguousarray(picture.pixels[..., chosen]), attributes_of(picture))


def attributes_of(picture: Picture) -> dict[str, str]:
    """Return the header: scene and driver if they are known, and the fingerprint."""
    kept = {name: picture.attributes[name] for name in _KEPT if name in picture.attributes}
    return kept | {
        FINGERPRINT_ATTRIBUTE: json.dumps(fingerprint_of(picture)),
        CONTAINER_ATTRIBUTE: picture.container,
    }


def fingerprint_of(picture: Picture) -> dict[str, str]:
    """Return the picture's own fingerprint, or that of this machine."""
    with suppress(KeyError, ValueError):
        found = parsed_json(picture.attributes[FINGERPRINT_ATTRIBUTE], "the fingerprint")
        if isinstance(found, dict):
            return {str(name): str(fact) for name, fact in found.items()}
    return fingerprint.of_picture(driver_of(picture.attributes))


def like_stored(picture: Picture, stored: Picture) -> Picture:
    """Return the picture as stored: grey with opacity becomes RGBA."""
    return replace(picture, channels=4) if (picture.channels, stored.channels) == (2, 4) else picture


def driver_of(attributes: Mapping[str, str]) -> str | None:
    """Return the driver in a picture's header, or None."""
    return attributes.get(DRIVER_ATTRIBUTE) or None
