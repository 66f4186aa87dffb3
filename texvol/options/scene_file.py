"""Scene files: TOML whose keys are scene options, and a volume with how it is read; see `options`."""

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
    """What knows how a value of a scene file is meant."""

    def from_file(self, value: Any) -> Any:
        """What the value becomes, or InputError, or argparse.ArgumentTypeError."""


class SceneFile(NamedTuple):
    """What a scene file says."""

    chosen: dict[str, Any]  # scene options by name
    reading: dict[str, Any]  # `volume`, and how it is read


def read(path: str | os.PathLike[str], scene: Mapping[str, Option], reading: Mapping[str, Option]) -> SceneFile:
    """The content of a scene file with these options; paths in it are relative to it.

    Raises
    ------
    InputError
        If it can't be read, is no TOML, or has a key or a value that is none.
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
            raise InputError(f"{path}: there is no scene option {key!r}; there are {known}")
    if found.reading and "volume" not in found.reading:
        raise InputError(f"{path}: {', '.join(found.reading)} is for a volume, and the file names none")
    return found._replace(chosen=beside(found.chosen, path.parent))


def _volume(value: Any, path: Path) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"{path}: volume is the path of a file or folder, and not {value!r}")
    return str(path.parent / value)


def _converted(option: Option, value: Any, key: str, path: Path) -> Any:
    try:
        return option.from_file(value)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{path}: {key}: {error}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
