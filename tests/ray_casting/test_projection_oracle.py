"""The oracle of the projection modes against closed forms, Fourier slices and dense sums."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from support.scenes import path_lengths

from texvol.ray_casting.projection import isosurface_depth, project
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

NUMBERS = ("xray", "average", "mip", "minip")
GRIDS = {
    "plain": {},
    "anisotropic": {"spacing": (1, 2.5, 0.4)},
    "sheared": {"spacing": (1, 2, 3), "origin": (5, 6, 7), "direction": [[-1, 0.4, 0], [0.2, 1, 0.3], [0, 0, 1]]},
}
CAMERAS = {
    "orthographic": lambda v: Camera.framing(v, "orthographic"),
    "perspective": lambda v: Camera.framing(v, "perspective", fov=60),
    "inside": lambda v: Camera.perspective(
        v.centre + 0.1 * v.box_edges.sum(axis=1), v.centre - v.box_edges[:, 0], (0.1, 0.2, 1), fov=90
    ),
    "along x": lambda v: Camera.framing(v, eye=v.centre - (2 * v.radius, 0, 0), up=(0, 0, 1)),
}
SIZE = (9, 7)
every_grid = pytest.mark.parametrize("grid", GRIDS)
every_view = pytest.mark.parametrize("view", CAMERAS)


def projected(volume, mode, camera, size=SIZE, **options):
    return project(Scene(volume, camera=camera, mode=mode, **options), size)


def through_samples(volume, axis):
    """Camera along grid axis `axis` whose pixels are the columns of samples there, and its size; plain axes only."""
    across, up = [(1, 2), (0, 2), (0, 1)][axis]
    view = np.eye(3)[axis] * 2 * volume.box_edges[axis, axis]
    camera = Camera.orthographic(volume.centre - view, volume.centre, np.eye(3)[up], volume.box_edges[up, up])
    return camera, (volume.dimensions[across], volume.dimensions[up])


def as_seen(samples, volume, axis):
    """Numbers of the columns along `axis`, (slower, faster grid axis), the way `through_samples` shows them."""
    across = [1, 0, 0][axis]
    rightwards = through_samples(volume, axis)[0].right[across] > 0
    return samples[::-1, :: 1 if rightwards else -1]


def middle(values, mode, **options):
    """Pixel of the one ray through the middle column of samples along z; all columns alike."""
    volume = Volume(np.broadcast_to(np.array(values)[:, None, None], (len(values), 3, 3)))
    camera = through_samples(volume, 2)[0]
    return projected(volume, mode, camera, (1, 1), **options)[0, 0]


def breakpoints(volume, camera, pixel, size):
    """Where on a ray a coordinate is that of an outermost sample, or the ray enters or leaves: s, and clamped index."""
    eyes, directions = camera.rays(size)
    start = volume.index_from_world @ (eyes[pixel] - volume.origin)
    step = volume.index_from_world @ directions[pixel]
    last = np.array(volume.dimensions) - 1
    with np.errstate(divide="ignore"):
        ends = np.sort([(-0.5 - start) / step, (last + 0.5 - start) / step], axis=0)
        cuts = np.concatenate([(0 - start) / step, (last - start) / step])
    enter, leave = max(ends[0].max(), 0), ends[1].min()
    s = np.unique(np.concatenate([[enter, leave], cuts[(cuts > enter) & (cuts < leave)]]))
    return s, np.clip(start + s[:, None] * step, 0, last)


@every_grid
@every_view
def test_a_constant_volume_is_its_chord(grid, view):
    volume = Volume(np.full((4, 5, 6), 3, np.uint8), **GRIDS[grid])
    camera = CAMERAS[view](volume)
    path = path_lengths(volume, camera, SIZE)
    assert (path > 0).any() and (view == "inside" or (path == 0).any())
    for mode in NUMBERS:
        picture = projected(volume, mode, camera)
        np.testing.assert_array_equal(picture[..., 3], path > 0)
        expected = 3 * path if mode == "xray" else np.where(path > 0, 3.0, 0.0)
        # A dozen cells, each to a few ulps; positions are known to 1e-14 of the box.
        np.testing.assert_allclose(picture[..., :3], expected[..., None].repeat(3, -1), rtol=1e-12, atol=1e-12)


@every_grid
@every_view
def test_a_linear_field_is_linear_between_the_outermost_samples(grid, view):
    weights = np.array([0.7, -1.3, 2.1])
    z, y, x = np.indices((5, 6, 4))
    volume = Volume(4 + np.stack([x, y, z], axis=-1) @ weights, **GRIDS[grid])
    camera = CAMERAS[view](volume)
    met = path_lengths(volume, camera, SIZE) > 0
    pictures = {mode: projected(volume, mode, camera)[..., 0] for mode in NUMBERS}
    for pixel in zip(*np.nonzero(met), strict=True):
        s, index = breakpoints(volume, camera, pixel, SIZE)
        values = 4 + index @ weights
        integral = np.trapezoid(values, s)
        expected = {"xray": integral, "average": integral / (s[-1] - s[0]), "mip": values.max(), "minip": values.min()}
        for mode in NUMBERS:
            assert pictures[mode][pixel] == pytest.approx(expected[mode], rel=1e-11, abs=1e-11), mode


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_along_an_axis_they_are_those_of_the_samples(axis):
    volume = Volume(np.random.default_rng(1).random((5, 6, 7)) - 0.4, (1, 1.5, 0.5))
    # The pixels are square and the samples are not: one row, or one column, at a time.
    square = Volume(volume.values)
    camera, size = through_samples(square, axis)
    of_columns = {"xray": np.sum, "average": np.mean, "mip": np.max, "minip": np.min}
    for mode, reduce in of_columns.items():
        expected = as_seen(reduce(volume.values, axis=2 - axis), square, axis)
        np.testing.assert_allclose(projected(square, mode, camera, size)[..., 0], expected, rtol=0, atol=1e-13)
    thin = Volume(square.values, np.where(np.arange(3) == axis, 0.25, 1.0))
    camera = through_samples(thin, axis)[0]
    expected = 0.25 * as_seen(volume.values.sum(axis=2 - axis), thin, axis)
    np.testing.assert_allclose(projected(thin, "xray", camera, size)[..., 0], expected, rtol=0, atol=1e-13)


def padded_noise(n=24, block=8):
    values = np.zeros((n, n, n))
    start = (n - block) // 2
    values[(slice(start, start + block),) * 3] = np.random.default_rng(2).random((block,) * 3)
    return Volume(values)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_xray_along_an_axis_is_a_central_slice_of_the_spectrum(axis):
    volume = padded_noise()
    camera, size = through_samples(volume, axis)
    picture = as_seen(projected(volume, "xray", camera, size)[..., 0], volume, axis)  # back into the volume's order
    central = np.fft.fftn(volume.values).take(0, axis=2 - axis)
    # 576 pixels, each to 1e-14.
    np.testing.assert_allclose(np.fft.fft2(picture), central, rtol=0, atol=1e-10)


def test_an_xray_along_a_diagonal_is_a_diagonal_slice_of_the_spectrum():
    # Seen along (1, 1, 0), pixels 1/√2 wide and 1 high lie on the samples. A sample's share x y, projected, is two
    # triangles of half width 1/√2 folded: the cubic B-spline, 1/6, 4/6, 1/6 at the pixels, so (4 + 2 cos ω) / 6.
    volume, n = padded_noise(), 24
    rows = []
    for k in range(n):  # pixels are square: one row of them at a time
        target = volume.centre + [0, 0, k - (n - 1) / 2]
        camera = Camera.orthographic(target - [50, 50, 0], target, (0, 0, 1), 1 / np.sqrt(2))
        rows.append(projected(volume, "xray", camera, (n + 1, 1))[0, :, 0])
    picture = np.array(rows)[:, :n]  # pixel n / 2 looks through the middle, where x - y is 0
    assert np.abs(np.array(rows)[:, n]).max() == 0
    spectrum = np.fft.fft2(np.roll(picture, -n // 2, axis=1)) / np.sqrt(2)
    frequency = np.arange(n)
    central = np.fft.fftn(volume.values)[:, -frequency, frequency]  # to the right is x, and away from it y
    np.testing.assert_allclose(spectrum, central * (4 + 2 * np.cos(2 * np.pi * frequency / n)) / 6, rtol=0, atol=1e-10)


def test_an_oblique_xray_of_a_blob_is_an_oblique_slice_of_its_spectrum():
    # Filtered trilinearly, the spectrum is that of the samples times Π sinc². Pixels of half a sample fold onto it what
    # lies 2, 4, … away. There the samples' spectrum repeats around whole numbers as e^(-2π²σ²δ²), and in this view the
    # nearest folds are δ > 0.15 from those: e^-7, times the sinc², under 1e-6 so close to whole numbers: 1e-9 at most.
    n, sigma, pixels = 40, 4.0, 160
    z, y, x = np.indices((n, n, n)) - (n - 1) / 2
    blob = np.exp(-(x**2 + 1.2 * y**2 + 0.9 * z**2 + 0.3 * x * y) / (2 * sigma**2))
    volume = Volume(blob * np.pad(np.ones((n - 2,) * 3), 1))  # 0 in the outer half spacing, where the filter differs
    camera = Camera.orthographic(volume.centre - [60, 110, -40], volume.centre, (0.1, 0, 1), pixels / 2)
    picture = projected(volume, "xray", camera, (pixels, pixels))[..., 0]
    u = (np.arange(pixels) - (pixels - 1) / 2) / 2
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    for a, b in [(0, 0), (2, 0), (0, 3), (3, -2), (-1, 4)]:
        k = (a * camera.right + b * camera.upward) / 80  # away from 0 by less than 0.07: e^(-2π²σ²k²) > 0.2
        seen = (picture * np.exp(-2j * np.pi * (a * u - b * u[:, None]) / 80)).sum() / 4
        of_samples = (volume.values.ravel() * np.exp(-2j * np.pi * positions @ k)).sum() * np.prod(np.sinc(k) ** 2)
        assert abs(seen - of_samples) < 1e-9 * volume.values.sum(), (a, b)


@every_grid
@every_view
def test_dense_samples_agree(grid, view):
    z, y, x = np.indices((6, 5, 7))
    values = np.exp(-((x - 3.2) ** 2 + (y - 1.7) ** 2 + (z - 2.9) ** 2) / 3) + 0.1 * np.random.default_rng(3).random(
        x.shape
    )
    volume = Volume(values, **GRIDS[grid])
    camera, samples = CAMERAS[view](volume), 4000
    eyes, directions = camera.rays(SIZE)
    path = path_lengths(volume, camera, SIZE)
    pictures = {mode: projected(volume, mode, camera)[..., 0] for mode in NUMBERS}
    for pixel in zip(*np.nonzero(path > 0), strict=True):
        s = breakpoints(volume, camera, pixel, SIZE)[0][0] + path[pixel] * (np.arange(samples) + 0.5) / samples
        index = volume.index_from_world @ (eyes[pixel] - volume.origin + s[:, None] * directions[pixel]).T.reshape(
            3, -1
        )
        along = map_coordinates(values, index[::-1], order=1, mode="nearest")
        # Samples are at most 25 cells / 4000 apart, the slope is under 3 per cell, with some 25 kinks a ray: the rule
        # is off by 25 * 6 * (25/4000)² / 8 / 25 = 3e-5 of the way, the extremes by half a step's rise at a kink.
        assert pictures["average"][pixel] == pytest.approx(along.mean(), abs=3e-5)
        assert pictures["xray"][pixel] == pytest.approx(along.mean() * path[pixel], abs=3e-5 * path[pixel])
        assert -1e-12 < pictures["mip"][pixel] - along.max() < 3 * 25 / 4000 / 2
        assert -1e-12 < along.min() - pictures["minip"][pixel] < 3 * 25 / 4000 / 2


def test_turning_points_inside_a_cell_are_found():
    # Along (1, -1, 0) the value x y is t (1 - t); along (1, 1, -1) x y z is t² (1 - t).
    z, y, x = np.indices((2, 2, 2))
    for values, away, highest in [(x * y, (1, -1, 0), 1 / 4), (x * y * z, (1, 1, -1), 4 / 27)]:
        for sign, mode in [(1.0, "mip"), (-1.0, "minip")]:
            volume = Volume(sign * values)
            camera = Camera.orthographic(volume.centre - 5 * np.array(away), volume.centre, (0, 0.3, 1), 1)
            assert projected(volume, mode, camera, (1, 1))[0, 0, 0] == pytest.approx(sign * highest, abs=1e-15)


@every_view
def test_extremes_are_mirrored_and_within_the_samples(view):
    values = np.random.default_rng(4).standard_normal((8, 7, 9)).astype(np.float32)
    camera = CAMERAS[view](Volume(values))
    highest, lowest = projected(Volume(values), "mip", camera), projected(Volume(values), "minip", camera)
    mirrored = projected(Volume(-values), "mip", camera)
    np.testing.assert_array_equal(mirrored[..., :3], -lowest[..., :3])
    met = highest[..., 3] > 0
    average = projected(Volume(values), "average", camera)[met, 0]
    assert (lowest[met, 0] < average).all() and (average < highest[met, 0]).all()
    assert values.min() <= lowest[met, 0].min() and highest[met, 0].max() <= values.max()


def test_rounding_takes_no_extreme_beyond_the_samples():
    random = np.random.default_rng(5)
    for low, high in np.sort(random.standard_normal((40, 2))):
        volume = Volume(random.choice([low, high], (5, 5, 5)))
        camera = Camera.framing(volume)
        assert projected(volume, "mip", camera)[..., 0].max() <= max(high, 0)
        assert projected(volume, "minip", camera)[..., 0].min() >= min(low, 0)


@pytest.mark.parametrize(
    "column, xray, average, mip, minip",
    [
        ([1, 2, np.nan, 4, 5], 9, 3, 5, 1),  # ½ + 1½ … 4½ + 2½ on a way of 3
        ([1, np.inf, 3], np.inf, np.inf, np.inf, 1),
        ([1, -np.inf, 3], -np.inf, -np.inf, 3, -np.inf),
        ([np.nan, np.inf, np.nan, 2], 1, 2, 2, 2),  # beside NaN nothing is; half a spacing of 2 is left
        ([np.inf, 1, -np.inf], np.nan, np.nan, np.inf, -np.inf),
    ],
)
def test_nan_is_nothing_and_infinities_are_extremes(column, xray, average, mip, minip):
    for mode, number in zip(NUMBERS, (xray, average, mip, minip), strict=True):
        np.testing.assert_allclose(middle(column, mode), [number, number, number, 1], rtol=1e-13, err_msg=mode)


def test_samples_without_weight_are_not_met():
    values = np.full((3, 3, 3), np.nan)
    values[:, 1, 1] = [1, 2, 3]
    values[0, 0, 0] = np.inf
    volume = Volume(values)
    camera, size = through_samples(volume, 2)
    assert projected(volume, "xray", camera, size)[1, 1, 0] == pytest.approx(6, rel=1e-13)
    assert projected(volume, "mip", camera, size)[1, 1, 0] == pytest.approx(3, rel=1e-13)


@pytest.mark.parametrize("mode", [*NUMBERS, "isosurface"])
def test_what_is_behind_the_eye_or_no_number_is_not_there(mode):
    options = {"isovalue": 0.5} if mode == "isosurface" else {}
    volume = Volume(np.arange(27.0).reshape(3, 3, 3) / 27)
    away = Camera.orthographic(volume.centre + (10, 0, 0), volume.centre + (20, 0, 0), (0, 0, 1), 4)
    assert not projected(volume, mode, away, **options).any()
    nothing = Volume(np.full((3, 3, 3), np.nan, np.float16))
    assert not projected(nothing, mode, Camera.framing(nothing), **options).any()


def test_an_eye_inside_sees_what_is_before_it():
    volume = Volume(np.arange(5.0)[:, None, None].repeat(3, 1).repeat(3, 2))
    camera = Camera.orthographic((1, 1, 1.5), (1, 1, 5), (0, 1, 0), 1)
    integral = (4**2 - 1.5**2) / 2 + 4 / 2
    for mode, number in zip(NUMBERS, (integral, integral / 3, 4, 1.5), strict=True):
        assert projected(volume, mode, camera, (1, 1))[0, 0, 0] == pytest.approx(number, rel=1e-13)


def test_the_background_enters_no_number():
    volume = Volume(np.ones((3, 3, 3)))
    with_light = Scene(volume, mode="xray", background=(1, 2, 3), camera=Camera.framing(volume), classification="slab")
    np.testing.assert_array_equal(project(with_light, SIZE), projected(volume, "xray", Camera.framing(volume)))


def test_modes_without_a_projection_are_refused():
    volume = Volume(np.zeros((2, 2, 2)))
    with pytest.raises(InputError, match="mode must be one of xray.*for a projection, got composite"):
        project(Scene(volume, classification="slab"), SIZE)
    with pytest.raises(InputError, match="mode must be isosurface for a depth, got mip"):
        isosurface_depth(Scene(volume, mode="mip", classification="slab"), SIZE)
    with pytest.raises(InputError, match="at least one pixel"):
        project(Scene(volume, mode="mip", classification="slab"), (0, 4))
