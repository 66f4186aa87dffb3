"""Matter that depends on the gradient, as the pieces and contours of shaders/graded.glsl.

Magnitudes are relative to `largest_gradient`, lengths in `length_unit`, values as the texture holds them.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.textures.ramps import STEP_MARGIN
from texvol.textures.value_storage import Storage

_UPRIGHT = 1e37  # the slope of a step: times a distance of 10 still a float32
_LEAST = 1e-30
_FARTHEST = 3e37  # a position beyond all values that are stored
Row = tuple[float, ...]


def graded_switches(transfer_function: TransferFunction) -> dict[str, int]:
    """Switches of graded.glsl."""
    modulation = transfer_function.modulation
    return {
        "MODULATIONS": 0 if modulation is None else max(len(modulation) - 1, 1),
        "GRADED": sum(len(_pieces(each)) for each in transfer_function.graded),
        "CONTOURS": len(transfer_function.contours),
    }


def graded_uniforms(
    transfer_function: TransferFunction, storage: Storage, length_unit: float, largest_gradient: float
) -> dict[str, Any]:
    """Uniforms of graded.glsl.

    Parameters
    ----------
    storage : Storage
        Of the values.
    length_unit : float
        World units that emission and extinction are counted per.
    largest_gradient : float
        Data units per world unit that a gradient of 1 in the shader stands for.
    """
    uniforms: dict[str, Any] = {}
    if transfer_function.modulation is not None:
        uniforms |= _modulation(transfer_function.modulation, largest_gradient)
    if any(_pieces(each) for each in transfer_function.graded):
        uniforms |= _graded(transfer_function.graded, storage, length_unit, largest_gradient)
    if transfer_function.contours:
        uniforms |= _contours(transfer_function.contours, storage, length_unit, largest_gradient)
    return uniforms


def _modulation(modulation: NDArray[np.float64], largest_gradient: float) -> dict[str, Any]:
    magnitudes, factors = modulation[:, 0] / largest_gradient, modulation[:, 1].astype(np.float32)
    ramps: list[Row] = []
    total = factors[0]
    for factor, (start, end) in zip(factors[1:], pairwise(magnitudes), strict=True):
        # From where float32's sum has come, so that it ends at exactly 0 where the factor is that: an opaque medium,
        # times whatever is left by rounding, would still be opaque.
        rise = factor - total
        total = total + rise
        ramps.append((float(rise), float(start), _slope(end - start)))
    return {"modulation_base": float(factors[0]), "modulations": ramps or [(0.0, 0.0, 1.0)]}


def _graded(
    graded: tuple[Graded, ...], storage: Storage, length_unit: float, largest_gradient: float
) -> dict[str, Any]:
    rows: list[tuple[Row, ...]] = []
    for each in graded:
        numbers = np.column_stack([each.emissions, each.extinctions]) * length_unit
        edges = np.clip(storage.stored(each.values), -_FARTHEST, _FARTHEST)
        margins = STEP_MARGIN * np.abs(edges) + _LEAST
        # A value on a point lies in the piece that begins there; on the last, in the last piece.
        bounds = edges - margins
        beyond = edges[-1] + margins[-1]
        start, width = each.start / largest_gradient, (each.full - each.start) / largest_gradient
        start -= STEP_MARGIN * start + _LEAST if width == 0 else 0.0
        for first, last in _pieces(each):
            is_closed = last == len(edges) - 1 and (first == last or not _ends_in_step(each))
            positions = bounds[first], beyond if is_closed else bounds[last], edges[first]
            slopes = _slope(edges[last] - edges[first]), start, _slope(width)
            rows.append(tuple(map(_row, (numbers[first], numbers[last], positions, slopes))))
    names = "graded_starts", "graded_ends", "graded_positions", "graded_slopes"
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def _pieces(graded: Graded) -> list[tuple[int, int]]:
    """The points at both ends of what is linear, where there is any medium; one twice for a value of its own."""
    pairs = [(i, i + 1) for i in range(graded.values.size - 1) if graded.values[i + 1] > graded.values[i]]
    if _ends_in_step(graded):
        pairs.append((graded.values.size - 1,) * 2)
    medium = (graded.extinctions > 0) | (graded.emissions > 0).any(axis=1)
    return [(first, last) for first, last in pairs if medium[first] or medium[last]]


def _ends_in_step(graded: Graded) -> bool:
    """True if the last value is the end of a step."""
    return bool(graded.values.size == 1 or graded.values[-1] == graded.values[-2])


def _slope(width: float) -> float:
    return min(float(1 / width), _UPRIGHT) if width > 1 / _UPRIGHT else _UPRIGHT


def _contours(
    contours: tuple[Contour, ...], storage: Storage, length_unit: float, largest_gradient: float
) -> dict[str, Any]:
    positions: list[Row] = []
    for each in contours:
        position = float(np.clip(storage.stored(np.array(each.value)), -_FARTHEST, _FARTHEST))
        # What is no farther away than rounding is there, also where nothing rises.
        per_value = _slope(each.thickness * largest_gradient / storage.scale)
        positions.append(_row((position, STEP_MARGIN * abs(position), per_value)))
    media = [_row(np.array([*each.emission, each.extinction]) * length_unit) for each in contours]
    return {"contour_media": media, "contour_positions": positions}


def _row(numbers: Iterable[float]) -> Row:
    return tuple(map(float, numbers))
