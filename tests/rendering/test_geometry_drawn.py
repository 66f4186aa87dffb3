"""Surfaces among matter: in a constant medium in closed form, in any other as the oracle has it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.pairs import each_classification_in_a_projection
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, constant, inside, random_volume, smooth_volume, sparse_volume
from support.shapes import Quad, ball, box_ends, fog_between, globe, hits_of, quad, quads_in_fog

from texvol import Camera, ClipPlane, DepthCue, Light, Lighting, Renderer, Scene, Volume, compare, raycast
from texvol.geometry import Lines, Mesh
from texvol.scene.scene import Classification

SIZE = (48, 44)
COLOR = (0.9, 0.6, 0.3)
VOLUME = random_volume(5, (13, 9, 14))
# What a picture may be off: float32's sums; the closed forms are exact.
ROUNDING = 2e-6
PROJECTIONS = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


def crossing_quads(volume: Volume) -> list[Quad]:
    """Oblique quads: three that cross each other, one opaque behind, one through the box's faces, one beside it."""
    c, r = volume.centre, volume.radius
    return [
        quad(c, r * np.array([0.3, 0.1, 0.0]), r * np.array([0.0, 0.1, 0.3]), (0.2, 0.7, 0.9), 0.4),
        quad(c, r * np.array([0.25, -0.2, 0.1]), r * np.array([0.1, 0.3, 0.1]), (0.9, 0.2, 0.1), 0.6),
        quad(c + 0.1 * r, r * np.array([0.0, 0.3, -0.2]), r * np.array([0.3, 0.0, 0.2]), (0.1, 0.9, 0.2), 0.25),
        quad(
            c + r * np.array([-0.1, 0.3, 0.0]), r * np.array([0.2, 0, 0]), r * np.array([0, 0.1, 0.2]), (0, 0.1, 0.8), 1
        ),
        quad(c - 0.2 * r, r * np.array([1.5, 0.2, 0.1]), r * np.array([-0.1, 0.2, 0.1]), (0.6, 0.5, 0.1), 0.5),
        quad(c + r * np.array([0.9, -0.9, 0.4]), r * np.array([0.3, 0, 0]), r * np.array([0, 0, 0.3]), (1, 1, 1), 0.3),
    ]


def view(volume: Volume, projection: Any) -> Camera:
    return Camera.framing(volume, projection, eye=volume.centre + volume.radius * np.array([1.5, -2.0, 1.2]))


@each_classification_in_a_projection
@pytest.mark.parametrize("rate", [0.3, 2.7])
def test_quads_in_fog(renderer: Renderer, classification: Classification, projection: str, rate: float) -> None:
    quads, camera = crossing_quads(VOLUME), view(VOLUME, projection)
    exact = quads_in_fog(VOLUME, camera, SIZE, quads, COLOR, 0.2)
    scene = Scene(VOLUME, constant(0.2, COLOR), camera, classification=classification)
    scene = replace(scene, geometry=tuple(each.mesh() for each in quads))
    assert np.abs(renderer.render(scene, SIZE, sampling_rate=rate) - exact).max() < ROUNDING
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12
    without = renderer.render(replace(scene, geometry=()), SIZE, sampling_rate=rate)
    assert (np.abs(without - exact).max(axis=-1) > 0.05).mean() > 0.2, "the quads are seen"


@PROJECTIONS
def test_dense_fog_ends_at_a_surface_to_the_digit(renderer: Renderer, projection: str) -> None:
    """Optical depth 400 across the box: float32's places, 6e-8 of the box, would be some 2e-5 of the picture."""
    extinction, camera = 200 / VOLUME.radius, view(VOLUME, projection)
    # Parallel to the face that the eye sees most of, behind fog of depth 0.5 and 1, and more at an angle.
    front = VOLUME.centre - np.array([0, VOLUME.box_edges[1, 1] / 2, 0])
    glass, wall = (
        quad(front + (0, depth / extinction, 0), (3, 0, 0), (0, 0, 3), (0.1, 0.5, 0.9), opacity)
        for depth, opacity in ((0.5, 0.5), (1.0, 1.0))
    )
    geometry = (glass.mesh(), wall.mesh())
    scene = Scene(VOLUME, constant(extinction, COLOR), camera, classification="post", geometry=geometry)
    exact = quads_in_fog(VOLUME, camera, SIZE, [glass, wall], COLOR, extinction)
    bare = raycast(replace(scene, geometry=()), SIZE)
    assert (np.abs(bare - exact).max(axis=-1) > 0.1).mean() > 0.05, "both are seen"
    assert np.abs(renderer.render(scene, SIZE) - exact).max() < 2e-5
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-10


@PROJECTIONS
def test_an_eye_inside_sees_what_is_in_front_of_it(renderer: Renderer, projection: Any) -> None:
    """One quad all around the eye's plane, so that its triangles go through it, others in front and behind."""
    camera = inside(VOLUME, projection)
    eye, forward, up = np.array(camera.eye), camera.forward, camera.upward
    floor = quad(eye - 0.15 * VOLUME.radius * up, 3 * VOLUME.radius * forward, 2 * VOLUME.radius * camera.right)
    quads = [floor, *crossing_quads(VOLUME), quad(eye - 0.1 * forward, 5 * up, 5 * camera.right, (1, 0, 0), 0.9)]
    scene = Scene(
        VOLUME, constant(0.2, COLOR), camera, geometry=tuple(each.mesh() for each in quads), classification="slab"
    )
    exact = quads_in_fog(VOLUME, camera, SIZE, quads, COLOR, 0.2)
    assert np.abs(renderer.render(scene, SIZE) - exact).max() < ROUNDING
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12
    if projection == "perspective":  # parallel rays run along the floor
        without = quads_in_fog(VOLUME, camera, SIZE, quads[1:], COLOR, 0.2)
        assert (np.abs(without - exact).max(axis=-1) > 0.01).mean() > 0.2, "the floor is seen"


@PROJECTIONS
@pytest.mark.parametrize("opacity", [0.4, 1.0])
def test_a_faceted_ball_in_fog(renderer: Renderer, opacity: float, projection: str) -> None:
    """A convex body: a ray is inside between the farthest plane that it enters by and the nearest that it leaves by."""
    c, radius = VOLUME.centre, 0.5 * VOLUME.radius
    vertices, triangles = ball()
    camera = view(VOLUME, projection)
    eyes, directions = camera.rays(SIZE)
    a, b, d = (vertices[triangles[:, corner]] for corner in range(3))
    normals = np.cross(b - a, d - a)
    height = ((eyes - c) / radius) @ normals.T - (normals * a).sum(axis=1)
    rise = directions / radius @ normals.T
    t = -height / rise
    enters = np.where(rise < 0, t, -np.inf).max(axis=-1)
    leaves = np.where(rise > 0, t, np.inf).min(axis=-1)
    met = enters < leaves
    look = (0.1, 0.5, 0.8, opacity)
    surfaces = [(np.where(met, at, np.inf), look) for at in (enters, leaves)]
    exact = fog_between(COLOR, 0.2, box_ends(VOLUME, eyes, directions), surfaces)
    mesh = Mesh(c + radius * vertices, triangles, look[:3], opacity, lit=False)
    scene = Scene(VOLUME, constant(0.2, COLOR), camera, geometry=(mesh,), classification="slab")
    assert 0.1 < met.mean() < 0.6
    assert np.abs(renderer.render(scene, SIZE) - exact).max() < ROUNDING
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12


def test_a_fine_ball_is_a_sphere(renderer: Renderer) -> None:
    """100,000 triangles, smooth, under a head light, against the sphere itself.

    Facets of angle h = π / 160 lie at most R h² / 4 below the sphere, R h² / 8 for either of their sides; seen at an
    angle whose cosine is at least k, a ray goes on for 1 / k of that: τ R h² / 4 k of optical depth. Normals between
    vertices are off by less than h² / 4 / k, and the light by (diffuse + shininess specular) as much.
    """
    volume, rings, least_cosine = VOLUME, 160, 0.3
    c, radius = volume.centre, 0.5 * volume.radius
    vertices, triangles = globe(rings)
    assert len(triangles) == 101_760
    camera, tau, lighting = view(volume, "perspective"), 0.2, Lighting()
    eyes, directions = camera.rays(SIZE)
    along = -((eyes - c) * directions).sum(axis=-1)
    nearest = eyes - c + along[..., np.newaxis] * directions
    square = radius**2 - (nearest**2).sum(axis=-1)
    at = np.where(square > 0, along - np.sqrt(np.maximum(square, 0)), np.inf)
    cosine = np.sqrt(np.maximum(square, 0)) / radius  # of the angle between the normal and the way to the eye
    shade = lighting.ambient + lighting.diffuse * cosine[..., np.newaxis]
    shine = lighting.specular * cosine[..., np.newaxis] ** lighting.shininess
    look = np.concatenate([np.array([0.1, 0.5, 0.8]) * shade + shine, np.ones((*cosine.shape, 1))], axis=-1)
    exact = fog_between(COLOR, tau, box_ends(volume, eyes, directions), [(at, look)])
    mesh = Mesh(c + radius * vertices, triangles, (0.1, 0.5, 0.8), normals=vertices)
    picture = renderer.render(
        Scene(volume, constant(tau, COLOR), camera, geometry=(mesh,), classification="slab"), SIZE
    )
    step = (np.pi / rings) ** 2 / 4 / least_cosine
    bound = step * (tau * radius + lighting.diffuse + lighting.shininess * lighting.specular) + ROUNDING
    inner = (cosine > least_cosine) | (square < -0.01 * radius**2)
    assert inner.mean() > 0.9 and (cosine > least_cosine).mean() > 0.1
    assert np.abs(picture - exact)[inner].max() < bound


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_worlds_of_any_size(renderer: Renderer, scale: float) -> None:
    volume = Volume(VOLUME.values, scale * VOLUME.spacing, origin=(9 * scale,) * 3)
    quads, camera = crossing_quads(volume), view(volume, "perspective")
    scene = Scene(
        volume,
        constant(0.2 / scale, COLOR),
        camera,
        geometry=tuple(each.mesh() for each in quads),
        classification="slab",
    )
    exact = quads_in_fog(volume, camera, SIZE, quads, COLOR, 0.2 / scale)
    assert np.abs(renderer.render(scene, SIZE) - exact).max() < ROUNDING
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12


def test_thirty_nested_quads(renderer: Renderer) -> None:
    c, r = VOLUME.centre, VOLUME.radius
    quads = [
        quad(c + z * r * np.array([0.1, -0.3, 0.9]), (0.4 * r, 0, 0), (0, 0.5 * r, 0), (0.5 + z, 0.2, 0.5 - z), 0.1)
        for z in np.random.default_rng(3).permutation(np.linspace(-0.5, 0.5, 30))
    ]
    camera = view(VOLUME, "perspective")
    scene = Scene(
        VOLUME, constant(0.1, COLOR), camera, geometry=tuple(each.mesh() for each in quads), classification="slab"
    )
    exact = quads_in_fog(VOLUME, camera, SIZE, quads, COLOR, 0.1)
    assert np.abs(renderer.render(scene, SIZE) - exact).max() < ROUNDING
    assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12


@pytest.mark.parametrize("opacity", [0.4, 1.0])
def test_of_surfaces_at_one_place_the_scenes_first_is_in_front(renderer: Renderer, opacity: float) -> None:
    c, r = VOLUME.centre, VOLUME.radius
    red = quad(c, (0.4 * r, 0, 0.1 * r), (0, 0.3 * r, 0.2 * r), (1, 0, 0), opacity)
    # The same plane, other corners, so that the same depth comes from other numbers.
    green = Quad(red.corner - 0.3 * red.along, 1.7 * red.along, 1.3 * red.across + 0.2 * red.along, (0, 1, 0), opacity)
    camera = view(VOLUME, "perspective")
    for quads in ([red, green], [green, red]):
        scene = Scene(
            VOLUME, constant(0.2, COLOR), camera, geometry=tuple(each.mesh() for each in quads), classification="slab"
        )
        eyes, directions = camera.rays(SIZE)
        ends = box_ends(VOLUME, eyes, directions)
        # Both are met at the first one's place, by a stable order.
        positions = [hits_of(each, eyes, directions) for each in quads]
        positions[1] = np.where(np.isfinite(positions[0]) & np.isfinite(positions[1]), positions[0], positions[1])
        looks = [(*each.color, each.opacity) for each in quads]
        exact = fog_between(COLOR, 0.2, ends, list(zip(positions, looks, strict=True)))
        assert np.abs(renderer.render(scene, SIZE) - exact).max() < ROUNDING
        assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-9


@pytest.mark.parametrize("projection, cells", [("orthographic", 5), ("perspective", 200)])
def test_no_ray_slips_through_between_triangles_or_meets_two(renderer: Renderer, projection: str, cells: int) -> None:
    """A plane of triangles with jittered corners, larger and smaller than pixels: everywhere of one opacity.

    Jittered by a fifth of their distance, so that none folds over.
    """
    across = np.stack(np.meshgrid(*[np.linspace(-1, 1, cells + 1)] * 2, indexing="ij"), axis=-1)
    across[1:-1, 1:-1] += np.random.default_rng(1).uniform(-0.4, 0.4, (cells - 1, cells - 1, 2)) / cells
    c, r = VOLUME.centre, VOLUME.radius
    vertices = c + across.reshape(-1, 2) @ np.array([(5 * r, r, 0), (0, -r, 5 * r)])
    first = (np.arange(cells)[:, np.newaxis] * (cells + 1) + np.arange(cells)).reshape(-1)
    corners = [(0, cells + 1, 1), (1, cells + 1, cells + 2)]
    triangles = np.concatenate([first[:, np.newaxis] + np.array(each) for each in corners])
    mesh = Mesh(vertices, triangles, (1, 1, 1), 0.5, lit=False)
    scene = Scene(VOLUME, constant(0.0), view(VOLUME, projection), geometry=(mesh,), classification="slab")
    np.testing.assert_allclose(renderer.render(scene, SIZE), 0.5, atol=1e-7)
    np.testing.assert_allclose(raycast(scene, SIZE), 0.5, atol=1e-12)


def test_an_edge_through_middles_of_pixels_belongs_to_one_triangle(renderer: Renderer) -> None:
    """The diagonals of squares on the screen go exactly through pixels' middles, and squares begin and end on them."""
    camera = Camera.orthographic((0, 0, 10), (0, 0, 0), (0, 1, 0), height=16)
    positions = np.arange(-8, 9) + 0.5
    x, y = np.meshgrid(positions, positions, indexing="ij")
    vertices = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    first = (np.arange(16)[:, np.newaxis] * 17 + np.arange(16)).reshape(-1)
    for corners in ([(0, 17, 18), (0, 18, 1)], [(0, 17, 1), (17, 18, 1)], [(18, 0, 17), (1, 0, 18)]):
        triangles = np.concatenate([first[:, np.newaxis] + np.array(each) for each in corners])
        mesh = Mesh(vertices, triangles, (1, 1, 1), 0.5, lit=False)
        scene = Scene(Volume(np.zeros((4, 4, 4))), constant(0.0), camera, geometry=(mesh,), classification="slab")
        for picture in (renderer.render(scene, (14, 14)), raycast(scene, (14, 14))):
            np.testing.assert_allclose(picture[1:-1, 1:-1], 0.5, atol=1e-7)


@pytest.mark.parametrize(
    "classification, volume, transfer",
    [
        *((each, random_volume(1, (20, 18, 17)), FOG) for each in ("slab", "integrated")),
        *((each, smooth_volume(20), BONE) for each in ("slab", "extinction", "post")),
    ],
)
def test_pictures_converge_to_the_oracle(
    renderer: Renderer, classification: Classification, volume: Volume, transfer: Any
) -> None:
    geometry = tuple(each.mesh(lit=True) for each in crossing_quads(volume))
    scene = Scene(volume, transfer, view(volume, "perspective"), classification=classification, geometry=geometry)
    truth = raycast(scene, SIZE)
    pictures = [renderer.render(scene, SIZE, sampling_rate=rate, texture_format="rgba32f") for rate in (2, 8)]
    errors = [compare(picture, truth).rms_error for picture in pictures]
    assert errors[0] < 1e-3
    # Two doublings: order 1 at least (`slab` on dense matter), where rounding is not reached.
    assert errors[1] < max(errors[0] / 3.2, 5e-6)


# Texels of a medium, and of values.
@pytest.mark.parametrize("classification, caps", [("extinction", True), ("integrated", False)])
def test_bricks_and_leaps_make_the_same_picture(renderer: Renderer, classification: Classification, caps: bool) -> None:
    volume = sparse_volume(3)
    planes = (ClipPlane((1.0, 0.4, -0.2), float(np.dot((1.0, 0.4, -0.2), volume.centre) - 2)),)
    geometry = (
        *(each.mesh() for each in crossing_quads(volume)[1:4:2]),
        Lines(volume.corners_from_centre, [range(8)], width=3),
    )
    scene = Scene(volume, FOG, view(volume, "perspective"), classification=classification, geometry=geometry)
    scene = replace(scene, clip=planes, caps=caps)
    expected = renderer.render(scene, SIZE, sampling_rate=1.5, skip_empty=False)
    assert np.abs(renderer.render(scene, SIZE, sampling_rate=1.5) - expected).max() < 2e-6
    with Renderer(texture_memory=0.05) as pieces:
        assert np.abs(pieces.render(scene, SIZE, sampling_rate=1.5) - expected).max() < 2e-6
        assert quick_stats(pieces)["bricks_total"] > 1


LIGHTS = {
    "head": Lighting(),
    "sun": Lighting((Light("directional", (-1, -2, 3), (1, 0.8, 0.5)),), two_sided=False),
    "lamp": Lighting((Light("point", (3, -9, 11)), Light("directional", (1, 1, 1), (0.2, 0.2, 0.9)))),
    "ambient": Lighting(()),
    "shadows": Lighting((Light("directional", (-1, -2, 3)),), shadows=True),
}


@pytest.mark.parametrize(
    "name, smooth, projection",
    [
        ("head", False, "orthographic"),
        ("sun", True, "orthographic"),
        ("lamp", False, "perspective"),
        ("ambient", False, "orthographic"),
        ("shadows", True, "perspective"),
    ],
)
def test_light_on_surfaces_is_that_of_the_oracle(renderer: Renderer, name: str, smooth: bool, projection: str) -> None:
    """Matter of one value has no gradient, so that its own light is exact: all that is off is float32's normals.

    2^-23 of an angle, through a highlight of exponent 32.
    """
    volume = Volume(np.zeros((14, 9, 13)), VOLUME.spacing)
    vertices, triangles = ball(40, seed=2)
    normals = np.random.default_rng(4).normal(size=vertices.shape) if smooth else None
    position = volume.centre + 0.6 * volume.radius * vertices
    geometry = (
        Mesh(position, triangles, (0.8, 0.5, 0.3), 0.5, normals),
        Mesh(volume.centre + 0.3 * volume.radius * vertices, triangles, (0.2, 0.4, 0.9), lit=False),
    )
    scene = Scene(
        volume,
        constant(0.1, COLOR),
        view(volume, projection),
        geometry=geometry,
        lighting=LIGHTS[name],
        classification="slab",
    )
    scene = replace(scene, classification="post", depth_cue=None)
    picture, truth = renderer.render(scene, SIZE), raycast(scene, SIZE, shadow_nodes=64)
    # Shadows in the matter are those of parts about as thick as a slab.
    assert np.abs(picture - truth).max() < (2e-3 if name == "shadows" else 2e-5)
    unlit = raycast(replace(scene, geometry=tuple(replace(each, lit=False) for each in geometry)), SIZE)
    assert np.abs(unlit - truth).max() > 0.05


def test_either_side_of_a_surface_is_lit(renderer: Renderer) -> None:
    """A light on the eye's side lights what the eye sees; one behind it does not, whichever way the triangles go."""
    volume = Volume(np.zeros((8, 8, 8)))
    camera = Camera.orthographic((3.5, 3.5, -20), (3.5, 3.5, 0), (0, 1, 0), height=8)
    wall = quad((3.5, 3.5, 0.0), (9, 0, 0), (0, 9, 0), (1, 0.5, 0), 1.0).mesh(lit=True)
    turned = replace(wall, triangles=wall.triangles[:, ::-1])
    for lamp, brightness in ((-1.0, 1.0), (1.0, 0.3)):
        lighting = Lighting((Light("directional", (0, 0, lamp)),), specular=0.0, two_sided=False)
        for mesh in (wall, turned, replace(wall, normals=np.tile((0, 0, 1.0), (4, 1)))):
            scene = Scene(volume, constant(0.0), camera, lighting=lighting, geometry=(mesh,), classification="slab")
            expected = np.broadcast_to((brightness, brightness / 2, 0, 1), (4, 4, 4))
            for picture in (renderer.render(scene, (4, 4)), raycast(scene, (4, 4))):
                np.testing.assert_allclose(picture, expected, atol=1e-6)


def test_a_depth_cue_is_that_of_the_place(renderer: Renderer) -> None:
    """A quad across the view, in nothing, at a third of the cue's range."""
    volume = Volume(np.zeros((8, 8, 8)))
    camera = Camera.orthographic((3.5, 3.5, -20), (3.5, 3.5, 0), (0, 1, 0), height=8)
    cue = DepthCue(0.9, (0.1, 0.2, 0.3), near=10, far=40)
    wall = quad((3.5, 3.5, 0.0), (9, 0, 0), (0, 9, 0), (1, 0.5, 0), 0.6)
    scene = Scene(volume, constant(0.0), camera, depth_cue=cue, geometry=(wall.mesh(),), classification="slab")
    fraction = 0.9 / 3
    expected = 0.6 * np.append((1 - fraction) * np.array([1, 0.5, 0]) + fraction * np.array([0.1, 0.2, 0.3]), 1)
    for picture in (renderer.render(scene, (9, 9)), raycast(scene, (9, 9))):
        np.testing.assert_allclose(picture, np.broadcast_to(expected, (9, 9, 4)), atol=1e-6)


@pytest.mark.parametrize("target", ["rgba8", "rgba16f", "rgba32f"])
def test_surfaces_brighter_than_white_are_drawn_into_any_target(renderer: Renderer, target: str) -> None:
    """A head light and a highlight: 1.2 of white, which 8 bits hold at half the scale, in steps of 2 / 255."""
    volume = Volume(np.zeros((8, 8, 8)))
    camera = Camera.orthographic((3.5, 3.5, -20), (3.5, 3.5, 0), (0, 1, 0), height=8)
    wall = quad((3.5, 3.5, 0.0), (9, 0, 0), (0, 9, 0), (1, 1, 1), 1.0)
    scene = Scene(volume, constant(0.0), camera, geometry=(wall.mesh(lit=True),), classification="slab")
    picture = renderer.render(scene, (4, 4), target_format=target)
    np.testing.assert_allclose(picture[..., :3], 1.2, atol={"rgba8": 1 / 255, "rgba16f": 1e-3, "rgba32f": 1e-6}[target])
