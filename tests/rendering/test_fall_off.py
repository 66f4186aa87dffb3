"""Point lights that fall off with distance, drawn and in the oracle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, constant, smooth_volume

from texvol.opengl.uniforms import light_switches
from texvol.options.light import light, light_table
from texvol.provenance import parts
from texvol.ray_casting import raycast
from texvol.ray_casting.marcher import march
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import Classification, Scene
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (16, 14)
NEAR = (9.0, -3.0, 12.0)


def scene_of(fall_off: float | None, classification: Classification = "post", **more: Any) -> Scene:
    """A scene in the light of one point."""
    volume = smooth_volume(12)
    lights = (Light("point", NEAR, (1.0, 0.8, 0.5), fall_off), Light("point", (-20.0, 5.0, 3.0)))
    lighting = Lighting(lights, specular=0.4, shininess=9)
    camera = Camera.framing(volume, "perspective")
    return Scene(volume, BONE, camera, classification=classification, lighting=lighting, **more)


@pytest.mark.parametrize("classification", ["slab", "post", "integrated"])
def test_pictures_go_to_the_oracle(renderer: Renderer, classification: Classification) -> None:
    scene = scene_of(6.0, classification)
    truth = raycast(scene, SIZE)
    errors = [np.abs(renderer.render(scene, SIZE, sampling_rate=rate) - truth).max() for rate in (2, 64)]
    assert errors[1] < errors[0] / 8 and errors[1] < 1.5e-3
    assert np.abs(raycast(scene_of(None, classification), SIZE) - truth).max() > 0.05


def test_with_shadows(renderer: Renderer) -> None:
    scene = scene_of(6.0)
    assert scene.lighting is not None
    scene = replace(scene, lighting=replace(scene.lighting, lights=scene.lighting.lights[:1], shadows=True))
    truth = raycast(scene, (9, 8), shadow_nodes=64)
    picture = renderer.render(scene, (9, 8), sampling_rate=64)
    assert np.abs(picture - truth).max() < 1.5e-3


def test_the_oracle_is_the_marcher() -> None:
    scene = scene_of(6.0)
    np.testing.assert_allclose(raycast(scene, (6, 5)), march(scene, (6, 5), 16_000), atol=2e-4)


def test_an_even_medium_of_one_ray_has_the_integral(renderer: Renderer) -> None:
    """Without a gradient it is lit evenly: ambient + diffuse k / (d + k), weighed with what is left of the ray."""
    volume, tau, k = Volume(np.full((8, 8, 8), 0.5, np.float32)), 0.3, 2.0
    lighting = Lighting((Light("point", (3.5, 3.5, 20.0), fall_off=k),), ambient=0.1, diffuse=0.8)
    camera = Camera.orthographic((3.5, 3.5, 30.0), (3.5, 3.5, 3.5), (0, 1, 0), 1e-3)
    scene = Scene(volume, constant(tau, (1.0, 1.0, 1.0)), camera, classification="post", lighting=lighting)
    depth = (np.arange(100_000) + 0.5) / 100_000 * 8  # from the face at z = 7.5
    shade = 0.1 + 0.8 * k / (12.5 + depth + k)
    expected = (shade * tau * np.exp(-tau * depth)).mean() * 8
    for picture in (raycast(scene, (1, 1)), renderer.render(scene, (1, 1), sampling_rate=32)):
        assert picture[0, 0, 0] == pytest.approx(expected, abs=2e-5)


def test_a_mesh_is_lit_as_well(renderer: Renderer) -> None:
    corners = np.array([(0.0, 0, 5), (11, 0, 5), (0, 11, 5)])
    scene = scene_of(4.0, geometry=(Mesh(corners, [(0, 1, 2)]),))
    assert np.abs(renderer.render(scene, SIZE, sampling_rate=64) - raycast(scene, SIZE)).max() < 1.5e-3


def test_lights_that_do_not_fall_off_cost_nothing() -> None:
    assert light_switches(scene_of(None).lighting)["FALL_OFF"] == 0
    assert light_switches(scene_of(3.0).lighting)["FALL_OFF"] == 1


def test_it_is_written_on_the_line_in_scene_files_and_in_headers() -> None:
    wanted = Light("point", (1.0, 2.0, 3.0), (0.5, 0.5, 0.5), 7.0)
    assert light("point:1,2,3:0.5:7") == wanted
    assert light("point:1,2,3::7") == replace(wanted, color=(1.0, 1.0, 1.0))
    table = {"kind": "point", "position": [1, 2, 3], "color": 0.5, "fall-off": 7}
    assert light_table(table) == wanted
    del table["color"]
    assert light_table(table) == replace(wanted, color=(1.0, 1.0, 1.0))
    content = {"kind": "point", "vector": [1, 2, 3], "color": [0.5, 0.5, 0.5], "fall_off": 7.0}
    assert parts.made(Light, content) == wanted


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("head", None, (1, 1, 1), 2.0), "only a point light falls off with distance, got kind head"),
        (
            ("directional", (1, 0, 0), (1, 1, 1), 2.0),
            "falls off with distance, got kind directional",
        ),
        (("point", (1, 0, 0), (1, 1, 1), 0.0), "fall-off must be a positive distance, got 0.0"),
        (("point", (1, 0, 0), (1, 1, 1), float("inf")), "fall-off must be a positive distance, got inf"),
        (("point", (1, 0, 0), (1, 1, 1), "far"), "fall-off must be a positive distance, got 'far'"),
    ],
)
def test_what_is_no_fall_off_is_refused(arguments: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Light(*arguments)
