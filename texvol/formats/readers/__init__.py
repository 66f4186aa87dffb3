"""Readers of volume files: one module for each family of formats, with one entry point, `load`.

A reader learns from the header where the samples are, checks this against the size of the file and the available
memory, and reads only then. World coordinates are those of the file, without rotation or mirroring.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal

from texvol.formats.readers.detection import FORMATS
from texvol.formats.readers.loading import ARGUMENTS, checked, read, read_tetrahedra, volume_of
from texvol.formats.readers.samples import Choice
from texvol.formats.readers.time_series import TimeSeries, time_steps
from texvol.scene.tetrahedra import TetrahedralGrid
from texvol.scene.volume import Volume

__all__ = ["ARGUMENTS", "FORMATS", "TimeSeries", "load", "load_tetrahedra", "time_steps"]


def load(
    path: str | os.PathLike[str],
    *,
    shape: Sequence[int] | None = None,
    dtype: str | None = None,
    spacing: Sequence[float] | None = None,
    series: str | int | None = None,
    channel: int | Literal["magnitude"] | None = None,
    time: int | None = None,
    variable: str | None = None,
    resolution: Sequence[int] | None = None,
    labels: bool = False,
    blocks: bool = False,
    color: bool | None = None,
    missing: float | Sequence[float] | None = None,
    image: str | int | None = None,
    level: int | Literal["auto"] | None = None,
    fix_pyramid: bool = False,
    missing_chunks: bool = False,
    memory: int | None = None,
    label_names: str | os.PathLike[str] | None = None,
    resample: bool = False,
) -> Volume:
    """Return the volume of a file, a folder of slices, or a store of chunks.

    Parameters
    ----------
    path : str or path
        NRRD, NIfTI, Analyze, AFNI, MINC, GIPL, MetaImage, DICOM (file or folder), TIFF (file or folder of slices), CZI,
        ND2, LIF, MRC, VTI, VTR, VTS, netCDF, FITS, SEG-Y, OpenVDB, NPY, or raw samples; OME-Zarr and Zarr, also as
        http://, https:// or s3:// URL, HDF5 and Imaris, which become a `LargeVolume`; an unstructured grid as VTU,
        Exodus, legacy VTK, Gmsh, XDMF or MED, which is resampled.
    shape : (nx, ny, nz)
        Dimensions of a raw file; of no other, since the others say.
    dtype : str
        Type of a raw file's samples in numpy's words, byte order included: "uint8", ">i2", "float32".
    spacing : (x, y, z)
        Distance of samples in world units, instead of the file's.
    series : str or int
        Which DICOM series of a folder: its UID, number or description.
    channel : int or "magnitude"
        Which channel of a file with more than three axes, or component of its vectors, from 0; or the length of the
        vectors.
    time : int
        Which time step, from 0.
    variable : str
        Which variable of a netCDF file, or array of a VTK one; else the first that is a volume, or VTK's scalars. Which
        dataset of HDF5, array of a Zarr group without images, image of FITS, or grid of OpenVDB. `path` may end with
        `::NAME` in its place.
    resolution : (nx, ny, nz)
        Samples of the regular grid that a rectilinear, curvilinear or unstructured one becomes; else as many as its
        finest spacing needs, up to 4 times its own along an axis and up to 512, or its own if these are more.
    labels : bool
        Whether its values are labels, names of what is there: see `Volume`.
    blocks : bool
        True if samples are blocks: between them the value is the nearest one's.
    color : bool, optional
        Whether 3 or 4 components are colours, and a fourth opacity: see `Volume`. Unless told, they are where the file
        calls them so and no channel is chosen. Whole numbers are taken as sRGB, floats as linear.
    missing : number or sequence of numbers, optional
        Samples of these values are missing, beside those that the file itself marks: they become NaN, and integers
        float32, or float64 where that has not the digits. Of an array, masked ones are (`numpy.ma.masked_equal`).
    image : str or int
        Which image of a Zarr store: its name, number or path, such as "labels/nuclei"; which scene, position or image
        of CZI, ND2 and LIF.
    level : int or "auto"
        Level of a store's pyramid that is the finest to be read, from 0; all of them by default.
    fix_pyramid : bool
        Whether levels of a store are moved to where a comparison with the next finer level finds them.
    missing_chunks : bool
        Whether chunks of a store that cannot be read count as missing, instead of being an error.
    memory : int
        Bytes of a store's samples that may be held in memory; half of what is free by default.
    label_names : str or path
        Table with names and colours of labels, see `texvol.formats.label_tables`; "none" for none. By default the
        names and colours of a segmentation's own file, or else the table beside the file, of the same name or the only
        one in its folder, if it fits the labels.
    resample : bool
        Whether slices of DICOM that are unevenly apart, beside a line, or of a tilted gantry are resampled onto a grid
        at right angles, with the distance of the nearest slices unless `resolution` says; else these are an error, and
        a tilt is kept as a shear.

    Returns
    -------
    Volume
        Named after `path`.

    Raises
    ------
    InputError
        If the file can't be read as what it says it is; one line that names the file and the fault.
    MissingExtraError
        If the library for this format is not installed.
    """
    name = os.fspath(path)
    told = Choice(
        shape, dtype, series, channel, time, variable, resolution, spacing, labels, blocks, color, missing,
        image, level, fix_pyramid, missing_chunks, memory, None if label_names is None else os.fspath(label_names),
        resample,
    )  # fmt: skip
    choice = checked(name, told)
    return volume_of(name, read(name, choice), choice)


def load_tetrahedra(
    path: str | os.PathLike[str],
    *,
    variable: str | None = None,
    channel: int | None = None,
    time: int | None = None,
    missing: float | Sequence[float] | None = None,
) -> TetrahedralGrid:
    """Return the field of an unstructured grid on tetrahedra, as the file holds it and without resampling.

    Hexahedra, wedges and pyramids are split so that neighbours share the diagonals of their faces.

    Parameters
    ----------
    path : str or path
        VTU, Exodus, legacy VTK, Gmsh, XDMF or MED.
    variable, channel, time, missing
        As those of `load`.

    Raises
    ------
    InputError, MissingExtraError
        As `load`.
    """
    name = os.fspath(path)
    return read_tetrahedra(name, checked(name, Choice(channel=channel, time=time, variable=variable, missing=missing)))
