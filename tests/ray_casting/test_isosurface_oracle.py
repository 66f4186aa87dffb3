"""The oracle's isosurface: where it is, against planes, spheres and roots of dense samples; and how it is lit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.optimize import brentq
from support.scenes import path_lengths

from texvol.ray_casting.common.surface_lighting import gradients_at
from texvol.ray_casting.projection import isosurface_depth, project
from texvol.ray_casting.projection.tracer import first_hit
from texvol.scene.camera import Camera
from texvol.scene.display import ISOSURFACE_COLOR
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting, unit
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (15, 11)
DIRECTION = [[-1, 0.4, 0], [0.2, 1, 0.3], [0, 0, 1]]
PROJECTIONS = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


def index_of(volume, points):
    return (points - volume.origin) @ volume.index_from_world.T


def world_of(volume):
    """World positions of the samples, shape (nz, ny, nx, 3)."""
    nz, ny, nx = volume.values.shape
    z, y, x = np.indices((nz, ny, nx))
    return volume.origin + np.stack([x, y, z], axis=-1) @ volume.world_from_index.T


def with_values(volume, of_world):
    placed = {"spacing": volume.spacing, "origin": volume.origin, "direction": volume.direction}
    return Volume(of_world(world_of(volume)), **placed)


def hits(scene, size=SIZE):
    """Where rays hit: mask of pixels, and points and ray directions there."""
    depth, camera = isosurface_depth(scene, size), scene.completed(size).camera
    eyes, directions = camera.rays(size)
    hit = np.isfinite(depth)
    line_of_sight = depth[hit] / (directions[hit] @ camera.forward)
    return hit, eyes[hit] + line_of_sight[:, None] * directions[hit], directions[hit]


@PROJECTIONS
@pytest.mark.parametrize("rising", [True, False])
def test_that_of_a_linear_field_is_a_plane(projection, rising):
    slope = np.array([0.3, 1.1, -0.5]) * (1 if rising else -1)
    grid = Volume(np.zeros((9, 8, 10)), (1, 0.7, 1.2), (30, 40, 50), DIRECTION)
    volume = with_values(grid, lambda position: position @ slope)
    isovalue = float(volume.centre @ slope)
    camera = Camera.framing(volume, projection)
    eyes, directions = camera.rays(SIZE)
    line_of_sight = (isovalue - eyes @ slope) / (directions @ slope)
    index = index_of(volume, eyes + line_of_sight[..., None] * directions)
    last = np.array(volume.dimensions) - 1
    within = ((index >= 0) & (index <= last)).all(axis=-1)
    outside = ((index < -0.5) | (index > last + 0.5)).any(axis=-1) & (path_lengths(volume, camera, SIZE) == 0)
    assert within.sum() > 20 and outside.any()
    depth = isosurface_depth(
        Scene(volume, camera=camera, mode="isosurface", isovalue=isovalue, classification="slab"), SIZE
    )
    np.testing.assert_allclose(depth[within], (line_of_sight * (directions @ camera.forward))[within], rtol=1e-12)
    assert np.isinf(depth[outside]).all()


@pytest.mark.parametrize("view", ["orthographic", "perspective", "inside"])
def test_it_is_the_first_root_of_dense_samples(view):
    values = np.random.default_rng(7).random((6, 7, 5))
    volume = Volume(values, (1, 1.4, 0.6), direction=DIRECTION)
    camera = Camera.framing(volume, "perspective" if view == "perspective" else "orthographic")
    if view == "inside":
        camera = Camera.perspective(volume.centre, volume.centre + [1, 2, -0.4], (0, 0, 1), fov=80)
    depth = isosurface_depth(Scene(volume, camera=camera, mode="isosurface", isovalue=0.7, classification="slab"), SIZE)
    eyes, directions = camera.rays(SIZE)
    found = 0
    for pixel in np.ndindex(depth.shape):

        def height(s, pixel=pixel):
            index = index_of(volume, eyes[pixel] + np.atleast_1d(s)[:, None] * directions[pixel])
            inside = ((index >= -0.5) & (index <= np.array(volume.dimensions) - 0.5)).all(axis=-1)
            along = map_coordinates(values, index.T[::-1], order=1, mode="nearest")
            return np.where(inside, along - 0.7, np.nan)

        s = np.linspace(0, 4 * volume.radius, 20_000)
        passed = np.nonzero(height(s)[:-1] * height(s)[1:] <= 0)[0]
        if passed.size:
            root = brentq(lambda t, height=height: height(t)[0], s[passed[0]], s[passed[0] + 1], xtol=1e-13)
            assert depth[pixel] == pytest.approx(root * (directions[pixel] @ camera.forward), rel=1e-11)
            found += 1
        else:
            assert np.isinf(depth[pixel])
    assert 10 < found < depth.size


def column(values, isovalue):
    """Depth of the surface, from where the box begins, that the ray down a column of samples sees."""
    volume = Volume(np.broadcast_to(np.array(values, float)[:, None, None], (len(values), 3, 3)))
    camera = Camera.orthographic((1, 1, -10.5), (1, 1, 0), (0, 1, 0), 1)
    return (
        isosurface_depth(
            Scene(volume, camera=camera, mode="isosurface", isovalue=isovalue, classification="slab"), (1, 1)
        )[0, 0]
        - 10
    )


@pytest.mark.parametrize(
    "values, isovalue, expected",
    [
        ([0, 0, 4, 4], 1, 1.75),
        ([4, 4, 0, 0], 1, 2.25),  # from above, and not where the ray enters
        ([4, 4, 4], 1, np.inf),
        ([0, 0, 0], 1, np.inf),
        ([0, 1, 0], 1, 1.5),  # touched
        ([2, 1, 2], 1, 1.5),
        ([1, 2, 3], 1, 0.0),  # met where the ray enters
        ([0, np.nan, 4, 4], 1, np.inf),  # nothing passes it beside a gap
        ([0, np.nan, 4, 0], 1, 3.25),
        ([0, 0, np.inf], 1, 1.5),  # a jump passes it on the face
        ([np.inf, 0, 0], 1, 1.5),
        ([np.inf, np.inf, -np.inf], 1, np.inf),  # both with weight: no value at all
        ([np.nan, np.nan], 1, np.inf),
    ],
)
def test_where_a_value_is_passed(values, isovalue, expected):
    assert column(values, isovalue) == pytest.approx(expected, abs=1e-13)
    negative = [-value for value in values]
    assert column(negative, -isovalue) == pytest.approx(expected, abs=1e-13)


def test_a_value_that_is_touched_inside_a_cell_is_met_where_it_turns():
    corners = np.array([0.0, 0, 0, 4, 0, 0, 0, 4])  # 4 x y, along (1, -1, 0) 4 t (1 - t)
    assert first_hit(corners, 0.0, (0.0, 1.0, 0.5), (1.0, 0.0, 0.5), 1.0, -1.0)[0] == 0.5  # a search stops √ε before it


def ball(spacing=(1.0, 1.0, 1.0), samples=24, **options):
    """The squared distance from the middle of a box, and a scene of its surface at 0.4 of the smallest side."""
    grid = Volume(np.zeros((samples,) * 3), spacing, (7, -8, 9), options.pop("direction", None))
    volume = with_values(grid, lambda position: ((position - grid.centre) ** 2).sum(axis=-1))
    radius = 0.4 * samples * min(spacing)
    projection = options.pop("projection", "orthographic")
    camera = Camera.framing(volume, projection, fov=30 if projection == "perspective" else None)
    return Scene(volume, camera=camera, mode="isosurface", isovalue=radius**2, **options), radius


def lit(scene, normals, directions, points):
    """Straight colour of the surface by the formulas in `lighting`, one light and one place at a time."""
    lighting, color = scene.lighting or Lighting(), np.array(ISOSURFACE_COLOR)
    result = []
    for normal, direction, point in zip(normals, directions, points, strict=True):
        light_sum, shine = np.full(3, lighting.ambient), np.zeros(3)
        if lighting.two_sided and normal @ -direction < 0:
            normal = -normal
        for light in lighting.lights:
            to_light = {
                "head": lambda light, point, direction: -direction,
                "directional": lambda light, point, direction: unit(light.vector),
                "point": lambda light, point, direction: unit(light.vector - point),
            }[light.kind](light, point, direction)
            light_sum += lighting.diffuse * max(normal @ to_light, 0) * np.array(light.color)
            if normal @ to_light > 0:
                height = max(normal @ unit(to_light - direction), 0)
                shine += lighting.specular * height**lighting.shininess * np.array(light.color)
        result.append(color * light_sum + shine)
    return np.array(result)


LIGHTINGS = {
    "default": None,
    "matt": Lighting(specular=0),
    "coloured": Lighting(
        (Light("directional", (1, -3, 2), (1, 0.5, 0.2)), Light("point", (7, -40, 60), (0.1, 0.3, 0.9))),
        *(0.1, 0.6, 0.5, 8.0),
    ),
    "one-sided": Lighting((Light("directional", (1, 2, 3)), Light()), two_sided=False),
}


@PROJECTIONS
@pytest.mark.parametrize("light", LIGHTINGS)
def test_a_ball_is_lit_by_its_normals(projection, light):
    # Central differences of a square are exact and linear: the normal at the hit is exactly away from the centre, or
    # towards it, where the value rises outwards. (Inside the ball's box no difference is one-sided.)
    scene, _ = ball((1.0, 1.1, 1.3), direction=DIRECTION, projection=projection, lighting=LIGHTINGS[light])
    hit, points, directions = hits(scene)
    assert hit.sum() > 10
    inwards = scene.volume.centre - points
    normals = inwards / np.linalg.norm(inwards, axis=1, keepdims=True)
    picture = project(scene, SIZE)
    np.testing.assert_allclose(picture[hit, :3], lit(scene, normals, directions, points), rtol=0, atol=1e-10)
    assert (picture[hit, 3] == 1).all() and not picture[~hit].any()


@PROJECTIONS
def test_a_ball_is_where_the_sphere_is_and_lit_as_it_is(projection):
    # Trilinear, r² comes out too large by Σ f (1 - f) h² <= 3/4 per unit spacing: the surface lies within 3/8R inside
    # the sphere, and along a ray at cosine c to the normal that is 3/8Rc nearer or farther.
    scene, radius = ball(samples=48, projection=projection, lighting=Lighting(specular=0))
    camera, volume = scene.camera, scene.volume
    eyes, directions = camera.rays(SIZE)
    from_centre = eyes - volume.centre
    along = -(from_centre * directions).sum(axis=-1)
    miss = (from_centre**2).sum(axis=-1) - along**2
    cosine = np.sqrt(np.maximum(1 - miss / radius**2, 0))
    steep = cosine > 0.4
    expected = (along - radius * cosine) * (directions @ camera.forward)
    farther = isosurface_depth(scene, SIZE)[steep] - expected[steep]
    most = 3 / (8 * radius * cosine[steep])
    # To second order in the shift: it goes on by itself / 2R c times its tangent, under a tenth more where c > 0.4.
    assert (farther > -1e-12).all() and (farther < 1.1 * most).all() and farther.max() > 0.1 * most.min()
    # The normal turns by the shift's share across it over R: at most 3/8R² tan θ; and d cosθ = sin θ dθ.
    lit_by_head = np.array(ISOSURFACE_COLOR) * (0.3 + 0.7 * cosine[steep, None])
    sine = np.sqrt(1 - cosine[steep, None] ** 2)
    turned = 1.1 * 3 / (8 * radius**2) * sine**2 / cosine[steep, None]
    assert (np.abs(project(scene, SIZE)[steep, :3] - lit_by_head) <= turned + 1e-12).all()


def test_where_the_gradient_is_small_light_falls_from_all_sides():
    lighting = Lighting((Light("directional", (0, 1, 2)),), 0.1, 0.6, 0.5, 4.0, two_sided=False)
    volume = with_values(Volume(np.zeros((8, 8, 8)), (1, 1, 0.5)), lambda position: -0.25 * position[..., 2])
    camera = Camera.orthographic(volume.centre + (0, 0, 10), volume.centre, (0, 1, 0), 1)
    scene = Scene(
        volume, camera=camera, mode="isosurface", isovalue=float(-0.25 * volume.centre[2]), classification="slab"
    )
    cosine, halfway = 2 / np.sqrt(5), unit(np.array([0, 1, 2]) / np.sqrt(5) + [0, 0, 1])[2]
    for fade, w in [
        (None, 1.0),
        (0.125, 1.0),
        (0.5, 0.5),
        (1.0, 0.0625 * 2.5),
        (1e9, 0.0),
    ]:  # 3 t² - 2 t³ of |g| / fade
        pixel = project(replace(scene, lighting=replace(lighting, fade=fade)), (1, 1))[0, 0]
        diffuse, specular = 0.1 + 0.6 * ((1 - w) + w * cosine), 0.5 * w * halfway**4
        np.testing.assert_allclose(pixel[:3], np.array(ISOSURFACE_COLOR) * diffuse + specular, rtol=1e-12, atol=1e-12)


def test_gradients_are_those_of_the_samples_interpolated():
    random = np.random.default_rng(8)
    volume = Volume(random.random((70, 4, 5)), (1, 2, 3), direction=DIRECTION)
    index = random.uniform(-0.5, np.array(volume.dimensions) - 0.5, (500, 3))
    index[:100] = np.rint(index[:100])
    per_index = np.stack(np.gradient(volume.values)[::-1], axis=-1)  # central, and one-sided at the border
    samples = per_index @ volume.index_from_world * volume.smallest_spacing
    expected = [map_coordinates(samples[..., axis], index.T[::-1], order=1, mode="nearest") for axis in range(3)]
    np.testing.assert_allclose(gradients_at(volume, Estimator(), index), np.transpose(expected), rtol=0, atol=1e-12)


@PROJECTIONS
def test_a_depth_cue_mixes_by_depth_along_the_view(projection):
    cue = DepthCue(0.8, (0.1, 0.2, 0.3))
    scene, _ = ball(projection=projection, background=(0.5, 0.6, 0.7))
    hit, points, _ = hits(scene)
    plain, cued = project(scene, SIZE), project(replace(scene, depth_cue=cue), SIZE)
    depth = (points - scene.camera.eye) @ scene.camera.forward
    near, far = cue.range_for(scene.volume, scene.camera)
    t = 0.8 * ((depth - near) / (far - near))[:, None]
    assert t.min() > 0.1 and np.ptp(t) > 0.05
    np.testing.assert_allclose(cued[hit, :3], plain[hit, :3] * (1 - t) + t * np.array(cue.color), atol=1e-11)
    np.testing.assert_array_equal(cued[~hit], np.broadcast_to([0.5, 0.6, 0.7, 0], cued[~hit].shape))


@pytest.mark.parametrize(
    "transfer, color",
    [
        (None, ISOSURFACE_COLOR),
        (TransferFunction([0, 10], [[1, 0, 0], [0, 0, 1]], [0, 0]), (0.75, 0, 0.25)),
        (TransferFunction([0, 10], [[0, 0, 0], [0.8, 0.4, 0]], [0, 4], premultiplied=True), (0.2, 0.1, 0)),
        (TransferFunction([0, 10], [[0.2, 0.4, 0.6]] * 2, [np.inf] * 2, premultiplied=True), (0.2, 0.4, 0.6)),
        (TransferFunction([0, 10], [[0.2, 0.4, 0.6]] * 2, [0, 0], premultiplied=True), ISOSURFACE_COLOR),
        (TransferFunction([0, 10], [[5, 5, 5]] * 2, [0, 0], emissive=True), ISOSURFACE_COLOR),
        (TransferFunction([0, 10], [[0, 0, 0], [8, 4, 0]], [1, 1], emissive=True), (0.25, 0.125, 0)),
    ],
    ids=["none", "straight", "premultiplied", "opaque", "premultiplied nothing", "gas that hides nothing", "gas"],
)
def test_its_colour_is_that_of_its_value(transfer, color):
    volume = Volume(np.arange(6.0)[:, None, None].repeat(3, 1).repeat(3, 2))
    camera = Camera.orthographic(volume.centre - (0, 0, 10), volume.centre, (0, 1, 0), 1)
    lighting = Lighting(ambient=1, diffuse=0, specular=0)
    scene = Scene(volume, transfer, camera, mode="isosurface", isovalue=2.5, lighting=lighting, classification="slab")
    np.testing.assert_allclose(project(scene, (1, 1))[0, 0], [*color, 1], rtol=1e-12)
