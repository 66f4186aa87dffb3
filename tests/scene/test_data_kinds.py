"""Kinds of data: what a volume of which nothing is said is taken for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from texvol import Volume
from texvol.scene.kinds import as_labels, kind_of
from texvol.scene.transfer.units import typical_samples

SIDE = 32
RANDOM = np.random.default_rng(7)
Z, Y, X = np.meshgrid(*[np.linspace(-1, 1, SIDE)] * 3, indexing="ij")
RADIUS = np.sqrt(X**2 + Y**2 + Z**2)
NOISE = RANDOM.normal(size=RADIUS.shape)
RAS = "right-anterior-superior"


def head() -> np.ndarray:
    """Air with noise, a broad medium, and few samples that are far brighter."""
    tissue = 300 + 150 * np.abs(NOISE) + 900 * (RADIUS < 0.25)
    return np.where(RADIUS < 0.7, tissue, np.abs(8 * NOISE))


def ct() -> np.ndarray:
    """Air, water and bone in Hounsfield units."""
    return np.select([RADIUS < 0.3, RADIUS < 0.7], [1200, 40], -1000) + 20 * NOISE


def tissues(levels: int) -> np.ndarray:
    """Nested balls, each of a number that has nothing to do with its neighbour's."""
    numbers = np.array([0, *RANDOM.permutation(np.arange(1, levels))])
    cells = (np.floor(4 * (X + 1)) + 8 * np.floor(4 * (Y + 1)) + 64 * np.floor(4 * (Z + 1))).astype(int)
    return np.where(RADIUS < 0.9, numbers[cells % (levels - 1) + 1], 0)


SEEN: dict[str, tuple[Any, dict[str, str], str]] = {
    "Hounsfield units": (ct().astype(np.int16), {}, "CT"),
    "Hounsfield units as float": (ct().astype(np.float32), {"value_unit": "HU"}, "CT"),
    "CT in bytes": (np.clip((ct() + 1000) / 10, 0, 255).astype(np.uint8), {}, "measured"),
    "a head in a space of the body": (head().astype(np.int16), {"space": RAS}, "MR"),
    "a head as float in 0 to 1": ((head() / head().max()).astype(np.float32), {"space": RAS}, "MR"),
    "a head nowhere": (head().astype(np.int16), {}, "measured"),
    "a field with nothing around": (np.where(RADIUS < 0.9, 3 - X, np.nan).astype(np.float32), {}, "field"),
    "a field with nothing around but below": (np.where((RADIUS < 0.9) | (Z < -0.9), 9 + Z, np.nan), {}, "field"),
    "a negative of a head": ((2000 - head()).astype(np.int16), {"space": RAS}, "dark"),
    "a negative in bytes": ((255 - np.clip((ct() + 1000) / 10, 0, 255)).astype(np.uint8), {}, "dark"),
    "a dark ball in transmitted light": ((1e-3 * (9 - np.exp(-8 * RADIUS**2))).astype(np.float32), {}, "dark"),
    "a mask whose object is 0": (np.where(RADIUS < 0.5, 0, 255).astype(np.uint8), {}, "dark"),
    "labels with a large one outside": (np.where(RADIUS < 0.9, tissues(30), 255).astype(np.uint8), {}, "labels"),
    "a bright block with pores": (np.where(NOISE > 1, 20, 200 + 40 * RADIUS**2 / 3).astype(np.uint8), {}, "measured"),
    "labels": (tissues(30).astype(np.uint8), {}, "labels"),
    "labels as float": (tissues(12).astype(np.float32), {}, "labels"),
    "large labels": ((tissues(20) * 100).astype(np.uint16), {}, "labels"),
    "three tissues": (np.digitize(RADIUS, [0.3, 0.6, 0.9]).astype(np.uint8), {}, "labels"),
    "a mask of 255": (np.where(RADIUS < 0.5, 255, 0).astype(np.uint8), {}, "labels"),
    "a ramp of few numbers": (np.broadcast_to(np.arange(8)[:, None, None], (8, 9, 10)), {}, "measured"),
    "noise in bytes": (np.clip(40 + 10 * NOISE, 0, 255).astype(np.uint8), {}, "field"),
    "a part of a body in bytes": (np.clip(40 + 10 * NOISE, 0, 255).astype(np.uint8), {"space": RAS}, "measured"),
    "few levels of a smooth field": ((20 * RADIUS).astype(np.uint8), {}, "field"),
    "few counts of photons": (RANDOM.poisson(3, RADIUS.shape).astype(np.uint16), {}, "measured"),
    "few levels of a steep field": ((1000 * np.floor(6 * np.exp(-3 * RADIUS**2))).astype(np.uint16), {}, "measured"),
    "a signed distance": ((RADIUS - 0.5).astype(np.float32), {}, "distance"),
    "a narrow band of a distance": (np.clip(RADIUS - 0.5, -0.2, 0.2).astype(np.float32), {}, "distance"),
    "a distance that is positive inside": (np.rint(300 * (0.5 - RADIUS)).astype(np.int16), {}, "distance"),
    "a tilted ramp": ((X + Y).astype(np.float32), {}, "signed"),
    "a wave": ((np.sin(6 * X) * np.exp(-RADIUS)).astype(np.float32), {}, "signed"),
    "a vortex that is stronger on one side": ((X + 0.15) * np.exp(-4 * RADIUS), {}, "signed"),
    "a scaled image": ((2 * (head() / head().max()) - 1).astype(np.float32), {}, "measured"),
    "a density of a molecule": ((np.exp(-4 * RADIUS) + 0.3 * NOISE).astype(np.float32), {"unit": "Å"}, "measured"),
    "a field that fills its box": ((0.6 + 0.2 * np.sin(3 * X + Y) + 0.05 * NOISE).astype(np.float32), {}, "field"),
    "a density": (np.exp(-4 * RADIUS).astype(np.float32), {}, "measured"),
    "a stain under a microscope": (
        (3e4 * np.exp(-30 * RADIUS**2) + 60 * np.abs(NOISE)).astype(np.uint16), {"unit": "µm"}, "fluorescence"
    ),
    "a constant": (np.full((4, 4, 4), 7.0), {}, "constant"),
    "only NaN": (np.full((4, 4, 4), np.nan), {}, "constant"),
    "one sample": (np.ones((1, 1, 1), np.uint8), {}, "constant"),
    "two samples": (np.array([[[0.0, 1.5]]]), {}, "measured"),
    "values near the largest": (RADIUS * 1e308, {}, "field"),
}  # fmt: skip


@pytest.mark.parametrize("name", SEEN)
def test_a_volume_is_taken_for_what_it_is(name: str) -> None:
    values, told, wanted = SEEN[name]
    kind = kind_of(Volume(values, **told))
    assert kind.name == wanted
    assert kind.reason


@pytest.mark.parametrize("name", ["a wave", "a head in a space of the body", "labels as float"])
def test_missing_samples_change_nothing_but_labels(name: str) -> None:
    """NaN is no label; a field with NaN is what it would be without."""
    values, told, wanted = SEEN[name]
    values = values.astype(np.float32)
    values[:2] = np.nan
    assert kind_of(Volume(values, **told)).name == (wanted if wanted != "labels" else "measured")


def test_what_a_file_says_goes_before_what_values_look_like() -> None:
    assert kind_of(Volume(tissues(30).astype(np.int32), labels=True)).reason == "its values are labels"
    assert kind_of(Volume(tissues(30), value_unit="HU")).name == "CT"
    colors = np.zeros((*RADIUS.shape, 3))
    assert kind_of(Volume(tissues(30), colors=colors)).name == "colours"


def test_a_volume_as_labels_is_one_object_in_the_same_place() -> None:
    volume = Volume(tissues(9), (1, 2, 3), (4, 5, 6), source={"path": "a.nii"})
    labels = as_labels(volume)
    assert labels is as_labels(volume) and labels is as_labels(labels)
    assert labels.labels and not volume.labels
    assert labels.source == {"path": "a.nii", "labels": True}
    np.testing.assert_array_equal(
        labels.corners_from_centre + labels.centre, volume.corners_from_centre + volume.centre
    )
    assert np.shares_memory(labels.values, volume.values)


def test_what_is_in_the_middle_of_powers_of_two_is_seen() -> None:
    """A stride would stay on a plane of it, x + z = y, and find zeros only."""
    values = np.zeros((256, 256, 256), np.uint8)
    values[96:160, 96:160, 96:160] = 200
    fraction = float((typical_samples(Volume(values)) > 0).mean())
    assert abs(fraction - 1 / 64) < 4 * np.sqrt(1 / 64 / 65536)
