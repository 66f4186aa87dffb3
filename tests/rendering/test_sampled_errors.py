"""The largest error of all pixels, told from some of them: on numbers of known distribution, and on random scenes."""

from __future__ import annotations

import numpy as np
import pytest
from support.judged_estimates.campaign import scene_of

from texvol.ray_casting import raycast
from texvol.rendering.checking import errors_of
from texvol.rendering.renderer import Renderer
from texvol.rendering.sampled_errors import beyond_sample

SIZE = (96, 96)


def pareto(exponent: float, count: int) -> np.ndarray:
    """Numbers of which those beyond x are as frequent as x^(-1/exponent)."""
    return (np.arange(count) + 0.5) ** -exponent


@pytest.mark.parametrize("exponent", [0.1, 0.3, 0.45])
@pytest.mark.parametrize("times", [4, 16])
def test_the_largest_of_many_errors_is_foreseen_from_some(exponent: float, times: int) -> None:
    largest = pareto(exponent, 4096 * times)[0] * times**exponent  # in units of a sample's
    foreseen = pareto(exponent, 4096)[0] * beyond_sample(pareto(exponent, 4096), 4096 * times)
    assert 0.75 * largest < foreseen < 1.5 * largest


def test_equal_errors_and_none_are_not_exceeded() -> None:
    assert beyond_sample(np.full((8, 8), 0.1), 6400) == 1
    assert beyond_sample(np.zeros((8, 8)), 6400) == 1


def test_one_error_alone_is_the_heaviest_distribution() -> None:
    lone = np.zeros((8, 8))
    lone[3, 4] = 0.1
    assert beyond_sample(lone, 16 * lone.size) == pytest.approx(4)
    assert beyond_sample(lone, lone.size) == 1


def test_infinite_errors_need_no_more() -> None:
    assert beyond_sample(np.array([np.inf, 1.0, 0.5, 0.1]), 100) == 1


@pytest.mark.parametrize("number", [25, 77, 155, 246])
def test_estimates_of_noisy_isosurfaces_are_true(number: int) -> None:
    kind, scene, rate = scene_of(number, [])
    assert kind == "isosurface"
    with Renderer() as renderer:
        picture = np.asarray(renderer.render(scene, SIZE, sampling_rate=rate))
        shown, in_stats = renderer.quick_estimate(), renderer.stats["estimated_error"]
    truth = raycast(scene.completed(SIZE), SIZE)
    error = errors_of(picture.reshape(-1, 4), truth.reshape(-1, 4)).max()
    assert shown is not None
    assert error <= min(shown, in_stats)
    assert max(shown, in_stats) < 40 * error
