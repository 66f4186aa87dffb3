"""Cells know what may be in them, and how far on from them it is the same."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, maximum_filter
from support.scenes import sparse_volume

from texvol.scene.gradient import Estimator, EstimatorKind, gradients
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.cells import CELL, Cells

seeds = st.integers(0, 2**32 - 1)
sizes = st.tuples(*[st.integers(1, 20)] * 3)
DTYPES = (np.uint8, np.int8, np.int16, np.uint16, np.int64, np.float16, np.float32, np.float64)
FARTHEST = 16


def values_of(random: np.random.Generator, size: tuple[int, int, int], dtype: type) -> NDArray:
    """Noise that changes in steps, so that cells differ; some samples of floats are not there, or infinite."""
    values = random.integers(0, 100, size) * (random.random(size) < random.random())
    values = values.astype(dtype)
    if values.dtype.kind == "f":
        for special in (np.nan, np.inf, -np.inf):
            values[random.random(size) < random.choice([0, 0.02])] = special
    return values


def interpolated(volume: Volume, random: np.random.Generator, count: int) -> tuple[NDArray, NDArray]:
    """Places in the box in samples, (3, n) along z, y, x, many of them on the faces of cells, and the values there."""
    shape = np.array(volume.values.shape)[:, np.newaxis]
    positions = random.random((3, count)) * shape - 0.5
    on_grid = random.random((3, count)) < 0.3
    positions = np.where(on_grid, np.rint(positions + 0.5) - random.choice([0.5, 1.0], (3, count)), positions)
    positions = np.clip(positions, -0.5, shape - 0.5)
    with np.errstate(invalid="ignore", over="ignore"):
        return positions, map_coordinates(volume.values.astype(np.float64), positions, order=1, mode="nearest")


@settings(max_examples=80, deadline=None, derandomize=True)
@given(seeds, sizes, st.sampled_from(DTYPES))
def test_a_range_holds_every_interpolated_value_in_its_cell(seed: int, size: tuple[int, int, int], dtype: type) -> None:
    random = np.random.default_rng(seed)
    volume = Volume(values_of(random, size, dtype))
    cells = Cells.of(volume)
    assert cells.size == (CELL,) * 3
    assert cells.per_box == tuple(count / CELL for count in volume.dimensions)
    assert cells.lowest.shape == cells.highest.shape == tuple(-(-count // CELL) for count in size)
    positions, values = interpolated(volume, random, 2000)
    known = ~np.isnan(values)
    # A place on the face between two cells lies in both.
    for nudge in (-1e-9, 1e-9):
        inside = np.clip((positions + 0.5) / CELL + nudge, 0, np.array(cells.lowest.shape)[:, np.newaxis] - 1e-6)
        z, y, x = inside.astype(int)[:, known]
        assert (cells.lowest[z, y, x] <= values[known] + 1e-9).all()
        assert (cells.highest[z, y, x] >= values[known] - 1e-9).all()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seeds, sizes, st.sampled_from(DTYPES))
def test_a_range_is_that_of_the_samples_in_the_cell_and_beside_it(
    seed: int, size: tuple[int, int, int], dtype: type
) -> None:
    volume = Volume(values_of(np.random.default_rng(seed), size, dtype))
    cells = Cells.of(volume)
    for cell in np.ndindex(cells.lowest.shape):
        block = volume.values[tuple(slice(max(CELL * at - 1, 0), CELL * (at + 1) + 1) for at in cell)]
        there = block[~np.isnan(block)] if block.dtype.kind == "f" else block
        low, high = (there.min(), there.max()) if there.size else (np.nan, np.nan)
        np.testing.assert_array_equal([cells.lowest[cell], cells.highest[cell]], [low, high])


def test_a_large_volume_has_larger_cells() -> None:
    """As many as a transfer function can be looked up for while one waits."""
    values = np.arange(2000, dtype=np.int16)[:, np.newaxis, np.newaxis] + np.zeros((100, 200), np.int16)
    cells = Cells.of(Volume(values))
    size = cells.size[2]
    assert size > CELL
    assert 10**5 < cells.lowest.size < 10**6
    assert cells.per_box == tuple(count / side for count, side in zip((200, 100, 2000), cells.size, strict=True))
    low = np.arange(0, 2000, size)
    np.testing.assert_array_equal(cells.lowest, np.maximum(low - 1, 0)[:, np.newaxis, np.newaxis] + 0 * cells.lowest)
    high = np.minimum(low + size, 1999)
    np.testing.assert_array_equal(cells.highest, high[:, np.newaxis, np.newaxis] + 0 * cells.highest)


# Values from a few numbers, so that points meet samples and each other: steps, single points, ramps from nothing.
positions = st.lists(st.sampled_from([-1.0, 0.0, 1.0, 2.0, 2.5, 3.0, 7.0, 100.0]), min_size=1, max_size=6).map(sorted)


def transfer_function_of(random: np.random.Generator, values: list[float]) -> TransferFunction:
    """Mostly nothing; what shows is thin, dense or opaque, or glows without absorbing."""
    count = len(values)
    extinctions = random.choice([0.0, 0.0, 0.0, 1e-30, 0.5, np.inf], count)
    colors = random.choice([0.0, 0.0, 1.0], (count, 3))
    return TransferFunction(np.array(values), colors, extinctions, emissive=bool(random.integers(2)))


def shows(transfer_function: TransferFunction, values: NDArray) -> NDArray[np.bool_]:
    """Whether anything of a value is to be seen."""
    emission, extinction = transfer_function.classify(values)
    return (extinction > 0) | (emission > 0).any(axis=-1)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(seeds, positions, st.sampled_from([np.uint8, np.float32]))
@example(0, [2.0], np.uint8)
def test_a_cell_in_which_anything_shows_is_visible(seed: int, points: list[float], dtype: type) -> None:
    random = np.random.default_rng(seed)
    transfer_function = transfer_function_of(random, points)
    values = random.integers(0, 8, (random.integers(1, 20), 9, 8)).astype(dtype)
    values[: random.integers(20)] = random.integers(8)
    volume = Volume(values)
    cells = Cells.of(volume)
    visible = cells.visible(transfer_function)
    for cell in np.ndindex(visible.shape):
        low, high = float(cells.lowest[cell]), float(cells.highest[cell])
        between = np.append(np.linspace(low, high, 257), [p for p in points if low <= p <= high])
        assert visible[cell] or not shows(transfer_function, between).any()
        # Interpolation rounds: on a ramp that is next to nothing, and no step or opaque matter may be that near.
        for nudge in (-(2.0**-21), 2.0**-21):
            emission, extinction = transfer_function.classify(between * (1 + nudge))
            assert visible[cell] or max(emission.max(), extinction.max()) < 1e-4


def cells_between(lowest: float, highest: float) -> Cells:
    """One cell of that range."""
    return Cells(np.full((1, 1, 1), lowest), np.full((1, 1, 1), highest), (CELL,) * 3, (1.0,) * 3)


def points(*pairs: tuple[float, float], emissive: bool = False) -> TransferFunction:
    """Extinctions by value, or emissions without extinction."""
    values, numbers = np.array(pairs, float).T
    if emissive:
        return TransferFunction(values, np.repeat(numbers[:, np.newaxis], 3, axis=1), np.zeros(values.size), True)
    return TransferFunction(values, np.ones((values.size, 3)), numbers)


@pytest.mark.parametrize("emissive", [False, True])
@pytest.mark.parametrize(
    "pairs, lowest, highest, expected",
    [
        ([(0, 0), (5, 0), (9, 1)], 0, 5, False),  # up to the point from which it rises
        ([(0, 0), (5, 0), (9, 1)], 5, 5, False),
        ([(0, 0), (5, 0), (9, 1)], 5, 5.01, True),
        ([(0, 0), (5, 0), (9, 1)], -np.inf, 5, False),
        ([(0, 0), (5, 0), (9, 1)], 4, np.inf, True),
        ([(0, 0), (1, 0), (1, 1)], 0, 1, True),  # the right side of a step holds at the value itself
        ([(0, 0), (1, 0), (1, 1)], 0, 0.99, False),
        ([(0, 1), (1, 1), (1, 0)], 1.01, 9, False),
        ([(0, 0), (1, 1), (1, 0)], 0, 9, True),  # a tooth: it rises to a step down
        ([(0, 0), (1, 0), (1, 1), (2, 0)], 0, 0.9, False),
        ([(0, 1), (1, 0), (2, 0), (3, 1)], 1, 2, False),  # a gap
        ([(0, 1), (1, 0), (2, 0), (3, 1)], 0.9, 1.1, True),
        ([(3, 0), (4, 1), (5, 0)], 0, 9, True),  # a spike within the range, nothing at its ends
        ([(3, 0)], -9, 9, False),
        ([(3, 1)], -9, -9, True),  # beyond its points it goes on
        ([(0, 0), (9, 1)], np.nan, np.nan, False),
    ],
)
def test_what_is_empty_and_what_is_not(
    emissive: bool, pairs: list[tuple[float, float]], lowest: float, highest: float, expected: bool
) -> None:
    assert cells_between(lowest, highest).visible(points(*pairs, emissive=emissive)).item() is expected


@pytest.mark.parametrize("lowest, highest, expected", [(0, 4.9, False), (5.1, 6, True), (9, 9, True), (0, 9, True)])
def test_between_nothing_and_an_opaque_point_all_is_opaque(lowest: float, highest: float, expected: bool) -> None:
    assert cells_between(lowest, highest).visible(points((0, 0), (5, 0), (9, np.inf))).item() is expected


def test_colour_without_extinction_is_nothing_unless_it_glows() -> None:
    for emissive in (False, True):
        colored = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.zeros(2), emissive)
        assert cells_between(0, 1).visible(colored).item() is emissive


def octants_of(skips: NDArray[np.uint8]) -> Iterator[tuple[tuple[slice, ...], NDArray[np.uint8]]]:
    """How to turn an array so that each octant of directions goes up along all axes, and the leaps of it."""
    shape = tuple(count // 2 for count in skips.shape)
    for octant in np.ndindex(2, 2, 2):
        half = tuple(slice(count * down, count * (down + 1)) for count, down in zip(shape, octant, strict=True))
        turned = tuple(slice(None, None, -1 if down else 1) for down in octant)
        yield turned, skips[half][turned]


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seeds, st.tuples(*[st.integers(1, 24)] * 3), st.sampled_from([0.0, 0.001, 0.02, 0.5, 0.98, 0.999, 1.0]))
@example(0, (1, 1, 40), 0.02)
def test_a_leap_reaches_as_far_as_all_is_alike(seed: int, shape: tuple[int, int, int], fraction: float) -> None:
    visible = np.random.default_rng(seed).random(shape) < fraction
    skips = cells_between(0, 1).skips(visible)
    assert skips.dtype == np.uint8 and skips.shape == tuple(2 * count for count in shape)
    for turned, of_octant in octants_of(skips):
        kinds = visible[turned]
        np.testing.assert_array_equal(of_octant & 1, kinds)
        # How many cells on, along axes and diagonals, are of one kind; what lies outside the box is of none.
        reach = np.zeros(shape, int)
        for r in range(1, FARTHEST + 1):
            full, empty = (maximum_filter(kind, r, mode="constant", origin=-(r // 2)) for kind in (kinds, ~kinds))
            reach += ~(full & empty)
        np.testing.assert_array_equal(of_octant >> 1, reach)


def test_a_leap_by_brute_force() -> None:
    """The definition itself, cell by cell: all cells less than r away in an octant are like the one in its corner."""
    visible = np.random.default_rng(7).random((5, 6, 7)) < 0.03
    for turned, of_octant in octants_of(cells_between(0, 1).skips(visible)):
        kinds = visible[turned]
        for cell in np.ndindex(kinds.shape):
            for r in range(1, FARTHEST + 1):
                near = kinds[tuple(slice(at, at + r) for at in cell)]
                assert (near == kinds[cell]).all() == (r <= of_octant[cell] >> 1)


def test_a_long_volume_has_no_more_cells_along_an_axis_than_a_texture_can_hold() -> None:
    volume = Volume(np.zeros((3, 3, 20_000), np.uint8))
    cells = Cells.of(volume)
    assert cells.size == (20, CELL, CELL) and cells.per_box == (1000, 3 / CELL, 3 / CELL)
    assert cells.skips(cells.visible(points((0, 0), (1, 1)))).shape == (2, 2, 2000)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3.0])
def test_volumes_of_one_value(value: float) -> None:
    for size in ((1, 1, 1), (9, 8, 17)):
        cells = Cells.of(Volume(np.full(size, value)))
        np.testing.assert_array_equal(np.unique(cells.lowest), [value])
        np.testing.assert_array_equal(np.unique(cells.highest), [value])
        visible = cells.visible(points((0, 0), (1, 1)))
        assert visible.all() == visible.any() == (value > 1)


def test_one_nan_does_not_hide_its_cell() -> None:
    values = np.zeros((CELL, CELL, CELL))
    values[1, 2, 0], values[0, 0, 0] = np.nan, 2
    cells = Cells.of(Volume(values))
    assert (cells.lowest.item(), cells.highest.item()) == (0, 2)
    assert cells.visible(points((0, 0), (2, 1))).all()


@pytest.mark.parametrize(
    "kind, scale", [("central", 1.0), ("zucker-hummel", 1.0), ("gaussian", 1.0), ("gaussian", 2.5)]
)
def test_no_gradient_in_a_cell_is_steeper_than_it_says(kind: EstimatorKind, scale: float) -> None:
    """Of clumps, so that most cells are flat, and at the samples all around, which interpolation mixes in."""
    volume, estimator = sparse_volume(3), Estimator(kind, scale)
    cells = Cells.of(volume)
    steepest = cells.steepest(volume, estimator.reach)
    found = np.linalg.norm(gradients(volume, estimator), axis=-1) / volume.smallest_spacing
    padded = np.pad(found, 1, mode="edge")
    around = np.max([padded[z : z + found.shape[0], y : y + found.shape[1], x : x + found.shape[2]]
                     for z, y, x in np.ndindex(3, 3, 3)], axis=0)  # fmt: skip
    z, y, x = (np.arange(count) // CELL for count in found.shape)
    assert (around <= steepest[np.ix_(z, y, x)]).all()
    # Flat cells are known for such, but for the rounding that texels may have.
    assert steepest.min() <= 1e-4 * steepest.max()


def test_beside_missing_samples_nothing_is_known_of_gradients() -> None:
    values = np.zeros((9, 9, 9), np.float32)
    values[4, 4, 4] = np.nan
    volume = Volume(values)
    assert np.isinf(Cells.of(volume).steepest(volume, 1)).all()
