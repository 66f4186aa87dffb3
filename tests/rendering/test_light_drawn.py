"""Lit matter, drawn: closed forms in fields of one gradient, orders of convergence to the oracle, planted mistakes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from support import closed_forms as known
from support import planted
from support.lit_scenes import (
    KINDS,
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
    tolerance,
    with_values,
)
from support.pairs import IN_A_PROJECTION
from support.scenes import path_lengths

from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import Classification, Scene
from texvol.scene.volume import Volume
from texvol.textures import shaded_samples
from texvol.textures.value_texture import ValueTexture

kinds = pytest.mark.parametrize("kind", KINDS)
MOON = Light("directional", (-1, 2, -0.5), (0.2, 0.3, 0.9))  # on the other side


# Closed forms.

CLOSED = {
    "head": Lighting(),
    "head, one side": Lighting(two_sided=False),
    "two of them, fading": Lighting((SUN, MOON), fade=1.5 * float(np.linalg.norm(SLOPE))),
    "one side": Lighting((SUN, MOON, Light()), two_sided=False, shininess=5.0),
    "shininess 0": Lighting((SUN,), shininess=0.0, specular=0.4),
    "shininess 64": Lighting((SUN, Light()), shininess=64.0, specular=0.4),
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
    + [("extinction", "orthographic", lights) for lights in IN_PERSPECTIVE]
    + [("post", "perspective", lights) for lights in IN_PERSPECTIVE[:2]]
    + [("integrated", "perspective", lights) for lights in IN_PERSPECTIVE[1:]],
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


@pytest.mark.parametrize("kind", ["extinction", "post"])  # gradients of samples, and between them
@pytest.mark.parametrize(
    "dtype, texture_format", [*((each, "auto") for each in TYPES), ("u1", "rgba32f"), ("f8", "rgba32f")]
)
def test_any_type_of_values(renderer: Renderer, kind: Classification, dtype: str, texture_format: str) -> None:
    factor, offset = TYPES[dtype]
    z, y, x = np.meshgrid(np.arange(7), np.arange(9), np.arange(13), indexing="ij")
    volume = with_values(grid((13, 9, 7)), (offset + factor * (np.stack([x, y, z], -1) @ WHOLE)).astype(dtype))
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


@pytest.mark.parametrize("kind, projection", IN_A_PROJECTION)
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
    position, direction = (origins - volume.box_corner) @ unit_from_world.T, directions @ unit_from_world.T
    with np.errstate(divide="ignore"):
        return np.minimum(-position / direction, (1 - position) / direction).max(axis=2)


@kinds
@pytest.mark.parametrize(
    "near, far, fraction", [(-1e300, -1e299, 1.0), (1e9, 1e10, 0.0), (0.0, 1e-3, 1.0), (0.0, 1e300, 0.0)]
)
def test_beyond_its_range_a_depth_cue_is_all_or_nothing(
    renderer: Renderer, kind: Classification, near: float, far: float, fraction: float
) -> None:
    volume = linear()
    cue = DepthCue(0.5, (0.1, 0.2, 0.7), near, far)
    plain = Scene(volume, even(), framed(volume), classification=kind)
    picture, unlit = drawn(renderer, replace(plain, depth_cue=cue)), drawn(renderer, plain)
    t = 0.5 * fraction
    expected = (1 - t) * unlit[..., :3] + t * unlit[..., 3:] * np.array(cue.color)
    assert largest(picture[..., :3] - expected) < ROUNDING


# Planted mistakes.

WITH_LIGHT = "Shade with_light(Shade shade, vec3 color, vec3 normal, vec3 to_light, vec3 to_eye, float confidence)"
SHADER_MISTAKES: dict[str, tuple[planted.Mistake, str]] = {
    "gradient transposed": (("vec3 gradient_of(vec4 texel)", "return gradient_of_right(texel).bgr;"), "one side"),
    "normal to higher values": (planted.NORMAL_TO_HIGHER_VALUES, "one side"),
    "light swapped": (
        (WITH_LIGHT, "return with_light_right(shade, color.bgr, normal, to_light, to_eye, confidence);"),
        "one side",
    ),
    "halfway not of length 1": (
        (
            "float halfway_cosine(vec3 normal, vec3 to_light, vec3 to_eye)",
            "return clamp(dot(normal, to_light + to_eye), 1e-30, 1.0);",
        ),
        "no fading",
    ),
    "fade ignored": (
        (WITH_LIGHT, "return with_light_right(shade, color, normal, to_light, to_eye, min(1e6 * confidence, 1.0));"),
        "two of them, fading",
    ),
    "one side only": (("vec3 lit_normal(vec3 normal, vec3 to_eye)", "return normal;"), "head"),
    "highlights on what faces away": (
        (
            "float highlight_of(float facing, float halfway, float confidence)",
            "return highlight_of_right(1.0, halfway, confidence);",
        ),
        "shininess 0, one side",
    ),
    "highlights coloured by matter": (
        (
            "vec4 lit_medium(vec4 medium, Shade shade)",
            "return vec4(medium.rgb * (shade.diffuse + shade.specular), medium.a);",
        ),
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
    wrong_function, lights = SHADER_MISTAKES[mistake]
    assert off_by(renderer, kind, lights) < 1
    with planted.planted(wrong_function) as wrong:
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
    twice = ("vec4 cued(vec4 color, float depth)", "return cued_right(cued_right(color, depth), depth);")
    half = drawn(renderer, replace(scene, depth_cue=None)) * [0.5, 0.5, 0.5, 1]
    assert largest(drawn(renderer, scene) - half) < ROUNDING
    with planted.planted(twice) as wrong:
        assert largest(drawn(wrong, scene) - half) > 0.1
