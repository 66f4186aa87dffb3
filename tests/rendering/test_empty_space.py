"""Leaping over what is empty changes nothing but the number of samples."""

from __future__ import annotations

import re
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.pairs import IN_A_PROJECTION, each_classification_in_a_projection
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, inside, random_volume, smooth_volume, sparse_volume

from texvol.opengl.compositor import Compositor
from texvol.opengl.shaders import FOLDER
from texvol.opengl.uniforms import skip_uniforms
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.cells import CELL, Cells
from texvol.slicing.slabs import SLABS_PER_STACK

SIZE = (48, 40)
SAME = 2e-6  # runs of slabs begin elsewhere, and so sums are rounded elsewhere
classifications = pytest.mark.parametrize("classification", CLASSIFICATIONS)

MEDIA = {
    "bone": BONE,
    "a step": TransferFunction(np.array([0, 0.5, 0.5, 1]), np.ones((4, 3)), np.array([0, 0, 0.4, 0.7])),
    "a tooth": TransferFunction(np.array([0.2, 0.7, 0.7]), np.ones((3, 3)), np.array([0, 0.6, 0])),
    "opaque": TransferFunction(np.array([0, 0.6, 0.6]), np.full((3, 3), 0.7), np.array([0, 0, np.inf])),
    "gas": TransferFunction(np.array([0.3, 1]), np.array([(0, 0, 0), (0.2, 0.1, 0.05)]), np.zeros(2), emissive=True),
}


def assert_leaping_changes_nothing(
    renderer: Renderer, scene: Scene, size: tuple[int, int] = SIZE, **options: float
) -> np.ndarray:
    """The picture, the same with leaps as without them."""
    leaping = renderer.render(scene, size, texture_format="rgba32f", **options)
    plain = renderer.render(scene, size, texture_format="rgba32f", skip_empty=False, **options)
    brightest = max(1.0, float(plain.max()))
    np.testing.assert_allclose(leaping, plain, rtol=0, atol=SAME * brightest)
    return plain


def test_rounding_to_16_bits_makes_nothing_show(renderer: Renderer) -> None:
    """With one sample below the others the value of nothing lies between two of the 65536 steps."""
    smooth = np.sin(np.linspace(0, np.pi, 40)) ** 4
    values = (smooth * smooth[:, np.newaxis] * smooth[:, np.newaxis, np.newaxis]).astype(np.float32)
    values[values < 0.1] = 0
    rising = TransferFunction(np.array([0, values.max()]), np.ones((2, 3)), np.array([0, 0.6]))
    formats = []
    for steps in (0.0, 6000.6):  # from the least value to that of nothing
        values[0, 0, 0] = -steps * values.max() / (65535 - steps)
        volume = Volume(values.copy())
        scene = Scene(volume, rising, Camera.framing(volume), classification="post")
        pictures = []
        for skip_empty in (True, False):
            pictures.append(renderer.render(scene, SIZE, sampling_rate=0.5, skip_empty=skip_empty))
            formats.append(quick_stats(renderer)["texture_format"])
        np.testing.assert_allclose(*pictures, rtol=0, atol=SAME)
    assert formats == ["r16", "r16", "r32f", "r32f"]


def test_what_rounding_to_16_bits_makes_of_few_samples_is_not_leapt_over(renderer: Renderer) -> None:
    """A small block just under the value from which something shows, which its rounding is over."""
    z, y, x = np.meshgrid(*[np.linspace(0, 6, 96)] * 3, indexing="ij")
    values = (0.55 + 0.45 * np.sin(3 * x) * np.cos(2 * y) * np.sin(4 * z)).astype(np.float32)
    values[:, :, :40] = 0
    step = values.max() / 65535
    rounded_up = (np.floor(0.3 / step) + 0.55) * step
    values[50:53, 30:33, 30:33] = rounded_up
    steep = np.array([0, rounded_up + 0.2 * step, rounded_up + 0.0025, 1])
    volume = Volume(values)
    medium = TransferFunction(steep, np.ones((4, 3)), np.array([0, 0, 0.9, 0.9]))
    camera = Camera.framing(volume, eye=volume.centre + (0, 1, -300))
    scene = Scene(volume, medium, camera, classification="post")
    pictures = [renderer.render(scene, (128, 128), sampling_rate=0.5, skip_empty=skip) for skip in (True, False)]
    assert quick_stats(renderer)["texture_format"] == "r16"
    np.testing.assert_allclose(*pictures, rtol=0, atol=SAME)


@pytest.mark.parametrize(
    "medium, classification, projection",
    [  # each medium where samples are classified, and where values are
        ("bone", "slab", "orthographic"),
        ("bone", "integrated", "orthographic"),
        ("a step", "extinction", "perspective"),
        ("a step", "post", "perspective"),
        ("a tooth", "slab", "orthographic"),
        ("a tooth", "integrated", "orthographic"),
        ("opaque", "extinction", "perspective"),
        ("opaque", "post", "perspective"),
        ("gas", "slab", "orthographic"),
        ("gas", "integrated", "orthographic"),
    ],
)
def test_a_picture_is_the_same_with_leaps_as_without(
    renderer: Renderer, classification: Classification, projection: Projection, medium: str
) -> None:
    volume = sparse_volume(1)
    # Slabs per sample: up to five cells in a slab, which may miss the whole medium.
    for camera, rates in ((Camera.framing(volume, projection), (0.05, 1)), (inside(volume, projection), (0.3, 2.3))):
        scene = Scene(volume, MEDIA[medium], camera, classification=classification)
        for rate in rates:
            picture = assert_leaping_changes_nothing(renderer, scene, sampling_rate=rate)
            assert picture.max() > 0.01 or rate < 0.1


@settings(max_examples=15, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(CLASSIFICATIONS),
    st.sampled_from(list(MEDIA)),
    st.sampled_from(["orthographic", "perspective"]),
    st.sampled_from([0.1, 0.7, 1.0, 3.1]),
)
def test_leaps_lose_nothing_of_any_volume_from_any_place(
    renderer: Renderer, seed: int, classification: Classification, medium: str, projection: Projection, rate: float
) -> None:
    random = np.random.default_rng(seed)
    values = np.zeros(random.choice([1, 7, 13, 20, 26, 37, 49], 3, p=[0.04, *[0.16] * 6]), np.float32)
    for _ in range(random.integers(1, 8)):
        corner = [random.integers(0, count) for count in values.shape]
        block = values[tuple(slice(at, at + random.integers(1, 6)) for at in corner)]
        block[...] = random.random(block.shape)
    direction = np.eye(3) + 0.4 * random.standard_normal((3, 3)) if random.random() < 0.5 else np.eye(3)
    volume = Volume(values, random.uniform(0.5, 2, 3), random.uniform(-9, 9, 3), direction)
    # Along an axis as often as not: rays in the faces of cells.
    line_of_sight = np.eye(3)[random.integers(3)] if random.random() < 0.5 else random.standard_normal(3)
    line_of_sight *= random.choice([0.1, 0.5, 2.5]) * volume.radius / np.linalg.norm(line_of_sight)
    target = volume.centre if random.random() < 0.5 else volume.centre + random.standard_normal(3)
    up = np.cross(line_of_sight, random.standard_normal(3))
    if projection == "perspective":
        camera = Camera.perspective(target - line_of_sight, target, up, fov=random.uniform(20, 100))
    else:
        camera = Camera.orthographic(target - line_of_sight, target, up, height=2 * volume.radius)
    scene = Scene(volume, MEDIA[medium], camera, classification=classification)
    assert_leaping_changes_nothing(renderer, scene, (25, 24), sampling_rate=rate)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("beside", [0.0, 1e-7, -1e-7])
def test_rays_in_the_faces_of_cells_see_what_lies_behind(renderer: Renderer, axis: int, beside: float) -> None:
    """The middle column of pixels runs along faces between cells, and touches two layers of them."""
    values = np.zeros((30, 30, 30), np.float32)
    values[13:17, 13:17, 13:17] = 0.8
    volume = Volume(values)
    line_of_sight = np.roll([1.0, beside, 0], axis)
    camera = Camera.orthographic(
        volume.centre - 60 * line_of_sight, volume.centre, np.roll([0, 0, 1], axis), height=33.0
    )
    for classification in CLASSIFICATIONS:
        scene = Scene(volume, BONE, camera, classification=classification)  # type: ignore[arg-type]
        picture = assert_leaping_changes_nothing(renderer, scene, (33, 33))
        assert picture[16, 16, 3] > 0.5


@pytest.mark.parametrize("classification, projection", IN_A_PROJECTION[::2])
def test_a_mostly_empty_scene_takes_few_samples(
    renderer: Renderer, classification: Classification, projection: Projection
) -> None:
    values = np.zeros((93, 93, 93), np.uint8)
    values[20:30, 50:58, 60:75] = np.random.default_rng(0).integers(100, 255, (10, 8, 15))
    volume = Volume(values)
    medium = TransferFunction(255 * BONE.values, BONE.colors, BONE.extinctions)
    scene = Scene(volume, medium, Camera.framing(volume, projection), classification=classification)
    picture = assert_leaping_changes_nothing(renderer, scene)
    assert picture[..., 3].max() > 0.5
    renderer.render(scene, SIZE)
    stats = quick_stats(renderer, samples=True)
    assert 0 < stats["samples"] <= 0.25 * stats["samples_total"]
    assert 0 < stats["cells_drawn"] < 0.05 * stats["cells_total"]
    assert stats["cells_total"] == (93 // CELL) ** 3


@pytest.mark.parametrize("classification, projection", IN_A_PROJECTION[1::2])
def test_without_leaps_every_slab_is_sampled(
    renderer: Renderer, classification: Classification, projection: Projection
) -> None:
    volume = sparse_volume(2)
    scene = Scene(volume, BONE, Camera.framing(volume, projection), classification=classification)
    renderer.render(scene, SIZE, skip_empty=False, early_termination=0)
    whole = quick_stats(renderer, samples=True)
    assert whole["samples"] == whole["samples_total"] > SIZE[0] * SIZE[1]
    renderer.render(scene, SIZE, early_termination=0)
    stats = quick_stats(renderer, samples=True)
    assert stats["samples_total"] == whole["samples_total"]
    assert 0 < stats["samples"] < whole["samples"]


def test_slabs_are_counted_as_the_rays_cross_them(renderer: Renderer) -> None:
    """Eight slabs of one sample along an axis, in as many pixels as the box covers, from few rows to several blocks."""
    volume = Volume(np.ones((8, 8, 8), np.float32))
    for side in (64, 140):
        camera = Camera.orthographic(volume.centre - (0, 20, 0), volume.centre, (0, 0, 1), height=16.0)
        for classification in CLASSIFICATIONS:
            scene = Scene(volume, BONE, camera, classification=classification)  # type: ignore[arg-type]
            renderer.render(scene, (side, side), slab_thickness=1.0, early_termination=0)
            stats = quick_stats(renderer, samples=True)
            assert stats["samples"] == stats["samples_total"] == 8 * (side // 2) ** 2


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_slabs_of_a_lit_scene_are_counted_without_light(
    renderer: Renderer, classification: Classification, monkeypatch: pytest.MonkeyPatch
) -> None:
    sun = Lighting((Light(), Light("directional", (1, 2, 3))), shadows=True)
    scene = Scene(smooth_volume(12), BONE, lighting=sun, depth_cue=DepthCue(), classification=classification)
    renderer.render(scene, SIZE)
    program, asked = Compositor.program, []
    monkeypatch.setattr(Compositor, "program", lambda *how: asked.append(how[2]) or program(*how))
    lit = quick_stats(renderer, samples=True)["samples"]
    assert asked and not any(switches.get("LIT") or switches.get("CUE") for switches in asked if switches.get("COUNT"))
    monkeypatch.undo()
    renderer.render(replace(scene, lighting=None, depth_cue=None), SIZE)
    # The brightest light is 2 and ends rays later than none, a few slabs at most.
    assert 1 <= lit / quick_stats(renderer, samples=True)["samples"] < 1.1


@classifications
@pytest.mark.parametrize("memory", [None, 0.5])
def test_an_invisible_volume_draws_nothing(classification: Classification, memory: float | None) -> None:
    volume = random_volume(0, (40, 41, 42))
    nothing = TransferFunction(np.array([0.0, 1.0, 2.0]), np.ones((3, 3)), np.array([0.0, 0.0, 9.0]))
    with Renderer(texture_memory=memory) as renderer:
        picture = renderer.render(Scene(volume, nothing, classification=classification), SIZE)
        stats = quick_stats(renderer, samples=True)
    assert not picture.any()
    assert stats["bricks_drawn"] == stats["cells_drawn"] == stats["samples"] == stats["texture_bytes"] == 0
    assert "upload" not in stats["seconds"]


def test_cells_without_a_skip_are_not_made(renderer: Renderer) -> None:
    with patch("texvol.opengl.empty_space.Cells.of", side_effect=AssertionError):
        renderer.render(Scene(sparse_volume(3), BONE, classification="slab"), SIZE, skip_empty=False)
    stats = quick_stats(renderer)
    assert stats["cells_total"] == stats["cells_drawn"] == 0


def test_another_transfer_function_shows_what_was_empty(renderer: Renderer) -> None:
    """And another volume, with the same one."""
    volume = sparse_volume(4)
    camera = Camera.framing(volume)
    for classification in CLASSIFICATIONS:
        scene = Scene(volume, constant(0.0), camera, classification=classification)  # type: ignore[arg-type]
        assert not renderer.render(scene, SIZE).any()
        assert_leaping_changes_nothing(renderer, replace(scene, transfer_function=BONE))
        other = Volume(volume.values[::-1], volume.spacing)
        picture = assert_leaping_changes_nothing(renderer, replace(scene, volume=other, transfer_function=BONE))
        assert picture.max() > 0.01


MISTAKES = {
    "one cell too far": ("skips", lambda cells, visible: Cells.skips(cells, visible) + 2),
    "cells beside themselves": ("visible", lambda cells, medium, *_: np.roll(Cells.visible(cells, medium), 1, axis=2)),
    "ranges without neighbours": ("visible", lambda cells, medium, *_: cells.lowest > 0),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_leap_too_far_shows(mistake: str) -> None:
    volume = sparse_volume(1)
    scene = Scene(volume, BONE, Camera.framing(volume), classification="slab")
    name, wrong = MISTAKES[mistake]
    wronged = type("Wronged", (Cells,), {name: wrong})
    planted = patch("texvol.opengl.empty_space.Cells", wronged)
    with planted, Renderer() as renderer, pytest.raises(AssertionError, match="Not equal"):
        assert_leaping_changes_nothing(renderer, scene)


@classifications
def test_no_slab_at_the_end_of_a_run_is_drawn_twice(renderer: Renderer, classification: Classification) -> None:
    # Cells with matter here and there: many short runs, of odd lengths, some of which begin where others end.
    medium = TransferFunction(np.array([0.1, 1]), np.ones((2, 3)), np.array([0, 0.2]))
    for seed in (2, 3):  # with 2 a fourth run begins where the third ends, in matter
        random = np.random.default_rng(seed)
        blocks = np.kron(random.random((22, 22, 22)) < 0.1, np.ones((3, 3, 3)))
        volume = Volume((blocks * random.random(blocks.shape)).astype(np.float32))
        eye = volume.centre + 100 * random.standard_normal(3)
        scene = Scene(volume, medium, Camera.framing(volume, eye=eye), classification=classification)
        assert_leaping_changes_nothing(renderer, scene, (160, 160), sampling_rate=1.0)


@each_classification_in_a_projection
@pytest.mark.parametrize("count, thick, apart", [(12, 3, 18), (3, 80, 100)])
def test_every_sheet_behind_another_is_met(
    renderer: Renderer, classification: Classification, projection: Projection, count: int, thick: int, apart: int
) -> None:
    """More of them than a ray looks for at a time, in number or in slabs; the last shows behind the others."""
    values = np.tile(np.arange(apart) >= apart - thick, count).astype(np.float32)
    volume = Volume(np.broadcast_to(values, (20, 20, values.size)).copy())
    faint = TransferFunction(np.array([0.1, 1]), np.ones((2, 3)), np.array([0, 0.01]))
    eye = volume.centre + (3 * values.size, 4, 7)
    scene = Scene(volume, faint, Camera.framing(volume, projection, eye=eye), classification=classification)
    picture = assert_leaping_changes_nothing(renderer, scene, (64, 64), sampling_rate=1.0)
    whole = 1 - np.exp(-0.01 * values.sum())
    assert abs(picture[32, 32, 3] - whole) < 0.1 * whole
    renderer.render(scene, (64, 64), sampling_rate=1.0)
    stats = quick_stats(renderer, samples=True)
    assert stats["samples"] < 0.95 * stats["samples_total"]


def test_a_run_has_room_for_all_slabs_of_a_stack() -> None:
    text = (FOLDER / "skip.glsl").read_text(encoding="utf-8")
    found = re.search(r"const float MOST_SLABS = ([\d.]+);", text)
    assert found
    assert float(found[1]) - 1 > SLABS_PER_STACK  # which stands for no run
    assert float(found[1]) ** 2 <= 2**24  # to which float32 counts


@pytest.mark.parametrize(
    "extinction, termination, expected",
    [
        (0.01, 2.0**-20, 64),
        (np.inf, 2.0**-20, 16),
        (np.inf, 0.0, 64),  # no ray is ended
        (20 * np.log(2) / 5, 2.0**-20, 30),  # six times the five slabs that let no more through
    ],
)
def test_where_rays_end_soon_they_do_not_look_far(extinction: float, termination: float, expected: float) -> None:
    volume = sparse_volume(1)
    medium = TransferFunction(np.array([0.0, 0.5, 0.5]), np.ones((3, 3)), np.array([0.0, 0.0, extinction]))
    scene = Scene(volume, medium, Camera.framing(volume), classification="post")
    with Renderer() as renderer, patch("texvol.opengl.compositor.skip_uniforms", wraps=skip_uniforms) as asked:
        renderer.render(scene, SIZE, slab_thickness=1.0, early_termination=termination)
    assert skip_uniforms(*asked.call_args.args)["slabs_ahead"] == pytest.approx(expected)
