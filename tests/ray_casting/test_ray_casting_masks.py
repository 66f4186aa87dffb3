"""The oracle on masks, labels and colours: what is hidden or faded, named, or has a colour of its own."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from support.scenes import BONE, FOG, constant, path_lengths, random_volume

from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (14, 12)
EXACT = {"rtol": 1e-12, "atol": 1e-13}  # see test_ray_casting_several
AGREED = {"rtol": 0, "atol": 1e-9}
ALL = pytest.mark.parametrize("classification", CLASSIFICATIONS)
PROJECTIONS = pytest.mark.parametrize("projection", ["orthographic", "perspective"])
SHADOWED = Lighting((Light("directional", (1, -2, 0.5)),), shadows=True)
LIGHTS = Lighting((Light("point", (3.0, 9.0, 11.0), (0.3, 0.8, 0.6)), Light("directional", (1, -2, 0.5))))
RED, BLUE = (0.9, 0.2, 0.1), (0.1, 0.3, 0.8)


def view(volume: Volume, projection: str = "perspective") -> Camera:
    return Camera.framing(volume, projection, fov=50 if projection == "perspective" else None)  # type: ignore[arg-type]


def scene(volume: Volume, medium: TransferFunction, **more: Any) -> Scene:
    return Scene(volume, medium, view(volume), **({"classification": "slab"} | more))


def weight(volume: Volume, amount: float) -> Mask:
    return Mask(np.full(volume.values.shape, amount))


@pytest.mark.parametrize(
    ("classification", "light"),
    [
        *((kind, light) for kind in CLASSIFICATIONS for light in (None, LIGHTS)),
        ("extinction", SHADOWED),
        ("post", SHADOWED),
    ],
)
def test_a_mask_of_ones_changes_nothing_and_one_of_zeros_leaves_nothing(classification: Any, light: Any) -> None:
    volume = random_volume(1, (5, 4, 6))
    bare = scene(volume, BONE, classification=classification, lighting=light, depth_cue=DepthCue(0.5))
    ones, zeros = (replace(bare, mask=weight(volume, amount)) for amount in (1.0, 0.0))
    np.testing.assert_allclose(raycast(ones, SIZE), raycast(bare, SIZE), **AGREED)
    np.testing.assert_array_equal(raycast(zeros, SIZE), 0)


@pytest.mark.parametrize(
    ("classification", "light"),
    [
        *((kind, light) for kind in CLASSIFICATIONS for light in (None, LIGHTS)),
        ("extinction", SHADOWED),
        ("post", SHADOWED),
    ],
)
def test_a_constant_weight_is_so_much_extinction(classification: Any, light: Any) -> None:
    """The quarter that is 0.25 in any precision; shadows are cast by it, too."""
    volume = random_volume(2, (5, 4, 6))
    thin = replace(BONE, extinctions=BONE.extinctions / 4)
    common: dict[str, Any] = {"classification": classification, "lighting": light}
    faded = raycast(scene(volume, BONE, mask=weight(volume, 0.25), **common), SIZE)
    np.testing.assert_allclose(faded, raycast(scene(volume, thin, **common), SIZE), **AGREED)


def columns(values: np.ndarray, weights: np.ndarray, medium: TransferFunction, **more: Any) -> np.ndarray:
    """rgba of one ray along z, through samples and weights that change along it alone."""
    shape = (len(values), 3, 3)
    volume = Volume(np.broadcast_to(values[:, None, None], shape))
    mask = Mask(np.broadcast_to(weights[:, None, None], shape))
    camera = Camera.orthographic((1, 1, -10), (1, 1, 0), (0, 1, 0), height=1)
    return raycast(Scene(volume, medium, camera, mask=mask, **({"classification": "slab"} | more)), (1, 1))[0, 0]


@ALL
@pytest.mark.parametrize("emissive", [False, True])
def test_weights_between_samples_are_held_against_quadrature(classification: Any, emissive: bool) -> None:
    values, weights = np.array([0, 0.9, 0.3, 0.8, 0.1]), np.array([1, 0.25, 0.5, 0, 1])
    medium = TransferFunction([0, 0.5, 1], [RED, BLUE, (1, 1, 1)], [0.1, 2.0, 0.5], emissive=emissive)
    k = np.arange(5)
    samples = medium.classify(values)

    def at(z: float) -> tuple[np.ndarray, float]:
        if classification in ("slab", "extinction"):
            q = np.array([np.interp(z, k, weights * samples.emission[:, c]) for c in range(3)])
            return q, float(np.interp(z, k, weights * samples.extinction))
        q, tau = medium.classify(np.interp(z, k, values))
        fraction = np.interp(z, k, weights)
        return fraction * q, float(fraction * tau)

    # Where anything has a kink: samples, and where the value meets 0.5.
    kinks = np.sort([-0.5, 0, 5 / 9, 1, 5 / 3, 2, 2.4, 3, 3 + 3 / 7, 4, 4.5])

    def integral(f: Any, until: float) -> float:
        ends = [*kinks[kinks < until], until]
        return sum(quad(f, a, b, epsabs=1e-13)[0] for a, b in pairwise(ends))

    def depth(z: float) -> float:
        return integral(lambda x: at(x)[1], z)

    picture = columns(values, weights, medium, classification=classification)
    assert picture[3] == pytest.approx(-np.expm1(-depth(4.5)), abs=1e-10)
    red = integral(lambda z: at(z)[0][0] * np.exp(-depth(z)), 4.5)
    assert picture[0] == pytest.approx(red, abs=1e-9)


@ALL
def test_what_is_opaque_stays_so_under_any_weight_but_0(classification: Any) -> None:
    medium = TransferFunction([0, 0.5, 0.5, 1], [RED, RED, BLUE, BLUE], [0.3, 0.3, np.inf, np.inf])
    values = np.array([0, 0, 1, 1, 0.0])
    opaque = columns(values, np.array([1, 1, 0.1, 0, 1]), medium, classification=classification)
    bare = columns(values, np.ones(5), medium, classification=classification)
    assert opaque[3] == bare[3] == 1
    hidden = columns(values, np.array([1, 1, 0, 0, 1]), medium, classification=classification)
    if classification in ("slab", "extinction"):
        assert hidden[3] == pytest.approx(-np.expm1(-0.3 * 3.0), rel=1e-12)  # from 0 to 1 and so on: 1.5 + ½, ½ + ½
    else:
        assert hidden[3] == 1  # between samples 1 and 2 some of it is there


def test_a_mask_does_not_bring_back_what_is_missing() -> None:
    values = np.array([0.5, np.nan, 0.5, 0.5])
    for classification, length in (("extinction", 0.5 + 0.5 + 0.5 + 1.5), ("post", 0.5 + 1.5)):
        picture = columns(values, np.ones(4), constant(0.4), classification=classification)
        assert picture[3] == pytest.approx(-np.expm1(-0.4 * length), rel=1e-12)


def by_voxels(volume: Volume, of_voxel: np.ndarray, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """Picture of voxels that are constant: emission and extinction (z, y, x, 4), each ray cut at all their faces."""
    eyes, directions = (each.reshape(-1, 3) for each in camera.rays(size))
    picture = np.zeros((len(eyes), 4))
    starts = (eyes - volume.origin) @ volume.index_from_world.T + 0.5
    steps = directions @ volume.index_from_world.T
    for ray, (start, step) in enumerate(zip(starts, steps, strict=True)):
        faces = [0.0]
        for axis, count in enumerate(volume.dimensions):
            faces += [(face - start[axis]) / step[axis] for face in range(count + 1)]
        s = np.sort(np.maximum(faces, 0))
        index = np.floor(start + ((s[:-1] + s[1:]) / 2)[:, None] * step).astype(int)
        inside = ((index >= 0) & (index < volume.dimensions)).all(axis=1)
        x, y, z = np.where(inside[:, None], index, 0).T
        glow = np.where(inside[:, None], of_voxel[z, y, x], 0)
        depths = glow[:, 3] * np.diff(s)
        before = np.cumsum(depths) - depths
        fraction = np.divide(-np.expm1(-depths), glow[:, 3], out=np.zeros_like(depths), where=glow[:, 3] > 0)
        picture[ray, :3] = (np.exp(-before) * fraction) @ glow[:, :3]
        picture[ray, 3] = -np.expm1(-depths.sum())
    return picture.reshape(size[1], size[0], 4)


LABELS = TransferFunction(
    np.repeat([0, 1, 2, 7], 2) + np.tile([-0.5, 0.5], 4) * 0.2,
    np.repeat([RED, BLUE, (1, 1, 1), RED], 2, axis=0),
    np.repeat([0, 0.3, 0.1, 0.8], 2),
)


def label_volume(seed: int = 3, dtype: Any = np.uint8) -> Volume:
    names = np.random.default_rng(seed).choice([0, 1, 2, 7], (6, 5, 7)).astype(dtype)
    return Volume(names, (1, 1.2, 0.8), (3, 4, 5), [[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]], labels=True)


@PROJECTIONS
@ALL
@pytest.mark.parametrize("masked", [False, True])
def test_labels_are_constant_in_their_voxels(classification: Any, projection: str, masked: bool) -> None:
    volume = label_volume()
    weights = np.random.default_rng(5).choice([0, 0.25, 0.5, 1], volume.values.shape)
    camera = view(volume, projection)
    q, tau = LABELS.classify(volume.values)
    glow = np.concatenate([q, tau[..., None]], axis=-1) * (weights[..., None] if masked else 1)
    mask = Mask(weights) if masked else None
    picture = raycast(Scene(volume, LABELS, camera, classification=classification, mask=mask), SIZE)
    np.testing.assert_allclose(picture, by_voxels(volume, glow, camera, SIZE), **EXACT)


def test_labels_of_any_type_look_the_same() -> None:
    pictures = [raycast(scene(label_volume(dtype=dtype), LABELS), SIZE) for dtype in (np.uint8, np.int64, np.float32)]
    assert pictures[0].any()
    for picture in pictures[1:]:
        np.testing.assert_array_equal(picture, pictures[0])


def colored(values: np.ndarray, colors: Any, **more: Any) -> Volume:
    return Volume(
        values, (1, 1.2, 0.8), colors=np.broadcast_to(np.asarray(colors, np.float32), (*values.shape, 3)), **more
    )


@ALL
@pytest.mark.parametrize("light", [None, LIGHTS], ids=["unlit", "lit"])
def test_one_colour_of_all_samples_is_that_of_the_transfer_function(classification: Any, light: Any) -> None:
    """Whatever the classification, what is seen is classified before it is interpolated."""
    values = random_volume(6).values
    color = np.array([0.5, 0.25, 0.75])  # single precision holds them
    tinted = replace(BONE, colors=BONE.colors * color)
    volume = colored(values, color)
    plain = Volume(values, volume.spacing)
    picture = raycast(scene(volume, BONE, classification=classification, lighting=light), SIZE)
    np.testing.assert_allclose(picture, raycast(scene(plain, tinted, lighting=light), SIZE), **AGREED)


def test_colours_between_samples_are_premultiplied() -> None:
    """Extinction a to b and straight colour c to d: emission goes linearly from a c to b d."""
    z = np.arange(2.0)
    colors = np.zeros((2, 1, 1, 3))
    colors[0], colors[1] = (1, 0.5, 0.25), (0, 0.75, 0.5)
    volume = Volume((0.5 + z)[:, None, None], colors=colors)
    camera = Camera.orthographic((0, 0, -10), (0, 0, 0), (0, 1, 0), height=1)
    picture = raycast(
        Scene(volume, TransferFunction([0, 2], [(1, 1, 1)] * 2, [0, 2]), camera, classification="slab"), (1, 1)
    )[0, 0]
    tau = lambda s: np.interp(s, z, [0.5, 1.5])  # noqa: E731
    depth = lambda s: quad(tau, -0.5, s, points=[0, 1] if s > 1 else None, epsabs=1e-14)[0]  # noqa: E731
    for channel in range(3):
        q = lambda s: np.interp(s, z, [0.5 * colors[0, 0, 0, channel], 1.5 * colors[1, 0, 0, channel]])  # noqa: B023, E731
        light = sum(
            quad(lambda s: q(s) * np.exp(-depth(s)), a, b, epsabs=1e-13)[0]  # noqa: B023
            for a, b in ((-0.5, 0), (0, 1), (1, 1.5))
        )
        assert picture[channel] == pytest.approx(light, abs=1e-10)
    assert picture[3] == pytest.approx(-np.expm1(-2.0), rel=1e-12)


def test_a_constant_coloured_box_has_its_closed_form() -> None:
    volume = colored(np.full((4, 5, 6), 0.5), (0.25, 0.5, 1.0))
    emissive = TransferFunction([0], [(0.5, 1, 0.5)], [0.2], emissive=True)
    camera = view(volume)
    lengths = path_lengths(volume, camera, SIZE)
    alpha = -np.expm1(-0.2 * lengths)
    picture = raycast(Scene(volume, emissive, camera, classification="post"), SIZE)
    expected = alpha[..., None] * np.array([0.25 * 0.5 / 0.2, 0.5 / 0.2, 0.5 / 0.2, 1.0])
    np.testing.assert_allclose(picture, expected, **EXACT)


@ALL
def test_opaque_samples_show_their_own_colour(classification: Any) -> None:
    volume = colored(np.full((4, 5, 6), 0.5), (0.25, 0.5, 1.0))
    picture = raycast(scene(volume, constant(np.inf, (1, 0.5, 0.5)), classification=classification), SIZE)
    met = picture[..., 3] > 0
    assert met.any()
    np.testing.assert_allclose(picture[met] - (0.25, 0.25, 0.5, 1), 0, atol=1e-14)


@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average", "isosurface"])
def test_in_other_modes_hidden_samples_are_missing(mode: Any) -> None:
    values = np.random.default_rng(7).integers(0, 255, (7, 8, 9)).astype(np.uint8)
    weights = np.random.default_rng(8).choice([0, 0.5, 1], values.shape, p=[0.1, 0.4, 0.5])
    volume = Volume(values)
    iso = 120.0 if mode == "isosurface" else None
    masked = Scene(volume, None, view(volume), mode=mode, isovalue=iso, mask=Mask(weights), classification="slab")
    gaps = Volume(np.where(weights > 0, values, np.nan).astype(np.float32))
    missing = Scene(gaps, None, view(volume), mode=mode, isovalue=iso, classification="slab")
    picture = raycast(masked, SIZE)
    np.testing.assert_array_equal(picture, raycast(missing, SIZE))
    assert (picture != raycast(replace(masked, mask=None), SIZE)).any()


def test_volumes_without_hidden_samples_are_made_once() -> None:
    volume = random_volume(9)
    mask = Mask(volume.values > 0.5)
    masked = scene(volume, FOG, mask=mask)
    assert masked.completed(SIZE).mask is mask
    mip = replace(masked, mode="mip")
    found = mip.completed(SIZE)
    assert found.mask is None and found.volume is replace(mip, background=(1, 1, 1)).completed(SIZE).volume
    assert found.volume.values.dtype == np.float32 and found.volume.name == volume.name
    assert found.volume.value_range == (volume.values[mask.array].min(), volume.values.max())
    assert not np.isnan(volume.values).any()
    assert replace(mip, mask=None).completed(SIZE).volume is volume
    assert replace(mip, mask=Mask(mask.array)).completed(SIZE).volume is not found.volume


@pytest.mark.parametrize(("dtype", "wanted"), [("u1", "f4"), ("i2", "f4"), ("f2", "f4"), ("i4", "f8"), ("f8", "f8")])
def test_values_keep_all_their_digits_beside_gaps(dtype: str, wanted: str) -> None:
    volume = Volume(np.arange(27).reshape(3, 3, 3).astype(dtype))
    mip = Scene(volume, None, view(volume), mode="mip", mask=Mask(volume.values != 4), classification="slab")
    assert mip.completed(SIZE).volume.values.dtype == wanted
