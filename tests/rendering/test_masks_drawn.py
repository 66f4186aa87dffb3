"""Masks, labels and colours as the renderer draws them, against closed forms and against what they must be equal to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.closed_forms import mean_transmittance, opacity
from support.pairs import each_classification_in_a_projection
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, path_lengths, random_volume
from support.several import turned

from texvol import Camera, InputError, Light, Lighting, Renderer, Scene, TransferFunction, Volume
from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS
from texvol.scene.transfer import label_function

SIZE = (40, 36)
SHAPE = (9, 13, 7)
ROUNDING = 2e-6
EXACT: dict[str, Any] = {"texture_format": "rgba32f", "early_termination": 0.0}
# Where a ray meets a face between samples float32 knows to some 1e-6 of the depth, and pieces of 1e-5 of a slab are
# given to their neighbours: of an extinction of 1 per slab each face may cost that.
AT_FACES = 5e-5
LIT = Lighting((Light("head"), Light("directional", (1.0, -0.5, 1.0))), specular=0.3)
GLOW = replace(BONE, colors=BONE.colors * 0.1, emissive=True)


def seen(volume: Volume, medium: TransferFunction, projection: Any = "perspective", **more: Any) -> Scene:
    eye = volume.centre + volume.radius * np.array([1.6, -2.0, 1.1])
    return Scene(volume, medium, Camera.framing(volume, projection, eye=eye), **({"classification": "slab"} | more))


MEDIUM: dict[str, tuple[TransferFunction, Lighting | None]] = {
    "plain": (BONE, None),
    "emissive": (GLOW, None),
    "lit": (BONE, LIT),
}


@pytest.fixture(scope="module")
def small() -> Iterator[Renderer]:
    """Without room for a whole volume of texels."""
    with Renderer(texture_memory=0.045) as opened:
        yield opened


# Each classification, and each medium where samples are classified and where values are.
@pytest.mark.parametrize(
    "medium, classification",
    [
        ("plain", "slab"),
        ("plain", "integrated"),
        ("emissive", "extinction"),
        ("emissive", "post"),
        ("lit", "extinction"),
        ("lit", "post"),
    ],
)
class TestAMask:
    @pytest.fixture
    def scene(self, medium: str, classification: Any) -> Scene:
        transfer, lighting = MEDIUM[medium]
        volume = random_volume(4, (17, 15, 13))
        return seen(volume, transfer, classification=classification, lighting=lighting)

    def test_of_ones_changes_nothing(self, renderer: Renderer, scene: Scene) -> None:
        expected = renderer.render(scene, SIZE, **EXACT)
        for ones in (np.ones(scene.volume.values.shape, bool), np.ones(scene.volume.values.shape)):
            drawn = renderer.render(replace(scene, mask=Mask(ones)), SIZE, **EXACT)
            np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)

    def test_of_zeros_leaves_nothing(self, renderer: Renderer, scene: Scene) -> None:
        for zeros in (np.zeros(scene.volume.values.shape, bool), np.zeros(scene.volume.values.shape)):
            assert not renderer.render(replace(scene, mask=Mask(zeros)), SIZE, **EXACT).any()

    def test_of_one_weight_thins(self, renderer: Renderer, scene: Scene) -> None:
        weight = 0.375
        medium = scene.transfer_function
        assert medium is not None
        colors = medium.colors * weight if medium.emissive else medium.colors
        thin = replace(medium, extinctions=medium.extinctions * weight, colors=colors)
        expected = renderer.render(replace(scene, transfer_function=thin), SIZE, **EXACT)
        mask = Mask(np.full(scene.volume.values.shape, weight))
        drawn = renderer.render(replace(scene, mask=mask), SIZE, **EXACT)
        np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)

    def test_ends_between_two_samples(self, renderer: Renderer, scene: Scene) -> None:
        """Of x nothing before the last hidden sample, and everything from the first shown one on."""
        volume = scene.volume
        x = np.broadcast_to(np.arange(volume.dimensions[0]), volume.values.shape)
        mask = Mask(x >= 8)
        hidden, shown = (float(volume.origin[0] + index * volume.spacing[0]) for index in (7, 8))
        everywhere = (-np.inf, np.inf)
        before = replace(scene, mask=mask, crop=((-np.inf, hidden), everywhere, everywhere))
        assert renderer.render(before, SIZE, **EXACT).max() < ROUNDING
        behind = replace(scene, crop=((shown, np.inf), everywhere, everywhere))
        expected = renderer.render(behind, SIZE, **EXACT)
        assert expected[..., 3].max() > 0.5
        np.testing.assert_allclose(renderer.render(replace(behind, mask=mask), SIZE, **EXACT), expected, atol=ROUNDING)


@pytest.mark.parametrize("medium, classification", [("plain", "slab"), ("emissive", "post"), ("lit", "extinction")])
def test_leaps_and_bricks_change_nothing_of_a_mask(
    renderer: Renderer, small: Renderer, medium: str, classification: Any
) -> None:
    transfer, lighting = MEDIUM[medium]
    volume = random_volume(4, (17, 15, 13))
    weights = np.random.default_rng(5).random(volume.values.shape)
    weights[:, :, :9] = 0
    masked = seen(volume, transfer, classification=classification, lighting=lighting, mask=Mask(weights))
    expected = renderer.render(masked, SIZE, **EXACT)
    drawn = renderer.render(masked, SIZE, skip_empty=False, **EXACT)
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)
    drawn = small.render(masked, SIZE, **EXACT)
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)
    assert quick_stats(small)["bricks_total"] > 1 or classification == "post"


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_a_weight_that_rises_has_its_closed_form(renderer: Renderer, classification: Any) -> None:
    """Along z the weight goes from 0 to 1 between the first sample and the last, the rays along z as well."""
    volume = Volume(np.ones((9, 7, 7), np.float32))
    weights = np.broadcast_to(np.linspace(0, 1, 9)[:, np.newaxis, np.newaxis], volume.values.shape)
    camera = Camera.orthographic(volume.centre - (0, 0, 20), volume.centre, (0, 1, 0), height=3)
    scene = Scene(volume, constant(0.3), camera, classification=classification, mask=Mask(weights))
    # ∫ w over 8 samples' way of a ramp, and half a sample of 0 and of 1 at the ends.
    depth = 0.3 * (4 + 0.5)
    errors = [
        abs(float(renderer.render(scene, (4, 4), sampling_rate=rate, **EXACT)[1, 1, 3]) - opacity(depth))
        for rate in (2.0, 8.0)
    ]
    # Opacities of slabs are mixed, and not extinctions: order 2.
    assert errors[1] < (2e-4 if classification == "slab" else ROUNDING)
    assert errors[0] < 16.5 * 2e-4


def test_shadows_are_those_of_what_is_left(renderer: Renderer) -> None:
    volume = Volume(np.ones((13, 13, 13), np.float32))
    z = np.broadcast_to(np.arange(13)[:, np.newaxis, np.newaxis], volume.values.shape)
    lighting = Lighting((Light("directional", (0, 0, 1)),), ambient=0.0, diffuse=1.0, shadows=True)
    scene = seen(volume, constant(0.4), classification="post", lighting=lighting, mask=Mask(z < 6))
    below = replace(scene, mask=None, crop=((-np.inf, np.inf), (-np.inf, np.inf), (-np.inf, 5.5)))
    above = replace(scene, mask=None)
    drawn, cut, dark = (renderer.render(each, SIZE, sampling_rate=4) for each in (scene, below, above))
    lit = cut[..., 3] > 0.5
    # What hides nothing casts nothing: as bright as where it is cut off, but for the sample in which the mask fades.
    assert np.abs(drawn - cut)[lit].mean() < 0.15 * np.abs(dark - cut)[lit].mean()


def test_a_mask_goes_with_its_volume(renderer: Renderer) -> None:
    volume = random_volume(6, SHAPE)
    hidden = Mask(np.zeros(volume.values.shape, bool))
    fog = constant(0.3)
    scene = seen(volume, fog, added=(AddedVolume(volume.moved(turned(30)), fog, hidden),), classification="post")
    alone = renderer.render(replace(scene, added=()), SIZE, **EXACT)
    np.testing.assert_allclose(renderer.render(scene, SIZE, **EXACT), alone, rtol=0, atol=ROUNDING)
    other = replace(scene, mask=hidden, added=(AddedVolume(volume.moved(turned(30)), fog),))
    assert np.abs(renderer.render(other, SIZE, **EXACT) - alone).max() > 0.1


@pytest.mark.parametrize("mode", ["mip", "minip", "xray", "average", "isosurface"])
def test_where_values_are_seen_hidden_samples_are_missing(renderer: Renderer, mode: Any) -> None:
    volume = random_volume(7, SHAPE)
    shown = np.random.default_rng(8).random(volume.values.shape) > 0.1
    more = {"mode": mode} | ({"isovalue": 0.5} if mode == "isosurface" else {})
    masked = replace(seen(volume, BONE), mask=Mask(shown), **more)
    missing = Volume(np.where(shown, volume.values, np.nan), volume.spacing, volume.origin)
    expected = renderer.render(replace(masked, volume=missing, mask=None), SIZE)
    np.testing.assert_array_equal(renderer.render(masked, SIZE), expected)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (
            np.ones((3, 3, 4)),
            r"^mask: a mask must have as many samples as its volume, got 4 x 3 x 3 samples where volume has 3 x 3",
        ),
        (np.full((3, 3, 3), 2.0), r"^mask: weights must be from 0 to 1, but they go from 2 to 2; fade"),
        (np.full((3, 3, 3), np.nan), r"^mask: weights must be from 0 to 1"),
        (np.ones((3, 3)), r"^mask: a mask must have numbers along 3 axes \(z, y, x\), got float64 of shape \(3, 3\)"),
        (np.full((3, 3, 3), "a"), r"^mask: a mask must have numbers along 3 axes"),
    ],
)
def test_a_mask_that_is_none_is_refused(weights: NDArray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Scene(Volume(np.ones((3, 3, 3))), mask=Mask(weights), classification="slab")


def test_masks_come_out_of_volumes() -> None:
    labels = Volume(np.arange(27).reshape(3, 3, 3) % 3)
    np.testing.assert_array_equal(Mask.of(labels).array, labels.values != 0)
    np.testing.assert_allclose(Mask.of(labels, (0, 2)).array, labels.values / 2)
    np.testing.assert_allclose(Mask.of(labels, (2, 0)).array, 1 - labels.values / 2)
    np.testing.assert_allclose(Mask.of(labels, (1, 1.5)).array, labels.values == 2)
    fractions = Volume(np.array([[[0.25, np.nan, 1.0]]]))
    np.testing.assert_allclose(Mask.of(fractions).array, [[[0.25, 0.0, 1.0]]])
    with pytest.raises(InputError, match="fade must be two different finite numbers, got 1 and 1"):
        Mask.of(labels, (1, 1))


def labelled(seed: int = 0, dimensions: tuple[int, int, int] = (6, 5, 4)) -> Volume:
    values = np.random.default_rng(seed).integers(0, 5, dimensions[::-1]).astype(np.uint8)
    return Volume(values, (1.0, 1.3, 0.7), labels=True)


def picture_of_labels(volume: Volume, medium: TransferFunction, camera: Camera) -> NDArray[np.float64]:
    """Voxel by voxel, in closed form."""
    eyes, directions = camera.rays(SIZE)
    origin = (eyes - volume.box_corner) @ volume.index_from_world.T
    direction = directions @ volume.index_from_world.T
    planes = [np.arange(count + 1) for count in volume.dimensions]
    with np.errstate(divide="ignore"):
        s = np.concatenate(
            [(p - origin[..., a, None]) / direction[..., a, None] for a, p in enumerate(planes)], axis=-1
        )
    s = np.sort(np.maximum(np.nan_to_num(s), 0), axis=-1)
    picture = np.zeros((*eyes.shape[:2], 4))
    for near, far in pairwise(np.moveaxis(s, -1, 0)):
        position = origin + direction * ((near + far) / 2)[..., np.newaxis]
        inside = ((position >= 0) & (position < volume.dimensions)).all(axis=-1)
        i, j, k = (np.clip(np.floor(position[..., a]).astype(int), 0, volume.dimensions[a] - 1) for a in range(3))
        emission, extinction = medium.classify(volume.values[k, j, i].reshape(-1))
        length = np.where(inside, far - near, 0.0)
        depth = extinction.reshape(length.shape) * length
        left = 1 - picture[..., 3:]
        glow = emission.reshape(*length.shape, 3) * length[..., np.newaxis]
        picture[..., :3] += left * glow * mean_transmittance(depth)[..., np.newaxis]
        picture[..., 3:] += left * opacity(depth)[..., np.newaxis]
    return picture


@each_classification_in_a_projection
def test_labels_have_their_closed_form(renderer: Renderer, projection: Any, classification: Any) -> None:
    volume = labelled()
    scene = seen(volume, label_function(volume), projection, classification=classification)
    assert scene.transfer_function is not None and scene.camera is not None
    expected = picture_of_labels(volume, scene.transfer_function, scene.camera)
    assert expected[..., 3].max() > 0.5
    for rate in (0.3, 1.0, 4.0):
        drawn = renderer.render(scene, SIZE, sampling_rate=rate, early_termination=0.0)
        assert np.abs(drawn - expected).max() < AT_FACES


def test_labels_are_not_mixed_in_bricks_either(renderer: Renderer) -> None:
    """A volume too large for one texture is sampled in the middle of slabs: no colour but those of its labels."""
    volume = labelled(1, (40, 30, 20))
    values = np.where(volume.values > 2, 4, 0).astype(np.uint8)
    volume = Volume(values, volume.spacing, labels=True)
    red, green = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    medium = label_function(
        Volume(np.arange(5).reshape(1, 1, 5), labels=True), colors={4: red, 2: green, 1: green, 3: green}
    )
    scene = seen(volume, medium)
    with Renderer(texture_memory=0.01) as small:
        drawn = small.render(scene, SIZE, sampling_rate=16)
        assert quick_stats(small)["bricks_total"] > 1
    assert drawn[..., 0].max() > 0.5 and not drawn[..., 1].any()
    assert np.abs(drawn - renderer.render(scene, SIZE)).mean() < 0.01


def test_labels_stand_among_other_matter(renderer: Renderer) -> None:
    """A label volume beside fog: the fog's own pieces are those of its slabs, cut where labels change."""
    volume = labelled(2)
    fog = Volume(np.ones((3, 3, 3), np.float32), (4, 4, 4)).moved(turned(30))
    scene = seen(volume, label_function(volume), added=(AddedVolume(fog, constant(0.02)),), classification="post")
    drawn = renderer.render(scene, SIZE, **EXACT)
    assert scene.camera is not None and scene.transfer_function is not None
    lengths = path_lengths(fog, scene.camera, SIZE)
    labels = picture_of_labels(volume, scene.transfer_function, scene.camera)[..., 3]
    np.testing.assert_allclose(drawn[..., 3], 1 - (1 - labels) * np.exp(-0.02 * lengths), rtol=0, atol=AT_FACES)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_colours_are_shown_as_they_are(renderer: Renderer, classification: Any) -> None:
    """One colour everywhere, as much of it as the values say."""
    values = random_volume(9, SHAPE)
    color = np.array((0.9, 0.4, 0.1), np.float32)
    colored = Volume(values.values, values.spacing, colors=np.broadcast_to(color, (*values.values.shape, 3)))
    white = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.6]))
    tinted = replace(white, colors=np.array([color, color]))
    kind = "slab" if classification == "slab" else "extinction"
    expected = renderer.render(seen(values, tinted, classification=kind), SIZE, **EXACT)
    drawn = renderer.render(seen(colored, white, classification=classification), SIZE, **EXACT)
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)
    whole = drawn[drawn[..., 3] > 0.01]
    np.testing.assert_allclose(whole[:, :3] / whole[:, 3:], np.broadcast_to(color, (len(whole), 3)), atol=1e-4)


def test_colours_are_mixed_by_how_much_there_is_of_them(renderer: Renderer) -> None:
    """Red beside white of which there is nothing: no pink."""
    values = np.zeros((4, 4, 8), np.float32)
    values[..., :4] = 1
    colors = np.ones((*values.shape, 3), np.float32)
    colors[..., :4, 1:] = 0
    volume = Volume(values, colors=colors)
    drawn = renderer.render(
        seen(volume, TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.6]))), SIZE
    )
    assert drawn[..., 0].max() > 0.3 and not drawn[..., 1:3].any()


@pytest.mark.parametrize("more", [{"labels": True}, {"colors": np.zeros((3, 3, 3, 3))}])
def test_labels_and_colours_are_of_matter(more: dict[str, Any]) -> None:
    volume = Volume(np.ones((3, 3, 3), np.uint8), **more)
    with pytest.raises(InputError, match="volumes of colours, labels or blocks need mode composite, got mode xray"):
        Scene(volume, mode="xray", classification="slab")


@pytest.mark.parametrize("mode", ["composite", "xray", "mip", "isosurface"])
def test_a_missing_sample_takes_only_what_it_has_weight_in(renderer: Renderer, mode: Any) -> None:
    """Beside the last sample before the box ends there is that sample alone, on every side of the box."""
    values = np.ones((3, 3, 3), np.float32)
    values[1, 1, 1] = np.nan
    volume = Volume(values)
    camera = Camera.orthographic((1, 1, 20), (1, 1, 1), (0, 1, 0), height=3)
    more: dict[str, Any] = {"mode": mode} | ({"isovalue": 0.5} if mode == "isosurface" else {})
    drawn = renderer.render(Scene(volume, constant(0.3), camera, classification="post", **more), (60, 60))[..., 3]
    if mode == "isosurface":  # ones everywhere: no surface, and none at the gap
        assert not drawn.any()
        return
    # The outermost half of a sample, ten pixels on every side, is whole; half way through it is the gap's.
    edge = np.ones((60, 60), bool)
    edge[10:-10, 10:-10] = False
    whole = opacity(0.3 * 3) if mode == "composite" else 1.0
    np.testing.assert_allclose(drawn[edge], whole, rtol=0, atol=ROUNDING)
    if mode == "composite":
        # Inside, from the first sample to the last, there is nothing in which it has no weight.
        np.testing.assert_allclose(drawn[30, 30], opacity(0.3 * 1), rtol=0, atol=ROUNDING)
