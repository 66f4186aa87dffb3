"""A ray that ends early loses no more light than it was told it may."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from support.pairs import each_classification_in_a_projection
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, inside, random_volume, smooth_volume

from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import DEFAULT_EARLY_TERMINATION
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (48, 40)
ROUNDING = 1e-6
FRACTIONS = (1 / 16, 1 / 100, 1 / 1024, 2.0**-16, DEFAULT_EARLY_TERMINATION)
classifications = pytest.mark.parametrize("classification", CLASSIFICATIONS)

# Colours that differ as much as they can, so that what is hidden would show.
DENSE = TransferFunction(
    np.array([0, 0.4, 0.6, 1]), np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]), np.array([0.1, 0.8, 2.0, 5.0])
)


@pytest.fixture(scope="module")
def renderers() -> Iterator[list[Renderer]]:
    """One with room for the whole volume, and one that draws it in bricks."""
    with Renderer() as whole, Renderer(texture_memory=0.4) as bricks:
        yield [whole, bricks]


@each_classification_in_a_projection
@pytest.mark.parametrize("eye", ["outside", "inside"])
def test_no_more_light_is_lost_than_may_be(
    renderers: list[Renderer], classification: Classification, projection: Projection, eye: str
) -> None:
    noise = random_volume(6, (40, 36, 33))
    volume = Volume(np.repeat(noise.values[::3], 3, axis=0), noise.spacing)
    camera = Camera.framing(volume, projection) if eye == "outside" else inside(volume, projection)
    scene = Scene(volume, DENSE, camera, classification=classification)
    for renderer in renderers:
        truth = renderer.render(scene, SIZE, early_termination=0, texture_format="rgba32f")
        errors = []
        for fraction in FRACTIONS:
            picture = renderer.render(scene, SIZE, early_termination=fraction, texture_format="rgba32f")
            errors.append(np.abs(picture - truth).max())
            assert errors[-1] <= fraction + ROUNDING
        assert errors[0] > 1 / 1024, "rays do end"
        assert truth[..., 3].max() > 0.99


@pytest.mark.parametrize(
    "classification, added",
    [*((each, False) for each in CLASSIFICATIONS), ("extinction", True), ("integrated", True)],
)
def test_what_glows_more_than_white_is_seen_from_farther_behind(
    renderers: list[Renderer], classification: Classification, added: bool
) -> None:
    values = np.repeat([1.0, 2.0], 20)[:, np.newaxis, np.newaxis] * np.ones((1, 6, 6))
    volume = Volume(values.astype(np.float32))
    bright = np.array([(0, 0, 0), (0, 0, 0), (1e4, 2e4, 1e4), (1e4, 2e4, 1e4)])
    glowing = TransferFunction([1, 1.5, 1.5, 2], bright, np.array([0.4, 0.4, 0, 0]), emissive=True)
    camera = Camera.orthographic(volume.centre - (0, 0, 60), volume.centre, (0, 1, 0), height=5)
    scene = Scene(volume, glowing, camera, classification=classification)
    if added:
        scene = replace(scene, added=(AddedVolume(Volume(np.ones((4, 4, 4)) * 0.1), DENSE),))
    truth = renderers[0].render(scene, (8, 8), early_termination=0)
    assert truth[4, 4, 1] > 10
    for fraction in FRACTIONS:
        picture = renderers[0].render(scene, (8, 8), early_termination=fraction)
        assert np.abs(picture - truth).max() <= fraction


@classifications
def test_the_sooner_a_ray_ends_the_fewer_slabs_are_sampled(
    renderers: list[Renderer], classification: Classification
) -> None:
    volume = random_volume(6, (40, 36, 33))
    scene = Scene(volume, DENSE, Camera.framing(volume), classification=classification)
    samples = []
    for fraction in (*FRACTIONS, 0):
        renderers[0].render(scene, SIZE, early_termination=fraction, sampling_rate=3)
        stats = quick_stats(renderers[0], samples=True)
        assert stats["early_termination"] == fraction
        samples.append(stats["samples"])
    assert samples == sorted(samples)
    # At 0 a ray never ends, even where float32 has opacity 1.
    assert samples[0] < samples[4] < samples[5] == stats["samples_total"]
    assert samples[0] < 0.5 * samples[5]


@classifications
def test_opaque_matter_is_not_looked_behind(renderers: list[Renderer], classification: Classification) -> None:
    volume = Volume(np.ones((63, 63, 63), np.uint8))
    opaque = TransferFunction(np.zeros(1), np.ones((1, 3)), np.array([np.inf]))
    scene = Scene(volume, opaque, Camera.framing(volume), classification=classification)
    picture = renderers[0].render(scene, SIZE)
    assert picture[20, 24, 3] == 1.0
    # The slab in front, the one after it, and what the box cuts short behind.
    assert quick_stats(renderers[0], samples=True)["samples"] <= 4 * SIZE[0] * SIZE[1]


def test_thin_matter_is_seen_to_its_end(renderers: list[Renderer]) -> None:
    volume = smooth_volume(20)
    scene = Scene(volume, FOG, Camera.framing(volume), classification="slab")
    truth = renderers[0].render(scene, SIZE, early_termination=0)
    picture = renderers[0].render(scene, SIZE, early_termination=0.01)
    np.testing.assert_array_equal(picture, truth)
    stats = quick_stats(renderers[0], samples=True)
    assert stats["samples"] == stats["samples_total"]


@pytest.mark.parametrize("max_error, expected", [(0.008, 0.0005), (1 / 64, 1 / 1024), (0.5, 1 / 1024)])
def test_a_wanted_error_gives_a_share_of_itself(renderers: list[Renderer], max_error: float, expected: float) -> None:
    volume = smooth_volume(17)
    scene = Scene(volume, BONE, Camera.framing(volume), classification="post")
    renderers[0].render(scene, (24, 24), max_error=max_error)
    assert quick_stats(renderers[0])["early_termination"] == expected
    renderers[0].render(scene, (24, 24), max_error=max_error, early_termination=0.25)
    assert quick_stats(renderers[0])["early_termination"] == 0.25


@pytest.mark.parametrize("fraction", [-1e-9, 1.0, 2.0, np.inf, -np.inf, np.nan])
def test_what_is_no_transmittance_is_refused(renderers: list[Renderer], fraction: float) -> None:
    scene = Scene(Volume(np.ones((2, 2, 2))), FOG, classification="slab")
    with pytest.raises(InputError, match="early termination must be a transmittance from 0 to below 1"):
        renderers[0].render(scene, SIZE, early_termination=fraction)
