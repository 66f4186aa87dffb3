"""Gradients of 16 bits: what they do to a lit picture is estimated from samples, and no texture is made for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE

from texvol import AddedVolume, Camera, Light, Lighting, Renderer, Scene, TransferFunction, Volume
from texvol.rendering import gradient_rounding as rounding
from texvol.rendering import volume_cache
from texvol.rendering.error_control import largest_difference
from texvol.rendering.settings import Settings
from texvol.textures import value_texture

SIZE = (128, 128)
FOG = TransferFunction(np.array([0, 0.4, 0.9]), np.array([(0, 0, 1), (1, 0.5, 0), (1, 1, 1)]), np.array([0, 0.05, 0.3]))


SUN_AND_HEAD = Lighting((Light("directional", (1, 2, -1)), Light()), specular=0.8, shininess=90.0, fade=3.0)


def waves(side: int = 40) -> Volume:
    """Smooth waves of 8 bits."""
    z, y, x = np.indices((side, side, side)) / side
    values = 0.5 + 0.25 * (np.sin(9 * x + 2 * z) + np.cos(7 * y - 3 * z * z))
    return Volume(np.rint(255 * values.clip(0, 1)).astype(np.uint8), (1, 1.3, 0.8))


def of_bytes(function: TransferFunction) -> TransferFunction:
    return replace(function, values=function.values * 255)


SCENES = {
    "bone": lambda: Scene(waves(), of_bytes(BONE), lighting=Lighting(), classification="post"),
    "fog": lambda: Scene(waves(), of_bytes(FOG), lighting=Lighting(), classification="post"),
    "highlights": lambda: Scene(
        waves(),
        of_bytes(BONE),
        lighting=replace(SUN_AND_HEAD, two_sided=False),
        classification="post",
    ),
}


def drawn(renderer: Renderer, scene: Scene, texture_format: str) -> Any:
    """Picture in texels of a format, all else exact."""
    complete = scene.completed(SIZE)
    settings = Settings(scene.volume.smallest_spacing / 4, texture_format, "rgba32f", 0.0, True)
    with renderer._context:
        return renderer._draw(complete, SIZE, settings)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("coarser", [1, 64])
def test_the_estimate_bounds_what_rounding_does(name: str, coarser: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same with gradients of 10 bits, so that it is not something else that the estimate bounds."""
    monkeypatch.setattr(value_texture, "_NO_GRADIENT", 32767 // coarser)
    scene = SCENES[name]()
    texels = value_texture.ValueTexture.texels

    def coarse(texture: value_texture.ValueTexture, *box: Any) -> Any:
        """Texels of 16 bits that are multiples of the step, as the shader reads them."""
        found = texels(texture, *box)
        if found.dtype == np.uint16:
            found[..., :3] = (found[..., :3].astype(int) - 32767 // coarser) * coarser + 32767
        return found

    if coarser > 1:
        monkeypatch.setattr(value_texture.ValueTexture, "texels", coarse)
    with Renderer() as renderer:
        moved = largest_difference(drawn(renderer, scene, "auto"), drawn(renderer, scene, "reference"))
    estimate = rounding.gradient_rounding(scene.completed(SIZE))
    assert estimate is not None and moved > 2e-5 * coarser
    assert moved <= estimate <= 12 * moved


@pytest.mark.parametrize(
    "changed",
    [
        lambda scene: replace(scene, lighting=None),
        lambda scene: replace(scene, mode="mip"),
        lambda scene: replace(scene, lighting=SUN_AND_HEAD),  # two-sided
        lambda scene: replace(scene, transfer_function=replace(scene.transfer_function, premultiplied=True)),
        lambda scene: replace(scene, added=(AddedVolume(waves(8), of_bytes(FOG)),)),
    ],
)
def test_where_samples_do_not_tell_there_is_no_estimate(changed: Callable[[Scene], Scene]) -> None:
    assert rounding.gradient_rounding(changed(SCENES["fog"]()).completed(SIZE)) is None


def test_nothing_seen_is_not_rounded() -> None:
    scene = replace(SCENES["fog"](), volume=Volume(np.zeros((9, 9, 9), np.uint8)))
    assert rounding.gradient_rounding(scene.completed(SIZE)) == 0.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 9, 9), (2, 3, 50), (9, 9, 9)])
@pytest.mark.parametrize("densest", [0.5, 1e300, np.inf])
@pytest.mark.parametrize("inside", [False, True])
def test_the_estimate_is_a_number_in_odd_volumes(shape: tuple[int, int, int], densest: float, inside: bool) -> None:
    values = np.random.default_rng(2).integers(0, 256, shape).astype(np.uint8)
    medium = replace(of_bytes(FOG), extinctions=np.array([0, 0.05, densest]))
    scene = Scene(Volume(values, (1, 2, 1e-3)), medium, lighting=Lighting(), classification="post")
    if inside:
        eye = scene.volume.centre + 0.01
        scene = replace(scene, camera=Camera.perspective(eye, eye + (0.3, 0.2, 1.0), (0, 1, 0), fov=60))
    estimate = rounding.gradient_rounding(scene.completed(SIZE))
    assert estimate is not None and np.isfinite(estimate)


@pytest.mark.parametrize("asked", [{}, {"sampling_rate": 1.0}])
def test_a_report_makes_no_texture_again(asked: dict[str, float], monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    texels = value_texture.ValueTexture.texels

    def noted(texture: value_texture.ValueTexture, *box: Any) -> Any:
        made.append(texture.texel_format)
        return texels(texture, *box)

    monkeypatch.setattr(value_texture.ValueTexture, "texels", noted)
    scene = replace(SCENES["bone"](), classification="auto")
    with Renderer() as renderer:
        renderer.render(scene, SIZE, **asked)
        before = list(made)
        report = renderer.stats
        renderer.render(scene, SIZE, **asked)
    assert made == before and made[-1] == "rgba16"
    assert report["estimated_error"] > 0


def test_the_report_says_what_rounding_does(monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    for moved in (0.0, 2.0):
        monkeypatch.setattr("texvol.rendering.late_estimate.gradient_rounding", lambda scene, moved=moved: moved)
        with Renderer() as renderer:
            renderer.render(SCENES["bone"](), SIZE, sampling_rate=1.0)
            told.append(renderer.stats["estimated_error"])
    assert told[0] < 0.5 and told[1] == pytest.approx(np.hypot(told[0], 2.0))


def test_labels_have_an_estimate_however_long_they_take(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their texels do not depend on the slabs, so that no texture is made again for it."""
    labels = (waves(24).values // 64).astype(np.uint8)
    baked: list[object] = []
    bake = volume_cache.bake
    monkeypatch.setattr(volume_cache, "bake", lambda *given: baked.append(given[0]) or bake(*given))
    monkeypatch.setattr("texvol.rendering.default_rate.PATIENCE", 0.0)
    with Renderer() as renderer:
        renderer.render(Scene(Volume(labels, labels=True)), SIZE)
        assert renderer.drawn_scene is not None and renderer.drawn_scene.classification == "slab"
        before = len(baked)
        estimate = renderer.quick_estimate()
    assert estimate is not None and 0 < estimate < 0.05
    assert len(baked) == before
