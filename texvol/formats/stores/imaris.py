"""Imaris: HDF5 with a pyramid for each time and channel, whose arrays are padded to whole chunks.

The box from ExtMin to ExtMax reaches to the faces of the outer voxels, at every level.
"""

from __future__ import annotations

import re
from datetime import datetime
from typing import Any

import numpy as np

from texvol.formats import units
from texvol.formats.readers.samples import Choice, FileFault, Samples, once
from texvol.formats.stores.hdf5 import LOCK, Hdf5Source, opened
from texvol.formats.stores.placing import layout_of
from texvol.formats.stores.pyramid import checked_levels, levels_of
from texvol.formats.stores.sources import Layout, Reading
from texvol.scene.channel import Channel
from texvol.util.color import linear_from_srgb

_MOST_TIMES = 10**6


def read(path: str, choice: Choice) -> Samples:
    """Return the levels of one channel at one time."""
    file = once(choice, "file", lambda: opened(path))
    with LOCK:
        return _read(path, file, choice)


def _read(path: str, file: Any, choice: Choice) -> Samples:
    if "DataSet" not in file or "DataSetInfo/Image" not in file:
        raise FileFault("is HDF5 without Imaris' groups DataSet and DataSetInfo/Image")
    groups = _numbered(file["DataSet"], "ResolutionLevel")
    if not groups:
        raise FileFault("has no resolution level")
    times = len(_numbered(groups[0], "TimePoint"))
    if not times:
        raise FileFault("has no time point")
    channels = tuple(_channel(file, number) for number in range(len(_numbered(groups[0]["TimePoint 0"], "Channel"))))
    chosen = choice if choice.channel is not None or len(channels) < 2 else choice._replace(channel=0)
    # As if it were one array of times and channels.
    picked = layout_of("TCZYX", (times, len(channels), 1, 1, 1), chosen)
    time, channel = picked.index[0] or 0, picked.index[1] or 0
    reading = Reading(path, tuple(choice.missing), bool(choice.missing_chunks))
    sources = [_source(group, time, channel, number, reading) for number, group in enumerate(groups)]
    low, high = _extent(file)
    scales = [(high - low) / each.shape for each in sources]
    corners = [low + scale / 2 for scale in scales]
    levels, notes = levels_of(sources, [_list(each) for each in scales], [_list(each) for each in corners],
                              [None] * len(sources))  # fmt: skip
    levels, check = (levels, None) if choice.labels else checked_levels(levels, choice)
    unit = units.length_unit(_text(file["DataSetInfo/Image"], "Unit"))
    return Samples.of_levels(
        levels, scales[0][::-1].tolist(), corners[0][::-1].tolist(), unit=unit, channels=channels,
        channel=channels[channel] if len(channels) > 1 else None, notes=notes, check=check, **_times(file, times),
    )  # fmt: skip


def _times(file: Any, count: int) -> dict[str, Any]:
    """Return the times of the steps in seconds after the first; nothing where one is not told."""
    group = file.get("DataSetInfo/TimeInfo")
    if group is None or not 1 < count <= _MOST_TIMES:
        return {}
    try:
        moments = [datetime.fromisoformat(_text(group, f"TimePoint{number + 1}").strip()) for number in range(count)]
        return {"times": [(each - moments[0]).total_seconds() for each in moments], "time_unit": "s"}
    except (ValueError, TypeError):
        return {}


def _numbered(group: Any, word: str) -> list[Any]:
    """Return the groups "WORD 0", "WORD 1" and so on."""
    found: list[Any] = []
    while f"{word} {len(found)}" in group:
        found.append(group[f"{word} {len(found)}"])
    return found


def _source(level: Any, time: int, channel: int, number: int, reading: Reading) -> Hdf5Source:
    place = f"TimePoint {time}/Channel {channel}"
    if f"{place}/Data" not in level:
        raise FileFault(f"its resolution level {number} has no {place}/Data")
    group = level[place]
    sizes = tuple(int(_number(group, f"ImageSize{axis}")) for axis in "ZYX")
    data = group["Data"]
    if len(data.shape) != 3 or min(sizes) < 1 or any(a > b for a, b in zip(sizes, data.shape, strict=True)):
        raise FileFault(f"its resolution level {number} has an array of shape {data.shape} for an image of {sizes}")
    return Hdf5Source.of(data, Layout(("z", "y", "x"), sizes, (None,) * 3, (0, 1, 2)), f"level {number}", reading)


def _extent(file: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the box, z, y, x."""
    image = file["DataSetInfo/Image"]
    low, high = (np.array([_number(image, f"{end}{axis}") for axis in (2, 1, 0)]) for end in ("ExtMin", "ExtMax"))
    if not (high > low).all():
        raise FileFault(f"its ExtMax must lie beyond its ExtMin, got {_list(low[::-1])} and {_list(high[::-1])}")
    return low, high


def _channel(file: Any, number: int) -> Channel:
    group = file.get(f"DataSetInfo/Channel {number}")
    if group is None:
        return Channel(number)
    color = _numbers(_text(group, "Color"))
    window = _numbers(_text(group, "ColorRange"))
    linear = linear_from_srgb(np.clip(color, 0, 1)) if len(color) == 3 else None
    return Channel(
        number,
        _text(group, "Name"),
        None if linear is None else (float(linear[0]), float(linear[1]), float(linear[2])),
        (window[0], window[1]) if len(window) == 2 and window[0] < window[1] else None,
    )


def _text(group: Any, name: str) -> str:
    """Return an attribute, which Imaris writes as an array of single letters; "" without one."""
    found = group.attrs.get(name)
    if found is None:
        return ""
    if isinstance(found, bytes | str):
        return found.decode("latin-1") if isinstance(found, bytes) else found
    letters = [each.decode("latin-1") if isinstance(each, bytes) else str(each) for each in np.ravel(found)]
    return "".join(letters).strip()


def _number(group: Any, name: str) -> float:
    found = _numbers(_text(group, name))
    if len(found) != 1:
        raise FileFault(f"its attribute {name} must be a number, got {_text(group, name)!r}")
    return found[0]


def _numbers(text: str) -> list[float]:
    words = re.split(r"[\s,]+", text.strip()) if text.strip() else []
    try:
        return [each for each in map(float, words) if np.isfinite(each)]
    except ValueError:
        return []


def _list(numbers: Any) -> list[float]:
    return [float(each) for each in numbers]
