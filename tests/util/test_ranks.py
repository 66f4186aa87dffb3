"""Numbers by their rank are those of numpy and of the standard library."""

from __future__ import annotations

import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from texvol.util.statistics import distinct, histogram, median, percentile_of_sorted

NUMBERS = [
    np.array([3.0]),
    np.array([2.0, 2.0, 2.0]),
    np.array([1.0, -np.inf, 5.0, 1.0, np.nextafter(1.0, 2.0), -0.0, 0.0]),
    np.random.default_rng(3).normal(size=1000).round(2),
    np.random.default_rng(4).random(101),
]


@pytest.mark.parametrize("numbers", NUMBERS)
def test_each_number_is_there_once(numbers: np.ndarray) -> None:
    np.testing.assert_array_equal(distinct(numbers), np.unique(numbers))


def test_of_none_there_is_none() -> None:
    assert distinct(np.empty(0)).shape == (0,)


@pytest.mark.parametrize("numbers", [each for each in NUMBERS if np.isfinite(each).all()])
def test_percentiles_are_those_of_numpy(numbers: np.ndarray) -> None:
    percent = np.array([0, 0.1, 5, 33.3, 50, 99.9, 100])
    np.testing.assert_array_equal(percentile_of_sorted(np.sort(numbers), percent), np.percentile(numbers, percent))
    assert percentile_of_sorted(np.sort(numbers), 5) == np.percentile(numbers, 5)


@pytest.mark.parametrize("numbers", [[2.0], [3.0, 1.0], [5.0, 1.0, 2.0], [4.0, 1.0, 3.0, 2.0]])
def test_a_median_is_that_of_the_standard_library(numbers: list[float]) -> None:
    assert median(numbers) == statistics.median(numbers)


def test_a_picture_imports_none_of_what_they_stand_for(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(0).random((9, 9, 9)))
    code = (
        "import sys; from texvol.__main__ import main; "
        "main(['render', 'a.npy', '--tf', 'fog', '-o', 'a.png', '--size', '9x9']); "
        "sys.exit(', '.join({'numpy.ma', 'statistics'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr.strip() == "" and (tmp_path / "a.png").exists()


@pytest.mark.parametrize(
    "ends", [(0.0, 2.0), (1e15, 1e15 + 1), (2.0**60, 2.0**60 + 256), (7.0, 7.0), (0.0, 1e-323), (-4e307, 4e307)]
)
def test_a_histogram_of_neighbouring_numbers_has_all_bins(ends: tuple[float, float]) -> None:
    numbers = np.array([ends[0], ends[1], ends[1]])
    with np.errstate(all="raise"):
        counts, edges = histogram(numbers, 64, ends)
    assert (counts.sum(), counts.size) == (3, 64)
    assert (np.diff(edges) > 0).all()
    assert histogram(numbers, 64, (-1.7e308, 1.7e308))[0].sum() == (numbers <= 4e307).sum()
    if ends == (0.0, 2.0):
        np.testing.assert_array_equal(edges, np.histogram(numbers, 64, ends)[1])
