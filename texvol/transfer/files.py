"""Transfer functions as JSON.

    {"points": [{"value": 0,   "color": [0, 0, 0],       "extinction": 0},
                {"value": 300, "color": [0.9, 0.8, 0.7], "extinction": 0.5}]}

Keys of a point: `value`; `color`, linear RGB in [0, 1]; `extinction` per unit of length, or in its place `opacity`,
that of one unit of length (the source's A_l), converted by -log1p(-A). Further keys of the whole:

    "values": "data" (default), or "percentile": values are percentiles of the volume's finite samples, 0 … 100,
              or "range": 0 is the smallest finite sample, 1 the largest
    "length": "world" (default), or "box": extinction is per mean edge of the volume's box, not per world unit
    "emission": "associated" (default), or "emissive": in place of `color` each point has `emission`, three numbers per
              unit of length that do not depend on the extinction
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.errors import InputError
from texvol.optics import depth_from_opacity
from texvol.transfer.function import TransferFunction
from texvol.volume import Volume

_MOST_BYTES = 64 << 20  # some million points; more is no transfer function
_CHOICES = {
    "values": ("data", "percentile", "range"),
    "length": ("world", "box"),
    "emission": ("associated", "emissive"),
}
_STATISTICS_SAMPLES = 1 << 16  # samples that percentiles are taken from; their error is 0.2 of a percentile


def load(path: str | os.PathLike[str], volume: Volume | None = None) -> TransferFunction:
    """The transfer function in a JSON file; `volume` is needed where the file speaks of percentiles, range or box.

    Raises
    ------
    InputError
        If the file can't be read, is not such a JSON object, or has unknown keys or points out of range.
    """
    path = Path(path)
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path}: {path.stat().st_size} bytes are no transfer function")
        text = path.read_text("utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not JSON: it is not UTF-8 text") from None
    return loads(text, str(path), volume)


def loads(text: str, name: str = "transfer function", volume: Volume | None = None) -> TransferFunction:
    """The transfer function in a JSON text; see `load`."""
    try:
        content = json.loads(text, object_pairs_hook=_without_duplicates)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name}: is not JSON: {error}") from None
    try:
        return _from_content(content, name, volume)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(name) else f"{name}: {message}") from None


def relative_to(
    transfer_function: TransferFunction, volume: Volume, values: str = "data", length: str = "world"
) -> TransferFunction:
    """A transfer function in data and world units, from one whose units `values` and `length` name."""
    placed = transfer_function.values
    if values == "range":
        low, high = volume.finite_range or (0.0, 1.0)
        placed = low * (1 - placed) + high * placed
    elif values == "percentile":
        placed = np.percentile(typical_samples(volume), placed)
    extinctions, colors = transfer_function.extinctions, transfer_function.colors
    if length == "box":
        edge = float(np.linalg.norm(volume.box_edges, axis=0).mean())
        extinctions = extinctions / edge
        colors = colors / edge if transfer_function.emissive else colors
    return replace(transfer_function, values=np.maximum.accumulate(placed), extinctions=extinctions, colors=colors)


def typical_samples(volume: Volume) -> NDArray[np.float64]:
    """Finite samples spread over the volume, at most 65,536 of them, ascending; (0,) where none is finite."""
    flat = volume.values.reshape(-1)
    stride = -(-flat.size // _STATISTICS_SAMPLES)
    # A stride that shares no factor with the row length visits every column, not a few over and over.
    while stride > 1 and any(np.gcd(stride, n) > 1 for n in volume.dimensions[:2] if n > 1) and stride < 1 << 20:
        stride += 1
    samples = flat[::stride].astype(np.float64)
    samples = samples[np.isfinite(samples)]
    if not samples.size and volume.finite_range:
        samples = np.array(volume.finite_range)
    return np.sort(samples) if samples.size else np.zeros(1)


def _from_content(content: Any, name: str, volume: Volume | None) -> TransferFunction:
    if not isinstance(content, dict):
        raise InputError("a transfer function is a JSON object with points")
    _refuse_unknown(content, {"points", *_CHOICES}, "a transfer function")
    chosen = {key: content.get(key, allowed[0]) for key, allowed in _CHOICES.items()}
    for key, allowed in _CHOICES.items():
        if chosen[key] not in allowed:
            raise InputError(f'"{key}" is one of {", ".join(allowed)}, and not {chosen[key]!r}')
    points = content.get("points")
    if not isinstance(points, list) or not points:
        raise InputError("a transfer function has a list of points, and at least one")
    emissive = chosen["emission"] == "emissive"
    parsed = [_point(point, number, emissive) for number, point in enumerate(points)]
    values, colors, extinctions = (np.array(column, np.float64) for column in zip(*parsed, strict=True))
    transfer_function = TransferFunction(values, colors, extinctions, emissive, name)
    if chosen["values"] == "data" and chosen["length"] == "world":
        return transfer_function
    if chosen["values"] == "percentile" and not ((values >= 0) & (values <= 100)).all():
        raise InputError("percentiles lie in [0, 100]")
    if volume is None:
        raise InputError("its units depend on the volume: give load(path, volume)")
    return relative_to(transfer_function, volume, chosen["values"], chosen["length"])


def _point(point: Any, number: int, emissive: bool) -> tuple[float, list[float], float]:
    """Value, colour or emission, and extinction of one point."""
    where = f"point {number}"
    if not isinstance(point, dict):
        raise InputError(f"{where} is an object with value, color and extinction, and not {point!r}")
    color_key = "emission" if emissive else "color"
    _refuse_unknown(point, {"value", color_key, "extinction", "opacity"}, where)
    if ("extinction" in point) == ("opacity" in point):
        raise InputError(f"{where} has either extinction or opacity")
    if "value" not in point or color_key not in point:
        raise InputError(f"{where} lacks {'value' if 'value' not in point else color_key}")
    color = point[color_key]
    if not isinstance(color, list) or len(color) != 3:
        raise InputError(f"{where}: {color_key} is three numbers, and not {color!r}")
    color = [_number(component, f"{where}: {color_key}") for component in color]
    if "opacity" in point:
        opacity = _number(point["opacity"], f"{where}: opacity")
        if not 0 <= opacity <= 1:
            raise InputError(f"{where}: opacity lies in [0, 1], and is {opacity:g}")
        extinction = float(depth_from_opacity(opacity))
    else:
        extinction = _number(point["extinction"], f"{where}: extinction")
        if not extinction >= 0:
            raise InputError(f"{where}: extinction must not be negative or NaN, and is {extinction:g}")
    return _number(point["value"], f"{where}: value"), color, extinction


def _number(thing: Any, what: str) -> float:
    if isinstance(thing, bool) or not isinstance(thing, int | float):
        raise InputError(f"{what} is a number, and not {thing!r}")
    try:
        return float(thing)
    except OverflowError:
        raise InputError(f"{what} is too large") from None


def _refuse_unknown(thing: dict[str, Any], known: set[str], what: str) -> None:
    unknown = sorted(set(thing) - known)
    if unknown:
        raise InputError(f"{what} has no key {unknown[0]!r}; it has {', '.join(sorted(known))}")


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        raise ValueError("a key stands twice in one object")
    return content
