"""Numbers, names and colours of the segments of a file, without its samples."""

from __future__ import annotations

import os

from texvol.formats.readers import dicom, nrrd
from texvol.formats.readers.loading import named_faults, silent_libraries
from texvol.formats.readers.segments import Segment, of_dicom, of_nrrd, of_table


def segments_of(path: str | os.PathLike[str]) -> tuple[Segment, ...]:
    """Return the segments of a .seg.nrrd, a DICOM SEG file, or a table of BIDS (.tsv); none if a file names none.

    Raises
    ------
    InputError, MissingExtraError
        If the file cannot be read.
    """
    name = os.fspath(path)
    if name.lower().endswith(".tsv"):
        return of_table(name)
    with named_faults(name, "a segmentation", "formats"), silent_libraries():
        if name.lower().endswith((".nrrd", ".nhdr")):
            return of_nrrd(nrrd.header_of(name))
        header = dicom.header_of(name)
        return () if header is None else of_dicom(header)
