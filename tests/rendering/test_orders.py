"""Orders of convergence, by differences of successive refinements, and the plateaus that appear without their cures.

After Etiene, Jönsson, Ropinski, Scheidegger, Comba, Nonato, Kirby, Ynnerman, Silva (2014): where a picture's error is
C d^k, pictures of d, d/2, d/4 … differ by C (1 - 2^-k) d^k, so that the slope of a line through the logarithms of
the differences is k. No truth is needed, and an error that does not fall shows as well.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from support import planted
from support.pairs import each_classification_in_a_projection
from support.scenes import BONE, FOG, smooth_volume

from texvol.comparison import compare
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.slabs import SLABS_PER_STACK

SIZE = (64, 64)
FLOAT32 = {"texture_format": "rgba32f", "target_format": "rgba32f"}
RATES = (1, 2, 4, 8)
ULP = 2.0**-24


def order(steps: np.ndarray, pictures: list[np.ndarray]) -> float:
    """Least-squares slope of the logarithm of the rms difference of successive pictures over that of the step."""
    differences = [compare(coarse, fine).rms_error for coarse, fine in pairwise(pictures)]
    return float(np.polyfit(np.log(steps[:-1]), np.log(differences), 1)[0])


def order_in_thickness(renderer: Renderer, scene: Scene, rates: tuple[float, ...] = RATES, **options: str) -> float:
    pictures = [renderer.render(scene, SIZE, sampling_rate=rate, **FLOAT32 | options) for rate in rates]
    return order(1 / np.array(rates), pictures)


@pytest.mark.parametrize("transfer_function", [FOG, BONE], ids=["fog", "bone"])
@each_classification_in_a_projection
def test_thinner_slabs_converge_with_their_order(
    renderer: Renderer, classification: Classification, projection: Projection, transfer_function: TransferFunction
) -> None:
    volume = smooth_volume()
    scene = Scene(volume, transfer_function, Camera.framing(volume, projection), classification=classification)
    found = order_in_thickness(renderer, scene)
    # Second order by the midpoint rule and the trapezium's; interpolated opacities are first order on opaque matter
    # and second on thin.
    assert (0.85 if classification == "slab" else 1.8) < found < 2.2


def linear_medium(emissive: bool) -> TransferFunction:
    """Emission and extinction linear in the value: what is trilinear before classification is so after it."""
    if emissive:  # and without extinction, so that the colour of a whole slab is linear too
        return TransferFunction(
            np.array([0, 1.0]), np.array([(0, 0, 0), (0.05, 0.1, 0.08)]), np.zeros(2), emissive=True
        )
    return TransferFunction(np.array([0, 1.0]), np.full((2, 3), (0.9, 0.6, 0.3)), np.array([0, 0.1]))


def refined(volume: Volume, times: int) -> Volume:
    """The same trilinear field on a grid of `times` as many samples along each axis, an odd number.

    The old samples and the faces of the box are on the new grid, so that the field is the same to the last digit.
    """
    values = volume.values.astype(np.float64)
    for axis, count in enumerate(values.shape):
        position = np.clip((np.arange(count * times) + 0.5) / times - 0.5, 0, count - 1)
        cell = np.minimum(position.astype(int), max(count - 2, 0))
        fraction = (position - cell).reshape([-1 if a == axis else 1 for a in range(3)])
        values = (
            values.take(cell, axis) * (1 - fraction) + values.take(np.minimum(cell + 1, count - 1), axis) * fraction
        )
    spacing = volume.spacing / times
    return Volume(values.astype(np.float32), spacing, volume.box_corner + spacing / 2)


@pytest.mark.parametrize(
    "classification, emissive, projection",
    [
        ("slab", True, "orthographic"),
        ("extinction", True, "perspective"),
        ("extinction", False, "orthographic"),
        ("post", False, "perspective"),
        ("integrated", False, "orthographic"),
    ],
)
def test_a_finer_grid_of_the_same_trilinear_field_changes_nothing(
    renderer: Renderer, classification: Classification, emissive: bool, projection: Projection
) -> None:
    random = np.random.default_rng(8)
    coarse = Volume(random.random((5, 6, 7)).astype(np.float32), (1, 1.2, 0.9))
    camera = Camera.framing(coarse, projection)
    pictures = []
    for times in (1, 3, 9):
        scene = Scene(refined(coarse, times), linear_medium(emissive), camera, classification=classification)
        pictures.append(renderer.render(scene, SIZE, slab_thickness=0.4, **FLOAT32))
    # Samples round to half an ulp. Texture coordinates round to 2^-25 of the box, 3.5 × 2^-24 of a sample, and
    # neighbours differ by up to 1 along each of three axes; of the mean of 30 slabs' roundings, as good as random, the
    # worst of ten thousand pixels has 5/√(3 × 30). The deepest ray has 1.1; blends and registers add two roundings.
    tolerance = (1.1 * (0.5 + np.sqrt(3) * 3.5 * 5 / np.sqrt(90)) + 2) * ULP
    for picture in pictures[1:]:
        np.testing.assert_allclose(picture, pictures[0], atol=tolerance)
    assert pictures[0].max() > 0.3


@each_classification_in_a_projection
def test_a_finer_grid_of_a_smooth_field_converges_with_order_two(
    renderer: Renderer, classification: Classification, projection: Projection
) -> None:
    samples = np.array([12, 24, 48, 96])
    pictures = []
    medium = linear_medium(emissive=False)
    for count in samples:
        h = 48 / count
        fine = smooth_volume(int(count))
        volume = Volume(fine.values, (h,) * 3, (h / 2,) * 3)
        scene = Scene(volume, medium, Camera.framing(volume, projection), classification=classification)
        pictures.append(renderer.render(scene, SIZE, slab_thickness=0.4, **FLOAT32))
    # Trilinear filtering is off by h² f''/8; the slabs stay the same, and so does most of their error.
    assert 1.8 < order(1 / samples, pictures) < 2.2


def errors(renderer: Renderer, scene: Scene, rates: tuple[float, ...] = RATES, **options: str) -> list[float]:
    """Rms errors against the oracle."""
    truth = raycast(scene, SIZE)
    return [
        compare(renderer.render(scene, SIZE, sampling_rate=rate, **FLOAT32 | options), truth).rms_error
        for rate in rates
    ]


def fog_scene(projection: Projection = "orthographic", classification: Classification = "extinction") -> Scene:
    volume = smooth_volume(32)
    camera = Camera.framing(volume, projection, fov=60 if projection == "perspective" else None)
    medium = TransferFunction(FOG.values, FOG.colors, 2 * FOG.extinctions)
    return Scene(volume, medium, camera, classification=classification)


@pytest.mark.parametrize("classification", ["slab", "post"])
def test_unclipped_end_slabs_are_first_order(renderer: Renderer, classification: Classification) -> None:
    """Each end is off by a share of a slab: τ d/2 at most."""
    scene = fog_scene(classification=classification)
    with planted.planted(*planted.UNCLIPPED_END_SLABS) as uncured:
        wrong = errors(uncured, scene)
    right = errors(renderer, scene)
    assert 0.8 < np.log2(wrong[0] / wrong[-1]) / 3 < 1.2
    assert wrong[0] > 10 * right[0] and wrong[-1] > 100 * right[-1]


@pytest.mark.parametrize("classification", ["extinction", "integrated"])
def test_without_the_cosine_the_error_does_not_fall(renderer: Renderer, classification: Classification) -> None:
    """Depth is short by 1 - cosθ, up to 1 - 1/1.29 in the corners at 60°, however thin the slabs."""
    scene = fog_scene("perspective", classification)
    with planted.planted(*planted.MISSING_COSINE) as uncured:
        wrong = errors(uncured, scene)
    assert wrong[-1] == pytest.approx(wrong[-2], rel=0.05)
    assert wrong[-1] > 100 * errors(renderer, scene)[-1]


@pytest.mark.parametrize("classification", ["extinction", "post"])
def test_linear_opacity_is_first_order(renderer: Renderer, classification: Classification) -> None:
    """A = τ d instead of 1 - e^-τd: off by (τd)²/2 a slab, τ d/2 of the whole."""
    scene = fog_scene(classification=classification)
    with planted.planted(*planted.LINEAR_OPACITY) as uncured:
        wrong = errors(uncured, scene)
    assert 0.8 < np.log2(wrong[0] / wrong[-1]) / 3 < 1.2
    assert wrong[-1] > 30 * errors(renderer, scene)[-1]


def test_straight_colour_is_a_plateau(renderer: Renderer) -> None:
    """Colour interpolated apart from opacity shows colours of matter that is not there, however thin the slabs."""
    volume = smooth_volume(32)
    scene = Scene(volume, BONE, Camera.framing(volume), classification="extinction")
    with planted.planted(*planted.STRAIGHT_COLOUR) as uncured:
        wrong = errors(uncured, scene)
    right = errors(renderer, scene)
    assert wrong[-1] == pytest.approx(wrong[-2], rel=0.05)
    assert wrong[-1] > 20 * right[-1]


def deep_fog(slabs: int) -> tuple[Scene, float]:
    """Optical depth 2 along an axis, even all over, and the thickness of so many slabs."""
    volume = Volume(np.zeros((8, 8, 8), np.uint8))
    medium = TransferFunction(np.zeros(1), np.ones((1, 3)), np.array([2 / 8]))
    camera = Camera.orthographic(volume.centre - (0, 20, 0), volume.centre, (0, 0, 1), height=4)
    return Scene(volume, medium, camera, classification="extinction"), 8 / slabs


@pytest.mark.parametrize(
    "target_format, slabs, most, least",
    # Rounding to nearest loses `least`, half of what optics.md says in section 3; cutting off, as Mesa does with half
    # floats, up to an ulp of each blend: 512 × 2^-12 on average in [1/2, 1). Black loses 1 - e^-2 = 0.865.
    [
        ("rgba8", 256, 0.16, 0.055),
        ("rgba8", 1024, 0.8647, 0.8646),
        ("rgba16f", 512, 0.125, 0.004),
        ("rgba16f", 4096, 0.55, 0.18),
    ],
)
def test_a_coarse_target_loses_thin_slabs_that_are_blended_one_by_one(
    renderer: Renderer, target_format: str, slabs: int, most: float, least: float
) -> None:
    scene, thickness = deep_fog(slabs)
    options = {"texture_format": "rgba32f", "target_format": target_format, "slab_thickness": thickness}
    true = 1 - np.exp(-2)
    with planted.one_slab_per_blend():
        lost = true - renderer.render(scene, (4, 4), **options)[..., 3].mean()
    assert least < lost < most
    cured = true - renderer.render(scene, (4, 4), **options)[..., 3].mean()
    # A stack is so many slabs that there are one or two blends: each rounds what comes and the sum.
    assert abs(cured) <= -(-slabs // SLABS_PER_STACK) * {"rgba8": 1 / 255, "rgba16f": 2.0**-11}[target_format]
    assert abs(cured) < lost / 3
