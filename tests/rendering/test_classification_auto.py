"""Classification auto: slab where its measured error is small enough and it is no dearer, else post; always said."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, constant, random_volume, smooth_volume

from texvol.cli.command_line import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures.scene_metadata import ATTRIBUTE
from texvol.ray_casting import raycast
from texvol.rendering.classification import GOOD_ENOUGH
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures import slab_texture
from texvol.util.errors import InputError
from texvol.util.statistics import rms

SIZE = (64, 56)
STEP = TransferFunction([0, 0.499, 0.501, 1], [(1, 1, 1)] * 4, [0, 0, 20, 20])


def held(renderer: Renderer, scene: Scene, **accuracy: Any) -> tuple[str, float, float]:
    """The choice, and the rms errors of slab, as refined, and post against the medium of post."""
    renderer.render(scene, SIZE, **accuracy)
    assert renderer.chosen is not None and renderer.drawn_scene is not None
    chosen, refinement = renderer.chosen.classification, renderer.chosen.texture_refinement
    truth = raycast(replace(scene, classification="post"), SIZE)
    pictures = [
        renderer.render(replace(scene, classification="slab"), SIZE, texture_refinement=refinement, **accuracy),
        renderer.render(replace(scene, classification="post"), SIZE, **accuracy),
    ]
    return chosen, rms(pictures[0] - truth), rms(pictures[1] - truth)


@pytest.mark.parametrize("seed", range(12))
def test_the_choice_is_what_the_errors_say(renderer: Renderer, seed: int) -> None:
    """Away from the limit, whose two sides the estimate from a sixteenth of the pixels may confuse."""
    random = np.random.default_rng(seed)
    volume = random_volume(seed) if seed % 2 else smooth_volume(16)
    edge = random.uniform(0.2, 0.8)
    width = 10 ** random.uniform(-3, 0)
    points = np.array([0, edge, edge + width, 2.0]) * float(volume.values.max())
    medium = TransferFunction(points, [(1, 0.5, 0.2)] * 4, np.array([0, 0, 1, 1]) * 10 ** random.uniform(-2, 1))
    scene = Scene(volume, medium, Camera.framing(volume))
    chosen, of_slab, of_post = held(renderer, scene, sampling_rate=float(random.choice([0.5, 1, 4])))
    limit = max(GOOD_ENOUGH, 2 * of_post)
    if of_slab < limit / 1.5:
        assert chosen == "slab"
    elif of_slab > 1.5 * limit:
        assert chosen == "post"


def test_both_choices_occur_and_say_their_numbers(renderer: Renderer) -> None:
    fog = Scene(smooth_volume(16), FOG)
    renderer.render(fog, SIZE)
    assert renderer.chosen is not None and renderer.chosen.classification == "slab"
    stats = quick_stats(renderer)
    assert "rms is at most" in stats["classification_reason"] and stats["classification"] == "slab"
    step = Scene(random_volume(1), STEP)
    renderer.render(step, SIZE, sampling_rate=8)
    assert renderer.chosen.classification == "post" and "is more than twice its" in renderer.chosen.sentence
    assert renderer.drawn_scene is not None and renderer.drawn_scene.classification == "post"


def test_refinement_may_make_slab_good_enough(renderer: Renderer) -> None:
    """On the grid of the samples the error is 3.5 times what it may be, and on one four times as fine it is kept."""
    medium = TransferFunction([0.4, 0.6], [(0, 0, 0), (1, 1, 1)], [0, 0.1])
    scene = Scene(volume := smooth_volume(12), medium, Camera.framing(volume))
    for asked, expected in ((1, ("post", 1)), (None, ("slab", 4)), ("auto", ("slab", 4))):
        renderer.render(scene, SIZE, sampling_rate=4, texture_refinement=asked)
        assert renderer.chosen is not None
        assert (renderer.chosen.classification, renderer.settings["texture_refinement"]) == expected


def test_the_oracle_computes_post() -> None:
    scene = Scene(smooth_volume(8), BONE)
    np.testing.assert_array_equal(raycast(scene, (9, 8)), raycast(replace(scene, classification="post"), (9, 8)))


@pytest.mark.parametrize(
    "parts, accuracy, chosen, reason",
    [
        ({}, {"max_error": 0.05}, "post", "a maximum error is of its integral"),
        ({}, {"slicing": "wilson"}, "slab", "slicing wilson draws its texture"),
        ({}, {"texture_refinement": 2}, "slab", "its texels are to be refined"),
        ({"mode": "mip"}, {}, "post", "mode mip shows values"),
        ({"added": (AddedVolume(smooth_volume(8), FOG),)}, {}, "post", "of several volumes extinctions add up"),
    ],
)
def test_what_needs_no_measuring(renderer: Renderer, parts: Any, accuracy: Any, chosen: str, reason: str) -> None:
    renderer.render(Scene(smooth_volume(8), BONE, **parts), (24, 20), **accuracy)
    assert renderer.chosen is not None
    assert renderer.chosen.classification == chosen and renderer.chosen.reason.startswith(reason)


def test_what_is_explicit_is_obeyed(renderer: Renderer) -> None:
    for classification in ("slab", "extinction", "post", "integrated"):
        renderer.render(Scene(smooth_volume(8), BONE, classification=classification), (24, 20))  # type: ignore[arg-type]
        stats = quick_stats(renderer)
        assert renderer.chosen is None and stats["classification"] == classification
        assert "classification_reason" not in stats


def test_a_volume_whose_texels_take_long_is_drawn_by_post_at_once(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slab_texture, "bake", None)  # calling it would raise TypeError
    values = np.zeros((160, 160, 160), np.uint8)
    values[60:100, 60:100, 60:100] = 200
    renderer.render(Scene(Volume(values), constant(0.01)), (32, 32))
    assert (
        renderer.chosen is not None and renderer.chosen.sentence == "post, since texels of slab would take 0.1 s longer"
    )


def test_light_that_depends_on_the_view_is_dearer_for_an_orbit(renderer: Renderer) -> None:
    volume = smooth_volume(40)
    for light, expected in ((Light(), "post"), (Light("directional", (1.0, 2.0, 3.0)), "slab")):
        lighting = Lighting((light,), specular=0.0, two_sided=False)
        scene = Scene(volume, FOG, Camera.framing(volume), lighting=lighting)
        renderer.render(scene, SIZE)
        assert renderer.chosen is not None and renderer.chosen.classification == "slab"
        renderer.render(scene, SIZE, views=100)
        assert renderer.chosen.classification == expected


def test_a_choice_holds_while_only_the_camera_changes(renderer: Renderer) -> None:
    volume = smooth_volume(12)
    chosen = []
    for eye in ((90, 5, 3), (5, 80, 9), (-40, 30, 70)):
        renderer.render(Scene(volume, BONE, Camera.framing(volume, eye=eye)), SIZE)
        chosen.append(renderer.chosen)
    assert chosen[0] is chosen[1] is chosen[2]


def test_line_stats_and_header_say_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", smooth_volume(12).values)
    line = ["render", "v.npy", "--size", "32x24", "--tf", "fog"]
    assert main([*line, "-o", "a.exr", "--stats", "s.json"]) == 0
    said, _ = capsys.readouterr().out.splitlines()
    stats, header = json.loads(Path("s.json").read_text()), read_picture("a.exr").attributes
    assert said == f"classification {stats['classification_reason']}"
    assert header["texvol:classification"] == stats["classification_reason"]
    assert json.loads(header[ATTRIBUTE])["classification"] == stats["classification"] == said.split()[1].strip(",")
    assert main([*line, "-o", "b.exr", "--classification", "post"]) == 0
    assert "classification" not in capsys.readouterr().out
    assert "texvol:classification" not in read_picture("b.exr").attributes
    assert main(["raycast", *line[1:], "-o", "t.exr"]) == 0
    assert json.loads(read_picture("t.exr").attributes[ATTRIBUTE])["classification"] == "post"


def test_frames_of_an_orbit_have_one_classification(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", smooth_volume(12).values)
    assert main(["render", "v.npy", "--size", "32x24", "--orbit", "4", "-o", "%d.exr"]) == 0
    found = {json.loads(read_picture(f"{i}.exr").attributes[ATTRIBUTE])["classification"] for i in range(4)}
    assert len(found) == 1 and found <= {"slab", "post"}


def test_what_is_no_classification_is_refused() -> None:
    with pytest.raises(InputError, match="classification must be one of auto, slab, extinction, post, integrated"):
        Scene(smooth_volume(4), BONE, classification="best")  # type: ignore[arg-type]
