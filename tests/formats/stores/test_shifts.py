"""Levels that lie elsewhere than their metadata say are found, and no others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from support.stores import field, halved, write_ome

from texvol import load


def every_second(values: NDArray) -> NDArray:
    return values[..., ::2, ::2, ::2]


def noisy(values: NDArray) -> NDArray:
    random = np.random.default_rng(1)
    return (values + random.normal(scale=12, size=values.shape)).astype(np.float32)


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_a_forgotten_translation_is_named_and_corrected(tmp_path: Path, version: str, noise: bool) -> None:
    values = noisy(field(64)) if noise else field(64)
    path = write_ome(tmp_path / "v.ome.zarr", values, shift=None, version=version)
    volume = load(path)
    assert "level 1 lies 0.5 samples of level 0 along x, y, z off where its metadata put it" in "\n".join(volume.notes)
    assert "level 2 lies 1.5 samples" in volume.notes[1]
    assert_allclose([each.first for each in volume.levels], 0)  # nothing moves unless told
    assert all("--fix-pyramid corrects this" in each for each in volume.notes)
    fixed = load(path, fix_pyramid=True)
    assert_allclose([each.first for each in fixed.levels], [[0] * 3, [0.5] * 3, [1.5] * 3], atol=1e-12)
    assert all("corrected by --fix-pyramid" in each for each in fixed.notes)
    assert fixed.source["fix_pyramid"] is True


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize(("down", "shift"), [(halved, 0.5), (every_second, 0.0)])
def test_levels_that_lie_where_they_should_are_not_accused(
    tmp_path: Path, down: Callable[[NDArray], NDArray], shift: float, noise: bool
) -> None:
    values = noisy(field(64)) if noise else field(64)
    path = write_ome(tmp_path / "v.ome.zarr", values, shift=shift, down=down)
    assert load(path).notes == ()
    fixed = load(path, fix_pyramid=True)
    assert_allclose([each.first for each in fixed.levels], [[0] * 3, [shift] * 3, [3 * shift] * 3], atol=1e-9)


def test_every_second_sample_with_the_place_of_averages_is_noticed(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", field(64), shift=0.5, down=every_second)
    assert "level 1 lies -0.5 samples of level 0" in load(path).notes[0]
    fixed = load(path, fix_pyramid=True)
    assert_allclose([each.first for each in fixed.levels], [[0] * 3] * 3, atol=1e-9)


def test_a_shift_along_one_axis_is_that_axis_alone(tmp_path: Path) -> None:
    def moved(values: NDArray) -> NDArray:
        return np.roll(halved(values), -1, axis=-1)

    path = write_ome(tmp_path / "v.ome.zarr", field(64), levels=2, down=moved)
    (note,) = load(path).notes
    assert "along x off" in note
    (x, y, z) = load(path, fix_pyramid=True).levels[1].first
    assert (y, z) == (0.5, 0.5)
    # One coarse sample further; the estimate is good to a tenth of a fine sample.
    assert x == pytest.approx(2.5, abs=0.1)


def test_a_constant_volume_tells_nothing(tmp_path: Path) -> None:
    assert load(write_ome(tmp_path / "v.ome.zarr", np.full((40, 40, 40), 3.0), shift=0.0)).notes == ()
