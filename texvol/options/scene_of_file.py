"""Scene of a scene file, for Python."""

from __future__ import annotations

import os

from texvol.options.scene_options import SceneOptions
from texvol.scene.scene import Scene


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Return the scene of a scene file.

    Raises
    ------
    InputError
        If the file, or one that it names, can't be read.
    """
    options = SceneOptions.of(scene=os.fspath(path))
    return options.scene(options.load())
