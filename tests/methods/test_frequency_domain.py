"""Fourier projection, of whole volumes and of blocks, against closed forms and the oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.survey_scenes import BOXES, SIZE, VIEWS, constant_scene, inside, rms_error, smooth_scene

from texvol.methods import draw, method_of
from texvol.methods.method import Method
from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

WHOLE = ("fourier", "fourier-padded", "fourier-cubic")
SHEAR = np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]])


def bump(samples: int = 32, spacing: tuple[float, float, float] = (1.0, 1.3, 0.7), width: float = 3.0) -> Scene:
    """A Gaussian of so many spacings, off the middle, in a sheared box: 0 at the border to float32's digits."""
    k, j, i = np.indices((samples, samples - 2, samples + 3))
    place = (samples / 2 - 1, samples / 2 - 3, samples / 2 + 2)
    squares = (i - place[2]) ** 2 + (j - place[1]) ** 2 + (k - place[0]) ** 2
    volume = Volume(np.exp(-squares / (2 * width**2)), spacing, (5, 6, -7), SHEAR)
    return Scene(volume, camera=Camera.framing(volume), mode="xray")


def test_a_gaussian_is_its_projection() -> None:
    # ∫ exp(-|A⁻¹ (x - m)|² / 2) along a unit vector d is √(2π) / |A⁻¹ d| times the Gaussian of the distance.
    scene, width = bump(), 3.0
    volume, camera = scene.volume, scene.camera
    assert camera is not None
    shape = volume.index_from_world / width
    middle = volume.origin + volume.world_from_index @ (34 - 16, 16 - 3, 16 - 1)
    eyes, directions = camera.rays(SIZE)
    p, d = (eyes - middle) @ shape.T, directions @ shape.T
    length = np.linalg.norm(d, axis=-1)
    squares = (p**2).sum(axis=-1) - ((p * d).sum(axis=-1) / length) ** 2
    expected = np.sqrt(2 * np.pi) / length * np.exp(-squares / 2)
    found = draw("fourier-cubic", scene, SIZE, reconstruction="ideal")
    # Nothing of it is beyond the band or the box; what is left is the spectrum's cubic interpolation.
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3 * expected.max())
    # Trilinear weights widen it by 1/6 of a squared spacing along each axis: 3 · 1/6 / (2 · 3²) = 3 %.
    wider = draw("fourier-cubic", scene, SIZE)
    assert 0.01 < (expected.max() - wider.max()) / expected.max() < 0.03


@pytest.mark.parametrize(("name", "least", "most"), [
    # Of the maximum; the interpolation of the spectrum has all the error, which is why each has its own.
    ("fourier", 4e-2, 1.5e-1), ("fourier-padded", 1e-2, 4e-2), ("fourier-cubic", 5e-5, 5e-4),
])  # fmt: skip
def test_errors_against_the_oracle(name: str, least: float, most: float) -> None:
    scene = bump()
    truth = raycast(scene, SIZE)[..., 0]
    assert least < np.abs(draw(name, scene, SIZE) - truth).max() / truth.max() < most


def test_premultiplied_samples_undo_the_darkening_and_leave_the_ghosts() -> None:
    scene = bump()
    truth = raycast(scene, SIZE)[..., 0]
    plain, corrected = (
        np.sqrt(np.square(draw("fourier-padded", scene, SIZE, premultiplied=each) - truth).mean())
        for each in (False, True)
    )
    assert corrected < 0.2 * plain


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("box", BOXES)
def test_the_projection_of_any_box_is_its_chord(box: str, view: str) -> None:
    scene, _ = constant_scene(box, view)
    volume = Volume(
        np.ones_like(scene.volume.values), scene.volume.spacing, scene.volume.origin, scene.volume.direction
    )
    assert scene.camera is not None
    camera = replace(
        scene.camera, height=2 * scene.camera.height
    )  # room for trilinear weights beyond the outer samples
    scene = Scene(volume, camera=camera, mode="xray")
    size = (64, 48)
    truth = raycast(scene, size)[..., 0]
    found = draw("fourier-cubic", scene, size)
    # A box's own edge is spread over a spacing and rings, but its volume is kept, unless the period cuts one sample.
    pixel = camera.height / size[1]
    assert found.sum() * pixel**2 == pytest.approx(abs(np.linalg.det(volume.box_edges)), rel=0.05)
    # Nowhere in the picture is there a second box.
    beside = raycast(Scene(_grown(volume), camera=scene.camera, mode="xray"), size)[..., 0] == 0
    assert np.abs(found[beside]).max(initial=0) < 0.06 * truth.max()


def _grown(volume: Volume) -> Volume:
    """The box with two samples more on each side."""
    origin = volume.origin - volume.world_from_index @ (2, 2, 2)
    return Volume(np.ones(np.add(volume.values.shape, 4)), volume.spacing, origin, volume.direction)


def test_a_small_period_leaves_ghosts_and_a_padded_one_hardly_any() -> None:
    # A ball at one side: its replicas appear beside it, where nothing is. Along an axis the slice's frequencies are
    # those of the transform, and there is nothing to interpolate.
    k, j, i = np.indices((16, 16, 16))
    volume = Volume(np.exp(-((i - 12) ** 2 + (j - 8) ** 2 + (k - 8) ** 2) / 2))
    ghosts = {}
    for eye in ((0, 0, -30), (-20, -15, -12)):
        camera = Camera.orthographic(volume.centre + eye, volume.centre, (0, 1, 0), height=30)
        scene = Scene(volume, camera=camera, mode="xray")
        truth = raycast(scene, SIZE)[..., 0]
        for name in WHOLE:
            ghosts[name, eye[0]] = np.abs(draw(name, scene, SIZE))[truth < 1e-4].max() / truth.max()
    assert ghosts["fourier", 0] < 1e-2
    assert ghosts["fourier", -20] > 0.05
    assert ghosts["fourier-padded", -20] < 0.5 * ghosts["fourier", -20]
    assert ghosts["fourier-cubic", -20] < 0.05 * ghosts["fourier", -20]


def test_pixels_far_beyond_the_box_are_0() -> None:
    scene = bump()
    assert scene.camera is not None
    far = draw("fourier", replace(scene, camera=replace(scene.camera, height=10 * scene.camera.height)), (60, 60))
    assert (far[:20] == 0).all() and (far[:, :20] == 0).all() and far.max() > 0


@pytest.mark.parametrize("name", [*WHOLE, "fourier-blocks"])
def test_an_eye_in_the_box_is_refused(name: str) -> None:
    scene = replace(bump(), mode="xray" if name in WHOLE else "composite")
    volume = scene.volume
    camera = Camera.orthographic(volume.centre, volume.centre + (1, 0, 0), (0, 0, 1), height=5)
    with pytest.raises(InputError, match=f"{name}: eye must be outside the box and look at all of it"):
        draw(name, replace(scene, camera=camera), SIZE)


def test_bad_settings_are_errors() -> None:
    for settings in ({"interpolation": "none"}, {"padding": 3}, {"reconstruction": "none"}):
        with pytest.raises(InputError, match=f"{next(iter(settings))} must be"):
            draw("fourier", bump(), SIZE, **settings)
    with pytest.raises(InputError, match="premultiplied needs interpolation linear, got cubic"):
        draw("fourier-cubic", bump(), SIZE, premultiplied=True)
    with pytest.raises(InputError, match="fourier: mode must be xray, got composite"):
        draw("fourier", replace(bump(), mode="composite"), SIZE)
    with pytest.raises(InputError, match="block must be from 2 to 256 samples, got 1"):
        draw("fourier-blocks", smooth_scene(), SIZE, block=1)


def test_blocks_of_a_constant_medium_are_its_chord() -> None:
    scene, expected = constant_scene("cube", "slanted")
    found = draw("fourier-blocks", scene, SIZE, block=4)
    within = inside(raycast(replace(scene, background=(0, 0, 0)), SIZE))
    # Trilinear weights fall off where the box ends, half a spacing on either side: away from that, 2 %.
    errors = np.abs(found - expected)[within]
    assert np.median(errors) < 0.02
    assert errors.max() < 0.2


def test_the_opacity_of_blocks_is_right_and_their_colour_hides_nothing_of_the_same_block() -> None:
    # Red in front of blue: in one block half of each is seen, in blocks of 4 as much as the medium lets through.
    k = np.indices((16, 16, 16))[0]
    volume = Volume((k >= 8).astype(np.float32))
    transfer = TransferFunction(np.array([0.0, 1.0]), np.array([(1.0, 0, 0), (0, 0, 1.0)]), np.array([0.2, 0.2]))
    camera = Camera.orthographic(volume.centre - (0, 0, 40), volume.centre, (0, 1, 0), height=1)
    scene = Scene(volume, transfer, camera)
    truth = raycast(scene, (1, 1))[0, 0]
    whole, parts = (draw("fourier-blocks", scene, (1, 1), block=each)[0, 0] for each in (16, 4))
    assert truth[3] == pytest.approx(-np.expm1(-3.2), rel=1e-9)
    assert whole[3] == pytest.approx(truth[3], abs=5e-3) and parts[3] == pytest.approx(truth[3], abs=5e-3)
    assert whole[0] == pytest.approx(whole[2], rel=0.02)
    assert abs(parts[0] - truth[0]) < 0.02 < abs(whole[0] - truth[0])


def test_smaller_blocks_are_nearer_to_the_oracle() -> None:
    scene = smooth_scene()
    # Fades to nothing at the border, where the box's end would have an error of its own.
    fades = np.sin(np.pi * (np.arange(24) + 0.5) / 24) ** 2
    values = scene.volume.values * fades * fades[:, np.newaxis] * fades[:, np.newaxis, np.newaxis]
    dense = TransferFunction(np.array([0, 1]), np.array([(1, 0, 0), (0, 0.3, 1)]), np.array([0.0, 2.0]))
    scene = replace(scene, volume=Volume(values, scene.volume.spacing, scene.volume.origin), transfer_function=dense)
    errors = [rms_error("fourier-blocks", scene, block=each) for each in (24, 12, 6, 3)]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 1.5e-2 and 1e-3 < errors[3] < 5e-3  # measured 2.6e-2 and 2.5e-3


def test_the_spectrum_s_memory_is_counted() -> None:
    size = (8, 8)
    complete = bump().completed(size)
    methods: dict[str, Method] = {name: method_of(name)(complete) for name in WHOLE}
    assert methods["fourier"].memory >= 8 * complete.volume.values.size
    assert 6 < methods["fourier-padded"].memory / methods["fourier"].memory < 10
