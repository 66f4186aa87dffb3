"""Gradients: exact where the field is linear, near where it is curved, finite, and the same for any box."""

from __future__ import annotations

import itertools
import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from support.directions import angles, positions

from texvol.scene import gradient
from texvol.scene.gradient import CENTRAL, Estimator, gradients, largest_component
from texvol.scene.volume import Volume
from texvol.util import threads
from texvol.util.errors import InputError

pytestmark = pytest.mark.filterwarnings("error")

ZUCKER_HUMMEL = Estimator("zucker-hummel")
ADAPTIVE = Estimator("adaptive")
ESTIMATORS = [
    *(CENTRAL, ZUCKER_HUMMEL, Estimator("gaussian", 0.1), Estimator("gaussian"), Estimator("gaussian", 2.3)),
    ADAPTIVE,
]
EVERY = pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda each: f"{each.kind} {each.scale}")

_COSINE, _SINE = np.cos(0.4), np.sin(0.4)
OBLIQUE = np.array([[_COSINE, -_SINE, 0], [_SINE, _COSINE, 0], [0, 0, 1]]) @ np.array(
    [[1, 0, 0], [0, _COSINE, -_SINE], [0, _SINE, _COSINE]]
)
SHEARED = np.array([[1, 0.3, 0.1], [0, 1, -0.25], [0.2, 0, -1]])  # and mirrored
GRIDS = {
    "cubic": ((1.0, 1.0, 1.0), np.eye(3)),
    "anisotropic": ((1.0, 0.6, 1.7), np.eye(3)),
    "mirrored": ((2.0, 3.0, 4.0), np.diag([1.0, 1.0, -1.0])),
    "permuted": ((2.0, 3.0, 4.0), np.eye(3)[[1, 2, 0]]),
    "oblique": ((1.0, 0.6, 1.7), OBLIQUE),
    "sheared": ((1.0, 1.2, 0.8), SHEARED),
    "of long columns": ((1.0, 1.2, 0.8), SHEARED * 40),
}
GRID = pytest.mark.parametrize("grid", GRIDS)
SLOPE = np.array([3.0, -5.0, 0.7])  # data units per world unit


def linear(grid: str, dimensions: tuple[int, int, int], unit: float = 1.0) -> Volume:
    """A field of slope `SLOPE` per `unit` of the world, in float64."""
    spacing, direction = GRIDS[grid]
    values = positions(dimensions) @ (direction * spacing).T @ SLOPE - 2
    return Volume(values, np.array(spacing) * unit, (5 * unit, 6, 7), direction)


def rounding(volume: Volume, dtype: type = np.float64) -> float:
    """What rounding may do to a gradient: half a bit of the largest value in each sample and each of a few sums.

    A derivative takes the difference of two values, and the matrix adds three of them up.
    """
    matrix = volume.index_from_world * volume.smallest_spacing
    return 16 * float(np.finfo(dtype).eps * np.nanmax(np.abs(volume.values)) * np.abs(matrix).sum(axis=0).max())


def punctured(values: np.ndarray, fraction: float = 0.2) -> np.ndarray:
    """`values` without some: NaN and infinities of both signs."""
    random = np.random.default_rng(5)
    holes = np.where(random.random(values.shape) < fraction, random.choice([np.nan, np.inf, -np.inf], values.shape), 0)
    return (values + holes).astype(values.dtype)


def noise(dimensions: tuple[int, int, int], dtype: type = np.float32) -> np.ndarray:
    return np.random.default_rng(3).normal(0, 50, dimensions[::-1]).astype(dtype)


@EVERY
@GRID
@pytest.mark.parametrize("dimensions", [(7, 6, 5), (2, 3, 2), (30, 3, 2), (2, 9, 23)])
def test_a_linear_field_has_its_slope_up_to_the_border(
    grid: str, dimensions: tuple[int, int, int], estimator: Estimator
) -> None:
    volume = linear(grid, dimensions)
    found = gradients(volume, estimator)
    np.testing.assert_allclose(found - SLOPE * volume.smallest_spacing, 0, atol=rounding(volume))


@EVERY
@pytest.mark.parametrize("dimensions", [(1, 1, 1), (1, 4, 3), (2, 1, 3), (5, 1, 1)])
def test_along_an_axis_of_one_sample_the_derivative_is_nothing(
    dimensions: tuple[int, int, int], estimator: Estimator
) -> None:
    volume = linear("sheared", dimensions)
    steps = volume.world_from_index.T @ SLOPE * (np.array(dimensions) > 1)
    expected = np.linalg.solve(volume.world_from_index.T, steps) * volume.smallest_spacing
    np.testing.assert_allclose(gradients(volume, estimator) - expected, 0, atol=rounding(volume))


@EVERY
@pytest.mark.parametrize("unit", [1e-9, 1e9, 1e-80])
def test_the_unit_of_the_world_changes_nothing(unit: float, estimator: Estimator) -> None:
    values = noise((9, 8, 7))
    spacing, direction = GRIDS["sheared"]
    expected = gradients(Volume(values, spacing, direction=direction), estimator)
    found = gradients(Volume(values, np.array(spacing) * unit, direction=direction), estimator)
    # The ratios of the spacings may differ in float64's last bit, and then the matrix in float32's.
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
    assert found.dtype == np.float32


@EVERY
@pytest.mark.parametrize(
    "dtype, holes", [(np.uint8, 0), (np.float32, 0), (np.float32, 0.002), (np.float32, 0.3), (np.float64, 0.002)]
)
def test_a_box_is_the_same_part_of_the_whole(
    dtype: type, holes: float, estimator: Estimator, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = np.abs(noise((31, 26, 24))).astype(dtype)
    volume = Volume(punctured(values, holes) if holes else values, (1, 1.2, 0.8), direction=SHEARED)
    whole = gradients(volume, estimator)
    random = np.random.default_rng(0)
    boxes = [
        tuple(slice(*np.sort(random.integers(0, count + 1, 2))) for count in volume.values.shape) for _ in range(12)
    ]
    boxes += [(slice(0, 1), slice(None), slice(30, None)), (slice(23, 24), slice(25, 26), slice(30, 31))]
    for box in boxes:
        assert gradients(volume, estimator, box).tobytes() == whole[box].tobytes(), box
    monkeypatch.setattr(gradient, "_CHUNK", 200)
    monkeypatch.setattr(gradient, "_DEEPEST_CHUNK", 5)
    assert gradients(volume, estimator).tobytes() == whole.tobytes()


def test_borders_are_one_sided() -> None:
    squares = np.broadcast_to(np.arange(5.0) ** 2, (3, 4, 5))
    for estimator in (CENTRAL, ZUCKER_HUMMEL):
        found = gradients(Volume(squares), estimator)
        np.testing.assert_allclose(found[..., 0], np.broadcast_to([1.0, 2, 4, 6, 7], (3, 4, 5)), rtol=1e-15)
        assert not found[..., 1:].any()
    middle = gradients(Volume(squares), CENTRAL, (slice(1, 2), slice(1, 2), slice(1, 4)))
    assert middle[0, 0, :, 0].tolist() == [2, 4, 6]


def window(values: np.ndarray, position: tuple[int, ...], reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Offsets z, y, x (n, 3) and values (n,) of the finite samples of a window."""
    found = []
    for offset in itertools.product(range(-reach, reach + 1), repeat=3):
        z, y, x = np.add(position, offset)
        if min(z, y, x) >= 0 and (np.array([z, y, x]) < values.shape).all() and np.isfinite(values[z, y, x]):
            found.append((*offset, values[z, y, x]))
    table = np.array(found).reshape(-1, 4)
    return table[:, :3], table[:, 3]


@pytest.mark.parametrize("holes", [0, 0.2])
@pytest.mark.parametrize("scale", [0.5, 1.0])
def test_gaussian_is_the_slope_of_the_plane_that_fits_best(scale: float, holes: float) -> None:
    values = noise((9, 8, 7), np.float64)
    values = punctured(values, holes) if holes else values
    found = gradients(Volume(values), Estimator("gaussian", scale))
    for position in [(0, 0, 0), (3, 4, 5), (6, 7, 8), (0, 4, 8), (2, 1, 3), (5, 2, 2)]:
        offsets, samples = window(values, position, int(np.ceil(3 * scale)))
        root = np.exp(-0.25 * (offsets**2).sum(axis=1) / scale**2)
        plane = np.column_stack([np.ones(len(samples)), offsets]) * root[:, np.newaxis]
        expected = np.linalg.lstsq(plane, samples * root, rcond=None)[0][:0:-1]
        np.testing.assert_allclose(found[position], expected, rtol=1e-9, atol=1e-9)


def test_zucker_hummel_weighs_26_neighbours_by_their_distance() -> None:
    values = noise((4, 5, 6), np.float64)
    found = gradients(Volume(values), ZUCKER_HUMMEL)
    offsets, _ = window(values, (2, 2, 2), 1)
    weights = 1 / np.maximum(np.linalg.norm(offsets, axis=1), 1)
    for z, y, x in itertools.product(range(1, 5), range(1, 4), range(1, 3)):
        _, samples = window(values, (z, y, x), 1)
        for component, axis in enumerate((2, 1, 0)):
            planes = offsets[:, axis] * weights
            expected = (planes * samples).sum() / (planes * offsets[:, axis]).sum()
            assert found[z, y, x, component] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_beside_missing_samples_differences_take_what_is_there() -> None:
    nan, inf = np.nan, np.inf
    row = np.array([0.0, 1, nan, 9, 16, inf, nan, 49, nan, -inf, 100])
    expected = [1, 1, 4, 7, 7, 0, 0, 0, 0, 0, 0]
    for dtype in (np.float32, np.float64):
        found = gradients(Volume(row.astype(dtype).reshape(1, 1, -1)), CENTRAL)
        assert found[0, 0, :, 0].tolist() == expected
        assert not found[..., 1:].any()


@EVERY
@GRID
def test_a_linear_field_with_holes_has_its_slope(grid: str, estimator: Estimator) -> None:
    volume = linear(grid, (9, 10, 11))
    holed = Volume(punctured(volume.values, 0.1), volume.spacing, direction=volume.direction)
    found = gradients(holed, estimator)
    # One in ten: some window of the nearest three has no derivative along some axis, none of the wide ones.
    there = np.pad(np.isfinite(holed.values), 1)
    known = np.ones(holed.values.shape, bool)
    for axis in range(3):
        before, here, after = (np.roll(there, step, axis)[1:-1, 1:-1, 1:-1] for step in (1, 0, -1))
        known &= (before & after) | (here & (before | after))
    exact = (np.abs(found - SLOPE * volume.smallest_spacing) < rounding(volume)).all(axis=-1)
    assert np.isfinite(found).all()
    assert 0.5 < known.mean() < 1
    assert exact[known].all()
    assert exact.all() or estimator in (CENTRAL, ESTIMATORS[2], ADAPTIVE)


@EVERY
def test_a_gap_as_wide_as_the_window_has_no_gradient(estimator: Estimator) -> None:
    values = noise((40, 19, 18))
    values[:, :, 5:] = np.nan
    found = gradients(Volume(values), estimator)
    assert np.isfinite(found).all()
    assert not found[:, :, 14:].any()
    assert not gradients(Volume(np.full((4, 4, 4), np.nan)), estimator).any()
    assert largest_component(Volume(np.full((4, 4, 4), np.inf)), estimator) == 0


@pytest.mark.parametrize("scale", [0.1, 1.0, 2.3])
@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 0, 1), (1, -1, 0), (1, -1, 1), (0, 1, 1)])
def test_samples_in_one_plane_have_the_gradient_of_central_differences(
    normal: tuple[int, int, int], scale: float
) -> None:
    values = noise((9, 8, 7), np.float64)
    values[(positions((9, 8, 7)) - 3) @ normal != 0] = np.nan
    found = gradients(Volume(values, (1, 1.2, 0.8)), Estimator("gaussian", scale))
    np.testing.assert_array_equal(found, gradients(Volume(values, (1, 1.2, 0.8)), CENTRAL))


@EVERY
@pytest.mark.parametrize("dtype", [*"bBhHiIlL", "e"], ids=lambda each: np.dtype(each).name)
def test_no_type_wraps_around(dtype: str, estimator: Estimator) -> None:
    ends = np.finfo(dtype) if dtype == "e" else np.iinfo(dtype)
    values = np.random.default_rng(2).choice(np.array([ends.min, 0, ends.max], dtype), (6, 7, 8))
    found = gradients(Volume(values, (1, 2, 3)), estimator)
    expected = gradients(Volume(values.astype(np.float64), (1, 2, 3)), estimator)
    assert found.dtype == (np.float64 if np.dtype(dtype).itemsize > 2 else np.float32)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


@EVERY
def test_large_integers_keep_their_last_digit(estimator: Estimator) -> None:
    steps = np.arange(6 * 7 * 8).reshape(6, 7, 8) % 5
    small, large = Volume(steps.astype(np.int32)), Volume((steps + 2**30).astype(np.int32))
    assert gradients(small, estimator).dtype == np.float32
    np.testing.assert_allclose(gradients(large, estimator), gradients(small, estimator), atol=2e-6)


@EVERY
@pytest.mark.parametrize("dtype, size", [(np.float32, 3e38), (np.float64, 1e300), (np.float64, 1.7e308)])
@pytest.mark.parametrize("holes", [0, 0.3])
def test_values_near_the_largest_number_have_finite_gradients(
    holes: float, dtype: type, size: float, estimator: Estimator
) -> None:
    signs = np.random.default_rng(4).choice([-1.0, 1.0], (9, 8, 7))
    signs = punctured(signs, holes) if holes else signs
    for direction in (np.eye(3), SHEARED):
        found = gradients(Volume((signs * size).astype(dtype), direction=direction), estimator)
        assert np.isfinite(found).all()
        limit = float(np.finfo(dtype).max) / size
        expected = np.clip(gradients(Volume(signs.astype(dtype), direction=direction), estimator), -limit, limit)
        np.testing.assert_allclose(found / size, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("estimator", ESTIMATORS[:5], ids=str)  # the last one looks at the noise of the whole volume
def test_a_huge_value_spoils_no_small_ones(estimator: Estimator) -> None:
    values = noise((40, 7, 7)) * np.float32(1e-4)
    expected = gradients(Volume(values[:, :, :20]), estimator)[:, :, :10]
    values[3, 3, 35] = -3.4e38
    np.testing.assert_allclose(gradients(Volume(values), estimator)[:, :, :10], expected, rtol=1e-6, atol=1e-9)


RADII = {"cubic": (20, 20, 20), "anisotropic": (24, 13, 40), "sheared": (18, 18, 18)}


def ellipsoid(grid: str) -> tuple[Volume, np.ndarray, np.ndarray]:
    """|x / radii| at 64³, the index of 4,000 places on its surface of 1, and its normals there."""
    spacing, direction = GRIDS[grid]
    world_from_index, radii = direction * spacing, np.array(RADII[grid])
    radius = np.linalg.norm((positions((64, 64, 64)) - 31.5) @ world_from_index.T / radii, axis=-1)
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    index = (points * radii) @ np.linalg.inv(world_from_index).T + 31.5
    assert 1 < index.min() < index.max() < 62
    return Volume(radius, spacing, direction=direction), index, points / radii


def interpolated(vectors: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Vectors between the samples, as light uses them."""
    first = np.floor(index).astype(int)
    fraction = index - first
    total = np.zeros((len(index), 3))
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.where(corner, fraction, 1 - fraction).prod(axis=1, keepdims=True)
        x, y, z = (first + corner).T
        total += weight * vectors[z, y, x]
    return total


def fields(radius: np.ndarray, grid: str) -> dict[str, np.ndarray]:
    """Fields whose values are higher inside; the width of the step is 3 voxels where it is narrowest."""
    width = 3 * max(GRIDS[grid][0]) / min(RADII[grid])
    fraction = np.clip(0.5 - (radius - 1) / width, 0, 1)
    return {"distance": 100 - 100 * radius, "square": -(radius**2), "step": 255 * fraction**2 * (3 - 2 * fraction)}


# A square's central difference is its derivative, and any mean that is even keeps it: only rounding is left, of values
# up to 10 in gradients of about 0.05. The others have the estimators' own errors: the distance those of a surface whose
# radius is 20 voxels, up to 0.13°, and the step up to 0.31°. Central differences lose k² / 6 of a wave of k radians per
# sample, along one axis more than along another: on the step they are off by up to 5.5°, and are not for it.
@pytest.mark.parametrize("grid", RADII)
@pytest.mark.parametrize(
    "field, estimator, bound",
    [
        *[("square", each, 2e-3) for each in ESTIMATORS],
        *[("distance", each, 0.5) for each in ESTIMATORS[:4]],
        ("step", Estimator("gaussian"), 0.5),
    ],
    ids=lambda each: f"{each.kind} {each.scale}" if isinstance(each, Estimator) else str(each),
)
def test_normals_of_a_curved_surface(grid: str, field: str, estimator: Estimator, bound: float) -> None:
    volume, index, normals = ellipsoid(grid)
    values = fields(volume.values, grid)[field].astype(np.float32)
    found = interpolated(gradients(Volume(values, volume.spacing, direction=volume.direction), estimator), index)
    assert angles(-found, normals).max() < bound


# Noise of deviation σ leaves σ_g = σ / √2 in a component by central differences, and σ_g / √(8 π^1.5 s⁵) by the fit of
# scale s (see fits.py). The angle has two components, √2 σ_g / |∇f| in the mean square: here 0.25 / 5 = 2.9°.
# The surface's 4,900 samples count for 4900 / (4 π s²) independent ones, 100 at scale 2: a mean square of 2 × 100
# numbers is off by 10 %, its root by 5 %, and three times that is allowed.
@pytest.mark.parametrize("scale", [None, 1.0, 2.0])
def test_a_fit_leaves_as_much_noise_as_its_weights_say(scale: float | None) -> None:
    clean, _, _ = ellipsoid("cubic")
    volume = Volume(100 - 100 * clean.values + np.random.default_rng(1).normal(0, 0.25, clean.values.shape))
    near = np.abs(clean.values - 1) < 0.5 / 20
    found = gradients(volume, Estimator("gaussian", scale) if scale else CENTRAL)
    error = np.sqrt((angles(-found[near], positions((64, 64, 64))[near] - 31.5) ** 2).mean())
    expected = np.degrees(0.25 / 5) / (np.sqrt(8 * np.pi**1.5 * scale**5) if scale else 1)
    assert 0.85 < error / expected < 1.15


@EVERY
def test_the_largest_component_is_that_of_all_gradients(estimator: Estimator) -> None:
    for values in (noise((80, 50, 40)), punctured(noise((9, 8, 7)))):
        volume = Volume(values, (1, 1.2, 0.8), direction=SHEARED)
        assert largest_component(volume, estimator) == np.abs(gradients(volume, estimator)).max()


@EVERY
def test_the_largest_component_holds_no_more_than_a_few_chunks(
    estimator: Estimator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(threads, "ThreadPoolExecutor", lambda _: ThreadPoolExecutor(2))
    volume = Volume(np.random.default_rng(0).integers(0, 255, (128, 160, 160), np.uint8))
    tracemalloc.start()
    largest_component(volume, estimator)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # Two threads, each with a chunk of 2^16 samples, twice that with its neighbours, and four times with those of the
    # widest window; about 12 numbers of 4 bytes for each. All gradients would take 39 MB.
    assert peak < 2 * 12 * 4 * (2**18 if estimator.scale > 2 else 2**17)


def test_without_threads_the_gradients_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    volume = Volume(noise((80, 50, 40)))
    expected = gradients(volume, CENTRAL)

    def refuse(_: int) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threads, "ThreadPoolExecutor", refuse)
    assert (gradients(volume, CENTRAL) == expected).all()
    assert largest_component(volume, CENTRAL) == np.abs(expected).max()


@pytest.mark.parametrize(
    "kind, scale, message",
    [
        ("sobel", 1, "kind must be one of central, zucker-hummel, gaussian, adaptive, got 'sobel'"),
        ("gaussian", 0, "scale must be from 0.1 to 100 samples, got 0"),
        ("gaussian", float("nan"), "scale must be from 0.1 to 100 samples, got nan"),
        ("gaussian", "2", "scale must be from 0.1 to 100 samples, got '2'"),
    ],
)
def test_an_estimator_that_does_not_exist_is_refused(kind: str, scale: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Estimator(kind, scale)
