"""TIFF: a stack of pages or a folder of slices, read by tifffile, with spacing, unit and channels of ImageJ and OME.

A plain TIFF has no distance between pages, and its resolution is meant for printers, so its spacing is 1.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.channels import described, note, with_first
from texvol.formats.readers.colors import colored, component_axis, is_colored, with_color
from texvol.formats.readers.missing import parsed, without_marked
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, check_unpacked, pick, real_type
from texvol.formats.readers.tiff_channels import channels_of
from texvol.formats.readers.tiff_pages import check_pages, check_planes
from texvol.formats.units import common_length, length_unit

# Values of the tags PhotometricInterpretation, Compression and ExtraSamples (TIFF 6.0).
_GDAL_NODATA = 42113
_RGB, _YCBCR, _JPEG, _ASSOCIATED = 2, 6, 7, 1

# tifffile's letters for axes, in those of `pick`: I, Q and R are sequences of pages without a name.
_LETTERS = {"S": "C", "I": "Z", "Q": "?", "R": "?", "M": "?", "A": "?", "P": "?"}


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a multi-page file, or of a folder's slices ordered by the numbers in their names."""
    return _folder(path, choice) if os.path.isdir(path) else _file(path, choice)


def _file(path: str, choice: Choice) -> Samples:
    import tifffile

    check_pages(path)
    with tifffile.TiffFile(path, _multifile=False) as tif:
        names = set(re.findall(r'FileName="([^"]*)"', tif.ome_metadata or ""))
        if len(names) > 1:
            raise FileFault(f"is one of {len(names)} files of an OME set, which texvol does not read")
        check_planes(tif.ome_metadata or "", len(tif.pages))
        if not tif.series:
            raise FileFault("has no image")
        series = tif.series[0]
        for program, is_so, kind in (("OME", tif.is_ome, "ome"), ("ImageJ", tif.is_imagej, "imagej")):
            # tifffile would fall back to the pages alone, with channels and slices in one sequence.
            if is_so and series.kind != kind:
                raise FileFault(f"its {program} description does not match its pages")
        sizes, axes = [int(size) for size in series.shape], _axes(series.axes)
        dtype = real_type(np.dtype(series.dtype))
        said = _color_name(series.keyframe)
        at = component_axis(series.axes, sizes, "S") if "S" in series.axes else component_axis(axes, sizes)
        axes = with_color(axes, sizes, at, choice, said)
        choice = choice if said else with_first(axes, sizes, choice)  # red, green and blue are no channels
        index = pick(axes, sizes, choice)
        chosen = prod(size for size, part in zip(sizes, index, strict=True) if isinstance(part, slice))
        check_size([chosen], dtype.itemsize)
        _check_pages(series, path)
        values = _values(series, sizes, index)
        more = _calibration(tif, dict(zip(axes, sizes, strict=True)).get("T", 1))
        if is_colored(axes):
            return Samples(**more, **colored(values, axes, index, said, associated=_is_associated(series.keyframe)))
        marked, notes = without_marked(values, _marks(series.keyframe), "tag GDAL_NODATA", choice)
        told = channels_of(tif, dict(zip(axes, sizes, strict=True)).get("C", 1))
        channels = told if said else described(axes, sizes, told)
        channel = channels[choice.channel] if channels and choice.channel is not None else None
        notes = (*note(channels, choice.channel), *notes)
        return Samples(marked, **more, notes=notes, channels=channels, channel=channel)


def _marks(page: Any) -> tuple[int | float, ...]:
    """Return the values that mark missing samples, by GDAL's tag."""
    tag = page.tags.get(_GDAL_NODATA)
    return () if tag is None else parsed([str(tag.value).strip("\0")])


def _axes(axes: str) -> str:
    """Return letters for `pick`; unnamed pages, or time steps of flat images, become a stack."""
    letters = "".join(_LETTERS.get(letter, letter if letter in "XYZCT" else "?") for letter in axes)
    if "Z" not in letters:
        for page_axis in ("?", "T"):
            if letters.count(page_axis) == 1:
                return letters.replace(page_axis, "Z")
    return letters


def _color_name(page: Any) -> str:
    """Return the name of the field that marks a page's samples as colour, or ""."""
    # JPEG's luminance and chrominance are decoded to colours.
    is_color = int(page.photometric) == _RGB or (int(page.photometric), int(page.compression)) == (_YCBCR, _JPEG)
    return "photometric interpretation RGB" if is_color else ""


def _is_associated(page: Any) -> bool:
    """True if the page's colours have opacity multiplied in."""
    return _ASSOCIATED in [int(kind) for kind in page.extrasamples]


def _check_pages(series: Any, path: str) -> None:
    """Raise FileFault if a page's data are beyond the end of the file, where tifffile would read zeros."""
    held = os.path.getsize(path)
    if int(series.keyframe.compression) != 1:
        check_unpacked(int(series.nbytes), held)
    for number, page in enumerate(series.pages):
        if page is None:
            raise FileFault(f"page {number} is missing")
        offsets, counts = page.dataoffsets, page.databytecounts
        if not offsets or len(offsets) != len(counts):
            raise FileFault(f"page {number} has no position of its data")
        end = max(offset + count for offset, count in zip(offsets, counts, strict=True))
        if end > held:
            raise FileFault(f"is truncated: page {number} ends at byte {end} of {held}")
        if int(page.compression) == 1 and sum(counts) < page.nbytes:
            raise FileFault(f"page {number} holds {sum(counts)} bytes, but its dimensions need {page.nbytes}")
    if len(series.pages) == 1 and series.dataoffset is not None and series.dataoffset + series.nbytes > held:
        raise FileFault(f"is truncated: its samples end at byte {series.dataoffset + series.nbytes} of {held}")


def _values(series: Any, sizes: Sequence[int], index: tuple[int | slice, ...]) -> NDArray:
    """Return the chosen samples; of several channels or time steps only the chosen pages are read."""
    leading = sizes[: len(sizes) - len(series.keyframe.shape)]
    is_all = all(isinstance(part, slice) or size == 1 for part, size in zip(index, sizes, strict=True))
    by_pages = len(series.pages) == prod(leading) and list(series.keyframe.shape) == list(sizes[len(leading) :])
    if by_pages and not is_all:
        numbers = np.arange(len(series.pages)).reshape(leading)[index[: len(leading)]].ravel()
        pages = np.asarray(series.asarray(key=[int(number) for number in numbers], maxworkers=1))
        kept = [size for size, part in zip(leading, index, strict=False) if isinstance(part, slice)]
        return pages.reshape([*kept, *sizes[len(leading) :]])[(*[slice(None)] * len(kept), *index[len(leading) :])]
    check_size(sizes, np.dtype(series.dtype).itemsize)
    return np.asarray(series.asarray(maxworkers=1)).reshape(sizes)[index]


def _calibration(tif: Any, steps: int) -> dict[str, Any]:
    """Return spacing and unit of ImageJ or OME, and the times of the steps if their distance is known."""
    found: dict[str, Any] = {}
    between, time_unit = 0.0, "s"
    if tif.ome_metadata:
        attributes = _ome_attributes(tif.ome_metadata)
        found = _ome_spacing(attributes)
        between, time_unit = float(attributes.get("TimeIncrement", 0)), attributes.get("TimeIncrementUnit", "s")
    elif tif.imagej_metadata:
        said, tags = tif.imagej_metadata, tif.pages[0].tags
        unit = str(said.get("unit") or "").strip()
        spacing = [_resolution(tags, "XResolution"), _resolution(tags, "YResolution"), float(said.get("spacing") or 1)]
        found = {"spacing": spacing, "unit": length_unit(unit)}
        between = float(said.get("finterval") or 0)
        time_unit = str(said.get("tunit") or "s").replace("sec", "s")
    if steps < 2 or not 0 < between < np.inf:
        return found
    return found | {"times": (between * np.arange(steps)).tolist(), "time_unit": time_unit}


def _resolution(tags: Any, name: str) -> float:
    """Return the distance of pixels, which ImageJ writes as pixels per unit."""
    if name not in tags:
        return 1.0
    pixels, units = tags[name].value
    return units / pixels if pixels and units else 1.0


def _ome_attributes(xml: str) -> dict[str, str]:
    """Return OME's attributes of the pixels."""
    pixels = re.search(r"<(?:\w+:)?Pixels\b([^>]*)>", xml)
    return dict(re.findall(r'(\w+)\s*=\s*"([^"]*)"', pixels.group(1))) if pixels else {}


def _ome_spacing(attributes: dict[str, str]) -> dict[str, Any]:
    """Return spacing and unit by OME's attributes of the pixels."""
    sizes = [attributes.get(f"PhysicalSize{axis}") for axis in "XYZ"]
    if not any(sizes):
        return {}
    # OME's default unit is the micrometre, per axis.
    told = [attributes.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"]
    units = [length_unit(unit) if size else "" for unit, size in zip(told, sizes, strict=True)]
    unit, factors, different = common_length(units[::-1])
    if different:
        raise FileFault(f"must have units of length for its spacing, got {', '.join(told)}; give --spacing")
    spacing = [float(size) * factor if size else 1.0 for size, factor in zip(sizes, factors[::-1], strict=True)]
    return {"spacing": spacing, "unit": unit}


def _folder(path: str, choice: Choice) -> Samples:
    """Return the samples of a folder with one slice per file, all of one size and type."""
    shown = [name for name in os.listdir(path) if not name.startswith(".")]
    names = sorted((name for name in shown if name.lower().endswith((".tif", ".tiff"))), key=_natural)
    if len(names) == 1:
        return _file(os.path.join(path, names[0]), choice)
    pick("ZYX", [1, 1, 1], choice)
    values = np.empty(0)
    first: _Slice | None = None
    for number, name in enumerate(names):
        try:
            found = _slice_of(os.path.join(path, name), choice)
            if first is None:
                first = found
                check_size([len(names), *found.pixels.shape], real_type(found.pixels.dtype).itemsize)
                values = np.empty((len(names), *found.pixels.shape), found.pixels.dtype)
            _check_alike(names[0], first, found)
            values[number] = found.pixels
        except FileFault as fault:
            raise FileFault(f"{name}: {fault}") from None
        except MemoryError:
            raise
        except Exception as error:
            raise FileFault(f"{name}: cannot be read as TIFF: {error}") from error
    assert first is not None
    series = f"{len(names)} files are read as slices of one volume, {names[0]} to {names[-1]}"
    if is_colored(first.axes):
        index = [slice(None)] * 4
        made = colored(values, first.axes, index, first.said, associated=first.associated)
        return Samples(**(made | {"notes": (series, *made.get("notes", ()))}))
    marked, notes = without_marked(values, first.marks, "tag GDAL_NODATA", choice)
    return Samples(marked, notes=(series, *notes))


class _Slice(NamedTuple):
    """Slice of a folder: pixels, axes of a stack, mark of colour, opacity multiplied in, marks of missing samples."""

    pixels: NDArray
    axes: str
    said: str
    associated: bool
    marks: tuple[int | float, ...]


def _slice_of(file: str, choice: Choice) -> _Slice:
    import tifffile

    check_pages(file)
    with tifffile.TiffFile(file, _multifile=False) as tif:
        page = tif.pages[0]
        said, axes, sizes = _color_name(page), "Z" + page.axes.replace("S", "C"), [1, *page.shape]
        axes = with_color(axes, sizes, component_axis(axes, sizes), choice, said)
        if len(tif.pages) > 1 or (len(page.shape) != 2 and not is_colored(axes)):
            raise FileFault(f"must be one page, of one channel or of colour, got shape {by(tif.series[0].shape)}")
        check_size(page.shape, real_type(np.dtype(page.dtype)).itemsize)
        _check_pages(tif.series[0], file)
        return _Slice(np.asarray(page.asarray(maxworkers=1)), axes, said, _is_associated(page), _marks(page))


def _check_alike(name: str, first: _Slice, one: _Slice) -> None:
    """Raise FileFault unless a slice is like the first slice, `name`."""
    if one.marks != first.marks:
        raise FileFault(f"its slices must mark missing samples alike (GDAL_NODATA): {name} differs")
    if one[1:] != first[1:]:
        raise FileFault(f"its slices are of mixed kinds: {name} and it are not both of one channel, or of colours")
    if one.pixels.shape != first.pixels.shape:
        sizes = f"{by(first.pixels.shape[::-1])} and {by(one.pixels.shape[::-1])}"
        raise FileFault(f"its slices are of mixed sizes: {name} and it have {sizes}")
    if one.pixels.dtype != first.pixels.dtype:
        types = f"{first.pixels.dtype} and {one.pixels.dtype}"
        raise FileFault(f"its slices are of mixed types: {name} and it have {types}")


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Return a sort key that puts slice 2 before slice 10."""
    return [(1, int(part), "") if part.isdigit() else (0, 0, part) for part in re.split(r"([0-9]+)", name)]
