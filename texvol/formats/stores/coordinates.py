"""Axes of an xarray.DataArray: which dimension is x, y, z, channel or time, and where its coordinates lie.

Attributes of the CF conventions decide (axis, standard_name, units, positive), then names. Dimensions without any known
name are z, y, x in this order; where only some are known nothing is guessed, so that nothing is silently transposed.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from texvol.formats import units
from texvol.formats.readers.netcdf_axes import role_of
from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.placing import letter_of
from texvol.formats.stores.sources import Layout

EVEN = 1e-3  # of a step, by which coordinates may be uneven


def names_of(array: Any) -> list[str | None]:
    """Return the names of an xarray.DataArray's dimensions, or as many None."""
    dims = getattr(array, "dims", None)
    named = isinstance(dims, tuple) and len(dims) == len(array.shape) and all(isinstance(each, str) for each in dims)
    return list(dims) if named and dims is not None else [None] * len(array.shape)


def letters_by_name(array: Any, names: Sequence[str]) -> str:
    """Return a letter for each dimension: X, Y, Z, T or C, or ? for an unknown one of length 1 beside X, Y and Z.

    Raises
    ------
    FileFault
        If there are not three dimensions of space, or some of them are not known.
    """
    told = [role_of(_coordinate(array, name), "") for name in names]
    tables: tuple[Callable[[str], str], ...] = (letter_of, lambda name: role_of(None, name))
    candidates = [[each or table(name) for each, name in zip(told, names, strict=True)] for table in tables]
    for found in candidates:
        if {"X", "Y", "Z"} <= set(found):
            found[:] = [each or ("?" if size == 1 else "") for each, size in zip(found, array.shape, strict=True)]
        if sorted(set(found) & set("XYZ")) == ["X", "Y", "Z"] and "" not in found and _are_different(found):
            return "".join(found)
    found = candidates[0]
    unknown = [number for number, each in enumerate(found) if not each]
    listed = ", ".join(names)
    if len(names) - sum(each in ("T", "C") for each in found) < 3:
        other = next((name for name, each in zip(names, found, strict=True) if each in ("T", "C")), None)
        fixed = f"array.rename({other}='z') makes one of {other}"
        if other is None:
            fixed = "isel(z=[3]) in place of isel(z=3) keeps one slice as a volume"
        raise FileFault(f"must have three dimensions of space, got {listed}; {fixed}")
    if len(unknown) != 3 or set(found) & set("XYZ"):
        wanted = "the dimensions must be named for z, y, x (and channel, time)"
        one = names[unknown[0] if unknown else 0]
        fixed = f"array.rename({one}='z') names one"
        if set("XYZ") <= set(found):
            fixed = f"array.rename({one}='channel') makes channels of it, array.isel({one}=0) leaves it out"
        raise FileFault(f"{wanted}, got {listed}; {fixed}")
    for number, letter in zip(unknown, "ZYX", strict=True):
        found[number] = letter
    return "".join(found)


def grid_of(array: Any, names: Sequence[str | None], layout: Layout, *, told: bool) -> Mapping[str, Any]:
    """Return spacing, origin and direction along x, y, z and their unit, by the coordinates of an xarray.DataArray.

    Axes in different units of length have that of x. An axis of one sample is as thick as the samples of the finest.

    Raises
    ------
    FileFault
        If coordinates are uneven or have several dimensions, unless the spacing is told.
    """
    steps, origin, found = [np.nan] * 3, [0.0] * 3, [""] * 3
    for number, axis in enumerate(layout.order):
        name = None if axis is None else names[axis]
        coordinate = _coordinate(array, name)
        if coordinate is None or np.asarray(coordinate).dtype.kind not in "iuf":
            if not told and name is not None:
                _check_not_curved(array, name)
            continue
        positions = np.asarray(coordinate).astype(np.float64)
        apart = np.diff(positions)
        if apart.size and not (apart[0] != 0 and np.abs(apart - apart.mean()).max() <= EVEN * abs(apart.mean())):
            if told:
                continue
            advice = f"array.interp({name}=…) makes them so, spacing=(x, y, z) overrides them"
            raise FileFault(f"its coordinates {name} must be even; {advice}")
        steps[number], origin[number] = float(apart.mean()) if apart.size else np.nan, float(positions[0])
        found[number] = units.length_unit(str(coordinate.attrs.get("units", "")))
    unit, factors, notes = units.common_length(found)
    if notes and not told:
        listed = ", ".join(each or "no unit" for each in found[::-1])
        words = f"the axes x, y, z have different units ({listed}); spacing=(x, y, z) makes them comparable"
        warnings.warn(words, stacklevel=4)
    known = [abs(step * factor) for step, factor in zip(steps, factors, strict=True)]
    thin = float(np.nanmin(known)) if np.isfinite(known).any() else 1.0
    thick = [1.0 if axis is None or layout.sizes[axis] > 1 else thin for axis in layout.order]
    spacing = [step if np.isfinite(step) else other for step, other in zip(known, thick, strict=True)]
    direction = np.diag([-1.0 if step < 0 else 1.0 for step in steps[::-1]])
    origin = [first * factor for first, factor in zip(origin, factors, strict=True)]
    return {"spacing": spacing[::-1], "origin": origin[::-1], "direction": direction, "unit": unit}


def _coordinate(array: Any, name: str | None) -> Any | None:
    """Return the coordinate of a dimension; None if it has none of its own."""
    coordinates = getattr(array, "coords", {})
    return coordinates[name] if name in coordinates and coordinates[name].dims == (name,) else None


def _are_different(letters: Sequence[str]) -> bool:
    space = [each for each in letters if each in ("X", "Y", "Z")]
    return len(set(space)) == len(space)


def _check_not_curved(array: Any, name: str) -> None:
    """Raise FileFault if positions along a dimension depend on another one."""
    for other, each in getattr(array, "coords", {}).items():
        if len(each.dims) > 1 and name in each.dims and role_of(each, str(other)) in ("X", "Y", "Z"):
            advice = "texvol.load of its file resamples it, spacing=(x, y, z) overrides them"
            raise FileFault(f"its coordinates {other} must have one dimension, got {', '.join(each.dims)}; {advice}")
