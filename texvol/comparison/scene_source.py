"""Scenes from files: a picture that texvol drew, a scene file that names its volume, or a volume."""

from __future__ import annotations

import os
from pathlib import Path

from texvol.comparison.pictures import read_picture
from texvol.options.scene_options import SceneOptions
from texvol.provenance.stored_scene import AnyVolume, StoredScene, stored_scene_of
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

PICTURES = (".exr", ".png", ".jpg", ".jpeg")  # a TIFF is a volume; a TIFF picture has no scene
LONGEST_SIDE = 256  # pixels, of a small picture of a scene


def scene_of(path: str | os.PathLike[str], *, volume: AnyVolume = None) -> tuple[StoredScene, tuple[int, int]]:
    """Return the scene of a file, and the size of a small picture of the scene.

    Parameters
    ----------
    path : str or path
        A picture with a scene in its header; a scene file (.toml) with a `volume`; or a volume, whose scene is that of
        `texvol render` without further options.
    volume : Volume or path, optional
        Replaces the volume that the picture or the scene file names.

    Raises
    ------
    InputError
        If the file is none of these.
    """
    name = os.fspath(path)
    kind = Path(path).suffix.lower()
    if kind in PICTURES:
        picture = read_picture(path)
        folder = Path(path).resolve().parent
        stored = stored_scene_of(picture.attributes, name=name, folder=folder, volume=volume)
        height, width = picture.pixels.shape[:2]
        return stored, _small((width, height))
    if kind == ".toml":
        given = None if volume is None or isinstance(volume, Volume) else os.fspath(volume)
        scene_options = SceneOptions.of(given, name)
        found = volume if isinstance(volume, Volume) else scene_options.load()
        return _stored(scene_options, found, name), _small(scene_options.size)
    if volume is not None:
        raise InputError(f"{name}: is a volume; leave --volume out")
    scene_options = SceneOptions.of(name)
    return _stored(scene_options, scene_options.load(), name), (LONGEST_SIDE, LONGEST_SIDE)


def _small(size: tuple[int, int]) -> tuple[int, int]:
    """Return a size of the same shape that is quick to draw."""
    fraction = min(1.0, LONGEST_SIDE / max(size))
    return max(1, round(size[0] * fraction)), max(1, round(size[1] * fraction))


def _stored(scene_options: SceneOptions, volume: Volume, name: str) -> StoredScene:
    """Return a scene that is not drawn yet."""
    return StoredScene(scene_options.scene(volume), {}, scene_options.window, name)
