"""Sampling rate that nobody chose: as fine as the picture's own error needs, and the same every time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, smooth_volume

from texvol import Lighting, Renderer, Scene, TransferFunction, Volume
from texvol.rendering import default_rate, error_control
from texvol.rendering.model_error import Classified
from texvol.rendering.settings import DEFAULT_EARLY_TERMINATION, Settings
from texvol.scene.scene import CompleteScene

SIZE = (96, 96)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A lit surface that has rings at one slab per voxel."""
    return Scene(smooth_volume(40), BONE, lighting=Lighting())


def test_the_estimate_is_within_its_limit(scene: Scene) -> None:
    with Renderer() as renderer:
        renderer.render(scene, SIZE, sampling_rate=1)
        coarse = renderer.stats
        renderer.render(scene, SIZE)
        stats = renderer.stats
        quick = renderer.quick_estimate()
    assert stats["classification"] == "post"
    assert coarse["estimated_error"] > default_rate.LIMIT >= stats["estimated_error"]
    assert quick is not None and quick <= default_rate.LIMIT
    factor = coarse["slab_thickness"] / stats["slab_thickness"]
    assert 1 < factor <= 16 and 2 * factor == pytest.approx(round(2 * factor))


@pytest.mark.parametrize("far", [0.0, 1e9])
def test_a_report_draws_a_reference_only_where_rounding_has_no_bound(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, far: float
) -> None:
    """The choice of the rate has compared two pictures of the same texels: beside far values both may be wrong."""
    values = scene.volume.values.astype(np.float32)
    values[0, 0, 0] += far
    drawn: list[float] = []
    by_finer = error_control.estimate_by_finer

    def counted(*arguments: Any, **more: Any) -> float:
        drawn.append(by_finer(*arguments, **more))
        return drawn[-1]

    monkeypatch.setattr(error_control, "estimate_by_finer", counted)
    with Renderer() as renderer:
        renderer.render(Scene(Volume(values), BONE, lighting=Lighting()), SIZE)
        quick, told = renderer.quick_estimate(), renderer.stats["estimated_error"]
    assert len(drawn) == (far > 0)
    assert quick is not None and told == pytest.approx(drawn[0] if drawn else quick, rel=0.05)


def test_what_is_asked_for_stays(scene: Scene) -> None:
    spacing = scene.volume.smallest_spacing
    with Renderer() as renderer:
        for given in ({"sampling_rate": 1.0}, {"slab_thickness": spacing}):
            renderer.render(scene, SIZE, **given)
            assert renderer.settings["slab_thickness"] == spacing
        for kind in ("post", "slab", "extinction", "integrated"):
            renderer.render(replace(scene, classification=kind), SIZE)
            assert renderer.settings["slab_thickness"] == spacing


def test_the_same_scene_gives_the_same_picture(scene: Scene) -> None:
    with Renderer() as one, Renderer() as other:
        first = one.render(scene, SIZE)
        one.render(replace(scene, background=(0, 0, 1)), SIZE)
        np.testing.assert_array_equal(one.render(scene, SIZE), first)
        np.testing.assert_array_equal(other.render(scene, SIZE), first)


def test_the_estimate_bounds_the_true_error(scene: Scene) -> None:
    with Renderer() as renderer:
        picture = renderer.render(scene, SIZE)
        estimate = renderer.quick_estimate()
        fine = renderer.render(replace(scene, classification="integrated"), SIZE, sampling_rate=64, early_termination=0)
    assert estimate is not None
    # Not more than a few times the error, or pictures would be finer than they have to be.
    assert np.abs(picture - fine).max() <= estimate <= 5 * np.abs(picture - fine).max()


def sampled(renderer: Renderer, scene: Scene) -> float:
    """Number of slabs that a picture of one slab per voxel samples."""
    renderer.render(scene, SIZE, sampling_rate=1, early_termination=default_rate.LIMIT / 16)
    return float(quick_stats(renderer, samples=True)["samples"])


@pytest.mark.parametrize(("times", "rate"), [(0.5, 1.0), (1.4, 1.0), (1.8, 1.5)])
def test_no_more_slabs_are_sampled_than_half_a_second_has(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, times: float, rate: float
) -> None:
    """The small picture has the size of the whole one here; half a slab per spacing is the step of rates."""
    monkeypatch.setattr(default_rate, "_small", lambda size: size)
    with Renderer() as renderer:
        monkeypatch.setattr(default_rate, "_MOST_SAMPLED", times * sampled(renderer, scene))
        renderer.render(scene, SIZE)
        assert renderer.settings["slab_thickness"] == pytest.approx(scene.volume.smallest_spacing / rate)
        estimate = renderer.quick_estimate()
        assert estimate is not None and (estimate <= default_rate.LIMIT) == (rate > 1)


def test_slabs_that_are_skipped_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball has the rate that it needs, however large the empty box around it is."""
    monkeypatch.setattr(default_rate, "_small", lambda size: size)
    z, y, x = np.mgrid[-1:1:32j, -1:1:32j, -1:1:32j]
    ball = np.clip(1.2 - np.sqrt(x**2 + y**2 + z**2), 0, 1).astype(np.float32)
    medium = TransferFunction(np.array([0.5, 0.6]), np.ones((2, 3)), np.array([0.0, 2.0]))
    scenes = [Scene(Volume(np.pad(ball, width)), medium, lighting=Lighting()) for width in (0, 100)]
    crossed, rates = [], []
    with Renderer() as renderer:
        for scene in scenes:
            renderer.render(scene, SIZE)
            stats = quick_stats(renderer, samples=True)
            crossed.append(stats["samples_total"])
            rates.append(scene.volume.smallest_spacing / renderer.settings["slab_thickness"])
            monkeypatch.setattr(default_rate, "_MOST_SAMPLED", 1.5 * stats["samples"])
    assert rates[0] == rates[1] > 1
    assert crossed[1] > 1.5 * crossed[0], "counting what is crossed would have made the slabs thicker"


def test_rays_end_as_early_as_the_limit_allows_unless_told(scene: Scene) -> None:
    with Renderer() as renderer:
        renderer.render(scene, SIZE)
        assert renderer.settings["early_termination"] == default_rate.LIMIT / 16
        renderer.render(scene, SIZE, early_termination=0)
        assert renderer.settings["early_termination"] == 0
        renderer.render(scene, SIZE, sampling_rate=2)
        assert renderer.settings["early_termination"] < 1e-6


@pytest.mark.parametrize("error", [0.02, 0.05, 0.11, 0.2, 0.3])
@pytest.mark.parametrize("order", [1.0, 1.6, 2.0])
def test_the_rate_is_about_the_least_that_keeps_the_limit(scene: Scene, error: float, order: float) -> None:
    """Errors of the pictures are those at one slab per voxel, times a power of the slab thickness."""

    def draw(scene: CompleteScene, size: tuple[int, int], settings: Settings) -> np.ndarray:
        return np.full((2, 2, 4), error * settings.slab_thickness**order, np.float32)

    def estimated(rate: float, finest: float) -> float:
        pictures = (draw(complete, SIZE, replace(settings, slab_thickness=1 / each)) for each in (rate, finest))
        return error_control.estimate(*pictures, np.log2(finest / rate))

    complete, settings = scene.completed(SIZE), Settings(1.0, "auto", "rgba32f", DEFAULT_EARLY_TERMINATION, True)
    chooser = default_rate.DefaultRate(draw, lambda *_: 1)
    rate = 1 / chooser.settled(complete, SIZE, settings, Classified("post")).slab_thickness
    limit = default_rate.LIMIT * (1 - 1 / 16)
    assert chooser.estimate is not None and chooser.estimate <= default_rate.LIMIT
    if rate > 1:
        finest = 4 * 2 ** np.ceil(np.log2(rate))
        assert estimated(rate, finest) <= limit < estimated(0.8 * rate - 0.5, finest)


def test_a_given_transfer_function_without_light_is_drawn_as_ever(scene: Scene) -> None:
    """One of a look has as many slabs as it needs; a look that is adjusted stays one."""
    unlit, spacing = replace(scene, lighting=None), scene.volume.smallest_spacing
    steep = TransferFunction([0.49, 0.5], [(1, 1, 1), (1, 1, 1)], [0, 5.0], by_look=True)
    with Renderer() as renderer:
        picture = renderer.render(unlit, SIZE)
        assert renderer.settings["slab_thickness"] == spacing
        np.testing.assert_array_equal(picture, renderer.render(unlit, SIZE, sampling_rate=1))
        for medium, is_chosen in (
            (steep, True),
            (replace(steep, name="mine"), True),
            (replace(steep, by_look=False), False),
        ):
            renderer.render(replace(unlit, transfer_function=medium), SIZE)
            assert (renderer.settings["slab_thickness"] < spacing) == is_chosen


@pytest.mark.parametrize("name", [None, "ct-bone", "mr", "fog"])
def test_looks_say_that_they_chose(scene: Scene, name: str | None) -> None:
    for lighting in (None, "none"):
        found = Scene(scene.volume, name, lighting=lighting)
        medium = found.completed(SIZE).transfer_function
        assert medium is not None and medium.by_look
