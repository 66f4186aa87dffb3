"""Clip planes, crop box and caps: exact for every ray, whatever the slabs, the bricks and the mode."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, constant, inside, random_volume, smooth_volume, sparse_volume

from texvol import (
    Camera,
    ClipPlane,
    InputError,
    Light,
    Lighting,
    Renderer,
    Scene,
    TransferFunction,
    Volume,
    compare,
    raycast,
)
from texvol.scene.cutting import Cutting
from texvol.scene.scene import CLASSIFICATIONS, Classification

SIZE = (72, 64)
SMALL = (36, 32)


def planes_through(volume: Volume) -> tuple[ClipPlane, ...]:
    """Two oblique planes near the middle; normals of other lengths than 1."""
    c, r = volume.centre, volume.radius
    normals = (2.0, 0.8, -0.6), (-0.1, 0.5, 0.25)
    return tuple(ClipPlane(n, float(np.dot(n, c) - 0.2 * r * np.linalg.norm(n))) for n in normals)


def crop_of(volume: Volume) -> tuple[tuple[float, float], ...]:
    c, r = volume.centre, volume.radius
    return tuple((float(c[i] - 0.5 * r), float(c[i] + 0.4 * r)) for i in range(3))


def view(volume: Volume, projection: str) -> Camera:
    eye = volume.centre + volume.radius * np.array([1.5, -2.0, 1.2])
    return Camera.framing(volume, projection, eye=eye)  # type: ignore[arg-type]


def cut_scene(volume: Volume, transfer: Any, projection: str = "perspective", **more: Any) -> Scene:
    return Scene(
        volume,
        transfer,
        view(volume, projection),
        clip=planes_through(volume),
        crop=crop_of(volume),
        **({"classification": "slab"} | more),
    )  # type: ignore[arg-type]


def lengths_kept(scene: Scene, size: tuple[int, int]) -> np.ndarray:
    """World length of each ray between all planes, by cutting it with one after the other; shape (height, width)."""
    assert scene.camera is not None and scene.crop is not None
    eyes, directions = scene.camera.rays(size)
    near, far = np.zeros(directions.shape[:2]), np.full(directions.shape[:2], np.inf)
    index = np.linalg.inv(scene.volume.box_edges)
    box = [(row, float(row @ scene.volume.centre) - 0.5) for row in index]
    box += [(-row, -float(row @ scene.volume.centre) - 0.5) for row in index]
    crop = [(s * np.eye(3)[a], s * end) for a, r in enumerate(scene.crop) for s, end in ((1.0, r[0]), (-1.0, r[1]))]
    for normal, offset in [*box, *crop, *((np.array(p.normal), p.offset) for p in scene.clip)]:
        height, rise = eyes @ normal - offset, directions @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -height / rise
        near = np.where(rise > 0, np.maximum(near, t), near)
        far = np.where(rise < 0, np.minimum(far, t), far)
    return np.maximum(far - near, 0)


@pytest.mark.parametrize(
    "classification, rate, projection",
    [
        (*pair, ("orthographic", "perspective")[number % 2])
        for number, pair in enumerate(itertools.product(CLASSIFICATIONS, [0.3, 1.0, 2.7]))
    ],
)
def test_a_clipped_and_cropped_constant_medium_keeps_its_closed_form(
    renderer: Renderer, classification: Classification, rate: float, projection: str
) -> None:
    volume = random_volume(5, (12, 10, 14))
    scene = cut_scene(volume, constant(0.2), projection, classification=classification)
    opacity = -np.expm1(-0.2 * lengths_kept(scene, SIZE))
    exact = opacity[..., np.newaxis] * np.array([0.9, 0.6, 0.3, 1.0])
    assert 0.1 < (opacity > 0).mean() < 0.6, "cut, and not cut away"
    # As for the uncut medium: float32's rounding, whatever the slabs.
    assert np.abs(renderer.render(scene, SIZE, sampling_rate=rate) - exact).max() < 1e-6
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12


MEDIA = {"noise": (random_volume(1, (20, 18, 16)), FOG), "smooth": (smooth_volume(32), BONE)}


# What the oracle integrates: the medium of the samples, or of interpolated values.
SAME_MEDIUM: dict[str, Classification] = {
    "slab": "slab", "extinction": "slab", "post": "post", "integrated": "post"
}  # fmt: skip


@cache
def cut_and_truth(kind: str, classification: Classification, caps: bool) -> tuple[Scene, np.ndarray]:
    """A cut scene, and its picture by the oracle."""
    scene = cut_scene(*MEDIA[kind], classification=classification, caps=caps)
    return scene, raycast(scene, SIZE)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
@pytest.mark.parametrize("kind, caps", [("noise", False), ("smooth", True)])
def test_cut_pictures_converge_to_the_oracle(
    renderer: Renderer, classification: Classification, kind: str, caps: bool
) -> None:
    scene, truth = cut_and_truth(kind, SAME_MEDIUM[classification], caps)
    scene = replace(scene, classification=classification)
    pictures = [renderer.render(scene, SIZE, sampling_rate=rate, texture_format="rgba32f") for rate in (2, 8)]
    errors = [compare(picture, truth).rms_error for picture in pictures]
    assert errors[0] < 1e-3
    # Two doublings: order 1 at least (`slab` on dense matter), where rounding is not reached.
    assert errors[1] < max(errors[0] / 3.2, 5e-6)


@pytest.mark.parametrize("mode", ["xray", "average", "mip", "minip", "isosurface"])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_other_modes_see_what_is_kept(renderer: Renderer, mode: str, projection: str) -> None:
    volume = smooth_volume(24)
    scene = cut_scene(volume, None, projection, mode=mode, isovalue=0.55 if mode == "isosurface" else None)
    picture, truth = renderer.render(scene, SIZE, sampling_rate=4), raycast(scene, SIZE)
    same = (picture[..., 3] > 0) == (truth[..., 3] > 0)
    assert same.mean() > 0.999 and 0.05 < (truth[..., 3] > 0).mean() < 0.6
    scale = max(float(np.abs(truth[..., :3]).max()), 1.0)
    off = np.abs(picture - truth)[same].max(axis=-1) / scale
    # Sums converge with the slabs; the others are exact but for float32, and rays that just meet a surface.
    assert np.quantile(off, 0.99) < (2e-3 if mode in ("xray", "average") else 1e-4)


@pytest.mark.parametrize("classification", ["slab", "post"])
def test_light_and_shadows_are_those_of_what_is_kept(renderer: Renderer, classification: Classification) -> None:
    lighting = Lighting((Light("directional", (-1.0, -2.0, 2.0)),), shadows=True, two_sided=False)
    scene = cut_scene(smooth_volume(32), BONE, classification=classification, lighting=lighting)
    truth = raycast(scene, SMALL)
    assert compare(renderer.render(scene, SMALL, sampling_rate=4), truth).rms_error < 4e-3
    # What was cut away casts none: the picture is another one with the shadows of the whole.
    whole = raycast(replace(scene, clip=(), crop=None), SMALL)
    assert compare(whole, truth).rms_error > 0.05
    unshadowed = raycast(replace(scene, lighting=replace(lighting, shadows=False)), SMALL)
    assert compare(unshadowed, truth).rms_error > 0.01


@pytest.mark.parametrize("classification, caps", [("extinction", False), *((each, True) for each in CLASSIFICATIONS)])
def test_bricks_and_leaps_make_the_same_picture(renderer: Renderer, classification: Classification, caps: bool) -> None:
    volume = sparse_volume(3)
    scene = cut_scene(volume, FOG, classification=classification, caps=caps)
    expected = renderer.render(scene, SMALL, sampling_rate=1.5, skip_empty=False)
    assert np.abs(renderer.render(scene, SMALL, sampling_rate=1.5) - expected).max() < 2e-6
    with Renderer(texture_memory=0.1) as pieces:
        assert np.abs(pieces.render(scene, SMALL, sampling_rate=1.5) - expected).max() < 2e-6
        assert quick_stats(pieces)["bricks_total"] > 1 and expected[..., 3].max() > 0.1


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_an_eye_inside_sees_what_is_kept(renderer: Renderer, projection: Any) -> None:
    volume = random_volume(2, (16, 16, 16))
    scene = replace(cut_scene(volume, FOG), camera=inside(volume, projection), classification="extinction")
    assert compare(renderer.render(scene, SIZE, sampling_rate=4), raycast(scene, SIZE)).max_error < 2e-3


def test_a_cap_has_the_colour_of_the_matter_that_is_cut(renderer: Renderer) -> None:
    """Value x from 0 to 1 along x, red below a half, green above; cut across y."""
    values = np.broadcast_to(np.linspace(0, 1, 16, dtype=np.float32), (8, 16, 16))
    colors = np.array([(1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)], float)
    transfer = TransferFunction(np.array([0, 0.5, 0.5, 1]), colors, np.array([0.01, 0.01, 0.01, 0.01]))
    volume = Volume(values)
    camera = Camera.orthographic((7.5, -50, 3.5), (7.5, 0, 3.5), (0, 0, 1), height=8)
    scene = Scene(volume, transfer, camera, clip=(ClipPlane((0, 1, 0), 6.0),), caps=True, classification="post")
    picture = renderer.render(scene, (32, 16))
    expected = np.zeros((16, 32, 4))
    expected[:, :16], expected[:, 16:] = (1, 0, 0, 1), (0, 1, 0, 1)
    np.testing.assert_allclose(picture, expected, atol=1e-6)
    assert "caps" in quick_stats(renderer)["modelled"] and "clip planes" in quick_stats(renderer)["modelled"]
    # From behind, the plane opens nothing: the ray leaves there.
    behind = replace(scene, camera=Camera.orthographic((7.5, 50, 3.5), (7.5, 0, 3.5), (0, 0, 1), height=8))
    assert renderer.render(behind, (32, 16))[..., 3].max() < 0.2


def test_planes_that_keep_all_or_nothing(renderer: Renderer) -> None:
    volume = random_volume(4)
    scene = Scene(volume, FOG, view(volume, "perspective"), classification="slab")
    plain = renderer.render(scene, SIZE)
    far = float(-10 * volume.radius)
    kept = renderer.render(replace(scene, clip=(ClipPlane((1, 0, 0), far),)), SIZE)
    np.testing.assert_allclose(kept, plain, atol=1e-7)
    gone = replace(scene, clip=(ClipPlane((1, 0, 0), 1e9),), background=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(renderer.render(gone, SIZE)[..., :3], np.broadcast_to((0.1, 0.2, 0.3), (64, 72, 3)))
    assert not renderer.render(replace(scene, crop=((1e8, 1e9),) * 3), SIZE).any()
    twenty = tuple(ClipPlane((np.cos(a), np.sin(a), 0.1), far) for a in np.linspace(0, 6, 20))
    np.testing.assert_allclose(renderer.render(replace(scene, clip=twenty), SIZE), plain, atol=1e-7)


@pytest.mark.parametrize("scale", [1e-60, 1e-9, 1e9, 1e60])
def test_worlds_of_any_size_are_cut_alike(renderer: Renderer, scale: float) -> None:
    def world(scale: float) -> Scene:
        volume = Volume(random_volume(6).values, spacing=(scale, 1.3 * scale, 0.7 * scale), origin=(9 * scale,) * 3)
        medium = constant(0.3 / scale)
        return cut_scene(volume, medium)

    np.testing.assert_allclose(renderer.render(world(scale), SIZE), renderer.render(world(1.0), SIZE), atol=2e-6)


def test_nothing_cut_compiles_nothing() -> None:
    assert len(Cutting()) == 0 and not Cutting()
    assert len(Cutting((ClipPlane((1, 0, 0), 0),), ((0, 1), (-np.inf, 1), (-np.inf, np.inf)))) == 4
    scene = Scene(random_volume(1), caps=True, classification="slab")
    assert not scene.cutting.caps


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ClipPlane((0, 0, 0), 1), "0, 0, 0"),
        (lambda: ClipPlane((1, np.nan, 0), 1), "finite"),
        (lambda: ClipPlane((1, 0), 1), "three"),  # type: ignore[arg-type]
        (lambda: ClipPlane((1, 0, 0), np.inf), "offset"),
        (
            lambda: Scene(random_volume(1), crop=((0, 1), (2, 1), (0, 1)), classification="slab"),
            "y must go from less to more",
        ),
        (lambda: Scene(random_volume(1), crop=((0, 1), (0, 1)), classification="slab"), "crop box"),  # type: ignore[arg-type]
        (lambda: Scene(random_volume(1), crop=((0, np.nan), (0, 1), (0, 1)), classification="slab"), "crop box"),
        (lambda: Scene(random_volume(1), clip=((1, 0, 0, 0),), classification="slab"), "ClipPlane"),  # type: ignore[arg-type]
        (
            lambda: Scene(
                random_volume(1), mode="mip", caps=True, clip=(ClipPlane((1, 0, 0), 0),), classification="slab"
            ),
            "mip",
        ),
    ],
)
def test_what_cuts_nothing_sensible_is_refused(make: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()
