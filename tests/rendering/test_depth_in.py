"""Depth pictures of another renderer: rays end there, drawn and in the oracle; what is in front is unchanged."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, random_volume

from texvol import InputError
from texvol.cli.command_line import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import depth as depth_files
from texvol.formats.pictures.scene_metadata import ATTRIBUTE
from texvol.provenance.stored_scene import stored_scene_of
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume

SIZE = (26, 22)


def scene_of(projection: Any = "orthographic", **more: Any) -> Scene:
    volume = random_volume(1)
    camera = Camera.framing(volume, projection, eye=volume.centre + np.array((30.0, 20.0, 25.0)))
    return Scene(volume, BONE, camera, **({"classification": "post"} | more))


def depths_of(scene: Scene, seed: int = 0) -> np.ndarray:
    """Depths in front of, in and behind the box, another for each pixel."""
    random, camera = np.random.default_rng(seed), scene.completed(SIZE).camera
    middle = float(camera.forward @ (scene.volume.centre - np.array(camera.eye)))
    found = middle + scene.volume.radius * random.uniform(-1.2, 1.2, SIZE[::-1])
    found[::5, ::3] = np.inf
    return found


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize(
    "more",
    [
        {},
        {"classification": "slab"},
        {"classification": "integrated"},
        {"lighting": Lighting(), "background": (0.2, 0.3, 0.1)},
        {"added": (AddedVolume(random_volume(2), BONE),)},
        {"mode": "isosurface", "isovalue": 0.5},
        {"crop": ((2.0, 6.0), (0.0, 20.0), (0.0, 20.0)), "caps": True},
    ],
    ids=lambda more: " ".join(more) or "plain",
)
def test_pictures_go_to_the_oracle(renderer: Renderer, projection: Any, more: Any) -> None:
    scene = scene_of(projection, **more)
    limited = replace(scene, depth=DepthPicture(depths_of(scene)))
    truth = raycast(limited, SIZE)
    assert np.abs(truth - raycast(scene, SIZE)).max() > 0.1
    errors = [np.abs(renderer.render(limited, SIZE, sampling_rate=rate) - truth) for rate in (2, 32)]
    # One pixel may lie on an edge that rounding moves.
    assert np.sort(errors[1].max(axis=-1), axis=None)[-2] < 6e-3
    assert errors[1].mean() < 2e-4


def test_half_of_an_even_box_in_closed_form(renderer: Renderer) -> None:
    volume = Volume(np.ones((8, 8, 8), np.float32))
    camera = Camera.orthographic((3.5, 3.5, 20.0), (3.5, 3.5, 3.5), (0, 1, 0), 2.0)
    depths = np.array([[12.5 + length for length in (-1.0, 0.0, 3.0, 7.0, 9.0)]])  # the box begins at depth 12.5
    scene = Scene(volume, constant(0.4), camera, depth=DepthPicture(depths))
    expected = 1 - np.exp(-0.4 * np.array([0.0, 0.0, 3.0, 7.0, 8.0]))
    for picture in (renderer.render(scene, (5, 1)), raycast(scene, (5, 1))):
        np.testing.assert_allclose(picture[0, :, 3], expected, atol=2e-6)


@pytest.mark.parametrize("opacity", [1.0, 0.5])
@pytest.mark.parametrize("mode", ["composite", "isosurface"])
def test_meshes_behind_it_are_hidden(renderer: Renderer, opacity: float, mode: Any) -> None:
    corners = np.array([(-4.0, -4, 3), (14, -4, 4), (0, 14, 5)])
    mesh = Mesh(corners, [(0, 1, 2)], opacity=opacity)
    isovalue = 0.5 if mode == "isosurface" else None
    scene = scene_of(geometry=(mesh,), mode=mode, isovalue=isovalue)
    limited = replace(scene, depth=DepthPicture(depths_of(scene, 1)))
    off = np.abs(renderer.render(limited, SIZE, sampling_rate=32) - raycast(limited, SIZE))
    assert np.sort(off.max(axis=-1), axis=None)[-4] < 6e-3


def test_infinite_depths_change_nothing(renderer: Renderer) -> None:
    scene = scene_of()
    everywhere = replace(scene, depth=DepthPicture(np.full(SIZE[::-1], np.inf)))
    np.testing.assert_array_equal(raycast(everywhere, SIZE), raycast(scene, SIZE))
    np.testing.assert_allclose(renderer.render(everywhere, SIZE), renderer.render(scene, SIZE), atol=2e-6)
    assert "depth picture" in quick_stats(renderer)["modelled"] or renderer.render(everywhere, SIZE) is not None


def test_the_depth_of_its_own_isosurface_hides_what_is_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", random_volume(3).values)
    line = ["v.npy", "--size", "26x22", "--eye", "30,25,28"]
    assert main(["render", *line, "--mode", "isosurface", "--isovalue", "0.6", "--depth", "z.exr", "-o", "i.exr"]) == 0
    render = ["render", *line, "--classification", "post"]
    assert main([*render, "--depth-in", "z.exr", "-o", "a.exr", "--stats", "s.json"]) == 0
    assert main([*render, "-o", "b.exr"]) == 0
    assert main(["raycast", *line, "--classification", "post", "--depth-in", "z.exr", "-o", "t.exr"]) == 0
    pictures = {name: read_picture(f"{name}.exr") for name in "abit"}
    assert "depth picture" in json.loads(Path("s.json").read_text())["modelled"]
    assert (pictures["a"].pixels[..., 3] <= pictures["b"].pixels[..., 3] + 1e-5).all()
    assert np.abs(pictures["a"].pixels - pictures["t"].pixels).mean() < 0.02
    stored = stored_scene_of(pictures["a"].attributes, name="a.exr")
    np.testing.assert_array_equal(stored.scene.depth.array, depth_files.read("z.exr"))
    with Renderer() as renderer:
        again = renderer.render(stored.scene, SIZE, **stored.settings)
    np.testing.assert_array_equal(again, pictures["a"].pixels)
    depth_files.write("z.exr", np.zeros((22, 26)))
    with pytest.raises(InputError, match="depth_in: 'z.exr' is not found, or has changed"):
        stored_scene_of(pictures["a"].attributes, name="a.exr")
    assert json.loads(pictures["a"].attributes[ATTRIBUTE])["depth_in"]["name"] == "z.exr"


@pytest.mark.parametrize("names", [("Z",), ("R", "G", "B", "Z"), ("beauty.R", "depth.Z"), ("Y",)])
def test_depths_are_the_channel_z_or_the_only_one(tmp_path: Path, names: tuple[str, ...]) -> None:
    pixels = np.random.default_rng(1).random((5, 7, len(names))).astype(np.float32)
    spec = oiio.ImageSpec(7, 5, len(names), oiio.FLOAT)
    spec.channelnames = names
    out = oiio.ImageOutput.create("d.exr")
    assert out.open(str(tmp_path / "d.exr"), spec) and out.write_image(pixels) and out.close()
    np.testing.assert_array_equal(depth_files.read(tmp_path / "d.exr"), pixels[..., -1])


def refused(*line: str, capsys: Any) -> str:
    assert main(list(line)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    return str(said)


def test_what_does_not_fit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", random_volume(3).values)
    depth_files.write("z.exr", np.ones((22, 26)))
    depth_files.write("nan.exr", np.full((22, 26), np.nan))
    Path("broken.exr").write_bytes(Path("z.exr").read_bytes()[:300])
    Path("text.exr").write_text("no picture")
    line = ["render", "v.npy", "-o", "a.png"]
    assert "must have the size of the picture, 512x512, got 26x22" in refused(
        *line, "--depth-in", "z.exr", capsys=capsys
    )
    line += ["--size", "26x22"]
    assert "got NaN; infinity is a ray" in refused(*line, "--depth-in", "nan.exr", capsys=capsys)
    for name in ("broken.exr", "text.exr", "none.exr"):
        assert f"{name}: cannot be read" in refused(*line, "--depth-in", name, capsys=capsys)
    assert main([*line, "--size", "26x22", "-o", "c.exr"]) == 0
    capsys.readouterr()
    assert "depths must be a channel Z, got channels R, G, B, A" in refused(*line, "--depth-in", "c.exr", capsys=capsys)
    assert "depth needs mode composite or isosurface, got mode mip" in refused(
        *line, "--depth-in", "z.exr", "--mode", "mip", capsys=capsys
    )
    said = refused(
        "render", "v.npy", "--size", "26x22", "--orbit", "3", "-o", "%d.png", "--depth-in", "z.exr", capsys=capsys
    )
    assert "--depth-in is of a single view: leave --orbit out" in said
    assert "slicing wilson does not draw a depth picture" in refused(
        *line, "--depth-in", "z.exr", "--slicing", "wilson", capsys=capsys
    )
    with pytest.raises(InputError, match=r"depths must have shape \(height, width\)"):
        DepthPicture(np.zeros((2, 2, 2)))
