"""Presets, and a transfer function for a volume of which nothing is known.

A preset's extinction is per mean edge of the volume's box, so that it looks the same on a tooth and on a thorax. The
CT presets are in Hounsfield units where the volume's range is that of such data; elsewhere, and in all other presets,
values are fractions of the range that holds the medium: from where the background ends to the 99.9th percentile.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.air import hounsfield_range, is_told_hounsfield
from texvol.scene.channel import Channel
from texvol.scene.transfer import color_maps, histogram, two_signs
from texvol.scene.transfer.function import TransferFunction
from texvol.scene.transfer.labels import label_function
from texvol.scene.transfer.units import Units, medium_range, typical_samples
from texvol.scene.volume import Volume
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError
from texvol.util.statistics import percentile_of_sorted
from texvol.util.suggestions import did_you_mean

Triple = tuple[float, float, float]
Point = tuple[float, Triple, float]  # value, linear colour, extinction per mean edge of the box

# Points in Hounsfield units, and in fractions of the medium's range for rescaled or 8-bit CT.
_CT: dict[str, list[tuple[float, float, Triple, float]]] = {
    "ct-bone": [
        (150, 0.38, (0.45, 0.10, 0.04), 0),
        (250, 0.48, (0.75, 0.42, 0.22), 12),
        (500, 0.65, (0.90, 0.78, 0.58), 60),
        (1200, 1.00, (1.00, 0.97, 0.90), 200),
    ],
    "ct-soft-tissue": [
        (-150, 0.05, (0.60, 0.25, 0.10), 0),
        (-60, 0.20, (0.75, 0.42, 0.20), 2),
        (20, 0.30, (0.62, 0.16, 0.10), 8),
        (90, 0.42, (0.80, 0.30, 0.20), 12),
        (200, 0.60, (0.95, 0.80, 0.62), 40),
        (1000, 1.00, (1.00, 0.97, 0.90), 120),
    ],
    "ct-lung": [
        (-950, 0.02, (0.05, 0.10, 0.35), 0),
        (-850, 0.06, (0.15, 0.35, 0.75), 1.5),
        (-650, 0.14, (0.45, 0.70, 0.90), 4),
        (-450, 0.22, (0.90, 0.55, 0.45), 10),
        (-300, 0.28, (0.80, 0.25, 0.18), 1),
        (100, 0.45, (0.60, 0.20, 0.15), 0.6),
        (300, 0.70, (1.00, 0.95, 0.85), 25),
    ],
}

_FRACTIONS: dict[str, list[Point]] = {
    "mr": [
        (0.08, (0.20, 0.05, 0.04), 0),
        (0.25, (0.40, 0.12, 0.08), 6),
        (0.50, (0.74, 0.38, 0.28), 50),
        (0.75, (0.95, 0.78, 0.64), 140),
        (1.00, (1.00, 0.98, 0.92), 300),
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

_Ramp = tuple[float, float] | None  # values between which a material rises, and the one before it falls
# Named materials, with the ramp in Hounsfield units and in fractions of the medium's range.
_CT_MATERIALS: dict[str, list[tuple[str, _Ramp, _Ramp, Triple, float]]] = {
    "ct-tissues": [
        ("air", None, None, (0, 0, 0), 0),
        ("fat", (-150, -120), (0.05, 0.12), (0.90, 0.70, 0.10), 3),
        ("soft tissue", (-40, 0), (0.24, 0.30), (0.75, 0.12, 0.10), 6),
        ("bone", (100, 250), (0.44, 0.60), (1, 1, 1), 80),
    ],
    # Skin is where a sample is part air, part what it covers; fat and muscle leave a view of the bone.
    "ct-materials": [
        ("air", None, None, (0, 0, 0), 0),
        ("skin", (-650, -400), (0.00, 0.05), (0.70, 0.36, 0.22), 2),
        ("fat", (-200, -140), (0.10, 0.14), (0.85, 0.62, 0.22), 1),
        ("muscle", (-50, -10), (0.22, 0.27), (0.60, 0.08, 0.06), 3),
        ("bone", (110, 190), (0.42, 0.52), (0.92, 0.80, 0.60), 60),
        ("dense bone", (600, 1100), (0.72, 0.85), (1.00, 0.98, 0.92), 200),
    ],
}
_MATERIALS: dict[str, list[tuple[str, _Ramp, Triple, float]]] = {
    # T1-weighted, where fluid is dark and white matter bright.
    "mr-materials": [
        ("fluid", (0.04, 0.12), (0.10, 0.24, 0.50), 2),
        ("grey matter", (0.32, 0.44), (0.62, 0.30, 0.24), 14),
        ("white matter", (0.66, 0.74), (0.92, 0.84, 0.70), 50),
        ("bright", (0.92, 1.00), (1.00, 0.80, 0.30), 60),
    ],
}

# Table 5-1 of Paiva, Seixas, Gattass (1999): first value of 8 bits, the one behind the last, 8-bit sRGB, opacity. The
# table gives no length for its opacities: here it is the smallest spacing of samples.
_TABLE_5_1 = (
    ("fat", 30, 90, (255, 200, 20), 0.2),
    ("tissue", 190, 230, (255, 80, 60), 0.8),
    ("bone", 230, None, (255, 255, 255), 1.0),
)

_OF_THE_HISTOGRAM = {
    "histogram": histogram.content_for,
    "contours": histogram.contours_for,
    "boundaries": histogram.boundaries_for,
}

_PROPOSAL: list[Point] = [
    (0.00, (0.25, 0.04, 0.02), 0),
    (0.30, (0.60, 0.16, 0.06), 3),
    (0.60, (0.90, 0.52, 0.22), 12),
    (1.00, (1.00, 0.95, 0.82), 50),
]

# Of measured values in light, which shows surfaces where an unlit medium has to be seen through. Where half of the
# medium lies below `_DARK` of its range, the values are lower by up to `_LOWERED`: what is fine and faint shows.
_SURFACES: list[Point] = [
    (0.15, (0.30, 0.06, 0.03), 0),
    (0.45, (0.62, 0.22, 0.10), 4),
    (0.60, (0.85, 0.55, 0.30), 60),
    (0.90, (1.00, 0.95, 0.84), 300),
]

_DARK, _LOWERED = (0.05, 0.3), 0.45
_THIN = 0.25  # of the mean edge: a box with a shorter one is as opaque from its broad side as one that has this

# Of a solid, extinction per mean edge of the box.
_SOLID_COLOR, _SOLID_EXTINCTION = (0.92, 0.74, 0.54), 600.0

# Of samples that have a colour of their own: white leaves it as it is; as dense as the above.
_AS_IT_IS: list[Point] = [(0.0, (1.0, 1.0, 1.0), 0), (1.0, (1.0, 1.0, 1.0), 50)]

# Of volumes beside the first, which is reddish: far from it and from each other.
_HUES = ((0.1, 0.65, 1.0), (0.2, 1.0, 0.25), (1.0, 0.2, 0.9), (1.0, 0.9, 0.1))

# Of channels that emit, per mean edge of the box. The emission is such that hardly a line through the volume would be
# brighter than `_WHITE` without absorption, which is a fraction of the emission, so that what lies behind shows.
_WHITE, _LEAST_GLOW, _MOST_GLOW, _ABSORPTION = 1.1, 2.0, 40.0, 0.25
_WHITE_BEYOND = 99.0  # percentile of the lines that show anything
_SHOWS = 0.02  # of the brightest line
_PROJECTED = 1 << 20  # samples

_PROPOSED: WeakKeyDictionary[Volume, TransferFunction] = WeakKeyDictionary()

_DIVERGING, _FLUORESCENCE = "diverging", "fluorescence"

PRESETS: tuple[str, ...] = (
    *(*_CT, *_FRACTIONS, *_RAMPS, *_CT_MATERIALS, *_MATERIALS),
    *("table-5-1", *_OF_THE_HISTOGRAM, _DIVERGING, _FLUORESCENCE),
)


def preset(name: str, volume: Volume, materials: Sequence[str] | None = None) -> TransferFunction:
    """The preset or colour map `name` in the units of `volume`.

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
    if not is_named(name):
        if os.path.isfile(name):
            raise InputError(f"preset {name!r} not found: texvol.load_look({name!r}, volume) reads a file")
        raise InputError(f"preset {name!r} not found; known are {', '.join(PRESETS)}{did_you_mean(name, PRESETS)}")
    if volume.labels:
        raise InputError(
            f"{volume.name}: the preset {name} needs measured values, got labels; "
            "without a transfer function each label has a colour"
        )
    content = _content_of(name, volume)
    if content is not None:
        return TransferFunction.from_content(content, name, volume, materials)
    if materials is not None:
        raise InputError(f"materials {', '.join(map(repr, materials))} not found: the preset {name} has none")
    if name == _DIVERGING:
        return _from_points(two_signs.points_of(volume), volume, "data", name)
    if name == _FLUORESCENCE:
        return replace(channel_function(volume, Channel(1)), name=name)
    if name not in PRESETS:
        return _from_points(color_maps.ramp(name), volume, "matter", name)
    if name not in _CT:
        return _from_points(_FRACTIONS[name] if name in _FRACTIONS else _ramp(name), volume, "matter", name)
    in_hounsfield = _is_hounsfield(volume)
    points: list[Point] = [
        (value if in_hounsfield else fraction, color, extinction) for value, fraction, color, extinction in _CT[name]
    ]
    return _from_points(points, volume, "data" if in_hounsfield else "matter", name)


def is_named(name: str) -> bool:
    """True if `name` is a preset, or a colour map of the library of colour maps."""
    return name in PRESETS or color_maps.is_color_map(name)


def _content_of(name: str, volume: Volume) -> dict[str, Any] | None:
    """A preset as a file would have it, or None if it is made of points alone."""
    if name in _OF_THE_HISTOGRAM:
        return _OF_THE_HISTOGRAM[name](volume)
    if name == "table-5-1":
        return _content_of_table(volume)
    if name in _MATERIALS:
        return _content_of_materials(_MATERIALS[name], "matter")
    if name not in _CT_MATERIALS:
        return None
    in_hounsfield = _is_hounsfield(volume)
    rows = [
        (each, ramp if in_hounsfield else fractions, color, extinction)
        for each, ramp, fractions, color, extinction in _CT_MATERIALS[name]
    ]
    return _content_of_materials(rows, "data" if in_hounsfield else "matter")


def _content_of_materials(rows: Sequence[tuple[str, _Ramp, Triple, float]], values: str) -> dict[str, Any]:
    """Materials as a file has them; each falls where the next one rises."""
    falls = [*(ramp for _, ramp, _, _ in rows[1:]), None]
    materials = []
    for (name, rise, color, extinction), fall in zip(rows, falls, strict=True):
        ends = {key: list(ramp) for key, ramp in (("from", rise), ("to", fall)) if ramp is not None}
        materials.append({"name": name, **ends, "color": list(color), "extinction": extinction})
    return {"values": values, "length": "box", "materials": materials}


def _content_of_table(volume: Volume) -> dict[str, Any]:
    """Table 5-1 as a file has it; the range of values that are not of 8 bits stands for 0 to 255."""
    in_bytes = volume.dtype == np.uint8
    materials = []
    for name, first, behind, color, opacity in _TABLE_5_1:
        ends = {"from": first, "to": behind} if behind else {"from": first}
        steps = {key: [value if in_bytes else value / 255] * 2 for key, value in ends.items()}
        linear = [float(each) for each in linear_from_srgb(np.array(color) / 255)]
        materials.append({"name": name, **steps, "color": linear, "opacity": opacity})
    return {"values": "data" if in_bytes else "range", "length": "spacing", "materials": materials}


def proposed_for(volume: Volume) -> TransferFunction:
    """Transfer function for an unknown volume, the same object each time for the same volume.

    Labels get a colour each, see `label_function`. A channel of several emits its own colour. Samples with colours of
    their own keep them, and are the denser the brighter they are. Of other volumes the values above the background
    show, denser where they are larger.
    """
    if volume not in _PROPOSED:
        if volume.labels:
            _PROPOSED[volume] = label_function(volume)
        elif volume.colors is not None:
            _PROPOSED[volume] = _from_points(_AS_IT_IS, volume, "data", "proposed")
        elif channel := getattr(volume, "channel", None):
            _PROPOSED[volume] = channel_function(volume, channel)
        else:
            _PROPOSED[volume] = _from_points(_PROPOSAL, volume, "matter", "proposed")
    return _PROPOSED[volume]


def proposed_in_light(volume: Volume) -> TransferFunction:
    """Transfer function for a volume of measured values of which nothing is known, in light."""
    samples = typical_samples(volume)
    largest = max(float(np.abs(samples).max()), 1e-300)
    low, high = (end / largest for end in medium_range(volume))
    medium = samples[samples / largest > low] / largest
    typical = (float(medium[medium.size // 2]) - low) / (high - low) if medium.size and high > low else 1.0
    lower = 1 - _LOWERED * float(np.interp(typical, _DARK, (1.0, 0.0)))
    edges = np.linalg.norm(volume.box_edges, axis=0)
    dense = max(float(edges.mean() / edges.min()) * _THIN, 1.0)
    points = [(lower * value, color, dense * extinction) for value, color, extinction in _SURFACES]
    return _from_points(points, volume, "matter", "proposed")


def solid_inside(volume: Volume, depth: float) -> TransferFunction:
    """Transfer function of a solid of one colour, clear at the value 0 and dense from the value `depth` on."""
    ends = sorted([(depth, _SOLID_EXTINCTION), (0.0, 0.0)])
    return _from_points([(value, _SOLID_COLOR, extinction) for value, extinction in ends], volume, "data", "solid")


def channel_function(volume: Volume, channel: Channel) -> TransferFunction:
    """Emission in the colour of one of several channels, from 0 at the start of its window to bright at its end.

    It is exposed so that what is thick is not burnt out and what is fine shows.
    A window as wide as the type of the samples says nothing; the range of the medium stands for it, and a hue by the
    channel's number for a colour that is not told.
    """
    window = channel.window
    if window is not None and volume.dtype.kind in "iu":
        limits = np.iinfo(volume.dtype)
        window = None if window[0] <= limits.min and window[1] >= limits.max else window
    color = np.array(_HUES[channel.number % len(_HUES)] if channel.color is None else channel.color)
    units = Units(volume, "matter", "box")
    ends = units.placed(np.array([0.0, 1.0])) if window is None else np.array(window)
    glow = _exposed(volume, float(ends[0]), float(ends[1])) * units.per_length
    return TransferFunction(
        ends,
        np.outer([0.0, glow], color),
        np.array([0.0, _ABSORPTION * glow]),
        emissive=True,
        name=channel.name or f"channel {channel.number}",
    )


def _exposed(volume: Volume, low: float, high: float) -> float:
    """Return the emission at the end of a window, per mean edge, that takes the brightest lines to white."""
    values = volume.overview.values
    step = max(int(np.ceil((values.size / _PROJECTED) ** (1 / 3))), 1)
    few = values[tuple(slice(None, None, min(step, max(count // 4, 1))) for count in values.shape)].astype(np.float64)
    with np.errstate(over="ignore"):  # far beyond a narrow window is as bright as its end
        shown = np.clip((np.nan_to_num(few, nan=low) - low) / max(high - low, 1e-300), 0.0, 1.0)
    edges = np.linalg.norm(volume.box_edges, axis=0)
    brightest = []
    for axis, edge in zip((2, 1, 0), edges / edges.mean(), strict=True):
        lines = np.sort(shown.mean(axis=axis), axis=None) * edge
        lines = lines[lines > _SHOWS * lines[-1]]
        brightest.append(float(percentile_of_sorted(lines, _WHITE_BEYOND)) if lines.size else 1e-9)
    # Between the views along what is flat, and from its broad side.
    return float(np.clip(_WHITE / np.sqrt(min(brightest) * max(brightest)), _LEAST_GLOW, _MOST_GLOW))


def proposed_beside(volume: Volume, number: int) -> TransferFunction:
    """Transfer function for one of several unknown volumes, in a hue that depends on its number."""
    proposed = proposed_for(volume)
    if volume.labels or volume.colors is not None or getattr(volume, "channel", None):
        return proposed
    # As much lighter as the proposal is: its hue becomes another, its brightest point all but white.
    brightness = proposed.colors.max(axis=1, keepdims=True)
    whiteness = (proposed.colors.min(axis=1, keepdims=True) / brightness) ** 2
    hue = np.array(_HUES[number % len(_HUES)])
    colors = brightness * (hue * (1 - whiteness) + whiteness)
    return replace(proposed, colors=colors)


def _is_hounsfield(volume: Volume) -> bool:
    """True if the file says that the values are Hounsfield units, or their range is one, as a preset of CT suggests."""
    return is_told_hounsfield(volume) or hounsfield_range(volume)


def _from_points(points: list[Point], volume: Volume, values: str, name: str) -> TransferFunction:
    units = Units(volume, values, "box")
    positions, colors, extinctions = (np.array(column, np.float64) for column in zip(*points, strict=True))
    # In a range of no width rounding may put a point before the last one.
    values_of_points = np.maximum.accumulate(units.placed(positions))
    return TransferFunction(values_of_points, colors, extinctions * units.per_length, name=name)


def _ramp(name: str) -> list[Point]:
    """A perceptual colour map, 17 points, with an extinction that grows with the square of the fraction."""
    from cmap import Colormap

    fractions = np.linspace(0, 1, 17)
    colors = linear_from_srgb(np.asarray(Colormap(name)(fractions))[:, :3])
    return [(float(s), tuple(c), color_maps.extinction(float(s))) for s, c in zip(fractions, colors, strict=True)]
