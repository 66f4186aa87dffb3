"""Sets of lights: where they stand, and that nothing is burnt out in them."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.options import light as lit
from texvol.scene.camera import Camera
from texvol.scene.light_sets import LIGHT_SETS, light_set
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

ASIDE = Camera.perspective((30, -20, 13), (5, 5, 5), (0, 0.2, 1))


@pytest.mark.parametrize("name", LIGHT_SETS)
def test_a_white_surface_is_lit_to_white_at_most(name: str) -> None:
    """Over all normals that face the eye, for full and for no gradient confidence; in between it is linear."""
    lighting = light_set(name, ASIDE)
    view = -ASIDE.forward
    normals = np.random.default_rng(0).normal(size=(20_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals *= np.sign(normals @ view)[:, np.newaxis]
    surface, even = np.full((len(normals), 3), lighting.ambient), np.full(3, lighting.ambient)
    for light in lighting.lights:
        towards = np.array(light.vector)
        half = (towards + view) / np.linalg.norm(towards + view)
        facing = normals @ towards
        shine = np.where(facing > 0, np.maximum(normals @ half, 0) ** lighting.shininess, 0)
        surface += np.outer(lighting.diffuse * np.maximum(facing, 0) + lighting.specular * shine, light.color)
        even += lighting.diffuse * np.array(light.color)
    assert surface.max() <= 1 and even.max() <= 1
    # Nor is it dark: what faces the eye is half as bright as the paper.
    assert surface[(normals @ view).argmax()].min() > 0.45 and surface.max() > 0.75


def test_the_key_light_is_at_the_upper_left_and_the_rim_light_behind() -> None:
    key, fill, rim = light_set("three-point", ASIDE).lights
    for light, (right, up, to_eye) in ((key, (-1, 1, 1)), (fill, (1, 0, 1)), (rim, (1, 1, -1))):
        vector = np.array(light.vector)
        assert np.sign(right) * (vector @ ASIDE.right) >= 0.3 and -to_eye * (vector @ ASIDE.forward) > 0.3
        assert up == 0 or vector @ ASIDE.upward > 0.3
    assert max(fill.color) < 0.5 * max(key.color)


def test_lights_are_placed_by_the_camera_of_the_scene() -> None:
    volume = Volume(np.random.default_rng(0).random((4, 5, 6)))
    scene = Scene(volume, "ct-bone", ASIDE, lighting="studio")  # type: ignore[arg-type]
    assert scene.lighting == light_set("studio", ASIDE)
    framed = Scene(volume, "ct-bone", lighting="studio")  # type: ignore[arg-type]
    assert framed.lighting == light_set("studio", Camera.framing(volume))


def test_an_unknown_set_is_named() -> None:
    with pytest.raises(InputError, match="set must be one of three-point, studio, got 'studo'; did you mean 'studio'"):
        light_set("studo", ASIDE)


@pytest.mark.parametrize("name", LIGHT_SETS)
def test_a_set_is_a_light_of_the_command_line(name: str) -> None:
    assert lit.light(name) == name == lit.light_table({"kind": name})
    chosen = {"light": [name], "ambient": 0.05, "shadows": True}
    lighting = lit.lighting(chosen, ASIDE)
    assert lighting is not None and lighting.lights == light_set(name, ASIDE).lights
    assert (lighting.ambient, lighting.shadows, lighting.diffuse) == (0.05, True, light_set(name, ASIDE).diffuse)
    with pytest.raises(InputError, match=f"light: {name} must be the only light"):
        lit.lighting({"light": [name, "none"]})
