"""Matter that depends on the gradient, as the ramps and contours of shaders/graded.glsl.

Magnitudes are relative to `largest_gradient`, lengths in `length_unit`, values as the texture holds them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.transfer import TransferFunction
from texvol.transfer.graded import Contour, Graded

_UPRIGHT = 1e37  # the slope of a step: times a distance of 10 still a float32
_LEAST = 1e-30
_FARTHEST = 3e37  # a place beyond all values that are stored
Stored = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def graded_switches(transfer_function: TransferFunction) -> dict[str, int]:
    """Switches of graded.glsl."""
    modulation = transfer_function.modulation
    return {
        "MODULATIONS": 0 if modulation is None else max(len(modulation) - 1, 1),
        "GRADED": sum(len(_rises(each)) for each in transfer_function.graded),
        "CONTOURS": len(transfer_function.contours),
    }


def graded_uniforms(
    transfer_function: TransferFunction,
    stored: Stored,
    value_scale: float,
    length_unit: float,
    largest_gradient: float,
    step_margin: float,
) -> dict[str, Any]:
    """Uniforms of graded.glsl.

    Parameters
    ----------
    stored : callable
        Takes values to those that the texture holds.
    value_scale : float
        What a difference of 1 between stored values stands for, data units.
    length_unit : float
        World units that emission and extinction are counted per.
    largest_gradient : float
        Data units per world unit that a gradient of 1 in the shader stands for.
    step_margin : float
        How much lower a step is put, in shares of its place: interpolation may round equal texels down.
    """
    uniforms: dict[str, Any] = {}
    if transfer_function.modulation is not None:
        uniforms |= _modulation(transfer_function.modulation, largest_gradient)
    if transfer_function.graded:
        rises, places = [], []
        for each in transfer_function.graded:
            start, width = each.start / largest_gradient, (each.full - each.start) / largest_gradient
            by_magnitude = (start - (_LEAST if width == 0 else 0), min(1 / width, _UPRIGHT) if width > 0 else _UPRIGHT)
            for rise, start, end, margin in _rises(each):
                rises.append(tuple(map(float, rise * length_unit)))
                ends = np.clip(stored(np.array([start, end])), -_FARTHEST, _FARTHEST)
                places.append((*_place(ends[0], ends[1], margin * step_margin), *by_magnitude))
        uniforms |= {"graded_rises": rises, "graded_places": places}
    if transfer_function.contours:
        uniforms |= _contours(transfer_function.contours, stored, value_scale, length_unit, largest_gradient)
    return uniforms


def _modulation(modulation: NDArray[np.float64], largest_gradient: float) -> dict[str, Any]:
    magnitudes, factors = modulation[:, 0] / largest_gradient, modulation[:, 1]
    ramps = [
        (float(rise), *_place(float(start), float(end), 0.0))
        for rise, start, end in zip(np.diff(factors), magnitudes[:-1], magnitudes[1:], strict=True)
    ]
    return {"modulation_base": float(factors[0]), "modulations": ramps or [(0.0, 0.0, 1.0)]}


def _rises(graded: Graded) -> list[tuple[NDArray[np.float64], float, float, int]]:
    """What each ramp by value adds of emission and extinction, and where it begins and ends.

    Where both are the same it is a step: 1 if a value on it lies to its right, -1 if to its left.
    """
    numbers = np.column_stack([graded.emissions, graded.extinctions])
    first, last = float(graded.values[0]), float(graded.values[-1])
    inner = zip(np.diff(numbers, axis=0), map(float, graded.values[:-1]), map(float, graded.values[1:]), strict=True)
    ramps = [(numbers[0], first, first, 1), *((*ramp, 1) for ramp in inner), (-numbers[-1], last, last, -1)]
    return [ramp for ramp in ramps if ramp[0].any()]


def _place(start: float, end: float, step_margin: float) -> tuple[float, float]:
    """Where a ramp starts, and 1 / its width; a step lies a little below its place, or above."""
    if end > start:
        return float(start), min(float(1 / (end - start)), _UPRIGHT)
    return float(start) - (step_margin * abs(start) + np.copysign(_LEAST, step_margin)), _UPRIGHT


def _contours(
    contours: tuple[Contour, ...], stored: Stored, value_scale: float, length_unit: float, largest_gradient: float
) -> dict[str, Any]:
    return {
        "contour_matters": [
            tuple(float(number * length_unit) for number in (*each.emission, each.extinction)) for each in contours
        ],
        "contour_places": [
            (float(stored(np.array(each.value))), value_scale / (each.thickness * largest_gradient))
            for each in contours
        ],
    }
