"""Infinite samples of every type, alone, together and beside NaN: drawn as the oracle has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.quick_stats import quick_stats

from texvol.ray_casting import raycast
from texvol.ray_casting.projection import project
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (31, 29)
KINDS = ("inf", "-inf", "inf -inf", "inf nan", "nan -inf inf")
# The largest of half precision leaves no number of it that stands out; 1e30 is what stands for infinities.
TYPES = [(np.float16, 1e-4), (np.float16, 1), (np.float16, 65504), (np.float32, 1), (np.float32, 1e20)]
TYPES += [(np.float32, 1e30), (np.float32, 3e38), (np.float64, 1), (np.float64, 1e300)]
TF = TransferFunction([0.2, 0.8, 1.0], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0.0, 0.3, 0.8])


def with_blocks(dtype: type, largest: float, kinds: str) -> Volume:
    """Noise up to a number, and blocks that are not finite in it."""
    values = (np.random.default_rng(1).random((15, 14, 16)) * largest).astype(dtype)
    each = kinds.split()
    for number, (z, y, x) in enumerate([(2, 3, 4), (0, 9, 8), (9, 5, 0), (11, 2, 8), (6, 6, 11), (13, 9, 4)]):
        values[z : z + 3, y : y + 2, x : x + 2] = float(each[number % len(each)])
    return Volume(values)


def kind_of(numbers: np.ndarray) -> np.ndarray:
    """NaN 2, infinities ±1, finite numbers 0."""
    return np.where(np.isnan(numbers), 2, np.where(np.isinf(numbers), np.sign(numbers), 0))


@pytest.mark.parametrize(
    "mode, kinds, dtype, largest",
    [  # sums and extremes in turns
        (mode, kinds, *each)
        for row, each in enumerate(TYPES)
        for column, kinds in enumerate(KINDS)
        for mode in sorted(NUMBER_MODES)[(row + column) % 2 :: 2]
    ],
)
def test_numbers_are_infinite_where_the_oracle_has_them_so(renderer, mode, kinds, dtype, largest):
    volume = with_blocks(dtype, largest, kinds)
    scene = Scene(volume, camera=Camera.framing(volume, "perspective", fov=50), mode=mode, classification="slab")
    with np.errstate(over="ignore", invalid="ignore"):
        expected = project(scene, SIZE)[..., 0].astype(np.float32)  # which may hold fewer finite numbers
    picture = renderer.render(scene, SIZE, sampling_rate=8)[..., 0]
    np.testing.assert_array_equal(kind_of(picture), kind_of(expected))
    finite = np.isfinite(expected)
    scale = np.abs(expected[finite]).max(initial=0)
    # At eight slabs a sample; beside NaN the edge is known to half a slab, which counts where a ray has little else.
    tolerance = 1e-5 if mode in ("mip", "minip") else 0.1 if "nan" in kinds else 0.01
    assert np.abs(picture[finite] - expected[finite]).max(initial=0) <= tolerance * scale


@pytest.mark.parametrize(
    "backend, kinds, largest, classification",
    [
        *(("egl", kinds, largest, "post") for kinds in ("inf", "inf -inf") for largest in (1, 6e4)),
        ("egl", "inf", 1, "extinction"),
        *(("egl", "inf -inf", 6e4, each) for each in ("slab", "integrated")),
        *(("osmesa", "inf -inf", 6e4, each) for each in ("post", "integrated")),
    ],
)
def test_matter_of_infinite_half_precision_is_that_of_the_end_of_the_transfer_function(
    backend, kinds, largest, classification
):
    volume, medium = with_blocks(np.float16, largest, kinds), replace(TF, values=largest * TF.values)
    scene = Scene(volume, medium, Camera.framing(volume, "perspective", fov=50), classification=classification)
    with Renderer(backend) as renderer:
        picture = renderer.render(scene, SIZE, sampling_rate=16)
    # A slab beside a block is as dense as the block or as what is beside it: 0.8 (1 / 16), less what is in front of it.
    assert np.abs(picture - raycast(scene, SIZE)).max() < 0.05


def test_a_ray_along_samples_beside_both_infinities_meets_the_nearer_ones_only(renderer):
    values = np.ones((9, 9, 9), np.float16)
    values[:, 2], values[:, 6], values[4, 4, 4] = np.inf, -np.inf, np.nan
    volume = Volume(values)
    camera = Camera.orthographic(volume.centre - (0, 0, 20), volume.centre, (0, 1, 0), 9)
    for mode in ("xray", "average"):
        scene = Scene(volume, camera=camera, mode=mode, classification="slab")
        picture, expected = (each[..., 0] for each in (renderer.render(scene, (9, 9)), project(scene, (9, 9))))
        np.testing.assert_array_equal(kind_of(picture), kind_of(expected))
        assert {-1, 0, 1} == set(kind_of(picture).ravel().tolist())


def test_half_precision_without_infinities_stays_half(renderer):
    volume = Volume(np.linspace(0, 65504, 125).astype(np.float16).reshape(5, 5, 5))
    renderer.render(Scene(volume, mode="xray", classification="slab"), (8, 8))
    assert quick_stats(renderer)["texture_format"] == "r16f"
