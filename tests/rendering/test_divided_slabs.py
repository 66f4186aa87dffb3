"""Slabs that are divided where they are not nearly transparent: what they draw, where they do, and who chooses them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.pipelines import SAME
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, inside, path_lengths, random_volume, smooth_volume

from texvol.comparison.wrong_functions import wrong_shaders
from texvol.opengl.compositor import Compositor
from texvol.provenance import parts
from texvol.pytest_plugin import plain_slabs
from texvol.rendering import default_rate
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Fine = Callable[[Scene], NDArray[np.float32]]

SIZE, HAZY_SIZE = (45, 38), (96, 96)
NOISE = random_volume(3, (28, 26, 24))
EXACT: dict[str, Any] = {"texture_format": "rgba32f", "early_termination": 0.0}
# Haze that no slab of is divided, and a shell in it of which all are.
HAZE = TransferFunction(
    np.array([0.1, 0.2, 0.6, 0.9]),
    np.array([(0.6, 0.2, 0.1), (0.6, 0.2, 0.1), (1, 1, 0.9), (1, 1, 0.9)]),
    np.array([0, 0.01, 0.012, 1.0]),
)


def sheared() -> Volume:
    values = random_volume(5, (28, 26, 24)).values
    return Volume(values, (1.0, 0.8, 1.2), (-3, 5, 7), np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]]))


def scenes() -> dict[str, Scene]:
    """Scenes in which some slabs are divided, some are not, and some are in between."""
    scene = Scene(NOISE, BONE, Camera.framing(NOISE), classification="post")
    normal, turned = (1.0, 0.4, -0.3), sheared()
    light = Lighting((Light("head"), Light("directional", (1.0, 2, 3))))
    return {
        "plain": scene,
        "perspective": replace(scene, camera=inside(NOISE, "perspective")),
        "sheared": Scene(turned, BONE, Camera.framing(turned, "perspective"), classification="post"),
        "masked": replace(scene, mask=Mask(random_volume(4, (28, 26, 24)).values)),
        "haze": replace(scene, transfer_function=HAZE),
        "lit": replace(scene, lighting=light, depth_cue=DepthCue(0.7)),
        "shadows": replace(scene, lighting=replace(light, shadows=True)),
        "cut open": replace(scene, clip=(ClipPlane(normal, float(np.dot(normal, NOISE.centre))),), caps=True),
    }


@pytest.fixture(scope="module")
def in_bricks() -> Any:
    with Renderer(texture_memory=0.03) as renderer:
        yield renderer


@pytest.fixture(scope="module")
def by_compute() -> Any:
    with Renderer(pipeline="compute") as renderer:
        yield renderer


def drawn(renderer: Renderer, scene: Scene, size: tuple[int, int] = SIZE, **how: Any) -> NDArray[np.float32]:
    return np.asarray(renderer.render(scene, size, **({"sampling_rate": 1.3, "adaptive": "on"} | how)))


@pytest.mark.parametrize("name", ["plain", "perspective", "sheared", "masked", "haze"])
@pytest.mark.parametrize(("rate", "size"), [(0.8, SIZE), (1.3, SIZE), (9.0, (17, 14))])
def test_they_are_those_of_plain_numpy(renderer: Renderer, name: str, rate: float, size: tuple[int, int]) -> None:
    scene = scenes()[name]
    thickness = scene.smallest_spacing / rate
    picture = drawn(renderer, scene, size, sampling_rate=rate, **EXACT)
    expected = plain_slabs.picture_of_slabs(scene, size, thickness, divides=True)
    undivided = drawn(renderer, scene, size, **EXACT | {"sampling_rate": rate, "adaptive": "off"})
    # A ray that misses the box by rounding is cut, or not: both are right.
    hits = path_lengths(scene.volume, scene.completed(size).camera, size) > 0
    off = np.abs(picture - expected)[hits].max()
    assert off < 2e-5 and np.abs(expected - undivided)[hits].max() > 50 * off


@pytest.mark.parametrize("name", list(scenes()))
def test_bricks_leaps_and_pipelines_change_nothing(
    renderer: Renderer, in_bricks: Renderer, by_compute: Renderer, name: str
) -> None:
    scene = scenes()[name]
    picture = drawn(renderer, scene)
    others = {
        "bricks": drawn(in_bricks, scene),
        "leaps": drawn(renderer, scene, skip_empty=False),
        "compute": drawn(by_compute, scene),
    }
    assert quick_stats(in_bricks)["bricks_total"] > 1
    assert np.abs(picture - drawn(renderer, scene, adaptive="off")).max() > 1e-3
    for words, other in others.items():
        assert np.abs(picture - other).max() <= SAME, words


def test_ten_slabs_at_a_time_are_the_same(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slab that is divided when a stack is full begins the next one anew."""
    scene, how = scenes()["plain"], {"sampling_rate": 3.7}
    assert np.abs(drawn(renderer, scene, **how) - _in_stacks_of(10, scene, **how)).max() <= SAME


def _in_stacks_of(count: int, scene: Scene, **how: Any) -> NDArray[np.float32]:
    texts = "const float MOST_AT_ONCE = 64.0;", f"const float MOST_AT_ONCE = {count}.0;"
    with wrong_shaders(("vec4 over(vec4 front, vec4 back)", "return over_right(front, back);")) as folder:
        file = folder / "compositing.glsl"
        assert texts[0] in file.read_text()
        file.write_text(file.read_text().replace(*texts))
        with Renderer(compositor=lambda context: Compositor(context, folder)) as renderer:
            return drawn(renderer, scene, **how)


@pytest.mark.parametrize(
    "mistake",
    [
        ("float share_of_thirds(vec4 medium, float length)", "return ceil(share_of_thirds_right(medium, length));"),
        (
            "vec4 over_thirds(vec4 color, Divided slab, float middle, vec4 front, vec4 behind)",
            "return over_thirds_right(color, slab, middle, behind, front);",
        ),
    ],
)
def test_mistakes_show(mistake: tuple[str, str]) -> None:
    scene = scenes()["plain"]
    expected = plain_slabs.picture_of_slabs(scene, SIZE, scene.smallest_spacing / 1.3, divides=True)
    hits = path_lengths(scene.volume, scene.completed(SIZE).camera, SIZE) > 0
    with wrong_shaders(mistake) as folder, Renderer(compositor=lambda context: Compositor(context, folder)) as renderer:
        assert np.abs(drawn(renderer, scene, **EXACT) - expected)[hits].max() > 2e-4


def test_the_error_is_of_order_two(renderer: Renderer) -> None:
    volume = smooth_volume(16)
    scene = Scene(volume, replace(FOG, extinctions=FOG.extinctions * 20), classification="post")
    fine = drawn(renderer, replace(scene, classification="integrated"), sampling_rate=64, adaptive="off", **EXACT)
    errors = [np.abs(drawn(renderer, scene, sampling_rate=rate, **EXACT) - fine).max() for rate in (1, 2, 4, 8)]
    undivided = np.abs(drawn(renderer, scene, sampling_rate=1, adaptive="off", **EXACT) - fine).max()
    assert errors[0] < undivided / 3
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert orders.min() > 1.5, orders


@pytest.mark.parametrize("graded", [False, True])
def test_the_estimate_bounds_the_error_of_a_given_thickness(hazy: Scene, graded: bool) -> None:
    """A medium that depends on the gradient is held against itself, whose finer slabs are not divided."""
    medium = hazy.transfer_function
    assert medium is not None
    if graded:
        medium = replace(medium, modulation=[(0.0, 0.7), (2.0, 1.0)])
    scene = replace(hazy, transfer_function=medium, classification="post")
    with Renderer() as renderer:
        picture = renderer.render(scene, (96, 96), sampling_rate=1, adaptive="on")
        estimate = renderer.stats["estimated_error"]
        fine = renderer.render(scene, (96, 96), sampling_rate=48)
    assert np.abs(picture - fine).max() <= estimate <= 20 * np.abs(picture - fine).max()


def test_a_given_rate_divides_nothing(renderer: Renderer) -> None:
    scene = scenes()["lit"]
    for how in ({"sampling_rate": 2.0}, {"slab_thickness": 0.3}):
        picture = np.asarray(renderer.render(scene, SIZE, **how))
        assert "adaptive" not in renderer.settings and quick_stats(renderer)["adaptive"] is False
        np.testing.assert_array_equal(picture, np.asarray(renderer.render(scene, SIZE, adaptive="off", **how)))


@pytest.mark.parametrize("divided", [True, False])
def test_a_maximum_error_divides_slabs_of_lit_scenes(own: Renderer, hazy: Scene, divided: bool, fine: Fine) -> None:
    scene = hazy if divided else replace(hazy, lighting=None)
    for adaptive in ("auto", "on", "off"):
        picture = own.render(scene, HAZY_SIZE, max_error=5e-3, adaptive=adaptive)
        settings = own.settings
        assert (settings.get("adaptive") == "on") == (adaptive == "on" or (divided and adaptive == "auto"))
        assert np.abs(picture - fine(scene)).max() <= 5e-3
        np.testing.assert_array_equal(picture, own.render(scene, HAZY_SIZE, **settings))


def test_halved_slabs_tell_the_error(own: Renderer, hazy: Scene, fine: Fine) -> None:
    """The same slabs are divided at each thickness: else a picture of thinner ones could be a worse one."""
    pictures = [own.render(hazy, HAZY_SIZE, sampling_rate=rate, adaptive="on") for rate in (2, 4, 8, 16)]
    for coarse, picture in pairwise(pictures):
        assert np.abs(picture - fine(hazy)).max() <= 0.75 * np.abs(coarse - picture).max()


@pytest.fixture(scope="module")
def hazy() -> Scene:
    """A lit head of haze around a shell, which needs thin slabs in the shell alone."""
    z, y, x = np.mgrid[-1:1:48j, -1:1:48j, -1:1:48j]
    radius = np.sqrt(x * x + y * y + z * z)
    shell = np.exp(-(((radius - 0.5) / 0.06) ** 2))
    values = np.where(radius < 0.95, 0.4, 0.0) + 0.6 * shell
    return Scene(Volume(values.astype(np.float32)), HAZE, lighting=Lighting())


@pytest.fixture(scope="module")
def own() -> Any:
    """A Renderer whose programs these tests share, and that has drawn nothing else."""
    with Renderer() as renderer:
        yield renderer


@pytest.fixture(scope="module")
def fine(own: Renderer) -> Fine:
    """The picture of a scene by thin slabs, drawn once."""
    drawn: dict[bool, NDArray[np.float32]] = {}

    def picture(scene: Scene) -> NDArray[np.float32]:
        is_lit = scene.lighting is not None
        if is_lit not in drawn:
            drawn[is_lit] = own.render(replace(scene, classification="integrated"), HAZY_SIZE, sampling_rate=64)
        return drawn[is_lit]

    return picture


def test_they_are_chosen_where_they_take_less_time(own: Renderer, hazy: Scene, fine: Fine) -> None:
    picture = own.render(hazy, HAZY_SIZE)
    divided, settings = own.stats, own.settings
    again = own.render(hazy, HAZY_SIZE, **settings)
    undivided_picture = own.render(hazy, HAZY_SIZE, adaptive="off")
    undivided = own.stats
    np.testing.assert_array_equal(again, picture)
    assert settings["adaptive"] == "on" and divided["adaptive"] is True
    assert undivided["adaptive"] is False and undivided["samples"] > 1.3 * divided["samples"]
    for each, stats in ((picture, divided), (undivided_picture, undivided)):
        assert np.abs(each - fine(hazy)).max() <= stats["estimated_error"] <= default_rate.LIMIT


def test_frames_share_the_choice(hazy: Scene) -> None:
    with Renderer() as renderer:
        first = renderer.render(hazy, (48, 48))
        settings = renderer.settings
        frames = [each.settings for each in renderer.frames([hazy] * 2, (48, 48))]
    assert first.shape == (48, 48, 4) and settings["adaptive"] == "on"
    assert all(each == settings for each in frames)


def test_what_is_not_divided_is_refused(renderer: Renderer) -> None:
    scene = scenes()["plain"]
    moved = Volume(NOISE.values, (1, 1, 1), (4, 2, 0))
    refused: dict[str, tuple[Scene, dict[str, Any]]] = {
        "adaptive must be one of auto, on, off, got 'yes'": (scene, {"adaptive": "yes"}),
        "got classification slab": (replace(scene, classification="slab"), {}),
        "got mode mip": (replace(scene, mode="mip"), {}),
        "several volumes": (replace(scene, added=(AddedVolume(moved, BONE),)), {}),
        "got labels": (replace(scene, volume=Volume(np.rint(NOISE.values), labels=True)), {}),
        "got slicing polygons": (scene, {"slicing": "polygons"}),
    }
    for words, (each, how) in refused.items():
        with pytest.raises(InputError, match=words):
            drawn(renderer, each, **how)


def test_a_header_says_so(tmp_path: Path, renderer: Renderer) -> None:
    renderer.render(scenes()["plain"], SIZE, sampling_rate=2, adaptive="on")
    assert parts.settings(renderer.settings) == renderer.settings
    with pytest.raises(InputError, match="adaptive must be one of"):
        parts.settings(renderer.settings | {"adaptive": "maybe"})
