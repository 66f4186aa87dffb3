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
from texvol.options import reading
from texvol.options.scene_options import SceneOptions
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, TexvolError

T = TypeVar("T")


def made(make: Callable[[Mapping[str, Any]], T], path: str, told: Mapping[str, Any], *, tells_step: bool = False) -> T:
    """Return `make` of no further options, or of those that the file needs beside those that are told.

    Parameters
    ----------
    make : callable
        Takes further options, arguments of `texvol.load`, and raises InputError if these do not suffice.
    tells_step : bool
        Warn where the first of several time steps is taken, as nothing else shows that there are others.

    Raises
    ------
    InputError
        That of `make`, if no choice mends it.
    """
    further: dict[str, Any] = {}
    remarks: list[str] = []
    fault: InputError | None = None
    while True:
        try:
            result = make(further)
        except InputError as error:
            fault = fault if "channel" in further and fault is not None else error
            found, remark = _needed(path, {**told, **further})
            if not found:
                raise fault from None
            further |= found
            remarks += [remark] if tells_step or "time" not in found else []
        else:
            for remark in remarks:
                warnings.warn(remark, stacklevel=2)
            return result


def _needed(path: str, told: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """Return the next option that the file may need, none if there is nothing to choose, and a sentence about it."""
    with suppress(TexvolError):
        if told.get("time") is None and (steps := time_steps(path, **told)) > 1:
            return {"time": 0}, f"the first of {steps} time steps is taken; --time N takes another"
    with suppress(TexvolError):
        if told.get("channel") is None and axis_length(path, checked(path, Choice(**told)), "C") > 1:
            return {"channel": MAGNITUDE}, "vectors are shown by their length; --channel N shows one component"
    return {}, ""


def volume_of(arguments: argparse.Namespace) -> Volume:
    """Return the volume that a command's arguments name, with the options that its file needs; warn of a first step."""

    def load(further: Mapping[str, Any]) -> Volume:
        return reading.load_volume(_more(arguments, further), arguments.spacing)

    return made(load, arguments.volume, reading.told(vars(arguments)), tells_step=True)


def opened_with(
    make: Callable[[argparse.Namespace], T], arguments: argparse.Namespace, *, tells_step: bool = False
) -> T:
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
    return made(lambda further: make(_more(arguments, further)), path, told, tells_step=tells_step)


def _more(arguments: argparse.Namespace, further: Mapping[str, Any]) -> argparse.Namespace:
    return argparse.Namespace(**{**vars(arguments), **further})
