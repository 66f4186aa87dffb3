"""Isosurfaces of large volumes: those of the volume in memory, in parts, and nothing read that does not show."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from rendering.streaming.test_numbers_in_parts import VIEWS, camera_of, interpolated
from support.large import large, of_levels
from support.quick_stats import quick_stats

from texvol import Camera, ClipPlane, DepthCue, Lighting, Renderer, Scene, Volume, plan, raycast
from texvol.ray_casting.projection import isosurface_depth
from texvol.rendering.checking import chosen_pixels
from texvol.rendering.streaming import exact, exact_regions, kinds
from texvol.rendering.streaming.chunk_grid import ChunkGrid
from texvol.scene.gradient import Estimator
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.large_volume import LargeVolume, Level

SIZE = (48, 40)
# Float32 knows a position among some hundred samples to 2^-23 of them, 2e-5 of a sample; in the waves below the normal
# turns by less than one from sample to sample.
ROUNDING = 2e-5
THREE = (Isosurface(140.3, (1, 0.3, 0.2), 0.4), Isosurface(100, (0, 1, 0), 0.3), Isosurface(170, None, 0.5))
EXACT = {"level": 0, "texture_format": "rgba32f"}  # in memory gradients of 16-bit values are rounded to 16 bits


@pytest.fixture(autouse=True)
def nothing_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stores are drawn in parts, however much memory there is."""
    monkeypatch.setattr(kinds, "fits", lambda scene: not any(isinstance(each, LargeVolume) for each in scene.volumes))
    monkeypatch.setattr(exact, "fits", kinds.fits)


def waves(dtype: Any = np.float32, shape: tuple[int, int, int] = (61, 72, 83), slow: float = 1.0) -> Volume:
    """Smooth waves between 60 and 180 on a turned grid of odd sides and uneven spacing."""
    z, y, x = np.indices(shape) / slow
    values = 120 + 60 * np.sin(x / 5) * np.sin(y / 7) * np.sin(z / 6)
    c, s = np.cos(0.3), np.sin(0.3)
    spacing, turn = np.array((1.0, 0.9, 1.2)) / slow, [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    return Volume(values.astype(dtype), spacing.tolist(), (5, -3, 7), turn, name="waves")


def surface_of(volume: Volume, view: Any = "perspective", **how: Any) -> Scene:
    camera = camera_of(volume, view) if isinstance(view, str) else view
    return Scene(volume, camera=camera, mode="isosurface", **(how or {"isovalue": 140.3}))


def along(volume: Volume, *direction: int) -> Camera:
    up = (0, 1, 0) if direction[2] else (0, 0, 1)
    return Camera.framing(volume, eye=volume.centre + 4 * volume.radius * np.array(direction), up=up)


# Each type with each view, with one surface and with three, and each view with one and with three.
@pytest.mark.parametrize(
    ("view", "dtype", "surfaces"),
    [
        (view, dtype, ({"isovalue": 140.3}, {"isosurfaces": THREE})[(m + n) % 2])
        for m, view in enumerate(VIEWS)
        for n, dtype in enumerate((np.uint8, np.float32, np.int32))
    ],
)
def test_surfaces_are_those_of_the_volume_in_memory(
    renderer: Renderer, surfaces: dict[str, Any], dtype: Any, view: str
) -> None:
    scene = surface_of(waves(dtype), view, **surfaces)
    stored, _ = large(scene.volume)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
    assert quick_stats(renderer)["parts"]["regions_drawn"] > 3
    depth = renderer.depth()
    assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=ROUNDING)
    assert np.isfinite(depth).any()
    assert_allclose(depth, renderer.depth(), atol=1e-6 * scene.volume.radius)


@pytest.mark.parametrize("side", [88, 104, 120])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0), (0, 0, 1)])
def test_surfaces_in_the_faces_of_regions_are_drawn_once(renderer: Renderer, direction: Any, side: int) -> None:
    """Blocks of two values end where regions do, in a plane between two slabs: along an axis that is a whole face."""
    blocks = np.random.default_rng(side).integers(0, 2, (4, 4, 4)).astype(np.uint8)
    volume = Volume(np.kron(blocks, np.ones((32, 32, 32), np.uint8))[:side, :side, :side].copy())
    scene = surface_of(volume, along(volume, *direction), isosurfaces=(Isosurface(0.5, None, 0.3),))
    drawn = renderer.render(replace(scene, volume=large(volume)[0]), SIZE, **EXACT)
    assert quick_stats(renderer)["parts"]["regions_drawn"] > 20
    assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=ROUNDING)


@pytest.mark.parametrize("slab_thickness", [0.3, 4.0, 9.0])
@pytest.mark.parametrize("surfaces", [{"isovalue": 140.3}, {"isosurfaces": THREE}])
def test_slabs_of_any_thickness(renderer: Renderer, surfaces: dict[str, Any], slab_thickness: float) -> None:
    """A slab that reaches beyond its region shows the surface there, also if nothing else of the region shows."""
    values = np.zeros((96, 96, 96), np.uint8)
    values[34:60, 34:60, 34:60] = waves(np.uint8, (26, 26, 26)).values
    scene = surface_of(Volume(values), "perspective", **surfaces)
    how = EXACT | {"slab_thickness": slab_thickness}
    drawn = renderer.render(replace(scene, volume=large(scene.volume, chunk=8)[0]), SIZE, **how)
    # Behind the box of 26 samples the surfaces are as steep as the block, and the normal turns in half a sample.
    expected = renderer.render(scene, SIZE, texture_format="rgba32f", slab_thickness=slab_thickness)
    assert_allclose(drawn, expected, atol=4 * ROUNDING)


def test_cuts_and_cue(renderer: Renderer) -> None:
    volume = waves(np.uint8)
    low, high = volume.centre - 0.05 * volume.radius, volume.centre + 0.35 * volume.radius
    clip = ClipPlane((1, 0.5, 0.2), float(np.array([1, 0.5, 0.2]) @ volume.centre) - 3.0)
    for cut in ({"crop": tuple(zip(low.tolist(), high.tolist(), strict=True))}, {"clip": (clip,)}):
        for surfaces in ({"isovalue": 140.3}, {"isosurfaces": THREE}):
            look: dict[str, Any] = {"depth_cue": DepthCue(), "background": (0.2, 0.1, 0.3), **cut, **surfaces}
            scene = surface_of(volume, "perspective", **look)
            stored, (finest, *_) = large(volume)
            drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
            assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=ROUNDING)
            assert 0 < finest.reads.astype(bool).sum() < finest.reads.size


def test_light_fades_by_the_range_of_the_whole_volume(renderer: Renderer) -> None:
    """Waves of a hundredth of all values have gradients that fade, if they are not taken for all that there is."""
    values = 10 + (waves(np.float32).values - 120) / 60
    values[50:54, 60:66, 70:76] = 250
    scene = surface_of(Volume(values), "perspective", isovalue=10.1, lighting=Lighting())
    stored, _ = large(scene.volume)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
    assert_allclose(drawn, renderer.render(scene, SIZE), atol=ROUNDING)
    steep = replace(scene, lighting=Lighting(fade=0.02))
    assert abs(drawn - renderer.render(steep, SIZE)).max() > 0.1


@pytest.mark.parametrize("kind", ["central", "zucker-hummel", "gaussian"])
def test_chunks_without_surfaces_are_not_read(renderer: Renderer, kind: Any) -> None:
    """Read are chunks that a surface is in, and those that its gradients reach: of four samples, the next ones."""
    values = np.zeros((64, 64, 64), np.uint8)
    values[20:40, 18:46, 25:39] = waves(np.uint8, (20, 28, 14)).values
    estimator = Estimator(kind)
    scene = surface_of(Volume(values), "perspective", isosurfaces=THREE, gradient=estimator)
    stored, (finest, *_) = large(scene.volume, chunk=4)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
    wanted, near = np.zeros_like(finest.reads, bool), np.zeros_like(finest.reads, bool)
    for place in np.argwhere(crossed_by(values, THREE)):
        low, high = place - estimator.reach, place + 1 + estimator.reach
        wanted[tuple(slice(max(a, 0) // 4, b // 4 + 1) for a, b in zip(low, high, strict=True))] = True
        near[tuple(slice(max(a // 4 - 1, 0), (a + 1) // 4 + 2) for a in place)] = True
    assert (finest.reads[wanted] == 1).all() and finest.reads[~near].max() == 0
    assert near.sum() < 0.3 * near.size
    assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=4 * ROUNDING)


def crossed_by(values: np.ndarray, surfaces: tuple[Isosurface, ...]) -> np.ndarray:
    """True for each cell that has corners on both sides of a value."""
    ends = [
        tuple(slice(a, a + n - 1) for a, n in zip(corner, values.shape, strict=True)) for corner in np.ndindex(2, 2, 2)
    ]
    low, high = (reduce([values[corner] for corner in ends]) for reduce in (np.minimum.reduce, np.maximum.reduce))
    found: np.ndarray = np.any([(low < each.value) & (high > each.value) for each in surfaces], axis=0)
    return found


def plate(height: int = 200) -> Volume:
    """Waves behind a plate that covers half of them."""
    values = waves(np.uint8, (96, 96, 96)).values.copy()
    values[:14] = 0
    values[2:10, :, :60] = height
    return Volume(values, name="plate")


def test_surfaces_behind_an_opaque_plate_are_hidden_in_one_view(renderer: Renderer) -> None:
    """Parts stay on the device: those of which something was left out are of one view and one opacity."""
    volume = plate()
    stored, (finest, *_) = large(volume, chunk=8)
    front, beside = along(volume, 0, 0, -1), along(volume, 0, 1, 0)
    for opacity, view in ((1.0, front), (0.6, front), (1.0, front), (1.0, beside), (0.6, beside), (1.0, front)):
        surfaces = Isosurface(150, (1, 0.5, 0.2), opacity), Isosurface(130, (0.1, 0.5, 1), opacity)
        scene = surface_of(volume, view, isosurfaces=surfaces)
        finest.reads[:] = 0
        drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
        if view is front:
            # Regions of 32 samples: of those at x = 0 none behind the plate is read.
            assert (quick_stats(renderer)["parts"]["regions_hidden"] > 0) == (opacity == 1)
            assert opacity < 1 or finest.reads[6:, 1:-1, 1:3].max() == 0
        depth = renderer.depth()
        assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=4 * ROUNDING)
        assert_allclose(depth, renderer.depth(), atol=1e-6 * volume.radius)


@pytest.mark.parametrize("statistics", [True, False])
def test_surfaces_end_at_missing_values(renderer: Renderer, statistics: bool) -> None:
    values = waves().values.copy()
    values[8:48, 30:56, 20:45] = np.nan  # with whole chunks that are missing
    values[40:44, 10:13, 50:60] = np.inf
    volume = Volume(values)
    with np.errstate(invalid="ignore"):  # the variance of infinities
        stored, _ = large(volume, chunk=8, levels=1, statistics=statistics)
    for surfaces in ({"isovalue": 140.3}, {"isosurfaces": THREE}, {"isovalue": 50.0}):
        scene = surface_of(volume, "perspective", **surfaces)
        drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
        # Beside gaps a ray that misses a surface in one texture may touch it in another: the oracle says what is right.
        assert_allclose(drawn, raycast(scene, SIZE), atol=1e-3)


@pytest.mark.parametrize("first", [0.5, 0.0])
@pytest.mark.parametrize("surfaces", [{"isovalue": 140.3}, {"isosurfaces": THREE}])
def test_a_coarse_level_is_drawn_across_the_faces_of_regions(
    renderer: Renderer, surfaces: dict[str, Any], first: float
) -> None:
    """Means of pairs lie at 0.5, every other sample at 0: half a sample of level 0 away from the box of the level."""
    volume, coarse = waves(shape=(64, 72, 80), slow=2.0), waves(shape=(32, 36, 40)).values
    stored, _ = large(volume, levels=1)
    _, (source,) = large(Volume(coarse), levels=1)
    stored = of_levels([*stored.levels, Level(source, (2.0,) * 3, (first,) * 3)], volume, memory=1_000_000)
    scene = surface_of(stored, "perspective", **surfaces)
    drawn = renderer.render(scene, SIZE, level=1)
    assert set(quick_stats(renderer)["parts"]["levels"]) == {"1"}
    assert quick_stats(renderer)["parts"]["regions_drawn"] > 3
    thickness = float(renderer.settings["slab_thickness"])
    if first == 0.5:
        whole = Volume(coarse, (volume.spacing * 2).tolist(), stored.at_level(1).origin.tolist(), volume.direction)
        expected = renderer.render(replace(scene, volume=whole), SIZE, slab_thickness=thickness)
        return assert_allclose(drawn, expected, atol=ROUNDING)
    # Interpolated samples in between have the same cubics along a ray, but gradients of their own: depths tell.
    depth = renderer.depth()
    fine = np.stack(np.meshgrid(*(np.arange(n) / 2 for n in volume.shape), indexing="ij"), axis=-1)
    whole = Volume(interpolated(coarse, fine), volume.spacing, volume.origin, volume.direction)
    renderer.render(replace(scene, volume=whole), SIZE, slab_thickness=thickness)
    assert_allclose(depth, renderer.depth(), atol=1e-5 * volume.radius)


def test_coarser_regions_farther_off_show_their_surfaces(renderer: Renderer) -> None:
    """No region is left out whose coarse samples show what none of its own chunks does."""
    volume = waves(np.uint8, (120, 120, 120), slow=4.0)
    eye = volume.centre - volume.radius * np.array([0.3, 0.3, 0.25])
    scene = surface_of(volume, Camera.perspective(tuple(eye), tuple(volume.centre), (0, 0, 1), fov=70))
    drawn = renderer.render(replace(scene, volume=large(volume, chunk=8)[0]), (24, 20))
    assert set(quick_stats(renderer)["parts"]["levels"]) > {"0"}
    assert_array_equal(drawn[..., 3], renderer.render(scene, (24, 20))[..., 3])


@pytest.mark.parametrize("statistics", [True, False])
def test_coarse_samples_have_surfaces_beyond_the_chunks_that_they_come_from(
    renderer: Renderer, statistics: bool
) -> None:
    """A plate ends in a chunk of four samples; of means of eight its surface lies in the next region but one chunk."""
    values = np.full((96, 96, 96), 100, np.uint8)
    values[:, :, 12:25] = 250  # of the mean of the samples 24 … 31, at 27.5, an eighth; regions end at 31.5
    volume = Volume(values)
    stored, sources = large(volume, chunk=4, levels=4)
    levels = [each if statistics or not number else replace(each, statistics=None)
              for number, each in enumerate(stored.levels)]  # fmt: skip
    stored = of_levels(levels, volume)
    # 60 is the value of no sample: it shows where 0 stands for a chunk that is not read.
    surfaces = Isosurface(103, (1, 0.5, 0.2), 0.5), Isosurface(60, (0.1, 0.5, 1), 0.5)
    scene = surface_of(volume, "orthographic", isosurfaces=surfaces)
    how: dict[str, Any] = {"slab_thickness": 0.5}
    drawn = renderer.render(replace(scene, volume=stored), (12, 10), level=0, coarser_by_pixels=True, **how)
    assert set(quick_stats(renderer)["parts"]["levels"]) == {"3"}
    coarse = Volume(sources[3].array, (8.0, 8.0, 8.0), (3.5, 3.5, 3.5))
    expected = renderer.render(replace(scene, volume=coarse), (12, 10), texture_format="rgba32f", **how)
    assert 0 < expected[..., 3].mean() < 0.9
    assert_allclose(drawn, expected, atol=ROUNDING)


def test_chunks_whose_samples_are_all_missing_stay_so() -> None:
    values = np.full((8, 8, 8), 200, np.float32)
    values[:4, :4, :4] = np.nan
    with pytest.warns(RuntimeWarning, match="Degrees of freedom"):  # the variance of nothing
        stored, _ = large(Volume(values), chunk=4, levels=1)
    grid = ChunkGrid(stored.levels[0])
    assert np.isnan(grid.unread((0, 0, 0)).least) and grid.unread((0, 0, 1)).least == 200


def test_memory_is_kept_and_a_plan_counts_what_is_read(renderer: Renderer) -> None:
    scene = surface_of(waves(np.uint8), "orthographic")
    stored, (finest, *_) = large(scene.volume, chunk=8, memory=150_000)  # of 364,000
    planned = plan(replace(scene, volume=stored), SIZE, level=0)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
    assert finest.reads.astype(bool).sum() <= planned.chunks
    assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=ROUNDING)
    renderer.render(replace(scene, volume=stored), SIZE, **EXACT)
    assert quick_stats(renderer)["parts"]["peak_bytes"] <= 150_000


def test_an_error_that_is_asked_for_is_kept_by_the_finest_level(renderer: Renderer) -> None:
    scene = surface_of(waves(np.uint8, (40, 44, 48)), isosurfaces=THREE)
    stored, _ = large(scene.volume)
    renderer.render(replace(scene, volume=stored), SIZE, max_error=0.01, check="all")
    assert renderer.check is not None and renderer.check.largest_error <= 0.01
    assert set(renderer.stats["parts"]["levels"]) == {"0"} and renderer.stats["estimated_error"] <= 0.01
    assert 0 < renderer.stats["samples"] <= renderer.stats["samples_total"]


@pytest.mark.parametrize("surfaces", [{"isovalue": 140.3}, {"isosurfaces": THREE}])
def test_the_oracle_joins_regions(surfaces: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact_regions, "_REGION", 1 << 15)
    scene = surface_of(waves(np.uint8), "perspective", depth_cue=DepthCue(), background=(0.2, 0.1, 0.3), **surfaces)
    stored, _ = large(scene.volume, chunk=8, memory=scene.volume.values.nbytes * 3 // 4)
    in_parts, pixels = replace(scene, volume=stored), chosen_pixels(SIZE, 60)
    truth, depth = raycast(scene, SIZE), isosurface_depth(scene, SIZE)
    found = exact.raycast_pixels(in_parts, SIZE, pixels)
    assert_allclose(found, truth[pixels[:, 1], pixels[:, 0]], atol=1e-11)
    assert_allclose(exact.raycast(in_parts, SIZE), truth, atol=1e-11)
    assert_allclose(exact.isosurface_depth(in_parts, SIZE), depth, rtol=1e-11)


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0)])
def test_the_oracle_meets_surfaces_in_faces_once(direction: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact_regions, "_REGION", 1 << 12)
    blocks = np.random.default_rng(4).integers(0, 2, (4, 4, 4)).astype(np.uint8) * 7
    volume = Volume(np.kron(blocks, np.ones((16, 16, 16), np.uint8)), (0.3, 0.7, 1.1), (0.1, 0.2, 0.3))
    scene = surface_of(volume, along(volume, *direction), isosurfaces=(Isosurface(3.5, None, 0.3),))
    found = exact.raycast(replace(scene, volume=large(volume, chunk=8)[0]), SIZE)
    assert_allclose(found, raycast(scene, SIZE), atol=1e-11)
