"""Whole pictures held against the oracle's, with a bound that comes from the scene: no picture of them is stored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.real_data import every_other_sample, real_volume
from support.scenes import BONE, FOG, inside, random_volume, smooth_volume

from texvol import Camera, Light, Lighting, Scene, load
from texvol.scene.demo import demo_scene, demo_volume
from texvol.scene.scene import CLASSIFICATIONS, Classification
from texvol.scene.transfer import preset

CheckPicture = Callable[..., None]
SIZE = (32, 32)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_the_demo(check_picture: CheckPicture, classification: Classification) -> None:
    scene = replace(demo_scene(), volume=demo_volume(48), classification=classification)
    check_picture(scene, f"demo-{classification}", size=SIZE, sampling_rate=2, oracle=True)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_noise_seen_from_inside(check_picture: CheckPicture, classification: Classification, projection: Any) -> None:
    volume = random_volume(8, (17, 13, 19))
    scene = Scene(volume, FOG, inside(volume, projection), classification=classification)
    check_picture(scene, f"inside-{projection}-{classification}", size=SIZE, sampling_rate=2, oracle=True)


@pytest.mark.parametrize("mode", ["xray", "average", "mip", "minip", "isosurface"])
def test_modes(check_picture: CheckPicture, mode: Any) -> None:
    volume = smooth_volume(24)
    scene = Scene(
        volume,
        None,
        Camera.framing(volume),
        mode=mode,
        isovalue=0.5 if mode == "isosurface" else None,
        classification="slab",
    )
    check_picture(scene, f"mode-{mode}", size=SIZE, sampling_rate=2, oracle=True)


@pytest.mark.parametrize(
    ("file", "presets"),
    [("engine/engine.nii.gz", "histogram"), ("lung/3DCT_lung.mha", "ct-bone"), ("flair/FLAIR.nrrd", "mr")],
)
def test_real_volumes(check_picture: CheckPicture, file: str, presets: str) -> None:
    volume = every_other_sample(load(real_volume(file)))
    camera = Camera.framing(volume, "perspective", eye=volume.centre + volume.radius * np.array([1.0, -2.5, 1.2]))
    scene = Scene(volume, preset(presets, volume), camera, classification="extinction")
    check_picture(scene, file.split("/")[0], size=SIZE, sampling_rate=2, oracle=True)


def test_light(check_picture: CheckPicture) -> None:
    volume = smooth_volume(32)
    lighting = Lighting((Light("head"),))
    scene = Scene(volume, BONE, Camera.framing(volume), classification="post", lighting=lighting)
    check_picture(scene, "lit", size=SIZE, sampling_rate=2, oracle=True)
