"""Scenes from the headers of pictures, as `scene_metadata` wrote them, with their volumes found again.

Anyone may have changed a header. Each part goes through the same checks as from any other source, and every fault
becomes one line that names the picture and the part.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import depth
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, BY_TRANSFER_FUNCTION, depth_metadata
from texvol.provenance import parts
from texvol.provenance.geometry import geometry_from_metadata
from texvol.provenance.metadata import Metadata
from texvol.provenance.volumes import ALWAYS, KEYS, AnyVolume, found_added, found_mask, found_volume, positions
from texvol.scene.added_volume import AddedVolume
from texvol.scene.air import checked_air
from texvol.scene.camera import Camera
from texvol.scene.cutting import checked_crop
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.display import NUMBER_MODES, checked_window, shown
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue
from texvol.scene.mask import Mask
from texvol.scene.measures.measure import Measure
from texvol.scene.scene import Scene
from texvol.util.errors import InputError

__all__ = ["AnyVolume", "StoredScene", "stored_scene_of"]
_ALWAYS = (*ALWAYS, "classification", "background")
_KEYS = dict.fromkeys(
    (*KEYS, "classification", "background", "format", "added", "mode", "isovalue", "air", "gradient", "lighting")
    + ("depth_cue", "camera", "transfer_function", "clip", "crop", "caps", "geometry", "settings", "window", "colors")
    + ("depth_in", "isosurfaces", "measures")
)


@dataclass(frozen=True)
class StoredScene:
    """Scene of a picture's header.

    Attributes
    ----------
    scene : Scene
    settings : mapping
        Arguments with which `Renderer.render` draws the picture again; empty if the oracle drew it.
    window : (centre, width), optional
        Window of an 8-bit picture of numbers.
    name : str
        Name of the picture in messages.
    measures : tuple of Measure
    """

    scene: Scene
    settings: Mapping[str, Any] = field(default_factory=dict)
    window: tuple[float, float] | None = None
    name: str = "scene"
    measures: tuple[Measure, ...] = ()

    @property
    def shows_numbers(self) -> bool:
        """True if the pixels of the picture are data, not light."""
        return self.scene.mode in NUMBER_MODES

    @property
    def texture_refinement(self) -> int:
        """Refinement of the texels whose medium the picture shows."""
        return int(self.settings.get("texture_refinement", 1))

    def in_eight_bits(self, picture: NDArray) -> NDArray[np.float64]:
        """Return the picture as an 8-bit file shows it: colours in [0, 1], linear, premultiplied."""
        if self.shows_numbers:
            picture = shown(picture, self.scene, window=self.window)
        return np.clip(np.asarray(picture, np.float64), 0.0, 1.0)


def stored_scene_of(
    attributes: Mapping[str, str],
    *,
    name: str,
    folder: str | os.PathLike[str] | None = None,
    volume: AnyVolume = None,
    mask: Mask | None = None,
    added: Sequence[AddedVolume | AnyVolume] = (),
) -> StoredScene:
    """Return the scene that a picture's header describes.

    Parameters
    ----------
    attributes : mapping
        The header, of which "texvol:scene" is read.
    name : str
        Name of the picture in messages.
    folder : path, optional
        Folder of the picture. The volume is searched relative to the current folder, relative to this folder, and at
        its absolute path.
    volume : Volume or path, optional
        The volume, instead of the search. It still must be the one that was drawn.
    mask : Mask, optional
        The volume's mask, instead of a search for its file.
    added : sequence of AddedVolume, Volume, path or None
        Further volumes in the order of the scene, instead of a search for their files; the transfer functions are
        always those of the header.

    Raises
    ------
    InputError
        If the header has no scene or is malformed, or a volume or a mask is not found or has changed.
    """
    if ATTRIBUTE not in attributes:
        raise InputError(f"{name}: has no scene in its header ({ATTRIBUTE}), where texvol writes it in EXR and PNG")
    metadata = Metadata.of(attributes[ATTRIBUTE], name, _KEYS, _ALWAYS)
    settings = metadata.part("settings", parts.settings) or {}
    window = metadata.part("window", lambda each: checked_window(parts.numbers(each, 2)))
    measures = metadata.part("measures", parts.measures) or ()
    described = _described(metadata, folder)
    # Volumes last, since reading them may take long.
    found = found_volume(metadata, volume, folder)
    described |= {"mask": found_mask(metadata, found, mask, folder), "added": found_added(metadata, added, folder)}
    scene = metadata.checked(lambda: Scene(found, **described))
    return StoredScene(scene, settings, window, name, measures)


def _depth(content: Any, folder: str | os.PathLike[str] | None) -> DepthPicture:
    """Return the depth picture of a header, read from its file."""
    if not isinstance(content, dict):
        raise InputError(f"must be an object, got {parts.quoted(content)}")
    source = parts.source(content.get("source") or {})
    for path in positions(source, folder):
        found = DepthPicture(depth.read(path), path, {"path": path, "absolute": os.path.abspath(path)})
        if depth_metadata(found)["checksum"] == content.get("checksum"):
            return found
    raise InputError(f"{parts.quoted(content.get('name'))} is not found, or has changed")


def _described(metadata: Metadata, folder: str | os.PathLike[str] | None) -> dict[str, Any]:
    """Return all arguments of the scene but volumes and masks."""
    described: dict[str, Any] = {
        "transfer_function": metadata.part("transfer_function", parts.transfer_function),
        "camera": metadata.part("camera", lambda each: parts.made(Camera, each)),
        "lighting": metadata.part("lighting", parts.lighting),
        "depth_cue": metadata.part("depth_cue", lambda each: parts.made(DepthCue, each)),
        "background": metadata.part("background", lambda each: parts.numbers(each, 3)),
        "isovalue": metadata.part("isovalue", parts.number),
        "air": metadata.part("air", checked_air),
        "coloring": "tf" if metadata.part("colors", lambda each: parts.word(each, BY_TRANSFER_FUNCTION)) else "grey",
        "gradient": metadata.part("gradient", lambda each: parts.made(Estimator, each)) or Estimator(),
        "clip": metadata.part("clip", parts.clip_planes) or (),
        "crop": metadata.part("crop", checked_crop),
        "caps": metadata.part("caps", parts.switch) or False,
        "geometry": metadata.part("geometry", lambda each: geometry_from_metadata(each, folder)) or (),
        "isosurfaces": metadata.part("isosurfaces", parts.isosurfaces) or (),
        "depth": metadata.part("depth_in", lambda each: _depth(each, folder)),
    }
    return described | {key: metadata.content[key] for key in ("classification", "mode") if key in metadata.content}
