"""How far coarse levels move a picture: what they leave out, what rays make of it, and which levels follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from support.large import large
from support.quick_stats import quick_stats

from texvol import Camera, Renderer, Scene, TransferFunction, Volume
from texvol.rendering.streaming.left_out import Guide, most_around
from texvol.rendering.streaming.levels import _coarsest, levels_by_error
from texvol.rendering.streaming.ordering import RegionsOfPicture
from texvol.rendering.streaming.plan import plan
from texvol.rendering.streaming.sensitivity import Sensitivity
from texvol.scene.large_volume import LargeVolume
from texvol.slicing.bricks import Brick
from texvol.slicing.regions import regions_of_level
from texvol.textures.distribution import Smoothed

SIZE = (64, 64)
FOG = TransferFunction([0, 255], [(1, 0.5, 0.2), (0.2, 0.5, 1)], [0, 0.02])


def noise(deviation: float, n: int = 64) -> Volume:
    """Values about 128 that know nothing of their neighbours."""
    values = 128 + np.random.default_rng(5).normal(0, deviation, (n, n, n))
    return Volume(values.astype(np.float32))


def guide_of(volume: Volume, levels: int = 3) -> Guide:
    stored, _ = large(volume, levels=levels)
    guide = Guide.of(stored, Smoothed(FOG, 1.0))
    assert guide is not None
    return guide


def test_of_noise_all_but_the_variance_of_means_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Means of 8 samples have an eighth of the variance, those of 64 a 64th; second differences have six times it."""
    deviation, of_steps = 20.0, 3 * 6 / 48
    guide = guide_of(noise(deviation))
    assert guide.number == 1
    assert_allclose(guide.left_out(1).mean() * 255**2, deviation**2 * (7 / 8 + of_steps / 8), rtol=0.02)
    monkeypatch.setattr("texvol.scene.large_volume._LOOKED_AT", 16**3)
    guide = guide_of(noise(deviation))
    assert guide.number == 2
    assert_allclose(guide.left_out(2).mean() * 255**2, deviation**2 * (63 / 64 + of_steps / 64), rtol=0.03)
    # From one level to the next it becomes an eighth, so that level 1 has 8/9 of what level 2 has.
    assert_allclose(guide.left_out(1).mean() / guide.left_out(2).mean(), 8 / 9, rtol=0.03)


def test_rays_beside_the_worst_samples_count_them() -> None:
    values = np.full((64, 64, 64), 50, np.float32)
    values[20:22, 30, 40] = 250
    guide = guide_of(Volume(values))
    left_out = guide.left_out(1)
    own, most = (each > 0.01 * each.max() for each in (left_out, most_around(left_out)))
    z, y, x = np.nonzero(own)
    around = np.zeros(own.shape, bool)
    for shift in np.ndindex(3, 3, 3):
        around[z + shift[0] - 1, y + shift[1] - 1, x + shift[2] - 1] = True
    assert own[10, 15, 20] and np.array_equal(most, around)


def test_of_a_linear_function_nothing_is_left_out() -> None:
    """Interpolation between coarse samples brings it back, but at the faces of the box."""
    values = np.broadcast_to(np.arange(64, dtype=np.float32) * 4, (64, 64, 64)).copy()
    guide = guide_of(Volume(values))
    inside = (slice(2, -2),) * 3
    # Two samples that are 4 apart vary by 2² within a coarse one.
    assert_allclose(guide.below[inside] * 255**2, 4.0, rtol=0.02)
    assert (guide.left_out(1)[inside] * 255**2 < 0.05).all()


@pytest.mark.parametrize("extinction", [0.02, 0.3])
def test_rays_are_moved_about_as_far_as_predicted(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, extinction: float
) -> None:
    """Root mean squares over a picture; the prediction has a term for all that is not noise."""
    monkeypatch.setattr("texvol.rendering.streaming.sensitivity.most_around", lambda values: values)
    stored, _ = large(noise(20.0))
    ramp = TransferFunction([0, 255], [(1, 0.5, 0.2), (0.2, 0.5, 1)], [0, extinction])
    scene = Scene(stored, ramp, Camera.framing(stored), classification="post")
    regions = regions_of_level(stored, 0)
    guide = Guide.of(stored, Smoothed(ramp, 1.0))
    assert guide is not None
    rays = Sensitivity(scene.completed(SIZE), SIZE, guide, regions)
    predicted = np.sqrt(rays.variance(1).sum(axis=1).mean())
    fine, coarse = (renderer.render(scene, SIZE, level=level, sampling_rate=2) for level in (0, 1))
    off = np.abs(fine - coarse).max(axis=2)
    found = np.sqrt((off[fine[..., 3] > 0] ** 2).mean())
    assert found <= predicted <= 4 * found


def test_what_is_hidden_moves_nothing() -> None:
    """Regions behind an opaque wall."""
    values = noise(20.0).values.copy()
    values[:32] = 255
    stored, _ = large(Volume(values))
    wall = TransferFunction([0, 200, 201], [(0, 0, 0), (0, 0, 0), (1, 1, 1)], [0, 0.02, 3])
    front = Camera.orthographic((31.5, 31.5, -100), tuple(stored.centre), (0, 1, 0), height=64)
    regions = regions_of_level(stored, 0)
    guide = Guide.of(stored, Smoothed(wall, 1.0))
    assert guide is not None
    behind = np.array([region.first[2] >= 32 for region in regions])
    for camera, hidden in ((front, True), (replace(front, eye=(31.5, 31.5, 200)), False)):
        complete = Scene(stored, wall, camera, classification="post").completed(SIZE)
        moved = Sensitivity(complete, SIZE, guide, regions).variance(1)[:, behind].max()
        assert bool(moved < 1e-12) == hidden


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), budget=st.floats(0.01, 3))
def test_no_ray_moves_beyond_its_budget_and_no_part_more_would_fit(seed: int, budget: float) -> None:
    rng = np.random.default_rng(seed)
    first = (rng.random((5, 6)) ** 3).astype(np.float32)
    second = first * rng.uniform(1, 4, (5, 6)).astype(np.float32)
    levels, used = _coarsest([first, second], rng.uniform(1, 3, 6), budget)
    moved = np.stack([np.zeros_like(first), first, second])
    sums = sum(moved[level][:, part].astype(float) for part, level in enumerate(levels))
    assert_allclose(np.max(sums), used, atol=1e-5)
    assert used <= budget * (1 + 1e-6)
    for part, level in enumerate(levels):
        if level == 0:
            assert ((sums + first[:, part]) > budget * (1 - 1e-6)).any()


def half_noise() -> Volume:
    """Noise in one half, smooth matter in the other."""
    z, y, x = np.indices((96, 96, 96))
    smooth = 120 + 40 * np.sin(x / 30) * np.sin(y / 30)
    values = np.where(z < 48, smooth + np.random.default_rng(3).normal(0, 60, x.shape), smooth)
    return Volume(np.clip(values, 0, 255).astype(np.uint8))


def test_chunks_that_only_coarse_levels_show_are_not_read(renderer: Renderer) -> None:
    volume = half_noise()
    stored, (finest, halved, _) = large(volume)
    scene = Scene(stored, FOG, Camera.framing(volume), classification="post")
    drawn = renderer.render(scene, SIZE, max_error=0.03)
    complete, regions = scene.completed(SIZE), regions_of_level(stored, 0)
    found = levels_by_error(complete, SIZE, stored, regions, 0.75 * 0.03)
    own = np.zeros(finest.reads.shape, bool)
    for region, level in zip(regions, found.levels, strict=True):
        if level == 0:
            ends = zip(region.first[::-1], region.last[::-1], strict=True)
            own[tuple(slice(a // 16, -(-b // 16)) for a, b in ends)] = True
    assert 0 < own.sum() < own.size
    assert np.array_equal(finest.reads > 0, own)
    assert halved.reads.max() == 1  # for the prediction, and not once more for the parts
    assert quick_stats(renderer)["parts"]["level_error"] == pytest.approx(found.moved)
    assert 0 < found.moved <= 0.75 * 0.03
    truth = renderer.render(replace(scene, volume=volume), SIZE, sampling_rate=8)
    assert np.abs(drawn - truth).max() <= 0.03


def test_a_region_goes_on_beyond_its_end_as_it_ends(renderer: Renderer) -> None:
    """Beside coarse regions nothing of what shows is lost: constant matter is as opaque as ever."""
    values = half_noise().values.copy()
    values[:, :, 40:] = 200
    volume = Volume(values)
    stored, _ = large(volume)
    camera = Camera.orthographic((47.5, 47.5, -200), tuple(volume.centre), (0, 1, 0), height=96)
    scene = Scene(stored, FOG, camera, classification="post")
    drawn = renderer.render(scene, SIZE, max_error=0.01)
    assert set(quick_stats(renderer)["parts"]["levels"]) == {"0", "1"}
    # ∫ τ dz over 96 samples of 200.
    opacity = -np.expm1(-0.02 * 200 / 255 * 96)
    truth = renderer.render(replace(scene, volume=volume), SIZE, sampling_rate=8)[..., 3]
    constant = abs(truth - opacity) < 1e-4
    assert constant.mean() > 0.3
    assert_allclose(drawn[constant, 3], opacity, atol=0.001)


def test_samples_that_are_left_to_coarse_levels_are_the_nearest_own_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    brick = Brick((0, 0, 0), (1, 2, 0), (4, 6, 4), (0, 0, 0), (5, 8, 4), (5, 8, 4), (5, 8, 4))
    beyond = (slice(0, 4), slice(6, 8), slice(0, 5)), (slice(0, 4), slice(2, 6), slice(0, 1))  # along z, y, x
    monkeypatch.setattr(RegionsOfPicture, "left_to_coarse", lambda *_: beyond)
    values = np.arange(4 * 8 * 5, dtype=np.float32).reshape(4, 8, 5)
    expected = values.copy()
    expected[:, 6:, :] = values[:, 5:6, [1, 1, 2, 3, 3]]
    expected[:, 2:6, 0] = values[:, 2:6, 1]
    found = object.__new__(RegionsOfPicture).continued(brick, values)
    np.testing.assert_array_equal(found, expected)


def test_without_a_small_level_or_statistics_all_is_of_the_finest(monkeypatch: pytest.MonkeyPatch) -> None:
    volume = half_noise()
    for stored in (large(volume, levels=1)[0], large(volume, statistics=False)[0]):
        assert _levels(stored) == {0}
    stored, _ = large(volume)
    assert _levels(stored) != {0}
    monkeypatch.setattr("texvol.scene.large_volume._LOOKED_AT", 1000)
    assert _levels(large(volume)[0]) == {0}


def _levels(stored: LargeVolume) -> set[int]:
    scene = Scene(stored, FOG, Camera.framing(stored), classification="post")
    return set(levels_by_error(scene.completed(SIZE), SIZE, stored, regions_of_level(stored, 0), 0.05).levels)


def test_a_plan_tells_levels_and_their_error() -> None:
    stored, (finest, *_) = large(half_noise())
    foreseen = plan(Scene(stored, FOG, Camera.framing(stored)), SIZE, max_error=0.03)
    assert set(foreseen.levels) == {0, 1}
    assert foreseen.level_error is not None and 0 < foreseen.level_error <= 0.75 * 0.03
    assert "by prediction" in foreseen.text
    assert not finest.reads.any()
