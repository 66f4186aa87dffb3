"""Values far apart: what a picture depends on keeps its digits beside samples of any size, or it is said not to."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from support import planted
from support.far_values import SIZE, VIEW, medium_to, wave

from texvol import Camera, Lighting, Renderer, Scene, TransferFunction, Volume, raycast
from texvol.scene.transfer import proposed_for
from texvol.textures.value_storage import (
    WELL,
    Storage,
    bulk_of,
    features_about,
    features_of_medium,
    other_storage,
    storage_of,
    stored_values,
)
from texvol.util.errors import AccuracyWarning

FAR = [
    (np.float64, 1e4),
    (np.float64, 1e8),
    (np.float64, -1e300),
    (np.float32, -3.4e38),
    (np.float32, 9.97e36),
    (np.float32, 1e6),
    (np.float16, 60000.0),
    (np.uint8, 255),
    (np.int16, -32768),
    (np.uint16, 65535),
    (np.int32, 2**31 - 1),
    (np.int32, -(2**31)),
    (np.uint32, 2**32 - 1),
    (np.int64, 2**62),
    (np.int64, -(2**62)),
    (np.uint64, 2**64 - 1),
]
NAMES = [f"{np.dtype(kind).name} {far:g}" for kind, far in FAR]


def with_far_sample(kind: type, far: float) -> tuple[Volume, float]:
    """A wave with one sample far off, and the wave's largest value: whole numbers have to have some steps."""
    high = 1.0 if np.dtype(kind).kind == "f" else 100.0
    values = wave(high) if high == 1 else np.rint(wave(high))
    values = values.astype(kind)
    values[8, 8, 8] = far
    return Volume(values), high


@pytest.mark.parametrize(
    "classification, kind, far",
    [  # values go to the device in post and integrated; the others are classified in double precision
        *(("post" if number % 2 else "integrated", *each) for number, each in enumerate(FAR)),
        *(("integrated" if number % 2 else "post", *each) for number, each in enumerate(FAR) if number % 5 == 1),
        *(("slab", *each) for each in FAR[1::10]),
        *(("extinction", *each) for each in FAR[6::10]),
    ],
)
def test_matter_keeps_the_wanted_error_beside_a_far_sample(
    renderer: Renderer, classification: str, kind: type, far: float
) -> None:
    volume, high = with_far_sample(kind, far)
    scene = Scene(volume, medium_to(high), VIEW, classification=classification)
    picture = renderer.render(scene, SIZE, max_error=0.01)
    error = np.abs(picture - raycast(scene, SIZE)).max()
    assert error <= 0.01
    assert error <= renderer.stats["estimated_error"] <= 0.01


@pytest.mark.parametrize(
    "mode, kind, far",
    [
        *(("isosurface", *each) for each in (*FAR[::2], *FAR[1::6])),
        *(("mip" if far > 0 else "minip", kind, far) for kind, far in (*FAR[1::2], *FAR[2::6])),
    ],
)
def test_values_and_surfaces_are_exact_beside_a_far_sample(
    renderer: Renderer, mode: str, kind: type, far: float
) -> None:
    volume, high = with_far_sample(kind, far)
    scene = Scene(
        volume, camera=VIEW, mode=mode, isovalue=0.5 * high if mode == "isosurface" else None, classification="slab"
    )
    picture, truth = renderer.render(scene, SIZE).astype(np.float64), raycast(scene, SIZE)
    held = np.abs(truth) < np.finfo(np.float32).max
    error = np.where(held, np.abs(picture - truth), np.where(np.isinf(picture), 0, np.inf))
    # Rays that show the far sample are known to float32's rounding of it, all others to that of the wave.
    values = volume.values.copy()
    values[8, 8, 8] = values[7, 8, 8]
    # All of a surface is where its values are ordinary; how it is lit depends on the range of all.
    ordinary = (truth == raycast(replace(scene, volume=Volume(values)), SIZE)).all(axis=2) | (mode == "isosurface")
    assert ordinary.mean() > 0.9
    # 16 bits with a sign are stored from their least value on: float32 rounds them to 2^-24 of half their range, and a
    # cubic of four fetches amplifies that by up to 3.
    rounding = 3 * 2.0**-24 * 32768 if kind is np.int16 else 0.0
    assert error[ordinary].max() <= max((2e-5 if mode == "isosurface" else 2e-6) * high, rounding)
    assert (error[~ordinary] <= np.maximum(3e-5 * np.abs(truth[~ordinary]), 2e-7 * min(abs(far), 1e38))).all()
    assert not error[held].max(initial=0) > renderer.stats["estimated_error"]


@pytest.mark.parametrize("mode", ["xray", "average"])
def test_rays_beside_a_far_sample_are_summed_as_without_it(renderer: Renderer, mode: str) -> None:
    volume, _ = with_far_sample(np.float64, 1e8)
    plain = Volume(wave())
    pictures = [
        renderer.render(Scene(each, camera=VIEW, mode=mode, classification="slab"), SIZE, sampling_rate=4)
        for each in (volume, plain)
    ]
    truth = raycast(Scene(volume, camera=VIEW, mode=mode, classification="slab"), SIZE)
    without = raycast(Scene(plain, camera=VIEW, mode=mode, classification="slab"), SIZE)
    beside = np.abs(truth - without).max(axis=2) == 0
    assert 0.5 < beside.mean() < 1
    np.testing.assert_allclose(pictures[0][beside], pictures[1][beside], rtol=0, atol=4e-6 * without.max())


def test_a_hot_pixel_makes_no_surface_of_what_lies_above_the_isovalue(renderer: Renderer) -> None:
    values = np.full((12, 12, 12), 0.7)
    values[5, 6, 7] = 1e7
    scene = Scene(
        Volume(values), camera=Camera.framing(Volume(values)), mode="isosurface", isovalue=0.5, classification="slab"
    )
    assert not renderer.render(scene, SIZE)[..., 3].any()
    assert not raycast(scene, SIZE)[..., 3].any()


@pytest.mark.parametrize("kind", [np.uint16, np.float32, np.float64])
def test_light_has_directions_beside_a_far_sample(renderer: Renderer, kind: type) -> None:
    values = np.rint(wave(100)).astype(kind)
    values[8, 8, 8] = 65535
    lighting = Lighting(fade=0.5)
    scene = Scene(Volume(values), medium_to(100.0), VIEW, classification="post", lighting=lighting)
    picture = renderer.render(scene, SIZE, sampling_rate=16)
    difference = np.abs(picture - raycast(scene, SIZE)).max(axis=2)
    assert np.median(difference) < 1e-3
    assert difference.max() < 0.02


def test_values_far_from_zero_are_told_apart_in_single_precision(renderer: Renderer) -> None:
    values = (2.0**30 + 64 * np.rint(3 * wave())).astype(np.float32)
    positions = 2.0**30 + np.array([0, 64, 192])
    medium = TransferFunction(positions, np.eye(3), np.array([0, 0.1, 0.5]))
    scene = Scene(Volume(values), medium, VIEW, classification="post")
    assert np.abs(renderer.render(scene, SIZE, max_error=0.01) - raycast(scene, SIZE)).max() <= 0.01


def test_what_single_precision_cannot_hold_is_said(renderer: Renderer) -> None:
    values = wave()
    values[::2] += 1e9
    positions = [0, 1, 1e9, 1e9 + 1]
    medium = TransferFunction(np.array(positions), np.zeros((4, 3)), np.array([0, 0.5, 0.5, 0]))
    scene = Scene(Volume(values), medium, VIEW, classification="post")
    with pytest.warns(AccuracyWarning, match="single precision cannot hold"):
        renderer.render(scene, SIZE, max_error=0.01)
    assert renderer.stats["estimated_error"] > 0.01
    with warnings.catch_warnings():  # which are classified in double precision
        warnings.simplefilter("error")
        renderer.render(Scene(Volume(values), medium, VIEW, classification="slab"), SIZE)


def test_the_estimate_is_not_made_from_the_texels_that_are_wrong(renderer: Renderer, monkeypatch) -> None:
    """A storage that loses the digits, as values had before: the reference is stored otherwise, and tells."""
    volume, high = with_far_sample(np.float64, 1e8)
    features = features_of_medium(medium_to(high), volume)
    middle = features.storage("r32f", 5e7, 5e7)
    monkeypatch.setattr("texvol.textures.value_texture.storage_of", lambda *_: middle)
    scene = Scene(volume, medium_to(high), VIEW, classification="post")
    with Renderer() as wrong:
        picture = wrong.render(scene, SIZE)
        error = np.abs(picture - raycast(scene, SIZE)).max()
        assert error > 0.3
        assert wrong.stats["estimated_error"] >= error
        with pytest.warns(AccuracyWarning):
            wrong.render(scene, SIZE, max_error=0.01)


@pytest.mark.parametrize(("kind", "far"), FAR, ids=NAMES)
def test_stored_values_differ_by_their_rounding_alone(kind: type, far: float) -> None:
    volume, high = with_far_sample(kind, far)
    features = features_of_medium(medium_to(high), volume)
    usual, other = storage_of(volume, features), other_storage(volume, features)
    assert usual.condition <= (2048 if kind is np.int16 else WELL)
    near = np.abs(volume.values.astype(np.float64)) <= high
    for storage in (usual, other):
        texels = stored_values(volume.values, storage).astype(np.float64)
        texels /= 65535 if storage.texel_format == "r16" else 1
        back = storage.offset + storage.scale * texels
        np.testing.assert_allclose(back[near], volume.values[near].astype(np.float64), rtol=0, atol=1e-5 * high)
    assert (other.offset, other.scale) != (usual.offset, usual.scale)


def test_ordinary_values_are_stored_as_they_are() -> None:
    for kind, expected in ((np.uint8, "r16"), (np.int16, "r16"), (np.float16, "r16f"), (np.float32, "r32f")):
        volume = Volume((50 * wave()).astype(kind))
        storage = storage_of(volume, features_of_medium(medium_to(50.0), volume))
        assert storage.texel_format == expected
        assert storage.vouches_for_itself(volume)
        if kind in (np.float16, np.float32):
            assert (storage.offset, storage.scale) == (0, 1)


def test_most_values_are_found_beside_many_of_one_far_value() -> None:
    values = wave()
    values[:6] = -9999.0  # of a third of the samples
    low, high = bulk_of(Volume(values))
    assert 0 <= low < 0.1 and 0.9 < high <= 1
    assert bulk_of(Volume(np.zeros((2, 2, 2)))) == (0, 0)
    assert bulk_of(Volume(np.full((2, 2, 2), np.nan))) == (0, 0)


def test_an_offset_lies_where_the_steepest_change_is() -> None:
    volume = Volume(wave(1e6))
    medium = TransferFunction(np.array([0, 2e5, 7e5, 7e5 + 1, 1e6]), np.zeros((5, 3)), np.array([0, 0.1, 0.1, 5, 5]))
    storage = storage_of(volume, features_of_medium(medium, volume))
    assert isinstance(storage, Storage) and 7e5 - 1 <= storage.offset <= 7e5 + 2
    about = storage_of(volume, features_about(volume, 123456.0))
    assert about.condition <= WELL


def test_a_lost_offset_is_seen(renderer: Renderer) -> None:
    """The check can fail: with the margin back that a far value gives to all, a hot pixel makes a surface."""
    with (
        planted.planted(("bool any_far(vec4 above)", "return any_far_right(1e-30 * above);")) as wrong,
        pytest.raises(AssertionError),
    ):
        test_a_hot_pixel_makes_no_surface_of_what_lies_above_the_isovalue(wrong)


@pytest.mark.parametrize("classification", ["post", "integrated"])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_opaque_steps_and_denormal_values_are_found_beside_far_ones(
    renderer: Renderer, classification: str, kind: type
) -> None:
    values = (1e-40 * wave()).astype(kind)
    values[:5] = 1e8
    positions = 1e-40 * np.array([0, 0.6, 0.6, 1])
    # One colour for all that is opaque: of that, a ray into the far values crosses less than float32 tells apart.
    colors = np.array([[1, 0, 0], [0, 1, 0], [1, 1, 1], [1, 1, 1]])
    medium = TransferFunction(positions, colors, np.array([0, 0.2, np.inf, np.inf]))
    scene = Scene(Volume(values), medium, VIEW, classification=classification)
    difference = np.abs(renderer.render(scene, SIZE, sampling_rate=16) - raycast(scene, SIZE)).max(axis=2)
    # Rays that touch the edge of what is opaque may miss it.
    assert (difference > 0.02).mean() < 0.01
    assert np.median(difference) < 1e-3


@pytest.mark.parametrize("mode", ["xray", "average", "mip", "minip"])
def test_pictures_of_numbers_hold_far_values_beside_denormal_ones(renderer: Renderer, mode: str) -> None:
    values = 1e-40 * wave()
    values[:5] = 9.97e36
    scene = Scene(Volume(values), camera=VIEW, mode=mode, classification="slab")
    picture, truth = renderer.render(scene, SIZE, sampling_rate=8), raycast(scene, SIZE)
    np.testing.assert_allclose(picture, truth, rtol=2e-2, atol=2e-3 * truth.max())


def test_most_values_of_few_kinds_are_all_of_them() -> None:
    values = np.zeros((4, 4, 4), np.float32)
    values[2:] = 100
    assert bulk_of(Volume(values)) == (0, 100)
    values[0, 0, 0] = 50
    values[3, 3, 3] = 1e8
    assert bulk_of(Volume(values)) == (0, 100)


def test_a_constant_beside_a_far_value_has_a_proposal() -> None:
    for value in np.random.default_rng(0).uniform(0, 1e6, 100):
        values = np.full((2, 8, 8), value)
        values[1, 4, 5] = 0.01 * value
        proposed = proposed_for(Volume(values))
        assert (np.diff(proposed.values) >= 0).all()


def test_a_maximum_between_far_and_ordinary_values_is_found(renderer: Renderer) -> None:
    """Cells that all touch a far value: what rays find there is neither far nor ordinary."""
    values = np.random.default_rng(5).uniform(300, 301, (5, 10, 5)).astype(np.float32)
    values[::2] = -9700
    scene = Scene(Volume(values), camera=Camera.framing(Volume(values)), mode="mip", classification="slab")
    picture, truth = renderer.render(scene, SIZE), raycast(scene, SIZE)
    assert ((truth[..., 0] < 0) & (truth[..., 0] > -1000)).any()
    assert np.abs(picture - truth).max() <= 4e-6 * 9700
    assert np.abs(picture - truth).max() <= renderer.stats["estimated_error"]


def test_a_surface_far_from_most_values_is_found(renderer: Renderer) -> None:
    values = 1e6 + np.random.default_rng(6).random((6, 3, 13))
    values[::2] = 3.6e5
    scene = Scene(
        Volume(values), camera=Camera.framing(Volume(values)), mode="isosurface", isovalue=5e5, classification="slab"
    )
    assert np.abs(renderer.render(scene, SIZE) - raycast(scene, SIZE)).max() <= 2e-5
