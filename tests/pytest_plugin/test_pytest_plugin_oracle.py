"""oracle=True: right pictures keep the bound that is derived from their scene, and planted mistakes do not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache
from unittest.mock import patch

import numpy as np
import pytest
from support import planted
from support.picture_project import Project, said
from support.scenes import BONE, FOG, inside, random_volume, smooth_volume

from texvol import Lighting, Scene, raycast
from texvol.comparison.limits import TWO_DRIVERS
from texvol.comparison.measures import flip
from texvol.comparison.outcome import Outcome
from texvol.comparison.pictures import Picture
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import scene_metadata
from texvol.pytest_plugin import oracle, plain_slabs
from texvol.pytest_plugin.candidates import Maker, Request
from texvol.rendering.error_control import SAFETY
from texvol.rendering.renderer import Renderer
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import Light
from texvol.scene.transfer import TransferFunction
from texvol.util.errors import InputError

pytest_plugins = ("pytester", "support.picture_project")

SIZE = (40, 32)
CLASSIFICATIONS = ("slab", "extinction", "post", "integrated")
VOLUME = smooth_volume(20)
INSIDE = Scene(VOLUME, BONE, inside(VOLUME, "perspective"), background=(0.2, 0.5, 0.9), classification="slab")
SCENES = {
    "fog": Scene(VOLUME, FOG, classification="slab"),
    "bone": Scene(VOLUME, BONE, classification="slab"),
    "noise": Scene(random_volume(3), BONE, classification="slab"),
    "inside": INSIDE,
    "glow": Scene(
        VOLUME,
        TransferFunction(np.array([0, 1.0]), np.ones((2, 3)), np.array([0, 0.02]), emissive=True),
        classification="slab",
    ),
}


@pytest.fixture(scope="module")
def maker() -> Iterator[Maker]:
    made = Maker()
    yield made
    made.close()


@pytest.fixture(scope="module")
def of_swapped_axes() -> Iterator[Renderer]:
    with planted.planted(*planted.SWAPPED_AXES) as renderer:
        yield renderer


def examined(scene: Scene, maker: Maker, renderer: Renderer | None = None, **options: object) -> Outcome:
    request = Request("scene", 1, None, None, renderer, {"size": SIZE} | options)
    accuracy = {name: options[name] for name in oracle.ACCURACY if name in options}
    return oracle.examined(maker.candidate(scene, request), accuracy, maker, "scene")


def in_two(names: Iterable[str]) -> list[tuple[str, str]]:
    """Each name with two classifications, one before and one after interpolation, neighbours with different ones."""
    return [(name, each) for at, name in enumerate(names) for each in CLASSIFICATIONS[at % 2 :: 2]]


@cache
def truth_of(name: str, classification: str) -> np.ndarray:
    return raycast(replace(SCENES[name], classification=classification), SIZE)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
@pytest.mark.parametrize("name", SCENES)
def test_plain_slabs_have_the_error_of_the_renderer_s(name: str, classification: str, maker: Maker) -> None:
    scene, truth = replace(SCENES[name], classification=classification), truth_of(name, classification)
    thickness = scene.volume.smallest_spacing
    drawn = maker.renderer().render(scene, SIZE, slab_thickness=thickness, texture_format="rgba32f")
    plain, coarse = plain_slabs.pictures_of_slabs(scene, SIZE, thickness)
    error = np.abs(drawn - truth).max()
    # Of `integrated` a quarter of half a slab is summed here where the renderer integrates: 1/16 of its error.
    assert np.abs(plain - truth).max() == pytest.approx(error, rel=1 / 16, abs=1e-5)
    assert np.abs(coarse - plain).max() < error


@pytest.mark.parametrize(("name", "classification"), in_two(SCENES))
def test_a_right_picture_keeps_the_bound_of_its_scene(name: str, classification: str, maker: Maker) -> None:
    outcome = examined(replace(SCENES[name], classification=classification), maker)
    assert outcome.status == "same" and outcome.measures is not None
    # It is no wider than it says: the error of plain slabs, which is the renderer's but for rounding and
    # 8-bit weights, which are less than half of that in all these scenes.
    assert outcome.limits.max_abs < 1.5 * SAFETY * outcome.measures.max_error + 1e-5
    assert "plain slabs" in outcome.limits.source


def test_the_bound_counts_the_nodes_of_shadows(maker: Maker) -> None:
    """At few nodes and thin slabs it is their error: without it a right picture would be beyond."""
    sun = Lighting((Light("directional", (1.0, -2.0, 1.5)),), two_sided=False, shadows=True)
    scene = Scene(random_volume(3), BONE, classification="post", lighting=sun)
    outcome = examined(scene, maker, sampling_rate=8, shadow_nodes=16)
    assert outcome.status == "same" and outcome.measures is not None
    with patch.object(oracle, "error_of_nodes", return_value=0.0):
        assert examined(scene, maker, sampling_rate=8, shadow_nodes=16).status == "different"


MISTAKES = {
    "linear opacity": planted.LINEAR_OPACITY,
    "half-texel shift": planted.HALF_TEXEL_SHIFT,
    "swapped axes": planted.SWAPPED_AXES,
    "unclipped end slabs": planted.UNCLIPPED_END_SLABS,
    "missing cosine": planted.MISSING_COSINE,
    "back's alpha in over": planted.BACKS_ALPHA_IN_REGISTERS,
}
# With a wanted error each mistake once: the renderer halves the slabs until it gives up, which takes long.
WANTED = {
    ("linear opacity", "post"),
    ("half-texel shift", "integrated"),
    ("swapped axes", "slab"),
    ("unclipped end slabs", "extinction"),
    ("missing cosine", "post"),
    ("back's alpha in over", "extinction"),
}


@pytest.mark.filterwarnings("ignore:an error of")  # which mistakes keep a renderer from reaching
@pytest.mark.parametrize(("mistake", "classification"), in_two(MISTAKES))
def test_a_planted_mistake_is_over_the_bound(mistake: str, classification: str, maker: Maker) -> None:
    scene = replace(INSIDE, classification=classification)
    with planted.planted(*MISTAKES[mistake]) as renderer:
        outcomes = [examined(scene, maker, renderer)]
        if (mistake, classification) in WANTED:
            outcomes.append(examined(scene, maker, renderer, max_error=0.01))
    assert all(outcome.status == "different" and outcome.violations for outcome in outcomes)


def test_each_mistake_is_planted_once_where_an_error_is_wanted() -> None:
    assert {mistake for mistake, _ in WANTED} == MISTAKES.keys()
    assert {*in_two(MISTAKES)} > WANTED


def test_the_renderer_s_own_estimate_would_have_let_linear_opacity_pass(maker: Maker) -> None:
    """Why the bound is not taken from there: the mistake is in the estimate as well."""
    with planted.planted(*planted.LINEAR_OPACITY) as renderer:
        outcome = examined(replace(SCENES["bone"], classification="post"), maker, renderer)
        assert outcome.status == "different" and outcome.measures is not None
        assert outcome.measures.max_error < renderer.stats["estimated_error"]


@pytest.mark.parametrize(
    "scene",
    [
        Scene(VOLUME, BONE, lighting=Lighting(), classification="slab"),
        Scene(VOLUME, BONE, lighting=Lighting(), classification="post"),
        Scene(VOLUME, mode="mip", classification="slab"),
        Scene(VOLUME, mode="xray", classification="slab"),
        Scene(VOLUME, mode="average", classification="slab"),
        Scene(VOLUME, mode="isosurface", isovalue=0.6, classification="slab"),
        Scene(VOLUME, BONE, clip=(ClipPlane((1, 0.3, 0), 3.0),), classification="slab"),
        Scene(VOLUME, BONE, classification="post", crop=((1, 5), (-np.inf, np.inf), (2, 7))),
    ],
    ids=lambda scene: f"{scene.mode} {scene.classification} {'cut' if scene.clip or scene.crop else ''}",
)
def test_what_plain_slabs_do_not_model_is_bounded_by_finer_ones(
    scene: Scene, maker: Maker, of_swapped_axes: Renderer
) -> None:
    assert examined(scene, maker).status == "same"
    assert examined(scene, maker, of_swapped_axes).status == "different"


@pytest.mark.parametrize("classification", ["slab", "post"])
def test_light_hides_no_linear_opacity(classification: str, maker: Maker) -> None:
    scene = Scene(VOLUME, BONE, lighting=Lighting(), classification=classification)
    with planted.planted(*planted.LINEAR_OPACITY) as renderer:
        outcome = examined(scene, maker, renderer)
    assert outcome.status == "different" and any(each.startswith("opacity is") for each in outcome.violations)


def check_array(pixels: np.ndarray, maker: Maker, scene: Scene | None = SCENES["bone"], **options: object) -> Outcome:
    candidate = maker.candidate(pixels, Request("array", 1, None, scene, None, options, oracle.ACCURACY))
    return oracle.examined(candidate, options, maker, "array")


def test_an_array_is_held_to_the_scene_that_it_is_said_to_show(maker: Maker) -> None:
    drawn = maker.renderer().render(SCENES["bone"], SIZE)
    assert check_array(drawn, maker).status == "same"
    assert check_array(raycast(SCENES["bone"], SIZE), maker).status == "same"
    assert check_array(drawn, maker, slab_thickness=0.25).status == "different"
    assert check_array(drawn, maker, max_error=1e-4).status == "different"
    off = drawn.copy()
    off[5, 5, 0] += 0.2
    assert check_array(off, maker).status == "different"
    assert check_array(off, maker, max_error=0.25).status == "same"
    assert check_array(off[:-1], maker).status == "different"
    with pytest.raises(InputError, match="needs a scene"):
        check_array(drawn, maker, None)
    with pytest.raises(InputError, match="max_error must be positive"):
        check_array(drawn, maker, max_error=-1)


def test_a_picture_s_header_may_say_the_scene(maker: Maker, project: Project) -> None:
    np.save("bone.npy", VOLUME.values)
    from texvol import load

    scene = Scene(load("bone.npy"), BONE, classification="slab")
    drawn = maker.renderer().render(scene, SIZE, sampling_rate=2)
    attributes = scene_metadata("bone.npy", scene, settings=maker.renderer().settings)
    image.write("bone.exr", drawn, attributes)
    drawn[4, 4] += np.float32(0.05)
    image.write("wrong.exr", drawn, attributes)
    project.write(
        test_it="""
@pytest.mark.parametrize("name", ["bone", "wrong"])
def test_it(check_picture, name):
    check_picture(f"{name}.exr", name, oracle=True)
"""
    )
    result = project.run("--texvol-report", "report")
    result.assert_outcomes(passed=1, failed=1)
    report = project.report()["by_name"]
    assert (report["bone"]["status"], report["wrong"]["status"]) == ("same", "different")
    assert "the oracle" in said(result) and "texvol-update" not in said(result)
    # There is no reference that the candidate could become.
    assert report["wrong"]["not_accepted"] == "it is held against the oracle, and has no reference"
    assert 'name="accept"' not in (project.folder / "report/index.html").read_text("utf-8")
    assert not project.references.exists()


def test_not_a_number_is_broken(maker: Maker) -> None:
    drawn = maker.renderer().render(SCENES["fog"], SIZE)
    drawn[3, 3, 3] = np.nan
    assert check_array(drawn, maker, SCENES["fog"], max_error=10.0).status == "broken"


DEMO = """
from dataclasses import replace
from texvol.scene import demo

def demo_scene():
    return replace(demo.demo_scene(), volume=demo.demo_volume(32))
"""


def test_scenes_are_drawn_stored_and_explained(project: Project) -> None:
    project.write(
        test_it=f"""{DEMO}
import os

def test_stored(check_picture):
    rate = float(os.environ.get("RATE", 1))
    outcome = check_picture(demo_scene(), "demo", size=(32, 24), sampling_rate=rate)
    assert outcome.candidate.pixels.shape == (24, 32, 4)

def test_oracle(check_picture):
    check_picture(demo_scene(), "truth", size=(32, 24), oracle=True, repeat=2)
"""
    )
    assert project.run("--texvol-update").ret == 0
    stored = project.stored("demo")
    assert "texvol:scene" in stored.attributes and stored.attributes["texvol:renderer"]
    assert [path.name for path in project.references.iterdir()] == ["demo.exr"]
    result = project.run("--texvol-report", "report", "--texvol-self-test")
    assert result.ret == 0 and f"drawn by {stored.attributes['texvol:renderer']}" in said(result)
    assert "half a texel" in (project.folder / "report/index.html").read_text("utf-8").lower()
    # Four times thinner slabs are nearer to the integral: a difference, and for the better.
    with patch.dict("os.environ", RATE="4"):
        result = project.run()
    assert result.ret == 1 and "better" in said(result)


def test_a_bound_that_lets_plain_errors_pass_warns(project: Project) -> None:
    project.write(
        test_it=f"""{DEMO}
def test_coarse(check_picture):
    outcome = check_picture(demo_scene(), "coarse", size=(32, 24), sampling_rate=0.3, oracle=True)
    assert outcome.measures.max_error > 0.2

def test_fine(check_picture):
    check_picture(demo_scene(), "fine", size=(32, 24), sampling_rate=6, oracle=True)

def test_told(check_picture):
    check_picture(np.zeros((24, 32, 4)), "told", scene=demo_scene(), max_error=2.0, oracle=True)
"""
    )
    result = project.run("--texvol-report", "report")
    result.assert_outcomes(passed=3, warnings=2)
    text = said(result)
    assert "AccuracyWarning: the bound of picture 'coarse' is 0." in text and "larger sampling_rate" in text
    assert "the bound of picture 'told' is 2" in text and "'fine'" not in text
    # The warning is at the test's own line.
    assert "test_it.py:" in text.partition("AccuracyWarning: the bound of picture 'coarse'")[0].splitlines()[-1]
    index = (project.folder / "report/index.html").read_text("utf-8")
    assert "visible errors" in index


@pytest.mark.parametrize("ground", [0.0, 0.05, 0.2, 0.5, 1.0])
def test_an_error_of_a_loose_bound_is_seen_on_every_ground(ground: float) -> None:
    even = np.full((32, 32, 4), ground, np.float32)
    off = even + np.float32(oracle.LOOSE if ground < 1 else -oracle.LOOSE)
    assert flip(off, even) > 2 * TWO_DRIVERS.flip


def test_a_header_that_contradicts_the_scene_of_the_test_is_said(maker: Maker) -> None:
    drawn = maker.renderer().render(SCENES["bone"], SIZE, sampling_rate=4)
    header = scene_metadata("", replace(SCENES["bone"], background=(1.0, 0.0, 0.0)), checksum=True)
    picture = Picture.of_array(drawn, "picture", header)
    request = Request("scene", 1, None, SCENES["bone"], None, {"max_error": 0.05}, oracle.ACCURACY)
    outcome = oracle.examined(maker.candidate(picture, request), {"max_error": 0.05}, maker, "scene")
    assert outcome.scene_words == ("the scenes differ in background: (1, 0, 0) instead of (0, 0, 0)",)


def test_options_reach_what_they_are_for(project: Project) -> None:
    project.limits("[tabled]\nrms = 1e-5\n")
    project.write(
        test_it=f"""{DEMO}
def test_function(check_picture):
    outcome = check_picture(demo_scene, "function", size=(16, 12), sampling_rate=4, oracle=True)
    assert "0.007812" in outcome.limits.source  # 1 / 32 / 4

def test_array(check_picture):
    check_picture(waves(), "array", oracle=True, scene=demo_scene(), max_error=2)

def test_stored_array(check_picture):
    check_picture(waves(), "stored", max_error=2)

def test_tabled(check_picture):
    check_picture(demo_scene(), "tabled", oracle=True)
"""
    )
    result = project.run()
    result.assert_outcomes(passed=2, failed=2)
    assert "max_error: options of drawing need a scene" in said(result) and "[tabled] has no effect" in said(result)


def test_without_numba_the_error_says_what_to_install(project: Project) -> None:
    test = "def test_it(check_picture):\n    check_picture(demo_scene(), 'x', size=(8, 8), oracle=True)\n"
    project.write(conftest="import sys\nsys.modules['numba'] = None\n", test_it=DEMO + test)
    result = project.run_apart()
    assert result.ret == 1 and "[oracle]" in said(result)


def test_numbers_in_eight_bits_are_refused(maker: Maker) -> None:
    scene = Scene(VOLUME, mode="mip", classification="slab")
    picture = Picture.of_array(np.zeros((8, 8, 3), np.uint8), "x")
    candidate = maker.candidate(picture, Request("x", 1, None, scene, None, {}))
    with pytest.raises(InputError, match="must hold floats"):
        oracle.examined(candidate, {}, maker, "x")
