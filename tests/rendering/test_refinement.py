"""Texels on a finer grid: the medium of slab and extinction comes nearer to that of post, by as much as is said."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates
from support.scenes import BONE, constant, random_volume, smooth_volume

from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.lighting import Lighting
from texvol.scene.mask import Mask
from texvol.scene.refinement import interpolated, refined, refined_scene
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.refinement import chosen_refinement, model_error_per_voxel
from texvol.util.errors import AccuracyWarning, InputError

SIZE = (48, 40)
WAVY = TransferFunction([0, 0.4, 0.6, 1], [(1, 0.2, 0.1), (0.2, 1, 0.3), (0.3, 0.4, 1), (1, 1, 1)], [0, 0.05, 0.6, 0.9])


@given(
    st.integers(0, 2**32 - 1), st.sampled_from([2, 4]), st.sampled_from([np.uint8, np.int16, np.float32, np.float64])
)
@settings(max_examples=30, deadline=None)
def test_refined_values_are_those_in_between(seed: int, factor: int, dtype: Any) -> None:
    random = np.random.default_rng(seed)
    values = (100 * random.random(random.integers(1, 9, 3))).astype(dtype)
    volume = Volume(values, random.uniform(0.5, 2, 3), random.uniform(-9, 9, 3), _turned(random))
    finer = refined(volume, factor)
    assert finer.dimensions == tuple(factor * count for count in volume.dimensions) and finer is refined(volume, factor)
    np.testing.assert_allclose(finer.box_corner, volume.box_corner, atol=1e-12)
    np.testing.assert_allclose(finer.box_edges, volume.box_edges, atol=1e-12)
    z, y, x = np.indices(finer.values.shape).reshape(3, -1)
    index = (np.stack([x, y, z], axis=1) + 0.5) / factor - 0.5
    expected = interpolated(values, index).reshape(finer.values.shape)
    np.testing.assert_allclose(finer.values, expected, atol=2e-5 if finer.values.dtype == np.float32 else 1e-12)


def _turned(random: np.random.Generator) -> np.ndarray:
    return np.linalg.qr(random.standard_normal((3, 3)))[0]


def test_even_values_stay_even() -> None:
    volume = Volume(np.full((3, 4, 5), 0.1, np.float32))
    assert (refined(volume, 4).values == np.float32(0.1)).all()


@pytest.mark.parametrize("classification", ["slab", "extinction"])
@pytest.mark.parametrize("factor", [2, 4])
def test_a_refined_picture_goes_to_the_oracle_of_that_grid(
    renderer: Renderer, classification: Classification, factor: int
) -> None:
    volume = random_volume(2)
    scene = Scene(volume, BONE, Camera.framing(volume, "perspective"), classification=classification)
    truth = raycast(scene, SIZE, texture_refinement=factor)
    errors = [
        np.abs(renderer.render(scene, SIZE, sampling_rate=rate, texture_refinement=factor) - truth).max()
        for rate in (4, 32)
    ]
    assert errors[1] < errors[0] / 4 and errors[1] < 0.01
    assert np.abs(truth - raycast(scene, SIZE)).max() > 3 * errors[1]


def test_finer_grids_come_nearer_to_post(renderer: Renderer) -> None:
    volume = smooth_volume(12)
    scene = Scene(volume, WAVY, Camera.framing(volume), classification="slab")
    truth = raycast(replace(scene, classification="post"), SIZE)
    found = []
    for factor in (1, 2, 4):
        picture = renderer.render(scene, SIZE, sampling_rate=16, texture_refinement=factor)
        stats = renderer.stats
        assert stats["texture_refinement"] == factor
        found.append((np.abs(picture - truth).max(), stats["estimated_model_error"]))
    errors, estimates = np.array(found).T
    assert errors[1] < errors[0] / 2 and errors[2] < errors[1] / 2
    # The estimate is that of a sixteenth of the pixels.
    assert (estimates >= 0.4 * errors).all() and (estimates <= 1.3 * errors).all()


@pytest.mark.parametrize("classification", ["post", "integrated"])
def test_what_is_classified_after_interpolation_has_no_model_error(
    renderer: Renderer, classification: Classification
) -> None:
    renderer.render(Scene(random_volume(3), BONE, classification=classification), SIZE)
    assert renderer.stats["estimated_model_error"] == 0


def test_an_error_of_post_bounds_both(renderer: Renderer) -> None:
    volume = smooth_volume(16)
    scene = Scene(volume, WAVY, Camera.framing(volume), classification="slab")
    truth = raycast(replace(scene, classification="post"), SIZE)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for wanted in (0.1, 0.03, 0.015):
            picture = renderer.render(scene, SIZE, max_error=wanted, of="post", texture_refinement="auto")
            assert np.abs(picture - truth).max() <= wanted
            stats = renderer.stats
            assert stats["estimated_error"] + stats["estimated_model_error"] <= wanted
    assert stats["texture_refinement"] > 1


def test_an_error_of_post_that_the_grid_cannot_keep_is_told(renderer: Renderer) -> None:
    volume = smooth_volume(12)
    scene = Scene(volume, WAVY, Camera.framing(volume), classification="slab")
    with pytest.warns(AccuracyWarning, match="of post not reached: the medium of slab at texture refinement 1 is"):
        renderer.render(scene, SIZE, max_error=1e-3, of="post")


def test_auto_refines_where_it_shows_and_fits() -> None:
    volume = smooth_volume(16)
    scene = Scene(volume, WAVY, Camera.framing(volume), classification="slab").completed(SIZE)
    thin, thick = (chosen_refinement(scene, thickness * volume.smallest_spacing, 1e9) for thickness in (0.1, 8))
    assert thin == 4 and thick == 1
    assert chosen_refinement(scene, 0.1 * volume.smallest_spacing, 16**3 * 8 * 20) == 2
    assert chosen_refinement(scene, 0.1 * volume.smallest_spacing, 0) == 1
    linear = replace(scene, transfer_function=constant(0.2))
    assert chosen_refinement(linear, volume.smallest_spacing, 1e9) == 1
    large = replace(scene, volume=smooth_volume(128))
    assert chosen_refinement(large, 0.1 * large.smallest_spacing, 1e12) == 1  # would take more than 0.3 seconds


@pytest.mark.parametrize("factor", [1, 2, 4])
def test_the_model_error_of_points_is_that_of_a_plain_computation(factor: int) -> None:
    volume = random_volume(5, (9, 8, 7))
    finer = refined(volume, factor)
    points = np.random.default_rng(1).random((20_000, 3))  # fractions of the box, z, y, x

    def at(values: np.ndarray) -> np.ndarray:
        return map_coordinates(values.astype(float), (points * values.shape - 0.5).T, order=1, mode="nearest")

    def opacity(values: np.ndarray) -> np.ndarray:
        return 1 - np.exp(-np.interp(values, WAVY.values, WAVY.extinctions) * volume.smallest_spacing)

    expected = np.sqrt(np.mean((at(opacity(finer.values)) - opacity(at(volume.values))) ** 2))
    found = model_error_per_voxel(volume, WAVY, factor)[:, 3]
    assert np.sqrt(np.mean(found**2)) == pytest.approx(expected, rel=0.05)


REFUSED: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "post": ({"classification": "post"}, {"texture_refinement": 2}, "before interpolation, got classification post"),
    "light": ({"lighting": Lighting()}, {"texture_refinement": 4}, "before interpolation, got light"),
    "mask": ({"mask": Mask(np.ones((7, 8, 9)))}, {"texture_refinement": 2}, "before interpolation, got a mask"),
    "factor": ({}, {"texture_refinement": 3}, "texture refinement must be 1, 2, 4 or auto, got 3"),
    "word": ({}, {"texture_refinement": "best"}, "texture refinement must be 1, 2, 4 or auto, got 'best'"),
    "true": ({}, {"texture_refinement": True}, "texture refinement must be 1, 2, 4 or auto, got True"),
    "of": ({}, {"of": "slab", "max_error": 0.1}, "of must be own or post, got 'slab'"),
    "no error": ({}, {"of": "post"}, "an error of post needs a maximum error, got none"),
    "mode": ({"mode": "mip"}, {"of": "post", "max_error": 0.1}, "an error of post needs a single volume"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_refined_is_refused(renderer: Renderer, case: str) -> None:
    parts, arguments, message = REFUSED[case]
    scene = Scene(random_volume(1), BONE, **({"classification": "slab"} | parts))
    with pytest.raises(InputError, match=message):
        renderer.render(scene, SIZE, **arguments)


def test_auto_leaves_alone_what_cannot_be_refined(renderer: Renderer) -> None:
    for parts in ({"classification": "post"}, {"lighting": Lighting()}, {"mode": "mip"}):
        renderer.render(
            Scene(random_volume(1), BONE, **({"classification": "slab"} | parts)), SIZE, texture_refinement="auto"
        )  # type: ignore[arg-type]
        assert renderer.settings["texture_refinement"] == 1


def test_refined_values_have_to_fit() -> None:
    with Renderer(texture_memory=0.5) as small, pytest.raises(InputError, match="texture refinement 4 of this volume"):
        small.render(Scene(smooth_volume(16), WAVY, classification="slab"), SIZE, texture_refinement=4)


def test_the_same_scene_stays_the_same() -> None:
    scene = Scene(random_volume(1), BONE, classification="slab").completed(SIZE)
    assert refined_scene(scene, 2) is refined_scene(scene, 2) and refined_scene(scene, 1) is scene
