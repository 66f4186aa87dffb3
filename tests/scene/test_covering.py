"""Labels that hide most of the others are faint in a first picture."""

from __future__ import annotations

import numpy as np
import pytest

from texvol import Volume
from texvol.scene.covering import covering_labels
from texvol.scene.looks import look_for

SIDE = 48
Z, Y, X = np.meshgrid(*[np.linspace(-1, 1, SIDE)] * 3, indexing="ij")
RADIUS = np.sqrt(X**2 + Y**2 + Z**2)
PARCELS = 20 + (np.floor(4 * (X + 1)) + 8 * np.floor(4 * (Y + 1)) + 64 * np.floor(4 * (Z + 1))).astype(int) % 40


def labels(values: np.ndarray) -> Volume:
    return Volume(values.astype(np.uint8), labels=True)


def atlas() -> np.ndarray:
    """Parcels in fluid, in bone, in skin."""
    return np.select([RADIUS < 0.6, RADIUS < 0.7, RADIUS < 0.8, RADIUS < 0.95], [PARCELS, 3, 2, 1])


def organ() -> np.ndarray:
    return np.select([np.abs(X - 0.2) + RADIUS < 0.5, RADIUS < 0.8], [2, 1])


def tissues() -> np.ndarray:
    return np.select([RADIUS < 0.5, RADIUS < 0.7, RADIUS < 0.9], [3, 2, 1])


FOUND = {"atlas": (atlas(), [1, 2, 3]), "organ with a tumour": (organ(), [1]), "three tissues": (tissues(), [1])}


@pytest.mark.parametrize("name", FOUND)
def test_outermost_labels_that_hide_the_others_are_covering(name: str) -> None:
    values, wanted = FOUND[name]
    assert [each.label for each in covering_labels(labels(values))] == wanted


def test_thickness_of_a_covering_label_is_its_mean_length_along_rays() -> None:
    """A shell of radii a < b is 4/3 (b³ - a³) / b² thick, in the mean over the rays that meet it."""
    values = np.select([RADIUS < 0.5, RADIUS < 0.9], [2, 1])
    (found,) = covering_labels(Volume(values.astype(np.uint8), (2.0, 2.0, 2.0), labels=True))
    half = 2.0 * (SIDE - 1) / 2  # world units of 1
    assert found.thickness == pytest.approx(4 / 3 * (0.9**3 - 0.5**3) / 0.9**2 * half, rel=0.03)


OPEN = {
    "parcels beside each other": np.where(RADIUS < 0.9, PARCELS, 0),
    "one label": (RADIUS < 0.9).astype(int),
    "two halves": np.select([(RADIUS < 0.9) & (X < 0), RADIUS < 0.9], [1, 2]),
    "an open box": np.select([(RADIUS < 0.5), (np.abs(X) > 0.8)], [2, 1]),
    "nothing": np.zeros(RADIUS.shape, int),
}


@pytest.mark.parametrize("name", OPEN)
def test_labels_that_leave_half_of_the_others_in_sight_are_not(name: str) -> None:
    assert covering_labels(labels(OPEN[name])) == []


def test_labels_that_are_clear_anyway_hide_nothing() -> None:
    assert [each.label for each in covering_labels(labels(atlas()), (0, 1, 2))] == [3]


def test_the_look_makes_them_faint_and_says_so() -> None:
    look = look_for(labels(atlas()))
    extinction = {label: float(look.transfer_function.at([label])[0, 3]) for label in (1, 2, 3, 30)}
    assert max(extinction[label] for label in (1, 2, 3)) < extinction[30] / 10
    assert min(extinction[label] for label in (1, 2, 3)) > 0
    assert "labels 1 … 3 are faint, since they hide others" in look.reason
    assert "faint" not in look_for(labels(OPEN["two halves"])).reason
