"""A transfer function as a sum of ramps is the transfer function."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from support.scenes import BONE, random_volume, smooth_volume

from texvol.opengl.shaders import FOLDER
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.ramps import NUMBERS_OF_RAMPS, STEP_MARGIN, ramp_uniforms
from texvol.textures.value_texture import bake_values

SIZE = (32, 24)
seeds = st.integers(0, 2**32 - 1)


def medium_of(random: np.random.Generator, segments: int, emissive: bool) -> TransferFunction:
    """So many segments between 0 and 1, some of them steps, some of nothing, of extinctions 1e-4 … 1."""
    values = random.random(segments + 1)
    values[random.random(segments + 1) < 0.3] = values[0]
    extinctions = 10 ** random.uniform(-4, 0, segments + 1) * (random.random(segments + 1) < 0.7)
    colors = random.random((segments + 1, 3)) * (random.random((segments + 1, 1)) < 0.8)
    return TransferFunction(np.sort(values), colors * (0.2 if emissive else 1.0), extinctions, emissive)


def sums(ramps: dict[str, Any], values: np.ndarray) -> np.ndarray:
    """What the shader adds up, in float32, shape (n, 4)."""
    values = values.astype(np.float32)[:, np.newaxis]
    total = np.broadcast_to(np.float32(ramps["ramp_base"]), (values.size, 4))
    for rise, (start, per_width, _) in zip(ramps["ramp_rises"], np.float32(ramps["ramp_positions"]), strict=True):
        with np.errstate(over="ignore", invalid="ignore"):
            fraction = np.clip((values - start) * per_width, 0, 1)
        total = total + np.float32(rise) * fraction
    assert total.dtype == np.float32
    return total


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seeds, st.integers(1, 24), st.sampled_from([1.0, 1e-9, 1e9, -300.0]))
@example(0, 24, 1.0)
def test_the_sum_is_the_transfer_function(seed: int, segments: int, scale: float) -> None:
    random = np.random.default_rng(seed)
    plain = medium_of(random, segments, emissive=False)
    values = np.float32(np.sort(plain.values * scale)).astype(np.float64)
    medium = replace(plain, values=values)
    ramps = ramp_uniforms(values, medium.numbers, True)
    assume(ramps is not None)  # digits lost beside a much larger number
    span = np.ptp(values) or 1.0
    asked = np.concatenate([random.uniform(values[0] - span, values[-1] + span, 300), values])
    # No nearer to a step than it may be moved, but for its own place, where the right side holds.
    steps = values[1:][np.diff(values) == 0]
    near = (np.abs(asked[:, np.newaxis] - steps) < 4 * STEP_MARGIN * np.abs(steps)) & (asked[:, np.newaxis] != steps)
    asked = np.float32(asked[~near.any(axis=1)])
    found, expected = sums(ramps, asked), medium.at(asked)
    # A value between two points is between their numbers, and rounds by the larger one's digits; so does its place.
    largest = medium.numbers.max(axis=0)
    widths = np.diff(values)[np.diff(values) > 0]
    blur = 1e-6 + 2.0**-22 * np.abs(values).max() / min(widths, default=1.0)
    assert (np.abs(found - expected) <= 1e-30 + largest * blur).all()
    np.testing.assert_allclose(sums(ramps, np.float32(values)), medium.at(values), rtol=2e-6, atol=0)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seeds, st.integers(1, 24))
def test_the_sum_is_zero_where_the_transfer_function_is(seed: int, segments: int) -> None:
    random = np.random.default_rng(seed)
    medium = medium_of(random, segments, emissive=False)
    values = np.float32(medium.values).astype(np.float64)
    ramps = ramp_uniforms(values, medium.numbers, True)
    assume(ramps is not None)
    for first, last, one, other in zip(values[:-1], values[1:], medium.numbers[:-1], medium.numbers[1:], strict=True):
        if last - first > 1e-3:
            between = np.linspace(first + 1e-4, last - 1e-4, 20)
            nothing = (one == 0) & (other == 0)
            assert not sums(ramps, between)[:, nothing].any()


def medium_of_ramps(number: int, volume: Volume, classification: Classification, emissive: bool) -> TransferFunction:
    """The first random medium that so many ramps of the shader are needed for."""
    media = (medium_of(np.random.default_rng(seed), number, emissive) for seed in range(1000))
    return next(
        medium for medium in media if bake_values(volume, medium, classification).switches(1.0, True)["RAMPS"] == number
    )


# Emissive or not, projection, and values that are missing or not: every two of them meet.
WAYS = (
    (False, "orthographic", False),
    (True, "perspective", False),
    (True, "orthographic", True),
    (False, "perspective", True),
)
NUMBERS = [("post", number) for number in NUMBERS_OF_RAMPS] + [("integrated", number) for number in (2, 4, 8, 12)]


@pytest.mark.parametrize(
    "classification, number, emissive, projection, missing",
    [(*how, *way) for how, way in zip(NUMBERS, itertools.cycle(WAYS), strict=False)],
)
def test_a_picture_by_ramps_is_that_by_segments(
    renderer: Renderer,
    classification: Classification,
    number: int,
    emissive: bool,
    projection: Projection,
    missing: bool,
) -> None:
    volume = random_volume(number, (7, 6, 5))
    if missing:
        values = volume.values.copy()
        values[np.random.default_rng(number).random(values.shape) < 0.1] = np.nan
        volume = Volume(values, volume.spacing, name=volume.name)
    medium = medium_of_ramps(number, volume, classification, emissive)
    scene = Scene(volume, medium, Camera.framing(volume, projection), classification=classification)
    by_ramps = renderer.render(scene, SIZE)
    with patch("texvol.textures.stored_function.ramp_uniforms", return_value=None):
        by_segments = renderer.render(replace(scene, transfer_function=replace(medium)), SIZE)
    brightest = max(1.0, float(by_segments.max()))
    # The steepest ramp takes a value's rounding to that of its numbers.
    widths = np.diff(medium.values)[np.diff(medium.values) > 0]
    steepest = 2.0**-24 / min(widths, default=1.0)
    np.testing.assert_allclose(by_ramps, by_segments, rtol=0, atol=brightest * (1e-6 + 10 * steepest))


@pytest.mark.parametrize("classification", ["post", "integrated"])
@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.uint16, np.int16, np.float16, np.float32, np.float64])
def test_any_type_of_values_by_ramps(renderer: Renderer, dtype: type, classification: Classification) -> None:
    """Flat layers of which some lie exactly on a step."""
    values = np.array([3, 90, 91, 120]).astype(dtype)
    volume = Volume(np.broadcast_to(values[:, np.newaxis, np.newaxis], (4, 5, 6)).copy())
    medium = TransferFunction(
        np.array([0, 90.0, 90, 100, 120, 120]), np.eye(6, 3), np.array([0.01, 0.02, 0.3, 0.1, 0.05, 0.7])
    )
    camera = Camera.orthographic((2.5, -20.0, 1.5), (2.5, 2, 1.5), (0, 0, 1), height=4)
    scene = Scene(volume, medium, camera, classification=classification)
    by_ramps = renderer.render(scene, (8, 8))
    with patch("texvol.textures.stored_function.ramp_uniforms", return_value=None):
        by_segments = renderer.render(replace(scene, transfer_function=replace(medium)), (8, 8))
    # A value is known to some 2^-22 of the largest stored; colour and depth change by up to 0.2 per unit.
    blur = 2.0**-22 * (65536 if np.dtype(dtype).kind in "iu" and np.dtype(dtype).itemsize == 2 else 256)
    np.testing.assert_allclose(by_ramps, by_segments, rtol=0, atol=1e-6 + 0.2 * blur)
    assert by_ramps[..., 3].min() > 0


def test_what_is_nothing_is_drawn_as_nothing(renderer: Renderer) -> None:
    """To the last bit, though sums of other numbers come before it; where nothing is leapt over."""
    volume = Volume(0.3 + 0.2 * smooth_volume(12).values)
    medium = TransferFunction(
        np.array([0, 0.1, 0.2, 0.25, 0.55, 0.6]), np.ones((6, 3)), np.array([9.7, 0.33, 2.1, 0, 0, 7.7])
    )
    scene = Scene(volume, medium, classification="post")
    assert bake_values(volume, medium, "post").switches(1.0, True)["RAMPS"]
    assert not renderer.render(scene, SIZE, skip_empty=False).any()


@pytest.mark.parametrize(
    "classification, segments, ramps",
    [("post", 24, 24), ("post", 25, 0), ("integrated", 12, 12), ("integrated", 13, 0)],
)
def test_more_ramps_than_there_are_are_looked_up(classification: Classification, segments: int, ramps: int) -> None:
    values = np.linspace(0, 1, segments + 1)
    medium = TransferFunction(values, np.repeat(values[:, np.newaxis], 3, axis=1), values)
    baked = bake_values(smooth_volume(8), medium, classification)
    assert baked.switches(1.0, True)["RAMPS"] == ramps
    assert bool(baked.tables) == (ramps == 0)
    assert ("ramp_base" in baked.uniforms(1.0)) == (ramps > 0)


def test_a_flat_stretch_takes_no_ramp() -> None:
    values = np.linspace(0, 1, 41)
    numbers = np.repeat(np.arange(41)[:, np.newaxis] // 2, 4, axis=1)  # 20 rises, 20 flat ones
    ramps = ramp_uniforms(values, numbers.astype(float), True)
    assert ramps is not None
    assert len(ramps["ramp_rises"]) == len(ramps["ramp_positions"]) == 24
    assert np.count_nonzero(np.array(ramps["ramp_rises"]).any(axis=1)) == 20


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seeds, st.integers(1, 24))
def test_contiguous_ramps_end_where_others_start_or_all_do(seed: int, segments: int) -> None:
    medium = medium_of(np.random.default_rng(seed), segments, emissive=False)
    ramps = ramp_uniforms(medium.values, medium.numbers, True, contiguous=True)
    assume(ramps is not None)
    positions = np.float32(ramps["ramp_positions"])
    rising = np.array(ramps["ramp_rises"]).any(axis=1)
    assert set(positions[rising, 2]) <= {*positions[:, 0], positions[-1, 2]}


def test_infinite_extinctions_and_lost_digits_are_looked_up() -> None:
    volume = smooth_volume(8)
    opaque = TransferFunction(np.array([0, 0.5, 1]), np.ones((3, 3)), np.array([0, 0.1, np.inf]))
    far_apart = TransferFunction(np.array([0, 0.5, 1]), np.ones((3, 3)), np.array([0, 1e9, 1e-3]))
    for medium in (opaque, far_apart):
        baked = bake_values(volume, medium, "post")
        assert baked.switches(1.0, True)["RAMPS"] == 0
        assert set(baked.tables) == {"segments", "segment_grid"}


def test_where_nothing_shows_there_is_no_ramp() -> None:
    assert bake_values(smooth_volume(8), BONE, "integrated").switches(1.0, True)["RAMPS"] == 3  # of four
    assert bake_values(smooth_volume(8), BONE, "post").switches(1.0, True)["RAMPS"] == 3


def test_the_shader_has_the_same_numbers_of_ramps() -> None:
    text = (FOLDER / "each_ramp.glsl").read_text()
    assert tuple(map(int, re.findall(r"RAMPS == (\d+)", text))) == NUMBERS_OF_RAMPS
    for number in NUMBERS_OF_RAMPS:
        assert f"#define EACH_RAMP(F) EACH_OF_{number}(F)" in text
