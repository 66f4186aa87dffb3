"""Pictures of several volumes that do not fit in memory together: those of the volumes in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.large import large, statistics_of
from support.quick_stats import quick_stats
from support.several import turned

from texvol import (
    AddedVolume,
    Camera,
    ClipPlane,
    DepthCue,
    InputError,
    Lighting,
    Mask,
    Renderer,
    Scene,
    TransferFunction,
    Volume,
    plan,
    raycast,
    render_progressively,
)
from texvol.rendering.streaming.visibility import Screen
from texvol.scene.large_volume import LargeVolume, Level

SIZE = (48, 40)
# Rounding of positions in textures of other sizes, and of blends.
ROUNDING = 2e-6
HAZE = TransferFunction([40, 100, 160, 255], [(0.2, 0.4, 0.9)] * 4, [0, 0.01, 0.03, 0.2])
RED = TransferFunction([30, 120, 255], [(1, 0.2, 0.1)] * 3, [0, 0.05, 0.15])
# Faces of labels are met to 1e-5 of a slab: some twenty on a ray, at an optical depth of 0.14 for a slab.
OF_FACES = 20 * 1e-5 * 0.14
GLOW = TransferFunction([30, 255], [(0.004, 0.018, 0.002)] * 2, [0.01, 0.02], emissive=True)
FINEST: dict[str, Any] = {"level": 0, "sampling_rate": 2}


@pytest.fixture
def few_regions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory is cut into a quarter of the regions, some tens: each takes milliseconds, whatever is in it."""
    monkeypatch.setattr("texvol.slicing.regions._LEAST_PARTS", 8)


def waves(n: int, phase: float = 0.0) -> np.ndarray:
    """A ball of waves in an empty box of odd sides."""
    z, y, x = np.ogrid[: n - 3, : n + 5, :n]
    r = np.sqrt((x - n / 2) ** 2 + (y - n / 2) ** 2 + (z - n / 2) ** 2) / n
    inside = 120 + 60 * np.sin(x / 5 + phase) * np.sin(y / 7) * np.sin(z / 6)
    return np.where(r < 0.42, inside, 0).astype(np.uint8)


FIRST = Volume(waves(64), (1.0, 0.9, 1.2), (5, -3, 7), name="first")
BESIDE = Volume(waves(64, 2.0), FIRST.spacing, FIRST.origin, name="beside")
WITHIN = Volume(waves(40), (1.3, 1.1, 0.8), name="within").moved(turned(25, shift=(20, 10, 30)))
FAR = Volume(waves(40), (0.7, 0.7, 0.7), (60, 40, 50), name="far")
LABELS = Volume(waves(40) // 40, (1.2, 1.0, 0.9), (10, 10, 10), labels=True, name="labels")
OTHERS = {"one grid": [BESIDE], "turned": [WITHIN], "farther": [FAR], "three": [BESIDE, FAR]}


def camera_of(projection: str = "orthographic") -> Camera:
    eye = FIRST.centre + FIRST.radius * np.array([1.5, 1.1, 0.8])
    if projection == "orthographic":
        return Camera.framing(FIRST, eye=eye)
    eye = FIRST.centre + FIRST.radius * np.array([0.7, 0.5, 0.4]) if projection == "inside" else eye
    return Camera.perspective(tuple(eye), tuple(FIRST.centre), (0, 0, 1), fov=40)


def scene_of(others: Sequence[Volume], projection: str = "orthographic", **how: Any) -> Scene:
    added = [AddedVolume(each, None if each.labels else RED) for each in others]
    return Scene(FIRST, HAZE, camera_of(projection), added=added, **({"classification": "post"} | how))


def stored(scene: Scene, memory: int | None = None, **how: Any) -> Scene:
    """The scene of stores that do not fit together, each of which fits by itself unless `memory` is told."""
    room = sum(volume.values.nbytes for volume in scene.volumes) - 1 if memory is None else memory
    made = [each if each.labels else large(each, **({"chunk": 8} | how), memory=room)[0] for each in scene.volumes]
    added = (replace(each, volume=volume) for each, volume in zip(scene.added, made[1:], strict=True))
    return replace(scene, volume=made[0], added=tuple(added))


def parts_of(renderer: Renderer) -> dict[str, Any]:
    parts: dict[str, Any] = quick_stats(renderer)["parts"]
    return parts


@pytest.mark.usefixtures("few_regions")
@pytest.mark.parametrize("projection", ["orthographic", "perspective", "inside"])
@pytest.mark.parametrize("others", list(OTHERS))
def test_the_picture_is_that_of_the_volumes_in_memory(renderer: Renderer, others: str, projection: str) -> None:
    scene = scene_of(OTHERS[others], projection)
    drawn = renderer.render(stored(scene), SIZE, **FINEST)
    assert parts_of(renderer)["regions_drawn"] > 3
    assert_allclose(drawn, renderer.render(scene, SIZE, sampling_rate=2), atol=ROUNDING)


# Statistics choose what is read, from the samples' range and whatever the classification.
@pytest.mark.usefixtures("few_regions")
@pytest.mark.parametrize(
    ("classification", "how"),
    [
        *((kind, {}) for kind in ("slab", "extinction", "post", "integrated")),
        *((kind, {"statistics": False}) for kind in ("post", "integrated")),
    ],
)
def test_every_classification(renderer: Renderer, classification: str, how: dict[str, Any]) -> None:
    scene = scene_of([WITHIN], classification=classification)
    drawn = renderer.render(stored(scene, **how), SIZE, **FINEST, texture_format="rgba32f")
    assert parts_of(renderer)["regions_drawn"] > 3
    assert_allclose(drawn, renderer.render(scene, SIZE, sampling_rate=2, texture_format="rgba32f"), atol=ROUNDING)


# In memory gradients have 16 bits unless told.
@pytest.mark.usefixtures("few_regions")
@pytest.mark.parametrize(
    ("how", "accuracy"),
    [
        ({"lighting": Lighting()}, {"texture_format": "rgba32f"}),
        ({"depth_cue": DepthCue(0.7, (0, 0.2, 0.5)), "clip": [ClipPlane((1, 1, 0.3), 40)]}, {}),
        ({"clip": [ClipPlane((1, 1, 0.3), 40)], "caps": True}, {}),
        ({"crop": ((20, 70), (0, 40), (10, 50))}, {"skip_empty": False}),
        ({"transfer_function": GLOW, "background": (0.1, 0.2, 0.3)}, {"early_termination": 0.0}),
    ],
    ids=["lit", "cued", "capped", "cropped", "emissive"],
)
def test_what_scenes_have_beside_media(renderer: Renderer, how: dict[str, Any], accuracy: dict[str, Any]) -> None:
    scene = replace(scene_of([WITHIN], "perspective"), **how)
    drawn = renderer.render(stored(scene), SIZE, **FINEST, **accuracy)
    assert parts_of(renderer)["regions_drawn"] > 3
    assert_allclose(drawn, renderer.render(scene, SIZE, sampling_rate=2, **accuracy), atol=ROUNDING)


@pytest.mark.parametrize("first", [FIRST, LABELS])
def test_labels_in_memory_beside_stores(renderer: Renderer, first: Volume) -> None:
    """Pieces of rays end at each label, also where no label shows."""
    scene = scene_of([LABELS, WITHIN])
    if first.labels:
        scene = Scene(LABELS, camera=scene.camera, classification="post", added=[AddedVolume(FIRST, HAZE)])
    in_parts = stored(scene, sum(each.values.nbytes for each in scene.volumes if not each.labels) - 1)
    drawn = renderer.render(in_parts, SIZE, **FINEST)
    assert parts_of(renderer)["regions_drawn"] > 3
    assert_allclose(drawn, renderer.render(scene, SIZE, sampling_rate=2), atol=OF_FACES)


@pytest.mark.usefixtures("few_regions")
def test_blocks_make_the_whole(renderer: Renderer) -> None:
    """Each region is drawn in one block, whatever part of the box that has."""
    scene = stored(scene_of([FAR])).completed(SIZE)
    whole = renderer.render(scene, SIZE, **FINEST)
    settings, pictures = renderer._last[2], renderer._pictures.of(renderer._last[0])  # type: ignore[index]
    halves = [np.array([(-1e9, -1e9, -1e9), (0.4, 1e9, 1e9)]), np.array([(0.4, -1e9, -1e9), (1e9, 1e9, 1e9)])]
    regions = 0
    composited = np.zeros_like(np.asarray(whole))
    with renderer._context:
        for block in reversed(halves):  # the eye is on the far side
            behind = pictures.draw(renderer._last[0], SIZE, settings, block=block)  # type: ignore[index]
            composited = composited + (1 - composited[..., 3:]) * behind
            regions += pictures.bricks_drawn
    assert_allclose(composited, whole, atol=ROUNDING)
    renderer.render(scene, SIZE, **FINEST)
    assert regions == parts_of(renderer)["regions_drawn"]


@pytest.mark.usefixtures("few_regions")
def test_chunks_that_show_nothing_are_not_read(renderer: Renderer) -> None:
    scene = scene_of([BESIDE])
    values = scene.added[0].volume.values.copy()
    values[:, :, 32:] = 0
    sources = []
    made = []
    for array in (scene.volume.values, values):
        level, (source, *_) = large(Volume(array, FIRST.spacing, FIRST.origin), chunk=8, memory=400_000)
        made.append(level)
        sources.append(source)
    renderer.render(replace(scene, volume=made[0], added=(AddedVolume(made[1], RED),)), SIZE, **FINEST)
    assert sources[0].reads[:, :, 6:].any()
    assert not sources[1].reads[:, :, 6:].any() and sources[1].reads[:, :, :4].any()
    drawn = parts_of(renderer)
    assert drawn["bytes_wanted"] < values.nbytes + scene.volume.values.nbytes
    assert drawn["peak_bytes"] <= 400_000


def test_what_any_volume_hides_is_not_read(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """One volume is opaque in front, the other is behind it."""
    wall = np.zeros((64, 64, 64), np.uint8)
    wall[:, 40:48] = 255
    thin = np.full((64, 64, 64), 60, np.uint8)
    dense = TransferFunction([100, 255], [(1, 1, 1)] * 2, [0, 20])
    camera = Camera.framing(Volume(wall), eye=(31.5, 300, 31.5))
    scene = Scene(Volume(wall), dense, camera, added=[AddedVolume(Volume(thin), RED)], classification="post")
    in_parts = stored(scene)
    drawn = renderer.render(in_parts, SIZE, **FINEST)
    hidden = parts_of(renderer)["regions_hidden"]
    assert hidden > 10
    assert_allclose(drawn, renderer.render(scene, SIZE, sampling_rate=2), atol=2e-4)  # what ends a ray
    monkeypatch.setattr(Screen, "covers", lambda *_: False)
    renderer.render(stored(scene), SIZE, **FINEST)
    assert parts_of(renderer)["regions_hidden"] == 0


def test_volumes_that_fit_together_are_drawn_from_memory(renderer: Renderer) -> None:
    scene = scene_of([BESIDE])
    drawn = renderer.render(stored(scene, 10**7), SIZE, sampling_rate=2)
    assert "parts" not in quick_stats(renderer)
    np.testing.assert_array_equal(drawn, renderer.render(scene, SIZE, sampling_rate=2))


@pytest.mark.parametrize("others", ["one grid", "turned"])
@pytest.mark.parametrize("how", [{}, {"lighting": Lighting(), "depth_cue": DepthCue(0.5, (0, 0.2, 0.5))}])
def test_the_oracle_joins_regions(others: str, how: dict[str, Any]) -> None:
    scene = scene_of(OTHERS[others], "perspective", **how)
    assert_allclose(raycast(stored(scene), (16, 12)), raycast(scene, (16, 12)), atol=1e-9)


@pytest.mark.usefixtures("few_regions")
def test_an_error_is_kept_from_the_finest_level(renderer: Renderer) -> None:
    scene = scene_of([WITHIN])
    drawn = renderer.render(stored(scene, levels=3), (24, 20), max_error=0.01, check=60)
    assert parts_of(renderer)["levels"].keys() == {"0"}
    check = renderer._check
    assert check is not None and check.largest_error <= 0.01
    assert np.abs(drawn - raycast(scene, (24, 20))).max() <= 0.01


@pytest.mark.usefixtures("few_regions")
def test_each_volume_has_levels_of_its_own(renderer: Renderer) -> None:
    """The second one's samples lie as far apart as those of the first one's level 1."""
    coarse = Volume(waves(32), (2.0, 1.8, 2.4), FIRST.origin + 0.5 * np.array([1.0, 0.9, 1.2]), name="coarse")
    scene = stored(scene_of([coarse]), levels=3)
    picture = renderer.render(scene, SIZE, level=1)
    assert parts_of(renderer)["levels"].keys() == {"0", "1"}
    finest = renderer.render(scene, SIZE, level=0)
    assert parts_of(renderer)["levels"].keys() == {"0"}
    assert 1e-4 < np.abs(picture - finest).max() < 0.1


def test_a_plan_counts_all_volumes(renderer: Renderer) -> None:
    scene = stored(scene_of([BESIDE]), levels=2)
    planned = plan(scene, SIZE, level=0)
    renderer.render(scene, SIZE, level=0)
    drawn = parts_of(renderer)
    assert planned.bytes_total == 2 * FIRST.values.nbytes
    assert sum(planned.levels.values()) == sum(drawn["levels"].values())
    assert planned.bytes >= drawn["bytes_wanted"] > 0
    assert planned.regions == drawn["regions"]


@pytest.mark.usefixtures("few_regions")
def test_coarse_pictures_come_first(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("texvol.rendering.streaming.progressive._FIRST", 1 << 14)
    scene = stored(scene_of([BESIDE]), levels=3)
    stages = list(render_progressively(renderer, scene, SIZE, level=0))
    assert [stage.level for stage in stages] == [2, 1, None]
    assert parts_of(renderer)["levels"].keys() == {"0"}


@pytest.mark.usefixtures("few_regions")
@pytest.mark.parametrize("missing", [0, 1])
def test_a_chunk_that_cannot_be_read_is_named(renderer: Renderer, missing: int) -> None:
    """And the next picture asks for it again."""
    scene = stored(scene_of([BESIDE]))
    volume = scene.volumes[missing]
    assert isinstance(volume, LargeVolume)
    source = volume.levels[0].source
    read = source.read

    def broken(box: Any) -> Any:
        raise InputError("chunk 1/2/3 is damaged")

    object.__setattr__(source, "read", broken)
    with pytest.raises(InputError, match="chunk 1/2/3"):
        renderer.render(scene, SIZE, **FINEST)
    object.__setattr__(source, "read", read)
    drawn = renderer.render(scene, SIZE, **FINEST)
    assert_allclose(drawn, renderer.render(scene_of([BESIDE]), SIZE, sampling_rate=2), atol=ROUNDING)


def test_a_mask_needs_all_samples_in_memory(renderer: Renderer) -> None:
    scene = scene_of([BESIDE])
    mask = Mask(np.ones(BESIDE.shape, np.uint8), [1])
    large_ones = stored(scene, BESIDE.values.nbytes // 2)
    added = (replace(large_ones.added[0], mask=mask),)
    with pytest.raises(InputError, match=r"a mask cannot be drawn part by part"):
        renderer.render(replace(large_ones, added=added), SIZE)


def test_memory_without_room_for_a_region_is_told(renderer: Renderer) -> None:
    source = large(FIRST, chunk=64, levels=1)[1][0]
    level = Level(source, statistics=statistics_of(FIRST.values, 64))
    one = LargeVolume([level], FIRST.spacing, FIRST.origin, memory=200_000, name="one")
    scene = replace(scene_of([BESIDE]), volume=one)
    with pytest.raises(InputError, match="one: memory must have room for"):
        renderer.render(scene, SIZE, **FINEST)
