"""Lineage of a transfer function that the window shows: the look that it came from, and what was done to it since.

Range and opacity are kept apart from what they are applied to, so that the result is that of `--range` and `--opacity`
whatever way they were dragged before. The lineage of a transfer function is remembered as long as the transfer function
exists: undo, redo and a return to another scene find it again.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.transfer import PRESETS, TransferFunction, adjusting
from texvol.window.color_maps import MapChoice, Stop, color_at
from texvol.window.layers import Layers
from texvol.window.ranges import Ends

_LEAST_STRENGTH = 1e-12  # of a colour: black has no hue


@dataclass(frozen=True)
class Lineage:
    """Origin of a transfer function.

    Attributes
    ----------
    name : str
        Displayed name of the look: a preset, a file, or "own".
    changed : bool
        True if points, colours or opacities differ from those of the look; range and opacity factor do not count.
    materials, shown : of str
        Materials of a preset, and those of them that are shown.
    base : TransferFunction, optional
        Transfer function before range and factor were applied; None if they have not been.
    factor : float
        Factor of the base's extinction.
    colors : MapChoice, optional
        Colour map that the colours were taken from.
    layers : Layers, optional
        Layers that the transfer function was made from.
    """

    name: str
    changed: bool = False
    materials: tuple[str, ...] = ()
    shown: frozenset[str] = frozenset()
    base: TransferFunction | None = None
    factor: float = 1.0
    colors: MapChoice | None = None
    layers: Layers | None = None

    @property
    def title(self) -> str:
        """Name, with * if the look has been changed."""
        return f"{self.name} *" if self.changed else self.name


_KNOWN: WeakKeyDictionary[TransferFunction, Lineage] = WeakKeyDictionary()


def lineage_of(medium: TransferFunction) -> Lineage:
    """Return the lineage of a transfer function; of an unknown one it begins with its name."""
    if medium not in _KNOWN:
        name = os.path.basename(os.path.normpath(medium.name)) or "own"
        materials = medium.materials if name in PRESETS else ()
        _KNOWN[medium] = Lineage(name, materials=materials, shown=frozenset(materials))
    return _KNOWN[medium]


def remembered(medium: TransferFunction, lineage: Lineage) -> TransferFunction:
    """Return the transfer function, whose lineage is known from now on."""
    # A transfer function that its own lineage held would never be forgotten.
    _KNOWN[medium] = replace(lineage, base=None) if lineage.base is medium else lineage
    return medium


def layers_of(medium: TransferFunction) -> Layers:
    """Return the layers of a transfer function."""
    found = lineage_of(medium)
    if found.layers is None:
        layers = Layers.of(medium)
        remembered(medium, replace(found, layers=layers))
        return layers
    return found.layers


def edited(medium: TransferFunction, layers: Layers) -> TransferFunction:
    """Return the transfer function with other layers."""
    before = lineage_of(medium)
    lineage = replace(before, changed=True, base=None, factor=1.0, layers=layers)
    return remembered(layers.applied(medium), lineage)


def adjusted(medium: TransferFunction, ends: Ends | None = None, factor: float | None = None) -> TransferFunction:
    """Return the transfer function between other values, or with another factor of its base's extinction.

    The numbers are those of `--range` and `--opacity` on the transfer function that it was before either.

    Raises
    ------
    InputError
        If the values are too large.
    """
    before = lineage_of(medium)
    base = before.base or medium
    here = adjusting.ends(medium)
    ends = here if ends is None else ends
    factor = before.factor if factor is None else factor
    if (ends, factor) == (here, before.factor):
        return medium
    of_base = adjusting.ends(base)
    found = base if ends == of_base else adjusting.between(base, *ends)
    found = found if factor == 1 else adjusting.denser(found, factor)
    layers = layers_of(base)
    if medium.glows or factor == 0:
        layers = Layers.of(found)
    elif found is not base:
        to = ends

        def place(values: np.ndarray) -> np.ndarray:
            return values if to == of_base else adjusting.placed(values, of_base, to)

        layers = layers.mapped(place, factor)
    return remembered(found, replace(before, base=base, factor=factor, layers=layers))


def recolored(medium: TransferFunction, stops: tuple[Stop, ...], choice: MapChoice | None) -> TransferFunction:
    """Return the transfer function with the colours of stops at values, and with its opacity as it is."""
    before = replace(lineage_of(medium), changed=True, base=None, factor=1.0, colors=choice)
    if medium.emissive:
        found = _glowing(medium, stops)
        return remembered(found, replace(before, layers=Layers.of(found)))
    layers = layers_of(medium).with_palette(stops)
    found = layers.applied(medium)
    graded = tuple(
        replace(each, emissions=_colors(stops, each.values) * each.extinctions[:, np.newaxis]) for each in found.graded
    )
    contours = tuple(
        replace(each, emission=tuple((each.extinction * color_at(stops, each.value)).tolist()))
        for each in found.contours
    )
    return remembered(replace(found, graded=graded, contours=contours), replace(before, layers=layers))


def palette_of(medium: TransferFunction) -> tuple[Stop, ...]:
    """Return the colours of a transfer function as stops at values."""
    layers = layers_of(medium)
    return layers.palette or tuple((point.value, point.color) for point in layers.curve.points)


def _glowing(medium: TransferFunction, stops: tuple[Stop, ...]) -> TransferFunction:
    """Return an emissive transfer function in other hues: each value emits as strongly as before."""
    values = np.union1d(medium.values, [value for value, _ in stops])
    # A step keeps both its points.
    steps = medium.values[1:][np.diff(medium.values) == 0]
    values = np.sort(np.concatenate([values, steps]))
    sides = [(value, number and value == values[number - 1]) for number, value in enumerate(values)]
    numbers = np.array([_beside(medium, value, bool(right)) for value, right in sides])
    hues = _colors(stops, values)
    hues = np.where(hues.max(axis=1, keepdims=True) > _LEAST_STRENGTH, hues, 1.0)
    hues /= hues.max(axis=1, keepdims=True)
    strengths = numbers[:, :3].max(axis=1, keepdims=True)
    return replace(medium, values=values, colors=strengths * hues, extinctions=numbers[:, 3])


def _beside(medium: TransferFunction, value: float, right: bool) -> np.ndarray:
    """Return emission and extinction at a value; of a step, those of one side."""
    at = np.flatnonzero(medium.values == value)
    if at.size > 1:
        row = at[-1 if right else 0]
        return np.array([*medium.colors[row], medium.extinctions[row]])
    return np.asarray(medium.at(value))


def _colors(stops: tuple[Stop, ...], values: np.ndarray) -> np.ndarray:
    return np.array([color_at(stops, value) for value in values]).reshape(-1, 3)
