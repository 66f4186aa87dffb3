"""Choices for files that need one: of several time steps the first, of vectors the length."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from texvol.formats.readers.loading import axis_length, checked
from texvol.formats.readers.magnitude import MAGNITUDE
from texvol.formats.readers.samples import Choice
from texvol.formats.readers.time_series import time_steps
from texvol.options.scene_options import SceneOptions
from texvol.util.errors import TexvolError


def choice_for(path: str, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a file needs beside those that are told, as arguments of `texvol.load`; mostly none."""
    found: dict[str, Any] = {}
    with suppress(TexvolError):
        if told.get("time") is None and time_steps(path, **told) > 1:
            found["time"] = 0
    with suppress(TexvolError):
        told = {**told, **found}
        if told.get("channel") is None and axis_length(path, checked(path, Choice(**told)), "C") > 1:
            found["channel"] = MAGNITUDE
            warnings.warn("vectors are shown by their length; --channel N shows one component", stacklevel=2)
    return found


def with_choice(arguments: argparse.Namespace) -> argparse.Namespace | None:
    """Return the arguments with the options that the volume's file needs; None if these change nothing."""
    options = SceneOptions(arguments)
    found = choice_for(options.volume, options.told)
    return argparse.Namespace(**vars(arguments) | found) if found else None
