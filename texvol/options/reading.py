"""Options that say which volume is meant, and how its file is read."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from texvol.options import texts
from texvol.options.scene_option import SceneOption
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

READING = {
    option.name: option
    for option in (
        SceneOption("shape", texts.dimensions, "NX,NY,NZ", "dimensions of a RAW file"),
        SceneOption("dtype", str, "TYPE", "sample type of a RAW file: uint8, >i2 (big-endian), float32 …"),
        SceneOption("series", str, "NAME", "which series of a DICOM folder"),
        SceneOption("channel", texts.index, "N", "which channel, from 0"),
        SceneOption("variable", str, "NAME", "which variable of a netCDF file, or array of a VTK one"),
        SceneOption(
            "time",
            texts.time_step,
            "N|all",
            "which time step, from 0; with all of them `render` makes numbered pictures, or a film",
        ),
        SceneOption(
            "resolution",
            texts.dimensions,
            "NX,NY,NZ",
            "samples of the regular grid that a rectilinear or curvilinear one becomes",
        ),
        SceneOption("labels", bool, "", "its values are labels: never mixed, each shown in a colour of its own"),
        SceneOption("color", bool, "", "its 3 or 4 components are colour; unless told, where the file calls them so"),
        SceneOption(
            "missing",
            texts.sample_value,
            "V",
            "samples of this value are missing, as those are that the file marks; give it again for further values",
            from_value=texts.sample_values,
            repeated=True,
        ),
    )
}


def add_volume_options(parser: argparse.ArgumentParser, *, in_scene_file: bool = False) -> None:
    """VOLUME and how to read it, but for the spacing, which is a scene option; a scene file may name it instead."""
    formats = "NRRD, NIfTI, MetaImage, DICOM folder, TIFF, MRC, VTI, VTR, VTS, netCDF, NPY, RAW"
    if in_scene_file:
        parser.add_argument("volume", metavar="VOLUME", nargs="?", help=f"{formats}; or the scene file's `volume`")
    else:
        parser.add_argument("volume", metavar="VOLUME", help=formats)
    group = parser.add_argument_group("reading the volume")
    for option in READING.values():
        option.add_to(group)


def load_volume(arguments: argparse.Namespace, spacing: tuple[float, float, float] | None) -> Volume:
    """The volume that the arguments name; `spacing` overrides the file's."""
    from texvol.formats.readers import load

    return load(arguments.volume, spacing=spacing, **told(vars(arguments)))


def told(given: Mapping[str, Any]) -> dict[str, Any]:
    """What is said of how the volume is read.

    Raises
    ------
    InputError
        If that is every time step, and one is wanted.
    """
    found = chosen(given)
    if found.get("time") == texts.ALL:
        raise InputError("--time all is for `texvol render`; here one step is wanted: --time N")
    return found


def chosen(given: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the options that were given."""
    return {name: given[name] for name in READING if given.get(name) is not None}
