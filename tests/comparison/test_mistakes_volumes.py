"""Mistakes planted in scenes of several volumes, masks, labels and colours are what they are called there, too."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from support.benches import CLASSIFICATIONS, NAMED, SIZE, planted
from support.scenes import BONE, FOG, constant, random_volume

from texvol.comparison.planting import PlantedRenderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

FIRST, SECOND = random_volume(1), random_volume(2, (6, 7, 5))
LABELS = Volume(np.rint(4 * FIRST.values), FIRST.spacing, labels=True)
SCENES = {
    "two": Scene(FIRST, BONE, added=(AddedVolume(SECOND, FOG),), classification="slab"),
    "masked": Scene(FIRST, BONE, classification="post", mask=Mask(random_volume(3).values)),
    "labels": Scene(LABELS, classification="slab"),
    "labels among others": Scene(FIRST, FOG, classification="integrated", added=(AddedVolume(LABELS),)),
    "colours": Scene(
        Volume(FIRST.values, colors=np.random.default_rng(4).random((7, 8, 9, 3))), BONE, classification="slab"
    ),
}


@pytest.fixture(scope="module")
def renderer() -> Iterator[PlantedRenderer]:
    with PlantedRenderer() as opened:
        yield opened


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_fog_of_two_volumes_in_closed_form(renderer: PlantedRenderer, classification: str) -> None:
    """Two boxes of fog, 0.1 and 0.2 dense, in one place: slabs lie across the view, all rays cross 8 of both."""
    volume = Volume(np.ones((8, 8, 8), np.float32))
    camera = Camera.orthographic((3.5, 3.5, -20), (3.5, 3.5, 3.5), (0, 1, 0), height=6)
    added = (AddedVolume(Volume(np.ones((4, 4, 4)), (2, 2, 2), (0.5, 0.5, 0.5)), constant(0.2)),)
    scene = Scene(volume, constant(0.1), camera, classification=classification, added=added)  # type: ignore[arg-type]
    bench, pictures = planted(renderer, scene, slab_thickness=0.5)
    halves = 2 if classification == "integrated" else 1  # it integrates each half of a slab
    opacities = {
        "dropped slab": -np.expm1(-0.3 * 7.5),
        "double thickness": -np.expm1(-0.3 * 16),
        "linear opacity": 1 - (1 - 0.3 * 0.5 / halves) ** (16 * halves),
    }
    np.testing.assert_allclose(bench.right[..., 3], -np.expm1(-0.3 * 8), rtol=4e-6)
    for name, opacity in opacities.items():
        np.testing.assert_allclose(pictures[name][..., 3], opacity, rtol=4e-6, err_msg=name)


@pytest.mark.parametrize("name", SCENES)
def test_mistakes_show(name: str, renderer: PlantedRenderer) -> None:
    bench, pictures = planted(renderer, SCENES[name], slab_thickness=0.37)
    for mistake in (*NAMED, "double thickness", "unclipped end slabs"):
        assert isinstance(pictures[mistake], np.ndarray) and not bench.is_right(pictures[mistake]), mistake
    np.testing.assert_array_equal(renderer.render(SCENES[name], SIZE, **bench.settings), bench.right)
