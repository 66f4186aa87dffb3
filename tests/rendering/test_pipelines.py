"""The compute shader draws the picture of polygons and their fragments, and is taken where it is faster."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray
from support.odd_scenes.outcomes import differences, size_of
from support.pipelines import SAME, compared
from support.planted import slabs_per_blend
from support.quick_stats import quick_stats
from support.scenes import BONE, inside, random_volume

from texvol.cli.command_line import main
from texvol.comparison.wrong_functions import wrong_shaders
from texvol.opengl import compositor, pipelines
from texvol.opengl.compositor import Compositor
from texvol.opengl.pipelines import Region, faster, spans
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.slicing.slabs import SlabStacks
from texvol.util.errors import InputError

SIZE = (45, 38)  # no multiples of a group of invocations
NOISE = random_volume(3, (12, 10, 9))


@pytest.fixture(scope="module")
def by_compute() -> Iterator[Renderer]:
    with Renderer(pipeline="compute") as renderer:
        yield renderer


def both(renderer: Renderer, by_compute: Renderer, scene: Scene, **how: Any) -> float:
    """Largest difference of the pictures of both pipelines, relative to the size of their numbers."""
    one, other = (np.asarray(each.render(scene, SIZE, **how)) for each in (renderer, by_compute))
    assert one[np.isfinite(one)].any()
    assert (quick_stats(renderer)["pipeline"], quick_stats(by_compute)["pipeline"]) == ("fragment", "compute")
    return float(differences(other, one).max() / size_of(one))


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
@pytest.mark.parametrize("where", ["orthographic", "perspective", "inside"])
def test_rays_draw_the_picture_of_polygons(
    renderer: Renderer, by_compute: Renderer, classification: Classification, where: Any
) -> None:
    camera = inside(NOISE, "perspective") if where == "inside" else Camera.framing(NOISE, where)
    scene = Scene(NOISE, BONE, camera, classification=classification)
    assert both(renderer, by_compute, scene, sampling_rate=1.7) <= SAME


def special_scenes() -> dict[str, Scene]:
    """Scenes of all that is drawn beside a medium alone."""
    scene = Scene(NOISE, BONE, Camera.framing(NOISE), classification="post")
    normal = (1.0, 0.4, -0.3)
    middle, radius = NOISE.centre, NOISE.radius
    lit = Lighting((Light("head"), Light("directional", (1.0, 2, 3)), Light("point", tuple(middle + 30.0))))
    corners = middle + 0.4 * radius * np.array([(-1, -1, 0.2), (1, -1, 0), (0, 1, -0.2)])
    moved = Volume(NOISE.values, (1, 1, 1), (4, 2, 0))
    return {
        "light and cue": replace(scene, lighting=lit, depth_cue=DepthCue(0.7)),
        "shadows": replace(scene, lighting=replace(lit, shadows=True)),
        "cut open": replace(scene, clip=(ClipPlane(normal, float(np.dot(normal, middle))),), caps=True),
        "several": replace(scene, added=(AddedVolume(moved, BONE),)),
        "mesh": replace(scene, geometry=(Mesh(corners, [(0, 1, 2)], opacity=0.5),)),
        "xray": replace(scene, mode="xray"),
        "mip": replace(scene, mode="mip"),
        "isosurface": replace(scene, mode="isosurface", isovalue=0.5),
    }


@pytest.mark.parametrize("name", list(special_scenes()))
def test_whatever_polygons_draw_rays_do_as_well(renderer: Renderer, by_compute: Renderer, name: str) -> None:
    assert both(renderer, by_compute, special_scenes()[name], sampling_rate=1.3) <= SAME


def test_any_scene_is_the_same_whole_and_in_bricks() -> None:
    found = [(odd.words, how, apart) for odd, how, apart in compared(range(6)) if apart is not None]
    assert len(found) > 6 and {how for _, how, _ in found} == {"whole", "in bricks"}
    assert all(apart <= SAME for _, _, apart in found), found


@pytest.mark.parametrize("target_format, same", [("rgba32f", SAME), ("rgba16f", 2**-8), ("rgba8", 1 / 64)])
def test_stacks_of_few_slabs_are_the_same_in_every_target(
    renderer: Renderer, by_compute: Renderer, target_format: str, same: float
) -> None:
    scene = Scene(NOISE, BONE, Camera.framing(NOISE), classification="extinction")
    with slabs_per_blend(5):
        assert both(renderer, by_compute, scene, sampling_rate=2, target_format=target_format) <= same


def test_tiles_of_a_maximum_error_are_the_same(renderer: Renderer, by_compute: Renderer) -> None:
    scene = Scene(NOISE, BONE, Camera.framing(NOISE), classification="extinction")
    pictures = [np.asarray(each.render(scene, (96, 96), max_error=1e-3)) for each in (renderer, by_compute)]
    assert len(quick_stats(by_compute, samples=True)["tiles"]) > 1 and np.abs(pictures[1] - pictures[0]).max() <= SAME


def test_a_mistake_of_the_compute_shader_shows(renderer: Renderer) -> None:
    scene = Scene(NOISE, BONE, Camera.framing(NOISE), classification="post")
    wrong = ("vec4 blended(vec4 picture, vec4 color)", "return 0.5 * blended_right(picture, color);")
    with wrong_shaders(wrong) as folder:

        def planted(context: Any) -> Compositor:
            return Compositor(context, folder)

        with Renderer(pipeline="compute", compositor=planted) as wrong_renderer:
            off = wrong_renderer.render(scene, SIZE) - renderer.render(scene, SIZE)
    assert np.abs(off).max() > 0.1


def stacks_of(*ends: int) -> SlabStacks:
    first, last = np.array(ends[:-1]), np.array(ends[1:])
    return SlabStacks(np.zeros((first.size, 4, 2)), first, last, 0.0, 1.0)


def test_no_run_of_the_shader_has_more_turns_than_a_driver_allows() -> None:
    assert spans(stacks_of(-3, 2, 7, 9)) == [(-3, 9, 5)]
    assert spans(stacks_of(0, 5)) == [(0, 5, 5)]
    found = spans(stacks_of(*range(0, 100 * 2048, 2048), 99 * 2048 + 5))
    assert [found[0][0], found[-1][1]] == [0, 99 * 2048 + 5]
    assert all(end - begin <= 1 << 15 and (end - begin <= each or each == 2048) for begin, end, each in found)
    assert [each[0] for each in found[1:]] == [each[1] for each in found[:-1]]
    apart = SlabStacks(np.zeros((2, 4, 2)), np.array([0, 6]), np.array([4, 9]), 0.0, 1.0)  # a slab between is dropped
    assert spans(apart) == [(0, 4, 4), (6, 9, 3)]


@pytest.mark.parametrize("compute, taken", [(0.5e-3, "compute"), (0.9e-3, "fragment"), (2e-3, "fragment")])
def test_compute_is_taken_where_it_is_clearly_faster(
    compute: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, drawn = 0.0, []
    monkeypatch.setattr(pipelines.time, "perf_counter", lambda: now)

    def draw_by(pipeline: str, region: Region) -> None:
        nonlocal now
        drawn.append(region)
        compiles = 1.0 if len(drawn) <= 2 else 0.0
        now += compiles + {"fragment": 1e-3, "compute": compute}[pipeline] * region[2] * region[3] / 4096

    assert faster(draw_by, (10, 0, 300, 300)) == taken
    assert now < 2 + 0.04 and drawn[-1][2] < 300
    assert all(x >= 10 and x + width <= 310 and y + height <= 300 for x, y, width, height in drawn)


def test_the_probe_is_made_once_and_leaves_the_picture_alone(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene(NOISE, BONE, Camera.framing(NOISE), classification="post")
    asked: list[Region] = []

    def found(draw_by: Any, within: Region) -> str:
        asked.append(within)
        faster(draw_by, within)
        return "compute"

    monkeypatch.setattr(compositor, "is_software", lambda context: False)
    monkeypatch.setattr(compositor, "faster", found)
    with Renderer() as auto:
        pictures: list[NDArray[np.float32]] = [auto.render(scene, SIZE) for _ in range(2)]
        assert quick_stats(auto)["pipeline"] == "compute" and len(asked) == 1
    for picture in pictures:
        assert np.abs(picture - renderer.render(scene, SIZE)).max() <= SAME


def test_what_compute_does_not_draw_is_refused_in_a_line(
    by_compute: Renderer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = Scene(NOISE, BONE)
    with pytest.raises(InputError, match="pipeline compute does not draw slicing polygons"):
        by_compute.render(scene, SIZE, slicing="polygons")
    with pytest.raises(InputError, match="pipeline must be auto, fragment or compute, got 'cuda'"):
        Renderer(pipeline="cuda")
    np.save(tmp_path / "v.npy", NOISE.values)
    line = ["render", str(tmp_path / "v.npy"), "--size", "16", "-o", str(tmp_path / "a.exr"), "--pipeline", "compute"]
    line += ["--sampling-rate", "1"]
    assert main([*line, "--slicing", "wilson", "--classification", "slab"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main([*line, "--workers", "2"]) == 2
    assert "--pipeline does not go with --workers" in capsys.readouterr().err
    assert main(line) == 0


def test_a_driver_without_compute_shaders_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipelines, "_SINCE", 1000)

    def refused(*_: Any) -> Any:
        raise moderngl.Error("no such extension")

    monkeypatch.setattr(moderngl.Context, "compute_shader", refused)
    with pytest.raises(InputError, match=r"needs OpenGL 4.3 or ARB_compute_shader, got \d"):
        Renderer(pipeline="compute")
    monkeypatch.setattr(compositor, "is_software", lambda context: False)
    with Renderer() as auto:
        auto.render(Scene(NOISE, BONE), (8, 8))
        assert quick_stats(auto)["pipeline"] == "fragment"


def test_compute_shaders_are_found_by_their_extension_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipelines, "_SINCE", 1000)
    with Renderer(pipeline="compute") as renderer:
        assert renderer.render(Scene(NOISE, BONE), (8, 8)).any()
