"""Ray casting of section 6.1: Bresenham, tripod and equal steps, against closed forms and the oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.survey_scenes import BOXES, PERSPECTIVE, SIZE, VIEWS, constant_scene, rms_error, smooth_scene

from texvol.methods import draw
from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

TRUE = ("bresenham-true", "tripod-true", "equal-steps", "equal-steps-before", "equal-steps-nearest")


@pytest.mark.parametrize("view", VIEWS | PERSPECTIVE)
@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize("name", TRUE)
def test_a_constant_medium_is_its_chord(name: str, box: str, view: str) -> None:
    scene, expected = constant_scene(box, view)
    # Classified samples are float32: 6e-8 of a depth of a few.
    np.testing.assert_allclose(draw(name, scene, SIZE), expected, rtol=0, atol=1e-6)


def _depth(name: str, corner: tuple[int, int, int], size: tuple[int, int] = (1, 1)) -> float:
    """Optical depth that a method finds through the middle of a cube of 8³, over the true one."""
    scene, _ = constant_scene("cube", "slanted")
    volume = scene.volume
    up = (0.0, 1.0, 0.0) if corner[:2] == (0, 0) else (0.0, 0.0, 1.0)
    camera = Camera.orthographic(volume.centre - 20 * np.array(corner), volume.centre, up, height=1)
    scene = replace(scene, camera=camera)
    found, true = (-np.log1p(-each[0, 0, 3]) for each in (draw(name, scene, size), raycast(scene, size)))
    return float(found / true)


def test_length_1_counts_too_little_by_bresenham_and_too_much_by_the_tripod() -> None:
    # Along a diagonal of the cube's faces and of the cube, Bresenham takes one sample of length 1 for √2 and √3.
    for name in ("bresenham", "tripod"):
        assert _depth(name, (1, 0, 0)) == pytest.approx(1, rel=1e-6)
    assert _depth("bresenham", (1, 1, 0)) == pytest.approx(1 / np.sqrt(2), rel=1e-6)
    assert _depth("bresenham", (1, 1, 1)) == pytest.approx(1 / np.sqrt(3), rel=1e-6)
    # From face to face there are 2 · 7 + 1 voxels on the way through 8 · √2, and 3 · 7 + 1 through 8 · √3.
    assert _depth("tripod", (1, 1, 0)) == pytest.approx(15 / (8 * np.sqrt(2)), rel=1e-6)
    assert _depth("tripod", (1, 1, 1)) == pytest.approx(22 / (8 * np.sqrt(3)), rel=1e-6)


def test_length_1_makes_an_anisotropic_volume_denser_along_its_short_spacing() -> None:
    volume = Volume(np.zeros((6, 6, 6)), (1, 1, 4))
    transfer = TransferFunction(np.zeros(1), np.ones((1, 3)), np.array([0.1]))
    depths = []
    for view, up in (((1, 0, 0), (0, 0, 1)), ((0, 0, 1), (0, 1, 0))):
        camera = Camera.orthographic(volume.centre - 50 * np.array(view), volume.centre, up, height=1)
        depths.append(-np.log1p(-draw("bresenham", Scene(volume, transfer, camera), (1, 1))[0, 0, 3]))
    np.testing.assert_allclose(depths, 0.6, rtol=1e-6)  # 6 samples both ways, though z is four times as long


def test_the_tripod_visits_every_voxel_that_a_ray_crosses_and_bresenham_does_not() -> None:
    # The opacity of a constant medium, where all voxels but one are empty, says whether that one is visited.
    camera = Camera.framing(Volume(np.zeros((9, 9, 9))))
    transfer = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.2]))
    missed = {"tripod-true": 0, "bresenham": 0}
    for place in np.random.default_rng(5).integers(0, 9, (30, 3)):
        values = np.zeros((9, 9, 9))
        values[tuple(place)] = 1
        # The medium of the exact picture of nearest samples: steps so short that none passes over a voxel's corner.
        crossed = draw("equal-steps-nearest", Scene(Volume(values), transfer, camera), SIZE, sampling_rate=200)[..., 3]
        for name in missed:
            found = draw(name, Scene(Volume(values), transfer, camera), SIZE)[..., 3]
            missed[name] += int(((found == 0) & (crossed > 0)).sum())
    assert missed["tripod-true"] == 0
    assert missed["bresenham"] > 10


def test_true_lengths_are_the_exact_picture_of_nearest_samples() -> None:
    scene = smooth_scene(12)
    exact = draw("tripod-true", scene, SIZE)
    errors = [np.abs(draw("equal-steps-nearest", scene, SIZE, sampling_rate=rate) - exact).max() for rate in (8, 64)]
    assert errors[1] < 0.2 * errors[0]  # order 1: a jump is misplaced by up to half a step
    assert errors[0] < 1e-2


@pytest.mark.parametrize("name", ["equal-steps", "equal-steps-before"])
def test_equal_steps_have_order_2_where_the_medium_is_smooth(name: str) -> None:
    errors = [rms_error(name, smooth_scene(), sampling_rate=rate) for rate in (1, 4, 16)]
    # The slope jumps at the cells' faces, where steps end by chance: over a factor of 4 that is some 0.1 of an order.
    assert 1.75 < np.log2(errors[0] / errors[1]) / 2 < 2.25
    assert 1.75 < np.log2(errors[1] / errors[2]) / 2 < 2.25
    assert 5e-5 < errors[0] < 2e-4  # measured 1.1e-4; half or twice the step would be 3e-5 or 4e-4


def test_each_goes_to_its_own_oracle() -> None:
    sharp = TransferFunction(np.array([0, 0.5, 0.6]), np.eye(3), np.array([0, 0, 0.5]))
    scene = replace(smooth_scene(), transfer_function=sharp)
    truths = {each: raycast(replace(scene, classification=each), SIZE) for each in ("extinction", "post")}
    for name, own, other in (("equal-steps", "post", "extinction"), ("equal-steps-before", "extinction", "post")):
        picture = draw(name, scene, SIZE, sampling_rate=8)
        errors = {each: np.sqrt(np.square(picture - truth).mean()) for each, truth in truths.items()}
        assert errors[own] < 0.1 * errors[other]


@pytest.mark.parametrize(("name", "least", "most"), [
    # Nearest samples are off with both signs along a ray, and the mean of the errors falls with the square of the
    # spacing. Bresenham's line is beside the ray by up to half a voxel, of one sign: order 1.
    ("tripod-true", 1.7, 2.3), ("equal-steps-nearest", 1.6, 2.3), ("bresenham-true", 0.7, 1.3),
    # A length of 1 is wrong by a factor, whatever the spacing.
    ("bresenham", -0.1, 0.5), ("tripod", -0.1, 0.1),
])  # fmt: skip
def test_what_a_finer_grid_removes(name: str, least: float, most: float) -> None:
    errors = [rms_error(name, smooth_scene(samples)) for samples in (12, 48)]
    assert least < np.log2(errors[0] / errors[1]) / 2 < most


def test_a_ray_ends_early_if_asked() -> None:
    opaque = TransferFunction(np.zeros(1), np.ones((1, 3)), np.array([5.0]))
    scene = replace(smooth_scene(), transfer_function=opaque)
    for name in ("bresenham", "tripod-true", "equal-steps", "equal-steps-before"):
        whole, short = (draw(name, scene, SIZE, least_transmittance=each) for each in (0.0, 0.01))
        assert 0 < np.abs(whole - short).max() < 0.01


def test_an_emissive_medium_glows_without_extinction() -> None:
    volume = Volume(np.zeros((5, 5, 5)))
    transfer = TransferFunction(np.zeros(1), np.array([(0.1, 0.2, 0.3)]), np.zeros(1), emissive=True)
    camera = Camera.orthographic(volume.centre - (0, 0, 9), volume.centre, (0, 1, 0), height=1)
    for name in TRUE:
        np.testing.assert_allclose(draw(name, Scene(volume, transfer, camera), (1, 1))[0, 0], (0.5, 1.0, 1.5, 0), 1e-6)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_a_bad_rate_is_an_error(rate: float) -> None:
    with pytest.raises(InputError, match="sampling_rate must be positive and finite, got"):
        draw("equal-steps", smooth_scene(), SIZE, sampling_rate=rate)


@pytest.mark.parametrize("name", ["tripod", "equal-steps"])
@pytest.mark.parametrize("least", [-0.1, 1.0, float("nan")])
def test_a_bad_end_of_rays_is_an_error(name: str, least: float) -> None:
    with pytest.raises(InputError, match="least_transmittance must be at least 0 and below 1, got"):
        draw(name, smooth_scene(), SIZE, least_transmittance=least)
