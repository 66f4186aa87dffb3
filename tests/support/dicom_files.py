"""DICOM files of the marked volume, for the tests of the reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pydicom
from numpy.typing import NDArray
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian

from support import marked

# Slices turned by 30° about the patient's z and tilted against it; rows and columns at right angles.
_TILT = np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
AXES = (marked.DIRECTION @ np.diag([1.0, 1.0, -1.0]) @ _TILT).T[:2]
NORMAL = np.cross(*AXES)
_COLUMNS = np.column_stack([*AXES, NORMAL])
POSITION = marked.position_of_mark(direction=_COLUMNS)


def slice_of(
    number: int, pixels: NDArray | None = None, step: NDArray | None = None, uid: str = "2.5.6", **fields: object
) -> FileDataset:
    """Slice `number` of a series, with further fields."""
    pixels = marked.marked()[number] if pixels is None else pixels
    meta = FileMetaDataset()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = f"2.25.{number + 1}"
    dataset = FileDataset("", {}, file_meta=meta, preamble=bytes(128))
    dataset.SOPClassUID, dataset.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
    dataset.StudyInstanceUID, dataset.SeriesInstanceUID, dataset.Modality = "2.5", uid, "CT"
    dataset.InstanceNumber = number + 1
    position = np.array(marked.ORIGIN) + (NORMAL * marked.SPACING[2] if step is None else step) * number
    dataset.ImagePositionPatient = [f"{coordinate:.10g}" for coordinate in position]
    dataset.ImageOrientationPatient = [f"{cosine:.10g}" for cosine in AXES.ravel()]
    dataset.PixelSpacing, dataset.SliceThickness = [marked.SPACING[1], marked.SPACING[0]], marked.SPACING[2]
    dataset.Rows, dataset.Columns = pixels.shape[:2]
    bits = pixels.dtype.itemsize * 8
    dataset.SamplesPerPixel, dataset.PhotometricInterpretation = 1, "MONOCHROME2"
    dataset.BitsAllocated, dataset.BitsStored, dataset.HighBit = bits, bits, bits - 1
    dataset.PixelRepresentation = int(pixels.dtype.kind == "i")
    dataset.PixelData = pixels.tobytes()
    for key, value in fields.items():
        setattr(dataset, key, value)
    return dataset


def written_series(
    folder: Path, values: NDArray | None = None, step: NDArray | None = None, uid: str = "2.5.6", **fields: object
) -> Path:
    """Write a series, a file a slice, under names that say nothing about the order."""
    slices = marked.marked() if values is None else values
    for number, pixels in enumerate(slices):
        path = folder / f"{(number * 7 + 3) % 10}-{len(list(folder.iterdir()))}"
        slice_of(number, pixels, step, uid, **fields).save_as(path, enforce_file_format=True)
    return folder


def multi_frame(path: Path, *, enhanced: bool) -> None:
    """Write all slices as frames of one file, each with its position or one after the other."""
    dataset = slice_of(0)
    dataset.NumberOfFrames = 3
    dataset.PixelData = marked.marked().tobytes()
    if enhanced:
        dataset.PixelData = marked.marked()[::-1].tobytes()
        shared, orientation, measures = Dataset(), Dataset(), Dataset()
        orientation.ImageOrientationPatient = dataset.ImageOrientationPatient
        measures.PixelSpacing, measures.SliceThickness = dataset.PixelSpacing, 1
        shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = [orientation], [measures]
        dataset.SharedFunctionalGroupsSequence = [shared]
        frames = []
        for number in (2, 1, 0):
            frame, plane = Dataset(), Dataset()
            plane.ImagePositionPatient = slice_of(number).ImagePositionPatient
            frame.PlanePositionSequence = [plane]
            frames.append(frame)
        dataset.PerFrameFunctionalGroupsSequence = frames
        for key in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness"):
            delattr(dataset, key)
    pydicom.dcmwrite(path, dataset, enforce_file_format=True)
