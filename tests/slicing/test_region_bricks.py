"""Regions as bricks: where their samples lie in textures, whatever is stored and however long the texture is."""

from __future__ import annotations

import numpy as np
import pytest
from support.large import large

from texvol import Camera, Renderer, Scene, TransferFunction, Volume
from texvol.slicing.regions import brick_of, regions_of


@pytest.mark.parametrize("count", [17, 37, 40, 64, 100])
@pytest.mark.parametrize("margin", [1.0, 3.0, 9.0, 16.0, 33.0])
@pytest.mark.parametrize("number", [0, 1])
def test_samples_lie_in_the_middles_of_texels(count: int, margin: float, number: int) -> None:
    """Also where a texture with its room beyond is as long as the whole volume and begins elsewhere."""
    dimensions = count, 2 * count, 24
    volume, _ = large(Volume(np.zeros(dimensions[::-1], np.uint8)), 8, levels=2)
    level = volume.levels[number]
    begin_elsewhere = 0
    for region in regions_of(dimensions, 16**3):
        brick = brick_of(region, level, number, dimensions, np.full(3, margin), goes_on=True)
        samples, before, scale = brick.texture_from_box
        for axis in range(3):
            first, last, size = (each[axis] for each in (brick.stored_first, brick.stored_last, brick.texture_size))
            assert last - first <= size
            at = np.arange(first, last)
            of_finest = level.first[axis] + level.factor[axis] * at
            place = ((of_finest + 0.5) / dimensions[axis] * samples[axis] - before[axis]) * scale[axis]
            np.testing.assert_allclose(place, (at - first + 0.5) / size, atol=1e-12)
            begin_elsewhere += first > 0 and size == dimensions[axis]
    assert begin_elsewhere or not (number == 0 and margin == 16 and count in (37, 40))


def test_slabs_thicker_than_regions(renderer: Renderer) -> None:
    z, y, x = np.ogrid[:40, :44, :37]
    volume = Volume((120 + 100 * np.sin(x / 3) * np.sin(y / 4) * np.sin(z / 5)).astype(np.uint8))
    fog = TransferFunction([0, 120, 255], [(1, 0.5, 0.2), (0.2, 0.5, 1), (1, 1, 1)], [0, 0.01, 0.05])
    scene = Scene(volume, fog, Camera.framing(volume), classification="post")
    stored = Scene(large(volume, 8, memory=200_000)[0], fog, scene.camera, classification="post")
    for thickness in (9.0, 20.0):
        drawn = renderer.render(stored, (40, 32), slab_thickness=thickness, level=0)
        expected = renderer.render(scene, (40, 32), slab_thickness=thickness, texture_format="rgba32f")
        np.testing.assert_allclose(drawn, expected, atol=2e-6)
