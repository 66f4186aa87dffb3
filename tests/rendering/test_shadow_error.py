"""Shadows between nodes: their error is a part of the estimate, and `--max-error` takes as many nodes as it needs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from support.scenes import random_volume

from texvol import Camera, InputError, Renderer, Scene, TransferFunction, Volume, raycast
from texvol.__main__ import main
from texvol.opengl import shadows as device
from texvol.rendering.shadow_error import ShadowError
from texvol.scene.lighting import Light, Lighting
from texvol.util.errors import AccuracyWarning, NoRoomError

SUN = Light("directional", (1.0, -2.0, 1.5))
SIZE = (24, 20)
GREY = TransferFunction([0.3, 1.0], [(0.8, 0.8, 0.8)] * 2, [0.0, 1.5])


def scene_in_shadow(classification: str = "post", *lights: Light) -> Scene:
    """Noise in its own shadow, in a box that is long, so that nodes along its short edges are few."""
    volume = Volume(random_volume(5, (24, 5, 5)).values, (1, 1.2, 0.9))
    lighting = Lighting(lights or (SUN,), two_sided=False, shadows=True)
    camera = Camera.framing(volume, "orthographic")
    return Scene(volume, GREY, camera, classification=classification, lighting=lighting)  # type: ignore[arg-type]


@pytest.mark.parametrize("classification", ["post", "extinction"])
def test_the_estimate_holds_the_error_of_the_nodes(renderer: Renderer, classification: str) -> None:
    scene = scene_in_shadow(classification)
    truth = raycast(scene, SIZE)
    errors = []
    for nodes in (32, 128):
        picture = renderer.render(scene, SIZE, sampling_rate=8, shadow_nodes=nodes)
        of_nodes = np.abs(raycast(scene, SIZE, shadow_nodes=nodes) - truth).max()
        assert renderer.stats["shadow_nodes"] == nodes
        assert of_nodes <= renderer.stats["estimated_shadow_error"] <= 10 * of_nodes
        assert np.abs(picture - truth).max() <= renderer.stats["estimated_error"]
        assert renderer.stats["estimated_shadow_error"] < renderer.stats["estimated_error"]
        errors.append(of_nodes)
    assert errors[1] <= errors[0] / 2


def test_the_estimate_of_the_last_line_holds_the_error_of_the_nodes(renderer: Renderer) -> None:
    scene = scene_in_shadow()
    picture = renderer.render(scene, SIZE, sampling_rate=8, shadow_nodes=16)
    off = float(np.abs(picture - raycast(scene, SIZE)).max())
    by_slabs = float(np.abs(picture - raycast(scene, SIZE, shadow_nodes=16)).max())
    assert renderer.quick_estimate() >= off > 5 * by_slabs  # type: ignore[operator]


def test_a_check_is_against_exact_shadows(renderer: Renderer) -> None:
    scene = scene_in_shadow()
    picture = renderer.render(scene, SIZE, sampling_rate=8, shadow_nodes=16, check="all")
    assert renderer.check is not None
    assert renderer.check.largest_error == pytest.approx(np.abs(picture - raycast(scene, SIZE)).max(), abs=1e-6)


def test_an_error_is_kept_by_more_nodes(renderer: Renderer) -> None:
    scene = scene_in_shadow()
    truth = raycast(scene, SIZE)
    assert np.abs(raycast(scene, SIZE, shadow_nodes=64) - truth).max() > 0.02
    picture = renderer.render(scene, SIZE, max_error=0.05, shadow_nodes="auto")
    assert np.array_equal(picture, renderer.render(scene, SIZE, max_error=0.05))
    assert renderer.settings["shadow_nodes"] == 128
    assert np.abs(picture - truth).max() <= renderer.stats["estimated_error"] <= 0.05
    assert 0.01 < renderer.stats["estimated_shadow_error"] <= 0.025
    assert np.array_equal(renderer.render(scene, SIZE, **renderer.settings), picture)


def test_an_error_that_no_nodes_keep_is_told(renderer: Renderer) -> None:
    told = "requested error of 0.0001 not reached: shadows at 32 nodes are off by"
    with pytest.warns(AccuracyWarning, match=told):
        renderer.render(scene_in_shadow(), SIZE, max_error=1e-4, shadow_nodes=32)
    assert renderer.stats["estimated_error"] > 1e-4
    assert renderer.settings["shadow_nodes"] == 32


def test_auto_without_an_error_takes_more_nodes_where_they_show(renderer: Renderer) -> None:
    scene = scene_in_shadow()
    renderer.render(scene, SIZE, sampling_rate=1, shadow_nodes="auto")
    assert renderer.settings["shadow_nodes"] > 64
    thin = replace(scene, transfer_function=replace(GREY, extinctions=GREY.extinctions / 100))
    renderer.render(thin, SIZE, sampling_rate=1, shadow_nodes="auto")
    assert renderer.settings["shadow_nodes"] == 64


def test_the_usual_nodes_are_64_and_nothing_else_is_cast_for_a_picture(renderer: Renderer) -> None:
    scene = scene_in_shadow()
    picture = renderer.render(scene, SIZE, sampling_rate=2)
    with patch.object(ShadowError, "at", side_effect=AssertionError("an error was estimated that nobody asked for")):
        assert np.array_equal(picture, renderer.render(scene, SIZE, sampling_rate=2, shadow_nodes=64))
    assert not np.array_equal(picture, renderer.render(scene, SIZE, sampling_rate=2, shadow_nodes=32))


def test_frames_have_the_nodes_of_the_first(renderer: Renderer) -> None:
    frames = renderer.frames([scene_in_shadow()] * 2, SIZE, count=2, sampling_rate=1, shadow_nodes="auto")
    nodes = [frame.settings["shadow_nodes"] for frame in frames]
    assert nodes[0] == nodes[1] > 64


def test_without_shadows_there_are_no_nodes(renderer: Renderer) -> None:
    scene = replace(scene_in_shadow(), lighting=Lighting((SUN,)))
    renderer.render(scene, SIZE, sampling_rate=1, shadow_nodes="auto")
    assert (renderer.stats["shadow_nodes"], renderer.stats["estimated_shadow_error"]) == (None, 0.0)


def test_nodes_are_drawn_some_layers_at_a_time(renderer: Renderer) -> None:
    scene = scene_in_shadow("post", SUN, Light("point", (9.0, 3.0, 30.0)))
    whole = renderer.render(scene, SIZE, sampling_rate=1)
    with patch.object(device, "_MOST_ROWS", 100), Renderer() as other:
        assert np.array_equal(other.render(scene, SIZE, sampling_rate=1), whole)


def test_more_nodes_than_textures_may_take_are_refused() -> None:
    needed = "shadows at 256 nodes need 3 MB of textures, got 1 MB: allow more by --texture-memory"
    with Renderer(texture_memory=1) as small, pytest.raises(NoRoomError, match=needed):
        small.render(scene_in_shadow(), SIZE, sampling_rate=1, shadow_nodes=256)


@pytest.mark.parametrize("nodes", [3, 513, True, 64.0, "many"])
def test_other_numbers_are_refused(renderer: Renderer, nodes: object) -> None:
    with pytest.raises(InputError, match="shadow nodes must be a number"):
        renderer.render(scene_in_shadow(), SIZE, shadow_nodes=nodes)  # type: ignore[arg-type]


def test_the_command_keeps_the_nodes_in_statistics_and_header(tmp_path: Path) -> None:
    np.save(tmp_path / "noise.npy", random_volume(5, (12, 5, 5)).values)
    picture, stats = tmp_path / "a.exr", tmp_path / "stats.json"
    words = [str(tmp_path / "noise.npy"), "--tf", "fog", "--light", "1,-2,1", "--shadows", "--size", "24x20"]
    how = ["--classification", "post", "--shadow-nodes", "32", "--stats", str(stats), "-o", str(picture)]
    assert main(["render", *words, *how]) == 0
    found = json.loads(stats.read_text())
    assert found["shadow_nodes"] == 32
    assert 0 < found["estimated_shadow_error"] < found["estimated_error"]
    assert b'"shadow_nodes":32' in picture.read_bytes().replace(b" ", b"")
    assert main(["render", *words, "--shadow-nodes", "3", "-o", str(picture)]) == 2
