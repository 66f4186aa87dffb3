"""Several isosurfaces in one picture: composited in order, drawn and in the oracle, translucent and opaque."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, random_volume

from texvol import InputError
from texvol.cli.command_line import main
from texvol.comparison.pictures import read_picture
from texvol.provenance.stored_scene import stored_scene_of
from texvol.ray_casting import raycast, raycast_progressively
from texvol.ray_casting.projection import isosurface_depth
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume

SIZE = (34, 28)
THREE = (Isosurface(0.3, (1.0, 0.2, 0.1), 0.4), Isosurface(0.7, (0.2, 0.9, 0.3), 0.6), Isosurface(0.5, None, 0.3))


def ball(samples: int = 20) -> Volume:
    """Distance from the centre of the box, smooth but for its centre."""
    z, y, x = np.indices((samples,) * 3) - (samples - 1) / 2
    return Volume(np.sqrt(x**2 + y**2 + z**2).astype(np.float32) / samples * 2, (1.0, 1.2, 0.9))


def scene_of(volume: Volume, projection: Any = "orthographic", surfaces: Any = THREE, **more: Any) -> Scene:
    camera = Camera.framing(volume, projection, eye=volume.centre + np.array((30.0, 20.0, 25.0)))
    return Scene(volume, BONE, camera, mode="isosurface", isosurfaces=surfaces, **more)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("volume", [ball(), random_volume(1)], ids=["ball", "noise"])
@pytest.mark.parametrize("rate", [0.3, 1, 5])
def test_pictures_are_the_oracle_s(renderer: Renderer, projection: Any, volume: Volume, rate: float) -> None:
    """However thick the slabs are, but for rays that touch a surface within rounding."""
    scene = scene_of(volume, projection, background=(0.1, 0.2, 0.4), lighting=Lighting(specular=0.2))
    off = np.abs(renderer.render(scene, SIZE, sampling_rate=rate) - raycast(scene, SIZE)).max(axis=-1)
    assert np.sort(off, axis=None)[-3] < 2e-4 and np.median(off) < 1e-5


@pytest.mark.parametrize(
    "more",
    [
        {"depth_cue": DepthCue(0.7, (0.1, 0.2, 0.3))},
        {"lighting": Lighting((Light("point", (30.0, 5, 9), fall_off=20.0),), two_sided=True)},
        {"crop": ((2.0, 12.0), (3.0, 15.0), (0.0, 30.0))},
    ],
    ids=lambda more: next(iter(more)),
)
def test_with_everything_else(renderer: Renderer, more: Any) -> None:
    scene = scene_of(ball(), **more)
    off = np.abs(renderer.render(scene, SIZE) - raycast(scene, SIZE)).max(axis=-1)
    assert np.sort(off, axis=None)[-4] < 3e-4


def test_meshes_and_depth_pictures(renderer: Renderer) -> None:
    corners = np.array([(-4.0, -4, 9), (24, -4, 10), (0, 24, 11)])
    scene = scene_of(ball(), geometry=(Mesh(corners, [(0, 1, 2)], opacity=0.5),))
    camera = scene.completed(SIZE).camera
    middle = float(camera.forward @ (scene.volume.centre - np.array(camera.eye)))
    ramp = middle + np.linspace(-12, 12, SIZE[0]) * np.ones((SIZE[1], 1))
    for each in (scene, replace(scene, depth=DepthPicture(ramp))):
        off = np.abs(renderer.render(each, SIZE) - raycast(each, SIZE)).max(axis=-1)
        assert np.sort(off, axis=None)[-8] < 5e-4


def test_missing_and_infinite_values(renderer: Renderer) -> None:
    values = random_volume(2).values.copy()
    values[3, 3, 3], values[5, 4, 4] = np.nan, np.inf
    scene = scene_of(Volume(values))
    off = np.abs(renderer.render(scene, SIZE, sampling_rate=2) - raycast(scene, SIZE)).max(axis=-1)
    # Beside gaps an interval of 1e-5 of the box may be met or missed, and gradients have kinks.
    assert (off > 2e-3).mean() < 0.02


def test_layers_of_a_ramp_in_closed_form(renderer: Renderer) -> None:
    """Unlit but for ambient light, planes across the view are composited as their opacities say."""
    ramp = np.broadcast_to(np.arange(8.0, dtype=np.float32)[:, np.newaxis, np.newaxis], (8, 4, 4))
    surfaces = (Isosurface(2.2, (1, 0, 0), 0.5), Isosurface(5.6, (0, 1, 0), 0.25), Isosurface(4.1, (0, 0, 1), 0.2))
    lighting = Lighting((), ambient=1.0)
    for eye, order in (((1.5, 1.5, 30.0), (1, 2, 0)), ((1.5, 1.5, -30.0), (0, 2, 1))):
        camera = Camera.orthographic(eye, (1.5, 1.5, 3.5), (0, 1, 0), 2.0)
        scene = Scene(
            Volume(ramp),
            camera=camera,
            mode="isosurface",
            isosurfaces=surfaces,
            lighting=lighting,
            background=(1, 1, 1),
        )
        expected, left = np.zeros(4), 1.0
        for number in order:
            opacity = surfaces[number].opacity
            expected += left * opacity * np.array([*surfaces[number].color, 1.0])  # type: ignore[misc]
            left *= 1 - opacity
        expected[:3] += left
        for picture in (raycast(scene, (3, 2)), renderer.render(scene, (3, 2))):
            np.testing.assert_allclose(picture, np.broadcast_to(expected, (2, 3, 4)), atol=2e-6)
    assert renderer.depth() == pytest.approx(np.full((2, 3), 30.0 + 2.2), abs=1e-4)


def test_one_opaque_surface_is_the_isosurface(renderer: Renderer) -> None:
    volume = ball()
    one = scene_of(volume, surfaces=(Isosurface(0.6),))
    plain = replace(one, isosurfaces=(), isovalue=0.6)
    np.testing.assert_allclose(raycast(one, SIZE), raycast(plain, SIZE), atol=1e-9)
    np.testing.assert_array_equal(renderer.render(one, SIZE), renderer.render(plain, SIZE))
    behind = scene_of(volume, surfaces=(Isosurface(0.6), Isosurface(0.2, (1, 0, 0))))
    np.testing.assert_allclose(raycast(behind, SIZE), raycast(plain, SIZE), atol=1e-9)
    off = np.abs(renderer.render(behind, SIZE) - renderer.render(plain, SIZE)).max(axis=-1)
    assert np.sort(off, axis=None)[-4] < 1e-4


def test_bricks_skipping_and_depth(renderer: Renderer) -> None:
    scene = scene_of(ball(40))
    whole = renderer.render(scene, SIZE)
    depth = renderer.depth()
    truth = isosurface_depth(scene, SIZE)
    both = np.isfinite(depth) & np.isfinite(truth)
    assert (np.isfinite(depth) == np.isfinite(truth)).mean() > 0.99
    np.testing.assert_allclose(depth[both], truth[both], atol=2e-3)
    np.testing.assert_allclose(renderer.render(scene, SIZE, skip_empty=False), whole, atol=2e-4)
    assert renderer.stats["estimated_error"] < 1e-2
    with Renderer(texture_memory=0.1) as bricked:
        off = np.abs(bricked.render(scene, SIZE) - whole).max(axis=-1)
        assert quick_stats(bricked)["bricks_total"] > 1 and np.sort(off, axis=None)[-4] < 2e-4


def test_the_progressive_oracle_has_them() -> None:
    scene = scene_of(random_volume(1))
    *_, (_, picture) = raycast_progressively(scene, SIZE)
    np.testing.assert_array_equal(picture, raycast(scene, SIZE))


def test_the_command_line_scene_files_and_headers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", ball().values)
    line = ["render", "v.npy", "--mode", "isosurface", "--size", "34x28", "--annotate", "legend"]
    values = ["--isovalue", "0.3:1,0.2,0.1:0.4", "--isovalue", "0.7:0.5", "--isovalue", "0.5"]
    assert main([*line, *values, "-o", "a.exr"]) == 0
    assert main([*line, *values, "-o", "a.png", "--size", "200x160"]) == 0
    Path("s.toml").write_text(
        'volume = "v.npy"\nmode = "isosurface"\nsize = "34x28"\n'
        'isovalue = [{value = 0.3, color = [1, 0.2, 0.1], opacity = 0.4}, "0.7:0.5", 0.5]\n'
    )
    assert main(["render", "--scene", "s.toml", "--annotate", "legend", "-o", "b.exr"]) == 0
    picture = read_picture("a.exr")
    np.testing.assert_array_equal(read_picture("b.exr").pixels, picture.pixels)
    scene = stored_scene_of(picture.attributes, name="a.exr").scene
    assert scene.isosurfaces == (Isosurface(0.3, (1.0, 0.2, 0.1), 0.4), Isosurface(0.7, None, 0.5), Isosurface(0.5))
    assert main(["raycast", *line[1:], *values, "-o", "t.exr"]) == 0
    off = np.abs(read_picture("t.exr").pixels - picture.pixels).max(axis=-1)
    assert np.sort(off, axis=None)[-4] < 3e-4
    single = [*line, "--isovalue", "0.5", "--stats", "s.json", "-o", "c.exr"]
    assert main(single) == 0 and stored_scene_of(read_picture("c.exr").attributes, name="c").scene.isovalue == 0.5
    assert json.loads(Path("s.json").read_text())["modelled"][0] == "isosurface"


@pytest.mark.parametrize(
    "values, message",
    [
        (["0.5:1,2"], "must be a colour R,G,B"),
        (["0.5:0"], "opacity must be from above 0 to 1, got 0.0"),
        (["0.5:1.5"], "opacity must be from above 0 to 1, got 1.5"),
        (["0.5:1,0,0:0.5:2"], "must be V[:R,G,B][:A]"),
        (["x"], "must be a finite number"),
        (["inf"], "must be a finite number"),
        (["0.5:-1,0,0"], "color must be three numbers of at least 0"),
        (["0.5", "0.5:0.3"], "isosurfaces must have different values, got 0.5 twice"),
        ([f"0.{i}:0.5" for i in range(1, 10)], "isosurfaces must be at most 8, got 9"),
    ],
)
def test_what_is_no_isosurface_is_refused(
    values: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", ball().values)
    given = [part for value in values for part in ("--isovalue", value)]
    try:
        status = main(["render", "v.npy", "--mode", "isosurface", *given, "-o", "a.png"])
    except SystemExit as end:
        status = int(end.code or 0)
    assert status == 2 and message in capsys.readouterr().err


def test_a_scene_has_one_or_the_other() -> None:
    volume = ball()
    with pytest.raises(InputError, match="one or the other, got both"):
        Scene(volume, mode="isosurface", isovalue=0.5, isosurfaces=THREE)
    with pytest.raises(InputError, match="isovalue needs mode isosurface, got mode composite"):
        Scene(volume, isosurfaces=THREE)
