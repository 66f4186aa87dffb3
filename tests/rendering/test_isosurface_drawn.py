"""Isosurfaces, drawn: where the oracle has them, and lit as it lights them."""

from __future__ import annotations

import numpy as np
import pytest
from support import planted
from support.projected import CAMERAS, GRIDS, SIZE, every_grid, every_view, noise, same_depths, scene_of, with_gaps
from support.quick_stats import quick_stats
from support.scenes import smooth_volume

from texvol.ray_casting.projection import isosurface_depth, project
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError


@every_view
@every_grid
def test_isosurfaces_are_where_they_are(renderer, grid, view):
    volume = noise(grid)
    scene = scene_of(volume, "isosurface", view)
    expected = isosurface_depth(scene, SIZE)
    assert np.isfinite(expected).sum() > 30
    for rate in (0.1, 1, 3.7):
        picture = renderer.render(scene, SIZE, sampling_rate=rate)
        depth = renderer.depth()
        same_depths(depth, expected, volume)
        np.testing.assert_array_equal(picture[..., 3], np.isfinite(depth))


@pytest.mark.parametrize("target_format", ["rgba8", "rgba16f"])
def test_a_depth_has_the_same_digits_whatever_the_picture_is_drawn_in(renderer, target_format):
    scene = scene_of(noise(), "isosurface")
    renderer.render(scene, SIZE, sampling_rate=1)
    expected = renderer.depth()
    assert expected[np.isfinite(expected)].max() > 1  # where 8 bits end
    renderer.render(scene, SIZE, sampling_rate=1, target_format=target_format)
    np.testing.assert_array_equal(renderer.depth(), expected)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("kind", ["nan", "inf", "-inf"])
def test_an_isosurface_beside_gaps_is_where_it_is(renderer, kind, projection):
    volume = with_gaps(kind)
    scene = scene_of(volume, "isosurface", projection, fraction=0.75)
    expected = isosurface_depth(scene, (63, 51))
    renderer.render(scene, (63, 51))
    same_depths(renderer.depth(), expected, volume)


@pytest.mark.parametrize("samples, speck", [(46, 1), (46, 4), (34, 10), (50, 7)])
def test_a_wall_behind_specks_is_met_beside_them(renderer, samples, speck):
    # Seen along an axis many slabs begin where a cell ends, which rounding puts before it or behind it.
    values = np.zeros((30, 30, samples), np.float32)
    values[1::3, 1::3, speck] = 0.6
    values[:, :, -3:] = 1
    volume = Volume(values)
    camera = Camera.orthographic(volume.centre - (100, 0, 0), volume.centre, (0, 0, 1), height=30.0)
    scene = Scene(volume, camera=camera, mode="isosurface", isovalue=0.5, classification="slab")
    for rate in (1.5, 2):
        leaping, plain = (
            renderer.render(scene, (60, 60), sampling_rate=rate, skip_empty=skip) for skip in (True, False)
        )
        np.testing.assert_array_equal(leaping[..., 3], 1)
        np.testing.assert_allclose(leaping, plain, rtol=0, atol=2e-6)


def test_a_sheet_thinner_than_a_slab_is_met(renderer):
    # The value rises to 1 in one layer of samples: crossed twice within one slab of any thickness.
    values = np.zeros((9, 9, 9), np.float32)
    values[4] = 1
    volume = Volume(values)
    camera = Camera.orthographic(volume.centre - (1, 2, 40), volume.centre, (0, 1, 0), 6)
    scene = Scene(volume, camera=camera, mode="isosurface", isovalue=0.9, classification="slab")
    eyes, directions = camera.rays(SIZE)
    expected = (3.9 - eyes[..., 2]) / directions[..., 2]
    for rate in (0.2, 0.7, 1, 5):
        renderer.render(scene, SIZE, sampling_rate=rate)
        # Places are known to 2^-22 of the box of 9.
        np.testing.assert_allclose(renderer.depth(), expected, rtol=0, atol=9 * 2.0**-20)


@pytest.mark.parametrize(
    "projection, dtype",
    [
        *(("orthographic", each) for each in (np.uint8, np.uint16, np.float64)),
        *(("perspective", each) for each in (np.int16, np.float32, np.float64)),
    ],
)
def test_values_exactly_at_the_isovalue_are_met(renderer, projection, dtype):
    """Flat regions of the isovalue itself, which rounding must not take to the other side."""
    values = np.zeros((10, 11, 12), dtype)
    values[3:8, 2:9, 4:10] = 77
    volume = Volume(values, **GRIDS["sheared"])
    for isovalue in (77, 0):
        scene = Scene(
            volume, camera=CAMERAS[projection](volume), mode="isosurface", isovalue=isovalue, classification="slab"
        )
        expected = isosurface_depth(scene, (51, 43))
        for skip in (True, False):
            picture = renderer.render(scene, (51, 43), skip_empty=skip)
            depth = renderer.depth()
            # Where only an edge is touched rounding decides.
            assert (np.isfinite(depth) == np.isfinite(expected)).mean() > 0.98
            met = np.isfinite(depth) & np.isfinite(expected)
            assert met.sum() > 80
            same_depths(depth, expected, volume)
            np.testing.assert_array_equal(picture[..., 3], np.isfinite(depth))


def test_a_volume_of_the_isovalue_is_its_box(renderer):
    volume = Volume(np.full((4, 5, 6), -3, np.int16))
    for view in CAMERAS:
        scene = Scene(volume, camera=CAMERAS[view](volume), mode="isosurface", isovalue=-3, classification="slab")
        renderer.render(scene, SIZE)
        same_depths(renderer.depth(), isosurface_depth(scene, SIZE), volume)


@pytest.mark.parametrize("view", ["orthographic", "perspective", "inside"])
def test_skipping_what_is_empty_changes_nothing(renderer, view):
    values = np.zeros((40, 33, 37), np.uint8)
    values[20:26, 8:15, 10:30] = np.random.default_rng(0).integers(90, 250, (6, 7, 20))
    volume = Volume(values, **GRIDS["sheared"])
    scene = scene_of(volume, "isosurface", view, fraction=0.5)
    skipped = renderer.render(scene, (64, 64))
    depth, stats = renderer.depth(), quick_stats(renderer, samples=True)
    everything = renderer.render(scene, (64, 64), skip_empty=False)
    np.testing.assert_allclose(renderer.depth(), depth, rtol=0, atol=1e-5 * volume.radius)
    np.testing.assert_allclose(skipped, everything, rtol=0, atol=1e-4)
    assert 0 < stats["samples"] < 0.7 * quick_stats(renderer, samples=True)["samples"]
    assert stats["cells_drawn"] < stats["cells_total"]


def test_a_depth_is_that_of_an_isosurface(renderer):
    renderer.render(scene_of(noise(), "mip"), SIZE)
    with pytest.raises(InputError, match="depth needs a picture of mode isosurface"):
        renderer.depth()
    with Renderer() as fresh, pytest.raises(InputError, match="depth needs a picture of mode isosurface"):
        fresh.depth()


# Light.


LIGHTINGS = {
    "default": None,
    "matt": Lighting(specular=0),
    "coloured": Lighting(
        (Light("directional", (1, -3, 2), (1, 0.5, 0.2)), Light("point", (7, -40, 60), (0.1, 0.3, 0.9))),
        *(0.1, 0.6, 0.5, 8.0),
    ),
    "one-sided": Lighting((Light("directional", (1, 2, 3)), Light()), two_sided=False),
    "ambient alone": Lighting((), ambient=1.0),
}


@pytest.mark.parametrize(
    "light, projection, dtype",
    [
        ("default", "orthographic", np.uint8),
        ("default", "perspective", np.float32),
        ("matt", "orthographic", np.float32),
        ("coloured", "perspective", np.uint8),
        ("one-sided", "perspective", np.float32),
        ("ambient alone", "orthographic", np.uint8),
    ],
)
def test_it_is_lit_and_cued_as_the_oracle_does(renderer, light, projection, dtype):
    volume = Volume((smooth_volume(20).values * 250).astype(dtype), **GRIDS["sheared"])
    transfer = TransferFunction([0, 250], [[1, 0.2, 0], [0, 0.5, 1]], [0, 1])
    cue = DepthCue(0.8, (0.1, 0.2, 0.3)) if light in ("default", "coloured") else None
    scene = Scene(
        volume, transfer, CAMERAS[projection](volume), (0.2, 0.3, 0.1), lighting=LIGHTINGS[light],
        gradient=Estimator("gaussian", 1.2), depth_cue=cue, mode="isosurface", isovalue=130)  # fmt: skip
    picture, expected = renderer.render(scene, SIZE), project(scene, SIZE)
    # Gradients in 16 bits have 2^-16 of the largest component, and a normal is as good where the gradient is that large
    # or a tenth of it; a highlight of exponent 30 makes 15 times as much of an angle.
    error = np.abs(picture - expected).max(axis=-1)
    assert (error < 15 * 10 * 2.0**-16).mean() > 0.99 and np.median(error) < 1e-5
    assert 50 < (expected[..., 3] == 1).sum() < expected[..., 3].size
    np.testing.assert_allclose(picture[expected[..., 3] == 0][:, :3].max(axis=0), (0.2, 0.3, 0.1), rtol=1e-6)


# The checks can fail.


FIRST_ROOT = "bool first_root(vec4 values, float from, float to, float margin, out float root)"
MISTAKES = {
    "planes half a sample off": planted.PLANES_HALF_A_SAMPLE_OFF,
    "what is crossed twice": ("vec2 turns_between(vec4 values, float from, float to)", "return vec2(from);"),
    "no refinement": (
        "float root_between(vec4 values, float side, vec2 interval, vec2 at)",
        "return interval.y;",
    ),
    "a margin of a thousandth": (FIRST_ROOT, "return first_root_right(values, from, to, 0.001 + margin, root);"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_where_it_is_is_seen(mistake):
    with planted.planted(MISTAKES[mistake]) as wrong, pytest.raises(AssertionError):
        test_isosurfaces_are_where_they_are(wrong, "sheared", "perspective")


def test_a_missing_margin_is_seen():
    none = (FIRST_ROOT, "return first_root_right(values, from, to, 1e-30 * margin, root);")
    with planted.planted(none) as wrong, pytest.raises(AssertionError):
        for projection in ("orthographic", "perspective"):
            test_values_exactly_at_the_isovalue_are_met(wrong, projection, np.float64)
            test_values_exactly_at_the_isovalue_are_met(wrong, projection, np.uint16)


def test_normals_that_look_away_are_seen():
    with (
        planted.planted(planted.NORMAL_TO_HIGHER_VALUES) as wrong,
        pytest.raises(AssertionError),
    ):
        test_it_is_lit_and_cued_as_the_oracle_does(wrong, "one-sided", "perspective", np.float32)
