"""The oracle draws from coarse to fine: each pixel once, the last picture bit for bit that of `raycast`."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, FOG, random_volume, smooth_volume

from texvol.cli.command_line import main
from texvol.comparison.pictures import read_picture
from texvol.ray_casting import raycast, raycast_progressively
from texvol.ray_casting.common import rays
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.shapes import Mesh

SIZE = (29, 21)
TRIANGLE = Mesh(np.array([(0.0, 0, 4), (9, 0, 5), (0, 9, 3)]), [(0, 1, 2)])
CUT = (ClipPlane((1.0, 0.3, 0.2), 2.0),)
SCENES: dict[str, dict[str, Any]] = {
    "plain": {"classification": "post"},
    "slab": {"classification": "slab"},
    "lit": {"lighting": Lighting(specular=0.3)},
    "several": {"added": (AddedVolume(random_volume(2), FOG),)},
    "cut": {"clip": CUT, "caps": True},
    "mesh": {"geometry": (TRIANGLE,)},
    "xray": {"mode": "xray"},
    "isosurface": {"mode": "isosurface", "isovalue": 0.5},
}


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_last_picture_is_that_of_raycast(kind: str, projection: Any) -> None:
    volume = random_volume(1)
    scene = Scene(volume, BONE, Camera.framing(volume, projection, eye=(40, 50, 60)), **SCENES[kind])
    pictures = dict(raycast_progressively(scene, SIZE))
    assert list(pictures) == [8, 4, 2, 1]
    truth = raycast(scene, SIZE)
    np.testing.assert_array_equal(pictures[1], truth)
    for step in (8, 4, 2):
        rows, columns = (np.arange(count) // step * step for count in SIZE[::-1])
        np.testing.assert_array_equal(pictures[step], truth[np.ix_(rows, columns)])


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (3, 2), (8, 8), (17, 16)])
def test_each_pixel_is_computed_once(monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]) -> None:
    seen = []
    rays_of = rays.rays_of
    monkeypatch.setattr(
        sys.modules["texvol.ray_casting.raycast"],  # the name itself is that of the function
        "rays_of",
        lambda scene, eyes, directions: seen.append(eyes.reshape(-1, 3)) or rays_of(scene, eyes, directions),
    )
    scene = Scene(smooth_volume(6), FOG, classification="post")
    fractions: list[float] = []
    *_, (_, picture) = raycast_progressively(scene, size, tell=fractions.append)
    eyes = np.concatenate(seen)
    assert len(eyes) == size[0] * size[1] == len(np.unique(eyes.round(9), axis=0))
    assert picture.shape == (size[1], size[0], 4)
    assert fractions == sorted(fractions) and fractions[-1] == pytest.approx(1)


def test_refined_textures_too() -> None:
    scene = Scene(smooth_volume(6), BONE, classification="slab")
    *_, (_, picture) = raycast_progressively(scene, SIZE, texture_refinement=2)
    np.testing.assert_array_equal(picture, raycast(scene, SIZE, texture_refinement=2))


def test_rays_do_not_depend_on_how_many_there_are() -> None:
    random = np.random.default_rng(1)
    vectors, matrix = random.standard_normal((64, 50, 3)), random.standard_normal((3, 3))
    many = rays.transformed(vectors, matrix)
    np.testing.assert_allclose(many, vectors @ matrix.T, rtol=1e-13, atol=1e-14)
    np.testing.assert_array_equal(rays.transformed(vectors[3::7, 5:6], matrix), many[3::7, 5:6])


def test_the_command_writes_the_very_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", smooth_volume(6).values)
    written = []
    from texvol.util import writing

    write_files = writing.write_files
    monkeypatch.setattr(writing, "write_files", lambda files: written.append(dict(files)) or write_files(files))
    line = ["raycast", "v.npy", "--tf", "fog", "--size", "20x16"]
    assert main([*line, "-o", "a.exr"]) == 0 and len(written) == 1
    assert main([*line, "-o", "b.exr", "--progressive"]) == 0 and len(written) == 5
    a, b = (re.sub(rb"capDate.{35}", b"", Path(f"{name}.exr").read_bytes(), count=1, flags=re.DOTALL) for name in "ab")
    assert len(a) < Path("a.exr").stat().st_size and a == b
    assert "texvol:scene" in read_picture("b.exr").attributes


def test_an_interruption_keeps_the_last_whole_picture(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", random_volume(1, (40, 40, 40)).values)
    line = [sys.executable, "-m", "texvol", "raycast", "v.npy", "-o", "a.exr", "--size", "1000x1000", "--progressive"]
    process = subprocess.Popen([*line, "--light", "head"], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    try:
        end = time.monotonic() + 300
        while not (tmp_path / "a.exr").exists() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=120)[1]
    finally:
        process.kill()
    assert process.returncode == 130, said
    picture = read_picture(tmp_path / "a.exr")
    assert picture.pixels.shape[:2] == (1000, 1000) and "texvol:scene" not in picture.attributes
    np.testing.assert_array_equal(picture.pixels[0::2, 0::2], picture.pixels[1::2, 1::2])
    assert os.listdir(tmp_path) and sorted(each.name for each in tmp_path.iterdir()) == ["a.exr", "v.npy"]
