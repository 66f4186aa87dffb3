"""Values of measures, in world units and units of the data.

ruler    length |b - a|
angle    between a - v and c - v:  φ = atan2(|u × w|, u · w), which keeps its digits near 0° and 180°
box      lengths of the edges and their product; statistics of the samples of each volume inside
profile  values of each volume at n points at equal distances from a to b, trilinear
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene import label_names
from texvol.scene.label_counts import label_counts
from texvol.scene.large_volume import LargeVolume
from texvol.scene.measures.inside import labels_of_store, statistics_inside
from texvol.scene.measures.measure import MOST_SAMPLES, Measure, called
from texvol.scene.sampling import sampled
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import check_type

_MOST_BY_DEFAULT = 2001  # points of a profile


class Quantity(NamedTuple):
    """Number with its unit, of the whole scene, of a volume, or of a label of a volume."""

    what: str
    value: float
    unit: str = ""
    volume: str = ""
    label: int | None = None
    label_name: str = ""


@dataclass(frozen=True, eq=False)
class Profile:
    """Values along a line.

    Attributes
    ----------
    distances : array of shape (n)
        Distances from the first point, world units.
    points : array of shape (n, 3)
        World positions.
    values : array of shape (volumes, n)
        NaN outside a volume.
    volumes, units : tuple of str
        Names of the volumes, and units of their values.
    """

    distances: NDArray[np.float64]
    points: NDArray[np.float64]
    values: NDArray[np.float64]
    volumes: tuple[str, ...]
    units: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Measured:
    """Measure with its values.

    Attributes
    ----------
    name, kind : str
        Kind is that of the measure, or "labels".
    measure : Measure, optional
    quantities : tuple of Quantity
    profile : Profile, optional
    """

    name: str
    kind: str
    quantities: tuple[Quantity, ...]
    measure: Measure | None = None
    profile: Profile | None = None

    def value(self, what: str, volume: str = "", label: int | None = None) -> float:
        """Return the value of a quantity by its name, such as "length" or "mean"; KeyError if there is none."""
        for each in self.quantities:
            if each.what == what and each.volume == volume and each.label == label:
                return each.value
        raise KeyError(what)


def measure(scene: Scene | Volume | Sequence[Volume], measures: Iterable[Measure]) -> tuple[Measured, ...]:
    """Return the values of measures in a scene, a volume, or several volumes of one world."""
    measures = tuple(measures)
    volumes = scene.volumes if isinstance(scene, Scene) else (scene,) if isinstance(scene, Volume) else tuple(scene)
    for each in measures:
        check_type("measures", each, Measure)
    names = called(measures)
    return tuple(measured(volumes, each, name) for each, name in zip(measures, names, strict=True))


def measured(volumes: Sequence[Volume], each: Measure, name: str) -> Measured:
    """Return the values of a measure; the world's unit is that of the first volume."""
    unit = volumes[0].unit
    quantities, profile = list(own_quantities(each, unit)), None
    if each.kind == "box":
        for volume, called_as in zip(volumes, names_of(volumes), strict=True):
            quantities += _statistics(volume, called_as, each, unit)
    elif each.kind == "profile":
        profile = profile_of(volumes, each)
    return Measured(name, each.kind, tuple(quantities), each, profile)


def measured_labels(volumes: Sequence[Volume]) -> tuple[Measured, ...]:
    """Return the number of samples and the volume of each label, for each volume of labels."""
    found = []
    for volume, name in zip(volumes, names_of(volumes), strict=True):
        if not volume.labels:
            continue
        quantities = _of_labels(volume, name, _numbers_of_labels(volume), volumes[0].unit)
        found.append(Measured(name, "labels", tuple(quantities)))
    return tuple(found)


def _numbers_of_labels(volume: Volume) -> Mapping[int, int]:
    if isinstance(volume, LargeVolume):
        return labels_of_store(volume)
    counts = label_counts(volume)
    return dict(zip(counts.labels.tolist(), counts.counts.tolist(), strict=True))


def _of_labels(volume: Volume, name: str, numbers: Mapping[int, int], unit: str) -> list[Quantity]:
    """Return the number of samples and the volume of each label."""
    one, called, quantities = sample_volume(volume), label_names.names_of(volume, numbers), []
    for label, count in numbers.items():
        of_label = name, label, called.get(label, "")
        quantities.append(Quantity("samples", count, "", *of_label))
        quantities.append(Quantity("volume", count * one, cubed(unit), *of_label))
    return quantities


def own_quantities(each: Measure, unit: str) -> tuple[Quantity, ...]:
    """Return the quantities that need the points alone."""
    points = np.array(each.points)
    if each.kind == "angle":
        return (Quantity("angle", angle(points), "°"),)
    if each.kind == "box":
        edges = np.abs(points[1] - points[0])
        sizes = (Quantity(f"size {axis}", float(edge), unit) for axis, edge in zip("xyz", edges, strict=True))
        return (Quantity("volume", float(np.prod(edges)), cubed(unit)), *sizes)
    return (Quantity("length", float(np.linalg.norm(points[1] - points[0])), unit),)


def angle(points: NDArray[np.float64]) -> float:
    """Return the angle at the second of three points, in degrees; NaN if another point is the same as it."""
    arms = points[[0, 2]] - points[1]
    lengths = np.linalg.norm(arms, axis=1)
    if not (lengths > 0).all():
        return float("nan")
    first, second = arms / lengths[:, np.newaxis]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second)))


def profile_of(volumes: Sequence[Volume], each: Measure) -> Profile:
    """Return the values of all volumes along a line."""
    start, end = np.array(each.points)
    length = float(np.linalg.norm(end - start))
    count = each.samples or default_samples(volumes, length)
    fractions = np.linspace(0.0, 1.0, count)
    points = start * (1 - fractions[:, np.newaxis]) + end * fractions[:, np.newaxis]
    values = np.stack([sampled(volume, points) for volume in volumes])
    units = tuple(volume.value_unit for volume in volumes)
    return Profile(fractions * length, points, values, names_of(volumes), units)


def default_samples(volumes: Sequence[Volume], length: float) -> int:
    """Return a number of points so that they are no farther apart than samples of the finest volume are on average."""
    apart = min(float(volume.spacing.mean()) for volume in volumes)
    return int(np.clip(np.ceil(min(length / apart, MOST_SAMPLES)) + 1, 2, _MOST_BY_DEFAULT))


def sample_volume(volume: Volume) -> float:
    """Return the volume of a sample, |det| of the step from sample to sample, in cubed world units."""
    return float(abs(np.linalg.det(volume.direction)) * np.prod(volume.spacing))


def names_of(volumes: Sequence[Volume]) -> tuple[str, ...]:
    """Return the file names of volumes; of equal names the later ones get a number."""
    names: list[str] = []
    for volume in volumes:
        name = os.path.basename(os.path.normpath(volume.name)) or volume.name
        before = sum(each == name or each.startswith(f"{name} (") for each in names)
        names.append(f"{name} ({before + 1})" if before else name)
    return tuple(names)


def cubed(unit: str) -> str:
    """Return the unit of a volume."""
    if not unit:
        return ""
    return f"{unit}³" if unit.isalpha() else f"({unit})³"


def _statistics(volume: Volume, name: str, each: Measure, world_unit: str) -> list[Quantity]:
    """Return the statistics of a volume inside a box; of labels their numbers of samples and volumes."""
    low, high = np.sort(np.array(each.points), axis=0)
    found = statistics_inside(volume, low, high)
    samples = Quantity("samples", found.count, "", name)
    if volume.labels:
        return [samples, *_of_labels(volume, name, found.labels, world_unit)]
    missing = [Quantity("missing samples", found.missing, "", name)] if found.missing else []
    numbers = {"mean": found.mean, "standard deviation": found.deviation, "min": found.lowest, "max": found.highest}
    return [samples, *missing, *(Quantity(what, number, volume.value_unit, name) for what, number in numbers.items())]
