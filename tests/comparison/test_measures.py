"""What is measured of a pair of pictures, against pictures whose differences are known."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from support.compared_pictures import smooth

from texvol.comparison.measures import flip, measure, structural_similarity
from texvol.comparison.pictures import Picture
from texvol.formats.pictures import image


def test_one_pixel_is_found_and_measured() -> None:
    reference = smooth()
    candidate = reference.copy()
    candidate[13, 29, 1] += 0.5
    found = measure(Picture.of_array(candidate), Picture.of_array(reference), 1e-3)
    count = reference.shape[0] * reference.shape[1]
    assert found.worst_pixel == (29, 13)
    assert found.max_error == pytest.approx(0.5, abs=1e-6)
    assert found.rms_error == pytest.approx(0.5 / np.sqrt(4 * count), rel=1e-5)
    assert found.parts["color"].rms_error == pytest.approx(0.5 / np.sqrt(3 * count), rel=1e-5)
    assert found.parts["opacity"].max_error == 0 and found.parts["opacity"].psnr == np.inf
    assert found.parts["all"].mean_error == pytest.approx(0.5 / (4 * count), rel=1e-5)
    assert found.parts["all"].psnr == pytest.approx(-20 * np.log10(found.rms_error))
    assert found.parts["all"].percentile_99 == 0
    assert found.percent_over == pytest.approx(100 / count)
    assert found.worst_values[0][1] - found.worst_values[1][1] == pytest.approx(0.5, abs=1e-6)
    # On a soft ground no neighbour is anywhere near.
    assert 0.3 < found.outlier <= 0.5


def test_percentiles_are_those_of_the_pixels() -> None:
    reference = np.zeros((10, 100, 3), np.float32)
    candidate = reference.copy()
    candidate.reshape(-1, 3)[:1000, 0] = np.arange(1000) / 1000
    found = measure(Picture.of_array(candidate), Picture.of_array(reference), 0.9).parts["all"]
    assert found.percentile_99 == pytest.approx(0.99, abs=1e-3)
    assert found.percentile_99_9 == pytest.approx(0.999, abs=1e-3)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("which", ["candidate", "reference", "both"])
def test_what_is_not_finite_is_counted_and_infinitely_far(wrong: float, which: str) -> None:
    pair = {"candidate": smooth(), "reference": smooth()}
    for name in pair if which == "both" else [which]:
        pair[name][5, 7, 2] = wrong
    found = measure(Picture.of_array(pair["candidate"]), Picture.of_array(pair["reference"]), 1e-3)
    assert found.non_finite == 1 and found.worst_pixel == (7, 5)
    for number in (found.max_error, found.rms_error, found.beyond_max, found.beyond_rms, found.outlier):
        assert not number <= 1e300
    # Infinity - infinity is no number that a limit or JSON could take.
    assert not np.isnan([part.percentile_99_9 for part in found.parts.values()]).any()
    json.dumps(found.as_json(), allow_nan=False)


def test_differences_within_the_rounding_of_eight_bits_are_none() -> None:
    light = smooth((200, 150), seed=3)
    rounded = Picture.of_array(image.eight_bits(light))
    exact = Picture.of_array(light[..., :3])
    found = measure(rounded, exact, 1e-3)
    assert found.max_error > 1e-3
    assert found.beyond_max == 0 and found.percent_over == 0 and found.beyond_rms == 0


def test_a_level_everywhere_is_a_difference_and_a_few_that_flip_are_none() -> None:
    light = np.clip(smooth((200, 150), seed=4)[..., :3], 0.05, 0.9)
    levels = image.eight_bits(np.dstack([light, np.ones(light.shape[:2])]))
    base = Picture.of_array(levels)
    brighter = measure(Picture.of_array(levels + np.uint8(1)), base, 1e-3)
    # A level is 1/255 of an encoding with a slope of 0.3 … 2: a quarter of a hundredth of light.
    assert brighter.beyond_rms > 1e-3 and brighter.beyond_max < 1e-5
    # Pictures 1e-5 apart, each rounded: a pixel in a hundred or so is on the other side of a boundary.
    moved = image.eight_bits(np.dstack([light + 1e-5, np.ones(light.shape[:2])]))
    flipped = (moved != levels).mean()
    assert 0.0005 < flipped < 0.02
    nearly = measure(Picture.of_array(moved), base, 1e-3)
    assert nearly.rms_error > 5e-5 and nearly.beyond_rms < 2e-5


def test_an_edge_that_moves_a_little_leaves_no_neighbourhood() -> None:
    x = np.arange(64.0)
    edge = np.clip(x - 30.2, 0, 1)[np.newaxis].repeat(20, 0).astype(np.float32)
    moved = np.clip(x - 30.9, 0, 1)[np.newaxis].repeat(20, 0).astype(np.float32)
    found = measure(Picture.of_array(moved), Picture.of_array(edge), 1e-3)
    assert found.beyond_max > 0.6 and found.outlier == 0
    spot = edge.copy()
    spot[10, 10] = 0.5
    for pair in ((spot, edge), (edge, spot)):
        found = measure(Picture.of_array(pair[0]), Picture.of_array(pair[1]), 1e-3)
        assert found.outlier == pytest.approx(0.5, abs=2e-6)


def test_similarity_is_that_of_its_authors() -> None:
    a = smooth((70, 60), 1)[..., 0].astype(np.float64)
    b = np.clip(a + 0.05 * np.random.default_rng(2).standard_normal(a.shape), 0, 1)

    def mean(picture: NDArray) -> NDArray:
        return gaussian_filter(picture, 1.5, truncate=5 / 1.5, mode="reflect")

    mean_a, mean_b = mean(a), mean(b)
    var_a, var_b, both = mean(a * a) - mean_a**2, mean(b * b) - mean_b**2, mean(a * b) - mean_a * mean_b
    expected = (
        (2 * mean_a * mean_b + 1e-4) * (2 * both + 9e-4) / ((mean_a**2 + mean_b**2 + 1e-4) * (var_a + var_b + 9e-4))
    ).mean()
    assert structural_similarity(a, b) == pytest.approx(expected, abs=1e-9)
    assert structural_similarity(a, a) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (4, 40)])
def test_tiny_pictures_are_measured(size: tuple[int, int]) -> None:
    a, b = smooth(size, 1), smooth(size, 2)
    found = measure(Picture.of_array(a), Picture.of_array(b), 1e-3)
    assert np.isfinite([found.ssim, found.flip, found.outlier, found.rms_error]).all()
    assert found.rms_error > 0 or size == (1, 1)


def test_a_wrong_object_on_black_has_a_weighted_median_however_small_it_is() -> None:
    medians, means = [], []
    for size in (40, 160):
        reference = np.zeros((size, size, 4), np.float32)
        reference[10:20, 10:20] = 0.5, 0.1, 0.1, 1
        candidate = reference.copy()
        candidate[10:20, 10:20] = 0.1, 0.5, 0.1, 1
        found = measure(Picture.of_array(candidate), Picture.of_array(reference), 1e-3)
        medians.append(found.flip_weighted_median)
        means.append(found.flip)
    # The same difference on 16 times the black: the mean is a 16th.
    assert means[0] == pytest.approx(16 * means[1], rel=1e-3) and means[1] < 0.01
    assert medians[0] == pytest.approx(medians[1], rel=1e-3) and medians[0] > 0.3


def test_flip_is_none_of_equal_pictures_and_grows_with_the_difference() -> None:
    a = smooth()
    small, large = a.copy(), a.copy()
    small[..., :3] *= 0.99
    large[..., :3] *= 0.8
    assert flip(a, a) == 0
    assert 0 < flip(small, a) < flip(large, a) < 1
    white, black = np.ones_like(a), np.zeros_like(a)
    # Black and white are as far apart as its authors' scale goes; their own code gives 0.97.
    assert flip(white, black) > 0.95


def test_a_scale_makes_shares_of_all_but_the_values() -> None:
    a, b = smooth(seed=1), smooth(seed=2)
    plain = measure(Picture.of_array(a), Picture.of_array(b), 1e-3)
    scaled = measure(Picture.of_array(a * 500), Picture.of_array(b * 500), 1e-3, 500.0)
    assert scaled.rms_error == pytest.approx(plain.rms_error, rel=1e-5)
    assert scaled.ssim == pytest.approx(plain.ssim, abs=1e-6)
    assert scaled.worst_values[0][0] == pytest.approx(500 * plain.worst_values[0][0], rel=1e-5)
