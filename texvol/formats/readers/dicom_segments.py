"""DICOM SEG: segments as frames of bits, of fractions, or of numbers, at the positions where a segment has samples.

Frames lie at whole multiples of one distance along their normal; positions without a frame have no segment. Bits are
packed without a gap between frames, the first one lowest (DICOM PS3.5, 8.1.1).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.dicom_pixels import pixels_of
from texvol.formats.readers.dicom_slices import Slice, slices_of
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, pick
from texvol.formats.readers.segments import Segment, check_count, label_table, listed, merged, of_dicom

_STORAGE = ("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7")  # Segmentation, Label Map Segmentation
_EVEN = 0.05  # of the distance of frames
_MOST_PLACES = 1 << 16


class _Placed(NamedTuple):
    """Place of each frame along the normal, the distance of places, and the position of the first one."""

    places: NDArray[np.intp]
    step: float
    origin: NDArray[np.float64]


def is_segmentation(header: Any) -> bool:
    """True if a DICOM header is that of a segmentation."""
    return str(header.get("SOPClassUID", "")) in _STORAGE


def read(path: str, header: Any, choice: Choice) -> Samples:
    """Return the segments of a file as numbers, or the fractions of one of them by --channel."""
    kind = str(header.get("SegmentationType") or "BINARY").upper()
    if kind not in ("BINARY", "FRACTIONAL", "LABELMAP"):
        raise FileFault(f"SegmentationType must be BINARY, FRACTIONAL or LABELMAP, got {kind[:40]!r}")
    segments = of_dicom(header)
    check_count(len(segments))
    if not segments:
        raise FileFault("has no segment")
    frames = _frames(path, header, kind)
    placed = _placed(frames)
    sizes = (int(placed.places.max()) + 1, frames[0].rows, frames[0].columns)
    chosen = _chosen(choice, kind, len(segments))
    pick("CZYX", [len(segments), *sizes], chosen)
    grid = _grid(frames[0], placed)
    notes, table = (listed(segments),), label_table(path, segments)
    is_single = choice.channel is not None or kind == "FRACTIONAL"
    wanted = [segments[chosen.channel]] if is_single else list(segments)
    if kind == "LABELMAP":
        return Samples(_numbers(frames, placed, sizes), **grid, labels=True, label_table=table, notes=notes)
    planes = _planes(path, header, frames, kind)
    referred = [_referred(header, number) for number in range(len(frames))]
    if kind == "FRACTIONAL":
        most = float(header.get("MaximumFractionalValue") or 255)
        return Samples(_fractions(planes, placed, referred, wanted[0], sizes, most), **grid, notes=notes)
    values, shared = _segments(planes, placed, referred, wanted, sizes)
    return Samples(values, **grid, labels=True, label_table=table, notes=(*notes, *shared))


def _chosen(choice: Choice, kind: str, count: int) -> Choice:
    """Return the choice among segments; numbers need none, and neither do fractions of a single segment."""
    if choice.channel is None and (kind != "FRACTIONAL" or count == 1):
        return choice._replace(channel=0)
    return choice


def _frames(path: str, header: Any, kind: str) -> list[Slice]:
    """Return the frames of a file; those of bits as if they were of bytes."""
    if kind != "BINARY":
        return slices_of(path, header)
    if int(header.get("BitsAllocated") or 0) != 1:
        raise FileFault(f"BitsAllocated of a BINARY segmentation must be 1, got {header.get('BitsAllocated')}")
    count = int(header.get("NumberOfFrames") or 1)
    rows, columns = int(header.get("Rows") or 0), int(header.get("Columns") or 0)
    needed, held = count * rows * columns // 8, os.path.getsize(path)
    if not 0 < needed <= held:
        raise FileFault(
            f"its {count} frames of {by([columns, rows])} bits need {needed} bytes, and the file has {held}"
        )
    check_size([count, rows, columns], 1)
    header.BitsAllocated, header.BitsStored, header.HighBit = 8, 8, 7
    return [Slice(path, header, frame, count) for frame in range(count)]


def _placed(frames: Sequence[Slice]) -> _Placed:
    """Return the places of frames; raise FileFault unless they are even."""
    axes = np.array(frames[0].axes)
    normal = np.cross(*axes)
    positions = np.array([frame.position for frame in frames])
    depths = positions @ normal
    first = positions[int(np.argmin(depths))]
    if any(not np.allclose(frame.axes, axes, rtol=0, atol=1e-3) for frame in frames):
        raise FileFault("its frames are of mixed directions")
    gaps = np.diff(np.unique(np.round(depths - depths.min(), 4)))
    step = float(gaps.min()) if gaps.size else frames[0].thickness
    places = (depths - depths.min()) / step
    off = np.abs(places - np.round(places)).max()
    beside = np.linalg.norm((positions - first) @ axes.T, axis=1).max()
    if off > _EVEN or beside > 0.5 * min(frames[0].spacing) or places.max() >= _MOST_PLACES:
        raise FileFault("its frames must be at whole multiples of one distance behind each other")
    # Rounded positions add up to less than one with the distance of the outermost frames.
    last = int(np.round(places.max()))
    step = float(np.ptp(depths)) / last if last else step
    return _Placed(np.round(places).astype(np.intp), step, first)


def _grid(first: Slice, placed: _Placed) -> dict[str, Any]:
    direction = np.column_stack([*first.axes, np.cross(*first.axes)])
    spacing = (*first.spacing, placed.step)
    return {
        "spacing": spacing,
        "origin": placed.origin.tolist(),
        "direction": direction,
        "unit": "mm",
        "space": "left-posterior-superior",
    }


def _planes(path: str, header: Any, frames: Sequence[Slice], kind: str) -> NDArray:
    """Return the pixels of all frames, shape (frames, rows, columns)."""
    shape = (len(frames), frames[0].rows, frames[0].columns)
    check_size(shape, 1)
    if kind == "FRACTIONAL":
        return _stacked(frames, shape)
    import pydicom

    if frames[0].syntax:
        raise FileFault("its bits are compressed, which texvol does not read")
    packed = np.frombuffer(pydicom.dcmread(path, force=True).PixelData, np.uint8)
    count = int(np.prod(shape))
    if packed.size * 8 < count:
        raise FileFault(f"its pixels hold {packed.size} bytes, but its frames need {-(-count // 8)}")
    return np.unpackbits(packed, count=count, bitorder="little").reshape(shape)


def _stacked(frames: Sequence[Slice], shape: tuple[int, ...]) -> NDArray:
    planes = np.empty(shape, frames[0].dtype)
    for number, pixels in pixels_of(frames):
        planes[number] = pixels
    return planes


def _referred(header: Any, frame: int) -> int:
    """Return the number of the segment of a frame."""
    groups = header.get("PerFrameFunctionalGroupsSequence") or ()
    shared = header.get("SharedFunctionalGroupsSequence") or ()
    for group in (*groups[frame : frame + 1], *shared[:1]):
        if found := group.get("SegmentIdentificationSequence"):
            return int(found[0].get("ReferencedSegmentNumber") or 0)
    raise FileFault(f"frame {frame} names no segment")


def _numbers(frames: Sequence[Slice], placed: _Placed, sizes: tuple[int, ...]) -> NDArray:
    check_size(sizes, frames[0].dtype.itemsize)
    values = np.zeros(sizes, frames[0].dtype)
    for number, pixels in pixels_of(frames):
        values[placed.places[number]] = pixels
    return values


def _fractions(
    planes: NDArray, placed: _Placed, referred: Sequence[int], wanted: Segment, sizes: tuple[int, ...], most: float
) -> NDArray:
    check_size(sizes, 4)
    values = np.zeros(sizes, np.float32)
    for plane, place, number in zip(planes, placed.places, referred, strict=True):
        if number == wanted.label:
            values[place] = plane / most
    return values


def _segments(
    planes: NDArray, placed: _Placed, referred: Sequence[int], wanted: Sequence[Segment], sizes: tuple[int, ...]
) -> tuple[NDArray, tuple[str, ...]]:
    """Return one number for each sample, and a note on samples in several segments."""
    check_size(sizes, 4)
    values, shared = np.zeros(sizes, np.uint16), 0
    for segment in wanted:
        here = np.zeros((1, *sizes), np.uint8)
        for plane, place, number in zip(planes, placed.places, referred, strict=True):
            if number == segment.label:
                here[0, place] |= plane
        one, _ = merged(here, [segment._replace(layer=0, stored=1)])
        shared += int(np.count_nonzero((one != 0) & (values != 0)))
        values[one != 0] = one[one != 0]
    notes = (
        (f"{shared} samples are in several segments, and have the last one; --channel N reads one",) if shared else ()
    )
    return values, notes
