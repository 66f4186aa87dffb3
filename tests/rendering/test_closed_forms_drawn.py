"""Pictures known in closed form, drawn by OpenGL: the cases of optics.md that can be put on a grid.

Each in the classifications that it holds for: an interpolated opacity (`slab`) is another medium than the case's
wherever opacity changes from sample to sample, and so is interpolated emission (`extinction`) where colour and
extinction both do. Rays go along the middle of the volume, d is the slab thickness, h the distance of samples.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike
from support import closed_forms as known

from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

ULP = 2.0**-24
ALL = ("slab", "extinction", "post", "integrated")
rates = pytest.mark.parametrize("rate", [0.3, 1, 2, 7])  # slabs per sample

# One blend and up to 64 slabs in registers, each rounding a product and a sum: 5 √(2 × 64 / 3) / 2, and texels, path
# and series four times with one sign. Relative to the brightest of the picture.
ROUNDING = 20 * ULP
# The table of `post` and `integrated` keeps a transfer function's points this share of themselves to the left.
EARLY = 2.0**-22


def kinds(*names: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("kind", names or ALL)


def column(values: ArrayLike, h: float = 1.0) -> Volume:
    """A volume of these values along z."""
    values = np.asarray(values, np.float32)
    return Volume(np.broadcast_to(values[:, np.newaxis, np.newaxis], (values.size, 3, 3)), (h, h, h))


def even(extinction: float, color: ArrayLike = (0.9, 0.5, 0.1), emissive: bool = False) -> TransferFunction:
    return TransferFunction(np.zeros(1), np.array([color], float), np.array([extinction]), emissive)


def line(
    a: float, b: float, top: float, front: ArrayLike = (1, 0.2, 0), back: ArrayLike = (1, 0.2, 0)
) -> TransferFunction:
    """From extinction a and colour `front` at value 0 to b and `back` at `top`."""
    return TransferFunction(np.array([0, top]), np.array([front, back], float), np.array([a, b]))


def middle_ray(
    renderer: Renderer,
    volume: Volume,
    medium: TransferFunction,
    kind: Classification,
    rate: float = 1,
    from_below: bool = True,
    background: tuple[float, float, float] = (0, 0, 0),
) -> np.ndarray:
    """rgba of the ray through the middle of the box, along z."""
    away = np.array([0, 0, volume.box_edges[2, 2] * (1 if from_below else -1)])
    camera = Camera.orthographic(volume.centre - away, volume.centre, (0, 1, 0), volume.smallest_spacing)
    scene = Scene(volume, medium, camera, background, kind)
    picture = renderer.render(scene, (1, 1), sampling_rate=rate, texture_format="rgba32f")
    return picture[0, 0].astype(np.float64)


def assert_near(pixel: np.ndarray, expected: ArrayLike, error: float = 0.0) -> None:
    """Within an error and float32's roundings."""
    expected = np.broadcast_to(expected, (4,))
    np.testing.assert_allclose(pixel, expected, rtol=0, atol=error + ROUNDING * expected.max())


@kinds()
@rates
@pytest.mark.parametrize("depth", [1e-12, 1e-3, 1.0, 50.0])
def test_case_1_even_matter_over_a_background(
    renderer: Renderer, kind: Classification, rate: float, depth: float
) -> None:
    volume, background = column(np.zeros(9), 0.3), (0.2, 0.6, 0.4)
    alpha = known.opacity(depth)
    expected = np.append(alpha * np.array([0.9, 0.5, 0.1]) + (1 - alpha) * np.array(background), alpha)
    assert_near(middle_ray(renderer, volume, even(depth / 2.7), kind, rate, background=background), expected)


@kinds()
@pytest.mark.parametrize("fov", [None, 20, 110])
@pytest.mark.parametrize("deepest", [1.0, 1.99, 2.01])
def test_slabs_of_any_depth_on_rays_of_any_slant(
    renderer: Renderer, kind: Classification, fov: float | None, deepest: float
) -> None:
    """The series that stand for exponentials go to a depth of 2, or to a slant that adds 1/2 to it."""
    volume, size = Volume(np.zeros((6, 5, 7), np.float32)), (24, 18)
    camera = Camera.framing(volume, "perspective" if fov else "orthographic", fov=fov, aspect=size[0] / size[1])
    medium = even(deepest / camera.largest_obliquity(size))
    scene = Scene(volume, medium, camera, classification=kind)
    for skip_empty in (True, False):
        picture = renderer.render(scene, size, slab_thickness=1.0, texture_format="rgba32f", skip_empty=skip_empty)
        np.testing.assert_allclose(picture, raycast(scene, size), rtol=0, atol=ROUNDING)


@kinds()
@rates
@pytest.mark.parametrize("depth", [0.0, 1e-30, 1e-8, 1e-3, 1.0, 50.0, 1e4])
def test_case_2_even_emission_and_extinction(
    renderer: Renderer, kind: Classification, rate: float, depth: float
) -> None:
    volume, q = column(np.zeros(8), 0.5), np.array([3, 0.5, 1e-3])
    light = known.constant_medium(q, depth / 4, 4.0)
    pixel = middle_ray(renderer, volume, even(depth / 4, q, emissive=True), kind, rate)
    # Channel by channel: a faint one does not lose digits to a bright one, nor a thin opacity to light.
    np.testing.assert_allclose(pixel, np.append(light, known.opacity(depth)), rtol=ROUNDING, atol=1e-37)


@kinds("extinction", "post", "integrated")
@rates
@pytest.mark.parametrize("a, b", [(0, 0.5), (0.5, 0), (0.1, 0.3), (5.0, 0)])
def test_case_3_linear_extinction(renderer: Renderer, kind: Classification, rate: float, a: float, b: float) -> None:
    depth = (a + b) / 2 * 8 + (a + b) * 0.5  # eight cells, and half a sample of a and of b
    # The slope changes by (b - a) / 8 at the outer samples and back; planes lie alike at both, so that this cancels.
    error = (1 - known.opacity(depth)) * EARLY * abs(b - a) * 9
    alpha = known.opacity(depth)
    assert_near(
        middle_ray(renderer, column(np.arange(9)), line(a, b, 8), kind, rate), alpha * np.array([1, 0.2, 0, 1]), error
    )


@kinds("slab")
@rates
def test_case_3_interpolated_opacity_is_short_by_the_squared_difference_of_neighbours(
    renderer: Renderer, kind: Classification, rate: float
) -> None:
    a, b, d = 0.1, 0.5, min(1 / rate, 4.5)
    alpha = known.opacity((a + b) / 2 * 9)
    kinks = 2 * (b - a) / 8 * d**2 / 8
    jensen = 9 / d * ((b - a) / 8 / rate) ** 2 / 8 * (rate * d)  # Δu²/8 for each slab of its neighbours' u = τ d
    pixel = middle_ray(renderer, column(np.arange(9)), line(a, b, 8), kind, rate)
    assert_near(pixel, alpha * np.array([1, 0.2, 0, 1]), (1 - alpha) * np.expm1(kinks + jensen))


@kinds("post", "integrated")
@pytest.mark.parametrize("rate", [1, 2, 8])
@pytest.mark.parametrize("a, b", [(0.05, 0.4), (0.4, 0.05), (0.2, 0.2), (0, 1.0), (1.0, 0)])
def test_case_4_linear_extinction_and_colour(
    renderer: Renderer, kind: Classification, rate: float, a: float, b: float
) -> None:
    front, back = np.array([1, 0.2, 0]), np.array([0.1, 0.6, 1])
    layers = [known.layer(front, a, 0.5), known.ramp(front, back, a, b, 8.0), known.layer(back, b, 0.5)]
    expected = known.over(layers[0], known.over(layers[1], layers[2]))
    d, change, most = 1 / rate, abs(b - a) / 8, max(a, b)
    # Slabs of a rate 1 are cut at every middle between samples, so that slopes change inside the outer ones; slabs of
    # an even rate are cut at the samples, too.
    kinks = 2 * change * d**2 / 8
    if kind == "post":
        # The slab's light is seen behind half of it and not behind itself: c' τ and τ' c over d³/24 and d³/12 a slab.
        per_depth = d**2 * (most / 8 + change) / 12
        error = kinks + per_depth * min(1, 9 * most) * 2
    elif rate == 1:
        # The bend in colour at the outer samples is that of extinction.
        error = kinks + 2 * d**2 / 8 / 8 * most
    else:
        # Linear colour in linear extinction is integrated to 3 points of Gauss, x^7 / 2016000 of a slab of depth x, and
        # points of the transfer function come early.
        error = 9 * rate * (most * d) ** 7 / 2016000 + EARLY * 9 * (change + most)
    assert_near(middle_ray(renderer, column(np.arange(9)), line(a, b, 8, front, back), kind, rate), expected, error)


@kinds("slab", "extinction")
@rates
def test_case_5_two_layers_of_the_same_extinction_before_classification(
    renderer: Renderer, kind: Classification, rate: float
) -> None:
    """Samples 0 0 1 1: between the layers the premultiplied colour goes linearly from one to the other."""
    first, second, tau = np.array([1, 0.2, 0]), np.array([0.1, 0.6, 1]), 0.4
    blend = known.ramp(first, second, tau, tau, 1.0)
    front, back = known.layer(first, tau, 1.5), known.layer(second, tau, 1.5)
    medium = line(tau, tau, 1, first, second)
    pixel = middle_ray(renderer, column([0, 0, 1, 1]), medium, kind, rate)
    reverse = middle_ray(renderer, column([0, 0, 1, 1]), medium, kind, rate, from_below=False)
    # Emission bends by τ Δc and back at two samples, alike between planes: J p²/8 each, less what is seen of one behind
    # the other, e^-0.6 and e^-1; inside a slab light is even instead of linear, τ Δc p³/12 τ of it, in 1/d slabs.
    p = min(1 / rate, 2.0)
    error = tau * p**2 / 8 * (np.exp(-0.6) - np.exp(-1)) + tau**2 * p**2 / 12
    assert_near(pixel, known.over(front, known.over(blend, back)), error)
    np.testing.assert_allclose(reverse[3], pixel[3], rtol=0, atol=2 * ULP)


@kinds("post", "integrated")
@pytest.mark.parametrize("rate", [1, 2, 8])
def test_case_5_two_layers_with_a_step_between_them(renderer: Renderer, kind: Classification, rate: float) -> None:
    first, second = np.array([1, 0.2, 0]), np.array([0.1, 0.6, 1])
    medium = TransferFunction(np.array([0, 3.3, 3.3, 8]), np.array([first] * 2 + [second] * 2), [0.2, 0.2, 0.9, 0.9])
    front, back = known.layer(first, 0.2, 3.8), known.layer(second, 0.9, 5.2)
    pixel = middle_ray(renderer, column(np.arange(9)), medium, kind, rate)
    reverse = middle_ray(renderer, column(np.arange(9)), medium, kind, rate, from_below=False)
    # `post` places the step to half a slab; `integrated` to 2^-22 of its value, and two ulps of that.
    position = 0.5 / rate if kind == "post" else 3.3 * EARLY + 8 * ULP
    assert_near(pixel, known.over(front, back), 0.9 * position)
    assert_near(reverse, known.over(back, front), 0.9 * position)
    np.testing.assert_allclose(reverse[3], pixel[3], rtol=0, atol=2 * ULP)
    difference = np.append((first - second) * front[3] * back[3], 0)
    np.testing.assert_allclose(pixel - reverse, difference, rtol=0, atol=2 * 0.9 * position + 2 * ROUNDING)


@kinds()
@pytest.mark.parametrize("field", ["exponential", "gaussian", "sinusoid"])
def test_cases_6_8_and_12_smooth_extinctions(renderer: Renderer, kind: Classification, field: str) -> None:
    n, length = 64, 2.0
    h = length / n
    z = (np.arange(n) + 0.5) * h
    if field == "exponential":  # depth, and by how much τ' differs at the two ends
        values, depth = 3 * np.exp(-1.5 * z), known.exponential_depth(3, 1.5, length)
        bend = 3 * 1.5 * (1 - np.exp(-3))
    elif field == "gaussian":
        values = 3 * np.exp(-((z - 0.7) ** 2) / (2 * 0.6**2))
        depth = float(known.gaussian_depth(3, 0.6, 0, -0.7, 1.3))
        bend = sum(3 * t / 0.6**2 * np.exp(-(t**2) / (2 * 0.6**2)) for t in (0.7, 1.3))
    else:
        values, depth = 2 * (1 + 0.8 * np.sin(2.5 * z)), known.sinusoid_depth(2, 0.8, 2.5, 0, length)
        bend = 2 * 0.8 * 2.5 * (1 - np.cos(5))
    medium = line(0, 10, 10)
    alpha = known.opacity(depth)
    # Samples at the middles of cells, flat at the ends: the midpoint rule of step h, h²/24 of the change of τ', and the
    # next term a hundredth of that. Planes d = h/2 apart go through the samples, where the slope changes.
    d = h / 2
    error = 1.01 * abs(bend) * h**2 / 24 + EARLY * values.max() * length
    if kind == "slab":
        # Opacities a quarter of the way between neighbours: depth falls short by 1/4 3/4 Δu²/2 < Δu²/8 a slab.
        error += length / d * np.mean(np.diff(values * d) ** 2) / 8
    pixel = middle_ray(renderer, column(values, h), medium, kind, 2)
    assert_near(pixel, alpha * np.array([1, 0.2, 0, 1]), (1 - alpha) * np.expm1(error))


@kinds()
def test_case_6_fading_emission_in_even_extinction(renderer: Renderer, kind: Classification) -> None:
    n, length = 64, 2.0
    h = length / n
    values = 3 * np.exp(-1.5 * (np.arange(n) + 0.5) * h)
    medium = TransferFunction(
        np.array([0, 10.0]), np.array([(0, 0, 0), (10, 5, 0)]), np.array([0.7, 0.7]), emissive=True
    )
    light = known.fading_emission(3, 1.5, 0.7, length) * np.array([1, 0.5, 0])
    # Interpolation is too high by h² q''/12 on average, and the flat ends off by h² q'/8, one each way, as seen through
    # T; in a slab light is even instead of linear, q' τ d²/12, as seen. All of q falls as e^-1.5t, of T as e^-0.7t.
    d, seen = h / 2, known.fading_emission(1, 1.5, 0.7, length)
    error = 3 * (1.5**2 * seen * h**2 / 12 + 1.5 * (1 + np.exp(-4.4)) * h**2 / 8 + 1.5 * 0.7 * seen * d**2 / 12)
    assert_near(middle_ray(renderer, column(values, h), medium, kind, 2), np.append(light, known.opacity(1.4)), error)


def squares() -> Volume:
    """x² + y² + z² on 25³ samples: exact on columns, where spheres of a whole radius lie on samples."""
    axis = np.arange(-12.0, 13.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return Volume((x * x + y * y + z * z).astype(np.float32))


@kinds("post", "integrated")
@pytest.mark.parametrize("rate", [1, 4])
def test_cases_7_and_9_a_ball_and_a_shell(renderer: Renderer, kind: Classification, rate: float) -> None:
    volume, tau = squares(), 0.13
    camera = Camera.orthographic(volume.centre - (0, 0, 50), volume.centre, (0, 1, 0), 25)
    ball = TransferFunction(np.array([25.0, 25]), np.ones((2, 3)), np.array([tau, 0]))
    shell = TransferFunction(np.array([50.0, 50, 65, 65]), np.ones((4, 3)), np.array([0, tau, tau, 0]))
    # 3² + 4² = 5²; 1 + 7² = 50, 1 + 8² = 65, 7² + 4² = 65. Planes go through samples, where the faces are: `integrated`
    # has them exactly, but for 2^-22 of r² = 65, which grows by at least 5 in the sample next to a face; `post` counts
    # whole slabs, whose middles lie on one side.
    chords = [(ball, b, known.ball_chord(5, b), 2) for b in (0, 3, 4)]
    chords += [(shell, -b, known.shell_chord(np.sqrt(50), np.sqrt(65), b), 4) for b in (1, 7)]
    for medium, b, chord, faces in chords:
        scene = Scene(volume, medium, camera, classification=kind)
        pixel = renderer.render(scene, (25, 25), sampling_rate=rate, texture_format="rgba32f")[12, 12 + b].astype(float)
        error = faces * tau * (65 * EARLY / 5 + 25 * ULP)
        assert_near(pixel, known.opacity(tau * chord), (1 - known.opacity(tau * chord)) * error)


@kinds("post", "integrated")
def test_case_7_the_mean_opacity_of_a_ball(renderer: Renderer, kind: Classification) -> None:
    axis = np.linspace(-1.1, 1.1, 65)
    h = axis[1] - axis[0]
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    volume = Volume((x * x + y * y + z * z).astype(np.float32), (h, h, h), (-1.1, -1.1, -1.1))
    ball = TransferFunction(np.array([1.0, 1]), np.ones((2, 3)), np.array([1.5, 0]))
    camera = Camera.orthographic((0, 0, -4), (0, 0, 0), (0, 1, 0), 2.2)
    scene = Scene(volume, ball, camera, classification=kind)
    picture = renderer.render(scene, (110, 110), sampling_rate=2, texture_format="rgba32f")
    mean = picture[..., 3].astype(float).sum() * (2.2 / 110) ** 2 / np.pi
    # r² is interpolated too high by h²/6 on average over two axes across the ray and h²/6 along it, so that the ball is
    # smaller by h²/4 in r, 3 % of a sample; opacity falls by 2 of that; pixels meet the disc to 1e-3.
    assert mean == pytest.approx(known.ball_mean_opacity(1.5), rel=2 * h**2 + 1e-3)


@kinds("integrated")
@pytest.mark.parametrize("front, behind", [(2.0, 5.0), (5.0, 2.0), (3.0, 3.0), (0.5, 7.5)])
def test_case_10_a_preintegrated_pair(renderer: Renderer, kind: Classification, front: float, behind: float) -> None:
    """A kinked extinction between two values: exact however few slabs there are."""
    points, tau = np.array([0, 2.5, 3.0, 6.0, 8.0]), np.array([0, 0.03, 0.12, 0.01, 0.05])
    medium = TransferFunction(points, np.ones((5, 3)), tau)
    between = [v for v in points if min(front, behind) < v < max(front, behind)]
    path = np.array(sorted([front, behind, *between]))
    ends = np.interp([front, behind], points, tau)
    mean = np.trapezoid(np.interp(path, points, tau), path) / abs(behind - front) if front != behind else ends[0]
    depth = 4 * mean + 2 * ends.sum()
    # Samples 4 apart in a box of 8: slabs of 2 end at the samples. Points come `EARLY`: over the flat ends τ is that of
    # a value beside the sample's, in between the mean moves by no more than τ does all the way.
    volume = Volume(np.broadcast_to(np.array([front, behind], np.float32)[:, None, None], (2, 3, 3)), (4, 4, 4))
    shift = EARLY * max(front, behind)
    slopes = np.abs(np.interp(np.array([front, behind]) + shift, points, tau) - ends)
    moved = shift * np.abs(np.diff(np.interp(path, points, tau))).sum() / max(abs(behind - front), shift)
    error = 2 * slopes.sum() + 4 * moved
    assert_near(middle_ray(renderer, volume, medium, kind, 2), known.opacity(depth), (1 - known.opacity(depth)) * error)


@kinds("extinction", "post", "integrated")
def test_case_11_a_linear_field_on_any_grid(renderer: Renderer, kind: Classification) -> None:
    """The picture of a ray that stays inside, by slabs of one thickness, on grids of 12 and 24 samples."""
    pictures = []
    for n in (12, 24):
        h = 12 / n
        position = (np.arange(n) + 0.5) * h - 6
        z, y, x = np.meshgrid(position, position, position, indexing="ij")
        volume = Volume((0.5 * x + 0.2 * y - 0.4 * z + 2.5).astype(np.float32), (h, h, h), (position[0],) * 3)
        medium = TransferFunction(np.array([-10.0, 10]), np.full((2, 3), 0.5), np.array([0, 0.3]))
        camera = Camera.perspective((1, 2, 0.5), (-3, 1, 0), (0, 0, 1), fov=10)
        scene = Scene(volume, medium, camera, classification=kind)
        pictures.append(renderer.render(scene, (7, 6), slab_thickness=0.31, texture_format="rgba32f"))
    # Only in the half samples at the wall do the grids differ, where the value stays behind by h/4 of its slope along x
    # on average, over h/2: 0.5 × 0.5 / 2 × 0.5 for h = 1, of τ' = 0.015; the rays are within 1.15 of that direction.
    wall = 1.15 * 0.5 * 0.5 / 2 * 0.5 * 0.015
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=wall)
    assert pictures[0].max() > 0.1


@kinds()
@rates
@pytest.mark.parametrize("alpha", [1e-7, 0.3, 0.999, 1.0])
def test_case_13_opacity_over_another_length(
    renderer: Renderer, kind: Classification, rate: float, alpha: float
) -> None:
    """Matter of opacity `alpha` per unit over 3 units: 1 stays 1, and 1e-7 does not vanish."""
    with np.errstate(divide="ignore"):
        tau = -np.log1p(-alpha)
        expected = -np.expm1(3 * np.log1p(-alpha))
    pixel = middle_ray(renderer, column(np.zeros(3)), even(tau, (1, 0.5, 0)), kind, rate)
    np.testing.assert_allclose(pixel, np.array([1, 0.5, 0, 1]) * expected, rtol=ROUNDING)
