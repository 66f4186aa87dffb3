"""The adaptive estimator takes 26 neighbours where there is but noise, and 6 where something bends."""

from __future__ import annotations

import numpy as np
import pytest
from support.directions import angles, positions

from texvol.scene.gradient import CENTRAL, Estimator, gradients
from texvol.scene.volume import Volume

ZUCKER_HUMMEL, ADAPTIVE = Estimator("zucker-hummel"), Estimator("adaptive")


def cube(noise: float) -> tuple[Volume, np.ndarray, np.ndarray]:
    """A turned cube of soft faces, the normals of its faces, and where they are compared."""
    place = positions((40, 40, 40)) - 19.5
    turned = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    in_cube = place @ turned
    farthest = np.abs(in_cube).max(axis=-1)
    normals = (np.abs(in_cube) == farthest[..., np.newaxis]) * np.sign(in_cube) @ turned.T
    values = 100 * np.clip((11 - farthest) / 4 + 0.5, 0, 1)
    values += np.random.default_rng(1).normal(0, 1, values.shape) * noise
    return Volume(values), normals, np.abs(farthest - 11) < 0.7


@pytest.mark.parametrize("noise", [1.0, 2.0])
def test_adaptive_is_better_than_either_at_edges_with_some_noise(noise: float) -> None:
    volume, normals, near = cube(noise)
    errors = [
        np.sqrt((angles(-gradients(volume, each)[near], normals[near]) ** 2).mean())
        for each in (CENTRAL, ZUCKER_HUMMEL, ADAPTIVE)
    ]
    assert errors[2] < min(errors[:2]) and errors[2] < 0.98 * max(errors[:2])


def test_adaptive_is_one_of_both_at_each_sample() -> None:
    volume, _, near = cube(2.0)
    of_6, of_26, chosen = (gradients(volume, each) for each in (CENTRAL, ZUCKER_HUMMEL, ADAPTIVE))
    is_6, is_26 = ((chosen == each).all(axis=-1) for each in (of_6, of_26))
    assert (is_6 | is_26).all()
    # Where nothing bends there is but noise; on the faces' rims there is more.
    inside = np.zeros(near.shape, bool)
    inside[16:24, 16:24, 16:24] = True
    assert is_26[inside].mean() > 0.95 and 0.1 < is_6[near].mean() < 0.9
