"""Pictures of thick slabs are drawn from a halved volume where that does not show, and only there."""

from __future__ import annotations

import gc
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch
from weakref import ref

import numpy as np
import pytest
from numpy.typing import NDArray
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, smooth_volume

from texvol.__main__ import main
from texvol.geometry import Lines
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera, Projection
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Lighting
from texvol.scene.looks import look_for
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.cells import CELL
from texvol.textures import halving as coarser
from texvol.window import quality

SIZE = (56, 48)
SAME = 2e-6  # what runs of slabs that begin elsewhere round elsewhere
COUNT = 64
OBLIQUE = np.array([[1, 0.4, 0], [0.2, 1, 0.3], [0, -0.3, -1]])  # and left-handed
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


@pytest.fixture(autouse=True)
def small_volumes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coarser, "LEAST_SAMPLES", 2)


def waves(shape: tuple[int, int, int] = (COUNT, COUNT, COUNT)) -> NDArray[np.float32]:
    """Between 0 and 1: waves of which none is shorter than a sixth of the box, in empty space."""
    z, y, x = np.meshgrid(*[(np.arange(count) + 0.5) / count * 2 - 1 for count in shape], indexing="ij")
    values = np.sin(9 * x + 3 * y + 1) * np.cos(8 * y - 3 * z) * np.sin(7 * z + 2)
    return np.clip(1.4 * values, 0, 1).astype(np.float32)


def noise(shape: tuple[int, int, int] = (COUNT, COUNT, COUNT)) -> NDArray[np.float32]:
    return np.random.default_rng(7).random(shape, np.float32)


def scene_of(values: NDArray, medium: TransferFunction = FOG, projection: Projection = "perspective") -> Scene:
    volume = Volume(values, (0.8, 1.0, 0.9), (3, -2, 1), OBLIQUE)
    thin = replace(medium, extinctions=4 * medium.extinctions)
    return Scene(volume, thin, Camera.framing(volume, projection), classification="post")


def drawn(renderer: Renderer, scene: Scene, apart: float, **how: Any) -> tuple[NDArray, list[int]]:
    """The picture of samples so many voxels apart, and how often the volume was halved for it."""
    picture = renderer.render(scene, SIZE, slab_thickness=apart * float(scene.volume.spacing.max()), **how)
    return picture, quick_stats(renderer)["halvings"]


def in_full(renderer: Renderer, scene: Scene, apart: float) -> NDArray:
    picture, halvings = drawn(renderer, scene, apart, texture_format="rgba32f")
    assert halvings == [0, 0, 0]
    return picture


def rms(numbers: NDArray) -> float:
    return float(np.sqrt(np.square(numbers, dtype=np.float64).mean()))


# When.


@projections
@pytest.mark.parametrize(("apart", "times"), [(6, 1), (7.9, 1), (11.3, 2)])
def test_the_error_is_hardly_raised_and_said(
    renderer: Renderer, projection: Projection, apart: float, times: int
) -> None:
    scene = scene_of(waves(), projection=projection)
    truth = raycast(scene, SIZE)
    picture, halvings = drawn(renderer, scene, apart)
    assert halvings == [times] * 3
    stats = renderer.stats
    left = COUNT // 2**times
    assert stats["texture_bytes"] <= 4 * left**3
    assert stats["cells_total"] == (-(-left // CELL)) ** 3
    full = in_full(renderer, scene, apart)
    assert rms(picture - full) > 0
    assert rms(picture - truth) < 1.2 * rms(full - truth)  # a tenth over all views
    assert stats["estimated_error"] >= np.abs(picture - truth).max()


# Two points so close that values are not rounded to 16 bits, on the line between their neighbours.
CLOSE = TransferFunction(
    np.insert(FOG.values, 2, (0.45, 0.4501)),
    np.insert(FOG.colors, 2, [(0.65, 0.7, 0.35)] * 2, axis=0),
    np.insert(FOG.extinctions, 2, (0.008, 0.0080027)),
)


@pytest.mark.parametrize(("medium", "texels"), [(FOG, "r16"), (CLOSE, "r32f")])
def test_the_estimate_leaves_the_halved_volume_where_it_is(
    renderer: Renderer, medium: TransferFunction, texels: str
) -> None:
    """It draws the full one, whose textures and cells are put aside afterwards."""
    scene = scene_of(waves(), medium)
    full = in_full(renderer, scene, 9)
    first, halvings = drawn(renderer, scene, 9)
    assert halvings == [1, 1, 1] and renderer.stats["texture_format"] == texels
    assert renderer.stats["estimated_error"] > 0
    assert not np.array_equal(full, first)
    uploads = renderer._pictures.in_memory.cache.volumes[0].textures.uploads
    with patch("texvol.opengl.empty_space.Cells.of", side_effect=AssertionError):
        again = renderer.render(scene, SIZE, slab_thickness=9.0)
    np.testing.assert_array_equal(again, first)
    assert renderer._pictures.in_memory.cache.volumes[0].textures.uploads == uploads
    np.testing.assert_array_equal(in_full(renderer, scene, 9), full)


def test_a_volume_is_halved_once(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(waves())
    drawn(renderer, scene, 7)
    monkeypatch.setattr(coarser, "_halved_values", None)
    for apart in (1, 6, 0.5, 7):
        moved = replace(scene, camera=Camera.framing(scene.volume, eye=scene.volume.centre + (90, 70 + apart, 80)))
        assert drawn(renderer, moved, apart)[1] == ([1, 1, 1] if apart >= 6 else [0, 0, 0])
        assert renderer.stats["estimated_error"] > 0  # which draws the full one


@pytest.mark.parametrize(
    ("values", "medium", "apart"),
    [(noise(), FOG, 8), (noise(), BONE, 16), (np.where(waves() > 0.5, 1, 0), FOG, 9)],
    ids=["noise in fog", "noise in bone", "edges"],
)
def test_where_it_would_show_it_is_not_done(
    renderer: Renderer, values: NDArray, medium: TransferFunction, apart: float
) -> None:
    """And would show: so the rule is no stricter than it has to be by far."""
    scene = scene_of(values, medium)
    picture, halvings = drawn(renderer, scene, apart)
    assert halvings == [0, 0, 0]
    halved = replace(scene, volume=coarser.halved(scene.volume, (0, 1, 2)))
    error = rms(in_full(renderer, scene, apart) - raycast(scene, SIZE))
    assert rms(drawn(renderer, halved, apart, texture_format="rgba32f")[0] - picture) > 0.2 * error


def test_only_axes_of_thick_slabs_and_even_counts_are_halved(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(coarser._Rays, "hide", lambda rays, volume: True)
    scene = Scene(Volume(waves((64, 63, 128)), (0.5, 1.0, 2.0)), FOG, classification="post")
    for thickness, halvings in ((1.99, [0, 0, 0]), (2, [1, 0, 0]), (4.5, [2, 0, 0]), (8, [3, 0, 1])):
        renderer.render(scene, SIZE, slab_thickness=thickness)
        assert quick_stats(renderer)["halvings"] == halvings
    for rate, halvings in ((1 / 3.9, [0, 0, 0]), (1 / 4, [1, 0, 0])):
        renderer.render(scene, SIZE, sampling_rate=rate)
        assert quick_stats(renderer)["halvings"] == halvings


def test_a_volume_may_be_halved_twice(renderer: Renderer) -> None:
    scene = Scene(smooth_volume(64), FOG, classification="post")
    picture, halvings = drawn(renderer, scene, 20)
    assert halvings == [2, 2, 2]
    truth, full = raycast(scene, SIZE), in_full(renderer, scene, 20)
    assert rms(picture - truth) < 1.05 * rms(full - truth)


def test_small_volumes_are_left_as_they_are(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(waves())
    monkeypatch.setattr(coarser, "LEAST_SAMPLES", COUNT**3 + 1)
    assert drawn(renderer, scene, 9)[1] == [0, 0, 0]
    monkeypatch.setattr(coarser, "LEAST_SAMPLES", COUNT**3)
    with Renderer() as other:
        assert drawn(other, scene, 9)[1] == [1, 1, 1]


# What is left out.


def changed_medium(**changes: Any) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, transfer_function=replace(scene.transfer_function, **changes))


def changed_values(**changes: Any) -> Callable[[Scene], Scene]:
    def change(scene: Scene) -> Scene:
        values = changes.pop("values", scene.volume.values)
        return replace(scene, volume=Volume(values, scene.volume.spacing, **changes))

    return change


def with_value(value: float) -> NDArray:
    values = waves()
    values[3, 4, 5] = value
    return values


CLIP = ClipPlane((1, 0, 0), 20.0)
WHOLE = np.ones((COUNT, COUNT, COUNT), np.bool_)
INFINITE = np.append(FOG.extinctions[:-1], np.inf)
LEFT_OUT: dict[str, Callable[[Scene], Scene]] = {
    "slab": lambda scene: replace(scene, classification="slab"),
    "extinction": lambda scene: replace(scene, classification="extinction"),
    "integrated": lambda scene: replace(scene, classification="integrated"),
    "xray": lambda scene: replace(scene, mode="xray"),
    "isosurface": lambda scene: replace(scene, mode="isosurface", isovalue=0.5),
    "labels": changed_values(values=np.rint(4 * waves()), labels=True),
    "colours": changed_values(colors=np.ones((COUNT, COUNT, COUNT, 3))),
    "mask": lambda scene: replace(scene, mask=Mask(WHOLE)),
    "light": lambda scene: replace(scene, lighting=Lighting()),
    "gradient": changed_medium(modulation=np.array([(0.0, 0.5), (1.0, 1.0)])),
    "missing": changed_values(values=with_value(np.nan)),
    "infinite value": changed_values(values=with_value(np.inf)),
    "infinite extinction": changed_medium(extinctions=INFINITE),
    "geometry": lambda scene: replace(scene, geometry=(Lines([(0, 0, 0), (9, 9, 9)], [(0, 1)]),)),
    "caps": lambda scene: replace(scene, clip=(CLIP,), caps=True),
}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_whatever_is_more_than_plain_matter_is_drawn_in_full(name: str) -> None:
    plain = scene_of(waves())
    changed = LEFT_OUT[name](plain)
    assert plain.transfer_function is not None and changed.transfer_function is not None
    assert coarser.may_be_coarser(plain.completed((8, 8)), 9.0)
    assert not coarser.may_be_coarser(changed.completed((8, 8)), 9.0)


@pytest.mark.parametrize("name", ["light", "added"])
def test_what_may_not_be_halved_is_not(renderer: Renderer, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coarser._Rays, "hide", lambda rays, volume: True)
    scene = scene_of(waves())
    if name == "added":
        scene = replace(scene, added=(AddedVolume(scene.volume, scene.transfer_function),))
    else:
        scene = LEFT_OUT[name](scene)
    assert drawn(renderer, scene, 9)[1] == [0, 0, 0]


@pytest.mark.parametrize("texture_format", ["rgba8", "rgba16f", "rgba32f"])
def test_who_asks_for_texels_gets_those_of_all_samples(renderer: Renderer, texture_format: str) -> None:
    picture, halvings = drawn(renderer, scene_of(waves()), 9, texture_format=texture_format)
    assert halvings == [0, 0, 0]
    np.testing.assert_array_equal(picture, in_full(renderer, scene_of(waves()), 9))


def test_a_wanted_error_is_that_of_all_samples(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(waves(), projection="orthographic")
    with Renderer() as other:
        picture = renderer.render(scene, SIZE, max_error=0.9)
        thickness, estimate = renderer.settings["slab_thickness"], renderer.estimate
        assert thickness >= 4 and quick_stats(renderer)["halvings"] == [0, 0, 0]
        assert renderer.render(scene, SIZE, slab_thickness=thickness).tobytes() != picture.tobytes()
        assert quick_stats(renderer)["halvings"] == [2, 2, 2]
        monkeypatch.setattr(coarser, "may_be_coarser", None)
        assert other.render(scene, SIZE, max_error=0.9).tobytes() == picture.tobytes()
        assert (other.settings["slab_thickness"], other.estimate) == (thickness, estimate)


@pytest.fixture
def file_of_waves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    np.save("waves.npy", waves())
    Path("fog.json").write_text(json.dumps(FOG.as_json()))
    return "waves.npy"


def test_views_after_the_first_of_a_wanted_error_are_of_all_samples(file_of_waves: str) -> None:
    line = ["render", file_of_waves, "--tf", "fog.json", "--classification", "post", "--size", "40x40"]
    line += ["--orbit", "2", "-o", "%d.exr", "--stats", "s.json"]
    for accuracy, halvings in (("--max-error", "0.9"), [0, 0, 0]), (("--sampling-rate", "0.0625"), [2, 2, 2]):
        assert main([*line, *accuracy]) == 0
        stats = json.loads(Path("s.json").read_text())
        assert (stats["slab_thickness"], stats["halvings"]) == (16, halvings)


def test_stats_say_it(file_of_waves: str) -> None:
    line = ["render", file_of_waves, "--tf", "fog.json", "--size", "40x40", "--sampling-rate", "0.125", "-o", "a.png"]
    for classification, halvings in (("post", [1, 1, 1]), ("slab", [0, 0, 0])):
        assert main([*line, "--classification", classification, "--stats", "s.json"]) == 0
        assert json.loads(Path("s.json").read_text())["halvings"] == halvings


def test_a_window_never_draws_so_coarsely_while_something_moves() -> None:
    """So nothing waits there for one volume and then for the other."""
    rates = [each.rate for each in (*quality.ON_CPU, *quality.ON_CARD)]
    assert min(rates) > 1 / coarser.SAMPLES_APART


# What stays as it was.

KINDS: dict[str, Callable[[Scene], Scene]] = {
    "plain": lambda scene: scene,
    "emissive": changed_medium(emissive=True, colors=FOG.values[:, np.newaxis] * (0.02, 0.03, 0.01)),
    "premultiplied": changed_medium(premultiplied=True, colors=FOG.extinctions[:, np.newaxis] * (3, 2, 1)),
    "depth cue": lambda scene: replace(scene, depth_cue=DepthCue()),
    "clip": lambda scene: replace(scene, clip=(CLIP,)),
    "crop": lambda scene: replace(scene, crop=((5, 40), (-30, 50), (-60, 30))),
}


@pytest.mark.parametrize("kind, projection", list(zip(KINDS, 3 * ["orthographic", "perspective"], strict=True)))
def test_a_picture_is_the_same_with_leaps_as_without(renderer: Renderer, projection: Projection, kind: str) -> None:
    values = waves()
    values[:, :30] = 0  # empty space, beside which halved values fall below 0
    values[:20] *= 0.5
    scene = KINDS[kind](scene_of(values, projection=projection))
    leaping, halvings = drawn(renderer, scene, 9)
    assert halvings == [1, 1, 1]
    stats = quick_stats(renderer, samples=True)
    assert stats["cells_drawn"] < stats["cells_total"] and stats["samples"] < 0.8 * stats["samples_total"]
    plain, halvings = drawn(renderer, scene, 9, skip_empty=False)
    assert halvings == [1, 1, 1]
    assert leaping.max() > 0.05
    np.testing.assert_allclose(leaping, plain, rtol=0, atol=SAME * max(1.0, float(plain.max())))


@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16", "float16", "float64"])
def test_any_type_of_values_is_halved_without_bias(renderer: Renderer, dtype: str) -> None:
    steps, low = {"uint8": (255, 0), "int8": (255, -128), "uint16": (60000, 0), "int16": (60000, -30000)}.get(
        dtype, (1, 0)
    )
    values = waves() * steps + low
    values = (np.rint(values) if steps > 1 else values).astype(dtype)
    scene = scene_of(waves())
    assert scene.transfer_function is not None
    medium = replace(scene.transfer_function, values=scene.transfer_function.values * steps + low)
    same = replace(scene, volume=Volume(values, scene.volume.spacing, scene.volume.origin, OBLIQUE))
    picture, halvings = drawn(renderer, replace(same, transfer_function=medium), 9)
    assert halvings == [1, 1, 1]
    # What 8 bits round the values to, and half precision; of the halved ones themselves nothing is lost.
    rounding = {"uint8": 1 / 510, "int8": 1 / 510, "float16": 2.0**-12}.get(dtype, 1 / 120000)
    expected, _ = drawn(renderer, scene, 9)
    assert rms(picture - expected) < 2 * rounding


@pytest.mark.parametrize("megabytes", [0.1, 0.5])
def test_in_bricks_it_is_the_same_picture(renderer: Renderer, megabytes: float) -> None:
    """Whether it is the halved volume that has no room in one piece, or the full one alone."""
    scene = scene_of(waves((96, 96, 96)))
    whole, _ = drawn(renderer, scene, 9)
    with Renderer(texture_memory=megabytes) as small:
        picture, halvings = drawn(small, scene, 9)
        assert halvings == [1, 1, 1]
        assert (quick_stats(small)["bricks_total"] > 1) == (megabytes < 0.2)
    np.testing.assert_allclose(picture, whole, rtol=0, atol=SAME)


def test_a_proposed_transfer_function_is_that_of_all_samples(renderer: Renderer) -> None:
    scene = replace(scene_of(waves()), transfer_function=None)
    picture, halvings = drawn(renderer, scene, 9)
    known = replace(scene, transfer_function=look_for(scene.volume))
    np.testing.assert_array_equal(picture, drawn(renderer, known, 9)[0])
    assert halvings == quick_stats(renderer)["halvings"]


def test_without_a_camera_the_same_box_is_framed(renderer: Renderer) -> None:
    scene = replace(scene_of(waves()), camera=None)
    assert drawn(renderer, scene, 9)[1] == [1, 1, 1]
    assert renderer._last is not None
    complete = scene.completed(SIZE)
    left = renderer._pictures.in_memory.cache.volumes[0].coarser_scene(complete, complete, renderer._last[2])
    assert left.volume.dimensions == (COUNT // 2,) * 3
    assert left.camera == scene.completed(SIZE).camera


def test_what_few_rays_meet_is_not_halved() -> None:
    """Where nothing is met nothing differs; that says nothing of the small thing that the rays miss."""
    for fraction, is_halved in ((1, True), (8, False)):
        values = waves()
        corner = COUNT // fraction
        values[corner:] = values[:, corner:] = values[:, :, corner:] = 0
        scene = scene_of(values)
        assert scene.transfer_function is not None
        chosen = coarser.coarsest(scene.volume, scene.transfer_function, 8.0)
        assert (chosen is not scene.volume) == is_halved


def test_nothing_is_kept_of_a_volume_that_is_gone(renderer: Renderer) -> None:
    scene = scene_of(waves())
    assert drawn(renderer, scene, 8)[1] == [1, 1, 1]
    volume = ref(scene.volume)
    renderer.render(Scene(smooth_volume(8), FOG, classification="slab"), SIZE)
    del scene
    gc.collect()
    assert volume() is None
