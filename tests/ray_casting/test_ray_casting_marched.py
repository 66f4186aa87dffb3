"""`raycast` against the naive marcher on random scenes: volumes, masks, labels, colours, light, cuts and depth cue."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from texvol.ray_casting import raycast
from texvol.ray_casting.marcher import march
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Graded
from texvol.scene.volume import Volume

SIZE = (4, 3)


def random_part(random: np.random.Generator, kind: str, masked: bool, graded: bool) -> AddedVolume:
    """A volume of a few samples on a sheared grid about (3, 3, 3)."""
    shape = tuple(random.integers(3, 6, 3))
    spacing, direction = random.uniform(0.8, 1.5, 3), np.eye(3) + random.uniform(-0.3, 0.3, (3, 3))
    origin = 3 + random.uniform(-1, 1, 3) - (direction * spacing) @ (np.array(shape[::-1]) - 1) / 2
    values: Any = random.uniform(0, 1, shape)
    further: dict[str, Any] = {}
    if kind == "labels":
        values, further = random.integers(0, 4, shape), {"labels": True}
    if kind == "colours":
        further = {"colors": random.uniform(0, 1, (*shape, 3))}
    points = np.sort(random.uniform(0, 3 if kind == "labels" else 1, 4))
    medium = TransferFunction(
        points, random.uniform(0, 1, (4, 3)), random.uniform(0, 0.5, 4),
        modulation=np.array([(0.1, 0.3), (0.6, 1.0)]) if graded else None,
        graded=(Graded([0.1, 0.9], random.uniform(0, 0.3, (2, 3)), [0.2, 0.4], 0.1, 0.5),) if graded else (),
    )  # fmt: skip
    mask = Mask(random.choice([0, 0.3, 1], shape)) if masked else None
    return AddedVolume(Volume(values, spacing, origin, direction, **further), medium, mask)


def random_scene(seed: int, classification: Any, **more: Any) -> Scene:
    random = np.random.default_rng(seed)
    kinds = random.permutation(["values", "values", "labels", "colours"])[: random.integers(1, 4)]
    graded = classification != "integrated" and seed % 3 == 0
    parts = [random_part(random, kind, random.random() < 0.6, graded) for kind in kinds]
    first, *added = parts
    eye = 3 + random.uniform(-1, 1, 3) * (4 if seed % 2 else 12)
    camera = (
        Camera.perspective(eye, (3, 3, 3), (0.1, 0.2, 1), fov=40)
        if seed % 2
        else Camera.orthographic(eye, (3, 3, 3), (0.1, 0.2, 1), height=5)
    )
    medium, mask = first.transfer_function, first.mask
    return Scene(
        first.volume,
        medium,
        camera,
        (0.1, 0.2, 0.3),
        classification,
        mask=mask,
        added=tuple(added),
        **more,
    )


def held(scene: Scene) -> None:
    """Steps are 1/1000 of a spacing: each of some 20 jumps is off by up to τ/2 of that, and so by 1e-4 at most."""
    expected = march(scene, SIZE)
    assert expected[..., 3].max() > 0.1 and np.ptp(expected[..., 3]) > 0.02
    np.testing.assert_allclose(raycast(scene, SIZE), expected, rtol=0, atol=3e-4)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
@pytest.mark.parametrize("seed", range(6))
def test_random_scenes_are_as_marched(seed: int, classification: Any) -> None:
    held(random_scene(seed, classification))


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
@pytest.mark.parametrize("seed", range(6, 12))
def test_random_scenes_in_light_are_as_marched(seed: int, classification: Any) -> None:
    lights = (Light("point", (3.0, 9.0, 11.0), (0.3, 0.8, 0.6)), Light("directional", (1, -2, 0.5)), Light())
    lighting = Lighting(lights, shininess=6.0, two_sided=seed % 2 == 0)
    scene = random_scene(
        seed, classification, lighting=lighting, depth_cue=DepthCue(0.7, (0.3, 0.1, 0.5)),
        clip=(ClipPlane((1, 2, 0.5), 8.0),), crop=((1.0, 5.0), (-9.0, 9.0), (0.5, np.inf)),
    )  # fmt: skip
    held(scene)
