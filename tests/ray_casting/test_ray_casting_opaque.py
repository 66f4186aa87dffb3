"""The oracle of opaque, dense and premultiplied matter, lit and unlit, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.lit_fields import COLOR, LIGHTING, SLOPE, answer, cued, framed, linear_volume, uniform
from support.scenes import path_lengths, random_volume

from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.lighting import DepthCue
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction

BOTH = pytest.mark.parametrize("classification", ["extinction", "post"])
SIZE = (4, 3)


@pytest.mark.parametrize("classification", ["slab", "extinction", "post", "integrated"])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_premultiplied_points_of_one_colour_are_associated_ones(projection, classification):
    volume = random_volume(5)
    values, extinctions = np.array([0.1, 0.4, 0.4, 0.7, 1.0]), np.array([0, 0.8, 3, 0.2, 1.5])
    straight = TransferFunction(values, [COLOR] * 5, extinctions)
    mixed = TransferFunction(values, np.outer(extinctions, COLOR), extinctions, premultiplied=True)
    scene = Scene(volume, straight, framed(volume, projection), (0.1, 0.2, 0.3), classification)
    wanted = raycast(scene, SIZE)
    # Some fifty pieces, each to a few ulps.
    np.testing.assert_allclose(raycast(replace(scene, transfer_function=mixed), SIZE), wanted, rtol=0, atol=1e-12)


def test_premultiplied_colours_mix_by_their_extinction():
    # Where τ is the same at both points, q is linear along the ray, as a depth cue's colour is.
    volume = linear_volume((0, 0, 0.5), (9, 3, 3))
    camera = Camera.orthographic(volume.centre - (0, 0, 30), volume.centre, (0, 1, 0), 1)
    red, blue = np.array([1.2, 0, 0]), np.array([0, 0, 1.2])
    mixed = TransferFunction([-2, 2], [red, blue], [1.2, 1.2], premultiplied=True)
    # Values are from -2 to 2 over 8 units, and the same half a unit beyond.
    ends = np.exp(-1.2 * 0.5), np.exp(-1.2 * 8.5)
    middle = ends[0] * cued(red / 1.2, 1.2, 8.0, 0, 1, blue / 1.2)
    wanted = red / 1.2 * (1 - ends[0]) + middle + blue / 1.2 * (ends[1] - np.exp(-1.2 * 9))
    picture = raycast(Scene(volume, mixed, camera, classification="post"), (1, 1))
    np.testing.assert_allclose(picture[0, 0, :3], wanted, rtol=0, atol=1e-12)


def opaque_above(value, **further):
    """A gas up to a value, opaque from there on."""
    thin, solid = np.array([0.2, 0.3, 0.4]), np.array([0.9, 0.6, 0.2])
    colors = [thin * 0.5, thin * 0.5, solid] if further.get("premultiplied") else [thin, thin, solid]
    return TransferFunction([value - 9, value, value], colors, [0.5, 0.5, np.inf], **further), thin, solid


@pytest.mark.parametrize("premultiplied", [False, True])
@pytest.mark.parametrize("lit", [False, True])
def test_opaque_matter_shows_its_shade_where_it_begins(lit, premultiplied):
    volume = linear_volume((0, 0, 0.5), (9, 3, 3))
    camera = Camera.orthographic(volume.centre - (0, 0, 30), volume.centre, (0, 1, 0), 1)
    medium, thin, solid = opaque_above(0.3, premultiplied=premultiplied)
    lighting = LIGHTING["several"] if lit else None
    scene = Scene(volume, medium, camera, classification="post", lighting=lighting)
    diffuse, specular = answer(lighting, (0, 0, 0.5), np.array([0, 0, -1.0])) if lit else (1.0, 0.0)
    through = np.exp(-0.5 * (4.5 + 0.3 / 0.5))
    wanted = (thin * diffuse + specular) * (1 - through) + (solid * diffuse + specular) * through
    np.testing.assert_allclose(raycast(scene, (1, 1))[0, 0], [*wanted, 1], rtol=0, atol=1e-9)
    # All of it lies behind where the cue is whole.
    picture = raycast(replace(scene, depth_cue=DepthCue(1.0, (0.0, 0.1, 0.0), 1.0, 1.1)), (1, 1))
    np.testing.assert_allclose(picture[0, 0], [0, 0.1, 0, 1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("premultiplied", [False, True])
@pytest.mark.parametrize("lit", [False, True])
def test_opaque_samples_show_their_shade_where_their_cell_begins(lit, premultiplied):
    volume = linear_volume((0, 0, 0.5), (9, 3, 3))
    camera = Camera.orthographic(volume.centre - (0, 0, 30), volume.centre, (0, 1, 0), 1)
    medium, thin, solid = opaque_above(0.3, premultiplied=premultiplied)  # samples are at …, 0, 0.5, …
    lighting = LIGHTING["several"] if lit else None
    scene = Scene(volume, medium, camera, classification="slab", lighting=lighting)
    diffuse, specular = answer(lighting, (0, 0, 0.5), np.array([0, 0, -1.0])) if lit else (1.0, 0.0)
    through = np.exp(-0.5 * 4.5)
    wanted = (thin * diffuse + specular) * (1 - through) + (solid * diffuse + specular) * through
    np.testing.assert_allclose(raycast(scene, (1, 1))[0, 0], [*wanted, 1], rtol=0, atol=1e-9)


@BOTH
@pytest.mark.parametrize("factor", [0.0, 0.01])
def test_modulation_leaves_opaque_matter_whole_or_takes_it_away(factor, classification):
    volume = linear_volume((0, 0, 0.5), (9, 3, 3))
    camera = Camera.orthographic(volume.centre - (0, 0, 30), volume.centre, (0, 1, 0), 1)
    medium = TransferFunction([0], [COLOR], [np.inf], modulation=np.array([[0.0, factor]]))
    picture = raycast(Scene(volume, medium, camera, classification=classification), (1, 1))[0, 0]
    np.testing.assert_allclose(picture, [*COLOR, 1] if factor else 0, rtol=0, atol=1e-15)


@BOTH
def test_dense_matter_shows_its_front(classification):
    volume = linear_volume()
    lighting = LIGHTING["several"]
    scene = Scene(volume, uniform(1e7), framed(volume), classification=classification, lighting=lighting)
    diffuse, specular = answer(lighting, SLOPE, -scene.camera.rays(SIZE)[1])
    wanted = np.where(path_lengths(volume, scene.camera, SIZE)[..., None] > 0, COLOR * diffuse + specular, 0)
    np.testing.assert_allclose(raycast(scene, SIZE)[..., :3], wanted, rtol=0, atol=1e-9)  # the oracle's promise
