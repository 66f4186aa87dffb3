"""Common form of two pictures: what the formats of both can hold, applied to both before they are compared.

numbers    modes xray, mip, minip and average: if one picture holds numbers and the other shows them in whole
           numbers, the numbers become grey or colours as the header of the latter says
range      cut to 0 … 1 if one picture holds whole numbers
straight   if one picture holds straight colour in whole numbers, its colour ends at 1, premultiplied colour at the
           opacity; the other picture is cut in the channels that reach that end
opacity    left out if one picture has none: that picture lies over its background, and texvol has put the background
           into the other picture's colours already
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.pictures import Picture
from texvol.util.errors import InputError, TexvolError
from texvol.util.text_files import parsed_json

if TYPE_CHECKING:
    from texvol.provenance.stored_scene import StoredScene

SCENE_ATTRIBUTE = "texvol:scene"
NUMBER_MODES = ("xray", "mip", "minip", "average")  # display.NUMBER_MODES, without its imports
SHOWING = ("window", "colors")  # parts of a header on the display of numbers
_ROUNDING = 2.0**-20  # straight colour 1 is read as opacity times 1 in float32


@dataclass(frozen=True)
class CommonForm:
    """Form that both pictures of a pair can hold.

    Attributes
    ----------
    ends_at_one, has_opacity : bool
    cut : array of shape (height, width, 3) or None
        True for channels whose straight colour reaches 1, so that premultiplied colour is cut at the opacity.
    display : StoredScene or None
        How numbers are shown; None if no numbers have to be shown.
    reason : str
        Why numbers that have to be shown cannot be shown; empty otherwise.
    """

    ends_at_one: bool
    has_opacity: bool
    cut: NDArray[np.bool_] | None = None
    display: StoredScene | None = None
    reason: str = ""

    @classmethod
    def of_pair(cls, candidate: Picture, reference: Picture) -> CommonForm:
        """Return the common form of two pictures of one size."""
        pair = candidate, reference
        display, reason = _display(*pair)
        both = all(each.has_opacity for each in pair)
        masks = [mask for each in pair if (mask := _at_the_end(each)) is not None] if both else []
        return cls(
            ends_at_one=any(each.whole_numbers for each in pair),
            has_opacity=both,
            cut=np.logical_or.reduce(masks) if masks else None,
            display=display,
            reason=reason,
        )

    def of(self, picture: Picture) -> Picture:
        """Return one picture of the pair in this form."""
        pixels = picture.pixels
        if self.display is not None and not picture.whole_numbers:
            pixels = self.display.in_eight_bits(pixels).astype(np.float32)
        pixels = self._cut(pixels, picture.whole_numbers)
        if not self.has_opacity and picture.has_opacity:
            pixels = np.dstack([pixels[..., :3], np.ones(pixels.shape[:2], np.float32)])
        return picture if pixels is picture.pixels else replace(picture, pixels=np.asarray(pixels, np.float32))

    def of_truth(self, truth: NDArray[np.float64], stored: StoredScene) -> NDArray[np.float64]:
        """Return the oracle's picture of a scene in this form, shape (height, width, 4)."""
        if self.ends_at_one:
            shown = self.display or stored
            scene = replace(stored.scene, coloring=shown.scene.coloring)
            truth = replace(stored, window=shown.window, scene=scene).in_eight_bits(truth)
        truth = np.array(self._cut(truth, False), np.float64)
        if not self.has_opacity:
            truth[..., 3] = 1.0
        return truth

    def _cut(self, pixels: NDArray, holds_whole_numbers: bool) -> NDArray:
        """Return the pixels, cut at the pair's ends; whole numbers are cut already."""
        if not self.ends_at_one or holds_whole_numbers:
            return pixels
        pixels = np.clip(pixels, 0, 1)
        if self.cut is not None:
            most = np.where(self.cut, pixels[..., 3:], 1)
            pixels = np.concatenate([np.minimum(pixels[..., :3], most), pixels[..., 3:]], axis=2)
        return pixels


def header_of(picture: Picture) -> dict[str, Any] | None:
    """Return the scene in a picture's header as it is stored; None if there is none, or no JSON object."""
    try:
        found = parsed_json(picture.attributes.get(SCENE_ATTRIBUTE, ""), picture.name)
    except InputError:
        return None
    return found if isinstance(found, dict) else None


def holds_numbers(picture: Picture) -> bool:
    """True if the picture is floating point, and its scene's mode makes pictures of the volume's own numbers."""
    if picture.whole_numbers:
        return False
    header = header_of(picture)
    return header is not None and header.get("mode") in NUMBER_MODES


def _at_the_end(picture: Picture) -> NDArray[np.bool_] | None:
    """Return the channels whose straight colour is the largest whole number; None without straight colour."""
    if not (picture.whole_numbers and picture.is_straight):
        return None
    opacity = picture.pixels[..., 3:]
    return np.asarray(np.abs(picture.pixels[..., :3] - opacity) <= _ROUNDING * opacity)


def _display(candidate: Picture, reference: Picture) -> tuple[StoredScene | None, str]:
    """Return how numbers are shown if one picture holds and the other shows them, or why that is unknown."""
    for numbers, colors in ((candidate, reference), (reference, candidate)):
        if colors.whole_numbers and holds_numbers(numbers):
            own, other = header_of(numbers) or {}, header_of(colors) or {}
            if not _says_how(other):
                other = own | {key: other[key] for key in ("background", "transfer_function") if key in other}
            try:
                found = _shown_as(other, colors.name) if _says_how(other) else _as_found(numbers)
            except TexvolError as error:
                return None, f"{numbers.name} holds numbers, and the display of {colors.name} is unknown: {error}"
            return found, ""
    return None, ""


def _says_how(header: Mapping[str, Any]) -> bool:
    return header.get("mode") in NUMBER_MODES and any(header.get(key) is not None for key in SHOWING)


def _shown_as(header: Mapping[str, Any], name: str) -> StoredScene:
    """Return the display of a header as a stored scene, whose volume is a single sample and means nothing."""
    from texvol.formats.pictures.scene_metadata import scene_metadata
    from texvol.provenance.stored_scene import stored_scene_of
    from texvol.scene.scene import Scene
    from texvol.scene.volume import Volume

    volume = Volume(np.zeros((1, 1, 1), np.float32))
    plain = json.loads(scene_metadata("", Scene(volume, mode="mip"))[SCENE_ATTRIBUTE])
    kept = ("mode", "background", "transfer_function", *SHOWING)
    text = json.dumps(plain | {key: header[key] for key in kept if key in header})
    return stored_scene_of({SCENE_ATTRIBUTE: text}, name=name, volume=volume)


def _as_found(numbers: Picture) -> StoredScene:
    """Return the display that texvol chooses by itself; needs the volume, whose range may be the window."""
    from texvol.provenance.stored_scene import stored_scene_of
    from texvol.scene.display import found_window

    folder = Path(numbers.name).resolve().parent
    stored = stored_scene_of(numbers.attributes, name=numbers.name, folder=folder)
    return replace(stored, window=found_window(numbers.pixels, stored.scene))
