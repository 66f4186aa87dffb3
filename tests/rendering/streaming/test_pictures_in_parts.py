"""Pictures of large volumes: those of the volume in memory, whatever is read, and nothing read that does not show."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.large import large
from support.quick_stats import quick_stats

from texvol import Camera, ClipPlane, DepthCue, InputError, Lighting, Renderer, Scene, TransferFunction, Volume, raycast
from texvol.rendering.checking import chosen_pixels
from texvol.rendering.streaming import exact
from texvol.rendering.streaming.assembly import Assembly
from texvol.scene.gradient import Estimator

SIZE = (48, 40)
# Rounding of positions in textures of other sizes, and of blends.
ROUNDING = 2e-6
HAZE = TransferFunction(
    [40, 100, 160, 255], [(0.2, 0.4, 0.9), (0.3, 0.6, 0.9), (0.9, 0.5, 0.2), (1, 1, 0.9)], [0, 0.01, 0.03, 0.2]
)


def ball(n: int = 150, dtype: Any = np.uint8) -> Volume:
    """A ball with waves in it, in an empty box of odd sides, on a turned grid of uneven spacing."""
    z, y, x = np.ogrid[: n - 7, : n + 5, :n]
    r = np.sqrt((x - n / 2) ** 2 + (y - n / 2) ** 2 + (z - n / 2) ** 2) / n
    waves = 120 + 60 * np.sin(x / 5) * np.sin(y / 7) * np.sin(z / 6)
    values = np.where(r < 0.35, waves, 0).astype(dtype)
    c, s = np.cos(0.3), np.sin(0.3)
    return Volume(values, (1.0, 0.9, 1.2), (5, -3, 7), [[c, -s, 0], [s, c, 0], [0, 0, 1]], name="ball")


@pytest.fixture(scope="module")
def volume() -> Volume:
    return ball()


def camera_of(volume: Volume, projection: str) -> Camera:
    eye = volume.centre + volume.radius * np.array([1.5, 1.1, 0.8])
    if projection == "orthographic":
        return Camera.framing(volume, eye=eye)
    return Camera.perspective(tuple(eye), tuple(volume.centre), (0, 0, 1), fov=40)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("classification", ["post", "slab", "integrated", "extinction"])
def test_the_picture_is_that_of_the_volume_in_memory(
    renderer: Renderer, volume: Volume, classification: Any, projection: str
) -> None:
    scene = Scene(volume, HAZE, camera_of(volume, projection), classification=classification)
    stored, _ = large(volume)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
    assert quick_stats(renderer)["parts"]["regions_drawn"] > 3
    assert_allclose(drawn, renderer.render(scene, SIZE), atol=ROUNDING)


@pytest.mark.parametrize("classification", ["post", "slab"])
def test_light_cuts_and_cue(renderer: Renderer, volume: Volume, classification: Any) -> None:
    scene = Scene(
        volume, HAZE, camera_of(volume, "perspective"), classification=classification, lighting=Lighting(),
        clip=(ClipPlane((1, 0.5, 0.2), 90.0),), depth_cue=DepthCue(), background=(0.2, 0.1, 0.3),
    )  # fmt: skip
    stored, _ = large(volume)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0, texture_format="rgba32f")
    # In memory gradients of `post` are rounded to 16 bits of the largest unless told, in parts they are not.
    assert_allclose(drawn, renderer.render(scene, SIZE, texture_format="rgba32f"), atol=10 * ROUNDING)


def test_floats_missing_values_and_labels(renderer: Renderer) -> None:
    plain = ball(90, np.float32)
    values = plain.values.copy()
    values[30:40, 20:50, 30:70] = np.nan
    for volume in (
        Volume(values, plain.spacing),
        Volume(np.minimum(plain.values // 60, 3).astype(np.uint8), labels=True),
    ):
        scene = Scene(volume, None if volume.labels else HAZE, camera_of(volume, "orthographic"), classification="post")
        scene = replace(scene, transfer_function=scene.completed(SIZE).transfer_function)
        stored, _ = large(volume)
        stored.labels = volume.labels
        drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
        assert_allclose(drawn, renderer.render(scene, SIZE), atol=5 * ROUNDING)


def test_every_chunk_is_read_once_and_what_is_empty_never(renderer: Renderer, volume: Volume) -> None:
    stored, (finest, *_) = large(volume)
    renderer.render(Scene(stored, HAZE, camera_of(volume, "orthographic")), SIZE, level=0)
    shows = HAZE.shows_between(stored.levels[0].statistics.lowest_around, stored.levels[0].statistics.highest_around, 0)
    assert_array_equal(finest.reads, shows)
    renderer.render(Scene(stored, HAZE, camera_of(volume, "perspective")), SIZE, level=0)
    assert_array_equal(finest.reads, shows)  # what was drawn is still there


def test_what_lies_behind_opaque_matter_is_not_read(renderer: Renderer) -> None:
    values = np.full((256, 128, 128), 100, np.uint8)
    stored, (finest, *_) = large(Volume(values), 32)
    opaque = TransferFunction([0, 100], [(1, 1, 1), (1, 1, 1)], [0.5, 0.5])
    camera = Camera.framing(stored, eye=stored.centre - np.array([0, 0, 1000.0]))
    renderer.render(Scene(stored, opaque, camera, classification="post"), SIZE, level=0)
    assert finest.reads[0].all() and not finest.reads[4:].any()
    assert quick_stats(renderer)["parts"]["regions_hidden"] > 0


def test_what_is_off_the_screen_or_cut_away_is_not_read(renderer: Renderer, volume: Volume) -> None:
    x = volume.centre[0]
    stored, (finest, *_) = large(volume)
    half = Scene(stored, HAZE, camera_of(volume, "orthographic"), clip=(ClipPlane((1, 0, 0), float(x) + 40.0),))
    renderer.render(half, SIZE, level=0)
    assert 0 < finest.reads.sum() < 0.5 * finest.reads.size


def test_memory_is_kept(renderer: Renderer, volume: Volume) -> None:
    whole = Scene(volume, HAZE, camera_of(volume, "orthographic"), classification="post")
    stored, _ = large(volume, memory=2_000_000)  # of 3.3 MB
    drawn = renderer.render(replace(whole, volume=stored), SIZE, level=0)
    assert_allclose(drawn, renderer.render(whole, SIZE), atol=ROUNDING)
    renderer.render(replace(whole, volume=stored), SIZE, level=0)
    assert renderer.stats["parts"]["peak_bytes"] <= 2_000_000
    tiny, _ = large(volume, memory=20_000)
    with pytest.raises(InputError, match="memory must have room"):
        renderer.render(replace(whole, volume=tiny), SIZE, level=0)


def test_what_cannot_be_drawn_in_parts_is_read_whole_or_refused(renderer: Renderer, volume: Volume) -> None:
    stored, _ = large(volume)
    adaptive = Estimator("adaptive")
    surface = Scene(stored, None, camera_of(volume, "orthographic"), mode="isosurface", isovalue=100, gradient=adaptive)
    assert_array_equal(renderer.render(surface, SIZE), renderer.render(replace(surface, volume=volume), SIZE))
    small, _ = large(volume, memory=1_000_000)
    with pytest.raises(InputError, match="the adaptive gradient cannot be drawn part by part"):
        renderer.render(replace(surface, volume=small), SIZE)


def test_surfaces_of_a_store_that_fits_are_drawn_from_memory(renderer: Renderer, volume: Volume) -> None:
    surface = Scene(volume, None, camera_of(volume, "orthographic"), mode="isosurface", isovalue=100)
    drawn = renderer.render(replace(surface, volume=large(volume)[0]), SIZE)
    assert "parts" not in quick_stats(renderer)
    assert_array_equal(drawn, renderer.render(surface, SIZE))


def test_a_chunk_that_cannot_be_read_is_an_error_and_read_again(renderer: Renderer, volume: Volume) -> None:
    stored, (finest, *_) = large(volume)
    scene, read, broken = Scene(stored, HAZE, camera_of(volume, "orthographic")), finest.read, True

    def fails(box: Any) -> Any:
        if broken and box[0].start <= 64 < box[0].stop:
            raise InputError("ball: level 0: chunk 4, 4, 4 cannot be read")
        return read(box)

    finest.read = fails  # type: ignore[method-assign]
    with pytest.raises(InputError, match="chunk 4, 4, 4"):
        renderer.render(scene, SIZE, level=0)
    broken = False
    whole = renderer.render(replace(scene, volume=volume, classification="post"), SIZE)
    assert_allclose(renderer.render(scene, SIZE, level=0, sampling_rate=1), whole, atol=ROUNDING)


@pytest.mark.parametrize("lighting", [None, Lighting()])
def test_the_oracle_reads_what_its_rays_pass(volume: Volume, lighting: Lighting | None) -> None:
    scene = Scene(volume, HAZE, camera_of(volume, "perspective"), classification="post", lighting=lighting)
    stored, (finest, *_) = large(volume)
    pixels = chosen_pixels(SIZE, 3)
    found = exact.raycast_pixels(replace(scene, volume=stored), SIZE, pixels)
    truth = raycast(scene, SIZE)[pixels[:, 1], pixels[:, 0]]
    assert_allclose(found, truth, atol=1e-12)
    assert finest.reads.sum() < finest.reads.size


def test_chunks_behind_opaque_pixels_are_left_out_for_one_view(renderer: Renderer) -> None:
    """A wall before half of a region: the chunks behind it are not read, though others of their region are."""
    values = np.full((96, 96, 96), 20, np.uint8)
    values[:, :32, :24] = 255
    volume = Volume(values, name="wall")
    points = [(0, 0.0), (100, 0.01), (255, 8.0)]
    medium = TransferFunction(*zip(*[(value, (1, 0.5, 0), extinction) for value, extinction in points], strict=True))
    stored, (finest, *_) = large(volume, chunk=8)
    front = Scene(stored, medium, Camera.framing(volume, eye=volume.centre + [0, -200, 0]), classification="post")
    drawn = renderer.render(front, SIZE, level=0)
    assert finest.reads[9:11, 10:, 1].sum() == 0 < finest.reads[9:11, 10:, 3].min()
    assert_allclose(drawn, renderer.render(replace(front, volume=volume), SIZE), atol=ROUNDING)
    behind = replace(front, camera=Camera.framing(volume, eye=volume.centre + [0, 200, 0]))
    assert_allclose(
        renderer.render(behind, SIZE, level=0), renderer.render(replace(behind, volume=volume), SIZE), atol=ROUNDING
    )
    assert finest.reads[9:11, 10:, 1].min() == 1


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_what_lies_where_nothing_was_read_is_not_seen(
    renderer: Renderer, volume: Volume, projection: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Memory of parts holds what was in it: here the most opaque value, where neither a chunk nor a neighbour lies."""
    values_of, left = Assembly.values, []

    def poisoned(assembly: Assembly) -> np.ndarray:
        assembly.buffer = np.full(assembly.bytes, 255, np.uint8)
        values = values_of(assembly)
        left.append((values == 255).sum())
        return values

    monkeypatch.setattr(Assembly, "values", poisoned)
    scene = Scene(volume, HAZE, camera_of(volume, projection), classification="post")
    stored, _ = large(volume, chunk=8)
    drawn = renderer.render(replace(scene, volume=stored), SIZE, level=0)
    assert sum(left) > 100_000
    assert_allclose(drawn, renderer.render(scene, SIZE), atol=ROUNDING)


def test_the_oracle_reads_no_large_store_as_a_whole_for_what_shows(
    volume: Volume, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exact, "_MOST_WHOLE", volume.values.nbytes - 1)
    scene = Scene(volume, HAZE, camera_of(volume, "perspective"), classification="post")
    stored, (finest, *_) = large(volume)  # it fits
    assert_allclose(exact.raycast(replace(scene, volume=stored), SIZE), raycast(scene, SIZE), atol=1e-11)
    assert 0 < finest.reads.sum() < finest.reads.size
