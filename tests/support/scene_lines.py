"""Scene options of a line, a scene file, or both, and the scene that they make."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.options.scene_options import SceneOptions
from texvol.scene.scene import Scene


def chosen(*line: str, file: str | None = None, path: str = "scene.toml", volume: str = "v.npy") -> SceneOptions:
    """Scene options of a line and the text of a scene file."""
    parser = argparse.ArgumentParser(exit_on_error=False)
    reading_options.add_volume_options(parser)
    options.add_scene_options(parser)
    if file is not None:
        Path(path).write_text(file, encoding="utf-8")
        line = (*line, "--scene", path)
    return SceneOptions(parser.parse_args(texts.with_negative_values([volume, *line])))


def scene(*line: str, **further: Any) -> Scene:
    made = chosen(*line, **further)
    return made.scene(made.load())
