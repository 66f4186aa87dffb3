"""FITS: an image of three axes or more, read by astropy; world coordinates are the linear ones of the header.

Of WCS (Greisen, Calabretta 2002) the linear part is taken, world = CRVAL + CD (pixel - CRPIX), or PC times CDELT for
CD. What CTYPE names beyond it, the projection of the sky or a spectral scale, is not applied.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.missing import without_marked
from texvol.formats.readers.samples import (
    Choice,
    FileFault,
    Samples,
    by,
    check_size,
    check_unpacked,
    grid_from_columns,
    pick,
    real_type,
)

_MOST_EXTENSIONS = 1000
_TYPES = {8: "u1", 16: "i2", 32: "i4", 64: "i8", -32: "f4", -64: "f8"}
_LETTERS = {"STOKES": "C", "TIME": "T", "UTC": "T", "TAI": "T", "TT": "T"}


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of the image that --variable names, or of the first one with three axes."""
    from astropy.io import fits

    check_survived(lambda: _described(fits, path, choice))
    # Sections are read from the file, mapped or not; scaled ones cannot be mapped.
    with fits.open(path, memmap=False, lazy_load_hdus=True) as file:
        unit = _chosen(file, choice)
        header = unit.header
        sizes, axes = _axes(header)
        _check_held(path, unit, sizes)
        index = pick(axes, sizes[::-1], choice)
        kept = [size for size, part in zip(sizes[::-1], index, strict=True) if isinstance(part, slice)]
        check_size(kept, 8)
        # Of a number among slices astropy's section keeps an axis of one sample: each part is a slice.
        section = unit.section[tuple(part if isinstance(part, slice) else slice(part, part + 1) for part in index)]
        values = np.asarray(section)[tuple(part if isinstance(part, slice) else 0 for part in index)]
        values = values.astype(real_type(values.dtype).newbyteorder("="), copy=False)
        values, notes = _without_blank(values, header, choice)
        spatial = [number for number, letter in enumerate(axes[::-1], 1) if letter in "XYZ"]
        grid, more = _grid(header, spatial)
    name = f"image {unit.name or 'PRIMARY'}"
    return Samples(values, **grid, value_unit=str(header.get("BUNIT") or "").strip(), notes=(name, *notes, *more))


def _is_plain(path: str) -> bool:
    return not path.lower().endswith((".gz", ".bz2", ".fz"))


def _described(fits: Any, path: str, choice: Choice) -> None:
    """Open the file and look at the header of the image."""
    with fits.open(path, memmap=False, lazy_load_hdus=True) as file:
        _axes(_chosen(file, choice).header)


def _chosen(file: Any, choice: Choice) -> Any:
    """Return the image that is named, or the first one with three axes."""
    known: list[str] = []
    for number in range(_MOST_EXTENSIONS):
        try:
            unit = file[number]
        except IndexError:
            break
        count = int(unit.header.get("NAXIS", 0)) if unit.is_image else 0
        name = str(unit.name or ("PRIMARY" if number == 0 else number))
        if choice.variable is None and count >= 3:
            return unit
        if choice.variable is not None and choice.variable.upper() in (name.upper(), str(number)) and unit.is_image:
            return unit
        if count >= 3:
            known.append(name)
    if choice.variable is None:
        raise FileFault("has no image with three axes")
    raise FileFault(f"has no image {choice.variable} (--variable); it has {', '.join(known) or 'none with three axes'}")


def _axes(header: Any) -> tuple[list[int], str]:
    """Return sizes, fastest first, and letters for `pick`, slowest first."""
    count = int(header["NAXIS"])
    if not 3 <= count <= 9:
        raise FileFault(f"must have 3 to 9 axes, got {count}")
    sizes = [int(header[f"NAXIS{axis}"]) for axis in range(1, count + 1)]
    letters = [
        _LETTERS.get(_word(header, f"CTYPE{axis}").partition("-")[0].upper(), "S") for axis in range(1, count + 1)
    ]
    space = [at for at, letter in enumerate(letters) if letter == "S"]
    for at, letter in zip(space, "XYZ" + "?" * len(space), strict=False):
        letters[at] = letter
    return sizes, "".join(letters[::-1])


def _check_held(path: str, unit: Any, sizes: Sequence[int]) -> None:
    """Raise FileFault if the file cannot hold the image."""
    bits, held = int(unit.header.get("BITPIX", 8)), os.path.getsize(path)
    if bits not in _TYPES or min(sizes) < 1:
        raise FileFault(
            f"must have positive sizes and a BITPIX of {', '.join(map(str, _TYPES))}, got {by(sizes)} of {bits}"
        )
    needed = check_size(sizes, abs(bits) // 8)
    is_packed = not _is_plain(path) or type(unit).__name__ == "CompImageHDU"
    if is_packed:
        check_unpacked(needed, held)
    elif needed > held:
        raise FileFault(f"holds {held} bytes, but its header's {by(sizes)} samples need {needed}")


def _without_blank(values: NDArray, header: Any, choice: Choice) -> tuple[NDArray, tuple[str, ...]]:
    """Return whole numbers with NaN for those that BLANK marks; astropy does so for scaled ones."""
    blank = header.get("BLANK")
    if blank is None or values.dtype.kind not in "iu" or isinstance(blank, bool) or not isinstance(blank, int):
        return values, ()
    return without_marked(values, (int(blank + header.get("BZERO", 0)),), "BLANK", choice)


def _grid(header: Any, axes: Sequence[int]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the grid along the world axes of the same numbers, and notes."""
    matrix = _matrix(header, axes)
    start = np.array([_number(header, f"CRVAL{world}", 0.0) for world in axes])
    first = np.array([1 - _number(header, f"CRPIX{axis}", 0.0) for axis in axes])  # pixels are counted from 1
    spacing, direction = grid_from_columns(matrix)
    units = [_word(header, f"CUNIT{axis}") for axis in axes]
    names = [_word(header, f"CTYPE{axis}") for axis in axes]
    described = [
        f"{name or letter} ({unit})" if unit else name or letter
        for name, letter, unit in zip(names, "xyz", units, strict=True)
    ]
    grid = {"spacing": spacing, "direction": direction, "origin": start + matrix @ first}
    grid |= {"unit": units[0] if len(set(units)) == 1 else "", "space": ", ".join(described) if any(names) else ""}
    notes = []
    if len(set(units)) > 1:
        listed = ", ".join(unit or "no unit" for unit in units)
        notes.append(f"its axes have different units ({listed}); --spacing X,Y,Z makes them comparable")
    if curved := [name for name in names if re.search(r"-[A-Z0-9]{3}$", name)]:
        notes.append(f"world coordinates are the linear ones: the projection of {', '.join(curved)} is not applied")
    return grid, tuple(notes)


def _matrix(header: Any, axes: Sequence[int]) -> NDArray[np.float64]:
    """Return the world steps of the pixel axes, one in each column: CD, or PC times CDELT, or CDELT turned by CROTA."""
    pairs = [(row, column, f"{axes[row]}_{axes[column]}") for row, column in np.ndindex(3, 3)]
    if any(re.fullmatch(r"CD\d_\d", str(key)) for key in header):
        return np.array([_number(header, f"CD{pair}", 0.0) for *_, pair in pairs]).reshape(3, 3)
    turns = np.array([_number(header, f"PC{pair}", float(row == column)) for row, column, pair in pairs]).reshape(3, 3)
    steps = np.array([_number(header, f"CDELT{world}", 1.0) for world in axes])
    if not any(re.fullmatch(r"PC\d_\d", str(key)) for key in header):
        turns = _turned(header, axes)
        return turns * steps  # the old convention scales before it turns
    return steps[:, np.newaxis] * turns


def _turned(header: Any, axes: Sequence[int]) -> NDArray[np.float64]:
    """Return the rotation of the sky's two axes by CROTA of the latitude (Greisen, Calabretta 2002, section 6.1)."""
    turns = np.eye(3)
    names = [_word(header, f"CTYPE{axis}").partition("-")[0].upper() for axis in axes]
    latitude = next((at for at, name in enumerate(names) if name == "DEC" or name.endswith("LAT")), None)
    longitude = next((at for at, name in enumerate(names) if name == "RA" or name.endswith("LON")), None)
    if latitude is None or longitude is None:
        return turns
    angle = np.radians(_number(header, f"CROTA{axes[latitude]}", 0.0))
    turns[[longitude, latitude], [longitude, latitude]] = np.cos(angle)
    turns[longitude, latitude], turns[latitude, longitude] = -np.sin(angle), np.sin(angle)
    return turns


def _number(header: Any, key: str, default: float) -> float:
    value = header.get(key, default)
    if isinstance(value, bool | str) or value is None or not np.isfinite(float(value)):
        raise FileFault(f"{key} must be a finite number, got {value!r}")
    return float(value)


def _word(header: Any, key: str) -> str:
    return str(header.get(key) or "").strip()
