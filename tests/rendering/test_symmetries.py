"""What a picture may not depend on, on random volumes: OpenGL and the oracle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (24, 24)
ULP = 2.0**-24
EXAMPLES = settings(max_examples=10, deadline=None)
SYMMETRIES = list(product(permutations(range(3)), product((1, -1), repeat=3)))  # axes, signs: 48

MEDIUM = TransferFunction(
    np.array([0.1, 0.4, 0.7, 1]),
    np.array([(0.1, 0.5, 1), (0.9, 0.4, 0.1), (0.2, 0.9, 0.3), (1, 1, 1)]),
    np.array([0, 0.3, 0.1, 0.6]),
)
GAS = TransferFunction(
    np.array([0.1, 0.5, 1]), np.array([(0, 0, 0), (0.3, 0.1, 0), (0, 0.1, 0.4)]), [0, 0.3, 0.1], True
)

seeds = st.integers(0, 2**32 - 1)
kinds = st.sampled_from(CLASSIFICATIONS)
media = st.sampled_from([MEDIUM, GAS])
projections = st.sampled_from(["orthographic", "perspective"])
Draw = Callable[[Scene], np.ndarray]


@pytest.fixture(scope="module", params=["opengl", "oracle"])
def draw(request: pytest.FixtureRequest, renderer: Renderer) -> Draw:
    """A picture in float64, by OpenGL with two slabs per sample, or by the oracle."""
    if request.param == "oracle":
        return lambda scene: raycast(scene, SIZE)

    def by_opengl(scene: Scene) -> np.ndarray:
        # Slabs of half the smallest spacing of the volume as it is in this world.
        picture = renderer.render(scene, SIZE, sampling_rate=2, texture_format="rgba32f")
        return picture.astype(np.float64)

    by_opengl.rounds = True  # type: ignore[attr-defined]
    return by_opengl


def tolerance(draw: Draw) -> float:
    """How far two pictures of the same may be apart.

    OpenGL: coordinates round to 2^-25 of a box of 7 samples, rms over it 2^-24 of a sample; neighbours in noise differ
    by 0.41 (rms of uniform numbers) along each of three axes; extinction rises by about 1 per unit of value, a path is
    up to 11 long, its 30 slabs are as good as independent: 11 × 0.41 √3 / √30 = 1.4 × 2^-24 of depth. The worst of
    some thousand pixels is five times that, √2 more for two pictures; texels, blends and registers add six.

    Oracle: some hundred pieces of a few ulps of float64, 2e-16 of a picture up to 3.
    """
    return 16 * ULP if hasattr(draw, "rounds") else 3e-13


def volume_of(random: np.random.Generator) -> Volume:
    """Noise on a small anisotropic grid somewhere."""
    nx, ny, nz = random.integers(3, 8, 3)
    values = random.random((nz, ny, nx)).astype(np.float32)
    return Volume(values, random.uniform(0.7, 1.1, 3), random.uniform(-5, 5, 3))


def camera_of(random: np.random.Generator, volume: Volume, projection: Projection) -> Camera:
    """A view from anywhere around; up is nothing special either."""
    eye = random.standard_normal(3)
    eye *= random.uniform(1.3, 3) * volume.radius / np.linalg.norm(eye)
    up = np.cross(eye, random.standard_normal(3))
    if projection == "perspective":
        return Camera.perspective(volume.centre + eye, volume.centre, up, fov=random.uniform(20, 70))
    return Camera.orthographic(volume.centre + eye, volume.centre, up, height=1.8 * volume.radius)


def moved(camera: Camera, matrix: np.ndarray, scale: float = 1.0) -> Camera:
    """The camera in a world that the matrix has turned or mirrored, and that is `scale` times as large."""
    positions = {name: tuple(scale * (matrix @ getattr(camera, name))) for name in ("eye", "target")}
    return replace(camera, **positions, up=tuple(matrix @ camera.up), height=scale * camera.height)


@EXAMPLES
@given(seeds, kinds, media, projections, st.sampled_from(SYMMETRIES))
def test_the_48_symmetries_of_the_cube(draw, seed, kind, medium, projection, symmetry) -> None:
    """Samples listed in another order along other axes, in a world turned or mirrored to match."""
    random = np.random.default_rng(seed)
    volume = volume_of(random)
    camera = camera_of(random, volume, projection)
    axes, signs = symmetry
    matrix = np.zeros((3, 3))
    matrix[range(3), axes] = signs  # new axis a is `signs[a]` times old axis `axes[a]`
    values = volume.values.transpose([2 - axes[2 - a] for a in range(3)])
    values = np.flip(values, [2 - a for a in range(3) if signs[a] < 0])
    spacing = volume.spacing[list(axes)]
    centre = matrix @ volume.centre
    turned = Volume(values, spacing, centre - spacing * (np.array(values.shape[::-1]) - 1) / 2)
    plain = draw(Scene(volume, medium, camera, classification=kind))
    picture = draw(Scene(turned, medium, moved(camera, matrix), classification=kind))
    if np.linalg.det(matrix) < 0:
        picture = picture[:, ::-1]  # the camera stays right-handed
    np.testing.assert_allclose(picture, plain, rtol=0, atol=tolerance(draw))


def test_there_are_48_of_them() -> None:
    matrices = set()
    for axes, signs in SYMMETRIES:
        matrix = np.zeros((3, 3), int)
        matrix[range(3), axes] = signs
        matrices.add(matrix.tobytes())
    assert len(matrices) == 48


@EXAMPLES
@given(seeds, kinds, media)
def test_opacity_is_the_same_from_the_two_ends_of_a_ray(draw, seed, kind, medium) -> None:
    random = np.random.default_rng(seed)
    volume = volume_of(random)
    camera = camera_of(random, volume, "orthographic")
    back = replace(camera, eye=tuple(2 * volume.centre - camera.eye))
    one, other = (draw(Scene(volume, medium, c, classification=kind))[..., 3] for c in (camera, back))
    np.testing.assert_allclose(other[:, ::-1], one, rtol=0, atol=tolerance(draw))


@EXAMPLES
@given(seeds, kinds, media, projections, st.floats(-9, 9))
def test_the_size_of_the_world_does_not_matter(draw, seed, kind, medium, projection, exponent) -> None:
    """Volume × k with extinction / k (and emission / k) is the same picture, k from 1e-9 to 1e9."""
    random = np.random.default_rng(seed)
    k = 10**exponent
    volume = volume_of(random)
    camera = camera_of(random, volume, projection)
    scaled = Volume(volume.values, k * volume.spacing, k * volume.origin)
    colors = medium.colors / k if medium.emissive else medium.colors
    thinner = TransferFunction(medium.values, colors, medium.extinctions / k, medium.emissive)
    plain = draw(Scene(volume, medium, camera, classification=kind))
    picture = draw(Scene(scaled, thinner, moved(camera, np.eye(3), k), classification=kind))
    # What reaches OpenGL differs by roundings of float64, and so by one of float32 here and there.
    np.testing.assert_allclose(picture, plain, rtol=0, atol=4 * ULP if hasattr(draw, "rounds") else 3e-13)


@EXAMPLES
@given(seeds, kinds, media, projections, st.integers(1, 3))
def test_an_empty_border_adds_nothing(draw, seed, kind, medium, projection, width) -> None:
    """Samples of nothing around a volume whose outer samples are nothing; as many on each side: the slabs stay."""
    random = np.random.default_rng(seed)
    volume = volume_of(random)
    values = np.pad(volume.values, 1)
    camera = camera_of(random, volume, projection)
    plain, wide = (
        Volume(np.pad(values, w), volume.spacing, volume.origin - (1 + w) * volume.spacing) for w in (0, width)
    )
    pictures = [draw(Scene(v, medium, camera, classification=kind)) for v in (plain, wide)]
    # The eye may be in the border, and the box is up to 15 samples wide instead of 7: twice the coordinates' rounding.
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=0, atol=2 * tolerance(draw))


@EXAMPLES
@given(seeds, kinds, media, projections, st.tuples(*[st.floats(0, 1)] * 3))
def test_the_background_enters_as_what_is_left(draw, seed, kind, medium, projection, background) -> None:
    random = np.random.default_rng(seed)
    volume = volume_of(random)
    scene = Scene(volume, medium, camera_of(random, volume, projection), classification=kind)
    plain, behind = draw(scene), draw(replace(scene, background=background))
    np.testing.assert_array_equal(behind[..., 3], plain[..., 3])
    expected = plain[..., :3] + (1 - plain[..., 3:]) * np.array(background)
    # One product and one sum of numbers up to 2, in float32 and in float64.
    atol = 4 * ULP if hasattr(draw, "rounds") else 1e-15
    np.testing.assert_allclose(behind[..., :3], expected, rtol=0, atol=atol)


@EXAMPLES
@given(seeds, kinds, st.booleans(), projections, st.floats(0, 1))
def test_light_is_linear_in_the_colour(draw, seed, kind, emissive, projection, fraction) -> None:
    random = np.random.default_rng(seed)
    volume = volume_of(random)
    camera = camera_of(random, volume, projection)
    one, other = random.random((2, 4, 3)) * (0.3 if emissive else 1.0)
    lights = []
    for colors in (one, other, fraction * one + (1 - fraction) * other):
        medium = TransferFunction(MEDIUM.values, colors, MEDIUM.extinctions, emissive)
        lights.append(draw(Scene(volume, medium, camera, classification=kind)))
    mixed = fraction * lights[0] + (1 - fraction) * lights[1]
    # The same fetches, so only what follows rounds: 30 products and sums, as good as random, and the worst pixel has
    # five times their rms; colours and the blend add four roundings.
    brightest = max(light.max() for light in lights)
    atol = brightest * (ULP * (5 * np.sqrt(2 * 30 / 3) / 2 + 4) if hasattr(draw, "rounds") else 1e-14)
    np.testing.assert_allclose(lights[2], mixed, rtol=0, atol=atol)
    assert lights[0][..., :3].max() > 0


@EXAMPLES
@given(seeds, kinds, media, projections)
def test_a_whole_is_its_halves_composited(draw, seed, kind, medium, projection) -> None:
    """Cut where two layers are the same, so that each half is clamped to what was there; the slabs' phase is kept."""
    random = np.random.default_rng(seed)
    front, back = random.integers(1, 4, 2)
    values = random.random((front + back, 5, 6)).astype(np.float32)
    values[front] = values[front - 1]
    whole = Volume(values)
    eye = whole.centre - (0.6, 0.4, 12)
    target = eye + (0, 0, 1)  # along z, across the cut
    if projection == "perspective":
        camera = Camera.perspective(eye, target, (0, 1, 0), fov=35)
    else:
        camera = Camera.orthographic(eye, target, (0, 1, 0), height=7)
    halves = Volume(values[:front]), Volume(values[front:], origin=(0, 0, front))
    # Middles of volumes of whole samples are half samples apart at least, which is a slab.
    together, first, second = (draw(Scene(v, medium, camera, classification=kind)) for v in (whole, *halves))
    np.testing.assert_allclose(first + (1 - first[..., 3:]) * second, together, rtol=0, atol=tolerance(draw))
