"""Integrand of an X-ray: the value itself, or what of it is above the value of air.

    air = None           ∫ v ds                        data units times world units
    air = V              ∫ max(0, v - V) ds            the same; air of value V, and what is below, lets all through
    air = "hounsfield"   ∫ max(0, 1 + v / 1000) ds     world units of water that let as much through

The last is attenuation relative to water's where values are Hounsfield units, of which air has -1000 and water 0. The
value itself says nothing of attenuation there: where air is -1000, rays that leave the box soonest are brightest.
Averages need none of it: they are divided by the ray's length.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, cast

import numpy as np

from texvol.scene.volume import Volume
from texvol.util.errors import InputError, is_number

HOUNSFIELD: Literal["hounsfield"] = "hounsfield"
Air = float | Literal["hounsfield"] | None
AIR, WATER = -1000.0, 0.0  # Hounsfield units, by their definition

_NAMES = ("hu", "[hu]", "[hnsf'u]", "hounsfield", "hounsfield unit", "hounsfield units")
_NEAR_AIR, _NEAR_WATER = 60.0, 200.0  # what scanners are off by, and soft tissue and fat
_ENOUGH = 0.02  # of the samples: air around a body, and the body


class Attenuation(NamedTuple):
    """Integrand of an X-ray with air: the excess of the value over that of air, times a factor."""

    air: float  # data units
    per_value: float


def attenuation_of(air: Air) -> Attenuation | None:
    """Return the integrand of an X-ray; None where that is the value itself."""
    if air is None:
        return None
    if air == HOUNSFIELD:
        return Attenuation(AIR, 1 / (WATER - AIR))
    return Attenuation(cast(float, air), 1.0)


def checked_air(air: Any) -> Air:
    """Return `air` as a Scene holds it; InputError unless it is a finite number, "hounsfield" or None."""
    if air is None or (isinstance(air, str) and air == HOUNSFIELD):
        return cast(Air, air)
    if not is_number(air) or not np.isfinite(air):
        raise InputError(f"air must be a finite number, {HOUNSFIELD!r} or None, got {air!r}")
    return float(air)


def air_in_8_bits(volume: Volume) -> Air:
    """Air of an X-ray in 8 bits where nobody says it: of Hounsfield units theirs, else the least value."""
    if hounsfield_by(volume):
        return HOUNSFIELD
    return volume.finite_range[0] if volume.finite_range else None


def hounsfield_by(volume: Volume) -> Literal["", "file", "values"]:
    """Return "file" or "values", whichever says that values are Hounsfield units; "" where neither does."""
    if is_told_hounsfield(volume):
        return "file"
    is_untold = not (volume.labels or volume.colors is not None or volume.value_unit)
    return "values" if is_untold and _like_hounsfield(volume) else ""


def is_told_hounsfield(volume: Volume) -> bool:
    """True if the file says that values are Hounsfield units; no value is looked at."""
    is_measured = not volume.labels and volume.colors is None
    return is_measured and volume.value_unit.strip().lower() in _NAMES


def hounsfield_range(volume: Volume) -> bool:
    """True if the range is one of Hounsfield units: from near air's to something denser than water."""
    low, high = volume.finite_range or (0.0, 0.0)
    return -4096 <= low <= -500 and 100 <= high <= 32767


def _like_hounsfield(volume: Volume) -> bool:
    """True if the range is that of Hounsfield units, with samples near air, samples near water, and none below air.

    Scanners pad with a number of their own what lies outside of their circle: the least value counts as no sample.
    """
    if not hounsfield_range(volume):
        return False
    from texvol.scene.transfer.units import typical_samples

    samples = typical_samples(volume)
    measured = samples[samples > samples[0]]
    if not measured.size:
        return False
    air = np.abs(samples - AIR) <= _NEAR_AIR
    water = np.abs(measured - WATER) <= _NEAR_WATER
    below = measured < AIR - 2 * _NEAR_AIR
    return bool(air.mean() >= _ENOUGH and water.mean() >= _ENOUGH and below.mean() < _ENOUGH / 2)
