"""What lit pictures may not depend on, and what they have to follow: no oracle needed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise, product
from unittest.mock import patch

import numpy as np
import pytest
from support.graded_media import mixed
from support.lit_scenes import (
    FOG,
    KINDS,
    LIGHTS,
    ROUNDING,
    SIZE,
    SPACING,
    SUN,
    drawn,
    even,
    framed,
    largest,
    linear,
    smooth,
    tolerance,
    with_values,
)
from support.pairs import IN_A_PROJECTION
from support.scenes import orbiting, sparse_volume

from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene import orbit
from texvol.scene.camera import Camera, Projection
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume

kinds = pytest.mark.parametrize("kind", KINDS)
ALL = LIGHTS["all, one side"]
SAME = 2e-6  # of pictures in bricks, or with leaps


@pytest.fixture(scope="module")
def small() -> Iterator[Renderer]:
    """Without room for a whole volume."""
    with Renderer(texture_memory=0.05) as opened:
        yield opened


def medium_for(kind: Classification) -> TransferFunction:
    """As much of it as the classification draws."""
    return mixed()["modulated premultiplied" if kind == "integrated" else "all"]


@pytest.mark.parametrize("kind, projection", IN_A_PROJECTION[1:])
def test_bricks_are_lit_as_the_whole(
    renderer: Renderer, small: Renderer, kind: Classification, projection: Projection
) -> None:
    volume = smooth()
    scene = Scene(volume, medium_for(kind), framed(volume, projection), classification=kind, lighting=ALL)
    scene = replace(scene, depth_cue=DepthCue(0.5, (0.1, 0.2, 0.3)), gradient=Estimator("gaussian", 1.0))
    pictures = [drawn(each, scene) for each in (renderer, small)]
    assert (
        len(small._pictures.in_memory.cache.volumes[0].textures.bricks) > 1
        and len(renderer._pictures.in_memory.cache.volumes[0].textures.bricks) == 1
    )
    assert largest(pictures[1] - pictures[0]) < SAME
    assert pictures[0].max() > 0.3


@pytest.mark.parametrize(
    "kind, graded", [("slab", False), ("extinction", True), ("post", False), ("post", True), ("integrated", False)]
)
def test_leaps_leave_lit_pictures_as_they_are(renderer: Renderer, kind: Classification, graded: bool) -> None:
    volume = sparse_volume(3)
    medium = FOG
    if graded:
        clumps = Graded([0.1, 1.0], np.full((2, 3), 0.1), np.array([0.2, 0.3]), 0.01, 0.2)
        medium = replace(FOG, graded=(clumps,), modulation=np.array([(0.0, 0.2), (0.3, 1.0)]))
    scene = Scene(volume, medium, framed(volume), classification=kind, lighting=Lighting())
    pictures = [
        renderer.render(scene, SIZE, texture_format="rgba32f", skip_empty=skip).astype(float) for skip in (True, False)
    ]
    assert (
        renderer._pictures.in_memory.cache.volumes[0].empty_space.counts[1]
        < 0.7 * renderer._pictures.in_memory.cache.volumes[0].empty_space.counts[0]
    )
    assert largest(pictures[1] - pictures[0]) < SAME
    assert pictures[0].max() > 0.1


@pytest.mark.parametrize(
    "kind, axes, signs",
    [  # each turn where samples are lit, and where what lies between them is
        ("slab", (0, 1, 2), (-1, 1, 1)),
        ("extinction", (2, 0, 1), (1, -1, -1)),
        ("extinction", (2, 0, 1), (-1, -1, -1)),
        ("post", (0, 1, 2), (-1, 1, 1)),
        ("post", (2, 0, 1), (1, -1, -1)),
        ("integrated", (2, 0, 1), (-1, -1, -1)),
    ],
)
def test_the_light_turns_with_the_world(
    renderer: Renderer, kind: Classification, axes: tuple[int, int, int], signs: tuple[int, int, int]
) -> None:
    """Samples listed along other axes, in a world turned or mirrored with all that is in it."""
    volume = Volume(smooth().values, SPACING, (1, 2, 3))
    matrix = np.zeros((3, 3))
    matrix[range(3), axes] = signs
    values = np.transpose(volume.values, [2 - axes[2 - a] for a in range(3)])
    values = np.flip(values, [2 - a for a in range(3) if signs[a] < 0])
    spacing = SPACING[list(axes)]
    turned = Volume(values, spacing, matrix @ volume.centre - spacing * (np.array(values.shape[::-1]) - 1) / 2)
    lamp = Light("point", tuple(volume.centre + (3, -2, 4)), (0.3, 0.8, 0.6))
    lighting = Lighting((SUN, lamp), shininess=8.0, two_sided=False)
    lights = tuple(replace(light, vector=tuple(matrix @ np.array(light.vector))) for light in lighting.lights)
    camera = framed(volume)
    positions = {name: tuple(matrix @ np.array(getattr(camera, name))) for name in ("eye", "target", "up")}
    scene = Scene(volume, medium_for(kind), camera, classification=kind, lighting=lighting)
    other = replace(
        scene, volume=turned, camera=replace(camera, **positions), lighting=replace(lighting, lights=lights)
    )
    plain, picture = drawn(renderer, scene), drawn(renderer, other)
    if np.linalg.det(matrix) < 0:
        picture = picture[:, ::-1]
    # Samples are fetched 2^-24 of 18 samples away, where values and normals of 0.2 per sample differ by 4e-7.
    assert largest(picture - plain) < 10 * ROUNDING


# Lights.


@pytest.mark.parametrize("kind", ["extinction", "post"])  # lit at the samples, and between them
def test_equal_lights_are_equal(renderer: Renderer, kind: Classification) -> None:
    """A head light is one along the view; two of half the colour, or one beside black ones, are one."""
    volume = smooth()
    scene = Scene(volume, FOG, framed(volume), classification=kind)
    backward = tuple(-framed(volume).forward)
    half = replace(SUN, color=tuple(0.5 * np.array(SUN.color)))
    black = Light("point", (1, 2, 3), (0, 0, 0))
    for one, other in (
        ((Light(),), (Light("directional", backward),)),
        ((SUN,), (half, half)),
        ((SUN,), (black, SUN, replace(black, kind="head", vector=None))),
        ((black,), ()),
        ((Light(), Light()), (Light(color=(2.0, 2.0, 2.0)),)),
        ((SUN,), (replace(SUN, vector=tuple(1e-200 * np.array(SUN.vector))),)),
    ):
        pictures = [
            drawn(renderer, replace(scene, lighting=Lighting(lights, two_sided=False))) for lights in (one, other)
        ]
        assert largest(pictures[0] - pictures[1]) < tolerance(Lighting(one))


@kinds
def test_without_light_there_is_what_is_ambient(renderer: Renderer, kind: Classification) -> None:
    volume = smooth()
    scene = Scene(volume, FOG, framed(volume), classification=kind)
    plain = drawn(renderer, scene)
    dark = drawn(renderer, replace(scene, lighting=Lighting((), ambient=0.4)))
    assert largest(dark - plain * [0.4, 0.4, 0.4, 1]) < ROUNDING


@pytest.mark.parametrize("kind", ["extinction", "post"])
def test_values_and_thresholds_a_thousand_times_as_large_are_the_same_picture(
    renderer: Renderer, kind: Classification
) -> None:
    volume = smooth()
    larger = with_values(volume, 1024 * volume.values)
    pictures = []
    for high, values in ((1.0, volume), (1024.0, larger)):
        medium = mixed(high=high)["all"]
        lighting = replace(ALL, fade=0.3 * high)
        scene = Scene(values, medium, framed(volume), classification=kind, lighting=lighting)
        pictures.append(drawn(renderer, scene))
    assert largest(pictures[1] - pictures[0]) < ROUNDING
    assert pictures[0].max() > 0.3


@pytest.mark.parametrize(
    "kind, fraction", [("slab", 1 / 16), ("extinction", 1 / 1024), ("post", 1 / 1024), ("integrated", 1 / 16)]
)
def test_a_ray_that_ends_early_loses_no_more_than_it_may(
    renderer: Renderer, kind: Classification, fraction: float
) -> None:
    """Also in light that makes what is behind three times as bright as any colour."""
    volume = smooth()
    medium = TransferFunction(FOG.values, FOG.colors, 20 * FOG.extinctions)
    scene = Scene(
        volume,
        medium,
        framed(volume),
        classification=kind,
        lighting=Lighting((SUN, Light(color=(3, 3, 3))), ambient=0.1),
    )
    whole, ended = (
        renderer.render(scene, SIZE, texture_format="rgba32f", early_termination=end).astype(float)
        for end in (0.0, fraction)
    )
    assert largest(ended - whole) <= fraction + ROUNDING
    assert largest(ended - whole) > 0


@kinds
def test_highlights_on_dark_matter_have_room_in_8_bits(renderer: Renderer, kind: Classification) -> None:
    """Texels are stored relative to the brightest of them, which light on black matter is."""
    volume = linear()
    black = even(0.15, (0.02, 0.02, 0.02))
    lighting = Lighting((Light(),), specular=0.9, shininess=0.0)
    scene = Scene(volume, black, framed(volume), classification=kind, lighting=lighting)
    for texture_format, error in (("rgba8", 3 / 255), ("rgba16f", 2e-3)):
        picture = renderer.render(scene, SIZE, texture_format=texture_format)
        assert largest(picture - drawn(renderer, scene)) < error
    assert picture[..., 0].max() > 0.5


def random_scene(seed: int, kind: Classification) -> Scene:
    """Noise, smoothed a little, in some light and of some matter."""
    random = np.random.default_rng(seed)
    noise = random.random((13, 14, 15))
    for axis in range(3):
        noise = (noise + np.roll(noise, 1, axis) + np.roll(noise, -1, axis)) / 3
    values = (noise - noise.min()) / np.ptp(noise)
    direction = np.eye(3) + 0.2 * random.standard_normal((3, 3))
    dtype = (np.float32, np.uint8, np.int16)[seed % 3]
    high = (1.0, 255.0, 2000.0)[seed % 3]
    volume = Volume((high * values).astype(dtype), random.uniform(0.7, 1.3, 3), random.uniform(-5, 5, 3), direction)
    lights = (Light("directional", tuple(random.standard_normal(3)), tuple(random.random(3))), Light())
    lighting = Lighting(lights[seed % 2 :], shininess=float(random.uniform(1, 30)), two_sided=bool(seed % 2))
    medium = mixed(high=high)["modulated" if kind == "integrated" else ("modulated", "graded", "contour")[seed % 3]]
    eye = volume.centre + 3 * volume.radius * random.standard_normal(3)
    camera = Camera.framing(volume, ("orthographic", "perspective")[seed % 2], eye=tuple(eye))
    return Scene(volume, medium, camera, classification=kind, lighting=lighting)


@pytest.mark.parametrize("kind, seed", [*product(("slab", "post"), range(2)), ("extinction", 2), ("integrated", 2)])
def test_a_wanted_error_is_kept(renderer: Renderer, kind: Classification, seed: int) -> None:
    scene = random_scene(seed, kind)
    picture = renderer.render(scene, SIZE, max_error=0.01)
    assert largest(picture - raycast(scene, SIZE)) <= 0.01


# One renderer for many pictures.


def changes(kind: Classification) -> list[Scene]:
    """A scene, and others, each of which differs from the one before it in one thing."""
    volume = smooth()
    scene = Scene(volume, FOG, framed(volume, "perspective"), classification=kind)
    steps: list[dict[str, object]] = [
        {},
        {"lighting": Lighting()},
        {"camera": framed(volume)},
        {"camera": replace(framed(volume), eye=tuple(volume.centre + (30, 20, 10)))},
        {"lighting": Lighting((SUN,))},
        {"lighting": Lighting((replace(SUN, vector=(1, 1, 1)),))},
        {"lighting": Lighting((replace(SUN, vector=(1, 1, 1), color=(0, 0, 1)),))},
        {"lighting": Lighting((Light("point", (1, 9, 11)),), specular=0, two_sided=False)},
        {"camera": framed(volume)},
        {"lighting": Lighting(fade=0.3)},
        {"gradient": Estimator("zucker-hummel")},
        {"gradient": Estimator("gaussian", 1.0)},
        {"gradient": Estimator("gaussian", 2.0)},
        {"depth_cue": DepthCue()},
        {"transfer_function": mixed()["modulated"]},
        {"lighting": None},
        {"transfer_function": replace(FOG, modulation=np.array([(0.0, 1.0), (0.1, 0.0)]))},
        {"gradient": Estimator()},
        {"transfer_function": FOG},
    ]
    if kind != "integrated":
        contour = Contour(0.5, 1.0, (0.1, 0.2, 0), 0.2)
        steps += [{"transfer_function": replace(FOG, contours=(replace(contour, value=v),))} for v in (0.5, 0.6)]
    scenes = []
    for step in steps:
        scene = replace(scene, **step)
        scenes.append(scene)
    return scenes


def stale(renderer: Renderer, scenes: list[Scene]) -> list[int]:
    """Numbers of the scenes whose picture depends on what was drawn before them."""
    found = []
    for number, scene in enumerate(scenes):
        picture = renderer.render(scene, SIZE)
        with Renderer() as fresh:
            if not np.array_equal(picture, fresh.render(scene, SIZE)):
                found.append(number)
    return found


@pytest.mark.parametrize("kind", ["slab", "post"])  # lit at the samples, and between them
def test_a_picture_does_not_depend_on_the_one_before(kind: Classification) -> None:
    scenes = changes(kind)
    with Renderer() as renderer:
        assert stale(renderer, scenes) == []
        pictures = [renderer.render(scene, SIZE) for scene in scenes]
    assert not any(np.array_equal(one, following) for one, following in pairwise(pictures))


@pytest.mark.parametrize("kind", ["slab", "extinction"])
def test_light_that_is_not_part_of_the_recipe_shows(kind: Classification) -> None:
    with patch("texvol.rendering.volume_cache.seen_from", lambda *_: ""), Renderer() as renderer:
        assert set(stale(renderer, changes(kind)[:9])) >= {2, 3, 4, 5, 6, 7}


@pytest.mark.parametrize("kind", ["slab", "post"])
def test_an_orbit_around_lit_matter_is_its_single_views(kind: Classification) -> None:
    volume = smooth()
    scene = Scene(volume, FOG, orbit.framing(volume), classification=kind, lighting=LIGHTS["sun"])
    scenes = [replace(scene, camera=camera) for camera in orbiting(scene.camera, 3)]
    with Renderer() as renderer:
        assert stale(renderer, scenes) == []


@pytest.mark.parametrize("kind", ["slab", "extinction"])
def test_light_that_no_eye_changes_is_baked_once(renderer: Renderer, kind: Classification) -> None:
    """Seen from elsewhere, only the head light, highlights and what is two-sided are others."""
    volume = smooth()
    cameras = [framed(volume), replace(framed(volume), eye=tuple(volume.centre + (30, 20, 10)))]
    for lighting, uploads in (
        (Lighting((SUN,), specular=0, two_sided=False), 1),
        (Lighting((SUN,), specular=0), 2),
        (Lighting((SUN,), two_sided=False), 2),
        (Lighting(specular=0, two_sided=False), 2),
        (Lighting(()), 1),
    ):
        before = renderer._pictures.in_memory.cache.volumes[0].textures.uploads
        for camera in cameras:
            renderer.render(Scene(volume, FOG, camera, classification=kind, lighting=lighting), SIZE)
        assert renderer._pictures.in_memory.cache.volumes[0].textures.uploads - before == uploads
