"""Quaternions: rotations of frames, their products and logarithms, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.scene import quaternions


def frames() -> list[np.ndarray]:
    """Random frames, and those of half turns, where three of the four components may be 0."""
    rng = np.random.default_rng(0)
    found = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(50)]
    found = [each * np.sign(np.linalg.det(each)) for each in found]
    return [*found, np.eye(3), *(np.diag(signs) for signs in ((1.0, -1, -1), (-1.0, 1, -1), (-1.0, -1, 1)))]


def test_a_frame_is_its_rotation() -> None:
    for axes in frames():
        np.testing.assert_allclose(quaternions.to_axes(quaternions.from_axes(axes)), axes, atol=1e-14)


def test_a_product_of_rotations_is_that_of_their_matrices() -> None:
    first, second, *_ = frames()
    found = quaternions.product(quaternions.from_axes(first), quaternions.from_axes(second))
    np.testing.assert_allclose(quaternions.to_axes(found), first @ second, atol=1e-14)
    back = quaternions.product(quaternions.inverse(found), found)
    np.testing.assert_allclose(back, [1, 0, 0, 0], atol=1e-15)


def test_exp_turns_counterclockwise_about_its_vector() -> None:
    turned = quaternions.to_axes(quaternions.exp([0, 0, np.pi / 2])) @ [1.0, 0, 0]
    np.testing.assert_allclose(turned, [0, 1, 0], atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 1.0, np.pi - 1e-6])
def test_log_is_the_inverse_of_exp(angle: float) -> None:
    vector = angle * np.array([2.0, -1, 2]) / 3
    for sign in (1, -1):  # both quaternions of a rotation
        found = quaternions.log(sign * quaternions.exp(vector))
        np.testing.assert_allclose(found, vector, rtol=1e-9, atol=1e-15)
