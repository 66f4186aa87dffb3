"""Presets, and a transfer function for a volume of which nothing is known.

A preset's extinction is per mean edge of the volume's box, so that it looks the same on a tooth and on a thorax. The
CT presets are in Hounsfield units where the volume's range is that of such data; elsewhere, and in all other presets,
values are fractions of the range that holds the medium: from where the background ends to the 99.9th percentile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.air import hounsfield_by, hounsfield_range
from texvol.scene.transfer.function import TransferFunction
from texvol.scene.transfer.material_presets import CT_MATERIALS, MATERIALS
from texvol.scene.transfer.units import Units
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Point = tuple[float, tuple[float, float, float], float]  # value, linear colour, extinction per mean edge of the box

# Each CT preset twice: in Hounsfield units, and in fractions of the medium's range for rescaled or 8-bit CT.
_CT: dict[str, tuple[list[Point], list[Point]]] = {
    "ct-bone": (
        [
            (150, (0.45, 0.10, 0.04), 0),
            (250, (0.75, 0.42, 0.22), 12),
            (500, (0.90, 0.78, 0.58), 60),
            (1200, (1.00, 0.97, 0.90), 200),
        ],
        [
            (0.38, (0.45, 0.10, 0.04), 0),
            (0.48, (0.75, 0.42, 0.22), 12),
            (0.65, (0.90, 0.78, 0.58), 60),
            (1.00, (1.00, 0.97, 0.90), 200),
        ],
    ),
    "ct-soft-tissue": (
        [
            (-150, (0.60, 0.25, 0.10), 0),
            (-60, (0.75, 0.42, 0.20), 2),
            (20, (0.62, 0.16, 0.10), 8),
            (90, (0.80, 0.30, 0.20), 12),
            (200, (0.95, 0.80, 0.62), 40),
            (1000, (1.00, 0.97, 0.90), 120),
        ],
        [
            (0.05, (0.60, 0.25, 0.10), 0),
            (0.20, (0.75, 0.42, 0.20), 2),
            (0.30, (0.62, 0.16, 0.10), 8),
            (0.42, (0.80, 0.30, 0.20), 12),
            (0.60, (0.95, 0.80, 0.62), 40),
            (1.00, (1.00, 0.97, 0.90), 120),
        ],
    ),
    "ct-lung": (
        [
            (-950, (0.05, 0.10, 0.35), 0),
            (-850, (0.15, 0.35, 0.75), 1.5),
            (-650, (0.45, 0.70, 0.90), 4),
            (-450, (0.90, 0.55, 0.45), 10),
            (-300, (0.80, 0.25, 0.18), 1),
            (100, (0.60, 0.20, 0.15), 0.6),
            (300, (1.00, 0.95, 0.85), 25),
        ],
        [
            (0.02, (0.05, 0.10, 0.35), 0),
            (0.06, (0.15, 0.35, 0.75), 1.5),
            (0.14, (0.45, 0.70, 0.90), 4),
            (0.22, (0.90, 0.55, 0.45), 10),
            (0.28, (0.80, 0.25, 0.18), 1),
            (0.45, (0.60, 0.20, 0.15), 0.6),
            (0.70, (1.00, 0.95, 0.85), 25),
        ],
    ),
}

_FRACTIONS: dict[str, list[Point]] = {
    "mr": [
        (0.08, (0.20, 0.05, 0.04), 0),
        (0.25, (0.45, 0.16, 0.12), 4),
        (0.50, (0.80, 0.50, 0.40), 14),
        (0.75, (0.95, 0.82, 0.70), 30),
        (1.00, (1.00, 1.00, 0.95), 60),
    ],
    "grey": [(0.0, (0.0, 0.0, 0.0), 0), (1.0, (1.0, 1.0, 1.0), 20)],
    "fog": [(0.0, (0.85, 0.90, 1.0), 0), (1.0, (0.85, 0.90, 1.0), 4)],
    "solid": [
        (0.30, (0.55, 0.52, 0.48), 0),
        (0.36, (0.75, 0.72, 0.66), 300),
        (1.00, (0.95, 0.93, 0.88), 600),
    ],
}

# Perceptually even ramps, by the names that the library of colour maps knows them by.
_RAMPS = ("viridis", "inferno", "magma", "cividis")

_PROPOSAL: list[Point] = [
    (0.00, (0.25, 0.04, 0.02), 0),
    (0.30, (0.60, 0.16, 0.06), 3),
    (0.60, (0.90, 0.52, 0.22), 12),
    (1.00, (1.00, 0.95, 0.82), 50),
]

# Of samples that have a colour of their own: white leaves it as it is; as dense as the above.
_AS_IT_IS: list[Point] = [(0.0, (1.0, 1.0, 1.0), 0), (1.0, (1.0, 1.0, 1.0), 50)]

# Of volumes beside the first, which is reddish: far from it and from each other.
_HUES = ((0.1, 0.65, 1.0), (0.2, 1.0, 0.25), (1.0, 0.2, 0.9), (1.0, 0.9, 0.1))

_PROPOSED: WeakKeyDictionary[Volume, TransferFunction] = WeakKeyDictionary()
_OF_THE_HISTOGRAM = ("histogram", "contours", "boundaries")

PRESETS: tuple[str, ...] = (*_CT, *_FRACTIONS, *_RAMPS, *CT_MATERIALS, *MATERIALS, *_OF_THE_HISTOGRAM)


def preset(name: str, volume: Volume, materials: Sequence[str] | None = None) -> TransferFunction:
    """The preset `name` in the units of `volume`.

    Parameters
    ----------
    materials : sequence of str, optional
        Names of those of its materials that are to show; all, unless told.

    Raises
    ------
    InputError
        If there is no such preset; the message lists them. If it has no such materials; the message lists those.
        If the volume is of labels, which no preset is for.
    """
    _check_measured(name, volume)
    content = _content_of(name, volume)
    if content is not None:
        return TransferFunction.from_content(content, name, volume, materials)
    if materials is not None:
        asked = ", ".join(map(repr, materials))
        raise InputError(f"materials {asked} not found: the preset {name} has none")
    if name in _CT:
        hounsfield, fractions = _CT[name]
        if _is_hounsfield(volume):
            return _from_points(hounsfield, volume, "data", name)
        return _from_points(fractions, volume, "matter", name)
    return _from_points(_FRACTIONS[name] if name in _FRACTIONS else _ramp(name), volume, "matter", name)


def _check_measured(name: str, volume: Volume) -> None:
    if volume.labels and name in PRESETS:
        raise InputError(
            f"{volume.name}: the preset {name} needs measured values, got labels; "
            "without a transfer function each label has a colour"
        )


def _content_of(name: str, volume: Volume) -> dict[str, Any] | None:
    """A preset as a file would have it, or None if it is made of points alone."""
    if name not in PRESETS:
        raise InputError(f"preset {name!r} not found; known are {', '.join(PRESETS)}")
    if name in _OF_THE_HISTOGRAM:
        from texvol.scene.transfer import histogram

        chosen = {
            "histogram": histogram.content_for,
            "contours": histogram.contours_for,
            "boundaries": histogram.boundaries_for,
        }
        return chosen[name](volume)
    if name in CT_MATERIALS:
        hounsfield, fractions = CT_MATERIALS[name]
        return {"values": "data"} | hounsfield if _is_hounsfield(volume) else {"values": "matter"} | fractions
    return MATERIALS.get(name)


def proposed_for(volume: Volume) -> TransferFunction:
    """Transfer function for an unknown volume, the same object each time for the same volume.

    Labels get a colour each, see `label_function`. Samples with colours of their own keep them, and are the denser the
    brighter they are. Of other volumes the values above the background show, denser where they are larger.
    """
    found = _PROPOSED.get(volume)
    if found is None:
        found = _PROPOSED[volume] = _proposed(volume)
    return found


def _proposed(volume: Volume) -> TransferFunction:
    if volume.labels:
        from texvol.scene.transfer.labels import label_function

        return label_function(volume)
    if volume.colors is not None:
        return _from_points(_AS_IT_IS, volume, "data", "proposed")
    return _from_points(_PROPOSAL, volume, "matter", "proposed")


def proposed_beside(volume: Volume, number: int) -> TransferFunction:
    """Transfer function for one of several unknown volumes, in a hue that depends on its number."""
    proposed = proposed_for(volume)
    if volume.labels or volume.colors is not None:
        return proposed
    # As much lighter as the proposal is: its hue becomes another, its brightest point all but white.
    brightness = proposed.colors.max(axis=1, keepdims=True)
    whiteness = (proposed.colors.min(axis=1, keepdims=True) / brightness) ** 2
    hue = np.array(_HUES[number % len(_HUES)])
    colors = brightness * (hue * (1 - whiteness) + whiteness)
    return replace(proposed, colors=colors)


def _is_hounsfield(volume: Volume) -> bool:
    """True if the file says that the values are Hounsfield units, or their range is one of such.

    Who asks for a preset of CT says by that that it is one.
    """
    return hounsfield_by(volume) == "file" or hounsfield_range(volume)


def _from_points(points: list[Point], volume: Volume, values: str, name: str) -> TransferFunction:
    units = Units(volume, values, "box")
    positions, colors, extinctions = (np.array(column, np.float64) for column in zip(*points, strict=True))
    # In a range of no width rounding may put a point before the last one.
    values_of_points = np.maximum.accumulate(units.placed(positions))
    return TransferFunction(values_of_points, colors, extinctions * units.per_length, name=name)


def _ramp(name: str) -> list[Point]:
    """A perceptual colour map, 17 points, with an extinction that grows with the square of the fraction."""
    from cmap import Colormap

    from texvol.util.color import linear_from_srgb

    fractions = np.linspace(0, 1, 17)
    colors = linear_from_srgb(np.asarray(Colormap(name)(fractions))[:, :3])
    return [(float(s), tuple(c), 30 * float(s) ** 2) for s, c in zip(fractions, colors, strict=True)]
