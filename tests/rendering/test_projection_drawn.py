"""Pictures of numbers, drawn, against the oracle's and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support import planted
from support.projected import (
    CAMERAS,
    GRIDS,
    NUMBERS,
    SIZE,
    every_grid_and_view,
    every_mode,
    noise,
    orders_of_sums,
    rounding,
    same_depths,
    scene_of,
    with_gaps,
)
from support.scenes import path_lengths, smooth_volume

from texvol.ray_casting.projection import isosurface_depth, project
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.slicing.bounds import bounds_of


@every_grid_and_view("mip", "minip")
def test_extremes_are_exact(renderer, mode, grid, view):
    volume = noise(grid)
    scene = scene_of(volume, mode, view)
    expected = project(scene, SIZE)
    for rate in (0.1, 1, 3.7):  # however thick slabs are
        picture = renderer.render(scene, SIZE, sampling_rate=rate)
        np.testing.assert_array_equal(picture[..., 3], expected[..., 3])
        np.testing.assert_allclose(picture, expected, rtol=0, atol=rounding(volume))
    assert (expected[..., 3] == 1).any() and (view.startswith("inside") or (expected[..., 3] == 0).any())


@every_grid_and_view("mip", "minip")
@pytest.mark.parametrize("kind", ["smooth", "gaps"])
def test_extremes_without_skipped_cells_are_the_same(renderer, mode, grid, view, kind):
    samples = np.random.default_rng(3).random((21, 18, 23))
    if kind == "smooth":
        samples = np.add.outer(np.sin(np.arange(21) / 3), np.cos(np.add.outer(np.arange(18), np.arange(23)) / 5))
    if kind == "gaps":
        samples[4:13, 5:9, 3:15] = np.nan
    volume = Volume(samples.astype(np.float32), **GRIDS[grid])
    scene = scene_of(volume, mode, view)
    few, every = (renderer.render(scene, SIZE, skip_empty=skips) for skips in (True, False))
    np.testing.assert_array_equal(few[..., 3], every[..., 3])
    np.testing.assert_allclose(few, every, rtol=0, atol=3 * rounding(volume))


@pytest.mark.parametrize("mode", ["mip", "minip"])
def test_a_cell_of_a_small_bound_is_skipped(renderer, mode, monkeypatch):
    """The largest or least value lies in a cell that its bound, which is wrong here, excludes."""
    sign = 1 if mode == "mip" else -1
    values = np.zeros((16, 16, 16), np.float32)
    values[5:7, 5:7, 5:7], values[8:12] = sign, 0.5 * sign
    monkeypatch.setattr("texvol.opengl.value_bounds.bounds_of", lambda *how: 0.9 * bounds_of(*how) * small)
    small = np.ones((4, 4, 4), np.float32)
    small[1, 1, 1] = 0
    scene = scene_of(Volume(values), mode, "along an axis")
    skipping, every = (renderer.render(scene, SIZE, skip_empty=skips) for skips in (True, False))
    assert abs(every[..., 0]).max() == 1 and abs(skipping[..., 0]).max() == 0.5


@pytest.mark.parametrize("mode", ["mip", "minip"])
def test_what_rays_meet_in_many_cells_of_larger_bounds_is_found(renderer, mode):
    """Beside each ray along z are 40 samples larger than all that it meets, and what it meets grows along it."""
    sign = 1 if mode == "mip" else -1
    values = np.zeros((160, 4, 12), np.float32)
    values[:, :, :8] = sign * np.linspace(0, 0.5, 160, dtype=np.float32)[:, np.newaxis, np.newaxis]
    values[2::4, 1, 9] = sign * np.linspace(1, 0.9, 40)
    volume = Volume(values)
    camera = Camera.orthographic(volume.centre - (0, 0, 200), volume.centre, (0, 1, 0), height=4)
    picture = renderer.render(Scene(volume, camera=camera, mode=mode), (36, 12))
    np.testing.assert_allclose(picture, project(Scene(volume, camera=camera, mode=mode), (36, 12)), rtol=0, atol=1e-6)
    assert (abs(picture[..., 0]) == 0.5).any() and (abs(picture[..., 0]) > 0.9).any()


@every_grid_and_view("xray", "average")
def test_sums_approach_those_of_the_oracle(renderer, mode, grid, view):
    volume = noise(grid)
    scene = scene_of(volume, mode, view)
    expected, direction = project(scene, SIZE), path_lengths(volume, scene.camera, SIZE)
    scale = direction if mode == "xray" else np.ones(SIZE[::-1])
    # The midpoint rule over a slab of length h loses h² v'' / 24 on average, and at a kink h (change of slope) / 8 in
    # the slab that holds it. With steps of s samples along the axes no slope of noise from 0 to 1 is over s per slab:
    # at a kink s / 4 times the slab at most. Rays cross s planes per slab, so that s²/4 of the way is the bound; the
    # whole of it in all slabs with the same sign is far from what noise does, hence the 1/8. Where the way is shorter
    # than a slab its middle alone counts.
    # At 64 slabs per spacing that is 3e-4 of the way at most: numbers a hundredth off are over it.
    rate = 64
    picture = renderer.render(scene, SIZE, sampling_rate=rate)
    steps = np.abs(volume.index_from_world).sum() * volume.smallest_spacing / rate
    np.testing.assert_array_equal(picture[..., 3], expected[..., 3])
    error = np.abs(picture[..., 0] - expected[..., 0])
    assert (error <= (steps**2 / 8 + 2e-6) * scale).all()


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("mode", ["xray", "average"])
def test_sums_converge_with_order_2(renderer, mode, projection):
    volume = smooth_volume(24)
    scene = scene_of(volume, mode, projection)
    orders = orders_of_sums(renderer, scene)
    assert ((orders > 1.8) & (orders < 2.3)).all(), orders


@every_mode
@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.uint16, np.int16, np.float16, np.float32, np.float64])
def test_values_of_every_type_are_shown_in_their_own_units(renderer, mode, dtype):
    volume = noise("sheared", dtype)
    scene = scene_of(volume, mode)
    picture = renderer.render(scene, SIZE, sampling_rate=4)
    if mode == "isosurface":
        same_depths(renderer.depth(), isosurface_depth(scene, SIZE), volume)
        return
    expected = project(scene, SIZE)
    low, high = volume.finite_range
    # Of sums a loose bound: what is asked here is the unit.
    scale = 2 * volume.radius if mode == "xray" else 1.0
    atol = rounding(volume) if mode in ("mip", "minip") else 0.01 * scale * (high - low)
    np.testing.assert_allclose(picture[..., 0], expected[..., 0], rtol=0, atol=atol)


@every_mode
def test_a_small_range_on_a_large_number_keeps_its_digits(renderer, mode):
    small = noise()
    large = Volume(1e9 + small.values.astype(np.float64))
    scene = scene_of(large, mode)
    picture = renderer.render(scene, SIZE, sampling_rate=4)
    if mode == "isosurface":
        same_depths(renderer.depth(), isosurface_depth(scene, SIZE), large)
        return
    # The picture is of float32, whose steps are 64 here; the way of an X-ray is a sum of float32, too.
    expected = project(scene, SIZE)
    np.testing.assert_allclose(picture[..., 0], expected[..., 0], rtol=2.0**-22)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("kind", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("mode", ["mip", "minip"])
def test_extremes_beside_gaps_are_exact(renderer, mode, kind, projection):
    volume = with_gaps(kind)
    scene = scene_of(volume, mode, projection)
    expected, picture = project(scene, SIZE), renderer.render(scene, SIZE)
    np.testing.assert_array_equal(picture[..., 3], expected[..., 3])
    np.testing.assert_array_equal(np.isinf(picture), np.isinf(expected))
    finite = np.isfinite(expected)
    # Beside NaN cubics go on beyond where they were looked up: each value counts up to three times.
    np.testing.assert_allclose(picture[finite], expected[finite], rtol=0, atol=3 * rounding(volume))
    infinite_extreme = kind == ("inf" if mode == "mip" else "-inf")
    assert np.isinf(expected).any() == infinite_extreme and finite.any()


@pytest.mark.parametrize("mode", ["xray", "average"])
def test_gaps_in_sums(renderer, mode):
    fine = {"sampling_rate": 8}
    holes = scene_of(with_gaps("nan"), mode)
    picture, expected = renderer.render(holes, SIZE, **fine), project(holes, SIZE)
    assert np.isfinite(picture).all()
    # The edge of a gap is known to half a slab, at three pairs of faces: an eighth of a sample, of values up to 1.
    direction = path_lengths(holes.volume, holes.camera, SIZE)
    met = expected[..., 3] * picture[..., 3] > 0
    error = np.abs(picture[..., 0] - expected[..., 0])[met]
    assert (error < 3 * holes.volume.smallest_spacing / 8).all() if mode == "xray" else np.median(error) < 0.02
    assert (direction[picture[..., 3] != expected[..., 3]] < holes.volume.smallest_spacing).all()
    for kind, number in (("inf", np.inf), ("-inf", -np.inf)):
        scene = scene_of(with_gaps(kind), mode)
        picture, expected = renderer.render(scene, SIZE, **fine)[..., 0], project(scene, SIZE)[..., 0]
        assert (picture[np.isinf(picture)] == number).all()
        assert (np.isinf(picture) == np.isinf(expected)).mean() > 0.99 and np.isinf(picture).any()
    column = np.array([np.inf, 1, 2, 3, -np.inf], np.float32)[:, None, None]
    both = Volume(np.broadcast_to(column, (5, 3, 3)))
    scene = Scene(both, camera=Camera.framing(both, eye=both.centre - (0, 0, 20)), mode=mode, classification="slab")
    assert np.isnan(renderer.render(scene, (1, 1))[0, 0, :3]).all() and np.isnan(project(scene, (1, 1))[0, 0, 0])


@pytest.mark.parametrize("mode", ["xray", "average", "mip", "minip"])
@pytest.mark.parametrize("missing", ["nan", "nan and inf"])
def test_rays_along_samples_take_nothing_from_gaps_beside_them(renderer, mode, missing):
    """Where rounding is all that is between a ray and a column of samples, a missing neighbour weighs 1e-14 or so."""
    volume = gaps_in_noise(missing)
    for aside in (1e-6, 3e-6, 1e-5):
        camera = Camera.framing(
            volume,
            eye=volume.centre - (0.3 * aside, aside, 100),
            target=volume.centre - (0.3 * aside, aside, 0),
            up=(0, 1, 0),
        )
        scene = Scene(
            volume, camera=replace(camera, height=float(volume.dimensions[1])), mode=mode, classification="slab"
        )
        picture = renderer.render(scene, volume.dimensions[:2])[..., 0]
        longest = volume.dimensions[2] if mode == "xray" else 1
        there = picture[np.isfinite(picture)]
        assert there.any() and there.min() >= 0 and there.max() <= (1 + 1e-5) * longest


def gaps_in_noise(missing: str) -> Volume:
    random = np.random.default_rng(0)
    values = random.random((33, 33, 33)).astype(np.float32)
    values[random.random(values.shape) < 0.1] = np.nan
    if "inf" in missing:
        values[random.random(values.shape) < 0.01] = np.inf
    return Volume(values)


@every_grid_and_view(*NUMBERS)
def test_a_constant_volume_is_its_chord(renderer, grid, view, mode):
    volume = Volume(np.full((4, 5, 6), 3, np.uint8), **GRIDS[grid])
    camera = CAMERAS[view](volume)
    path = path_lengths(volume, camera, SIZE)
    expected = 3 * path if mode == "xray" else np.where(path > 0, 3.0, 0.0)
    picture = renderer.render(Scene(volume, camera=camera, mode=mode, classification="slab"), SIZE)
    np.testing.assert_array_equal(picture[..., 3], path > 0)
    # A dozen slabs, summed up in float32, their shares rounded once.
    np.testing.assert_allclose(picture[..., 0], expected, rtol=2e-6, atol=2e-6 * (path.max() if mode == "xray" else 1))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("samples", [12, 13])
def test_an_xray_along_an_axis_is_a_central_slice_of_the_spectrum(renderer, axis, samples):
    # One slab per sample: the value is linear on either side of a sample, which lies in the middle of a slab or, where
    # the number of samples is odd, at its ends; so the midpoint rule gives the sum of the samples times the spacing,
    # and the two-dimensional spectrum of the picture is the plane k_axis = 0 of the volume's. Each pixel is a sum of
    # 13 numbers of float32, rounded to 2^-24 of up to 13 each time: 13² 2^-24 = 1e-5 at most, and a coefficient of
    # the spectrum sums up 169 of them; with random signs √169.
    volume = Volume(np.random.default_rng(2).random((samples,) * 3).astype(np.float32))
    eye, up = 3.0 * volume.radius * np.eye(3)[axis], np.eye(3)[(axis + 2) % 3]
    camera = Camera.orthographic(volume.centre - eye, volume.centre, up, samples)
    picture = renderer.render(Scene(volume, camera=camera, mode="xray", classification="slab"), (samples, samples))[
        ..., 0
    ]
    # Back into the volume's order: rows upwards along `up`, columns along what is right of it.
    right = int(np.abs(camera.right).argmax())
    order = picture[::-1, :: int(np.sign(camera.right[right]))]
    if right > (axis + 2) % 3:
        order = order.T  # the slower axis of values is the later of x, y, z
    central = np.fft.fftn(volume.values.astype(np.float64)).take(0, axis=2 - axis)
    np.testing.assert_allclose(np.fft.fft2(order), central, rtol=0, atol=13 * 1e-5)


@every_mode
@pytest.mark.parametrize("dimensions", [(1, 1, 1), (1, 1, 5), (5, 1, 1), (1, 4, 3)])
def test_one_sample_along_an_axis(renderer, dimensions, mode):
    volume = noise("sheared", dimensions=dimensions)
    scene = scene_of(volume, mode, "perspective", fraction=0.5)
    picture = renderer.render(scene, SIZE, sampling_rate=8)
    if mode == "isosurface" and dimensions == (1, 1, 1):
        assert picture[..., 3].any()  # all of it is the isovalue
    if mode == "isosurface":
        same_depths(renderer.depth(), isosurface_depth(scene, SIZE), volume)
    else:
        expected = project(scene, SIZE)
        np.testing.assert_array_equal(picture[..., 3], expected[..., 3])
        np.testing.assert_allclose(picture[..., 0], expected[..., 0], rtol=2e-3, atol=2e-3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average"])
def test_numbers_beyond_single_precision_are_infinite(renderer, mode):
    volume = Volume(1e60 * (1 + noise().values.astype(np.float64)))
    numbers = renderer.render(Scene(volume, mode=mode, classification="slab"), SIZE)[..., 0]
    assert set(np.unique(numbers)) == {0, np.inf}


@every_mode
def test_nothing_is_nothing(renderer, mode):
    options = {"isovalue": 0.5} if mode == "isosurface" else {}
    volume = noise()
    behind = Camera.orthographic(volume.centre + (40, 0, 0), volume.centre + (80, 0, 0), (0, 0, 1), 4)
    beside = Camera.perspective(volume.centre + (40, 0, 0), volume.centre + (40, 90, 0), (0, 0, 1), 20)
    missing = Volume(np.full((3, 4, 5), np.nan, np.float32))
    for scene in (
        Scene(volume, camera=behind, mode=mode, **options),
        Scene(volume, camera=beside, mode=mode, **options),
        Scene(missing, mode=mode, **options),
    ):
        assert not renderer.render(scene, SIZE).any()
        assert renderer.stats["estimated_error"] is not None
        if mode == "isosurface":
            assert np.isinf(renderer.depth()).all()
        with_light = renderer.render(replace(scene, background=(0.1, 0.2, 0.3)), SIZE)
        light = (0.1, 0.2, 0.3, 0) if mode == "isosurface" else (0, 0, 0, 0)  # numbers have no background
        np.testing.assert_allclose(with_light, np.broadcast_to(light, with_light.shape), rtol=1e-6)


# The checks can fail.

LOST_PLANES = (
    "float next_depth(SampleWalk walk, float end, inout vec3 planes)",
    "float depth = next_depth_right(walk, end, planes); planes += 1.0; return depth;",
)
EIGHT_CELLS = (
    "BestCells best_cells(SampleWalk walk, inout float from, float end, float known, vec2 last, bool only_first)",
    "return best_cells_right(walk, from, only_first ? from : end, known, last, only_first);",
)
HUNDREDTH = (
    "vec4 part_of_integral(float value, float fraction)",
    "return 1.01 * part_of_integral_right(value, fraction);",
)
TURNS = "vec2 turns_between(vec4 values, float from, float to)"
MISTAKES = {
    "planes half a sample off": (test_extremes_are_exact, planted.PLANES_HALF_A_SAMPLE_OFF),
    "a plane is left out": (test_extremes_are_exact, LOST_PLANES),
    "no look between planes": (test_extremes_are_exact, (TURNS, "return vec2(from);")),
    "the other turn": (test_extremes_are_exact, (TURNS, "return turns_between_right(values, from, to).yx;")),
    "end slabs unclipped": (test_sums_approach_those_of_the_oracle, *planted.UNCLIPPED_END_SLABS),
    "a hundredth too much": (test_sums_approach_those_of_the_oracle, HUNDREDTH),
    "cosine left out": (test_sums_approach_those_of_the_oracle, *planted.MISSING_COSINE),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_planted_mistake_is_seen(mistake):
    check, *mistakes = MISTAKES[mistake]
    mode = {test_extremes_are_exact: ("mip",), test_sums_approach_those_of_the_oracle: ("xray",)}.get(check, ())
    with planted.planted(*mistakes) as wrong, pytest.raises(AssertionError):
        check(wrong, *mode, "sheared", "perspective")


def test_what_lies_in_no_cell_of_the_eight_largest_bounds_is_not_left_out():
    with planted.planted(EIGHT_CELLS) as wrong, pytest.raises(AssertionError):
        test_what_rays_meet_in_many_cells_of_larger_bounds_is_found(wrong, "mip")
