"""Files to Volumes: one module for each family of formats, one way in, one place where what goes wrong becomes a line.

A reader learns from the header where the samples lie, holds that against the file and the memory there is, and only
then reads. World coordinates are the file's own: nothing is turned or mirrored on the way.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from texvol.errors import InputError, TexvolError, missing_extra
from texvol.readers.detection import FORMATS, format_of
from texvol.readers.samples import Choice, FileFault, Samples
from texvol.terminal import one_line
from texvol.volume import Volume

__all__ = ["ARGUMENTS", "FORMATS", "load"]

ARGUMENTS = ("shape", "dtype", "series", "channel", "time", "spacing")  # of `load`, which a volume's source keeps


def load(
    path: str | os.PathLike[str],
    *,
    shape: Sequence[int] | None = None,
    dtype: str | None = None,
    spacing: Sequence[float] | None = None,
    series: str | int | None = None,
    channel: int | None = None,
    time: int | None = None,
) -> Volume:
    """The volume that a file, or a folder of slices, holds.

    Parameters
    ----------
    path : str or path
        NRRD, NIfTI, MetaImage, DICOM (file or folder), TIFF (file or folder of slices), MRC, VTI, NPY, or raw samples.
    shape : (nx, ny, nz)
        Dimensions of a raw file; of no other, since the others say.
    dtype : str
        Type of a raw file's samples in numpy's words, byte order included: "uint8", ">i2", "float32".
    spacing : (x, y, z)
        Distance of samples in world units, instead of the file's.
    series : str or int
        Which DICOM series of a folder: its UID, number or description.
    channel, time : int
        Which channel and time step of a file with more than three axes, from 0.

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
    choice = Choice(
        shape=None if shape is None else tuple(shape),
        dtype=dtype,
        series=None if series is None else str(series),
        channel=channel,
        time=time,
    )
    kind = "a volume"
    try:
        kind = format_of(name, choice)
        samples = _read(kind, name, choice)
    except FileFault as fault:
        # Readers of folders name the slice; of a single file that would be said twice.
        reason = one_line(fault).removeprefix(f"{os.path.basename(name)}: ")
        raise InputError(f"{name}: {reason}") from None
    except TexvolError:
        raise
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {one_line(error.strerror or error)}") from error
    except MemoryError as error:
        raise InputError(f"{name}: reading it asks for more memory than there is") from error
    except ImportError as error:
        raise missing_extra(error.name or str(error), "formats", f"{name}: reading {kind}") from error
    except Exception as error:  # whatever a library raises on a file that it can't make sense of
        raise InputError(f"{name}: cannot be read as {kind}: {one_line(str(error) or type(error).__name__)}") from error
    return Volume(
        samples.values,
        samples.spacing if spacing is None else spacing,
        samples.origin,
        samples.direction,
        unit=samples.unit,
        space=samples.space,
        name=name,
        source=_source(name, choice, spacing),
    )


def _source(path: str, choice: Choice, spacing: Sequence[float] | None) -> dict[str, Any]:
    """How the volume is read again."""
    told = choice._asdict() | {"spacing": None if spacing is None else [float(number) for number in spacing]}
    place = {"path": path, "absolute": os.path.abspath(path)}
    return place | {name: told[name] for name in ARGUMENTS if told[name] is not None}


def _read(kind: str, path: str, choice: Choice) -> Samples:
    """Samples of a file of that kind; a reader, and the library that it stands on, is imported when it is needed."""
    if kind == "NPY":
        from texvol.readers import npy

        return npy.read(path, choice)
    if kind == "raw":
        from texvol.readers import raw

        return raw.read(path, choice)
    with _silent_libraries():
        if kind == "NRRD":
            from texvol.readers import nrrd

            return nrrd.read(path, choice)
        if kind == "NIfTI":
            from texvol.readers import nifti

            return nifti.read(path, choice)
        if kind == "MetaImage":
            from texvol.readers import metaimage

            return metaimage.read(path, choice)
        if kind == "DICOM":
            from texvol.readers import dicom

            return dicom.read(path, choice)
        if kind == "TIFF":
            from texvol.readers import tiff

            return tiff.read(path, choice)
        if kind == "MRC":
            from texvol.readers import mrc

            return mrc.read(path, choice)
        from texvol.readers import vti

        return vti.read(path, choice)


@contextmanager
def _silent_libraries() -> Iterator[None]:
    """Keep the libraries' warnings and log lines off stderr: what matters of them is in the error or not an error."""
    import logging
    import warnings

    disabled = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(disabled)
