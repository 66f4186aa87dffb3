"""Planted mistakes are what they are called: in closed form, or by drawing another scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.benches import CLASSIFICATIONS, NAMED, SIZE, planted
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, constant, path_lengths, random_volume
from support.stored_scenes import GRADED, LIT, SCENES

from texvol.comparison.mistakes import CATALOGUE, WRONG_BY, MistakeTrial, drawn
from texvol.comparison.planting import Planted, PlantedRenderer, without
from texvol.comparison.wrong_functions import wrong_shaders
from texvol.opengl.shaders import FOLDER, ShaderError
from texvol.provenance.stored_scene import StoredScene
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.slabs import slab_stacks
from texvol.util.color import linear_from_srgb


@pytest.fixture(scope="module")
def renderer():
    with PlantedRenderer() as opened:
        yield opened


def test_a_renderer_is_the_right_one_again_after_a_mistake(renderer: PlantedRenderer) -> None:
    bench, _ = planted(renderer, SCENES["slab"])
    pictures = {mistake.name: picture for mistake, picture in drawn(bench)}
    assert len(pictures) == len(CATALOGUE)
    assert set(NAMED) <= set(pictures)
    np.testing.assert_array_equal(renderer.render(SCENES["slab"], SIZE, **bench.settings), bench.right)
    np.testing.assert_array_equal(bench.draw(), bench.right)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_fog_without_a_slab_is_that_much_thinner(renderer: PlantedRenderer, classification: str) -> None:
    volume = Volume(np.ones((8, 8, 8), np.float32))
    camera = Camera.orthographic((3.5, 3.5, -20), (3.5, 3.5, 3.5), (0, 1, 0), height=6)
    scene = Scene(volume, constant(0.1), camera, classification=classification)  # type: ignore[arg-type]
    bench, pictures = planted(renderer, scene, slab_thickness=0.5)
    # Slabs lie across the view, so that all rays cross 8 of fog, and 7.5 without one of them.
    np.testing.assert_allclose(bench.right[..., 3], -np.expm1(-0.8), rtol=2e-6)
    np.testing.assert_allclose(pictures["dropped slab"][..., 3], -np.expm1(-0.75), rtol=2e-6)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_fog_of_linear_opacity_is_the_product_of_its_slabs(renderer: PlantedRenderer, classification: str) -> None:
    volume = Volume(np.ones((8, 8, 8), np.float32))
    camera = Camera.orthographic((3.5, 3.5, -20), (3.5, 3.5, 3.5), (0, 1, 0), height=6)
    scene = Scene(volume, constant(0.3), camera, classification=classification)  # type: ignore[arg-type]
    _, pictures = planted(renderer, scene, slab_thickness=1.0)
    # `integrated` integrates each half of a slab.
    transmittance = (1 - 0.15) ** 16 if classification == "integrated" else (1 - 0.3) ** 8
    np.testing.assert_allclose(pictures["linear opacity"][..., 3], 1 - transmittance, rtol=4e-6)
    color = np.broadcast_to((1 - transmittance) * np.array((0.9, 0.6, 0.3)), (*SIZE[::-1], 3))
    np.testing.assert_allclose(pictures["linear opacity"][..., :3], color, rtol=4e-6)


def test_opaque_slabs_of_linear_opacity_are_opaque(renderer: PlantedRenderer) -> None:
    volume = Volume(np.ones((4, 4, 4), np.float32))
    camera = Camera.orthographic((1.5, 1.5, -9), (1.5, 1.5, 1.5), (0, 1, 0), height=3)
    _, pictures = planted(renderer, Scene(volume, constant(2.0), camera, classification="slab"), slab_thickness=1.0)
    np.testing.assert_allclose(pictures["linear opacity"][..., 3], 1, rtol=1e-6)
    np.testing.assert_allclose(pictures["linear opacity"][..., 0], 0.9, rtol=1e-6)


@pytest.mark.parametrize(
    "name", [*CLASSIFICATIONS, "emissive", "premultiplied, opaque", "graded", "graded in texels", "lit"]
)
def test_double_thickness_is_the_picture_of_a_volume_twice_as_large(renderer: PlantedRenderer, name: str) -> None:
    scene = SCENES[name]
    bench, pictures = planted(renderer, scene, slab_thickness=0.35, texture_format="rgba32f")
    volume, camera = scene.volume, scene.completed(SIZE).camera
    large = Volume(volume.values, 2 * volume.spacing, 2 * volume.origin, volume.direction)
    wide = Camera.orthographic(
        *(2 * np.array(each) for each in (camera.eye, camera.target)), camera.up, 2 * camera.height
    )
    # Gradients are half as steep there: what asks for them has to ask for half.
    medium = _of_half_gradients(bench.scene.medium)
    lighting = scene.lighting and replace(scene.lighting, fade=scene.lighting.fade / 2, lights=_twice_as_far(scene))
    twice = replace(scene, volume=large, camera=wide, transfer_function=medium, lighting=lighting)
    settings = bench.settings | {"slab_thickness": 0.7}
    expected = renderer.render(twice, SIZE, **settings)
    # float32 rounds texels and depths otherwise; an opaque edge may be met in one and missed in the other.
    np.testing.assert_allclose(pictures["double thickness"], expected, atol=2e-4)
    assert np.abs(bench.right - expected).max() > 0.02


def _of_half_gradients(medium: TransferFunction) -> TransferFunction:
    modulation = None if medium.modulation is None else medium.modulation * [0.5, 1]
    graded = tuple(replace(each, start=each.start / 2, full=each.full / 2) for each in medium.graded)
    contours = tuple(replace(each, thickness=2 * each.thickness) for each in medium.contours)
    return replace(medium, modulation=modulation, graded=graded, contours=contours)


def _twice_as_far(scene: Scene):
    assert scene.lighting is not None
    return tuple(
        replace(each, vector=tuple(2 * np.array(each.vector))) if each.kind == "point" else each
        for each in scene.lighting.lights
    )


def test_swapped_order_shows_the_back_in_front(renderer: PlantedRenderer) -> None:
    """Of two layers, red before green, as of green before red."""
    values = np.zeros((8, 4, 4), np.float32)
    values[4:] = 1
    medium = TransferFunction(
        np.array([0, 0.5, 0.5, 1]), np.array([(1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)]), np.full(4, 0.3)
    )
    camera = Camera.orthographic((1.5, 1.5, -20), (1.5, 1.5, 3.5), (0, 1, 0), height=3)
    for classification in CLASSIFICATIONS:
        scene = Scene(Volume(values), medium, camera, classification=classification)  # type: ignore[arg-type]
        _, pictures = planted(renderer, scene)
        behind = replace(scene, volume=Volume(values[::-1]))
        np.testing.assert_allclose(pictures["swapped order"], renderer.render(behind, SIZE), atol=1e-5)


def test_swapped_order_goes_through_all_stacks_and_bricks(renderer: PlantedRenderer) -> None:
    stored = StoredScene(
        Scene(random_volume(3, (33, 32, 31)), BONE, classification="integrated"), {"slab_thickness": 0.1}
    )
    swapped = next(each for each in CATALOGUE if each.name == "swapped order")
    whole = MistakeTrial(renderer, stored, SIZE)
    with PlantedRenderer(texture_memory=0.1) as other:
        in_bricks = MistakeTrial(other, stored, SIZE)
        wrong = swapped.draw(in_bricks)
        assert quick_stats(other)["bricks_total"] > 1
    # A slab at the face of two bricks is drawn in one of them, whose rays are rounded otherwise.
    np.testing.assert_allclose(in_bricks.right, whole.right, atol=1e-4)
    np.testing.assert_allclose(wrong, swapped.draw(whole), atol=1e-4)
    assert np.abs(wrong - whole.right).max() > 0.05


@pytest.mark.parametrize("axis", range(3))
def test_half_a_texel_is_a_volume_half_a_sample_off_along_each_axis(axis: int, renderer: PlantedRenderer) -> None:
    """Of a ramp along an axis, a layer of which shows: half a sample on the value is larger by a half."""
    values = np.moveaxis(np.broadcast_to(np.arange(24, dtype=np.float32), (24, 24, 24)), 2, 2 - axis)
    medium = TransferFunction(np.array([9.0, 11, 13, 15]), np.full((4, 3), 0.7), np.array([0, 0.2, 0.4, 0]))
    position = [11.5, 11.5, 11.5]
    position[(axis + 1) % 3] = -60.0  # from aside, so that the layer is seen where it is
    up = np.roll([1.0, 0, 0], axis)
    camera = Camera.orthographic(position, (11.5, 11.5, 11.5), up, height=20)
    scene = Scene(Volume(values), medium, camera, classification="post")
    bench, pictures = planted(renderer, scene, slab_thickness=0.5, texture_format="rgba32f")
    expected = renderer.render(replace(scene, volume=Volume(scene.volume.values + 0.5)), SIZE, **bench.settings)
    np.testing.assert_allclose(pictures["half a texel"], expected, atol=1e-5)
    assert np.abs(expected - bench.right).max() > 0.1


def test_the_other_axis_is_of_a_volume_whose_axes_are_swapped(renderer: PlantedRenderer) -> None:
    values = random_volume(5, (6, 6, 6)).values
    scene = Scene(Volume(values), FOG, Camera.framing(Volume(values)), classification="post")
    _, pictures = planted(renderer, scene)
    swapped = replace(scene, volume=Volume(values.transpose(2, 1, 0)), transfer_function=FOG)
    np.testing.assert_allclose(pictures["other axis"], renderer.render(swapped, SIZE), atol=1e-5)


def test_where_some_axes_are_the_same_others_are_swapped(renderer: PlantedRenderer) -> None:
    values = random_volume(5, (6, 6, 6)).values
    values = values + values.transpose(2, 1, 0)
    scene = Scene(Volume(values), FOG, Camera.framing(Volume(values)), classification="slab")
    bench, pictures = planted(renderer, scene)
    assert np.abs(pictures["other axis"] - bench.right).max() > 0.01


def test_mistakes_in_the_picture_are_made_of_the_right_one(renderer: PlantedRenderer) -> None:
    bench, pictures = planted(renderer, SCENES["sheared, from inside"])
    right = bench.right
    np.testing.assert_allclose(linear_from_srgb(pictures["wrong gamma"][..., :3]), right[..., :3], atol=1e-6)
    opacity = pictures["straight colour"][..., 3:]
    np.testing.assert_allclose(pictures["straight colour"][..., :3] * opacity, right[..., :3], rtol=1e-5)
    wrong = np.argwhere((pictures["one wrong pixel"] != right).any(axis=2))
    assert len(wrong) == 1
    off = np.abs(pictures["one wrong pixel"] - right)
    np.testing.assert_allclose(off[tuple(wrong[0])], [WRONG_BY] * 3 + [0], atol=1e-6)
    assert np.abs(pictures["8-bit target"] - right).max() > 0.5 / 255


def test_unclipped_end_slabs_make_fog_thicker_at_its_faces(renderer: PlantedRenderer) -> None:
    volume = Volume(np.ones((5, 5, 5), np.float32))
    bench, pictures = planted(renderer, Scene(volume, constant(0.02), classification="post"), slab_thickness=0.7)
    lengths = path_lengths(volume, bench.scene.completed(SIZE).camera, SIZE)
    through = -np.log1p(-pictures["unclipped end slabs"][..., 3].astype(np.float64)) / 0.02
    seen = lengths > 0.1
    # Both ends are rounded to whole slabs.
    slabs = through[seen] / 0.7
    np.testing.assert_allclose(slabs, np.rint(slabs), atol=1e-3)
    assert (slabs * 0.7 >= lengths[seen] - 1e-3).all()
    assert (slabs * 0.7 <= lengths[seen] + 1.4 + 1e-3).all()


def test_a_missing_cosine_makes_oblique_fog_thinner(renderer: PlantedRenderer) -> None:
    volume = Volume(np.ones((5, 5, 5), np.float32))
    camera = Camera.perspective((2, 2, -4), (2, 2, 2), (0, 1, 0), fov=70)
    bench, pictures = planted(renderer, Scene(volume, constant(0.1), camera, classification="slab"), slab_thickness=0.5)
    _, directions = camera.rays(SIZE)
    cosine = directions @ camera.forward
    depth, thinner = (-np.log1p(-each[..., 3].astype(np.float64)) for each in (bench.right, pictures["missing cosine"]))
    seen = depth > 0.01
    np.testing.assert_allclose(thinner[seen], (depth * cosine)[seen], rtol=1e-4)
    assert cosine[seen].min() < 0.95


def test_the_dropped_slab_is_one_that_shows(renderer: PlantedRenderer) -> None:
    """A thin sheet far from the middle of a box that is empty otherwise."""
    values = np.zeros((64, 8, 8), np.float32)
    values[50] = 1
    camera = Camera.orthographic((3.5, 3.5, -99), (3.5, 3.5, 31.5), (0, 1, 0), height=6)
    bench, pictures = planted(renderer, Scene(Volume(values), BONE, camera, classification="post"), slab_thickness=1.0)
    assert bench.right[..., 3].min() > 0.3
    assert pictures["dropped slab"][..., 3].max() < 0.2


# Stacks and shaders.


def test_stacks_without_slabs_are_the_others_in_their_order() -> None:
    volume, camera = Volume(np.ones((9, 9, 9))), Camera.framing(Volume(np.ones((9, 9, 9))))
    stacks = slab_stacks(volume, camera, 0.5, SIZE, per_stack=4)
    for dropped in ((-3, -2), (0, 1), (-9, 7), (100, 101), (stacks.first[0], stacks.last[-1])):
        left = without(stacks, dropped)
        slabs = [k for first, last in zip(left.first, left.last, strict=True) for k in range(first, last)]
        every = [k for first, last in zip(stacks.first, stacks.last, strict=True) for k in range(first, last)]
        assert slabs == [k for k in every if not dropped[0] <= k < dropped[1]]
        assert len(left.polygons) == len(left.first)


def test_nothing_dropped_is_the_same_picture(renderer: PlantedRenderer) -> None:
    bench, _ = planted(renderer, SCENES["slab"])
    np.testing.assert_array_equal(bench.without((9999, 10000)), bench.right)


def test_shaders_with_wrong_functions_stay_as_they_are() -> None:
    before = {path.name: path.read_bytes() for path in FOLDER.iterdir()}
    with wrong_shaders(("float mean_transmittance(float x, float opacity)", "return 1.0;")) as folder:
        assert folder != FOLDER
        changed = {path.name for path in folder.iterdir() if path.read_bytes() != before[path.name]}
        assert changed == {"optics.glsl"}
        assert "return 1.0;" in (folder / "optics.glsl").read_text()
    assert not folder.exists()
    assert {path.name: path.read_bytes() for path in FOLDER.iterdir()} == before


@pytest.mark.parametrize(
    "signature, reason",
    {
        "vec4 under(vec4 front, vec4 back)": "found in none; there are no functions named 'under'",
        "vec4 over(vec4 front)": r"there are 'vec4 over\(vec4 front, vec4 back\)'",
        "void main()": r"found in .*slab_stack.frag",
        "vec4 over": "signature must be such as",
    }.items(),
)
def test_a_function_that_is_not_there_is_an_error(signature: str, reason: str) -> None:
    with pytest.raises(ShaderError, match=reason), wrong_shaders((signature, "return front;")):
        pass


def test_a_wrong_function_calls_the_right_one_whatever_its_parameters_are_called() -> None:
    with wrong_shaders(("bool first_root(vec4 a, float b, float c, float d, out float e)", "BODY")) as folder:
        text = (folder / "trilinear.glsl").read_text()
    assert text.count("bool first_root_right(") == 1 == text.count("bool first_root(")
    assert "out float e) {\n    BODY\n}" in text


def test_a_wrong_function_replaces_every_definition_under_a_switch() -> None:
    with wrong_shaders(("vec4 slab_color(vec4 texel, float length, vec3 position)", "return texel;")) as folder:
        text = (folder / "sampled_slabs.glsl").read_text()
    assert text.count("vec4 slab_color_right(vec4 texel, float length, vec3 position) {") == 3


def test_a_mistake_that_cannot_be_compiled_leaves_the_renderer_whole(renderer: PlantedRenderer) -> None:
    with pytest.raises(ShaderError, match=r"optics\.glsl"):
        MistakeTrial(renderer, StoredScene(SCENES["slab"]), SIZE).draw(
            Planted((("vec4 over(vec4 front, vec4 back)", "no GLSL"),))
        )
    assert renderer.render(SCENES["slab"], SIZE).any()


# What has no meaning, and what changes nothing.


@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average", "isosurface"])
def test_what_has_no_meaning_for_a_mode_does_not_apply(mode: str, renderer: PlantedRenderer) -> None:
    isovalue = 0.5 if mode == "isosurface" else None
    scene = Scene(random_volume(3), mode=mode, isovalue=isovalue, classification="slab")  # type: ignore[arg-type]
    _, pictures = planted(renderer, scene)
    for name in ("swapped order", "linear opacity", "double thickness", "alpha of the back"):
        assert pictures[name] == f"mode {mode} composites nothing"
    for name in ("wrong gamma", "straight colour", "8-bit target"):
        assert isinstance(pictures[name], str) == (mode != "isosurface")
    assert pictures["missing cosine"] == "rays are parallel"
    assert isinstance(pictures["half a texel"], np.ndarray)


def test_lit_and_graded_scenes_have_mistakes_too(renderer: PlantedRenderer) -> None:
    for scene in (
        Scene(random_volume(3), GRADED, lighting=LIT, classification="slab"),
        SCENES["shadows"],
        SCENES["depth cue"],
    ):
        bench, pictures = planted(renderer, scene)
        for name in NAMED:
            assert np.abs(pictures[name] - bench.right).max() > 1e-4, name
