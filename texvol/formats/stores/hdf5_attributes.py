"""Grid and marks of missing samples of an HDF5 dataset, by its attributes.

The format itself has no spacing. Read are even coordinates in dimension scales with an attribute `units` (netCDF-4),
`element_size_um` of Fiji's and ilastik's files (z, y, x), the unit of the values, `units`, and the marks `_FillValue`
and `missing_value`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from texvol.formats import units
from texvol.formats.readers.missing import Mark
from texvol.formats.stores.sources import Layout

_EVEN = 1e-3  # of a step, by which coordinates may be uneven
_LONGEST = 1 << 20  # coordinates along an axis


def grid_of(dataset: Any, layout: Layout) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return spacing, origin and units of a dataset, and notes."""
    value_unit = _units(dataset)
    sizes = _numbers(dataset.attrs.get("element_size_um"))
    if len(sizes) == 3 and min(sizes) > 0:
        return {"spacing": sizes[::-1], "unit": "µm", "value_unit": value_unit}, ()
    spacing, origin, found, notes = [1.0] * 3, [0.0] * 3, [""] * 3, []
    for number, axis in enumerate(layout.order):
        scale = None if axis is None else _scale(dataset, axis)
        if scale is None:
            continue
        values, unit = scale
        steps = np.diff(values)
        step = float(steps.mean()) if steps.size else 1.0
        if not (np.isfinite(values).all() and step > 0 and np.abs(steps - step).max(initial=0.0) <= _EVEN * step):
            notes.append(
                f"coordinates of its axis {layout.names[axis or 0]} are not even and ascending: spacing 1 is taken"
            )
            continue
        spacing[number], origin[number], found[number] = step, float(values[0]), unit
    unit, factors, more = units.common_length(found)
    spacing = [each * factor for each, factor in zip(spacing, factors, strict=True)]
    origin = [each * factor for each, factor in zip(origin, factors, strict=True)]
    grid = {"spacing": spacing[::-1], "origin": origin[::-1], "unit": unit, "value_unit": value_unit}
    return grid, (*notes, *more)


def marks_of(dataset: Any) -> tuple[Mark, ...]:
    """Return the values that mark missing samples."""
    found = [number for key in ("_FillValue", "missing_value") for number in _numbers(dataset.attrs.get(key))]
    whole = dataset.dtype.kind in "iu"
    return tuple(dict.fromkeys(int(each) if whole and each.is_integer() else each for each in found if each == each))


def _scale(dataset: Any, axis: int) -> tuple[np.ndarray, str] | None:
    """Return coordinates and unit of an axis, or None if it has no scale of as many numbers."""
    scales = dataset.dims[axis]
    if not len(scales):
        return None
    scale = scales[0]
    if scale.shape != (dataset.shape[axis],) or scale.dtype.kind not in "iuf" or scale.shape[0] > _LONGEST:
        return None
    values = np.asarray(scale[()], np.float64)
    # netCDF makes a scale without coordinates for each dimension; it is filled with zeros.
    return None if values.size > 1 and not values.any() else (values, units.length_unit(_units(scale)))


def _units(dataset: Any) -> str:
    """Return the attribute `units`, empty unless it is a text."""
    named = dataset.attrs.get("units", "")
    text = named.decode("latin-1") if isinstance(named, bytes) else named
    return text.strip() if isinstance(text, str) else ""


def _numbers(thing: Any) -> Sequence[float]:
    """Return the numbers of an attribute, or none."""
    try:
        found = np.ravel(np.asarray(thing, np.float64)) if thing is not None else np.empty(0)
    except (TypeError, ValueError):
        return []
    return [float(each) for each in found[:16]]
