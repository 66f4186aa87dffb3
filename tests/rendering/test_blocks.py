"""Volumes of blocks: the nearest sample's value fills its voxel, whatever its type; nothing is interpolated."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, random_volume

from texvol import InputError, load
from texvol.cli.command_line import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures.scene_metadata import scene_metadata
from texvol.provenance.stored_scene import stored_scene_of
from texvol.ray_casting import raycast
from texvol.ray_casting.marcher import march
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (24, 20)
TILTED = (40.0, 30.0, 25.0)


def in_blocks(volume: Volume, **changed: Any) -> Volume:
    values = changed.pop("values", volume.values)
    return Volume(values, volume.spacing, volume.origin, volume.direction, blocks=True, **changed)


def scene_of(volume: Volume, projection: Any = "orthographic", **more: Any) -> Scene:
    camera = Camera.framing(volume, projection, eye=volume.centre + np.array(TILTED))
    return Scene(volume, BONE, camera, **({"classification": "post"} | more))


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_pictures_are_the_oracle_s(renderer: Renderer, projection: Any, classification: Any) -> None:
    """Every ray is cut at the faces between blocks, and within one the medium is even: nothing is left but rounding."""
    scene = scene_of(in_blocks(random_volume(3)), projection, classification=classification)
    picture = renderer.render(scene, SIZE, sampling_rate=1)
    # Rays that pass within rounding of an edge see another block on a length of as much.
    assert np.abs(picture - raycast(scene, SIZE)).max() < 2e-5


def test_the_oracle_is_the_marcher() -> None:
    scene = scene_of(in_blocks(random_volume(4)))
    # Each of some 20 faces is misplaced by half of one of 40000 steps.
    np.testing.assert_allclose(raycast(scene, (5, 4)), march(scene, (5, 4), 40_000), atol=2e-3)


def test_it_is_the_volume_of_many_samples_for_one(renderer: Renderer) -> None:
    """Interpolated between n samples of equal value a block is flat, but for a fraction 1/n at its faces."""
    volume = random_volume(5, (5, 4, 3))
    many = 24
    fine = Volume(
        np.repeat(np.repeat(np.repeat(volume.values, many, 0), many, 1), many, 2),
        volume.spacing / many,
        volume.origin + volume.world_from_index @ np.full(3, 0.5 / many - 0.5),
        volume.direction,
    )
    camera = Camera.framing(volume, eye=volume.centre + np.array(TILTED))
    blocks = renderer.render(Scene(in_blocks(volume), BONE, camera), SIZE)
    interpolated = renderer.render(Scene(fine, BONE, camera, classification="post"), SIZE)
    plain = renderer.render(Scene(volume, BONE, camera, classification="post"), SIZE)
    off, far = (np.sqrt(np.square(blocks - each).mean()) for each in (interpolated, plain))
    assert off < far / 8


def test_one_block_in_closed_form(renderer: Renderer) -> None:
    """Along an axis each ray passes through one value of the first sample and one of the second."""
    volume = Volume(np.array([[[0.25]], [[0.75]]], np.float32), (1.0, 1.0, 2.0), blocks=True)
    medium = TransferFunction([0, 1], [(1, 1, 1), (1, 1, 1)], [0, 1])
    camera = Camera.orthographic((0, 0, 9), (0, 0, 0), (0, 1, 0), 0.5)
    picture = renderer.render(Scene(volume, medium, camera), (1, 1))
    assert picture[0, 0, 3] == pytest.approx(1 - np.exp(-2 * 0.25 - 2 * 0.75), abs=1e-6)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.float32, np.float64])
def test_every_type_missing_and_infinite_values(renderer: Renderer, dtype: Any) -> None:
    values = (200 * random_volume(6).values / random_volume(6).values.max()).astype(dtype)
    if values.dtype.kind == "f":
        values[2, 3, 3], values[4, 4, 4], values[1, 2, 3] = np.nan, np.inf, -np.inf
    volume = in_blocks(random_volume(6), values=values)
    medium = TransferFunction([0, 60, 61, 200], [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], [0, 0.1, 0.6, 0.2])
    scene = replace(scene_of(volume), transfer_function=medium)
    assert np.abs(renderer.render(scene, SIZE) - raycast(scene, SIZE)).max() < 2e-5


@pytest.mark.parametrize("parts", ["light", "cut", "added", "bricks"])
def test_with_everything_else(parts: str) -> None:
    volume = in_blocks(random_volume(7))
    box = volume.box_corner + volume.box_edges @ np.array([0.55, 0.9, 0.8])
    more: dict[str, Any] = {
        "light": {"lighting": Lighting()},
        "cut": {"crop": tuple(zip(volume.box_corner.tolist(), box.tolist(), strict=True))},
        "added": {"added": (AddedVolume(random_volume(8), BONE),)},
        "bricks": {},
    }[parts]
    scene = scene_of(volume, **more)
    with Renderer(texture_memory=0.002 if parts == "bricks" else None) as renderer:
        error = np.abs(renderer.render(scene, SIZE, sampling_rate=16) - raycast(scene, SIZE)).max()
    # Interpolated parts have an error of slabs, blocks have none.
    assert error < (0.01 if parts == "added" else 3e-5)


def test_the_command_line_and_headers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", random_volume(9).values)
    line = ["render", "v.npy", "--size", "24x20", "--stats", "s.json"]
    for name, more in (("a", ["--blocks"]), ("b", [])):
        assert main([*line, *more, "-o", f"{name}.exr"]) == 0
        assert ("blocks" in json.loads(Path("s.json").read_text())["modelled"]) == bool(more)
    pictures = {name: read_picture(f"{name}.exr") for name in "ab"}
    assert np.abs(pictures["a"].pixels - pictures["b"].pixels).max() > 0.05
    for name, picture in pictures.items():
        scene = stored_scene_of(picture.attributes, name=name).scene
        assert scene.volume.blocks == (name == "a")
    Path("v.toml").write_text('volume = "v.npy"\nblocks = true\nsize = "24x20"\n')
    assert main(["render", "--scene", "v.toml", "-o", "c.exr"]) == 0
    np.testing.assert_array_equal(read_picture("c.exr").pixels, pictures["a"].pixels)


def test_another_kind_of_samples_is_noticed() -> None:
    volume = random_volume(1)
    header = scene_metadata("v", scene_of(in_blocks(volume)))
    with pytest.raises(InputError, match="needs a volume of blocks, got values"):
        stored_scene_of(header, name="p", volume=volume)
    assert stored_scene_of(header, name="p", volume=in_blocks(volume)).scene.volume.blocks


def test_what_does_not_go_together_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="blocks need mode composite, got mode mip"):
        Scene(in_blocks(random_volume(1)), mode="mip")
    with pytest.raises(InputError, match="must have blocks or colors, got both"):
        Volume(np.zeros((2, 2, 2)), colors=np.zeros((2, 2, 2, 3)), blocks=True)
    np.save(tmp_path / "v.npy", np.zeros((2, 2, 2, 3), np.uint8))
    with pytest.raises(InputError, match="give --blocks or --color"):
        load(tmp_path / "v.npy", blocks=True, color=True)
