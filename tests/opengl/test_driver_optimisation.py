"""The tests have llvmpipe compile shaders without optimising them; pictures are those of the optimised shaders."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from support.scenes import BONE, FOG, random_volume

from texvol import AddedVolume, Light, Lighting, Renderer, Scene
from texvol.scene.camera import Camera

SIZE = (40, 30)
FOLDERS = os.pathsep.join(map(str, (Path(__file__).parents[1], Path(__file__).parents[2])))


def scenes() -> list[Scene]:
    """One of each classification, with light, in perspective, of two volumes, and of values."""
    volume = random_volume(3, (20, 18, 16))
    lit = Lighting((Light(), Light("directional", (1, 2, 3))), shadows=True)
    near = Camera.framing(volume, "perspective")
    second = AddedVolume(random_volume(4, (10, 12, 9)), BONE)
    return [
        Scene(volume, FOG, classification="slab"),
        Scene(volume, BONE, near, classification="extinction"),
        Scene(volume, BONE, classification="integrated"),
        Scene(volume, BONE, near, classification="post", lighting=lit),
        Scene(volume, FOG, near, classification="post", added=(second,)),
        Scene(volume, mode="isosurface", isovalue=0.6, lighting=replace(lit, shadows=False), classification="slab"),
        Scene(volume, mode="average", classification="slab"),
    ]


def write_pictures(path: str) -> None:
    """Draw all scenes to a file of numpy's."""
    with Renderer() as renderer:
        np.savez(path, *(renderer.render(scene, SIZE) for scene in scenes()))


def test_pictures_are_those_of_optimised_shaders_to_the_bit(tmp_path: Path, renderer: Renderer) -> None:
    unoptimised = "nopt" in os.environ["GALLIVM_PERF"]
    assert unoptimised, "nothing is compared"
    optimised = {name: value for name, value in os.environ.items() if name != "GALLIVM_PERF"}
    code = "from opengl.test_driver_optimisation import write_pictures; write_pictures('pictures.npz')"
    line = [sys.executable, "-c", code]
    subprocess.run(
        line,
        cwd=tmp_path,
        env=optimised | {"PYTHONPATH": FOLDERS, "MESA_SHADER_CACHE_DISABLE": "true"},
        check=True,
        timeout=300,
    )
    with np.load(tmp_path / "pictures.npz") as pictures:
        for scene, picture in zip(scenes(), pictures.values(), strict=True):
            assert picture[..., 3].max() > 0.05
            assert np.array_equal(picture, renderer.render(scene, SIZE)), (scene.mode, scene.classification)
