"""Drivers whose weights have 8 bits: found by drawing, and not used where an error asked for is finer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from support.planted import EIGHT_BIT_WEIGHTS, planted
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, random_volume, smooth_volume

from texvol.opengl.filtering import bits_of
from texvol.ray_casting import raycast
from texvol.rendering.interpolation import settled_interpolation
from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import Settings
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import AccuracyWarning, InputError

SIZE = (40, 34)
SAME = 4e-6
FLOATS = {"texture_format": "rgba32f"}
STEEP = TransferFunction(np.array([0.45, 0.55]), np.array([(0.2, 0.4, 0.9), (1, 0.9, 0.8)]), np.array([0.0, 1]))
NOISE = random_volume(5, (10, 9, 11))
# Along a ray through columns the weights' errors are the same everywhere: no sample makes good for another.
COLUMNS = Volume(np.repeat(NOISE.values[:1], 6, axis=0), name="columns")
ALONG = Camera.orthographic(COLUMNS.centre - (0, 0, 20), COLUMNS.centre, (0, 1, 0), height=9.7)
LIGHT = Lighting((Light("head"),), ambient=0.2)
SHADOWS = Lighting((Light("directional", (1, 1, 1)),), ambient=0.2, shadows=True)


@pytest.fixture(scope="module")
def coarse() -> Iterator[Renderer]:
    """A renderer whose driver interpolates with weights of 8 bits."""
    with planted(*EIGHT_BIT_WEIGHTS) as renderer:
        yield renderer


def scenes() -> dict[str, Scene]:
    """A scene for each place in which textures are interpolated."""
    camera = Camera.framing(NOISE, "perspective")
    far = Volume(NOISE.values, (1, 1, 1), (4, 2, 0))
    mask = Mask(random_volume(6, NOISE.dimensions).values > 0.5)
    whole = {each: Scene(NOISE, BONE, camera, classification=each) for each in CLASSIFICATIONS}
    post = whole["post"]
    return whole | {
        "light": replace(post, lighting=LIGHT),
        "shadows": replace(post, lighting=SHADOWS),
        "mask": replace(post, mask=mask),
        "several": replace(post, added=(AddedVolume(far, BONE),)),
        "mip": replace(post, mode="mip"),
        "isosurface": replace(post, mode="isosurface", isovalue=0.5),
    }


@pytest.mark.parametrize("name", list(scenes()))
def test_the_shader_interpolates_as_an_exact_driver_does(renderer: Renderer, coarse: Renderer, name: str) -> None:
    scene = scenes()[name]
    exact = renderer.render(scene, SIZE, **FLOATS)
    scale = max(float(np.abs(exact[np.isfinite(exact)]).max()), 1.0)
    by_driver, by_shader = (coarse.render(scene, SIZE, interpolation=each, **FLOATS) for each in ("driver", "shader"))
    off = np.abs(by_driver - exact).max()
    assert off <= SAME * scale if name == "mip" else off > 10 * SAME * scale  # mip fetches the corners of cells
    assert np.abs(by_shader - exact).max() <= SAME * scale


@pytest.mark.parametrize("number", [0, 1])
def test_slices_after_wilson_are_interpolated_by_the_shader_too(
    renderer: Renderer, coarse: Renderer, number: int
) -> None:
    scene = Scene(NOISE, BONE, Camera.framing(NOISE, ("orthographic", "perspective")[number]), classification="slab")
    exact = renderer.render(scene, SIZE, slicing="wilson", **FLOATS)
    assert np.abs(coarse.render(scene, SIZE, slicing="wilson", interpolation="shader", **FLOATS) - exact).max() <= SAME
    assert np.abs(coarse.render(scene, SIZE, slicing="wilson", **FLOATS) - exact).max() > 10 * SAME


def test_weights_are_measured_by_drawing(renderer: Renderer, coarse: Renderer) -> None:
    with coarse._context:
        assert bits_of(coarse._compositor.weights_error) == 8 and coarse._compositor.has_coarse_weights
    assert bits_of(1 / 512) == bits_of(1 / 500) == 8 and bits_of(0.0) == 24
    if "llvmpipe" in renderer.renderer_name:
        with renderer._context:
            assert renderer._compositor.weights_error < 1e-6 and not renderer._compositor.has_coarse_weights


@pytest.mark.parametrize("classification, wanted", [("extinction", 2e-4), ("post", 5e-4), ("integrated", 5e-4)])
def test_an_error_below_a_thousandth_is_kept_with_weights_of_8_bits(
    coarse: Renderer, classification: Classification, wanted: float
) -> None:
    scene = Scene(COLUMNS, STEEP, ALONG, classification=classification)
    truth = raycast(scene, SIZE)

    def off(**how: str) -> float:
        return float(np.abs(coarse.render(scene, SIZE, max_error=wanted, **how) - truth).max())

    assert off() <= wanted
    assert quick_stats(coarse)["interpolation"] == "shader" and coarse.settings["interpolation"] == "shader"
    with pytest.warns(AccuracyWarning, match="not reached"):
        assert off(interpolation="driver") > wanted
    assert "interpolation" not in coarse.settings


def test_coarser_errors_are_asked_of_the_driver_where_its_weights_allow_it(coarse: Renderer) -> None:
    soft = Scene(smooth_volume(24), constant(0.01), Camera.framing(smooth_volume(24)), classification="post")
    hard = Scene(COLUMNS, STEEP, ALONG, classification="post")
    coarse.render(soft, SIZE, max_error=4e-3)
    assert quick_stats(coarse)["interpolation"] == "driver"
    picture = coarse.render(hard, SIZE, max_error=4e-3)
    assert quick_stats(coarse)["interpolation"] == "shader" and np.abs(picture - raycast(hard, SIZE)).max() <= 4e-3


def test_the_estimate_of_a_picture_counts_its_weights(renderer: Renderer, coarse: Renderer) -> None:
    scene = Scene(COLUMNS, STEEP, ALONG, classification="integrated")
    how = {"sampling_rate": 16, "early_termination": 0} | FLOATS
    picture = coarse.render(scene, SIZE, **how)
    off = np.abs(picture - renderer.render(scene, SIZE, **how)).max()
    assert off > 1e-3 and coarse.stats["estimated_error"] > off / 2 > renderer.stats["estimated_error"]


def test_exact_drivers_are_left_to_interpolate(renderer: Renderer) -> None:
    scene, settings = Scene(NOISE, BONE), Settings(1.0, "auto", "rgba32f", 0.0, skip_empty=True)
    complete = scene.completed(SIZE)
    assert settled_interpolation(complete, SIZE, settings, 1e-5, renderer._draw, None) == (settings, 1e-5)


def test_another_interpolation_is_refused(renderer: Renderer) -> None:
    with pytest.raises(InputError, match="interpolation must be auto, driver or shader, got 'cubic'"):
        renderer.render(Scene(NOISE, BONE), SIZE, interpolation="cubic")
