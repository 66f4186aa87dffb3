"""Ray casting in wavelet and cosine coefficients, against closed forms, the oracle, and nearest samples."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import random_volume
from support.survey_scenes import BOXES, PERSPECTIVE, SIZE, VIEWS, constant_scene, rms_error, smooth_scene

from texvol.methods import draw, method_of
from texvol.methods.coefficients import bits_per_voxel
from texvol.methods.dct import Cosines
from texvol.methods.wavelets import Wavelets
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

BOTH = pytest.mark.parametrize("name", ["wavelets", "dct"])


@pytest.mark.parametrize("view", VIEWS | PERSPECTIVE)
@pytest.mark.parametrize("box", BOXES)
@BOTH
def test_a_constant_medium_is_its_chord(name: str, box: str, view: str) -> None:
    scene, expected = constant_scene(box, view)
    np.testing.assert_allclose(draw(name, scene, SIZE, kept=0.01), expected, rtol=0, atol=1e-9)


def test_all_wavelets_are_the_nearest_samples() -> None:
    volume = random_volume(3, (21, 16, 11))
    transfer = TransferFunction(np.array([0, 1]), np.array([(1, 0, 0), (0, 1, 1)]), np.array([0, 0.4]))
    for camera in (Camera.framing(volume), Camera.framing(volume, "perspective", fov=70)):
        scene = Scene(volume, transfer, camera)
        # Sums of some 15 float32 numbers.
        np.testing.assert_allclose(draw("wavelets", scene, SIZE, kept=1.0), draw("tripod-true", scene, SIZE), atol=3e-6)


def test_all_cosines_go_through_every_sample() -> None:
    # A ray through the middles of one row of samples, in steps of a spacing, meets each of them.
    volume = Volume(np.random.default_rng(2).random((3, 3, 19)).astype(np.float32))
    transfer = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.5]))
    camera = Camera.orthographic(volume.centre - (40, 0, 0), volume.centre, (0, 0, 1), height=1)
    found = draw("dct", Scene(volume, transfer, camera), (1, 1), kept=1.0)[0, 0, 3]
    assert -np.log1p(-found) == pytest.approx(0.5 * float(volume.values[1, 1].sum()), rel=1e-5)


def test_a_cosine_is_its_integral() -> None:
    # cos(π u x / 8) of one block along x, u = 2: one coefficient beside the mean, and the value between the samples.
    x = np.arange(8) + 0.5
    volume = Volume(np.broadcast_to(1 + np.cos(np.pi * 2 * x / 8), (8, 8, 8)))
    transfer = TransferFunction(np.array([0.0, 2.0]), np.ones((2, 3)), np.array([0.0, 0.2]))
    at = np.array([2.3, 3.5, -20])
    camera = Camera.orthographic(at, at + (0, 0, 1), (0, 1, 0), height=1)
    found = draw("dct", Scene(volume, transfer, camera), (1, 1), kept=2 / 512)[0, 0, 3]
    assert -np.log1p(-found) == pytest.approx(8 * 0.1 * (1 + np.cos(np.pi * 2 * (2.3 + 0.5) / 8)), rel=1e-5)


@pytest.mark.parametrize(("name", "least", "most"), [("wavelets", 1e-4, 1e-3), ("dct", 5e-4, 2e-3)])
def test_the_error_grows_as_coefficients_are_left_out(name: str, least: float, most: float) -> None:
    scene = smooth_scene()
    fractions = (1.0, 0.1, 0.02, 0.004)
    errors = [rms_error(name, scene, kept=each) for each in fractions]
    # Cosines have no slope at the seams of the blocks, and are off by more there than nearest samples are.
    assert least < errors[0] < most  # the reconstruction's own, which all coefficients leave
    assert errors[1] < errors[2] < errors[3] and errors[3] > 3 * errors[0]
    complete = scene.completed(SIZE)
    bits = [method_of(name)(complete, kept=each).bits_per_voxel for each in fractions]  # type: ignore[call-arg, attr-defined]
    assert bits == sorted(bits, reverse=True)
    # 0.469 bits say where a tenth is; 24 samples are padded to 32 where cubes have 16 voxels.
    padding = (32 / 24) ** 3 if name == "wavelets" else 1
    assert bits[1] == pytest.approx((32 * 0.1 + 0.469) * padding, rel=2e-3)


def test_nodes_without_coefficients_are_crossed_in_one_step() -> None:
    values = np.zeros((32, 32, 32), np.float32)
    values[:8, :8, :8] = np.random.default_rng(0).random((8, 8, 8))
    volume = Volume(values)
    transfer = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.5]))
    complete = Scene(volume, transfer, Camera.framing(volume)).completed(SIZE)
    wavelets, cosines = Wavelets(complete, kept=1.0), Cosines(complete, kept=1.0)
    uniform = [
        int((wavelets.nodes[first : first + 32**3 // 8**level] == -2).sum())
        for level, first in enumerate(wavelets.first, 1)
    ]
    assert uniform == [16**3 - 64, 8**3 - 8, 4**3 - 1, 2**3 - 1, 0]
    assert (np.diff(cosines.ends) > 1).sum() == 1


def test_compressed_volumes_take_less_memory() -> None:
    complete = smooth_scene(32).completed(SIZE)
    for kind in (Wavelets, Cosines):
        few, many = (kind(complete, kept=each).memory for each in (0.02, 1.0))
        assert few < 0.4 * many


def test_bits_of_all_and_of_half() -> None:
    ones = np.ones(8, np.float32)
    assert bits_per_voxel(ones, 8) == 32
    assert bits_per_voxel(np.tile(np.float32([0, 1]), 4), 8) == 17
    assert bits_per_voxel(0 * ones, 8) == 0


@BOTH
@pytest.mark.parametrize("kept", [0.0, 1.1, float("nan")])
def test_a_bad_fraction_is_an_error(name: str, kept: float) -> None:
    with pytest.raises(InputError, match="kept must be above 0 and at most 1, got"):
        draw(name, smooth_scene(), SIZE, kept=kept)
