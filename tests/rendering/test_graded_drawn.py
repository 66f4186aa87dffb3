"""Matter that depends on the gradient, drawn: closed forms, what is in flat regions, and orders against the oracle."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from support import closed_forms as known
from support import planted
from support.graded_media import mixed
from support.lit_scenes import (
    FOG,
    KINDS,
    LIGHTS,
    ROUNDING,
    SIZE,
    SLOPE,
    drawn,
    errors,
    even,
    framed,
    largest,
    linear,
    order,
    smooth,
)
from support.scenes import path_lengths

from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.lighting import DepthCue
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction, loads
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume
from texvol.textures import graded_uniforms, value_texture
from texvol.util.errors import InputError

kinds = pytest.mark.parametrize("kind", KINDS)
by_gradient = pytest.mark.parametrize("kind", ["slab", "extinction", "post"])
STEEPNESS = float(np.linalg.norm(SLOPE))  # of the linear field
COLOR = (0.9, 0.6, 0.3)
NOTHING = {"values": np.zeros(1), "colors": np.zeros((1, 3)), "extinctions": np.zeros(1)}


def layer(volume: Volume, camera: Camera, tau: float, color: Sequence[float] = COLOR) -> np.ndarray:
    """Picture of constant matter."""
    opacity = known.opacity(tau * path_lengths(volume, camera, SIZE))[..., np.newaxis]
    return np.concatenate([opacity * np.array(color), opacity], axis=-1)


def alike(values: Sequence[float], tau: float, start: float, full: float) -> Graded:
    """Graded matter of one colour and extinction."""
    emissions = np.broadcast_to(tau * np.array(COLOR), (len(values), 3))
    return Graded(np.array(values), emissions, np.full(len(values), tau), start, full)


# Fields of one gradient.

MODULATIONS = {
    "one factor": ([(0.2, 0.4)], 0.4),
    "half way": ([(0.5 * STEEPNESS, 0.2), (1.5 * STEEPNESS, 1.0)], 0.6),
    "beyond the last": ([(0.1, 0.0), (0.2, 1.7)], 1.7),
    "before the first": ([(1.0, 0.3), (2.0, 5.0)], 0.3),
    "down to nothing": ([(0.01, 0.3), (0.1, 0.7), (0.2, 0.0)], 0.0),  # 0.3 + 0.4 - 0.7 is not 0 in float32
}


@pytest.mark.parametrize("kind, opaque", [("slab", False), ("extinction", True), ("post", False), ("integrated", True)])
@pytest.mark.parametrize("modulation", MODULATIONS)
def test_a_modulation_is_a_factor(renderer: Renderer, kind: Classification, modulation: str, opaque: bool) -> None:
    """What is opaque stays so, unless the factor is 0."""
    pairs, factor = MODULATIONS[modulation]
    volume = linear()
    camera = framed(volume)
    medium = replace(even(np.inf if opaque else 0.15), modulation=np.array(pairs))
    picture = drawn(renderer, Scene(volume, medium, camera, classification=kind))
    expected = layer(volume, camera, factor * (1e9 if opaque else 0.15))
    # Where the box is thinner than a billionth an opaque one still shows; and rounding of |g| moves the factor.
    assert largest(picture - expected) < 2 * ROUNDING


@kinds
def test_gas_is_modulated_in_what_glows_and_what_absorbs(renderer: Renderer, kind: Classification) -> None:
    volume = linear()
    camera = framed(volume)
    gas = TransferFunction(np.zeros(1), np.array([(0.1, 0.2, 0.05)]), np.array([0.15]), emissive=True)
    medium = replace(gas, modulation=np.array([(0.5 * STEEPNESS, 0.2), (1.5 * STEEPNESS, 1.0)]))
    picture = drawn(renderer, Scene(volume, medium, camera, classification=kind))
    lengths = path_lengths(volume, camera, SIZE)
    glow = lengths * known.mean_transmittance(0.6 * 0.15 * lengths)
    expected = 0.6 * glow[..., np.newaxis] * np.array((0.1, 0.2, 0.05))
    assert largest(picture[..., :3] - expected) < 2 * ROUNDING
    assert largest(picture[..., 3] - known.opacity(0.6 * 0.15 * lengths)) < 2 * ROUNDING


RAMPS = {  # start, full, what is left
    "half way": (0.5 * STEEPNESS, 1.5 * STEEPNESS, 0.5),
    "not reached": (1.1 * STEEPNESS, 2 * STEEPNESS, 0.0),
    "passed": (0.1 * STEEPNESS, 0.9 * STEEPNESS, 1.0),
    "step before": (0.9 * STEEPNESS, 0.9 * STEEPNESS, 1.0),
    "step beyond": (1.1 * STEEPNESS, 1.1 * STEEPNESS, 0.0),
    "from 0": (0.0, 0.0, 1.0),
}


# The magnitudes of a file's material rise; it alone has no ends.
RAMPS_AND_ENDS = [(ramp, ends) for ramp in RAMPS for ends in ((-50.0, 50.0), (-50.0, -1.0, 1.0, 1.0, 50.0))]
RAMPS_AND_ENDS += [(ramp, None) for ramp, (start, full, _) in RAMPS.items() if start < full]  # type: ignore[misc]


@pytest.mark.parametrize("kind", ["extinction", "post"])
@pytest.mark.parametrize("ramp, ends", RAMPS_AND_ENDS, ids=str)
def test_graded_matter_has_its_share(
    renderer: Renderer, kind: Classification, ramp: str, ends: tuple[float, ...] | None
) -> None:
    """All over a field of values about 0, in one piece, in several, or without ends as a file has it."""
    start, full, fraction = RAMPS[ramp]
    volume = linear()
    camera = framed(volume)
    if ends is None:
        material = {"name": "all", "color": COLOR, "extinction": 0.15, "gradient": [start, full]}
        medium = loads(json.dumps({"materials": [material]}))
    else:
        medium = TransferFunction(**NOTHING, graded=(alike(ends, 0.15, start, full),))
    picture = drawn(renderer, Scene(volume, medium, camera, classification=kind))
    assert largest(picture - layer(volume, camera, 0.15 * fraction)) < 2 * ROUNDING


def rising(spacing: float = 0.7) -> Volume:
    """0 … 1 along z over 26 samples, in a world of that spacing."""
    values = np.linspace(0, 1, 26, dtype=np.float32)
    return Volume(np.broadcast_to(values[:, np.newaxis, np.newaxis], (26, 13, 13)), (spacing,) * 3)


def across(volume: Volume) -> Camera:
    """Looks through all of the values, aslant."""
    eye = volume.centre + 3 * volume.radius * np.array([0.15, -0.1, 1])
    return Camera.orthographic(eye, volume.centre, (0, 1, 0), height=0.2 * volume.radius)


def test_a_contour_is_a_sheet_of_its_thickness(renderer: Renderer) -> None:
    """Its depth along a ray: ∫ τ max(0, 1 - |f - v| / (r |∇f|)) ds = τ r / cos θ, whatever the gradient."""
    volume = rising()
    camera = across(volume)
    contours = (Contour(0.4, 2.1, tuple(0.8 * np.array(COLOR)), 0.8),)
    scene = Scene(volume, TransferFunction(**NOTHING, contours=contours), camera, classification="post")
    opacity = known.opacity(0.8 * 2.1 / abs(camera.forward[2]))
    expected = np.append(opacity * np.array(COLOR), opacity)
    for rate in (1, 4, 16):
        # The midpoint rule misses at most d²/8 times the change of slope at each of a hat's three kinks, 4 of its
        # slope together; of opacity a change in depth moves 1 - A.
        d = 0.7 / rate
        error = 0.8 * 4 * abs(camera.forward[2]) / 2.1 * d**2 / 8 * (1 - opacity)
        assert largest(drawn(renderer, scene, rate) - expected) < 1.1 * error + ROUNDING


def test_a_thickness_counted_in_voxels_shows(renderer: Renderer) -> None:
    volume = rising()
    contours = (Contour(0.4, 2.1, tuple(0.8 * np.array(COLOR)), 0.8),)
    scene = Scene(volume, TransferFunction(**NOTHING, contours=contours), across(volume), classification="post")
    opacity = known.opacity(0.8 * 2.1 / abs(across(volume).forward[2]))
    right = graded_uniforms._contours

    def in_voxels(contours: tuple[Contour, ...], *rest: object) -> dict:
        return right(tuple(replace(each, thickness=each.thickness / 0.7) for each in contours), *rest)

    assert largest(drawn(renderer, scene, 8)[..., 3] - opacity) < 3e-3
    with patch.object(graded_uniforms, "_contours", in_voxels), Renderer() as wrong:
        assert largest(drawn(wrong, scene, 8)[..., 3] - opacity) > 0.02


# Flat regions.


def flat(value: float, dtype: str) -> Volume:
    """One value in the middle of a field of others, in the corners of which others are."""
    values = np.full((9, 9, 9), value)
    values[0, 0, 0], values[8, 8, 8] = 0, 250
    return Volume(values.astype(dtype))


def through_flat(renderer: Renderer, medium: TransferFunction, volume: Volume, kind: Classification) -> float:
    """Extinction per world unit of the ray through the middle, which meets one value alone."""
    camera = Camera.orthographic(volume.centre - (0, 0, 20), volume.centre, (0, 1, 0), height=1)
    picture = drawn(renderer, Scene(volume, medium, camera, classification=kind), size=(1, 1))
    return float(-np.log1p(-picture[0, 0, 3])) / 9


@pytest.mark.parametrize(
    "kind, dtype",
    [("slab", "u1"), ("extinction", "i2"), ("post", "u1"), ("post", "f8")],
)
def test_the_ends_and_steps_of_graded_matter_hold_at_their_values(
    renderer: Renderer, kind: Classification, dtype: str
) -> None:
    """Whole numbers are often exactly on them."""
    closed = Graded([100, 150, 200], np.zeros((3, 3)), [0.1, 0.1, 0.2], 0.0, 0.0)
    stepped = Graded([100, 100, 200, 200], np.zeros((4, 3)), [0.3, 0.1, 0.2, 0.0], 0.0, 0.0)
    alone = Graded([100], np.zeros((1, 3)), [0.2], 0.0, 0.0)
    lone_end = Graded([50, 100, 100], np.zeros((3, 3)), [0.1, 0.1, 0.3], 0.0, 0.0)
    for graded, expected in (
        (closed, {99: 0.0, 100: 0.1, 199: 0.198, 200: 0.2, 201: 0.0}),
        (stepped, {99: 0.0, 100: 0.1, 199: 0.199, 200: 0.0}),
        (alone, {99: 0.0, 100: 0.2, 101: 0.0}),
        (lone_end, {99: 0.1, 100: 0.3, 101: 0.0}),
    ):
        medium = TransferFunction(**NOTHING, graded=(graded,))
        for value, extinction in expected.items():
            found = through_flat(renderer, medium, flat(value, dtype), kind)
            # 16 bits of integers: a value of 1/2 rounds to 2^-24, of a way of 100 of 65535.
            assert found == pytest.approx(extinction, rel=1e-5, abs=1e-5), (graded.values, value)


@pytest.mark.parametrize(
    "kind, dtype",
    [("slab", "u1"), ("extinction", "i2"), ("post", "u1"), ("post", "f8")],
)
def test_where_nothing_rises_a_contour_is_its_value_alone(renderer: Renderer, kind: Classification, dtype: str) -> None:
    medium = TransferFunction(**NOTHING, contours=(Contour(100, 3.0, (0, 0.1, 0), 0.2),))
    found = [through_flat(renderer, medium, flat(value, dtype), kind) for value in (99, 100, 101)]
    assert found == pytest.approx([0, 0.2, 0], rel=1e-5)


@by_gradient
def test_dense_matter_leaves_nothing_where_it_ends(renderer: Renderer, kind: Classification) -> None:
    """A sum of ramps that rise and fall would leave float32's 6e-8 of the densest: 1e-3 of a box 2 wide."""
    values = np.array([0, 20, 40, 60, 80.0])
    extinctions = np.array([1e4, 0.3e4, 0.77e4, 1.3e4, 0.1e4])
    medium = TransferFunction(**NOTHING, graded=(Graded(values, np.zeros((5, 3)), extinctions, 0.0, 100.0),))
    volume = Volume(np.broadcast_to(np.linspace(90, 200, 9, dtype=np.float32)[:, np.newaxis, np.newaxis], (9, 9, 9)))
    scene = Scene(volume, medium, framed(volume), classification=kind)
    assert renderer.render(scene, SIZE, skip_empty=False).max() == 0


@by_gradient
def test_matter_that_is_none_is_none(renderer: Renderer, kind: Classification) -> None:
    nothing = Graded([0.2, 0.8], np.zeros((2, 3)), np.zeros(2), 0.0, 1.0)
    volume = smooth()
    plain = Scene(volume, FOG, framed(volume), classification=kind)
    picture = drawn(renderer, replace(plain, transfer_function=replace(FOG, graded=(nothing,))))
    assert largest(picture - drawn(renderer, plain)) < ROUNDING


# The oracle.


@kinds
@pytest.mark.parametrize("name, lit", [*((each, False) for each in mixed()), ("all", True)])
def test_pictures_converge_to_the_oracle(renderer: Renderer, kind: Classification, name: str, lit: bool) -> None:
    medium = mixed()[name]
    volume = smooth()
    projection = "perspective" if lit else "orthographic"
    if kind == "integrated" and (medium.graded or medium.contours):
        with pytest.raises(InputError, match="integrated needs a medium that depends on the value alone"):
            Scene(volume, medium, classification=kind)
        return
    scene = Scene(volume, medium, framed(volume, projection), classification=kind)
    if lit:
        scene = replace(scene, lighting=LIGHTS["all, one side"], depth_cue=DepthCue(0.7, (0.1, 0.1, 0.3)))
    # `post` meets the jumps at the ends of graded matter somewhere in a slab: first order.
    jumps = kind == "slab" or (kind == "post" and name in ("graded", "all"))
    assert (0.8 if jumps else 1.6) < order(renderer, scene) < 2.4


@pytest.mark.parametrize("kind", ["extinction", "post"])
@pytest.mark.parametrize(
    "dtype, low, high, world", [("u1", 0, 255, 1e9), ("i2", -1000, 3000, 1), ("f8", 1e9 - 1, 1e9 + 1, 1e-9)]
)
def test_types_and_worlds_converge_to_the_oracle(
    renderer: Renderer, kind: Classification, dtype: str, low: float, high: float, world: float
) -> None:
    volume = smooth(dtype, low, high, world)
    scene = Scene(volume, mixed(world, low, high)["all"], framed(volume), classification=kind)
    coarse, fine = errors(renderer, replace(scene, lighting=LIGHTS["head"]), (1, 8))
    assert fine < 1e-3 and coarse / fine > 5


MATERIALS = {
    "materials": [
        {"name": "low", "to": [0.3, 0.5], "color": [0.1, 0.3, 0.9], "extinction": 0.1, "gradient": [0.02, 0.2]},
        {"name": "middle", "from": [0.3, 0.5], "to": 0.7, "color": [0.9, 0.5, 0.2], "extinction": 0.3},
        {"name": "high", "from": 0.7, "color": [0.9, 0.9, 0.6], "extinction": 0.5, "gradient": [0.02, 0.2]},
    ],
    "contours": [{"value": 0.6, "thickness": 1.5, "material": "high"}],
    "gradient": [[0, 0.3], [0.2, 1]],
}


@pytest.mark.parametrize(
    "kind, show",
    [
        ("slab", None),
        ("extinction", ["low"]),
        ("post", ["high"]),
        ("extinction", ["low", "middle"]),
        ("post", None),
    ],
    ids=str,
)
def test_materials_of_a_file_are_what_the_oracle_makes_of_them(
    renderer: Renderer, kind: Classification, show: list[str] | None
) -> None:
    volume = smooth()
    medium = loads(json.dumps(MATERIALS), volume=volume, materials=show)
    scene = Scene(volume, medium, framed(volume), classification=kind, lighting=LIGHTS["head"])
    coarse, fine = errors(renderer, scene, (1, 8))
    assert fine < 1.5e-3 and coarse / fine > 5


@pytest.mark.parametrize(
    "kind, factor, shows",
    [
        ("slab", 0.0, False),
        ("extinction", 1e-3, True),
        ("post", 0.0, False),
        ("post", 1e-3, True),
        ("integrated", 0.0, False),
    ],
)
def test_a_factor_of_nothing_takes_opaque_matter_away(
    renderer: Renderer, kind: Classification, factor: float, shows: bool
) -> None:
    """Where the field rises to the right; to the left it is flat, and the factor 1."""
    values = np.maximum(np.arange(17) - 8, 0) * 10.0 + 5
    volume = Volume(np.broadcast_to(values, (9, 9, 17)).astype(np.float32))
    medium = replace(even(np.inf), modulation=np.array([(1.0, 1.0), (9.0, factor)]))
    camera = Camera.orthographic(volume.centre + (0, 0, 20), volume.centre, (0, 1, 0), height=8)
    for lighting in (None, LIGHTS["head"]):
        picture = drawn(renderer, Scene(volume, medium, camera, classification=kind, lighting=lighting), 2)
        left, right = picture[:, :6], picture[:, 18:]
        np.testing.assert_allclose(left[..., 3], 1, atol=1e-6)
        np.testing.assert_allclose(right[..., 3], float(shows), atol=1e-6)
        if lighting is None:
            np.testing.assert_allclose(left[..., :3], np.broadcast_to(COLOR, left[..., :3].shape), atol=1e-6)


# Planted mistakes.

MODULATED = "vec4 modulated(vec4 medium, float factor)"
PIECE = "float piece_weight(float value, float magnitude, vec3 position, vec3 slope)"
CONTOUR = "float contour_distance(float value, float magnitude, vec3 position)"
MISTAKES: dict[str, tuple[planted.Mistake, str]] = {
    "modulation of colours only": ((MODULATED, "return medium * vec4(vec3(factor), 1.0);"), "modulated"),
    "modulation of extinction only": (
        (MODULATED, "return medium * vec4(vec3(1.0), factor);"),
        "modulated premultiplied",
    ),
    "graded whatever the gradient": (
        (PIECE, "return min(1e9 * piece_weight_right(value, magnitude, position, slope), 1.0);"),
        "graded",
    ),
    "graded beyond its ends": (
        (PIECE, "return position.x < position.y ? ramp(magnitude, slope.y, slope.z) : 0.0;"),
        "graded",
    ),
    "colour of points not weighted": (("vec4 with_emission(vec4 medium)", "return medium;"), "graded"),
    "a contour of the same width everywhere": (
        (CONTOUR, "return contour_distance_right(value, 0.1 + 1e-6 * magnitude, position);"),
        "contour",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_the_matter_shows(renderer: Renderer, mistake: str) -> None:
    wrong_function, name = MISTAKES[mistake]
    volume = smooth()
    scene = Scene(volume, mixed()[name], framed(volume), classification="post")
    [right] = errors(renderer, scene, (8,))
    with planted.planted(wrong_function) as mistaken:
        [wrong] = errors(mistaken, scene, (8,))
    assert wrong > 10 * right


def test_a_magnitude_per_spacing_shows(renderer: Renderer) -> None:
    """Gradients are per world unit, not per voxel."""
    volume = linear(world=3.0)
    medium = replace(even(), modulation=np.array([(0.0, 0.0), (0.3, 1.0)]))
    scene = Scene(volume, medium, framed(volume), classification="post")
    expected = layer(volume, framed(volume), 0.15 * STEEPNESS / 3 / 0.3)
    assert largest(drawn(renderer, scene) - expected) < 2 * ROUNDING
    wrong = property(lambda texture: texture.largest_component)
    with patch.object(value_texture.ValueTexture, "largest_gradient", wrong):
        assert largest(drawn(renderer, scene) - expected) > 0.1
