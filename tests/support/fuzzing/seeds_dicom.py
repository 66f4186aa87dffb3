"""Sound DICOM series for `fuzz.py`: plain and in every compressed coding that is read."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom import uid
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.encaps import encapsulate

from support.fuzzing.seeds import Seed

_SLICES, _ROWS, _COLUMNS = 2, 12, 16  # of the compressed ones, whose codings want blocks


def seeds() -> Iterator[Seed]:
    """Series of slices, frames of one file, colours, and each coding."""
    small = np.arange(60, dtype="i2").reshape(3, 4, 5)
    yield _series("dicom", [slice_of(number, each) for number, each in enumerate(small)])
    big = [slice_of(number, each, syntax=uid.ImplicitVRLittleEndian) for number, each in enumerate(small)]
    yield _series("dicom", big)
    yield Seed("dicom", {"v.dcm": file_of(_frames(small))}, "v.dcm")
    yield Seed("dicom", {"e.dcm": file_of(_enhanced(small))}, "e.dcm")
    colors = np.arange(180, dtype="u1").reshape(3, 4, 5, 3)
    yield _series("dicom", [slice_of(number, each) for number, each in enumerate(colors)])
    steps = [slice_of(n // 2, small[n // 2], TemporalPositionIndex=n % 2, InstanceNumber=n + 1) for n in range(4)]
    yield _series("dicom", steps, "series")
    for kind, syntax, dtype, encode in _codings():
        values = (np.arange(_SLICES * _ROWS * _COLUMNS) % 251).reshape(_SLICES, _ROWS, _COLUMNS).astype(dtype)
        packed = [slice_of(number, each, syntax, encode(each)) for number, each in enumerate(values)]
        yield _series(f"dicom-{kind}", packed)
    rle = [slice_of(number, each) for number, each in enumerate(small)]
    for one in rle:
        one.compress(uid.RLELossless, generate_instance_uid=False)
    yield _series("dicom-rle", rle)


def _codings() -> Iterator[tuple[str, uid.UID, str, Callable[[NDArray], bytes]]]:
    import imagecodecs as codecs

    yield "jpeg", uid.JPEGBaseline8Bit, "u1", lambda each: codecs.jpeg8_encode(each, level=90)
    yield "jpeg-ls", uid.JPEGLSLossless, "u2", codecs.jpegls_encode
    yield "jpeg-ls", uid.JPEGLSLossless, "u1", codecs.jpegls_encode
    yield "lossless", uid.JPEGLosslessSV1, "u2", lambda each: codecs.ljpeg_encode(each, bitspersample=16)
    yield "lossless", uid.JPEGLosslessSV1, "u1", lambda each: codecs.ljpeg_encode(each, bitspersample=8)
    yield "jpeg-2000", uid.JPEG2000Lossless, "u2", lambda each: codecs.jpeg2k_encode(each, codecformat="j2k", level=0)


def slice_of(
    number: int,
    pixels: NDArray,
    syntax: uid.UID = uid.ExplicitVRLittleEndian,
    packed: bytes | None = None,
    **fields: Any,
) -> FileDataset:
    meta = FileMetaDataset()
    meta.TransferSyntaxUID, meta.MediaStorageSOPClassUID = syntax, uid.CTImageStorage
    meta.MediaStorageSOPInstanceUID = f"2.25.{number + 1}"
    dataset = FileDataset("", {}, file_meta=meta, preamble=bytes(128))
    dataset.SOPClassUID, dataset.SOPInstanceUID = uid.CTImageStorage, meta.MediaStorageSOPInstanceUID
    dataset.StudyInstanceUID, dataset.SeriesInstanceUID, dataset.Modality = "2.5", "2.5.6", "CT"
    dataset.InstanceNumber = number + 1
    dataset.ImagePositionPatient, dataset.ImageOrientationPatient = [1, 2, 3 * number], [1, 0, 0, 0, 1, 0]
    dataset.PixelSpacing, dataset.SliceThickness = [2, 1.5], 3
    dataset.RescaleSlope, dataset.RescaleIntercept = 2, -1024
    dataset.Rows, dataset.Columns = pixels.shape[:2]
    bits = pixels.dtype.itemsize * 8
    colored = pixels.ndim == 3
    dataset.SamplesPerPixel, dataset.PhotometricInterpretation = (3, "RGB") if colored else (1, "MONOCHROME2")
    if colored:
        dataset.PlanarConfiguration = 0
    dataset.BitsAllocated, dataset.BitsStored, dataset.HighBit = bits, bits, bits - 1
    dataset.PixelRepresentation = int(pixels.dtype.kind == "i")
    dataset.PixelData = pixels.tobytes() if packed is None else encapsulate([packed])
    dataset["PixelData"].VR = "OW" if packed is None else "OB"
    if packed is not None:
        dataset["PixelData"].is_undefined_length = True
    for key, value in fields.items():
        setattr(dataset, key, value)
    return dataset


def _frames(values: NDArray) -> FileDataset:
    dataset = slice_of(0, values[0], NumberOfFrames=len(values))
    dataset.PixelData = values.tobytes()
    return dataset


def _enhanced(values: NDArray) -> FileDataset:
    """Frames that have their positions in functional groups."""
    dataset = _frames(values)
    shared, orientation, measures = Dataset(), Dataset(), Dataset()
    orientation.ImageOrientationPatient = dataset.ImageOrientationPatient
    measures.PixelSpacing, measures.SliceThickness = dataset.PixelSpacing, 3
    shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = [orientation], [measures]
    dataset.SharedFunctionalGroupsSequence = [shared]
    frames = []
    for number in range(len(values)):
        frame, plane = Dataset(), Dataset()
        plane.ImagePositionPatient = [1, 2, 3 * number]
        frame.PlanePositionSequence = [plane]
        frames.append(frame)
    dataset.PerFrameFunctionalGroupsSequence = frames
    for key in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness"):
        delattr(dataset, key)
    return dataset


def _series(kind: str, slices: list[FileDataset], reader: str = "volume") -> Seed:
    return Seed(kind, {f"{number}.dcm": file_of(one) for number, one in enumerate(slices)}, "", reader)


def file_of(dataset: FileDataset) -> bytes:
    written = io.BytesIO()
    dataset.save_as(written, enforce_file_format=True)
    return written.getvalue()
