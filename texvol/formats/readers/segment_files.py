"""Segments that a file names, without its samples: see `segments`."""

from __future__ import annotations

import os

from texvol.formats.readers import dicom, nrrd, segments
from texvol.formats.readers.loading import named_faults, silent_libraries


def segments_of(path: str | os.PathLike[str]) -> tuple[segments.Segment, ...]:
    """Return the segments of a .seg.nrrd, a DICOM SEG file, or a table of BIDS (.tsv); none if a file names none.

    Raises
    ------
    InputError, MissingExtraError
        If the file cannot be read.
    """
    name = os.fspath(path)
    if name.lower().endswith(".tsv"):
        return segments.of_table(name)

    is_nrrd = name.lower().endswith((".nrrd", ".nhdr"))
    with named_faults(name, "a segmentation", "formats"), silent_libraries():
        if is_nrrd:
            return segments.of_nrrd(nrrd.header_of(name))
        header = dicom.header_of(name)
        return () if header is None else segments.of_dicom(header)
