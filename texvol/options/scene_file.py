"""Scene files: TOML whose keys are scene options, `volume` and options for reading the volume; see `options`."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from texvol.options.volumes import beside
from texvol.util import text_files
from texvol.util.errors import InputError


class Option(Protocol):
    """Converter of a scene-file value."""

    def from_file(self, value: Any) -> Any:
        """Return the converted value, or raise InputError or argparse.ArgumentTypeError."""


class SceneFile(NamedTuple):
    """Content of a scene file."""

    chosen: dict[str, Any]  # scene options by name
    reading: dict[str, Any]  # `volume`, and how it is read


def read(path: str | os.PathLike[str], scene: Mapping[str, Option], reading: Mapping[str, Option]) -> SceneFile:
    """Return the content of a scene file with these options; paths in it are relative to its folder.

    Raises
    ------
    InputError
        If the file can't be read, is not TOML, or has an unknown key or a wrong value.
    """
    path = Path(path)
    found = SceneFile({}, {})
    for key, value in text_files.read_toml(path).items():
        name = key.replace("_", "-")
        if name == "volume":
            found.reading[name] = _volume(value, path)
        elif name in reading:
            found.reading[name] = _converted(reading[name], value, key, path)
        elif name in scene:
            found.chosen[name] = _converted(scene[name], value, key, path)
        else:
            known = ", ".join((*scene, "volume", *reading))
            raise InputError(f"{path}: unknown scene option {key!r}; scene options are {known}")
    if found.reading and "volume" not in found.reading:
        raise InputError(f"{path}: {', '.join(found.reading)} needs a volume: name it (volume = …)")
    return found._replace(chosen=beside(found.chosen, path.parent))


def _volume(value: Any, path: Path) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"{path}: volume must be the path of a file or folder, got {value!r}")
    return str(path.parent / value)


def _converted(option: Option, value: Any, key: str, path: Path) -> Any:
    try:
        return option.from_file(value)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{path}: {key}: {error}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
