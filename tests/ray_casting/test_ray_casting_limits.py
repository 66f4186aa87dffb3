"""The oracle against a dense sum of its own arithmetic, on values that are not numbers, and against symmetries."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.installation import install_command

BOTH = pytest.mark.parametrize("classification", ["extinction", "post"])
EXAMPLES = settings(max_examples=12, deadline=None)
BONE = TransferFunction(
    [0, 0.3, 0.35, 0.6, 1],
    [[0.1, 0, 0], [0.9, 0.2, 0.1], [0.2, 0.9, 0.1], [1, 1, 1], [0.1, 0.2, 1]],
    [0, 0, 0.8, 0.3, 2],
)
GAS = TransferFunction([0.2, 0.5, 0.9], [[0, 1, 3], [2, 0, 0], [0.5, 0.5, 4]], [0, 1.5, 0.2], emissive=True)
STEP = TransferFunction([0, 0.5, 0.5, 1], [[1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 1]], [0, 0.1, 1, 0.5])


def random_volume(seed, shape=(4, 5, 6), spacing=(1.0, 1.3, 0.7), **position):
    return Volume(np.random.default_rng(seed).random(shape), spacing, **position)


def dense_sum(scene, size, samples=20_000):
    """The same integral by the midpoint rule and scipy's trilinear filter; off by h² of the curvature, see the test."""
    volume, transfer = scene.volume, scene.transfer_function
    eyes, directions = scene.completed(size).camera.rays(size)
    inverse = np.linalg.inv(volume.world_from_index)
    shape = np.array(volume.dimensions)
    picture = np.zeros((size[1], size[0], 4))
    for pixel in np.ndindex(size[1], size[0]):
        start, step = inverse @ (eyes[pixel] - volume.origin), inverse @ directions[pixel]
        with np.errstate(divide="ignore"):
            ends = np.sort([(-0.5 - start) / step, (shape - 0.5 - start) / step], axis=0)
        enter, leave = max(ends[0].max(), 0), ends[1].min()
        if leave <= enter:
            picture[pixel][:3] = scene.background
            continue
        h = (leave - enter) / samples
        points = start[:, None] + (enter + (np.arange(samples) + 0.5) * h) * step[:, None]
        if scene.classification in ("slab", "extinction"):
            emission, extinction = transfer.classify(volume.values)
            fields = [*np.moveaxis(emission, -1, 0), extinction]
            q = np.stack([map_coordinates(f, points[::-1], order=1, mode="nearest") for f in fields[:3]], axis=-1)
            tau = map_coordinates(fields[3], points[::-1], order=1, mode="nearest")
        else:
            values = volume.values.astype(np.float64)
            q, tau = transfer.classify(map_coordinates(values, points[::-1], order=1, mode="nearest"))
        depth = np.cumsum(tau) * h
        reached = np.exp(-(depth - tau * h / 2))
        light = (q * reached[:, None]).sum(axis=0) * h
        picture[pixel] = np.append(light + np.exp(-depth[-1]) * np.array(scene.background), -np.expm1(-depth[-1]))
    return picture


@pytest.mark.parametrize("classification", ["slab", "integrated"])
@pytest.mark.parametrize("transfer", [BONE, GAS], ids=["bone", "gas"])
@pytest.mark.parametrize("projection", ["orthographic", "perspective", "inside", "sheared"])
def test_a_dense_sum_agrees(projection, transfer, classification):
    # h = 10 / 20000; each of some 50 kinks adds up to h² Δ(q τ)' / 8, that is under 50 * 2.5e-7 * 8 / 8 / 50: 3e-7.
    volume = random_volume(5)
    if projection == "sheared":
        volume = random_volume(5, direction=[[-1, 0.5, 0], [0.1, 1, 0.4], [0, 0, 1.0]], origin=(4, 5, 6))
    camera = Camera.framing(volume, "perspective" if projection == "perspective" else "orthographic")
    if projection == "inside":
        camera = Camera.perspective(volume.centre, volume.centre + np.array([1, 0.4, -0.7]), (0, 0, 1), fov=100)
    scene = Scene(volume, transfer, camera, (0.3, 0.1, 0.6), classification)
    np.testing.assert_allclose(raycast(scene, (5, 4)), dense_sum(scene, (5, 4)), rtol=0, atol=1e-6)


def test_a_dense_sum_agrees_on_steps_as_far_as_it_can():
    # A sum of 20000 places a step to half a sample: 2.5e-4 of length, Δτ 0.9, some 10 steps of random sign.
    scene = Scene(random_volume(7), STEP, classification="post")
    np.testing.assert_allclose(raycast(scene, (5, 4)), dense_sum(scene, (5, 4)), rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    "kind", [np.uint8, np.int8, np.int16, np.uint16, np.int64, np.uint64, np.float16, np.float32, np.float64]
)
def test_a_picture_does_not_depend_on_the_type_that_holds_the_values(kind):
    values = np.random.default_rng(3).integers(0, 100, (3, 3, 3))
    transfer = TransferFunction([0, 100], [[1, 0, 0], [0, 0, 1]], [0, 1])
    expected = raycast(Scene(Volume(values.astype(np.float64)), transfer, classification="post"), (4, 4))
    picture = raycast(Scene(Volume(values.astype(kind)), transfer, classification="post"), (4, 4))
    np.testing.assert_array_equal(picture, expected)


def columns(volume, classification, transfer, **options):
    """One pixel for each column of samples along z, seen from below; row 0 is the last y."""
    nx, ny, _ = volume.dimensions
    depth = np.array([0, 0, 3.0 * volume.radius])
    camera = Camera.orthographic(volume.centre + depth, volume.centre, (0, 1, 0), volume.box_edges[1, 1])
    return raycast(Scene(volume, transfer, camera, classification=classification, **options), (nx, ny))


OPAQUE = TransferFunction([0, 1, 2], [[0, 0, 1], [1, 0.5, 0], [0, 1, 0]], [0, np.inf, 0])


@pytest.mark.parametrize("origin", [(0, 0, 0), (0.1, 0.7, 1e5 / 3)])
def test_one_opaque_voxel_hides_all_rays_that_pass_nearer_than_its_neighbours(origin):
    # Pre-classified: weight beyond 0 is opaque, and a column through the neighbours has none, also off by rounding.
    values = np.zeros((7, 7, 7))
    values[3, 3, 3] = 1
    volume = Volume(values, (0.7, 0.7, 0.7), origin)
    expected = np.zeros((7, 7, 4))
    expected[3, 3] = [1, 0.5, 0, 1]
    np.testing.assert_allclose(columns(volume, "slab", OPAQUE), expected, atol=1e-12)
    camera = Camera.orthographic(volume.centre + np.array([0, 0, 9]), volume.centre, (0, 1, 0), 7 * 0.7)
    finer = raycast(Scene(volume, OPAQUE, camera, classification="slab"), (70, 70))[..., 3]
    np.testing.assert_array_equal(finer[25:45, 25:45], 1)
    assert finer.sum() == 400


def test_two_opaque_voxels_show_by_their_weights_where_the_ray_enters():
    values = np.array([[[0, 2.0]], [[0, 2.0]]])  # z, y, x
    transfer = TransferFunction([0, 2], [[1, 0, 0], [0, 0, 1]], [np.inf, np.inf])
    camera = Camera.orthographic((0.25, 0, 9), (0.25, 0, 0), (0, 1, 0), 1)
    pixel = raycast(Scene(Volume(values), transfer, camera, classification="slab"), (1, 1))[0, 0]
    np.testing.assert_allclose(pixel, [0.75, 0, 0.25, 1], atol=1e-12)


def test_opaque_corners_behind_the_cell_show_their_limit_from_inside():
    # Samples 0 in front, two opaque ones behind: their weights vanish where the ray enters, their ratio does not.
    values = np.array([[[0, 2.0]], [[1, 1]]])
    transfer = TransferFunction([0, 1, 1, 2], [[1, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 1]], [np.inf, np.inf, 0, 0])
    camera = Camera.orthographic((0.25, 0, 9), (0.25, 0, 0), (0, 1, 0), 1)
    pixel = raycast(Scene(Volume(values), transfer, camera, classification="slab"), (1, 1))[0, 0]
    np.testing.assert_allclose(pixel, [1, 0, 0, 1], atol=1e-12)


def test_opaque_matter_behind_haze():
    values = np.zeros((4, 3, 3))
    values[3] = 1
    transfer = TransferFunction([0, 0.5, 0.5, 1], [[1, 0, 0]] * 2 + [[0, 0, 1]] * 2, [0.3, 0.3, 0, np.inf])
    depth = np.array([0, 0, 9.0])
    for classification, hazy in (("extinction", 2.5), ("post", 3.0)):  # opaque from sample 2 on, from value 0.5 on
        volume = Volume(values)
        camera = Camera.orthographic(volume.centre - depth, volume.centre, (0, 1, 0), 3)
        pixel = raycast(Scene(volume, transfer, camera, (0.5, 0.5, 0.5), classification), (1, 1))[0, 0]
        reached = np.exp(-0.3 * hazy)
        np.testing.assert_allclose(pixel, [1 - reached, 0, reached, 1], atol=1e-12)


def test_a_value_at_a_finite_point_beside_an_opaque_segment_is_not_opaque():
    transfer = TransferFunction([0, 1, 2], [[1] * 3] * 3, [0.25, 0.5, np.inf])
    volume = Volume(np.full((3, 3, 3), 1.0))
    np.testing.assert_allclose(columns(volume, "post", transfer), -np.expm1(-1.5), rtol=1e-13)
    # Values up to the point, met at a sample: rounding must not lift them over it.
    values = np.broadcast_to(np.array([0.1, 0.7, 1.0, 0.3])[:, None, None], (4, 3, 3))
    assert columns(Volume(values, (0.3, 0.3, 0.3)), "post", transfer).max() < 0.9
    assert columns(Volume(values * 1.001), "post", transfer)[..., 3].min() == 1


@BOTH
def test_a_flat_field_at_a_step_takes_the_right_side(classification):
    transfer = TransferFunction([0, 0.1, 0.1, 1], [[1, 0, 0]] * 2 + [[0, 1, 0]] * 2, [5, 5, 0.2, 0.2])
    picture = columns(Volume(np.full((3, 4, 5), 0.1), (0.3, 0.3, 0.3)), classification, transfer)
    alpha = -np.expm1(-0.2 * 0.9)
    np.testing.assert_allclose(picture, np.broadcast_to([0, alpha, 0, alpha], (4, 5, 4)), rtol=1e-12)


@pytest.mark.parametrize("aside", [-1e-15, 0.0, 1e-15])
@pytest.mark.parametrize("h", [0.1, 0.7, 1.1])
def test_rays_in_the_plane_of_a_step_take_its_right_side_whatever_rounding_does(h, aside):
    # Value 2.5 half-way between two samples in x; the ray is a few ulps to either side of that plane.
    transfer = TransferFunction([0, 2.5, 2.5, 5], [[1, 0, 0]] * 2 + [[0, 1, 0]] * 2, [5, 5, 0.2, 0.2])
    volume = Volume(np.broadcast_to(np.arange(6.0), (6, 6, 6)), (h, h, h))
    middle = volume.centre + np.array([aside, 0, 0])
    camera = Camera.orthographic(middle + np.array([0, 0, 5.0]), middle, (0, 1, 0), 0.1)
    pixel = raycast(Scene(volume, transfer, camera, classification="post"), (1, 1))[0, 0]
    alpha = -np.expm1(-0.2 * 6 * h)
    np.testing.assert_allclose(pixel, [0, alpha, 0, alpha], atol=1e-12)


@BOTH
def test_opaque_matter_that_only_emits_shows_nothing(classification):
    transfer = TransferFunction([0, 1], [[3, 2, 1]] * 2, [np.inf, np.inf], emissive=True)
    picture = columns(Volume(np.full((3, 2, 2), 0.5)), classification, transfer, background=(1, 1, 1))
    np.testing.assert_array_equal(picture, np.broadcast_to([0, 0, 0, 1], (2, 2, 4)))


@BOTH
def test_samples_that_are_not_there(classification):
    # τ = 1 wherever there is a value. Pre-classified: NaN is matter of extinction 0, blended in over a spacing each
    # way. Post-classified: nothing is where a NaN sample has weight.
    values = np.zeros((7, 5, 5))
    values[3, 2, 2] = np.nan
    picture = columns(Volume(values), classification, TransferFunction([0], [[1, 1, 0]], [1.0]))
    depth = np.full((5, 5), 7.0)
    depth[2, 2] = 6.0 if classification == "extinction" else 5.0
    np.testing.assert_allclose(picture[..., 3], -np.expm1(-depth), rtol=1e-12)


@BOTH
def test_a_volume_of_nothing_shows_the_background(classification):
    volume = Volume(np.full((3, 4, 5), np.nan, np.float32))
    picture = columns(volume, classification, TransferFunction([0], [[1, 1, 1]], [1.0]), background=(0.1, 0.2, 0.3))
    np.testing.assert_array_equal(picture, np.broadcast_to([0.1, 0.2, 0.3, 0], (4, 5, 4)))


@pytest.mark.parametrize("infinity, extinction", [(np.inf, 0.5), (-np.inf, 0.125)])
def test_infinite_values_clamp_to_the_end_of_the_transfer_function(infinity, extinction):
    transfer = TransferFunction([-1, -1, 1, 1], [[1] * 3] * 4, [0.125, 0, 0, 0.5])
    values = np.zeros((5, 3, 3))
    values[2, 1, 1] = infinity
    post = columns(Volume(values), "post", transfer)[..., 3]
    assert post[1, 1] == pytest.approx(-np.expm1(-2 * extinction), rel=1e-12)  # a spacing on either side
    pre = columns(Volume(values), "slab", transfer)[..., 3]
    assert pre[1, 1] == pytest.approx(-np.expm1(-extinction), rel=1e-12)
    post[1, 1] = pre[1, 1] = 0
    assert not post.any() and not pre.any()


def test_opposite_infinities_leave_no_value():
    values = np.array([np.inf, -np.inf]).reshape(2, 1, 1)
    picture = columns(Volume(values), "post", TransferFunction([0], [[1] * 3], [1.0]))
    assert picture[0, 0, 3] == pytest.approx(-np.expm1(-1.0), rel=1e-12)  # the outer half spacings, each one infinity


def turned(volume, axes, mirrored):
    """The same matter with the grid's axes in another order and sense: values, spacing, origin and direction."""
    values, order = volume.values, [2 - a for a in axes][::-1]
    steps, origin = volume.direction.copy(), volume.origin.copy()
    for axis in range(3):
        if mirrored[axis]:
            values = np.flip(values, 2 - axis)
            origin = origin + volume.world_from_index[:, axis] * (volume.dimensions[axis] - 1)
            steps[:, axis] *= -1
    return Volume(values.transpose(order), volume.spacing[list(axes)], origin, steps[:, list(axes)])


@BOTH
@EXAMPLES
@given(st.permutations([0, 1, 2]), st.tuples(st.booleans(), st.booleans(), st.booleans()))
def test_matter_does_not_depend_on_the_order_of_its_grid(classification, axes, mirrored):
    scene = Scene(random_volume(11), STEP, classification=classification)
    scene = replace(scene, camera=scene.completed((6, 5)).camera)
    other = replace(scene, volume=turned(scene.volume, axes, mirrored))
    np.testing.assert_allclose(raycast(other, (6, 5)), raycast(scene, (6, 5)), rtol=0, atol=1e-12)


@BOTH
@EXAMPLES
@given(st.floats(-1, 1), st.floats(-1, 1), st.integers(0, 1000))
def test_opacity_is_equal_from_the_two_ends(classification, x, y, seed):
    volume = random_volume(seed)
    away = np.array([x, y, 1.5]) * 10
    there = Camera.orthographic(volume.centre + away, volume.centre, (0, 1, 0), 4)
    back = Camera.orthographic(volume.centre - away, volume.centre, (0, 1, 0), 4)
    pictures = [raycast(Scene(volume, BONE, c, classification=classification), (5, 5))[..., 3] for c in (there, back)]
    np.testing.assert_allclose(pictures[0], pictures[1][:, ::-1], rtol=0, atol=1e-12)


@BOTH
@pytest.mark.parametrize("scale", [1e-9, 7.0, 1e9])
def test_a_volume_k_times_as_large_of_matter_k_times_as_thin_looks_the_same(scale, classification):
    small = random_volume(13)
    large = Volume(small.values, small.spacing * scale)
    thin = TransferFunction(BONE.values, BONE.colors, BONE.extinctions / scale)
    pictures = [raycast(Scene(v, t, classification=classification), (6, 5)) for v, t in ((small, BONE), (large, thin))]
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=1e-11)


@BOTH
def test_light_is_linear_in_colour_and_the_background_is_what_is_let_through(classification):
    volume = random_volume(17)
    half = TransferFunction(BONE.values, BONE.colors / 2, BONE.extinctions)
    full, dim, behind = (
        raycast(Scene(volume, t, None, b, classification), (6, 5))
        for t, b in ((BONE, (0, 0, 0)), (half, (0, 0, 0)), (BONE, (0.2, 0.4, 2)))
    )
    np.testing.assert_allclose(dim[..., :3], full[..., :3] / 2, rtol=1e-12)
    np.testing.assert_allclose(behind[..., :3], full[..., :3] + (1 - full[..., 3:]) * [0.2, 0.4, 2], atol=1e-14)


@BOTH
def test_an_empty_border_adds_nothing(classification):
    # Two layers of zeros around a volume whose outermost samples are 0 already, without its outer half spacing.
    inner = np.zeros((6, 6, 6))
    inner[1:-1, 1:-1, 1:-1] = np.random.default_rng(19).random((4, 4, 4))
    small, large = Volume(inner), Volume(np.pad(inner, 2), origin=(-2, -2, -2))
    camera = Camera.framing(small, "perspective")
    pictures = [raycast(Scene(v, BONE, camera, classification=classification), (6, 5)) for v in (small, large)]
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=1e-12)


@BOTH
def test_a_whole_is_its_parts_composited(classification):
    # Cut half-way between two samples of one value, where the field is flat: each half ends in what the whole has.
    values = np.random.default_rng(23).random((8, 3, 3))
    values[4] = values[3]
    whole, below = Volume(values), Volume(values[:4])
    above = Volume(values[4:], origin=(0, 0, 4))
    camera = Camera.orthographic((1, 1, -5), (1, 1, 0), (0, 1, 0), 3)
    whole, below, above = (
        raycast(Scene(v, BONE, camera, classification=classification), (6, 5)) for v in (whole, below, above)
    )
    np.testing.assert_allclose(whole, below + (1 - below[..., 3:]) * above, rtol=0, atol=1e-13)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_finer_grid_of_the_same_trilinear_field_looks_the_same(projection):
    # Three samples for one, from -1/3 on: the box stays -1/2 … 7/2, and every coarse sample is a fine one.
    coarse = np.random.default_rng(29).random((4, 4, 4))
    at = (np.mgrid[0:12, 0:12, 0:12] - 1) / 3
    fine = map_coordinates(coarse, at.reshape(3, -1), order=1, mode="nearest").reshape(12, 12, 12)
    volumes = Volume(coarse), Volume(fine, (1 / 3,) * 3, (-1 / 3,) * 3)
    camera = Camera.framing(volumes[0], projection)
    pictures = [raycast(Scene(v, STEP, camera, classification="post"), (12, 11)) for v in volumes]
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=1e-11)


def test_threads_may_cast_rays_at_once():
    scene = Scene(random_volume(31), BONE, classification="post")
    expected = raycast(scene, (40, 30))
    with ThreadPoolExecutor(4) as threads:
        for picture in threads.map(lambda _: raycast(scene, (40, 30)), range(8)):
            np.testing.assert_array_equal(picture, expected)


def run_python(code, **environment):
    root = str(Path(__file__).parents[2])
    variables = {**os.environ, "PYTHONPATH": root, **environment}
    return subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, env=variables)


def test_without_numba_the_error_names_the_extra():
    scene = "texvol.Scene(texvol.Volume([[[1.0]]]), 'fog')"
    done = run_python(f"import sys; sys.modules['numba'] = None; import texvol; texvol.raycast({scene}, (2, 2))")
    assert done.returncode != 0
    assert "texvol raycast needs numba" in done.stderr and install_command("oracle") in done.stderr


def test_without_a_folder_to_keep_compiled_code_it_still_compiles():
    code = """
from numba.core import caching
caching.CacheImpl._locator_classes = []
from texvol.ray_casting.plain.tracer import trace_rays
print(type(trace_rays._cache).__name__)
"""
    done = run_python(code)
    assert done.stdout.strip() == "NullCache", done.stderr
