"""Lit matter of any kind, drawn, against the oracle; and the places where light is hard to tell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from support import closed_forms as known
from support.lit_scenes import (
    FOG,
    KINDS,
    LIGHTS,
    ROUNDING,
    SIZE,
    SUN,
    drawn,
    even,
    framed,
    largest,
    linear,
    order,
    scaled,
    smooth,
    tolerance,
    with_values,
)
from support.scenes import path_lengths

from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

kinds = pytest.mark.parametrize("kind", KINDS)
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as opened:
        yield opened


@kinds
@projections
@pytest.mark.parametrize("lights", LIGHTS)
def test_lit_pictures_converge_to_the_oracle(
    renderer: Renderer, kind: Classification, projection: Projection, lights: str
) -> None:
    volume = smooth()
    scene = Scene(volume, FOG, framed(volume, projection), classification=kind, lighting=LIGHTS[lights])
    # Second order, but for what is lit otherwise at once where a two-sided surface turns away from the eye; slabs whose
    # opacity is interpolated are between first and second, and samples (Gouraud) know no turning in between.
    least = 1.2 if kind == "slab" or (lights == "sun" and kind != "extinction") else 1.7
    assert least < order(renderer, scene) < 2.4


@kinds
@pytest.mark.parametrize(
    "dtype, low, high, world", [("u1", 0, 255, 1), ("i2", -1000, 3000, 1e9), ("f8", 1e9 - 1, 1e9 + 1, 1e-9)]
)
def test_types_and_worlds_converge_to_the_oracle(
    renderer: Renderer, kind: Classification, dtype: str, low: float, high: float, world: float
) -> None:
    volume = smooth(dtype, low, high, world)
    lamp = Light("point", tuple(volume.centre + 0.2 * volume.radius * np.array([1, -2, 1])))
    lighting = Lighting((lamp, Light()), shininess=8.0, two_sided=False)
    medium = scaled(FOG, low, high, world)
    scene = Scene(volume, medium, framed(volume, "perspective"), classification=kind, lighting=lighting)
    assert (1.2 if kind == "slab" else 1.7) < order(renderer, scene) < 2.4


def skin(samples: int = 12) -> Volume:
    """A ball, flat inside and outside, with values from 0 to 200 in whole numbers."""
    index = np.arange(samples) - (samples - 1) / 2
    z, y, x = np.meshgrid(index, index, index, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2)
    return Volume(np.rint(200 * np.clip(4.5 - distance, 0, 1)).astype(np.uint8), (1, 0.9, 1.1))


@kinds
@pytest.mark.parametrize("fade", [None, 0.0])
@pytest.mark.parametrize("texture_format", ["auto", "rgba32f"])
def test_flat_regions_are_lit_from_all_sides(
    renderer: Renderer, kind: Classification, fade: float | None, texture_format: str
) -> None:
    """Where nothing rises there is no normal, however little has to be believed: w = 0."""
    volume = skin()
    medium = TransferFunction(np.array([0, 200]), np.array([(0.2, 0.3, 0.9), (0.9, 0.5, 0.2)]), np.array([0.02, 0.3]))
    lighting = Lighting((SUN,), fade=fade, two_sided=False)
    scene = Scene(volume, medium, framed(volume), classification=kind, lighting=lighting)
    picture = renderer.render(scene, SIZE, sampling_rate=16, texture_format=texture_format)
    # The corners' rays see flat matter alone, of value 0: D = ambient + diffuse.
    lengths = path_lengths(volume, framed(volume), SIZE)
    opacity = known.opacity(0.02 * lengths)[..., np.newaxis]
    flat = np.array([0.2, 0.3, 0.9]) * (0.3 + 0.7 * np.array(SUN.color)) * opacity
    beside = (lengths > 0) & (distance_from_centre(volume, framed(volume)) > 8)
    assert beside.sum() >= 4
    rounding = ROUNDING if texture_format == "rgba32f" or kind in ("post", "integrated") else 1 / 255
    assert largest((picture[..., :3] - flat)[beside]) < rounding
    truth = raycast(scene, SIZE)
    assert np.sqrt(np.square(picture - truth).mean()) < 3e-3


def distance_from_centre(volume: Volume, camera: Camera) -> np.ndarray:
    """Of each pixel's ray, world units."""
    origins, directions = camera.rays(SIZE)
    return np.linalg.norm(np.cross(volume.centre - origins, directions), axis=2)


@kinds
def test_holes_are_not_lit(renderer: Renderer, kind: Classification) -> None:
    volume = smooth()
    values = volume.values.copy()
    values[5:9, 4:8, 6:11] = np.nan
    values[12, 3, 3] = np.nan
    scene = Scene(
        with_values(volume, values), FOG, framed(volume), classification=kind, lighting=LIGHTS["all, one side"]
    )
    # Around a hole all is cut off at once, between samples under `post` and `integrated`: first order.
    assert (0.7 if kind in ("post", "integrated") else 1.2) < order(renderer, scene) < 2.4


@kinds
@projections
def test_an_opaque_surface_is_lit(renderer: Renderer, kind: Classification, projection: Projection) -> None:
    volume = smooth()
    medium = TransferFunction(
        np.array([0, 0.55, 0.55]), np.array([(0, 0, 0), (0, 0, 0), (0.9, 0.7, 0.5)]), [0, 0, np.inf]
    )
    scene = Scene(volume, medium, framed(volume, projection), classification=kind, lighting=LIGHTS["all, one side"])
    truth, picture = raycast(scene, SIZE), drawn(renderer, scene, 32)
    # Values find the surface half a slab early or late, a 64th of a spacing, on which normals turn by about as much.
    # Texels make the least share of an opaque sample opaque: `extinction` finds where it begins but for a slab,
    # `slab` so much later as it takes opacities of a share of 1 to add up.
    opaque = truth[..., 3] > 0.999
    there = opaque & (picture[..., 3] > 0.999)
    most_missed, median = {"slab": (0.2, 1e-3), "extinction": (0.02, 1e-4)}.get(kind, (0.0, 1e-3))
    assert opaque.mean() > 0.2
    assert (opaque & ~there).sum() <= most_missed * opaque.sum()
    assert np.median(np.abs(picture - truth)[there]) < median
    assert np.ptp(truth[there][:, 0]) > 0.3


@kinds
def test_premultiplied_matter_reflects_light(renderer: Renderer, kind: Classification) -> None:
    volume = smooth()
    emissions = FOG.colors * FOG.extinctions[:, np.newaxis]
    premultiplied = TransferFunction(FOG.values, emissions, FOG.extinctions, premultiplied=True)
    scene = Scene(volume, premultiplied, framed(volume), classification=kind, lighting=LIGHTS["all, one side"])
    assert (1.2 if kind == "slab" else 1.7) < order(renderer, scene) < 2.4
    assert order(renderer, replace(scene, lighting=None)) > 1.2


@kinds
def test_at_points_alone_premultiplied_matter_is_the_same(renderer: Renderer, kind: Classification) -> None:
    volume = smooth()
    color, extinction = np.array([(0.9, 0.6, 0.3)]), np.array([0.1])
    plain = TransferFunction(np.zeros(1), color, extinction)
    premultiplied = TransferFunction(np.zeros(1), color * 0.1, extinction, premultiplied=True)
    scenes = [
        Scene(volume, medium, framed(volume), classification=kind, lighting=LIGHTS["all, one side"])
        for medium in (plain, premultiplied)
    ]
    assert largest(drawn(renderer, scenes[0], 2) - drawn(renderer, scenes[1], 2)) < 2 * ROUNDING


# Hard places.


def rotation(seed: int) -> np.ndarray:
    turned, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return turned * np.sign(np.linalg.det(turned))


@kinds
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("seed", range(4))
def test_seen_from_the_side_a_surface_has_the_side_that_it_has(
    renderer: Renderer, kind: Classification, side: float, seed: int
) -> None:
    """Square to the view, rounding would turn the normal from pixel to pixel and from camera to camera."""
    turn = rotation(seed)
    values = np.broadcast_to(side * 0.3 * np.arange(8, dtype=np.float32)[:, np.newaxis, np.newaxis], (8, 8, 8))
    volume = Volume(values, origin=tuple(turn @ np.full(3, -3.5)), direction=turn)
    to_light, to_eye = np.array([0.3, 0.5, 1]) / np.sqrt(1.34), np.array([0.1, 1, 0]) / np.sqrt(1.01)
    camera = Camera.orthographic(tuple(turn @ (30 * to_eye)), (0, 0, 0), tuple(turn[:, 2]), height=6)
    lighting = Lighting((Light("directional", tuple(turn @ to_light)),))
    scene = Scene(volume, even(), camera, classification=kind, lighting=lighting)
    picture = drawn(renderer, scene)
    normal = np.array([0, 0, -side])
    cosine, highlight = max(float(normal @ to_light), 0.0), 0.0
    if cosine > 0:
        halfway = to_light + to_eye
        highlight = 0.2 * (normal @ halfway / np.linalg.norm(halfway)) ** 32
    middle = picture[8:16, 8:16]
    straight = middle[..., 2] / middle[..., 3]
    np.testing.assert_allclose(straight, 0.3 * (0.3 + 0.7 * cosine) + highlight, rtol=0, atol=1e-5)


@pytest.mark.parametrize("kind", ["post", "slab", "extinction"])
@pytest.mark.parametrize("field", ["ambient", "diffuse", "specular", "shininess", "fade", "color", "vector"])
def test_numbers_beyond_float32_are_drawn(renderer: Renderer, field: str, kind: str) -> None:
    volume = linear()
    lighting = Lighting((Light("point", (1e290, -1e290, 3)),)) if field == "vector" else Lighting()
    if field == "color":
        lighting = Lighting((Light(color=(1e300, 0, 0)),))
    elif field != "vector":
        lighting = replace(lighting, **{field: 1e300})
    picture = renderer.render(Scene(volume, even(), framed(volume), classification=kind, lighting=lighting), (8, 8))
    assert not np.isnan(picture).any()


@pytest.mark.parametrize("shadows", [False, True])
@pytest.mark.parametrize("kind", ["post", "slab"])
def test_a_light_far_away_is_directional(renderer: Renderer, kind: str, shadows: bool) -> None:
    volume = linear()
    pictures = [
        drawn(
            renderer,
            Scene(volume, even(), framed(volume), classification=kind, lighting=Lighting((light,), shadows=shadows)),
        )
        for light in (SUN, Light("point", tuple(1e290 * np.array(SUN.vector)), SUN.color))
    ]
    assert largest(pictures[0] - pictures[1]) < tolerance(Lighting((SUN,)))


def test_light_is_not_for_matter_that_glows() -> None:
    gas = TransferFunction(np.zeros(1), np.ones((1, 3)), np.ones(1), emissive=True)
    with pytest.raises(InputError, match="lighting needs an associated transfer function"):
        Scene(linear(), gas, lighting=Lighting(), classification="slab")
