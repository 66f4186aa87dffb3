"""Large volumes are drawn through a few textures the first time, from smaller texels, and are the same picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, random_volume, smooth_volume

from texvol.opengl import texture_store
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.slicing.bricks import layered_size
from texvol.textures import texel_format
from texvol.textures.texel_format import cheapest_texel_format

SIZE = (40, 36)
EXACT: dict[str, Any] = {"texture_format": "rgba32f", "sampling_rate": 1.5}


@pytest.fixture
def small_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have volumes of 50 kB count as large."""
    for name, size in (("_LARGE", 50_000), ("_LARGE_BRICK", 45_000), ("_AT_FIRST", 90_000)):
        monkeypatch.setattr(texture_store, name, size)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_they_are_the_same_picture_the_first_time_and_later(
    renderer: Renderer, request: pytest.FixtureRequest, classification: Classification
) -> None:
    volume = random_volume(4, (24, 22, 60))
    scene = Scene(volume, BONE, Camera.framing(volume, "perspective"), classification=classification)
    expected = renderer.render(scene, SIZE, **EXACT)
    request.getfixturevalue("small_is_large")
    with Renderer() as other:
        for again in range(3):
            assert np.abs(other.render(scene, SIZE, **EXACT) - expected).max() <= 2e-6, again
        assert quick_stats(other)["bricks_drawn"] > 3


@pytest.mark.usefixtures("small_is_large")
def test_several_at_once_are_each_in_one_piece() -> None:
    volume = random_volume(4, (24, 22, 60))
    half = replace(BONE, extinctions=BONE.extinctions / 2)
    both = Scene(volume, half, classification="extinction", added=(AddedVolume(volume, half),))
    with Renderer() as renderer:
        renderer.render(both, SIZE, **EXACT)
        assert quick_stats(renderer)["bricks_total"] == 2


@pytest.mark.parametrize(
    "dimensions, margin, expected",
    [
        ((64, 32, 100), (1, 1, 1), (64, 32, 32)),
        ((64, 32, 20), (1, 1, 1), (64, 32, 20)),
        ((64, 32, 100), (1, 1, 5), None),
    ],
)
def test_layers_are_as_thick_as_fits(dimensions: Any, margin: Any, expected: Any) -> None:
    assert layered_size(dimensions, margin, 4, 64 * 32 * 4 * 33) == expected


def test_a_large_texture_takes_a_format_that_is_not_seen(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    volume = smooth_volume(24)
    thin = TransferFunction([0, 1], [(0.5, 0.4, 0.3), (1, 1, 1)], [0.0005, 0.002])
    order = ("rgba8", "rgba16f", "rgba32f")
    for medium in (thin, BONE, constant(0.8)):
        asked = volume, medium, "slab", 0.125
        usual = cheapest_texel_format(*asked)  # type: ignore[arg-type]
        with monkeypatch.context() as patched:
            patched.setattr(texel_format, "_LARGE", 0)
            large = cheapest_texel_format(*asked)  # type: ignore[arg-type]
        assert order.index(large) <= order.index(usual)
        assert medium is not thin or (usual == "rgba32f" and large != usual)
        scene = Scene(volume, medium, classification="slab")
        pictures = [
            renderer.render(scene, SIZE, slab_thickness=0.125, texture_format=each) for each in (large, "rgba32f")
        ]
        assert np.abs(pictures[0] - pictures[1]).max() <= (1 / 1024 if large != usual else 1)
