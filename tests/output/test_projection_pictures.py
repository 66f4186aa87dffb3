"""Pictures of the projection modes and each other: bricks, order, and what is said of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.projected import GRIDS, MODES, NUMBERS, SIZE, every_mode, noise, same_depths, scene_of
from support.scenes import random_volume, smooth_volume

from texvol.ray_casting import raycast
from texvol.ray_casting.projection import project
from texvol.rendering.renderer import Renderer
from texvol.scene.volume import Volume

# Each pair of mode, kind of values and projection.
BRICKED = [
    (mode, kind, ("orthographic", "perspective")[(i + j) % 2])
    for i, mode in enumerate(MODES)
    for j, kind in enumerate(("uint8", "nan", "inf"))
]


@pytest.mark.parametrize("mode, kind, projection", BRICKED)
def test_bricks_are_the_whole(renderer, mode, kind, projection):
    values = np.random.default_rng(4).integers(0, 256, (30, 34, 38)).astype(np.uint8 if kind == "uint8" else np.float32)
    if kind != "uint8":
        values[10:14, 8:20, 5:20] = float(kind)
    volume = Volume(values, **GRIDS["sheared"])
    scene = scene_of(volume, mode, projection)
    whole = renderer.render(scene, SIZE)
    depth = renderer.depth() if mode == "isosurface" else None
    texels = values.size * ((8 if kind == "uint8" else 16) if mode == "isosurface" else values.itemsize)
    with Renderer(texture_memory=texels / 2e6) as bricked:
        picture = bricked.render(scene, SIZE)
        assert len(bricked._pictures.in_memory.cache.volumes[0].textures.bricks) > 8
        if depth is not None:
            same_depths(bricked.depth(), depth, volume)
    np.testing.assert_array_equal(np.isfinite(picture), np.isfinite(whole))
    finite = np.isfinite(whole[..., 0])
    if mode == "isosurface":
        # Where a ray grazes the surface, rounding turns the normal.
        assert (np.abs(picture - whole).max(axis=-1) < 2e-4).mean() > 0.995
    else:
        scale = 255.0 * (np.ptp(whole[..., 0][finite]) / 255.0 if mode == "xray" else 1)
        np.testing.assert_allclose(picture[finite], whole[finite], rtol=0, atol=2e-6 * scale)


def test_a_picture_does_not_depend_on_what_was_drawn_before(renderer):
    volume = noise("sheared", np.int16, (20, 21, 22))
    scenes = [scene_of(volume, mode, "perspective") for mode in MODES]
    scenes += [replace(scenes[-1], mode="composite", isovalue=None, classification=name) for name in ("post", "slab")]
    scenes += [replace(scenes[4], isovalue=float(volume.finite_range[1]) / 3), scene_of(random_volume(3), "mip")]
    fresh = []
    for scene in scenes:
        with Renderer() as each:
            fresh.append(each.render(scene, SIZE))
    for i in np.random.default_rng(6).integers(0, len(scenes), 24):
        np.testing.assert_array_equal(renderer.render(scenes[i], SIZE), fresh[i], err_msg=scenes[i].mode)
        np.testing.assert_array_equal(renderer.render(scenes[i], SIZE, repeat=2), fresh[i])


@every_mode
def test_raycast_is_the_oracle_of_every_mode(mode):
    scene = scene_of(noise(), mode, background=(0.1, 0.2, 0.3))
    np.testing.assert_array_equal(raycast(scene, SIZE), project(scene, SIZE))


@every_mode
def test_stats_say_what_was_drawn(renderer, mode):
    volume = Volume(smooth_volume(24).values * 1000)
    scene = scene_of(volume, mode, "perspective")
    picture = renderer.render(scene, (96, 80))
    stats = renderer.stats
    modelled = {"perspective", mode} | ({"central gradient", "head light"} if mode == "isosurface" else set())
    assert set(stats["modelled"]) == modelled
    assert 0 < stats["samples"] <= stats["samples_total"]
    if mode != "isosurface":
        error = np.abs(picture - project(scene, (96, 80))).max()
        assert error <= stats["estimated_error"] <= max(20 * error, 0.01)


@pytest.mark.parametrize("mode", NUMBERS)
def test_an_error_is_asked_for_in_the_numbers_units(renderer, mode):
    volume = Volume(smooth_volume(24).values * 1000)
    scene = scene_of(volume, mode, "perspective")
    expected = project(scene, (96, 80))
    wanted = 20.0 if mode == "xray" else 1.0
    picture = renderer.render(scene, (96, 80), max_error=wanted)
    assert np.abs(picture - expected).max() <= wanted
    assert renderer.stats["estimated_error"] <= wanted
