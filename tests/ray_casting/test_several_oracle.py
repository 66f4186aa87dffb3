"""Masks, labels, colours and several volumes: the renderer comes to what the oracle says, by order 2 but for light."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, FOG, smooth_volume
from support.several import turned

from texvol import (
    AddedVolume,
    Camera,
    ClipPlane,
    DepthCue,
    Light,
    Lighting,
    Mask,
    Renderer,
    Scene,
    TransferFunction,
    Volume,
    raycast,
)
from texvol.scene.scene import CLASSIFICATIONS
from texvol.scene.transfer import label_function

SIZE = (40, 36)
RANDOM = np.random.default_rng(0)
FIRST = smooth_volume(20)
SECOND = AddedVolume(smooth_volume(12).moved(turned(40, shift=(4, 2, 3))), BONE)
LABELS = Volume(RANDOM.integers(0, 4, (7, 8, 9)).astype(np.uint8), (2, 2, 2), labels=True)
LABELS = LABELS.moved(turned(20, (1, 0, 1), (1, 1, 1)))
COLORS = Volume(RANDOM.random((6, 6, 6)).astype(np.float32), (3, 3, 3), colors=RANDOM.random((6, 6, 6, 3)))
WHITE = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.1]))
MASK = Mask(RANDOM.random(FIRST.values.shape))
LIT = Lighting((Light("head"), Light("directional", (1, -0.5, 1))), specular=0.3)
OTHERS = (SECOND, AddedVolume(LABELS, label_function(LABELS)), AddedVolume(COLORS, WHITE))
SCENES: dict[str, Scene] = {
    "two": Scene(FIRST, FOG, added=(SECOND,), classification="slab"),
    "masked": Scene(FIRST, BONE, mask=MASK, classification="slab"),
    "coloured": Scene(COLORS, WHITE, classification="slab"),
    "all kinds": Scene(FIRST, FOG, mask=MASK, added=OTHERS, classification="slab"),
    "cut": Scene(
        FIRST, FOG, mask=MASK, added=(SECOND,), clip=(ClipPlane((1, 1, 0), 18.0),), caps=True, classification="slab"
    ),
    "lit": Scene(FIRST, FOG, added=(SECOND,), lighting=LIT, depth_cue=DepthCue(0.6), classification="slab"),
    "all kinds, lit": Scene(FIRST, FOG, mask=MASK, added=(SECOND, OTHERS[2]), lighting=LIT, classification="slab"),
}


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as opened:
        yield opened


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_pictures_come_to_the_oracles(renderer: Renderer, name: str, classification: Any) -> None:
    scene = replace(SCENES[name], classification=classification)
    eye = scene.box.centre + scene.box.radius * np.array([1.5, -2.0, 1.0])
    scene = replace(scene, camera=Camera.framing(scene.box, "perspective", eye=eye))
    expected = raycast(scene, SIZE)
    exact: dict[str, Any] = {"texture_format": "rgba32f", "early_termination": 0.0}
    errors = [np.abs(renderer.render(scene, SIZE, sampling_rate=rate, **exact) - expected).max() for rate in (1, 4, 16)]
    # Light on one side of a surface, and opacities of slabs that are mixed in place of extinctions, are of order 1.
    first_order = (scene.lighting and classification in ("post", "integrated")) or (
        classification == "slab" and not scene.added
    )
    assert errors[0] < 0.1
    assert errors[2] < (5e-3 if first_order else 2e-4)
    assert errors[2] < errors[0] / (8 if first_order else 64)


def test_labels_are_the_oracles_at_any_rate(renderer: Renderer) -> None:
    for projection in ("orthographic", "perspective"):
        scene = Scene(LABELS, label_function(LABELS), Camera.framing(LABELS, projection), classification="slab")
        expected = raycast(scene, SIZE)
        for rate in (0.5, 2.0):
            # Places of faces are float32's, and pieces of 1e-5 of a slab are given to their neighbours.
            assert np.abs(renderer.render(scene, SIZE, sampling_rate=rate) - expected).max() < 5e-5
