"""Sampling rate that nobody chose: as fine as the picture's own error needs, and the same every time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.scenes import BONE, smooth_volume

from texvol import Lighting, Renderer, Scene
from texvol.rendering import default_rate

SIZE = (96, 96)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A lit surface that has rings at one slab per voxel."""
    return Scene(smooth_volume(40), BONE, lighting=Lighting())


def test_the_estimate_is_within_its_limit(scene: Scene) -> None:
    with Renderer() as renderer:
        renderer.render(scene, SIZE, sampling_rate=1)
        coarse = renderer.stats
        renderer.render(scene, SIZE)
        stats = renderer.stats
        quick = renderer.quick_estimate()
    assert stats["classification"] == "post"
    assert coarse["estimated_error"] > default_rate.LIMIT >= stats["estimated_error"]
    assert quick is not None and quick <= default_rate.LIMIT
    factor = coarse["slab_thickness"] / stats["slab_thickness"]
    assert factor in (2, 4, 8, 16)


def test_what_is_asked_for_stays(scene: Scene) -> None:
    spacing = scene.volume.smallest_spacing
    with Renderer() as renderer:
        for given in ({"sampling_rate": 1.0}, {"slab_thickness": spacing}):
            renderer.render(scene, SIZE, **given)
            assert renderer.settings["slab_thickness"] == spacing
        for kind in ("post", "slab", "extinction", "integrated"):
            renderer.render(replace(scene, classification=kind), SIZE)
            assert renderer.settings["slab_thickness"] == spacing


def test_the_same_scene_gives_the_same_picture(scene: Scene) -> None:
    with Renderer() as one, Renderer() as other:
        first = one.render(scene, SIZE)
        one.render(replace(scene, background=(0, 0, 1)), SIZE)
        np.testing.assert_array_equal(one.render(scene, SIZE), first)
        np.testing.assert_array_equal(other.render(scene, SIZE), first)


def test_no_more_slabs_are_crossed_than_half_a_second_has(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(default_rate, "_MOST_CROSSED", 0)
    with Renderer() as renderer:
        renderer.render(scene, SIZE)
        assert renderer.settings["slab_thickness"] == scene.volume.smallest_spacing
