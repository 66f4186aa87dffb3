"""Pictures against closed forms and invariants; the oracle comes in test_render_convergence."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from support.pairs import each_classification_in_a_projection
from support.planted import slabs_per_blend
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, constant, inside, path_lengths, random_volume, smooth_volume

import texvol
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.cells import CELL
from texvol.slicing.slabs import SLABS_PER_STACK
from texvol.util.errors import InputError

SIZE = (48, 40)
FLOAT32 = {"texture_format": "rgba32f", "target_format": "rgba32f"}
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])
classifications = pytest.mark.parametrize("classification", ["slab", "extinction", "post", "integrated"])

# Some ten runs of 64 slabs, each rounding by 2^-24 of a number up to 1, partly cancelling.
ROUNDING = 1e-6


@classifications
@projections
@pytest.mark.parametrize(
    "eye, extinction", [("outside", 0.003), ("inside", 0.05), ("outside", 0.5), ("inside", 3.0), ("outside", np.inf)]
)
def test_a_constant_medium_is_its_closed_form_for_any_number_of_slabs(
    renderer: Renderer, classification: Classification, projection: Projection, eye: str, extinction: float
) -> None:
    volume = Volume(np.full((24, 40, 32), 7, np.uint8), (1, 1.3, 0.7), (10, -20, 30))
    camera = Camera.framing(volume, projection) if eye == "outside" else inside(volume, projection)
    length = path_lengths(volume, camera, SIZE)
    with np.errstate(invalid="ignore"):
        opacity = -np.expm1(-np.where(length > 0, extinction * length, 0.0))
    assert (opacity > 0).mean() > 0.2
    scene = Scene(volume, constant(extinction), camera, classification=classification)
    for rate in (0.25, 1, 3, 8):
        picture = renderer.render(scene, SIZE, sampling_rate=rate, **FLOAT32)
        np.testing.assert_allclose(picture[..., 3], opacity, atol=ROUNDING)
        np.testing.assert_allclose(picture[..., :3], opacity[..., np.newaxis] * [0.9, 0.6, 0.3], atol=ROUNDING)


@each_classification_in_a_projection
@pytest.mark.parametrize("depth", [0.0, 1e-12, 1e-3, 1.0, 50.0])
def test_an_emissive_medium_is_its_closed_form(
    renderer: Renderer, classification: Classification, projection: Projection, depth: float
) -> None:
    volume = Volume(np.zeros((16, 16, 16), np.uint8))
    camera = Camera.framing(volume, projection)
    emission, extinction = np.array([0.02, 0.3, 4.0]), depth / 16
    glow = TransferFunction(np.zeros(1), emission[np.newaxis], np.array([extinction]), emissive=True)
    length = path_lengths(volume, camera, SIZE)
    x = extinction * length
    mean = np.where(x > 0, -np.expm1(-x) / np.where(x > 0, x, 1), 1.0)
    expected = (length * mean)[..., np.newaxis] * emission
    scene = Scene(volume, glow, camera, classification=classification)
    for rate in (0.25, 1, 4):
        picture = renderer.render(scene, SIZE, sampling_rate=rate, **FLOAT32)
        # The rounding above, relative to the brightest pixel, which is up to 80.
        np.testing.assert_allclose(picture[..., :3], expected, atol=ROUNDING * expected.max())
        np.testing.assert_allclose(picture[..., 3], -np.expm1(-x), atol=ROUNDING)


@projections
def test_a_linear_extinction_is_its_closed_form(renderer: Renderer, projection: Projection) -> None:
    """The midpoint rule integrates a linear extinction exactly; colour constant (optics, case 3)."""
    samples = 64
    values = np.broadcast_to(np.arange(samples, dtype=np.float32)[:, np.newaxis, np.newaxis], (samples, 8, 8))
    volume = Volume(values)
    # From 0.5 to 62.5 the field is linear in z; the camera looks at it through the side and is narrow enough.
    eye, target = (-40, 4, 20), (4, 4, 34)
    if projection == "perspective":
        camera = Camera.perspective(eye, target, (0, 0, 1), fov=8)
    else:
        camera = Camera.orthographic(eye, target, (0, 0, 1), height=5)
    transfer_function = TransferFunction(np.array([0.0, 63.0]), np.full((2, 3), 0.5), np.array([0.0, 0.63]))
    origins, directions = camera.rays(SIZE)
    direction = np.where(np.abs(directions) < 1e-15, 1e-15, directions)
    a, b = (volume.box_corner - origins) / direction, (volume.box_corner + volume.dimensions - origins) / direction
    enters, leaves = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
    ends = [(origins + s[..., np.newaxis] * directions)[..., 2] for s in (enters, leaves)]
    assert min(end.min() for end in ends) > 0 and max(end.max() for end in ends) < 63
    expected = -np.expm1(-0.01 * (ends[0] + ends[1]) / 2 * np.maximum(leaves - enters, 0))
    picture = renderer.render(
        Scene(volume, transfer_function, camera, classification="extinction"), SIZE, sampling_rate=0.7, **FLOAT32
    )
    # Extinction is interpolated at a position rounded to 2^-24 of 64 samples: 4e-6 of a sample, times 0.01 × 14.
    np.testing.assert_allclose(picture[..., 3], expected, atol=ROUNDING)


@classifications
@projections
def test_the_picture_does_not_depend_on_how_slabs_are_stacked(
    renderer: Renderer, classification: Classification, projection: Projection
) -> None:
    volume = random_volume(5)
    scene = Scene(volume, BONE, Camera.framing(volume, projection), classification=classification)
    pictures = []
    for per_stack in (1, 7, 1000):
        with slabs_per_blend(per_stack):
            pictures.append(renderer.render(scene, SIZE, sampling_rate=4, **FLOAT32))
    np.testing.assert_allclose(pictures[1], pictures[0], atol=2e-6)
    np.testing.assert_allclose(pictures[2], pictures[0], atol=2e-6)


@projections
def test_mirrored_samples_in_a_mirrored_direction_are_the_same_matter(
    renderer: Renderer, projection: Projection
) -> None:
    """A left-handed grid is a right-handed one whose samples are listed the other way round."""
    values = random_volume(3).values
    nx = values.shape[2]
    plain = Volume(values, (1, 1.3, 0.7))
    mirrored = Volume(values[:, :, ::-1], (1, 1.3, 0.7), (nx - 1, 0, 0), np.diag([-1.0, 1, 1]))
    camera = Camera.framing(plain, projection)
    first, second = (
        renderer.render(Scene(volume, BONE, camera, classification="extinction"), SIZE, **FLOAT32)
        for volume in (plain, mirrored)
    )
    np.testing.assert_allclose(first, second, atol=3e-6)
    assert first[..., 3].max() > 0.5


@pytest.mark.parametrize("scale, origin", [(1e-9, 0.0), (1e9, 0.0), (1.0, 1e7), (1e-3, 1e4)])
@projections
def test_the_world_may_be_of_any_size_and_anywhere(
    renderer: Renderer, projection: Projection, scale: float, origin: float
) -> None:
    values = smooth_volume(16).values

    def picture(scale: float, origin: float) -> np.ndarray:
        volume = Volume(values, (scale,) * 3, (origin,) * 3)
        transfer_function = TransferFunction(BONE.values, BONE.colors, BONE.extinctions / scale)
        scene = Scene(volume, transfer_function, Camera.framing(volume, projection), classification="extinction")
        return renderer.render(scene, SIZE, sampling_rate=2, **FLOAT32)

    # The camera's own numbers are float64: at 1e7 its eye is known to 2e-9, and the box is 16 wide.
    np.testing.assert_allclose(picture(scale, origin), picture(1.0, 0.0), atol=1e-5)


@pytest.mark.parametrize("dimensions", [(1, 1, 1), (1, 1, 9), (1, 9, 9), (7, 5, 3), (2000, 3, 3)])
@projections
def test_boxes_of_any_shape_show(renderer: Renderer, projection: Projection, dimensions: tuple[int, int, int]) -> None:
    volume = Volume(np.full(dimensions[::-1], 0.9, np.float32))
    camera = Camera.framing(volume, projection)
    picture = renderer.render(Scene(volume, BONE, camera, classification="slab"), (256, 256), **FLOAT32)
    extinction = BONE.classify(volume.values[:1, :1, :1]).extinction.item()
    expected = -np.expm1(-extinction * path_lengths(volume, camera, (256, 256)))
    assert expected.max() > 0.3
    # Float32 texture coordinates on a box of 2000 samples round the silhouette's position by 1e-4 samples.
    np.testing.assert_allclose(picture[..., 3], expected, atol=2e-6)


def test_faces_on_an_axis_view_are_exact(renderer: Renderer) -> None:
    """A box seen along an axis, its faces between pixels: inside all of its depth, outside nothing."""
    volume = Volume(np.zeros((8, 8, 8), np.uint8))
    camera = Camera.orthographic((3.5, -20, 3.5), (3.5, 3.5, 3.5), (0, 0, 1), height=16)
    opacity = renderer.render(Scene(volume, constant(0.1), camera, classification="slab"), (64, 64), **FLOAT32)[..., 3]
    expected = np.zeros((64, 64))
    expected[16:48, 16:48] = -np.expm1(-0.8)
    np.testing.assert_allclose(opacity, expected, atol=ROUNDING)


@pytest.mark.parametrize("tilt", [0.0, 1e-7, -1e-7])
def test_views_beside_an_axis_are_whole(renderer: Renderer, tilt: float) -> None:
    volume = Volume(np.zeros((8, 8, 8), np.uint8))
    eye = volume.centre - 20 * np.array([np.sin(tilt), np.cos(tilt), tilt])
    camera = Camera.orthographic(eye, volume.centre, (0, 0, 1), height=16)
    opacity = renderer.render(Scene(volume, constant(0.1), camera, classification="slab"), (63, 63), **FLOAT32)[..., 3]
    length = path_lengths(volume, camera, (63, 63))
    np.testing.assert_allclose(opacity, -np.expm1(-0.1 * length), atol=ROUNDING)


@pytest.mark.parametrize("fov", [1.0, 130.0, 150.0])
def test_any_field_of_view(renderer: Renderer, fov: float) -> None:
    volume = Volume(np.zeros((8, 8, 8), np.uint8))
    camera = Camera.framing(volume, "perspective", fov=fov)
    opacity = renderer.render(Scene(volume, constant(0.2), camera, classification="slab"), SIZE, **FLOAT32)[..., 3]
    np.testing.assert_allclose(opacity, -np.expm1(-0.2 * path_lengths(volume, camera, SIZE)), atol=ROUNDING)


@projections
def test_the_background_enters_behind_what_is_left(renderer: Renderer, projection: Projection) -> None:
    volume = smooth_volume(16)
    camera = Camera.framing(volume, projection)
    plain = renderer.render(Scene(volume, FOG, camera, classification="slab"), SIZE)
    behind = renderer.render(Scene(volume, FOG, camera, background=(0.2, 0.5, 1.0), classification="slab"), SIZE)
    np.testing.assert_array_equal(behind[..., 3], plain[..., 3])
    expected = plain[..., :3] + (1 - plain[..., 3:]) * np.array([0.2, 0.5, 1.0])
    np.testing.assert_allclose(behind[..., :3], expected, atol=2e-7)


def test_top_is_up_and_right_is_right(renderer: Renderer) -> None:
    values = np.zeros((9, 9, 9), np.uint8)
    values[7, 4, 1] = 1  # high in z, low in x
    volume = Volume(values)
    camera = Camera.orthographic((4, -20, 4), (4, 4, 4), (0, 0, 1), height=9)  # looks along +y: x to the right
    transfer_function = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 1.0]))
    opacity = renderer.render(Scene(volume, transfer_function, camera, classification="slab"), (90, 90))[..., 3]
    row, column = np.unravel_index(opacity.argmax(), opacity.shape)
    assert (10 <= row < 20) and (10 <= column < 20)


@pytest.mark.parametrize("values", [np.nan, 3.0, np.inf, -np.inf])
@classifications
def test_all_nan_and_constant_volumes_render(renderer: Renderer, classification: Classification, values: float) -> None:
    volume = Volume(np.full((3, 4, 5), values))
    for transfer_function in (BONE, None):
        picture = renderer.render(Scene(volume, transfer_function, classification=classification), SIZE)
        assert np.isfinite(picture).all()
        if np.isnan(values):
            assert not picture.any()


def test_a_volume_behind_the_eye_gives_an_empty_picture(renderer: Renderer) -> None:
    volume = Volume(np.ones((4, 4, 4)))
    camera = Camera.perspective((0, -10, 0), (0, -20, 0), (0, 0, 1))
    assert not renderer.render(Scene(volume, BONE, camera, classification="slab"), SIZE).any()


@pytest.mark.parametrize("target_format, error", [("rgba8", 0.5 / 255), ("rgba16f", 2**-11), ("rgba32f", 2**-23)])
def test_target_formats_round_as_their_digits_say(renderer: Renderer, target_format: str, error: float) -> None:
    volume = smooth_volume(24)
    scene = Scene(volume, FOG, Camera.framing(volume), classification="extinction")
    truth = renderer.render(scene, SIZE, **FLOAT32)
    picture = renderer.render(scene, SIZE, texture_format="rgba32f", target_format=target_format)
    # Each slab stack's blend rounds what comes, its product and the sum.
    assert quick_stats(renderer)["slabs"] < SLABS_PER_STACK
    assert np.abs(picture - truth).max() <= 3 * error
    assert target_format == "rgba32f" or np.abs(picture - truth).max() > error / 8


def test_stats_say_what_was_done(renderer: Renderer) -> None:
    volume = smooth_volume(24)
    camera = Camera.framing(volume, "perspective")
    renderer.render(
        Scene(volume, FOG, camera, background=(1, 0, 0), classification="slab"), (64, 32), slab_thickness=0.5, repeat=3
    )
    stats = renderer.stats
    assert stats["size"] == [64, 32]
    assert stats["slab_thickness"] == 0.5
    assert 48 <= stats["slabs"] <= 2 * 24 * np.sqrt(3) + 1
    assert stats["classification"] == "slab"
    assert stats["texture_format"] in ("rgba8", "rgba16f", "rgba32f")
    assert stats["target_format"] == "rgba32f"
    assert stats["modelled"] == ["perspective", "background"]
    assert set(stats["seconds"]) == {"bake", "upload", "draw", "read"}
    assert 0 < stats["estimated_error"] < 0.01
    assert stats["bricks_total"] == stats["bricks_drawn"] == 1
    assert stats["texture_bytes"] == 24**3 * {"rgba8": 4, "rgba16f": 8, "rgba32f": 16}[stats["texture_format"]]
    assert 0 < stats["cells_drawn"] <= stats["cells_total"] == (24 // CELL) ** 3
    assert stats["early_termination"] == 2.0**-22
    assert 0 < stats["samples"] <= stats["samples_total"] <= 64 * 32 * stats["slabs"]
    renderer.render(Scene(volume, FOG, Camera.framing(volume), classification="slab"), (64, 32))
    assert renderer.stats["modelled"] == []


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"size": (0, 10)}, "size must be at least one pixel along each side, got 0x10"),
        ({"size": (10, 10**6)}, "this driver draws 1 to"),
        ({"sampling_rate": 0.0}, "sampling rate must be positive"),
        ({"sampling_rate": np.nan}, "sampling rate must be positive"),
        ({"slab_thickness": -1.0}, "slab thickness must be positive"),
        ({"slab_thickness": 1.0, "sampling_rate": 1.0}, "give only one of them"),
        ({"max_error": 0.0}, "maximum error must be positive"),
        ({"max_error": np.nan}, "maximum error must be positive"),
        ({"max_error": 0.1, "sampling_rate": 1.0}, "give only one of them"),
        ({"texture_format": "rgba64f"}, "texture format must be auto"),
        ({"target_format": "rgb"}, "target format must be auto"),
    ],
)
def test_arguments_out_of_range_are_refused(renderer: Renderer, arguments: dict, message: str) -> None:
    scene = Scene(Volume(np.ones((2, 2, 2))), FOG, classification="slab")
    with pytest.raises(InputError, match=message):
        renderer.render(scene, **arguments)


def test_closing_twice_is_fine() -> None:
    renderer = Renderer()
    renderer.render(Scene(Volume(np.ones((2, 2, 2))), FOG, classification="slab"), SIZE)
    renderer.close()
    renderer.close()


def test_the_interface_is_callable_however_it_is_reached() -> None:
    scene = texvol.Scene(texvol.Volume(np.ones((2, 2, 2))), FOG, classification="slab")
    first = texvol.render(scene, size=(8, 6))
    assert texvol.Renderer is Renderer
    importlib.import_module("texvol.rendering.render")
    np.testing.assert_array_equal(texvol.render(scene, size=(8, 6)), first)
    assert first.shape == (6, 8, 4)
    assert first.flags.c_contiguous


@classifications
def test_stats_can_be_asked_for_later(classification: Classification) -> None:
    with Renderer() as renderer:
        renderer.render(Scene(smooth_volume(12), FOG, classification=classification), SIZE)
        assert renderer.stats["estimated_error"] > 0
        renderer.render(Scene(smooth_volume(12), FOG, classification=classification), SIZE)
    assert renderer.stats["slabs"] > 0
    assert renderer.stats["estimated_error"] is None


@pytest.mark.parametrize("thickness", [1e300, 1e9])
def test_a_slab_thicker_than_the_box_is_the_box(renderer: Renderer, thickness: float) -> None:
    volume = Volume(np.zeros((4, 5, 6), np.uint8))
    camera = Camera.framing(volume)
    picture = renderer.render(
        Scene(volume, constant(0.3), camera, classification="slab"), SIZE, slab_thickness=thickness
    )
    expected = -np.expm1(-0.3 * path_lengths(volume, camera, SIZE))
    np.testing.assert_allclose(picture[..., 3], expected, atol=ROUNDING)


@classifications
def test_asking_for_stats_leaves_the_texture_where_it_is(renderer: Renderer, classification: Classification) -> None:
    scene = Scene(smooth_volume(12), FOG, classification=classification)
    first = renderer.render(scene, SIZE)
    assert renderer.stats["estimated_error"] > 0
    np.testing.assert_array_equal(renderer.render(scene, SIZE), first)
    assert "upload" not in quick_stats(renderer)["seconds"]


@pytest.mark.parametrize("together", [False, True])
def test_slabs_of_a_large_picture_are_counted_on_a_sixteenth_of_its_rays(
    together: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene(smooth_volume(40), BONE, classification="post")
    if together:
        scene = replace(scene, added=(AddedVolume(scene.volume, scene.transfer_function),))
    found = []
    with Renderer() as renderer:
        for most in (1 << 16, 1 << 20):
            monkeypatch.setattr("texvol.rendering.stats._MOST_COUNTED", most)
            renderer.render(scene, (320, 300), early_termination=0.25)
            found.append(quick_stats(renderer, samples=True))
    few, all_of_them = found
    assert few["samples"] == pytest.approx(all_of_them["samples"], rel=0.01)
    assert few["samples_total"] == pytest.approx(all_of_them["samples_total"], rel=0.01 if together else 0)
    assert few["samples"] < few["samples_total"]
