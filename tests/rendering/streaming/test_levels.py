"""Levels of large volumes: by pixels, by error; coarse samples classified by distribution; plans and stages."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.large import large
from support.quick_stats import quick_stats

from texvol import AddedVolume, Camera, InputError, Renderer, Scene, TransferFunction, Volume
from texvol.cli.command_line import main
from texvol.rendering.streaming.levels import covers, settled_level
from texvol.rendering.streaming.plan import plan
from texvol.rendering.streaming.progressive import render_progressively
from texvol.scene.transfer.presets import preset
from texvol.slicing.regions import Region
from texvol.textures.distribution import NODES, ROWS, Smoothed

SIZE = (64, 64)
FOG = TransferFunction([0, 255], [(1, 0.5, 0.2), (0.2, 0.5, 1)], [0, 0.02])


def random_volume(seed: int, n: int = 96) -> Volume:
    """Smooth matter, a thin bright shell and noise, in an empty box."""
    rng = np.random.default_rng(seed)
    z, y, x = np.ogrid[:n, :n, :n]
    r = np.sqrt((x - n / 2) ** 2 + (y - n / 2.2) ** 2 + (z - n / 1.9) ** 2) / n
    values = np.where(r < 0.3, 80 + 40 * np.sin(x / rng.uniform(4, 20)) * np.sin(y / rng.uniform(4, 20)), 0)
    values = values + 150 * (abs(r - 0.25) < 0.008) + np.where(r < 0.2, rng.normal(0, 15, (n, n, n)), 0)
    return Volume(np.clip(values, 0, 255).astype(np.uint8))


def test_as_fine_as_pixels_can_show() -> None:
    stored, _ = large(random_volume(0))
    wide = Camera.orthographic((0, 0, -500), tuple(stored.centre), (0, 1, 0), height=64.0 * 3)
    scene = Scene(stored, FOG, wide).completed(SIZE)
    assert settled_level(scene, SIZE, "auto", None) == 1  # pixels are 3 spacings apart
    assert settled_level(scene, (256, 256), "auto", None) == 0
    assert settled_level(scene, (32, 32), "auto", None) == 2
    assert settled_level(scene, (32, 32), "auto", 1.5) == 0  # slabs that were asked for
    assert settled_level(scene, SIZE, 2, None) == 2
    with pytest.raises(InputError, match="level must be auto or from 0 to 2, got 3"):
        settled_level(scene, SIZE, 3, None)


def test_near_regions_are_finer(renderer: Renderer) -> None:
    stored, _ = large(Volume(np.full((512, 32, 32), 100, np.uint8)), 32)
    eye = (15.5, 15.5, -40.0)
    scene = Scene(stored, FOG, Camera.perspective(eye, (15.5, 15.5, 100), (0, 1, 0), fov=60))
    renderer.render(scene, (24, 24))
    levels = quick_stats(renderer)["parts"]["levels"]
    assert set(levels) >= {"0", "1", "2"} or len(levels) > 1


def test_a_level_that_is_asked_for_is_that_of_all_regions(renderer: Renderer) -> None:
    """A near eye: regions behind were drawn from coarser levels than their pixels show."""
    volume = random_volume(3)
    stored, _ = large(volume)
    eye = volume.centre + [10, -8, -60]
    scene = Scene(stored, FOG, Camera.perspective(eye, volume.centre, (0, 1, 0), fov=40), classification="post")
    for level in (0, 1):
        renderer.render(scene, SIZE, level=level)
        assert set(quick_stats(renderer)["parts"]["levels"]) == {str(level)}
    drawn = renderer.render(scene, SIZE, level=0, max_error=0.005)
    truth = renderer.render(replace(scene, volume=volume), SIZE, sampling_rate=8)
    assert np.abs(drawn - truth).max() <= 0.005


def test_settings_draw_a_picture_of_several_levels_again(renderer: Renderer) -> None:
    stored, _ = large(Volume(np.full((512, 32, 32), 100, np.uint8)), 32)
    scene = Scene(stored, FOG, Camera.perspective((15.5, 15.5, -40.0), (15.5, 15.5, 100), (0, 1, 0), fov=60))
    first = renderer.render(scene, (24, 24))
    levels, settings = quick_stats(renderer)["parts"]["levels"], renderer.settings
    assert len(levels) > 1
    again = renderer.render(replace(scene, classification="post"), (24, 24), **settings)
    assert quick_stats(renderer)["parts"]["levels"] == levels
    assert np.array_equal(first, again)


@pytest.mark.parametrize("name", ["contours", "boundaries"])
def test_matter_that_depends_on_the_gradient_has_coarse_levels(renderer: Renderer, name: str) -> None:
    volume = random_volume(2)
    stored, _ = large(volume)
    scene = Scene(stored, preset(name, volume), Camera.framing(volume), classification="post")
    fine = renderer.render(scene, SIZE, level=0)
    coarse = renderer.render(scene, SIZE, level=1)
    assert np.abs(coarse - fine).mean() < 0.1 < fine[..., 3].max()
    renderer.render(scene, SIZE, max_error=0.1)
    assert set(quick_stats(renderer)["parts"]["levels"]) == {"0"}  # nothing predicts how far coarse ones are off


@pytest.mark.parametrize("seed", range(2))
def test_an_error_is_kept_and_less_is_read(renderer: Renderer, seed: int) -> None:
    volume = random_volume(seed)
    stored, sources = large(volume)
    scene = Scene(stored, FOG, Camera.framing(volume, eye=volume.centre + [200, 150, 90]), classification="post")
    for error in (0.3, 0.05):
        drawn = renderer.render(scene, SIZE, max_error=error)
        assert renderer.estimate is not None and renderer.estimate <= error
        truth = renderer.render(replace(scene, volume=volume), SIZE, sampling_rate=8)
        assert np.abs(drawn - truth).max() <= error
    assert sources[0].reads.sum() < sources[0].reads.size


def test_a_coarse_level_is_classified_by_its_distribution(renderer: Renderer) -> None:
    """A thin shell whose mean shows nothing is not lost."""
    volume = random_volume(1)
    bone = TransferFunction([150, 200], [(1, 1, 1)] * 2, [0, 0.3])
    scene = Scene(volume, bone, Camera.framing(volume), classification="post")
    stored, _ = large(volume)
    fine = renderer.render(scene, SIZE)[..., 3].mean()
    coarse = renderer.render(replace(scene, volume=stored), SIZE, level=2)[..., 3].mean()
    means = renderer.render(replace(scene, volume=stored.at_level(2).whole), SIZE)[..., 3].mean()
    assert abs(coarse - fine) < abs(means - fine) / 2


def test_a_smoothed_function_in_closed_form() -> None:
    """A ramp convolved with a normal distribution: E[max(v, 0)] = m Φ(m / σ) + σ φ(m / σ)."""
    ramp = TransferFunction([0, 1], [(1, 1, 1)] * 2, [0, 1])
    found = _mean_extinction(ramp, np.array([0.0, 0.1, -0.05]), 0.1)
    t = np.array([0.0, 1.0, -0.5])
    phi = np.exp(-(t**2) / 2) / np.sqrt(2 * np.pi)
    cumulated = np.array([0.5, 0.8413447460685429, 0.3085375387259869])
    assert_allclose(found, 0.1 * (t * cumulated + phi), atol=1e-3)  # nodes lie 0.0015 apart
    assert_allclose(_mean_extinction(ramp, np.array([0.25]), 0.0), 0.25, atol=1e-6)


def _mean_extinction(function: TransferFunction, means: np.ndarray, deviation: float) -> np.ndarray:
    """Mean extinction of values about some means, between the entries of the smoothed function's table."""
    smoothed = Smoothed(function, 1.0)
    rows = smoothed.stored(np.full(1, deviation**2, np.float32), 1.0)[0] / 65535 * (ROWS - 1)
    assert_allclose(
        smoothed.reach(smoothed.stored(np.full(1, deviation**2, np.float32), 1.0)), 3 * deviation, rtol=1e-3
    )
    low, high = smoothed.ends
    table = smoothed.table[..., 3]
    first, part = min(int(rows), ROWS - 2), rows - min(int(rows), ROWS - 2)
    of_width = (1 - part) * table[first] + part * table[first + 1]
    return np.interp(means, np.linspace(low, high, NODES), of_width)


def test_levels_that_leave_samples_out_cover_less() -> None:
    stored, _ = large(Volume(np.zeros((33, 33, 33), np.uint8)))
    last = Region((1, 1, 1), (16, 16, 16), (33, 33, 33))
    assert covers(stored.levels[1], last)
    short = replace(stored.levels[1], source=large(Volume(np.zeros((16, 16, 16), np.uint8)))[1][0])
    assert not covers(short, last)


def test_a_plan_is_what_is_read(renderer: Renderer) -> None:
    volume = random_volume(2)
    stored, (finest, *_) = large(volume)
    scene = Scene(stored, FOG, Camera.framing(volume))
    foreseen = plan(scene, SIZE, level=0)
    assert not finest.reads.any()
    renderer.render(scene, SIZE, level=0)
    assert foreseen.chunks == np.count_nonzero(finest.reads) and foreseen.chunks_total == finest.reads.size
    assert foreseen.metadata["levels"] == quick_stats(renderer)["parts"]["levels"]
    with pytest.raises(InputError, match="plan: needs a volume in a store"):
        plan(replace(scene, volume=volume), SIZE)


def test_pictures_become_finer(renderer: Renderer) -> None:
    volume = random_volume(3, 160)
    stored, _ = large(volume)
    scene = Scene(stored, FOG, Camera.framing(volume))
    stages = list(render_progressively(renderer, scene, (256, 256)))
    assert [stage.level for stage in stages] == [1, None]
    assert stages[-1].moved is not None and 0 < stages[-1].moved < 0.2
    assert [stage.shrunk for stage in stages] == [2, 1] and "level 1 with a quarter of the pixels" in stages[0].sentence
    whole = renderer.render(scene, (256, 256), level=1)
    assert stages[0].picture.shape == whole.shape
    assert np.sqrt(np.mean((stages[0].picture - whole) ** 2)) < 0.1 * np.sqrt(np.mean(whole**2))
    shifted = np.roll(whole, 1, axis=1)  # by a pixel
    assert np.mean((stages[0].picture - whole) ** 2) < 0.5 * np.mean((stages[0].picture - shifted) ** 2)
    assert len(list(render_progressively(renderer, replace(scene, volume=volume), SIZE))) == 1


@pytest.mark.parametrize("kind", ["mip", "isosurface", "several"])
def test_coarse_pictures_of_what_fits_in_memory_come_from_their_levels(renderer: Renderer, kind: str) -> None:
    """Samples of the finest level are not read for them."""
    volume = random_volume(3, 160)
    stored, (finest, *_) = large(volume)
    how: dict[str, Any] = {"mip": {"mode": "mip"}, "isosurface": {"mode": "isosurface", "isovalue": 100}}.get(kind, {})
    scene = Scene(stored, FOG, Camera.framing(volume), **how)
    scene = replace(scene, added=(AddedVolume(large(volume)[0], FOG),)) if kind == "several" else scene
    assert plan(scene, (256, 256), level=1).metadata["levels"].keys() == {"1"}
    stages = render_progressively(renderer, scene, (256, 256))
    coarse = next(stages)
    assert coarse.level == 1 and not finest.reads.any()
    (last,) = stages
    assert last.level is None and finest.reads.all()
    expected = renderer.render(replace(scene, volume=volume, added=()), (256, 256))
    if kind != "several":
        assert_allclose(last.picture, expected, atol=2e-6)
        assert np.sqrt(np.mean((coarse.picture - expected) ** 2)) < 0.2 * expected.max()


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tensorstore")
    np.save(tmp_path / "v.npy", random_volume(4).values)
    store = f"{tmp_path}/v.ome.zarr"
    assert main(["convert", f"{tmp_path}/v.npy", store]) == 0
    assert re.search(r"v.ome.zarr: 2 levels \(96 x 96 x 96, 48 x 48 x 48\)", capsys.readouterr().out)
    picture = ["render", store, "-o", f"{tmp_path}/p.exr", "--size", "64x64"]
    assert main([*picture, "--plan"]) == 0
    assert capsys.readouterr().out.startswith("draws ") and not (tmp_path / "p.exr").exists()
    assert main([*picture, "--progressive", "--memory", "50MB", "--check", "8"]) == 0
    assert "8 pixels checked" in capsys.readouterr().out
    assert main([*picture, "--level", "7"]) == 2
    assert "level must be from 0 to 1, got 7" in capsys.readouterr().err
