"""Shadows: what is left of each light at the nodes of the box, and pictures in it."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import random_volume
from support.several import turned

from texvol import Camera, InputError, Renderer, Scene, TransferFunction, Volume, raycast
from texvol.opengl.shadows import Shadows
from texvol.ray_casting.lit.shadows import shadows_in
from texvol.ray_casting.raycast import tracer_for
from texvol.scene.camera import Projection
from texvol.scene.lighting import SHADOW_NODES, Light, Lighting, shadow_distance, shadow_nodes, unit
from texvol.scene.scene import CLASSIFICATIONS, Classification
from texvol.scene.transfer.graded import Contour

# Turned and sheared.
OBLIQUE = np.array([[0.8, -0.6, 0.1], [0.6, 0.8, 0.0], [0.0, 0.2, 1.0]])
BOX = Volume(np.ones((6, 8, 10), np.uint8), (1.0, 1.4, 0.8), (3.0, -2.0, 5.0), OBLIQUE)
EXTINCTION = 0.07
FOG = TransferFunction([0.0], [(0.8, 0.6, 0.4)], [EXTINCTION])
SIZE = (40, 36)
SMALL = (24, 20)
SUN = Light("directional", (1.0, -2.0, 1.5), (1.0, 0.9, 0.8))
OUTSIDE = Light("point", (40.0, 20.0, 30.0), (0.3, 0.5, 1.0))
INSIDE = Light("point", tuple(BOX.centre + BOX.box_edges @ (0.2, -0.1, 0.15)), (0.5, 1.0, 0.5))  # type: ignore[arg-type]


def scene_of(volume: Volume, medium: TransferFunction, *lights: Light, **more: object) -> Scene:
    """A scene in which these lights cast shadows; one-sided, so that its error is of order 2."""
    lighting = Lighting(lights, two_sided=False, shadows=True)
    return Scene(volume, medium, lighting=lighting, **({"classification": "post"} | more))  # type: ignore[arg-type]


def cast(renderer: Renderer, scene: Scene, medium: TransferFunction, thickness: float) -> np.ndarray:
    """What arrives at the nodes, (z, y, x, lights), as the device finds it."""
    with renderer._context:
        [shadow] = renderer._pictures.in_memory.cache._shadows.prepare([scene.completed((8, 8))], thickness)
    assert shadow is not None
    return shadow.transmittance


def exact_at_nodes(scene: Scene) -> np.ndarray:
    """Return the oracle's transmittance from the nodes to the first light, shape (z, y, x)."""
    return shadows_in(scene.completed((1, 1)), SHADOW_NODES, tracer_for).fields[0].nodes[0]


def node_positions(volume: Volume) -> np.ndarray:
    """World places of the nodes, shape (z, y, x, 3)."""
    x, y, z = ((np.arange(count) + 0.5) / count for count in shadow_nodes(volume))
    fractions = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1)
    return volume.box_corner + fractions @ volume.box_edges.T


def ray_to(light: Light, volume: Volume) -> np.ndarray:
    """World units from each node to the light, or to the face of the box through which the way leads out of it."""
    positions = node_positions(volume)
    if light.kind == "directional":
        direction = np.broadcast_to(unit(light.vector), positions.shape)  # type: ignore[arg-type]
        farthest = np.full(positions.shape[:3], np.inf)
    else:
        to_light = np.array(light.vector) - positions
        farthest = np.linalg.norm(to_light, axis=-1)
        direction = to_light / farthest[..., np.newaxis]
    to_box = np.linalg.inv(volume.box_edges)
    fractions, per_unit = (positions - volume.box_corner) @ to_box.T, direction @ to_box.T
    with np.errstate(divide="ignore"):
        faces = np.where(per_unit > 0, (1 - fractions) / per_unit, fractions / -per_unit)
    return np.minimum(faces.min(axis=-1), farthest)


@pytest.mark.parametrize("light", [SUN, OUTSIDE, INSIDE], ids=["directional", "point outside", "point inside"])
def test_in_a_constant_medium_light_falls_off_exponentially(renderer: Renderer, light: Light) -> None:
    scene = scene_of(BOX, FOG, light)
    expected = np.exp(-EXTINCTION * ray_to(light, BOX))
    light_transmittance = cast(renderer, scene, FOG, 0.5)
    # A sum of up to 60 float32 parts: some 1e-6 of the depth.
    assert np.abs(light_transmittance[..., 0] - expected).max() <= 5e-6
    assert np.abs(exact_at_nodes(scene) - expected).max() <= 1e-12


def test_each_light_has_a_component_of_its_own_whatever_their_order(renderer: Renderer) -> None:
    together = cast(renderer, scene_of(BOX, FOG, OUTSIDE, Light(), SUN, INSIDE), FOG, 0.5)
    assert together.shape[3] == 3
    for component, light in enumerate((SUN, OUTSIDE, INSIDE)):
        alone = cast(renderer, scene_of(BOX, FOG, light), FOG, 0.5)
        assert np.array_equal(alone[..., 0], together[..., component])


def test_nothing_comes_through_opaque_matter(renderer: Renderer) -> None:
    values = np.zeros((8, 8, 8), np.uint8)
    values[3] = 1
    wall = TransferFunction([0.4, 0.5, 0.5], np.full((3, 3), 0.5), [0.0, 0.0, np.inf])
    scene = scene_of(Volume(values), wall, Light("directional", (0, 0, 1)))
    light_transmittance = cast(renderer, scene, wall, 0.25)
    heights = node_positions(scene.volume)[:, 0, 0, 2]
    assert (light_transmittance[heights < 2.4] == 0).all() and (light_transmittance[heights > 3.6] == 1).all()
    exact = exact_at_nodes(scene)
    assert (exact[heights < 2.4] == 0).all() and (exact[heights > 3.6] == 1).all()


def noise_in_shadow(projection: Projection, classification: Classification) -> Scene:
    """A scene of noise in shadow."""
    volume = Volume(random_volume(5, (24, 5, 5)).values, (1, 1.2, 0.9), direction=OBLIQUE)  # long: few nodes
    medium = TransferFunction([0.3, 0.6, 1.0], [(0.9, 0.3, 0.2), (0.3, 0.8, 0.4), (1, 1, 1)], [0.0, 0.15, 0.6])
    near = Light("point", tuple(volume.centre + (5.0, -3.0, 9.0)), (0.3, 0.6, 1.0))
    camera = Camera.framing(volume, projection)
    return scene_of(volume, medium, SUN, near, camera=camera, classification=classification)


# The lookup of shadows depends neither on the projection nor on the classification: each of both is enough.
@pytest.mark.parametrize(
    "classification, projection",
    list(zip(CLASSIFICATIONS, ["perspective", "orthographic", "perspective", "orthographic"], strict=True)),
)
def test_pictures_in_shadow_go_to_the_oracles(
    renderer: Renderer, classification: Classification, projection: Projection
) -> None:
    scene = noise_in_shadow(projection, classification)
    assert scene.lighting is not None
    truth = raycast(scene, SMALL, shadow_nodes=64)
    errors = [np.sqrt(np.square(renderer.render(scene, SMALL, sampling_rate=rate) - truth).mean()) for rate in (2, 8)]
    # Order 2, or 1 for opacities that are interpolated; two slabs a voxel of such noise are some 1e-3 off.
    factor = 1.7 if classification == "slab" else 3.0
    assert errors[0] <= (6e-3 if classification == "slab" else 3e-3)
    assert errors[0] / errors[1] >= factor**2
    unshadowed = replace(scene, lighting=replace(scene.lighting, shadows=False))
    assert np.abs(raycast(unshadowed, SMALL) - truth).max() > 0.05  # there are shadows to speak of


@pytest.mark.parametrize("classification, megabytes", [("slab", 0.047), ("post", 0.09)])
def test_bricks_are_in_the_shadow_of_the_whole(renderer: Renderer, classification: str, megabytes: float) -> None:
    scene = scene_of(random_volume(8, (48, 16, 16)), FOG_OF_VALUES, SUN, OUTSIDE, classification=classification)
    whole = renderer.render(scene, SMALL)
    with Renderer(texture_memory=megabytes) as small:
        assert np.abs(small.render(scene, SMALL) - whole).max() <= 2e-6
        assert quick_stats(small)["bricks_total"] > 1


def test_matter_that_depends_on_the_gradient_casts_shadows(renderer: Renderer) -> None:
    contour = Contour(0.5, 2.0, (0.4, 0.3, 0.2), 0.5)
    medium = TransferFunction([0.0], [(0, 0, 0)], [0.0], contours=(contour,))
    scene = scene_of(random_volume(6, (28, 7, 7)), medium, SUN)
    truth = raycast(scene, SIZE, shadow_nodes=64)
    errors = [np.abs(renderer.render(scene, SIZE, sampling_rate=rate) - truth).mean() for rate in (2, 8)]
    # Kinks at the edges of the contour, and none of them at the samples' places: order 2 in the mean.
    assert errors[1] <= errors[0] / 8


def test_the_head_light_casts_no_shadow_that_could_be_seen(renderer: Renderer) -> None:
    scene = scene_of(random_volume(6, (14, 14, 14)), FOG_OF_VALUES, Light())
    with patch.object(Shadows, "_cast", side_effect=AssertionError("shadows were cast")):
        picture = renderer.render(scene, SIZE)
    without = replace(scene, lighting=Lighting(two_sided=False))
    assert np.array_equal(picture, renderer.render(without, SIZE))


def test_shadows_are_cast_again_only_where_light_or_matter_changed(renderer: Renderer) -> None:
    volume = random_volume(6, (14, 14, 14))
    scene = scene_of(volume, FOG_OF_VALUES, SUN)
    renderer.render(scene, SIZE)
    turned = replace(scene, camera=Camera.framing(volume, eye=(40, 30, 20)))
    with patch.object(Shadows, "_cast", side_effect=AssertionError("shadows were cast again")):
        renderer.render(turned, SIZE)
    denser = TransferFunction([0.0, 1.0], [(0.8, 0.8, 0.8)] * 2, [0.0, 1.0])
    elsewhere = Lighting((Light("directional", (-1, 0, 0)),), two_sided=False, shadows=True)
    for changed in (replace(scene, transfer_function=denser), replace(scene, lighting=elsewhere)):
        with Renderer() as fresh:
            assert np.array_equal(renderer.render(changed, SIZE), fresh.render(changed, SIZE))


def test_a_wall_leaves_a_shadow_on_the_floor_behind_it(renderer: Renderer) -> None:
    """Seen from above: the floor is dark on the side away from the light, bright on the other."""
    values = np.zeros((24, 24, 24), np.uint8)
    values[:4] = 255
    values[4:16, :, 11:13] = 255
    medium = TransferFunction([100, 150], [(0.8, 0.8, 0.8)] * 2, [0.0, 20.0])
    camera = Camera.orthographic((11.5, 11.5, 60), (11.5, 11.5, 11.5), (0, 1, 0), 24)
    lighting = Lighting((Light("directional", (1, 0, 1)),), ambient=0.0, diffuse=1.0, specular=0.0, shadows=True)
    scene = Scene(Volume(values), medium, camera, classification="post", lighting=lighting)
    red = renderer.render(scene, (24, 24), sampling_rate=2)[12, :, 0]
    dark, bright = red[4:9], red[16:21]
    lit = 0.8 * np.sqrt(0.5)  # Lambert's cosine
    assert (dark < 0.02 * lit).all()
    assert (np.abs(bright - lit) < 0.02 * lit).all()


def test_a_place_is_looked_up_somewhat_nearer_to_the_light() -> None:
    assert shadow_distance(BOX) == pytest.approx(1.5 * 0.8)  # of these few samples
    long = Volume(np.zeros((2, 2, 200), np.uint8))
    assert shadow_distance(long) == pytest.approx(1.5 * 200 / 64)  # of the nodes


@pytest.mark.parametrize("counts", [(5, 0), (3, 2), (0, 5)])
def test_more_lights_than_a_texel_holds_are_refused(counts: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="at most 4 lights can cast shadows, got 5"):
        Lighting((SUN,) * counts[0] + (OUTSIDE,) * counts[1], shadows=True)
    Lighting((SUN,) * counts[0] + (OUTSIDE,) * counts[1])


@pytest.mark.parametrize("light", [SUN, OUTSIDE, INSIDE], ids=["directional", "point outside", "point inside"])
def test_shadows_fall_from_one_volume_on_another(renderer: Renderer, light: Light) -> None:
    """What lies in both boxes between a node and the light adds up, whether the node is in them or not."""
    other = Volume(np.ones((5, 4, 3), np.uint8), (3.0, 1.0, 2.0)).moved(turned(33))
    other = other.moved(turned(0, shift=BOX.centre - other.centre + (1.0, 0.5, 2.0)))
    medium = (FOG, replace(FOG, extinctions=np.array([3 * EXTINCTION])))
    scenes = [
        scene_of(volume, each, light).completed((8, 8)) for volume, each in zip((BOX, other), medium, strict=True)
    ]
    with renderer._context:
        found = renderer._pictures.in_memory.cache._shadows.prepare(scenes, 0.25)
    for volume, shadow in zip((BOX, other), found, strict=True):
        assert shadow is not None
        positions = node_positions(volume)
        depth = sum(
            each.extinctions[0] * _ray_inside(light, positions, box)
            for box, each in zip((BOX, other), medium, strict=True)
        )
        # Places are float32, of lights some 50 away: 3e-6, times an extinction of 0.3, and ten times that where a way
        # just grazes an edge of a box.
        np.testing.assert_allclose(shadow.transmittance[..., 0], np.exp(-depth), rtol=0, atol=2e-5)
    alone = [np.exp(-EXTINCTION * ray_to(light, BOX)), np.exp(-3 * EXTINCTION * ray_to(light, other))]
    assert (
        max(
            np.abs(shadow.transmittance[..., 0] - each).max()
            for shadow, each in zip(found, alone, strict=True)
            if shadow is not None
        )
        > 0.02
    )


def _ray_inside(light: Light, positions: np.ndarray, volume: Volume) -> np.ndarray:
    """World units in a box between places anywhere and the light."""
    assert light.vector is not None
    if light.kind == "directional":
        direction, farthest = np.broadcast_to(unit(light.vector), positions.shape), np.full(positions.shape[:3], np.inf)
    else:
        farthest = np.linalg.norm(np.array(light.vector) - positions, axis=-1)
        direction = (np.array(light.vector) - positions) / farthest[..., np.newaxis]
    to_box = np.linalg.inv(volume.box_edges)
    fractions, per_unit = (positions - volume.box_corner) @ to_box.T, direction @ to_box.T
    a, b = -fractions / per_unit, (1 - fractions) / per_unit
    near, far = np.maximum(np.minimum(a, b).max(axis=-1), 0), np.minimum(np.maximum(a, b).min(axis=-1), farthest)
    return np.maximum(far - near, 0)


def test_an_isosurface_is_refused_shadows() -> None:
    with pytest.raises(InputError, match="shadows need mode composite"):
        Scene(BOX, lighting=Lighting((SUN,), shadows=True), mode="isosurface", isovalue=0.5, classification="slab")


FOG_OF_VALUES = TransferFunction([0.0, 1.0], [(0.9, 0.8, 0.7)] * 2, [0.0, 0.4])
