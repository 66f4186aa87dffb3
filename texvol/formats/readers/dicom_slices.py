"""Slices of a DICOM file: header fields of each frame."""

from __future__ import annotations

import os
from collections.abc import Sequence
from copy import copy
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault, check_size, check_unpacked

# Sequences in which enhanced multi-frame files keep fields that other files have at the top (DICOM PS3.3, C.7.6.16).
_GROUPS = {
    "ImagePositionPatient": "PlanePositionSequence",
    "ImageOrientationPatient": "PlaneOrientationSequence",
    "PixelSpacing": "PixelMeasuresSequence",
    "SliceThickness": "PixelMeasuresSequence",
    "SpacingBetweenSlices": "PixelMeasuresSequence",
    "RescaleSlope": "PixelValueTransformationSequence",
    "RescaleIntercept": "PixelValueTransformationSequence",
    "RescaleType": "PixelValueTransformationSequence",
    "TemporalPositionIndex": "FrameContentSequence",
    "NominalCardiacTriggerDelayTime": "CardiacSynchronizationSequence",
    "EffectiveEchoTime": "MREchoSequence",
    "DiffusionBValue": "MRDiffusionSequence",
    "DimensionIndexValues": "FrameContentSequence",
}

_MOST_FRAMES = 2**16  # of a file
_PARAMETRIC_MAP = "1.2.840.10008.5.1.4.1.1.30"

# Fields that order slices at one position, most significant first.
_ORDER = (
    *("TemporalPositionIndex", "TemporalPositionIdentifier", "NominalCardiacTriggerDelayTime", "EchoTime"),
    *("EffectiveEchoTime", "DiffusionBValue", "AcquisitionNumber", "InstanceNumber"),
)


class Slice:
    """One slice of a file of `frames`: its pixels' location, its position, and the meaning of its numbers."""

    def __init__(self, path: str, header: Any, frame: int, frames: int) -> None:
        if "ModalityLUTSequence" in header:
            raise FileFault("has a modality lookup table for its values, which texvol does not read")
        self.photometric = str(header.get("PhotometricInterpretation", ""))
        if "PALETTE" in self.photometric:
            raise FileFault("has palette colours, and a volume must have numbers")
        self.path, self.frame, self.frames = path, frame, frames
        self.rows, self.columns = int(header.Rows), int(header.get("Columns") or 0)
        self.samples_per_pixel = int(header.get("SamplesPerPixel") or 1)
        self.dtype, self.bits, self.high_bit = _stored_type(header)
        check_size([frames, self.rows, self.columns, self.samples_per_pixel], self.dtype.itemsize)
        self.axes = _axes(header, frame)  # directions of rising column and rising row
        scaling = header.get("DoseGridScaling")
        self.slope = _number(header, frame, "RescaleSlope", 1.0 if scaling is None else float(scaling))
        if self.slope == 0:
            raise FileFault("its RescaleSlope must not be 0")
        self.spacing = _pixel_spacing(header, frame)[::-1]  # of columns and rows
        syntax = getattr(getattr(header, "file_meta", None), "TransferSyntaxUID", None)
        is_packed = syntax is not None and syntax.is_transfer_syntax and syntax.is_encapsulated
        self.syntax = str(syntax) if is_packed else ""
        # Of the first pixel's centre; frames without one have that of the file's first frame.
        self.position = _numbers(header, frame, "ImagePositionPatient", 3)
        spacing = abs(_number(header, frame, "SpacingBetweenSlices", 0.0))
        thickness = spacing or _number(header, frame, "SliceThickness", 0.0)
        self.thickness = thickness if thickness > 0 else 1.0
        self.intercept = _number(header, frame, "RescaleIntercept", 0.0)
        self.value_unit = _value_unit(header, frame)
        order = [_number(header, frame, key, 0.0) for key in _ORDER]
        self.order = (*order, *_indices(header, frame))  # among slices at one position
        self.padding = _padding(header, self.dtype)

    @property
    def name(self) -> str:
        """Name of the slice in messages."""
        return f"{os.path.basename(self.path)} frame {self.frame}" if self.frame else os.path.basename(self.path)

    @property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of a frame's stored pixels: rows, columns, and samples if several."""
        return (self.rows, self.columns) + ((self.samples_per_pixel,) if self.samples_per_pixel > 1 else ())

    @property
    def frame_bytes(self) -> int:
        """Bytes of a frame's pixels."""
        return prod(self.frame_shape) * self.dtype.itemsize

    def replaced(self, **attributes: Any) -> Slice:
        """Return a copy with other attributes."""
        other = copy(self)
        vars(other).update(attributes)
        return other

    def stored(self, pixels: NDArray) -> NDArray:
        """Return decoded pixels in the frame's shape, with unused bits cleared."""
        pixels = pixels.reshape(self.frame_shape)
        allocated = pixels.dtype.itemsize * 8
        if pixels.dtype.kind in "iu" and self.bits < allocated:
            # Shifting up drops overlays kept in unused bits, and shifting down extends the sign.
            pixels = (pixels << (allocated - 1 - self.high_bit)) >> (allocated - self.bits)
        return pixels


def slices_of(path: str, header: Any) -> list[Slice]:
    """Return all slices of a file; raise FileFault, which names the file, if header fields are missing or wrong."""
    try:
        count = int(header.get("NumberOfFrames") or 1)
        if not 1 <= count <= os.path.getsize(path):
            raise FileFault(f"its NumberOfFrames is {count}, in a file of {os.path.getsize(path)} bytes")
        if count > _MOST_FRAMES:
            raise FileFault(f"its NumberOfFrames must be at most {_MOST_FRAMES}, got {count}")
        first = Slice(path, header, 0, count)
        _check_held(path, first)
        if count == 1:
            return [first]
        if header.get("PerFrameFunctionalGroupsSequence"):
            return [first, *(Slice(path, header, frame, count) for frame in range(1, count))]
        positions = np.array(first.position) + np.outer(_along(header, count), np.cross(*first.axes))
        # Frames without functional groups differ only by position.
        return [first.replaced(frame=frame, position=position) for frame, position in enumerate(positions.tolist())]
    except FileFault as fault:
        raise FileFault(f"{os.path.basename(path)}: {fault}") from None


def _check_held(path: str, first: Slice) -> None:
    """Raise FileFault if the file is too small for its frames."""
    needed, held = first.frames * first.frame_bytes, os.path.getsize(path)
    if first.syntax:
        check_unpacked(needed, held)
    # Chrominance at half the columns takes two thirds of the bytes.
    elif needed * 2 // 3 > held:
        raise FileFault(f"its pixels can't be read: its header needs {needed} bytes of them, and the file has {held}")


def _axes(header: Any, frame: int) -> tuple[list[float], list[float]]:
    orientation = _numbers(header, frame, "ImageOrientationPatient", 6)
    axes = _unit_vector(orientation[:3]), _unit_vector(orientation[3:])
    if abs(float(np.dot(*axes))) > 0.01:
        raise FileFault("direction must not be singular: its rows and columns are not at right angles")
    return axes


def _value_unit(header: Any, frame: int) -> str:
    """Return the unit of the rescaled values; CT that names no type is in Hounsfield units (DICOM PS3.3, C.8.2.1.1.2).

    This requires that values may be negative, as air is: stored values have a sign, or the intercept is negative. "US"
    is the standard's word for an unspecified unit.
    """
    kind = str(_found(header, frame, "RescaleType") or header.get("Units") or "").strip()
    if kind or header.get("Modality") != "CT":
        return "" if kind == "US" else kind
    may_be_negative = bool(header.get("PixelRepresentation")) or _number(header, frame, "RescaleIntercept", 0.0) < 0
    return "HU" if may_be_negative and _found(header, frame, "RescaleIntercept") is not None else ""


def _padding(header: Any, dtype: np.dtype) -> tuple[float, float] | None:
    """Return smallest and largest stored value of padding, or None (DICOM PS3.3, C.7.5.1.1.2)."""
    if dtype.kind == "f":
        prefix = "Double" if dtype.itemsize == 8 else ""
        value, limit = (header.get(f"{prefix}FloatPixelPadding{word}") for word in ("Value", "RangeLimit"))
        if value is None:
            return None
        low, high = sorted((float(value), float(value if limit is None else limit)))
        return low, high
    value, limit = (header.get(key) for key in ("PixelPaddingValue", "PixelPaddingRangeLimit"))
    if value is None or value == "":
        return None
    # In the pixels' type, since some files write negative numbers as unsigned, or the reverse.
    ends = [int(end) % 2 ** (8 * dtype.itemsize) for end in (value, value if limit in (None, "") else limit)]
    stored = np.array(ends, f"u{dtype.itemsize}").view(dtype)
    return int(stored.min()), int(stored.max())


def _stored_type(header: Any) -> tuple[np.dtype, int, int]:
    """Return the type of the stored pixels, the number of used bits, and the highest used bit."""
    allocated = int(header.get("BitsAllocated") or 0)
    # Parametric maps have whole numbers or floats; only floats come without these fields (DICOM PS3.3, C.7.6.24).
    if header.get("SOPClassUID") == _PARAMETRIC_MAP and "BitsStored" not in header and allocated in (32, 64):
        return np.dtype(f"f{allocated // 8}"), allocated, allocated - 1
    if allocated not in (8, 16, 32):
        raise FileFault(f"BitsAllocated must be 8, 16 or 32, got {allocated}")
    bits = int(header.get("BitsStored") or allocated)
    high_bit = int(header.get("HighBit", bits - 1))
    if not 1 <= bits <= high_bit + 1 <= allocated:
        raise FileFault(f"has {bits} bits stored up to bit {high_bit} of {allocated}, which is impossible")
    kind = "i" if int(header.get("PixelRepresentation") or 0) else "u"
    return np.dtype(f"{kind}{allocated // 8}"), bits, high_bit


def _found(header: Any, frame: int, key: str) -> Any:
    """Return a field of a frame: from its own group, the shared group, or the top of the file."""
    per_frame = header.get("PerFrameFunctionalGroupsSequence") or []
    shared = header.get("SharedFunctionalGroupsSequence") or []
    for group in (*per_frame[frame : frame + 1], *shared[:1]):
        sequence = group.get(_GROUPS.get(key, "")) if key in _GROUPS else None
        if sequence and sequence[0].get(key) is not None:
            return sequence[0].get(key)
    value = header.get(key)
    detector = header.get("DetectorInformationSequence")  # of nuclear medicine
    return detector[0].get(key) if value is None and detector else value


def _number(header: Any, frame: int, key: str, default: float) -> float:
    value = _found(header, frame, key)
    number = default if value in (None, "") else float(value)
    if not np.isfinite(number):
        raise FileFault(f"its {key} must be finite, got {number}")
    return number


def _indices(header: Any, frame: int) -> list[float]:
    """Return the numbers of a frame along the dimensions that an enhanced file names, which order all its frames."""
    value = _found(header, frame, "DimensionIndexValues")
    several = () if value is None else [value] if isinstance(value, int) else value
    return [float(number) for number in several]


def _numbers(header: Any, frame: int, key: str, count: int) -> list[float]:
    value = _found(header, frame, key)
    if value is None:
        raise FileFault(f"has no {key}, without which its position is unknown")
    numbers = [float(number) for number in value]
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise FileFault(f"its {key} must be {count} finite numbers, got {numbers}")
    return numbers


def _unit_vector(numbers: Sequence[float]) -> list[float]:
    length = float(np.linalg.norm(numbers))
    if not 0.9 < length < 1.1:
        vector = ", ".join(f"{number:g}" for number in numbers)
        raise FileFault(f"direction must not be singular: {vector} of ImageOrientationPatient has length {length:g}")
    return [number / length for number in numbers]


def _pixel_spacing(header: Any, frame: int) -> tuple[float, float]:
    """Return the distances of rows and of columns, in mm."""
    for key in ("PixelSpacing", "ImagerPixelSpacing"):
        if _found(header, frame, key) is not None:
            rows, columns = _numbers(header, frame, key, 2)
            if not (rows > 0 and columns > 0):
                raise FileFault(f"spacing must be positive, got {key} {rows:g}, {columns:g}")
            return rows, columns
    raise FileFault("has no PixelSpacing")


def _along(header: Any, count: int) -> NDArray[np.float64]:
    """Return offsets of frames along the normal from the file's position, for frames without positions."""
    offsets = header.get("GridFrameOffsetVector")
    if offsets is not None:
        along = np.atleast_1d(np.array(offsets, dtype=np.float64))[:count]
        if len(along) < count:
            raise FileFault(f"has {count} frames, but a GridFrameOffsetVector of {len(along)}")
        return along - along[0]
    spacing = _number(header, 0, "SpacingBetweenSlices", 0.0) or _number(header, 0, "SliceThickness", 0.0)
    if not spacing:
        raise FileFault("its frames have no positions")
    return np.arange(count, dtype=np.float64) * spacing
