"""Options that name a volume and tell how its file is read."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from texvol.formats.label_tables import NONE
from texvol.options import texts
from texvol.options.scene_option import SceneOption
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_OPTIONS = (
    SceneOption("shape", texts.dimensions, "NX,NY,NZ", "dimensions of a RAW file"),
    SceneOption("dtype", str, "TYPE", "sample type of a RAW file: uint8, >i2 (big-endian), float32 …"),
    SceneOption("series", str, "NAME", "series of a DICOM folder"),
    SceneOption(
        "channel", texts.channel, "N|magnitude", "channel or component of vectors, from 0; or the length of the vectors"
    ),
    SceneOption(
        "variable", str, "NAME",
        "variable of netCDF, array of a VTK or mesh file, dataset of HDF5, image of FITS, grid of OpenVDB",
    ),
    SceneOption(
        "time", texts.time_step, "N|all",
        "time step, from 0; with `all`, `render` writes numbered pictures or a film, `convert` an unnamed axis as time",
    ),
    SceneOption(
        "resolution", texts.dimensions, "NX,NY,NZ",
        "samples of the regular grid to which a rectilinear, curvilinear or unstructured grid is resampled",
    ),
    SceneOption(
        "resample", bool, "", "resample DICOM slices that are unevenly apart, or of a tilted gantry, at right angles",
    ),
    SceneOption("labels", bool, "", "the values are labels: never interpolated, each with a colour of its own"),
    SceneOption(
        "label-names", texts.file_name, "FILE|none",
        "names and colours of labels: a table of ITK-SNAP, FreeSurfer, 3D Slicer, FSL or BIDS, or lines LABEL NAME "
        "(default: those of the file, or the table beside it)",
    ),
    SceneOption("blocks", bool, "", "samples are blocks, not interpolated: the value anywhere is the nearest one's"),
    SceneOption("color", bool, "", "the 3 or 4 components are a colour (default: if the file says so)"),
    SceneOption(
        "missing", texts.sample_value, "V",
        "samples of this value are missing, besides those that the file marks; repeat it for more values",
        from_value=texts.sample_values, repeated=True,
    ),
    SceneOption("image", str, "NAME|N", "image of a Zarr store, such as labels/nuclei, or of CZI, ND2 and LIF"),
    SceneOption("level", texts.level, "N|auto", "finest level of a store's pyramid that is read, from 0"),
    SceneOption("fix-pyramid", bool, "", "move a store's levels to where their content is found"),
    SceneOption("missing-chunks", bool, "", "chunks of a store that cannot be read are missing, not an error"),
    SceneOption("memory", texts.memory, "SIZE", "memory for samples of a store, such as 4GB (half of what is free)"),
)  # fmt: skip
READING = {option.name: option for option in _OPTIONS}


def add_volume_options(parser: argparse.ArgumentParser, *, in_scene_file: bool = False) -> None:
    """Add VOLUME and how it is read; with `in_scene_file`, VOLUME may be left out. --spacing is a scene option."""
    formats = (
        "NRRD, NIfTI, Analyze, AFNI, MINC, GIPL, MGH, MetaImage, DICOM folder or file, TIFF, CZI, ND2, LIF, MRC, VTI, "
    )
    formats += "VTR, VTS, VTU, netCDF, Exodus, VTK, Gmsh, XDMF, MED, FITS, SEG-Y, OpenVDB, NPY, RAW; OME-Zarr or its "
    formats += "URL, Zarr, HDF5, Imaris; FILE::NAME is FILE with --variable NAME"
    shown = f"{formats}; or a scene file" if in_scene_file else formats
    parser.add_argument("volume", metavar="VOLUME", nargs="?" if in_scene_file else None, help=shown)
    add_options(parser)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that tell how a volume's file is read."""
    group = parser.add_argument_group("reading the volume")
    for option in READING.values():
        option.add_to(group)


def load_volume(arguments: argparse.Namespace, spacing: tuple[float, float, float] | None) -> Volume:
    """Return the volume that the arguments name; `spacing` (x, y, z), if given, overrides the file's."""
    from texvol.formats.readers import load

    return load(arguments.volume, spacing=spacing, **told(vars(arguments)))


def told(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the reading options that are given as arguments of `texvol.load`.

    Raises
    ------
    InputError
        If they ask for all time steps.
    """
    found = arguments_of(chosen(given))
    if found.get("time") == texts.ALL:
        raise InputError("--time all needs `texvol render`; elsewhere give one step: --time N")
    return found


def chosen(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the reading options that are given, by name, all time steps included."""
    named = {name.replace("_", "-"): value for name, value in given.items()}
    return {name: named[name] for name in READING if named.get(name) is not None}


def beside(options: Mapping[str, Any], folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Return reading options of a scene file with their paths relative to the file's folder."""
    table = options.get("label-names", NONE)
    return dict(options) if table == NONE else {**options, "label-names": str(Path(folder) / table)}


def arguments_of(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options by the names of the arguments of `texvol.load`."""
    return {name.replace("-", "_"): value for name, value in options.items()}
