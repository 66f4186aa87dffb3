"""DICOM: a series of slices in a folder, or the frames of one file, ordered by their positions in the patient.

World coordinates are the patient's, in mm: x to the left, y to the back, z to the head. The third axis runs from the
first slice's position to the last slice's, which keeps the shear of a tilted gantry.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.colors import colored, component_axis, is_colored, with_color
from texvol.formats.readers.detection import FORMATS, has_preamble
from texvol.formats.readers.dicom_pixels import pixels_of
from texvol.formats.readers.dicom_resampling import on_even_slices
from texvol.formats.readers.dicom_segments import is_segmentation
from texvol.formats.readers.dicom_segments import read as read_segmentation
from texvol.formats.readers.dicom_slices import Slice, slices_of
from texvol.formats.readers.missing import noted, without_chosen, without_where
from texvol.formats.readers.samples import (
    Choice,
    FileFault,
    Samples,
    TimeSteps,
    by,
    check_size,
    grid_from_columns,
    once,
    out_of_range,
    pick,
    rescale_into,
    rescaled_type,
)

# Positions are often rounded to 0.01 mm, which moves a gap of 0.4 mm by up to 5 %; a missing slice doubles it.
_GAP_TOLERANCE = 0.05
_SAME_POSITION = 0.01  # of the usual gap: slices closer than this are at one position
_RESAMPLE = "--resample makes an even grid of them, with a known error"
_SAME_ANGLE = 1e-3  # largest difference of direction cosines within a series, due to their rounding

# Photometric interpretations that are red, green and blue, at least after decoding.
_COLORS = ("RGB", "YBR_FULL", "YBR_FULL_422", "YBR_ICT", "YBR_RCT")


class _Series(NamedTuple):
    uid: str
    number: str
    description: str
    headers: list[tuple[str, Any]]  # path and dataset without pixels

    def __str__(self) -> str:
        return f"{self.number or self.uid} {self.description!r} ({len(self.headers)} files)"


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of one series, with slope and intercept applied."""
    headers = once(choice, "headers", lambda: _chosen(_series_of(path), choice.series).headers)
    if len(headers) == 1 and is_segmentation(headers[0][1]):
        return read_segmentation(*headers[0], choice)
    slices = once(choice, "slices", lambda: [one for file, header in headers for one in slices_of(file, header)])
    _check_alike(slices)
    ordered = _in_order(slices, choice)
    first = ordered[0]
    grid = {} if choice.resample else _grid(ordered)
    sizes, axes, said = [len(ordered), first.rows, first.columns], "ZYX", ""
    if first.samples_per_pixel != 1:
        sizes, axes = [*sizes, first.samples_per_pixel], "ZYXC"
        said = f"photometric interpretation {first.photometric}" if first.photometric in _COLORS else ""
    axes = with_color(axes, sizes, component_axis(axes, sizes, "C"), choice, said)
    # With --time, the step selects among slices at one position; it is not an axis.
    index = pick(axes, sizes, choice._replace(time=None))
    if is_colored(axes):
        if choice.resample:
            raise FileFault("--resample is for numbers, got colours: --channel N reads one component as numbers")
        return Samples(**colored(_stored(ordered), axes, index, said, bits=first.bits), **grid)
    values, notes = _values(ordered, index[3:], choice)
    if not choice.resample:
        return Samples(values, **grid, notes=notes)
    values, further = without_chosen(values, choice) if choice.missing else (values, ())
    samples = on_even_slices(values, ordered, choice)
    return samples._replace(**_world(first), notes=(*notes, *further, *samples.notes))


def header_of(file: str) -> Any | None:
    """Return a DICOM file's header without pixels; None if it is not DICOM or has no image."""
    return _header(file)


def _series_of(path: str) -> list[_Series]:
    """Return the series of a folder or file."""
    if os.path.isfile(path):
        files = [path]
    else:
        files = [os.path.join(path, name) for name in sorted(os.listdir(path)) if not name.startswith(".")]
    found: dict[str, _Series] = {}
    for file in files:
        header = _header(file)
        if header is None:
            continue
        uid = str(header.get("SeriesInstanceUID", ""))
        number, description = (str(header.get(key) or "") for key in ("SeriesNumber", "SeriesDescription"))
        found.setdefault(uid, _Series(uid, number, description, [])).headers.append((file, header))
    if not found:
        raise FileFault("holds no DICOM slice with pixels")
    return sorted(found.values(), key=lambda series: (len(series.number), series.number, series.uid))


def _header(file: str) -> Any | None:
    """Return a DICOM file's header without pixels; None if it is not DICOM or has no image."""
    import pydicom
    from pydicom.uid import UID, DeflatedExplicitVRLittleEndian

    name = os.path.basename(file)
    if not os.path.isfile(file):
        return None
    is_marked = has_preamble(file)
    if not is_marked and not file.lower().endswith(FORMATS["DICOM"]):
        return None
    try:
        meta: Any = pydicom.filereader.read_file_meta_info(file) if is_marked else {}
        is_deflated = meta.get("TransferSyntaxUID") == DeflatedExplicitVRLittleEndian
        header = None if is_deflated else pydicom.dcmread(file, stop_before_pixels=True, force=not is_marked)
    except Exception as error:
        raise FileFault(f"{name} is corrupt: {error}") from error
    if header is None:
        raise FileFault(f"{name} is deflated as a whole, which texvol does not read")
    kind = UID(str(header.get("SOPClassUID") or meta.get("MediaStorageSOPClassUID") or "")).name
    if "Rows" in header:
        return header
    if not kind:
        raise FileFault(f"{name} is corrupt: it does not name its kind of DICOM object")
    if kind.endswith("Image Storage"):
        raise FileFault(f"{name} is corrupt: it is a {kind.removesuffix(' Storage')} without Rows, as if truncated")
    return None  # a directory, a report, a plan: no image


def _chosen(found: Sequence[_Series], wanted: str | None) -> _Series:
    """Return the series of that UID, number or description, or the only series."""
    listed = "; ".join(str(series) for series in found)
    if wanted is None:
        if len(found) > 1:
            raise FileFault(f"holds {len(found)} series; choose one with --series: {listed}")
        return found[0]
    for field in ("uid", "number", "description"):
        matching = [series for series in found if getattr(series, field).strip().lower() == wanted.strip().lower()]
        if len(matching) == 1:
            return matching[0]
        if matching:
            uids = ", ".join(series.uid for series in matching)
            raise FileFault(f"--series {wanted} matches {len(matching)} series; choose by UID: {uids}")
    raise FileFault(f"has no series {wanted}; it has {listed}")


def _check_alike(slices: Sequence[Slice]) -> None:
    """Raise FileFault unless all slices have the same size, spacing, direction and type."""
    first = slices[0]
    for one in slices:
        pair = f"{first.name} and {one.name}"
        if (one.rows, one.columns) != (first.rows, first.columns):
            sizes = f"{by([first.columns, first.rows])} and {by([one.columns, one.rows])}"
            raise FileFault(f"its slices are of mixed sizes: {pair} have {sizes}")
        if (one.dtype, one.samples_per_pixel) != (first.dtype, first.samples_per_pixel):
            raise FileFault(f"its slices are of mixed types: {pair} have {first.dtype} and {one.dtype}")
        if one.axes != first.axes and not np.allclose(one.axes, first.axes, rtol=0, atol=_SAME_ANGLE):
            raise FileFault(f"its slices are of mixed directions: {pair} differ")
        if one.spacing != first.spacing and not np.allclose(one.spacing, first.spacing, rtol=1e-3, atol=0):
            raise FileFault(f"its slices are of mixed pixel spacing: {pair} have {first.spacing} and {one.spacing}")


def _in_order(slices: Sequence[Slice], choice: Choice) -> list[Slice]:
    """Return one slice for each position along their normal; raise FileFault unless the positions are even."""
    normal = np.cross(*slices[0].axes)
    along = {one: float(np.dot(one.position, normal)) for one in slices}
    ordered = sorted(slices, key=lambda one: (along[one], one.order))
    gaps = np.diff([along[one] for one in ordered])
    real_gaps = gaps[gaps > _SAME_POSITION * gaps.max(initial=0.0)]
    usual = float(np.median(real_gaps)) if real_gaps.size else 0.0
    positions: list[list[Slice]] = [[ordered[0]]]
    for one, gap in zip(ordered[1:], gaps, strict=True):
        if gap > _SAME_POSITION * usual and gap > 0:
            positions.append([one])
        else:
            positions[-1].append(one)
    one_each = _one_at_each(positions, choice)
    if choice.resample:
        return one_each
    for before, after in pairwise(one_each):
        gap = along[after] - along[before]
        if abs(gap - usual) > _GAP_TOLERANCE * usual:
            raise FileFault(
                f"its slices are unevenly apart, as if some were missing: {gap:g} mm between {before.name} and "
                f"{after.name}, where {usual:g} mm is usual; {_RESAMPLE}"
            )
    _check_on_a_line(one_each)
    return one_each


def _one_at_each(positions: Sequence[list[Slice]], choice: Choice) -> list[Slice]:
    """Return the slice of each position, or that of the chosen time step if each position has several."""
    counts = {len(position) for position in positions}
    if len(counts) > 1:
        twice = next(position for position in positions if len(position) > 1)
        raise FileFault(f"has duplicate slices: {twice[0].name} and {twice[1].name} lie at the same place")
    steps = counts.pop()
    if choice.counting:
        raise TimeSteps(steps)
    if steps > 1 and choice.time is None:
        raise FileFault(
            f"has duplicate slices: {steps} at each of {len(positions)} places; if these are time steps or echoes, "
            f"choose one with --time 0..{steps - 1}"
        )
    step = choice.time or 0
    if not 0 <= step < steps:
        raise out_of_range("T", step, steps)
    return [sorted(position, key=lambda one: one.order)[step] for position in positions]


def _check_on_a_line(ordered: Sequence[Slice]) -> None:
    """Raise FileFault if a slice is half a pixel or more beside the line from the first to the last."""
    first, last = np.array(ordered[0].position), np.array(ordered[-1].position)
    steps = max(len(ordered) - 1, 1)
    for number, one in enumerate(ordered):
        expected = first + (last - first) * number / steps
        beside = np.linalg.norm(np.array(one.axes) @ (np.array(one.position) - expected))
        if beside > 0.5 * min(one.spacing):
            raise FileFault(f"its slices are not on a line: {one.name} is {beside:g} mm beside it; {_RESAMPLE}")


def _grid(ordered: Sequence[Slice]) -> dict[str, Any]:
    first = ordered[0]
    if len(ordered) > 1:
        step = (np.array(ordered[-1].position) - first.position) / (len(ordered) - 1)
    else:
        step = np.cross(*first.axes) * first.thickness
    lengths, direction = grid_from_columns(np.column_stack([*first.axes, step]))
    return {
        "spacing": (*first.spacing, lengths[2]),
        "origin": first.position,
        "direction": direction,
        **_world(first),
    }


def _world(first: Slice) -> dict[str, Any]:
    return {"unit": "mm", "space": "left-posterior-superior", "value_unit": first.value_unit}


def _values(
    ordered: Sequence[Slice], component: Sequence[int | slice], choice: Choice
) -> tuple[NDArray, tuple[str, ...]]:
    """Return rescaled samples of all slices without padding, and notes; files are read one at a time."""
    first = ordered[0]
    target = rescaled_type(first.dtype, first.slope, first.intercept, first.bits)
    if any((one.slope, one.intercept, one.bits) != (first.slope, first.intercept, first.bits) for one in ordered):
        target = rescaled_type(first.dtype, 0.5, 0.0, max(one.bits for one in ordered))  # mixed scales: a float
    check_size([len(ordered), first.rows, first.columns], target.itemsize)
    values = np.empty((len(ordered), first.rows, first.columns), target)
    padded: dict[int, NDArray[np.uint8]] = {}  # a bit for each pixel
    for number, pixels in pixels_of(ordered):
        one, picked = ordered[number], pixels[(..., *component)]
        rescale_into(values[number], picked, one.slope, one.intercept)
        if one.padding is not None and not choice.labels and one.samples_per_pixel == 1:
            padded[number] = np.packbits((picked >= one.padding[0]) & (picked <= one.padding[1]))
    if not any(bits.any() for bits in padded.values()):
        return values, ()
    without = np.zeros_like(next(iter(padded.values())))

    def is_padded(number: int, part: NDArray) -> NDArray:
        bits = np.unpackbits(padded.get(number, without), count=part.size)
        return bits.astype(np.bool_).reshape(part.shape)

    marked, count = without_where(values, is_padded)
    return marked, noted(count, "Pixel Padding Value")


def _stored(ordered: Sequence[Slice]) -> NDArray:
    """Return stored samples of all slices, not rescaled, for colours."""
    first = ordered[0]
    sizes = (len(ordered), first.rows, first.columns, first.samples_per_pixel)
    check_size(sizes, first.dtype.itemsize)
    values = np.empty(sizes, first.dtype)
    for number, pixels in pixels_of(ordered):
        values[number] = pixels
    return values
