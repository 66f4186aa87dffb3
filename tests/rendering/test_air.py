"""X-rays of what values are above that of air: the oracle's integral, the renderer's, and who says what air is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.projected import CAMERAS, SIZE, ct, every_grid, every_view, noise, orders_of_sums, scene_of, with_gaps
from support.quick_stats import quick_stats
from support.scenes import path_lengths, smooth_volume

from texvol.ray_casting.projection import project
from texvol.rendering.renderer import Renderer
from texvol.scene.air import HOUNSFIELD, air_in_8_bits, attenuation_of, hounsfield_by
from texvol.scene.camera import Camera
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError


def xray(volume: Volume, air, view: str = "orthographic", **more) -> Scene:
    return scene_of(volume, "xray", view, air=air, **more)


def along_z(column, air) -> float:
    """Integral through the middle of a column of samples."""
    volume = Volume(np.broadcast_to(np.array(column, np.float64)[:, None, None], (len(column), 3, 3)))
    camera = Camera.orthographic(volume.centre - (0, 0, 20), volume.centre, (0, 1, 0), 1)
    return float(project(Scene(volume, camera=camera, mode="xray", air=air, classification="slab"), (1, 1))[0, 0, 0])


@pytest.mark.parametrize(
    "column, air, number",
    [
        ([2, 2, 2], 0.5, 4.5),
        ([1, 1, 1], 1, 0),
        ([0, 4], 1, 9 / 8 + 3 / 2),  # from 0 to 4 on one spacing: above 1 on ¾ of it, and the outer half at 4
        ([0, 4], 5, 0),
        ([0, 4], -3, 2 * 3 + 4),
        ([4, 0, 4], 2, 2 * (1 / 2 + 1)),
        ([-1000, 0], HOUNSFIELD, 1 / 2 + 1 / 2),
        ([-3000, -1000, 1000], HOUNSFIELD, 1 + 1),
        ([1, -np.inf, 3], 1, 0 + 2 / 2),  # nothing beside minus infinity, and 1 + 2 in the outer halves
        ([1, np.inf, 3], 5, np.inf),
        ([np.inf, 1, -np.inf], 0, np.inf),
        ([5, np.nan, 5], 3, 2),
    ],
)
def test_the_oracle_cuts_the_integral_where_the_value_passes_that_of_air(column, air, number):
    assert along_z(column, air) == pytest.approx(number, rel=1e-13, abs=1e-13)


@every_view
@every_grid
def test_parts_above_and_below_air_add_up_to_the_plain_integral(grid, view):
    """∫ max(0, v - a) - ∫ max(0, a - v) = ∫ v - a ∫ 1, along every ray, each part by itself."""
    volume = noise(grid, np.float64)
    mirrored = Volume(-volume.values, volume.spacing, volume.origin, volume.direction)
    camera = CAMERAS[view](volume)
    line_of_sight = path_lengths(volume, camera, SIZE)
    numbers = {
        name: project(Scene(each, camera=camera, mode="xray", air=air, classification="slab"), SIZE)[..., 0]
        for name, each, air in (("above", volume, 0.45), ("below", mirrored, -0.45), ("plain", volume, None))
    }
    expected = numbers["plain"] - 0.45 * line_of_sight
    np.testing.assert_allclose(numbers["above"] - numbers["below"], expected, rtol=0, atol=1e-9 * line_of_sight.max())
    assert (numbers["above"] >= 0).all() and numbers["above"].max() > 0.01 * line_of_sight.max()


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("air", [0.3, 0.6, -2.0])
def test_what_is_above_air_converges_with_order_2(renderer, projection, air):
    """In the slab in which the value passes that of air the kink costs what a plane of samples does."""
    volume = smooth_volume(24)
    scene = xray(volume, air, projection)
    orders = orders_of_sums(renderer, scene)
    assert ((orders > 1.8) & (orders < 2.35)).all(), orders


@pytest.mark.parametrize("wanted", [0.3, 0.03])
def test_a_wanted_error_is_kept_across_the_kink(renderer, wanted):
    scene = xray(noise(), 0.6, "perspective")
    picture = renderer.render(scene, SIZE, max_error=wanted)
    assert np.abs(picture - project(scene, SIZE)).max() <= wanted
    assert renderer.stats["estimated_error"] <= wanted


@pytest.mark.parametrize(
    "dtype, fraction",
    [
        *((each, 0.5) for each in (np.uint8, np.int8, np.uint16, np.int16, np.float16, np.float32, np.float64)),
        *((each, fraction) for each in (np.int8, np.uint16, np.float32) for fraction in (-1.5, 0.0, 1.5)),
    ],
)
def test_air_within_and_beyond_the_values_of_every_type(renderer, dtype, fraction):
    volume = noise("sheared", dtype)
    low, high = volume.finite_range
    scene = xray(volume, low + fraction * (high - low))
    picture, expected = renderer.render(scene, SIZE, sampling_rate=16), project(scene, SIZE)
    np.testing.assert_array_equal(picture[..., 3], expected[..., 3])
    # As in test_projection_drawn: s²/8 of the way at s steps of samples a slab, and as much at the kinks; s is 1/7.
    line_of_sight = path_lengths(volume, scene.camera, SIZE)
    assert (np.abs(picture[..., 0] - expected[..., 0]) <= (high - low) * line_of_sight / 200).all()
    assert picture[..., 0].min() >= 0 and (fraction < 1 or not picture[..., 0].any())


@pytest.mark.parametrize("kind", ["nan", "inf", "-inf"])
def test_gaps_and_infinities_beside_air(renderer, kind):
    scene = xray(with_gaps(kind), 0.5)
    picture, expected = (each[..., 0] for each in (renderer.render(scene, SIZE, sampling_rate=8), project(scene, SIZE)))
    assert not np.isnan(picture).any() and (np.isinf(picture) == np.isinf(expected)).mean() > 0.99
    assert np.isinf(expected).any() == (kind == "inf"), "minus infinity is as good as air"
    finite = np.isfinite(picture) & np.isfinite(expected)
    # Three pairs of faces of gaps, each known to half a slab, of values up to ½ above air.
    assert np.abs(picture[finite] - expected[finite]).max() < 3 * scene.volume.smallest_spacing / 16


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("air", [HOUNSFIELD, -0.2, 0.3])
def test_minus_infinity_is_air_also_far_above_it(renderer, dtype, air):
    """All values are far above -1000: nothing but the infinite sample is air."""
    values = noise("plain", dtype).values.copy()
    values[3, 4, 5] = -np.inf
    scene = Scene(
        Volume(values), camera=CAMERAS["orthographic"](Volume(values)), mode="xray", air=air, classification="slab"
    )
    picture, expected = renderer.render(scene, SIZE, sampling_rate=32), project(scene, SIZE)
    without = project(replace(scene, volume=noise("plain", dtype)), SIZE)
    high = attenuation_of(air).per_value * (1 - attenuation_of(air).air)
    # Half a slab, 1/64, at each of up to three faces of the cells around it.
    assert np.abs(picture - expected).max() < 3 / 64 * high
    assert np.abs(expected - without).max() > 10 * 3 / 64 * high or air == 0.3


def test_bricks_and_masks_change_nothing_of_it(renderer):
    volume = Volume(np.random.default_rng(6).random((40, 40, 40)).astype(np.float32))
    scene = xray(volume, 0.7, "perspective")
    with Renderer(texture_memory=0.1) as small:
        in_bricks = small.render(scene, SIZE)
        assert quick_stats(small)["bricks_total"] > 1
    np.testing.assert_allclose(in_bricks, renderer.render(scene, SIZE), rtol=0, atol=40 * 2e-6)
    half = np.ones(volume.values.shape, bool)
    half[:, :, 20:] = False
    masked = replace(scene, mask=Mask(half))
    # What is hidden begins within half a slab, 1/32, of where it is, twice at most, and values are up to 0.3 above air.
    picture, expected = renderer.render(masked, SIZE, sampling_rate=16), project(masked, SIZE)
    np.testing.assert_allclose(picture, expected, rtol=0, atol=0.02)


@pytest.mark.parametrize("padding", [None, -2000.0, -3024.0])
def test_hounsfield_units_are_known_by_air_and_water(padding):
    volume = Volume(ct(padding=padding))
    assert hounsfield_by(volume) == "values" and air_in_8_bits(volume) == HOUNSFIELD


@pytest.mark.parametrize(
    "values",
    [
        np.clip(ct(), 0, None),
        (ct() + 1024).astype(np.uint16),
        np.random.default_rng(0).integers(-4096, 4096, (24, 24, 24)),  # such as the phase of MR
        np.random.default_rng(0).integers(-600, 3000, (24, 24, 24)),
        np.where(ct() < -500, -600, ct()),
        np.linspace(-3000, 3000, 24**3).reshape(24, 24, 24),
        np.zeros((3, 3, 3)),
        np.full((3, 3, 3), np.nan),
    ],
    ids=["cut off", "rescaled", "phase", "no air", "other air", "ramp", "nothing", "missing"],
)
def test_other_values_are_not_taken_for_hounsfield_units(values):
    volume = Volume(values)
    assert hounsfield_by(volume) == ""
    assert air_in_8_bits(volume) == (volume.finite_range[0] if volume.finite_range else None)


def test_the_file_knows_better_than_the_values():
    cropped = np.clip(ct(), 0, 100)
    for unit in ("HU", "hu", "[hnsf'U]", "Hounsfield units"):
        assert hounsfield_by(Volume(cropped, value_unit=unit)) == "file"
    assert hounsfield_by(Volume(ct(), value_unit="BQML")) == ""
    assert hounsfield_by(Volume(np.zeros((2, 2, 2), np.uint8), labels=True, value_unit="HU")) == ""


def test_wrong_air_is_refused():
    volume = Volume(np.zeros((2, 2, 2)))
    for air in (np.nan, np.inf, "air", True, (1, 2)):
        with pytest.raises(InputError, match="air must be a finite number, 'hounsfield' or None, got"):
            Scene(volume, mode="xray", air=air, classification="slab")
    for mode in ("composite", "mip", "average"):
        with pytest.raises(InputError, match=f"air needs mode xray, got mode {mode}"):
            Scene(volume, mode=mode, air=0.0, classification="slab")
    assert Scene(volume, mode="xray", air=np.int16(-3), classification="slab").air == -3.0
    assert attenuation_of(HOUNSFIELD) == (-1000, 1 / 1000)
