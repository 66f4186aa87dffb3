"""Pictures of numbers (xray, average, mip, minip) of large volumes: those of the volume in memory, drawn in parts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.large import Counted, large, of_levels
from support.projected import GRIDS, NUMBERS, every_number
from support.quick_stats import quick_stats

from texvol import Camera, ClipPlane, Renderer, Scene, Volume, plan, raycast
from texvol.rendering.checking import chosen_pixels
from texvol.rendering.streaming import exact, exact_regions, kinds
from texvol.scene.large_volume import LargeVolume, Level

SIZE = (48, 40)
# Of the largest number: float32 knows positions in the box to 2^-23, and a sum of a few hundred slabs to as much of
# its largest.
ROUNDING = 2e-6


@pytest.fixture
def nothing_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stores are drawn in parts, however much memory there is."""
    monkeypatch.setattr(kinds, "fits", lambda scene: not any(isinstance(each, LargeVolume) for each in scene.volumes))
    monkeypatch.setattr(exact, "fits", kinds.fits)


pytestmark = pytest.mark.usefixtures("nothing_fits")


def waves(dtype: Any = np.float32, shape: tuple[int, int, int] = (61, 72, 83), grid: str = "sheared") -> Volume:
    """Waves of a few samples with noise, between 20 and 240, on a grid of odd sides."""
    z, y, x = np.indices(shape)
    values = 120 + 60 * np.sin(x / 5) * np.sin(y / 7) * np.sin(z / 6)
    values += np.random.default_rng(7).uniform(-40, 40, shape)
    return Volume(values.astype(dtype), name="waves", **GRIDS[grid])


def holed() -> Volume:
    """Waves with boxes of missing values, of infinities of either sign, and of both side by side."""
    values = waves().values.copy()
    values[10:20, 30:50, 20:45] = np.nan
    values[40:44, 10:13, 50:60] = np.inf
    values[25:30, 60:66, 10:12] = values[41:43, 11:13, 60:63] = -np.inf
    return Volume(values, name="holed", **GRIDS["sheared"])


def holed_store(**how: Any) -> tuple[LargeVolume, list[Counted]]:
    with np.errstate(invalid="ignore"):  # the variance of infinities
        return large(holed(), levels=1, **how)


def camera_of(volume: Volume, view: str) -> Camera:
    eye = volume.centre + volume.radius * np.array([1.5, 1.1, 0.8])
    if view == "orthographic":
        return Camera.framing(volume, eye=eye)
    if view == "inside":
        eye = volume.centre + 0.1 * volume.radius * np.array([1.0, -0.5, 0.7])
        return Camera.perspective(tuple(eye), tuple(volume.centre + volume.radius), (0, 0, 1), fov=70)
    return Camera.perspective(tuple(eye), tuple(volume.centre), (0, 0, 1), fov=40)


def assert_same(drawn: np.ndarray, whole: np.ndarray, times: float = 1.0) -> None:
    """The same numbers to rounding, and the same infinities and gaps."""
    assert_array_equal(drawn[..., 3], whole[..., 3])
    assert_array_equal(np.isfinite(drawn), np.isfinite(whole))
    finite = np.isfinite(whole)
    assert_array_equal(drawn[~finite], whole[~finite])
    assert_allclose(drawn[finite], whole[finite], rtol=0, atol=times * ROUNDING * np.abs(whole[finite]).max())


VIEWS = "orthographic", "perspective", "inside"
TYPES = np.uint8, np.uint16, np.float32, np.float64


# Each mode with each type, with each view, and each type with each view.
@pytest.mark.parametrize(
    ("mode", "dtype", "view"),
    [(mode, dtype, VIEWS[(m + n) % 3]) for m, mode in enumerate(NUMBERS) for n, dtype in enumerate(TYPES)],
)
def test_the_numbers_are_those_of_the_volume_in_memory(renderer: Renderer, mode: Any, dtype: Any, view: str) -> None:
    volume = waves(dtype)
    scene = Scene(volume, camera=camera_of(volume, view), mode=mode)
    stored, _ = large(volume)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
    assert quick_stats(renderer)["parts"]["regions_drawn"] > 3
    assert_same(drawn, renderer.render(scene, SIZE))


@pytest.mark.parametrize("statistics", [True, False])
@every_number
def test_what_is_missing_or_infinite_is_so_in_parts(renderer: Renderer, mode: Any, statistics: bool) -> None:
    volume = holed()
    scene = Scene(volume, camera=camera_of(volume, "perspective"), mode=mode)
    stored, _ = holed_store(statistics=statistics)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
    whole = renderer.render(scene, SIZE)
    assert not np.isfinite(whole).all()
    # Without statistics nobody knows that sums are from plane to plane where there are infinities elsewhere: then the
    # parts without any take the middle of each slab, which is some hundredths of the noise off.
    assert_same(drawn, whole, 1.0 if statistics or mode in ("mip", "minip") else 5000.0)


@pytest.mark.parametrize("air", [150.0, "hounsfield"])
def test_an_xray_above_air(renderer: Renderer, air: Any) -> None:
    volume = waves(np.int16)
    scene = Scene(volume, camera=camera_of(volume, "perspective"), mode="xray", air=air)
    stored, _ = large(volume)
    # Rounding is of positions and whole values, of which a tenth is above the air.
    assert_same(renderer.render(replace(scene, volume=stored), SIZE, level=0), renderer.render(scene, SIZE), 10.0)


@every_number
def test_cuts(renderer: Renderer, mode: Any) -> None:
    volume = waves(np.uint8, grid="anisotropic")
    low, high = volume.centre - 0.05 * volume.radius, volume.centre + 0.35 * volume.radius
    clip = ClipPlane((1, 0.5, 0.2), float(np.array([1, 0.5, 0.2]) @ volume.centre) - 3.0)
    for cut in ({"crop": tuple(zip(low.tolist(), high.tolist(), strict=True))}, {"clip": (clip,)}):
        scene = Scene(volume, camera=camera_of(volume, "perspective"), mode=mode, **cut)
        stored, (finest, *_) = large(volume)
        drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
        assert_same(drawn, renderer.render(scene, SIZE))
        assert 0 < finest.reads.astype(bool).sum() < finest.reads.size


@pytest.mark.parametrize("first", [0.5, 0.0])
@every_number
def test_a_coarse_level_is_drawn_across_the_faces_of_regions(renderer: Renderer, mode: Any, first: float) -> None:
    """Means of pairs lie at 0.5, every other sample at 0: half a sample of level 0 away from the box of the level."""
    volume = waves(np.float32, (64, 72, 80))
    coarse = waves(np.float32, (32, 36, 40)).values
    stored, _ = large(volume, levels=1)
    _, (source,) = large(Volume(coarse), levels=1)
    stored = of_levels([*stored.levels, Level(source, (2.0,) * 3, (first,) * 3)], volume, memory=1_000_000)
    scene = Scene(stored, camera=camera_of(volume, "perspective"), mode=mode)
    drawn = renderer.render(scene, SIZE, level=1)
    assert quick_stats(renderer)["parts"]["levels"] == {"1": quick_stats(renderer)["parts"]["regions_drawn"]}
    assert quick_stats(renderer)["parts"]["regions_drawn"] > 3
    if first == 0.5:
        whole = Volume(coarse, (volume.spacing * 2).tolist(), stored.at_level(1).origin.tolist(), volume.direction)
    else:  # the box of level 0 has its samples at every half: so do those that are interpolated in between
        fine = np.stack(np.meshgrid(*(np.arange(n) / 2 for n in volume.shape), indexing="ij"), axis=-1)
        whole = Volume(interpolated(coarse, fine), volume.spacing, volume.origin, volume.direction)
    # Between the planes of interpolated samples a cubic is what it is between those of the others.
    expected = renderer.render(replace(scene, volume=whole), SIZE, slab_thickness=renderer_thickness(renderer))
    assert_same(drawn, expected, 4.0)


def interpolated(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values between samples at places along z, y, x; those of the last ones beyond."""
    found = np.zeros(places.shape[:-1])
    last = np.array(values.shape) - 1
    low = np.floor(places).astype(int)
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, places - low, 1 - (places - low)).prod(axis=-1)
        found += weight * values[tuple(np.minimum(low + corner, last).transpose(3, 0, 1, 2))]
    return found.astype(np.float32)


def renderer_thickness(renderer: Renderer) -> float:
    return float(renderer.settings["slab_thickness"])


@every_number
def test_memory_is_kept(renderer: Renderer, mode: Any) -> None:
    volume = waves(np.uint8)
    scene = Scene(volume, camera=camera_of(volume, "orthographic"), mode=mode)
    stored, _ = large(volume, chunk=8, memory=150_000)  # of 364,000
    whole = renderer.render(scene, SIZE)
    for _ in range(2):
        assert_same(renderer.render(replace(scene, volume=stored), SIZE, level=0), whole)
        assert quick_stats(renderer)["parts"]["peak_bytes"] <= 150_000


def plate(mode: str) -> Volume:
    """Faint noise, and a bright plate before half of it; for minip a dark one."""
    values = np.random.default_rng(3).integers(90, 110, (96, 96, 96)).astype(np.uint8)
    values[2:10, :, :54] = 200
    return Volume(values if mode == "mip" else 255 - values, name="plate")


@pytest.mark.parametrize("mode", ["mip", "minip"])
def test_what_cannot_change_an_extreme_is_not_read(renderer: Renderer, mode: Any) -> None:
    volume = plate(mode)
    scene = Scene(volume, camera=Camera.framing(volume, eye=volume.centre + [0, 0, -400]), mode=mode)
    whole = renderer.render(scene, SIZE)
    for statistics in (True, False):
        stored, (finest, *_) = large(volume, chunk=8, statistics=statistics)
        drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
        assert_same(drawn, whole)
        # Regions of 32 samples: of those at x = 0 none behind the plate is read, of those at x = 32 only the chunks
        # that are not behind it.
        assert (quick_stats(renderer)["parts"]["regions_hidden"] == 6) == statistics
        assert finest.reads[:4].min() == finest.reads[6:, :, 8:].min() == 1
        assert finest.reads[6:, :, :3].max() == (0 if statistics else 1)
        assert (finest.reads[6:, :, 3:6].mean() < 0.5) == statistics


@pytest.mark.parametrize("mode", ["mip", "minip"])
def test_other_views_do_not_have_the_holes_of_one(renderer: Renderer, mode: Any) -> None:
    """Parts stay on the device: those of which something was left out are of one view, and of one mode."""
    volume = plate(mode)
    stored, _ = large(volume, chunk=8)
    for each in (mode, "minip" if mode == "mip" else "mip", "xray"):
        for side in ([0, 0, -400], [0, 400, 5], [400, 30, 0], [0, 0, -400]):
            scene = Scene(volume, camera=Camera.framing(volume, eye=volume.centre + side), mode=each)
            drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
            assert_same(drawn, renderer.render(scene, SIZE))


def test_regions_go_in_the_order_of_their_extremes(renderer: Renderer) -> None:
    values = np.zeros((128, 128, 128), np.uint8)
    values[100:] = 50
    values[3, 40, 40] = 255
    volume = Volume(values)
    stored, (finest, *_) = large(volume)
    scene = Scene(stored, camera=Camera.framing(volume, eye=volume.centre + [0, 0, -400]), mode="mip")
    drawn = renderer.render(scene, SIZE, level=0)
    # The regions around the spot come first, then what is behind all; so the rest in front of it is not read.
    assert finest.reads[0, 2, 2] == 1 and finest.reads[6:].min() == 1 and finest.reads[0, 5:].max() == 0
    assert_same(drawn, renderer.render(replace(scene, volume=volume), SIZE))


@every_number
def test_an_error_that_is_asked_for_is_kept_by_the_finest_level(renderer: Renderer, mode: Any) -> None:
    volume = waves(np.float32, (40, 40, 40))
    scene = Scene(volume, camera=camera_of(volume, "perspective"), mode=mode)
    stored, _ = large(volume)
    wanted = 0.05 * float(np.ptp(renderer.render(scene, SIZE)[..., 0]))
    drawn = renderer.render(replace(scene, volume=stored), SIZE, max_error=wanted, check="all")
    assert renderer.check is not None and renderer.check.largest_error <= wanted
    assert set(renderer.stats["parts"]["levels"]) == {"0"} and renderer.stats["estimated_error"] <= wanted
    whole = renderer.render(scene, SIZE, max_error=wanted)
    assert renderer.stats["estimated_error"] <= wanted
    assert_allclose(drawn, whole, atol=2 * wanted)


@every_number
def test_the_estimate_is_that_of_the_volume_in_memory(renderer: Renderer, mode: Any) -> None:
    volume = waves(np.uint16, (40, 44, 48))
    scene = Scene(volume, camera=camera_of(volume, "orthographic"), mode=mode)
    renderer.render(replace(scene, volume=large(volume)[0]), SIZE, level=0)
    in_parts = renderer.stats["estimated_error"]
    renderer.render(scene, SIZE)
    assert_allclose(in_parts, renderer.stats["estimated_error"], rtol=0.05)


@every_number
def test_the_oracle_joins_regions(mode: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact_regions, "_REGION", 1 << 15)
    volume = holed()
    scene = Scene(volume, camera=camera_of(volume, "perspective"), mode=mode)
    stored, (finest, *_) = holed_store(chunk=8, memory=volume.values.nbytes // 2)
    pixels = chosen_pixels(SIZE, 60)
    found = exact.raycast_pixels(replace(scene, volume=stored), SIZE, pixels)
    truth = raycast(scene, SIZE)
    assert finest.reads.max() > 0
    assert_allclose(found, truth[pixels[:, 1], pixels[:, 0]], rtol=1e-9)
    assert_allclose(exact.raycast(replace(scene, volume=stored), SIZE), truth, rtol=1e-9)


def test_a_plan_counts_all_that_may_be_read() -> None:
    volume = waves(np.uint8)
    stored, (finest, *_) = large(volume, memory=150_000)
    found = plan(Scene(stored, camera=camera_of(volume, "perspective"), mode="mip"), SIZE, level=0)
    assert found.chunks == finest.reads.size and found.memory == 150_000
