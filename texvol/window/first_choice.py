"""Choices for files that need one: of several time steps the first, of vectors the length."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, TypeVar

from texvol.formats.readers.loading import axis_length, checked
from texvol.formats.readers.magnitude import MAGNITUDE
from texvol.formats.readers.samples import Choice
from texvol.formats.readers.time_series import time_steps
from texvol.options.scene_options import SceneOptions
from texvol.util.errors import InputError, TexvolError

T = TypeVar("T")


def made(make: Callable[[Mapping[str, Any]], T], path: str, told: Mapping[str, Any]) -> T:
    """Return `make` of no further options, or of those that the file needs beside those that are told.

    Parameters
    ----------
    make : callable
        Takes further options, arguments of `texvol.load`, and raises InputError if these do not suffice.

    Raises
    ------
    InputError
        That of `make`, if no choice mends it.
    """
    further: dict[str, Any] = {}
    while True:
        try:
            return make(further)
        except InputError:
            found = _needed(path, {**told, **further})
            if not found:
                raise
            further |= found


def _needed(path: str, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the next option that the file may need; none if there is nothing to choose."""
    with suppress(TexvolError):
        if told.get("time") is None and time_steps(path, **told) > 1:
            return {"time": 0}
    with suppress(TexvolError):
        if told.get("channel") is None and axis_length(path, checked(path, Choice(**told)), "C") > 1:
            warnings.warn("vectors are shown by their length; --channel N shows one component", stacklevel=2)
            return {"channel": MAGNITUDE}
    return {}


def opened_with(make: Callable[[argparse.Namespace], T], arguments: argparse.Namespace) -> T:
    """Return `make` of the command line's arguments, with the options that the volume's file needs.

    Raises
    ------
    InputError
        That of `make`, if no choice mends it.
    """
    try:
        return make(arguments)
    except InputError:
        options = SceneOptions(arguments)
        path, told = options.volume, options.told
    return made(lambda further: make(argparse.Namespace(**{**vars(arguments), **further})), path, told)
