"""Pictures against the oracle: the error's size, its order, and that EGL and OSMesa agree."""

from __future__ import annotations

import numpy as np
import pytest
from support.pairs import each_classification_in_a_projection
from support.scenes import BONE, FOG, random_volume, smooth_volume

from texvol.comparison import compare
from texvol.opengl.contexts import open_context
from texvol.output.one_picture import render
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import AccuracyWarning, ContextError

SIZE = (80, 80)
FLOAT32 = {"texture_format": "rgba32f", "target_format": "rgba32f"}
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])
medium = pytest.mark.parametrize("transfer_function", [FOG, BONE], ids=["fog", "bone"])


@pytest.mark.parametrize(
    "transfer_function, projection, texture_format",
    [(FOG, "orthographic", "auto"), (FOG, "perspective", "rgba32f"), (BONE, "perspective", "auto")],
    ids=["fog", "fog in float32", "bone"],
)
def test_the_error_falls_with_its_order(
    renderer: Renderer, transfer_function: TransferFunction, projection: Projection, texture_format: str
) -> None:
    volume = smooth_volume()
    camera = Camera.framing(volume, projection)
    truth = raycast(Scene(volume, transfer_function, camera, classification="slab"), SIZE)
    rates = np.array([1, 2, 4, 8])
    orders = {}
    for classification in ("slab", "extinction"):
        scene = Scene(volume, transfer_function, camera, classification=classification)  # type: ignore[arg-type]
        errors = [
            compare(renderer.render(scene, SIZE, sampling_rate=rate, texture_format=texture_format), truth).rms_error
            for rate in rates
        ]
        orders[classification] = -np.polyfit(np.log2(rates), np.log2(errors), 1)[0]
    # Second order by the midpoint rule; interpolated opacities are first order on opaque matter, second on thin.
    assert 1.8 < orders["extinction"] < 2.2
    assert 0.85 < orders["slab"] < 2.2


@medium
@pytest.mark.parametrize("classification, projection", [("slab", "perspective"), ("extinction", "orthographic")])
def test_the_error_at_rate_2_is_small(
    renderer: Renderer, transfer_function: TransferFunction, projection: Projection, classification: Classification
) -> None:
    volume = smooth_volume()
    scene = Scene(volume, transfer_function, Camera.framing(volume, projection), classification=classification)
    difference = compare(renderer.render(scene, SIZE, sampling_rate=2), raycast(scene, SIZE))
    # What the project promises of smooth and of bone-like transfer functions at two slabs per voxel.
    if transfer_function is FOG:
        assert difference.max_error <= 2e-3
        assert difference.rms_error <= 3e-4
    else:
        assert difference.rms_error <= (3e-3 if classification == "slab" else 1e-3)


@pytest.mark.parametrize("classification", ["slab", "extinction"])
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_on_an_anisotropic_grid_converges_to_the_oracle(
    renderer: Renderer, classification: Classification, seed: int
) -> None:
    volume = random_volume(seed)
    scene = Scene(volume, BONE, Camera.framing(volume, "perspective"), classification=classification)
    difference = compare(renderer.render(scene, SIZE, sampling_rate=64, **FLOAT32), raycast(scene, SIZE))
    assert difference.max_error <= (2e-3 if classification == "slab" else 2e-4)


@pytest.mark.parametrize("classification", ["slab", "extinction"])
def test_opaque_voxels_converge_to_the_oracle(renderer: Renderer, classification: Classification) -> None:
    """Opacity 1 per unit length is a value: whatever its interpolation touches is opaque."""
    volume = random_volume(4)
    transfer_function = TransferFunction(
        np.array([0.0, 0.9, 0.9, 1.0]),
        np.array([(0.1, 0.2, 0.9), (0.1, 0.2, 0.9), (0.9, 0.3, 0.1), (0.9, 0.9, 0.1)]),
        np.array([0.05, 0.05, np.inf, np.inf]),
    )
    scene = Scene(volume, transfer_function, Camera.framing(volume), classification=classification)
    truth = raycast(scene, SIZE)
    opaque = truth[..., 3] == 1
    assert 0.2 < opaque.mean() < 0.95
    coarse, fine = (
        compare(renderer.render(scene, SIZE, sampling_rate=rate, **FLOAT32), truth).mean_error for rate in (4, 32)
    )
    # A slab sees an opaque cell if its midpoint lies in it: chords shorter than a slab are missed in proportion to
    # the slab, so that the mean error is of first order, 8 to one here. Interpolated opacity grows from 0 at the
    # cell's face, and a ray that grazes the face is opaque only once a slab is as thin as its weight there.
    assert coarse / fine > (2 if classification == "slab" else 5)
    assert fine < (0.03 if classification == "slab" else 1e-3)


@each_classification_in_a_projection
def test_the_estimated_error_is_near_the_true_one(
    renderer: Renderer, projection: Projection, classification: Classification
) -> None:
    volume = smooth_volume()
    for transfer_function in (FOG, BONE):
        scene = Scene(volume, transfer_function, Camera.framing(volume, projection), classification=classification)
        truth = raycast(scene, SIZE)
        for rate in (1, 4):
            true = compare(renderer.render(scene, SIZE, sampling_rate=rate), truth).max_error
            # The estimate looks at a sixteenth of the pixels, and doubles what should be 4/3 where the order is 2.
            assert 0.4 * true < renderer.stats["estimated_error"] < 4 * true


@projections
def test_egl_and_osmesa_give_the_same_picture(projection: Projection) -> None:
    for backend in ("egl", "osmesa"):
        try:
            open_context(backend).release()
        except ContextError as error:
            pytest.skip(f"two back ends are needed: {error}")
    volume = smooth_volume()
    scene = Scene(volume, BONE, Camera.framing(volume, projection), classification="slab")
    one, other = (render(scene, SIZE, backend=backend) for backend in ("egl", "osmesa"))
    np.testing.assert_allclose(one, other, atol=2e-6)
    assert one[..., 3].max() > 0.5


SPIKE = TransferFunction(
    np.array([0, 0.495, 0.5, 0.505, 1]),
    np.array([(0.2, 0.4, 0.9), (0.2, 0.4, 0.9), (1, 0.8, 0.3), (0.9, 0.2, 0.1), (0.9, 0.2, 0.1)]),
    np.array([0, 0, 1.5, 0, 0]),
)


@projections
def test_integrated_sees_a_spike_that_post_steps_over(renderer: Renderer, projection: Projection) -> None:
    """A spike a hundredth of the range wide: at most 0.3 of the error, and less at a quarter of the samples."""
    volume = smooth_volume()
    camera = Camera.framing(volume, projection)
    truth = raycast(Scene(volume, SPIKE, camera, classification="post"), SIZE)

    def error(classification: Classification, rate: float) -> float:
        scene = Scene(volume, SPIKE, camera, classification=classification)
        return compare(renderer.render(scene, SIZE, sampling_rate=rate), truth).rms_error

    assert error("integrated", 1) < 0.3 * error("post", 1)
    # Three values make a slab, of which it shares one with the next: two samples. A quarter of the samples:
    assert error("integrated", 0.5) < error("post", 4)


@pytest.mark.parametrize(
    "projection, points, dtype",
    [  # each type with few points and with many
        ("orthographic", 1, np.uint8),
        ("perspective", 10000, np.uint8),
        ("orthographic", 2, np.int16),
        ("orthographic", 10000, np.int16),
        ("perspective", 1, np.uint16),
        ("orthographic", 50, np.uint16),
        ("orthographic", 2, np.float16),
        ("orthographic", 50, np.float16),
        ("orthographic", 1, np.float32),
        ("orthographic", 10000, np.float32),
        ("perspective", 2, np.float64),
        ("perspective", 50, np.float64),
        ("orthographic", 1, np.int32),
        ("orthographic", 10000, np.int32),
    ],
)
def test_any_number_of_points_and_any_type_is_looked_up_without_loss(
    renderer: Renderer, projection: Projection, points: int, dtype: type
) -> None:
    """A volume of one value in each layer, so that what is looked up is known; crowded points around one of them."""
    levels = np.array([3, 90, 91, 120]).astype(dtype)
    volume = Volume(np.broadcast_to(levels[:, np.newaxis, np.newaxis], (4, 5, 6)).copy())
    random = np.random.default_rng(points)
    values = np.sort(
        np.concatenate([random.uniform(0, 127, points // 2), random.normal(90, 1e-3, points - points // 2)])
    )
    transfer_function = TransferFunction(values, random.random((points, 3)), random.random(points))
    # Rays in the plane of a layer's samples see nothing of its neighbours.
    eye = np.array([2.5, -20.0, 1.0])
    camera = Camera.orthographic(eye, eye + (0, 1, 0), (0, 0, 1), height=1e-6)
    for layer, level in enumerate(levels):
        shifted = Camera(camera.projection, (2.5, -20.0, layer), (2.5, -19.0, layer), camera.up, height=1e-6)
        if projection == "perspective":
            shifted = Camera.perspective(shifted.eye, shifted.target, shifted.up, fov=1e-6)
        emission, extinction = transfer_function.classify(float(level))
        opacity = -np.expm1(-extinction * 5)
        expected = np.append(emission / extinction * opacity, opacity)
        for classification in ("post", "integrated"):
            scene = Scene(volume, transfer_function, shifted, classification=classification)  # type: ignore[arg-type]
            picture = renderer.render(scene, (2, 2))
            # A value is known to some 2^-22 of the largest stored, over which colour and depth change as they do
            # between the points there; where points crowd closer, by anything.
            blur = 2.0**-22 * (65536 if np.dtype(dtype).itemsize == 2 and dtype != np.float16 else 256)
            near = transfer_function.classify(float(level) + blur * np.linspace(-1, 1, 41))
            depths = 5 * near.extinction[:, np.newaxis]
            spread = np.ptp(np.append(5 * near.emission / depths, depths, axis=1), axis=0)
            tolerance = 2e-6 + (2.0 if points > 2 and level == 90 else spread.max())
            np.testing.assert_allclose(picture, np.broadcast_to(expected, (2, 2, 4)), atol=tolerance)


def test_a_flat_region_on_a_step_is_on_its_right_side(renderer: Renderer) -> None:
    for dtype in (np.uint8, np.int16, np.uint16, np.float32, np.float64):
        for level in (1, 3, 77, 100):
            volume = Volume(np.full((4, 4, 4), level, dtype))
            transfer_function = TransferFunction(
                np.array([0.0, level, level, 127]), np.full((4, 3), 0.5), np.array([0, 0, 0.3, 0.3])
            )
            for classification in ("post", "integrated"):
                scene = Scene(volume, transfer_function, classification=classification)  # type: ignore[arg-type]
                picture = renderer.render(scene, (16, 16))
                np.testing.assert_allclose(picture, raycast(scene, (16, 16)), atol=2e-6)
                assert picture[..., 3].max() > 0.5


@pytest.mark.parametrize(
    "formats", [{"texture_format": "rgba8"}, {"target_format": "rgba8"}, {"target_format": "rgba16f"}]
)
def test_rounding_to_a_format_counts_as_error(renderer: Renderer, formats: dict[str, str]) -> None:
    volume = smooth_volume()
    scene = Scene(volume, FOG, Camera.framing(volume), classification="extinction")
    truth = raycast(scene, SIZE)
    true = compare(renderer.render(scene, SIZE, sampling_rate=8, **formats), truth).max_error
    assert 0.4 * true < renderer.stats["estimated_error"]
    with pytest.warns(AccuracyWarning, match="requested error of 1e-05 not reached"):
        renderer.render(scene, SIZE, max_error=1e-5, **formats)
    assert compare(renderer.render(scene, SIZE, max_error=0.05, **formats), truth).max_error <= 0.05
