"""The oracle of lit scenes in closed form: constant gradients, so that what remains is an integral that is known."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from support.lit_fields import (
    AMBIENT,
    COLOR,
    EXTINCTION,
    GRIDS,
    LIGHTING,
    SLOPE,
    SUN,
    answer,
    cued,
    framed,
    lights_of,
    linear_volume,
    uniform,
    unit,
)
from support.scenes import path_lengths, random_volume

from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume

BOTH = pytest.mark.parametrize("classification", ["extinction", "post"])
SIZE = (4, 3)
# Gradients of a linear field are exact to its values' rounding, 1e-15 of some 10 over spacings of 0.3; a highlight of
# exponent 50 takes that fifty times. A pixel has some ten pieces of an error of 1e-12 at most, all being constant.
EXACT = {"rtol": 0, "atol": 1e-11}


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("light", LIGHTING)
def test_a_constant_medium_shows_one_shade(light, grid, projection):
    for slope in (SLOPE, -SLOPE):  # both sides are seen
        volume = linear_volume(slope, **GRIDS[grid])
        scene = Scene(volume, uniform(), framed(volume, projection), classification="post", lighting=LIGHTING[light])
        camera = scene.camera
        diffuse, specular = answer(scene.lighting, slope, -camera.rays(SIZE)[1])
        alpha = -np.expm1(-EXTINCTION * path_lengths(volume, camera, SIZE))[..., None]
        wanted = np.concatenate([(COLOR * diffuse + specular) * alpha, alpha], axis=-1)
        np.testing.assert_allclose(raycast(scene, SIZE), wanted, **EXACT)
        if projection == "orthographic":  # V is the same at all samples
            np.testing.assert_allclose(raycast(replace(scene, classification="slab"), SIZE), wanted, **EXACT)


@BOTH
@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.999, 1.5])
def test_light_fades_where_the_gradient_is_small(fraction, classification):
    volume = linear_volume(fraction * SLOPE if fraction else 0 * SLOPE, **GRIDS["sheared"])
    lighting = replace(LIGHTING["several"], fade=float(np.linalg.norm(SLOPE)))
    scene = Scene(volume, uniform(), framed(volume), classification=classification, lighting=lighting)
    w = min(fraction, 1) ** 2 * (3 - 2 * min(fraction, 1))
    diffuse, specular = answer(lighting, SLOPE, -scene.camera.rays(SIZE)[1], w)
    alpha = -np.expm1(-EXTINCTION * path_lengths(volume, scene.camera, SIZE))[..., None]
    np.testing.assert_allclose(raycast(scene, SIZE)[..., :3], (COLOR * diffuse + specular) * alpha, **EXACT)


def test_where_no_fade_is_given_it_is_a_hundredth_of_the_range_per_smallest_spacing():
    volume = linear_volume(**GRIDS["anisotropic"])
    low, high = volume.value_range
    lighting = LIGHTING["several"]
    told = replace(lighting, fade=float(0.01 * (high - low) / 0.3))
    soft = TransferFunction([low, high], [COLOR, COLOR], [0, 1])
    scene = Scene(replace_corner(volume), soft, classification="post", lighting=lighting)
    np.testing.assert_array_equal(raycast(scene, SIZE), raycast(replace(scene, lighting=told), SIZE))


def replace_corner(volume):
    """The same volume, with a flat corner, where light fades."""
    values = volume.values.copy()
    values[:3, :3, :3] = values[1, 1, 1]
    return Volume(values, volume.spacing)


@BOTH
def test_a_point_light_far_away_is_a_directional_one(classification):
    volume = linear_volume(**GRIDS["sheared"])
    direction = unit(np.array(SUN.vector))
    # 1e9 spans of the volume away, light turns by 1e-9 on the way, and a highlight of exponent 20 by 2e-8.
    far = Light("point", tuple(volume.centre + 1e10 * direction), SUN.color)
    pictures = [
        raycast(Scene(volume, uniform(), classification=classification, lighting=lights_of(light)), SIZE)
        for light in (far, SUN)
    ]
    np.testing.assert_allclose(*pictures, rtol=0, atol=1e-8)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_point_light_lies_where_it_is_said(projection):
    # Opaque matter shows the shade of the place where the ray enters the box: D is the cosine there.
    volume = linear_volume(**GRIDS["sheared"])
    position = volume.centre + volume.radius * np.array([0.4, -3.0, 0.9])
    lighting = Lighting((Light("point", tuple(position)),), 0, 1, 0)
    scene = Scene(volume, uniform(np.inf), framed(volume, projection), classification="post", lighting=lighting)
    eyes, directions = scene.camera.rays(SIZE)
    inverse = np.linalg.inv(volume.box_edges)
    start, step = (eyes - volume.box_corner) @ inverse.T, directions @ inverse.T
    enter = np.minimum(-start / step, (1 - start) / step).max(axis=-1, keepdims=True)
    normal = unit(SLOPE) * np.sign((directions * SLOPE).sum(-1, keepdims=True)) * -1
    cosine = (normal * unit(position - eyes - enter * directions)).sum(-1)
    wanted = COLOR * (np.maximum(cosine, 0) * (path_lengths(volume, scene.camera, SIZE) > 0))[..., None]
    assert wanted.max() > 0.3
    # Opacity is looked at a billionth of a cell behind its beginning.
    np.testing.assert_allclose(raycast(scene, SIZE)[..., :3], wanted, rtol=0, atol=1e-8)


@BOTH
def test_lights_add_up(classification):
    volume = random_volume(4)
    soft = TransferFunction([0, 1], [COLOR, COLOR], [0, 2])
    point = Light("point", (3.0, 20.0, 4.0), (0.1, 0.9, 0.4))

    def picture(*lights, ambient=0.0):
        lighting = Lighting(lights, ambient, 0.7, 0.4)
        return raycast(Scene(volume, soft, classification=classification, lighting=lighting), SIZE)[..., :3]

    # Each is good to 1e-9, see `raycast`.
    parts = picture(Light()) + picture(SUN) + picture(point) + picture(ambient=0.3)
    np.testing.assert_allclose(picture(Light(), SUN, point, ambient=0.3), parts, rtol=0, atol=4e-9)


@BOTH
def test_without_lights_there_is_the_ambient_share(classification):
    volume = random_volume(4)
    soft = TransferFunction([0, 0.5, 1], [COLOR, 1 - COLOR, COLOR], [0, 2, 1])
    plain = raycast(Scene(volume, soft, classification=classification), SIZE)
    for lights in ((), (Light(color=(0, 0, 0)),)):
        dark = raycast(Scene(volume, soft, classification=classification, lighting=lights_of(*lights)), SIZE)
        np.testing.assert_allclose(dark, plain * [AMBIENT, AMBIENT, AMBIENT, 1], rtol=0, atol=2e-9)


@BOTH
@pytest.mark.parametrize("lit", [False, True])
def test_a_depth_cue_in_a_constant_medium(lit, classification):
    volume = linear_volume((0, 0, 0.9), (9, 3, 3), spacing=(1, 1, 0.5))
    camera = Camera.orthographic(volume.centre - (0, 0, 4.25), volume.centre, (0, 1, 0), 1)
    fog = np.array([0.1, 0.6, 0.8])
    cue = DepthCue(0.75, tuple(fog), near=3.1, far=5.7)  # the box is from 2 to 6.5
    lighting = LIGHTING["head"] if lit else None
    scene = Scene(volume, uniform(), camera, classification=classification, lighting=lighting, depth_cue=cue)
    color = COLOR
    if lit:
        diffuse, specular = answer(lighting, (0, 0, 0.9), np.array([0, 0, -1.0]))
        color = COLOR * diffuse + specular
    pieces = [(2, 3.1, 0, 0), (3.1, 5.7, 0, 0.75), (5.7, 6.5, 0.75, 0.75)]
    wanted = sum(
        np.exp(-EXTINCTION * (start - 2)) * cued(color, EXTINCTION, end - start, t0, t1, fog)
        for start, end, t0, t1 in pieces
    )
    np.testing.assert_allclose(raycast(scene, (1, 1))[0, 0, :3], wanted, **EXACT)


def test_a_depth_cue_reaches_from_the_nearest_to_the_farthest_corner_along_the_view():
    volume = linear_volume(**GRIDS["sheared"])
    camera = framed(volume, "perspective")
    depths = camera.in_eye_space(volume.corners_from_centre, volume.centre)[:, 2]
    told = DepthCue(0.5, (0.2, 0.3, 0.4), float(depths.min()), float(depths.max()))
    scene = Scene(volume, uniform(), camera, classification="post", depth_cue=replace(told, near=None, far=None))
    np.testing.assert_array_equal(raycast(scene, SIZE), raycast(replace(scene, depth_cue=told), SIZE))


@BOTH
@pytest.mark.parametrize("grid", GRIDS)
def test_modulation_by_a_constant_gradient(grid, classification):
    volume = linear_volume(**GRIDS[grid])
    m = float(np.linalg.norm(SLOPE))
    modulation = np.array([[0.5 * m, 0.2], [1.5 * m, 0.8], [2 * m, 9]])  # 0.5 at m
    scene = Scene(volume, uniform(modulation=modulation), framed(volume), classification=classification)
    alpha = -np.expm1(-0.5 * EXTINCTION * path_lengths(volume, scene.camera, SIZE))[..., None]
    wanted = np.concatenate([COLOR * alpha, alpha], axis=-1)
    np.testing.assert_allclose(raycast(scene, SIZE), wanted, **EXACT)


@pytest.mark.parametrize("thickness", [0.7, 1e-3])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("grid", GRIDS)
def test_a_contour_across_a_linear_field(grid, projection, thickness):
    # |f - f_v| / |∇f| is the distance from a plane: along a ray a triangle, r / cos θ wide on each side.
    volume = linear_volume(shape=(19, 20, 21), **GRIDS[grid])
    contour = Contour(0.07, thickness, tuple(COLOR * EXTINCTION), EXTINCTION)
    camera = Camera.framing(volume, projection, height=0.4) if projection == "orthographic" else framed(volume)
    scene = Scene(volume, uniform(0.0, contours=(contour,)), camera, classification="post")
    cosine = np.abs(camera.rays((1, 1))[1] @ unit(SLOPE))
    alpha = -np.expm1(-EXTINCTION * thickness / cosine)[..., None]
    np.testing.assert_allclose(raycast(scene, (1, 1)), np.concatenate([COLOR * alpha, alpha], axis=-1), **EXACT)


def test_graded_matter_in_a_linear_field():
    # Along z the value grows by 0.5 per world unit; |∇f| = 0.5 is a quarter of the way from 0.4 to 0.8.
    volume = linear_volume((0, 0, 0.5), (21, 3, 3))
    camera = Camera.orthographic(volume.centre - (0, 0, 30), volume.centre, (0, 1, 0), 1)
    graded = Graded(np.array([-3.0, 1, 2, 2]), np.outer([0, 2, 2, 6], COLOR), np.array([0, 2.0, 2, 6]), 0.4, 0.8)
    stepped = Graded(np.array([-1.0, 0.5]), np.outer([1, 1], COLOR), np.array([1.0, 1]), 0.499, 0.499)
    above = Graded(np.array([-1.0, 0.5]), np.outer([1, 1], COLOR), np.array([1.0, 1]), 0.501, 0.501)
    medium = uniform(0.0, graded=(graded, stepped, above))
    scene = Scene(volume, medium, camera, classification="post")
    alpha = -np.expm1(-(0.25 * (4 * 2 / 2 + 1 * 2) / 0.5 + 1.5 / 0.5))
    np.testing.assert_allclose(raycast(scene, (1, 1))[0, 0], [*(COLOR * alpha), alpha], **EXACT)


@BOTH
@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_the_unit_of_the_world_and_of_the_values_is_no_matter(scale, classification):
    values = random_volume(6).values.astype(float)

    def picture(world, data):
        graded = Graded(
            data * np.array([0.1, 0.9]), np.ones((2, 3)) / world, np.ones(2) / world, 0.1 * data / world, data / world
        )
        medium = TransferFunction(
            data * np.array([0, 1]),
            [COLOR, 1 - COLOR],
            np.array([0, 1]) / world,
            modulation=np.array([[0.1 * data / world, 0], [0.4 * data / world, 1]]),
            graded=(graded,),
            contours=(Contour(0.5 * data, 0.3 * world, tuple(COLOR / world), 1 / world),),
        )
        volume = Volume(values * data, np.array([1, 1.3, 0.7]) * world)
        lighting = LIGHTING["several"]
        return raycast(Scene(volume, medium, classification=classification, lighting=lighting), SIZE)

    plain = picture(1.0, 1.0)
    np.testing.assert_allclose(picture(scale, 1.0), plain, rtol=0, atol=2e-9)
    np.testing.assert_allclose(picture(1.0, scale * 1e100), plain, rtol=0, atol=2e-9)


@BOTH
def test_samples_that_are_no_numbers_leave_the_rest_as_it_is(classification):
    volume = random_volume(7, (9, 9, 9))
    values = volume.values.copy()
    values[6:, :, :] = np.nan
    values[0, 0, 0] = np.inf
    soft = TransferFunction([0, 1], [COLOR, COLOR], [0.1, 2])
    scene = Scene(Volume(values, volume.spacing), soft, classification=classification, lighting=LIGHTING["several"])
    picture = raycast(scene, (16, 16))
    assert np.isfinite(picture).all()
    unlit = raycast(replace(scene, lighting=None), (16, 16))
    np.testing.assert_allclose(picture[..., 3], unlit[..., 3], rtol=0, atol=2e-9)
    assert (picture[..., 3] > 0.1).any()


def test_a_picture_without_light_compiles_no_light():
    code = """
import sys, numpy as np
from texvol import Scene, TransferFunction, Volume, raycast
raycast(Scene(Volume(np.ones((2, 2, 2))), TransferFunction([0], [[1, 1, 1]], [1])), (1, 1))
assert not [name for name in sys.modules if "ray_casting.lit" in name]
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=300)
