"""Lit matter, drawn: closed forms in fields of one gradient, orders of convergence to the oracle, planted mistakes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from unittest.mock import patch

import closed_forms as known
import numpy as np
import planted
import pytest
from lit_scenes import (
    FOG,
    KINDS,
    LIGHTS,
    ROUNDING,
    SIZE,
    SLOPE,
    SUN,
    ULP,
    drawn,
    even,
    framed,
    grid,
    largest,
    linear,
    lit_and_even,
    order,
    scaled,
    smooth,
    with_values,
)
from scenes import path_lengths

from texvol import shaded_samples
from texvol.camera import Camera, Projection
from texvol.errors import InputError
from texvol.gradient import Estimator
from texvol.lighting import DepthCue, Light, Lighting
from texvol.ray_casting import raycast
from texvol.renderer import Renderer
from texvol.scene import Classification, Scene
from texvol.transfer import TransferFunction
from texvol.value_texture import ValueTexture
from texvol.volume import Volume

kinds = pytest.mark.parametrize("kind", KINDS)
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])
MOON = Light("directional", (-1, 2, -0.5), (0.2, 0.3, 0.9))  # on the other side


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as opened:
        yield opened


def tolerance(lighting: Lighting, direction_error: float = 4 * ULP) -> float:
    """Rounding, and what an error of the normal's direction does: as much to N·L, n times as much to (N·H)^n."""
    brightest = max(lighting.brightest, 1.0)
    light = sum(max(each.color) for each in lighting.lights)
    return ROUNDING * brightest + direction_error * light * (lighting.diffuse + lighting.specular * lighting.shininess)


# Closed forms.

CLOSED = {
    "head": Lighting(),
    "head, one side": Lighting(two_sided=False),
    "two of them, fading": Lighting((SUN, MOON), fade=1.5 * float(np.linalg.norm(SLOPE))),
    "one side": Lighting((SUN, MOON, Light()), two_sided=False, shininess=5.0),
    "shininess 0": Lighting((SUN,), shininess=0.0, specular=0.4),
    "no highlights": Lighting((SUN,), specular=0.0),
    "no highlights, one side": Lighting((SUN,), specular=0.0, two_sided=False),
    "no lights": Lighting(()),
    "black": Lighting((replace(SUN, color=(0.0, 0.0, 0.0)),)),
    "nine": Lighting(tuple(Light("directional", (i - 4, 1, i % 3 - 1), (i / 20, 0.1, 0.4 - i / 30)) for i in range(9))),
    "fade 0": Lighting((SUN,), fade=0.0),
    "faded": Lighting((SUN,), fade=1e300),
    "sharp": Lighting((Light(),), shininess=200.0),
    "against the view": Lighting((Light("directional", tuple(framed(linear()).forward)), SUN), two_sided=False),
}


# Samples are seen from other sides than what lies between: in perspective only what is lit when it is drawn is exact.
IN_PERSPECTIVE = ("head", "one side", "two of them, fading", "against the view")


@pytest.mark.parametrize(
    "kind, projection, lights",
    [(kind, "orthographic", lights) for kind in ("slab", "post") for lights in CLOSED]
    + [(kind, "orthographic", lights) for kind in ("extinction", "integrated") for lights in IN_PERSPECTIVE]
    + [(kind, "perspective", lights) for kind in ("post", "integrated") for lights in IN_PERSPECTIVE],
)
def test_even_matter_of_one_gradient_is_lit_by_the_formula(
    renderer: Renderer, kind: Classification, projection: Projection, lights: str
) -> None:
    volume = linear()
    scene = Scene(volume, even(), framed(volume, projection), classification=kind, lighting=CLOSED[lights])
    expected = lit_and_even(scene, SLOPE)
    assert largest(drawn(renderer, scene, 2) - expected) < tolerance(CLOSED[lights])
    assert expected[..., 3].max() > 0.5


@kinds
@pytest.mark.parametrize("world", [1e-9, 1e9])
def test_the_size_of_the_world_does_not_matter(renderer: Renderer, kind: Classification, world: float) -> None:
    volume = linear(world=world)
    lighting = Lighting((SUN, Light()), fade=1.5 * float(np.linalg.norm(SLOPE)) / world)
    scene = Scene(volume, even(0.15 / world), framed(volume), classification=kind, lighting=lighting)
    assert largest(drawn(renderer, scene) - lit_and_even(scene, SLOPE / world)) < tolerance(lighting)


@pytest.mark.parametrize("estimator", [Estimator("zucker-hummel"), Estimator("gaussian", 0.8)], ids=str)
@pytest.mark.parametrize("kind", ["slab", "post"])
def test_any_estimator_finds_one_gradient(renderer: Renderer, kind: Classification, estimator: Estimator) -> None:
    volume = linear()
    lighting = Lighting((SUN, Light()))
    scene = Scene(volume, even(), framed(volume), classification=kind, lighting=lighting, gradient=estimator)
    # Means of float32 differences: a few more ulps of a value of 6 per difference of 0.1.
    assert largest(drawn(renderer, scene) - lit_and_even(scene, SLOPE)) < tolerance(lighting, 60 * 6 * ULP)


WHOLE = np.array([3.0, -5.0, 2.0])  # data units per index
TYPES = {  # values of a linear field: type, factor, offset
    "u1": (1, 60),
    "i1": (1, -40),
    "u2": (500, 30_000),
    "i2": (100, -5000),
    "i4": (1000, 10**6),
    "f2": (1, 0),
    "f8": (0.01, 1e9),
}


@kinds
@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("texture_format", ["auto", "rgba32f"])
def test_any_type_of_values(renderer: Renderer, kind: Classification, dtype: str, texture_format: str) -> None:
    factor, offset = TYPES[dtype]
    z, y, x = np.meshgrid(np.arange(7), np.arange(8), np.arange(9), indexing="ij")
    volume = with_values(grid((9, 8, 7)), (offset + factor * (np.stack([x, y, z], -1) @ WHOLE)).astype(dtype))
    slope = volume.index_from_world.T @ (factor * WHOLE)
    lighting = Lighting((SUN, Light()), shininess=10.0)
    scene = Scene(volume, even(), framed(volume), classification=kind, lighting=lighting)
    picture = renderer.render(scene, SIZE, texture_format=texture_format)
    # 16 bits: each component is off by half of 1/32767 of the largest, which |g| is at least. 8 bits of opacity are
    # off by what `auto` allows itself, a quarter of the discretisation error; of even matter that is nothing.
    direction_error = 4 * ULP if texture_format == "rgba32f" else np.sqrt(3) / 65534
    if kind in ("slab", "extinction") and texture_format == "auto":
        direction_error = 1 / 255
    if dtype == "f8":
        direction_error += 1e-6  # float64 keeps 1e-7 of 1e9, and differences are 0.06
    assert largest(picture - lit_and_even(scene, slope)) < tolerance(lighting, direction_error)


@kinds
@projections
def test_a_depth_cue_on_even_matter_is_its_closed_form(
    renderer: Renderer, kind: Classification, projection: Projection
) -> None:
    """∫ τ e^-τs [c (1 - t) + t b] ds with t linear in s: c A + (b - c) strength ∫ τ e^-τs (z - near)/(far - near)."""
    volume = linear()
    camera = framed(volume, projection)
    cue = DepthCue(0.8, (0.1, 0.2, 0.7))
    tau, color = 0.15, np.array([0.9, 0.6, 0.3])
    scene = Scene(volume, even(tau), camera, classification=kind, depth_cue=cue)
    near, far = cue.range_for(volume, camera)
    lengths = path_lengths(volume, camera, SIZE)
    origins, directions = camera.rays(SIZE)
    # Where each ray enters: its way in the box, less that of the same ray without what lies before.
    cosine = directions @ camera.forward
    enters = entry_depths(volume, origins, directions) * cosine
    opacity = known.opacity(tau * lengths)
    first = enters * opacity + cosine * (opacity / tau - lengths * (1 - opacity))  # ∫ τ e^-τs z ds, z = enters + s cos
    cued = 0.8 * (first - near * opacity) / (far - near)
    mixed = opacity[..., np.newaxis] * color + cued[..., np.newaxis] * (np.array(cue.color) - color)
    off = [largest(drawn(renderer, scene, rate)[..., :3] - mixed) for rate in (1, 8)]
    # The cue of a slab is that of its middle, of half a slab in `integrated`: by 1/12 (τd)² of the change over a slab.
    assert off[1] < 1e-5
    assert 1.8 < np.log2(off[0] / off[1]) / 3 < 2.2
    assert largest(mixed - opacity[..., np.newaxis] * color) > 0.1


def entry_depths(volume: Volume, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Way of each ray to the box."""
    unit_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    place, way = (origins - volume.box_corner) @ unit_from_world.T, directions @ unit_from_world.T
    with np.errstate(divide="ignore"):
        return np.minimum(-place / way, (1 - place) / way).max(axis=2)


@kinds
@pytest.mark.parametrize(
    "near, far, share", [(-1e300, -1e299, 1.0), (1e9, 1e10, 0.0), (0.0, 1e-3, 1.0), (0.0, 1e300, 0.0)]
)
def test_beyond_its_range_a_depth_cue_is_all_or_nothing(
    renderer: Renderer, kind: Classification, near: float, far: float, share: float
) -> None:
    volume = linear()
    cue = DepthCue(0.5, (0.1, 0.2, 0.7), near, far)
    plain = Scene(volume, even(), framed(volume), classification=kind)
    picture, unlit = drawn(renderer, replace(plain, depth_cue=cue)), drawn(renderer, plain)
    t = 0.5 * share
    expected = (1 - t) * unlit[..., :3] + t * unlit[..., 3:] * np.array(cue.color)
    assert largest(picture[..., :3] - expected) < ROUNDING


# The oracle.


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
    matter = scaled(FOG, low, high, world)
    scene = Scene(volume, matter, framed(volume, "perspective"), classification=kind, lighting=lighting)
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
    matter = TransferFunction(np.array([0, 200]), np.array([(0.2, 0.3, 0.9), (0.9, 0.5, 0.2)]), np.array([0.02, 0.3]))
    lighting = Lighting((SUN,), fade=fade, two_sided=False)
    scene = Scene(volume, matter, framed(volume), classification=kind, lighting=lighting)
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
    matter = TransferFunction(
        np.array([0, 0.55, 0.55]), np.array([(0, 0, 0), (0, 0, 0), (0.9, 0.7, 0.5)]), [0, 0, np.inf]
    )
    scene = Scene(volume, matter, framed(volume, projection), classification=kind, lighting=LIGHTS["all, one side"])
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
        Scene(volume, matter, framed(volume), classification=kind, lighting=LIGHTS["all, one side"])
        for matter in (plain, premultiplied)
    ]
    assert largest(drawn(renderer, scenes[0], 2) - drawn(renderer, scenes[1], 2)) < 2 * ROUNDING


# Hard places.


@pytest.mark.parametrize("kind", ["post", "integrated", "extinction"])
def test_a_light_on_a_ray_has_no_direction_there_and_harms_nothing(renderer: Renderer, kind: Classification) -> None:
    """At a light there is no direction to it: 0 / 0 would be all over the pixel."""
    volume = linear()
    camera = Camera.orthographic(volume.centre - (0, 20, 0), volume.centre, (0, 0, 1), height=10)
    for place in (volume.centre, volume.origin, volume.centre + (0, 0.4, 0)):
        lighting = Lighting((Light("point", tuple(place)),))
        scene = Scene(volume, even(), camera, classification=kind, lighting=lighting)
        for thickness in (0.8, 0.4):
            picture = renderer.render(scene, (25, 25), slab_thickness=thickness)
            assert np.isfinite(picture).all()


@kinds
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("eye_y", [1000.0, 37.3, 1e7 / 3])
def test_seen_from_the_side_a_surface_has_the_side_that_it_has(
    renderer: Renderer, kind: Classification, side: float, eye_y: float
) -> None:
    """Square to the view, rounding would turn the normal from pixel to pixel and from camera to camera."""
    values = np.broadcast_to(side * 0.3 * np.arange(8, dtype=np.float32)[:, np.newaxis, np.newaxis], (8, 8, 8))
    volume = Volume(values, origin=(-3.5, -3.5, -3.5))
    camera = Camera.orthographic((0.1 * eye_y, eye_y, 0), (0, 0, 0), (0, 0, 1), height=6)
    lighting = Lighting((Light("directional", (0.3, 0.5, 1)),))
    scene = Scene(volume, even(), camera, classification=kind, lighting=lighting)
    picture = drawn(renderer, scene)
    normal = np.array([0, 0, -side])
    cosine = max(normal @ np.array([0.3, 0.5, 1]) / np.sqrt(1.34), 0)
    straight = picture[12, 12, 2] / picture[12, 12, 3]
    highlight = 0.0
    if cosine > 0:
        halfway = np.array([0.3, 0.5, 1]) / np.sqrt(1.34) + np.array([0.1, 1, 0]) / np.sqrt(1.01)
        highlight = 0.2 * (normal @ halfway / np.linalg.norm(halfway)) ** 32
    assert straight == pytest.approx(0.3 * (0.3 + 0.7 * cosine) + highlight, abs=1e-5)


@pytest.mark.parametrize("field", ["ambient", "diffuse", "specular", "shininess", "fade", "color", "vector"])
def test_numbers_beyond_float32_are_drawn(renderer: Renderer, field: str) -> None:
    volume = linear()
    lighting = Lighting((Light("point", (1e290, -1e290, 3)),)) if field == "vector" else Lighting()
    if field == "color":
        lighting = Lighting((Light(color=(1e300, 0, 0)),))
    elif field != "vector":
        lighting = replace(lighting, **{field: 1e300})
    picture = renderer.render(Scene(volume, even(), framed(volume), classification="post", lighting=lighting), (8, 8))
    assert not np.isnan(picture[..., 3]).any()


def test_a_light_far_away_is_directional(renderer: Renderer) -> None:
    volume = linear()
    pictures = [
        drawn(renderer, Scene(volume, even(), framed(volume), classification="post", lighting=Lighting((light,))))
        for light in (SUN, Light("point", tuple(1e290 * np.array(SUN.vector)), SUN.color))
    ]
    assert largest(pictures[0] - pictures[1]) < tolerance(Lighting((SUN,)))


def test_light_is_not_for_matter_that_glows() -> None:
    gas = TransferFunction(np.zeros(1), np.ones((1, 3)), np.ones(1), emissive=True)
    with pytest.raises(InputError, match="emissive transfer function glows by itself"):
        Scene(linear(), gas, lighting=Lighting())


# Planted mistakes.

LIGHT = "light.glsl"
SHADER_MISTAKES: dict[str, tuple[planted.Replacement, str]] = {
    "gradient transposed": (("volume_texture.glsl", "return texel.rgb;", "return texel.bgr;"), "one side"),
    "normal to higher values": ((LIGHT, "gradient / -max(", "gradient / max("), "one side"),
    "light swapped": ((LIGHT, "direction_colors[i] *", "direction_colors[i].bgr *"), "one side"),
    "halfway not of length 1": ((LIGHT, "unit(to_light + to_eye))", "(to_light + to_eye))"), "no fading"),
    "fade ignored": (
        (LIGHT, "mix(1.0, max(facing, 0.0), believed)", "mix(1.0, max(facing, 0.0), min(1e6 * believed, 1.0))"),
        "two of them, fading",
    ),
    "one side only": ((LIGHT, "if (dot(normal, to_eye) < -SQUARE)", "if (dot(normal, to_eye) < -2.0)"), "head"),
    "highlights on what faces away": ((LIGHT, "facing > SQUARE ?", "facing > -2.0 ?"), "shininess 0, one side"),
    "highlights coloured by matter": (
        ("slab_stack.frag", "(GLOWS ? matter.a : 1.0) * shade.specular", "matter.rgb * shade.specular"),
        "shininess 0",
    ),
}
# In one field both ends of the gradient have to be told apart, and both sides have to be lit.
PLANTED_LIGHTS = CLOSED | {
    "no fading": Lighting((SUN, Light()), shininess=3.0),
    "shininess 0, one side": Lighting((SUN, MOON), shininess=0.0, specular=0.4, two_sided=False),
}


def off_by(renderer: Renderer, kind: Classification, lights: str, world: float = 1.0) -> float:
    """Largest error in a field of one gradient, in tolerances; the eye on the side of lower values, or of higher."""
    volume, lighting = linear(world=world), PLANTED_LIGHTS[lights]
    if lighting.fade is not None:
        lighting = replace(lighting, fade=lighting.fade / world)
    found = 0.0
    for sign in (1, -1):
        eye = tuple(volume.centre + sign * 3 * volume.radius * np.array([0.6, 0.5, 0.4]))
        camera = Camera.orthographic(eye, tuple(volume.centre), (0, 0, 1), height=2 * volume.radius)
        scene = Scene(volume, even(0.15 / world), camera, classification=kind, lighting=lighting)
        error = largest(drawn(renderer, scene) - lit_and_even(scene, SLOPE / world))
        found = max(found, error / tolerance(lighting))
    return found


@pytest.mark.parametrize("mistake", SHADER_MISTAKES)
@pytest.mark.parametrize("kind", ["post"])
def test_a_mistake_in_the_light_shows(renderer: Renderer, kind: Classification, mistake: str) -> None:
    replacement, lights = SHADER_MISTAKES[mistake]
    assert off_by(renderer, kind, lights) < 1
    with planted.planted(replacement) as wrong:
        assert off_by(wrong, kind, lights) > 1000


def _higher(slopes: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    normals, magnitudes = _DIRECTIONS(slopes, spacing)
    return -normals, magnitudes


def _without_spacing(slopes: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    return _DIRECTIONS(slopes, 1.0)


def _transposed(scene: Scene, box: object, is_shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    slopes, index = _SLOPES_AT(scene, box, is_shown)
    return np.ascontiguousarray(slopes[::-1]), index


_DIRECTIONS, _SLOPES_AT = shaded_samples._directions, shaded_samples._slopes_at
SAMPLE_MISTAKES = {
    "gradient transposed": ("_slopes_at", _transposed, "one side"),
    "normal to higher values": ("_directions", _higher, "one side"),
    "spacing left out": ("_directions", _without_spacing, "two of them, fading"),
    "halfway not of length 1": ("_unit", lambda vectors: vectors, "no fading"),
}


@pytest.mark.parametrize("kind", ["slab"])
@pytest.mark.parametrize("mistake", SAMPLE_MISTAKES)
def test_a_mistake_in_the_light_at_the_samples_shows(renderer: Renderer, kind: Classification, mistake: str) -> None:
    name, wrong, lights = SAMPLE_MISTAKES[mistake]
    assert off_by(renderer, kind, lights, world=3.0) < 1
    with patch.object(shaded_samples, name, wrong), Renderer() as other:
        assert off_by(other, kind, lights, world=3.0) > 1000


@contextmanager
def gradients_per_spacing() -> Iterator[None]:
    wrong = property(lambda texture: texture.largest_component)
    with patch.object(ValueTexture, "largest_gradient", wrong):
        yield


@pytest.mark.parametrize("kind", ["post", "integrated"])
def test_a_spacing_that_is_left_out_of_the_fade_shows(renderer: Renderer, kind: Classification) -> None:
    assert off_by(renderer, kind, "two of them, fading", world=3.0) < 1
    with gradients_per_spacing():
        assert off_by(renderer, kind, "two of them, fading", world=3.0) > 1000


@kinds
def test_a_cue_applied_twice_shows(renderer: Renderer, kind: Classification) -> None:
    volume = linear()
    scene = Scene(volume, even(), framed(volume), classification=kind, depth_cue=DepthCue(0.5, near=0.0, far=1e-3))
    mixed = "mix(color.rgb, cue.rgb * color.a, %s)"
    twice = ("seen.glsl", mixed % "share", mixed % "share * (2.0 - share)")
    half = drawn(renderer, replace(scene, depth_cue=None)) * [0.5, 0.5, 0.5, 1]
    assert largest(drawn(renderer, scene) - half) < ROUNDING
    with planted.planted(twice) as wrong:
        assert largest(drawn(wrong, scene) - half) > 0.1
