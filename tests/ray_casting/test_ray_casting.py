"""The oracle against closed forms: fields that trilinear filtering represents exactly, so any error is integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from support import closed_forms as known

from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.looks import look_for
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

BOTH = pytest.mark.parametrize("classification", ["extinction", "post"])
# Some hundred pieces of a few ulps (2e-16) each, and ray positions to 1e-14 of a cell: 1e-12 leaves room.
EXACT = {"rtol": 1e-12, "atol": 1e-14}


def uniform(extinction, color=(0.9, 0.5, 0.1), emissive=False):
    return TransferFunction([0], [color], [extinction], emissive=emissive)


def ramp_volume(n=9, spacing=(1.0, 1.0, 1.0), across=3):
    """Value k at sample k along z."""
    return Volume(np.broadcast_to(np.arange(float(n))[:, None, None], (n, across, across)), spacing)


def along_z(volume, height=None, from_below=True):
    """Camera whose pixels are the sample columns, where the size is the dimensions and height that of the box."""
    depth = np.array([0, 0, 2.0 * volume.box_edges[2, 2] * (1 if from_below else -1)])
    height = volume.box_edges[1, 1] if height is None else height
    return Camera.orthographic(volume.centre - depth, volume.centre, (0, 1, 0), height)


def middle_ray(volume, transfer, classification, from_below=True, **options):
    """rgba of the one ray through the middle of the box, along z."""
    camera = along_z(volume, from_below=from_below)
    return raycast(Scene(volume, transfer, camera, classification=classification, **options), (1, 1))[0, 0]


def box_path(volume, camera, size):
    """Length of each ray inside the box: slabs, in the coordinates of the box (own arithmetic, no cells)."""
    eyes, directions = camera.rays(size)
    inverse = np.linalg.inv(volume.box_edges)
    start, step = (eyes - volume.box_corner) @ inverse.T, directions @ inverse.T
    with np.errstate(divide="ignore"):
        crossings = np.stack([(0 - start) / step, (1 - start) / step])
    enter = np.maximum(crossings.min(axis=0).max(axis=-1), 0)
    return np.maximum(crossings.max(axis=0).min(axis=-1) - enter, 0)


CAMERAS = {
    "orthographic": lambda v: Camera.framing(v, "orthographic"),
    "perspective": lambda v: Camera.framing(v, "perspective", fov=60),
    "eye inside": lambda v: Camera.perspective(
        v.centre + 0.1 * v.box_edges.sum(axis=1), v.centre - v.box_edges[:, 0], (0.1, 0.2, 1), fov=90
    ),
    "eye inside, orthographic": lambda v: Camera.orthographic(
        v.centre, v.centre + v.box_edges[:, 1], v.box_edges[:, 2], height=v.radius
    ),
    "along x": lambda v: Camera.framing(v, eye=v.centre - (2 * v.radius, 0, 0), up=(0, 0, 1)),
    "1e-7 rad beside x": lambda v: Camera.framing(
        v, eye=v.centre - v.radius * np.array([2, 2e-7, -1e-7]), up=(0, 0, 1)
    ),
    "along a diagonal": lambda v: Camera.framing(v, eye=v.centre - v.box_edges.sum(axis=1), up=(0, 0, 1)),
}
VOLUMES = {
    "plain": lambda s: Volume(np.zeros((5, 6, 7), np.uint8)),
    "anisotropic": lambda s: Volume(np.zeros((4, 5, 6), np.uint8), (1, 1, 20)),
    "sheared, left-handed": lambda s: Volume(
        np.zeros((4, 5, 6), np.uint8), (1, 2, 3), (5, 6, 7), [[-1, 0.4, 0], [0.2, 1, 0.3], [0, 0, 1]]
    ),
    "one voxel": lambda s: Volume(np.zeros((1, 1, 1), np.uint8)),
    "a needle": lambda s: Volume(np.zeros((40, 1, 1), np.uint8)),
    "a plank": lambda s: Volume(np.zeros((3, 3, 2000), np.uint8)),
    "tiny world": lambda s: Volume(np.zeros((4, 5, 6), np.uint8), (1e-9, 1e-9, 2e-9)),
    "huge world": lambda s: Volume(np.zeros((4, 5, 6), np.uint8), (1e9, 1e9, 2e9)),
    "far away": lambda s: Volume(np.zeros((4, 5, 6), np.uint8), origin=(1e7, -1e7, 3e7)),
}


@BOTH
@pytest.mark.parametrize("view", CAMERAS)
@pytest.mark.parametrize("shape", VOLUMES)
def test_a_constant_medium_is_its_chord(shape, view, classification):
    volume = VOLUMES[shape](None)
    camera, size = CAMERAS[view](volume), (7, 9)
    extinction = 1.3 / volume.radius
    path = box_path(volume, camera, size)
    assert (path > 0).any()
    background = np.array([0.2, 0.3, 0.4])
    picture = raycast(Scene(volume, uniform(extinction), camera, tuple(background), classification), size)
    alpha = known.opacity(extinction * path)
    # A coordinate of 3e7 is known to 4e-9, so far away a chord of some 10 cannot be told better than 1e-9 of it.
    tolerance = 3e-9 if shape == "far away" else 1e-11
    np.testing.assert_allclose(picture[..., 3], alpha, rtol=0, atol=tolerance)
    expected = alpha[..., None] * [0.9, 0.5, 0.1] + (1 - alpha[..., None]) * background
    np.testing.assert_allclose(picture[..., :3], expected, rtol=0, atol=tolerance)


@BOTH
def test_an_eye_far_away_costs_no_digits_of_a_chord(classification):
    # At s = 1e8 an ulp is 1.5e-8: a length taken as a difference there would be off by that.
    volume = Volume(np.zeros((4, 4, 4)), (0.3, 0.3, 0.3))
    camera = Camera.orthographic(volume.centre + np.array([0, 0, 1e8 / 3]), volume.centre, (0, 1, 0), 1)
    picture = raycast(Scene(volume, uniform(0.3), camera, classification=classification), (3, 3))
    np.testing.assert_allclose(picture[..., 3], known.opacity(0.3 * 1.2), rtol=1e-13)


@BOTH
@pytest.mark.parametrize("depth", [0.0, 1e-30, 1e-12, 1e-8, 1e-3, 1.0, 50.0, 1e4, 1e12])
def test_emission_in_constant_extinction(depth, classification):
    volume = Volume(np.zeros((5, 3, 3), np.float64), (1, 1, 0.25))
    length = 5 * 0.25
    pixel = middle_ray(volume, uniform(depth / length, (3, 2, 1), emissive=True), classification)
    np.testing.assert_allclose(pixel[:3], known.constant_medium([3, 2, 1], depth / length, length), rtol=1e-12)
    np.testing.assert_allclose(pixel[3], known.opacity(depth), rtol=1e-12, atol=0)


@BOTH
@pytest.mark.parametrize("depth", [1e-30, 1e-12, 1e-3, 1.0, 50.0, 1e12])
def test_matter_shows_its_own_colour_however_deep(depth, classification):
    volume = Volume(np.zeros((4, 3, 3), np.int16))
    pixel = middle_ray(volume, uniform(depth / 4), classification)
    np.testing.assert_allclose(pixel, np.array([0.9, 0.5, 0.1, 1]) * known.opacity(depth), rtol=1e-12, atol=0)


@BOTH
@pytest.mark.parametrize("a, b", [(0, 2.0), (2.0, 0), (1e-9, 3e-9), (1e5, 0), (0, 1e5)])
def test_linear_extinction_and_constant_colour(a, b, classification):
    volume = ramp_volume(9, (1, 1, 0.5))
    transfer = TransferFunction([0, 8], [[0.7] * 3] * 2, [a, b])
    alpha = known.opacity((a + b) / 2 * 4 + (a + b) * 0.25)  # eight cells, and half a spacing of a and of b
    np.testing.assert_allclose(middle_ray(volume, transfer, classification), np.array([0.7] * 3 + [1]) * alpha, **EXACT)


@pytest.mark.parametrize("a, b", [(0.1, 2.0), (2.0, 0.1), (0, 7.0), (7.0, 0), (0.5, 0.5), (300, 1), (1, 300)])
def test_linear_extinction_and_colour(a, b):
    front, back = np.array([1, 0.2, 0]), np.array([0.1, 0.6, 1])
    transfer = TransferFunction([0, 8], [front, back], [a, b])
    layers = [known.layer(front, a, 0.5), known.ramp(front, back, a, b, 8.0), known.layer(back, b, 0.5)]
    expected = known.over(layers[0], known.over(layers[1], layers[2]))
    # The closed form is a difference of numbers near 1 where a - b is small against τ: 1e-11.
    np.testing.assert_allclose(middle_ray(ramp_volume(), transfer, "post"), expected, rtol=1e-10, atol=1e-11)


@BOTH
@pytest.mark.parametrize("a, b", [(0.1, 2.0), (2.0, 0.1), (0, 30.0), (30.0, 0)])
def test_constant_emission_in_linear_extinction(a, b, classification):
    transfer = TransferFunction([0, 8], [[3] * 3] * 2, [a, b], emissive=True)
    light, reached = 0.0, 1.0
    for mean, depth, length in (
        (known.mean_transmittance(a / 2), a / 2, 0.5),
        (known.mean_transmittance_of_ramp(a, b, 8.0), 4 * (a + b), 8.0),
        (known.mean_transmittance(b / 2), b / 2, 0.5),
    ):
        light, reached = light + reached * 3 * length * mean, reached * np.exp(-depth)
    pixel = middle_ray(ramp_volume(), transfer, classification)
    np.testing.assert_allclose(pixel, [light] * 3 + [1 - reached], rtol=1e-11)


@BOTH
def test_linear_emission_in_constant_extinction(classification):
    transfer = TransferFunction([0, 8], [[1, 0, 4], [5, 2, 0]], [0.3, 0.3], emissive=True)
    expected = []
    for front, back in ((1, 5), (0, 2), (4, 0)):
        near, far = known.constant_medium([front, back], 0.3, 0.5)
        expected.append(near + np.exp(-0.15) * (known.emission_ramp(front, back, 0.3, 8) + np.exp(-2.4) * far))
    np.testing.assert_allclose(middle_ray(ramp_volume(), transfer, classification)[:3], expected, rtol=1e-12)


@BOTH
def test_two_layers_differ_by_their_colours_from_the_two_ends(classification):
    # Samples 0, 0, 1, 1: between the layers τ and c τ go linearly from one to the other. Same τ: exact for both.
    volume = Volume(np.repeat([0.0, 0, 1, 1], 9).reshape(4, 3, 3))
    first, second = np.array([1, 0.2, 0]), np.array([0.1, 0.6, 1])
    tau = 0.4
    transfer = TransferFunction([0, 1], [first, second], [tau, tau])
    middle = known.ramp(first, second, tau, tau, 1.0)
    front, back = known.layer(first, tau, 1.5), known.layer(second, tau, 1.5)
    pixel = middle_ray(volume, transfer, classification)
    np.testing.assert_allclose(pixel, known.over(front, known.over(middle, back)), **EXACT)
    reverse = middle_ray(volume, transfer, classification, from_below=False)
    np.testing.assert_allclose(reverse[3], pixel[3], **EXACT)


def test_a_step_splits_a_cell_into_two_layers_exactly():
    first, second = np.array([1, 0.2, 0]), np.array([0.1, 0.6, 1])
    transfer = TransferFunction([0, 3.3, 3.3, 8], [first, first, second, second], [0.2, 0.2, 0.9, 0.9])
    volume = ramp_volume()
    front, back = known.layer(first, 0.2, 3.8), known.layer(second, 0.9, 5.2)  # the box begins at -1/2
    pixel = middle_ray(volume, transfer, "post")
    np.testing.assert_allclose(pixel, known.over(front, back), **EXACT)
    reverse = middle_ray(volume, transfer, "post", from_below=False)
    np.testing.assert_allclose(reverse, known.over(back, front), **EXACT)
    np.testing.assert_allclose((pixel - reverse)[:3], (first - second) * front[3] * back[3], **EXACT)
    assert pixel[3] == pytest.approx(reverse[3], rel=1e-14)


@pytest.mark.parametrize("width", [2.0, 1e-3, 1e-9])
def test_a_spike_in_the_transfer_function_is_not_missed(width):
    # A triangle of height 1/width above the value 4.3: its depth is 1/2 however narrow, sampled or not.
    points = [4.3 - width / 2, 4.3, 4.3 + width / 2]
    transfer = TransferFunction(points, [[1] * 3] * 3, [0, 1 / width, 0])
    # The control points are known to an ulp of 4.3, 9e-16; so is the width.
    np.testing.assert_allclose(
        middle_ray(ramp_volume(), transfer, "post"), known.opacity([0.5] * 4), rtol=4e-15 / width + 1e-12
    )


def test_a_transfer_function_of_many_points_is_that_of_few():
    few = TransferFunction([0, 8], [[1, 0, 0], [0, 0, 1]], [0.1, 0.5])
    values = np.linspace(0, 8, 1001)
    fraction = values[:, None] / 8
    many = TransferFunction(values, (1 - fraction) * [1, 0, 0] + fraction * [0, 0, 1], 0.1 + 0.05 * values)
    volume = ramp_volume()
    np.testing.assert_allclose(middle_ray(volume, many, "post"), middle_ray(volume, few, "post"), **EXACT)


@BOTH
def test_a_preintegrated_pair(classification):
    # Case 10: from value 2 to 5 over d: α = -expm1(-d (S(5) - S(2)) / 3), S the integral of τ; τ = 0.2 v here.
    volume = Volume(np.repeat([2.0, 5.0], 9).reshape(2, 3, 3), (1, 1, 4))
    transfer = TransferFunction([0, 10], [[1] * 3] * 2, [0, 2])
    inside = 4 * 0.1 * (5**2 - 2**2) / 3
    alpha = known.opacity(inside + 2 * 0.4 + 2 * 1.0)
    np.testing.assert_allclose(middle_ray(volume, transfer, classification), [alpha] * 4, **EXACT)


@pytest.mark.parametrize("field", ["exponential", "gaussian", "sinusoid", "fading emission"])
def test_smooth_fields_are_met_with_order_two_as_the_grid_refines(field):
    # Trilinear filtering is off by h² f''/8 at most; nothing else may be. Samples at cell middles fill the box [0, 2].
    errors = []
    for n in (64, 128):
        z = (np.arange(n) + 0.5) * 2 / n
        values, expected, transfer = smooth_case(field, z)
        volume = Volume(np.repeat(values, 9).reshape(n, 3, 3), (1, 1, 2 / n))
        pixel = middle_ray(volume, transfer, "extinction")
        errors.append(abs((pixel[0] if field == "fading emission" else pixel[3]) - expected))
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2


def smooth_case(field, z):
    identity = TransferFunction([0, 10], [[1] * 3] * 2, [0, 10])
    if field == "exponential":
        return 3 * np.exp(-1.5 * z), known.opacity(known.exponential_depth(3, 1.5, 2)), identity
    if field == "gaussian":
        depth = known.gaussian_depth(3, 0.6, 0, -0.7, 1.3)
        return 3 * np.exp(-((z - 0.7) ** 2) / (2 * 0.6**2)), known.opacity(depth), identity
    if field == "sinusoid":
        return 2 * (1 + 0.8 * np.sin(2.5 * z)), known.opacity(known.sinusoid_depth(2, 0.8, 2.5, 0, 2)), identity
    emissive = TransferFunction([0, 10], [[0] * 3, [10] * 3], [0.7, 0.7], emissive=True)
    return 3 * np.exp(-1.5 * z), known.fading_emission(3, 1.5, 0.7, 2), emissive


def test_a_ball_and_a_shell_on_columns_where_the_grid_hits_them():
    # r² is filtered exactly along a column at samples (x, y), where its sphere lies on a sample:
    # 3² + 4² = 5²; 1 + 7² = 50, 1 + 8² = 65; 7² + 1 = 50, 7² + 4² = 65.
    axis = np.arange(-12.0, 13.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    volume = Volume(x * x + y * y + z * z)
    tau = 0.13
    ball = TransferFunction([25, 25], [[1] * 3] * 2, [tau, 0])
    shell = TransferFunction([50, 50, 65, 65], [[1] * 3] * 4, [0, tau, tau, 0])
    row = 12  # y = 0
    pictures = [raycast(Scene(volume, t, along_z(volume), classification="post"), (25, 25)) for t in (ball, shell)]
    for b in (0, 3, 4):
        expected = known.opacity(tau * known.ball_chord(5, b))
        np.testing.assert_allclose(pictures[0][row, 12 + b], [expected] * 4, **EXACT)
    for b in (1, 7):
        expected = known.opacity(tau * known.shell_chord(np.sqrt(50), np.sqrt(65), b))
        np.testing.assert_allclose(pictures[1][row, 12 - b], [expected] * 4, **EXACT)


def test_the_mean_opacity_of_a_ball():
    # 65³ samples of r²: the sphere is off by h²/8 in r² at most, pixels sample the disc finely: 2e-3 of the mean.
    axis = np.linspace(-1.1, 1.1, 65)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    volume = Volume((x * x + y * y + z * z).astype(np.float32), [axis[1] - axis[0]] * 3, [-1.1] * 3)
    ball = TransferFunction([1, 1], [[1] * 3] * 2, [1.5, 0])
    height = 2.2
    picture = raycast(Scene(volume, ball, along_z(volume, height), classification="post"), (110, 110))
    mean = picture[..., 3].sum() * (height / 110) ** 2 / np.pi
    assert mean == pytest.approx(known.ball_mean_opacity(1.5), rel=2e-3)


@BOTH
def test_a_linear_field_does_not_depend_on_its_grid(classification):
    # The same linear field and the same box on two grids; trilinear filtering has it exactly, but for the flat outer
    # half spacings, which a transfer function that is empty beyond [1, 5] hides from the post-classified.
    transfer = TransferFunction([1, 1, 5, 5], [[1, 0.5, 0.1]] * 4, [0, 0.3, 0.3, 0])
    if classification == "extinction":
        transfer = TransferFunction([-10, 10], [[1, 0.5, 0.1]] * 2, [0, 0.3])
    pictures = []
    for n in (12, 24):
        h = 12 / n
        position = (np.arange(n) + 0.5) * h - 6
        z, y, x = np.meshgrid(position, position, position, indexing="ij")
        volume = Volume(0.5 * x + 0.2 * y - 0.4 * z + 2.5, (h, h, h), (position[0],) * 3)
        camera = Camera.perspective((1, 2, 0.5), (-3, 1, 0), (0, 0, 1), fov=10)  # sees 5 units, then the wall
        pictures.append(raycast(Scene(volume, transfer, camera, classification=classification), (7, 6)))
    # The wall's half spacing is where the grids differ: at most gradient * h/2 * τ' over h/2, and only there.
    tolerance = 1e-12 if classification == "post" else 0.67 * 0.5 * 0.015 * 0.5
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=tolerance)


@BOTH
@pytest.mark.parametrize("alpha", [1e-7, 0.3, 1.0])
def test_opacity_over_another_length(alpha, classification):
    # Case 13: matter of opacity `alpha` per unit over 3 units; 1 stays 1, 1e-7 does not vanish.
    with np.errstate(divide="ignore"):
        tau = -np.log1p(-alpha)
        expected = -np.expm1(3 * np.log1p(-alpha))
    pixel = middle_ray(Volume(np.zeros((3, 2, 2), np.uint8)), uniform(tau, (1, 0.5, 0)), classification)
    np.testing.assert_allclose(pixel, np.array([1, 0.5, 0, 1]) * expected, rtol=1e-13)


def test_the_ramp_formulas_agree_with_quadrature():
    for a, b, length in ((0.1, 2.0, 3.0), (2.0, 0.1, 3.0), (5.0, 0.0, 1.0)):
        mean = quad(lambda s, a=a, b=b, d=length: np.exp(-a * s - (b - a) * s * s / (2 * d)) / d, 0, length)[0]
        assert known.mean_transmittance_of_ramp(a, b, length) == pytest.approx(mean, rel=1e-11)


@pytest.mark.parametrize("size", [(0, 4), (4, 0), (-1, 4)])
def test_a_picture_without_pixels_is_refused(size):
    with pytest.raises(InputError, match="at least one pixel"):
        raycast(Scene(ramp_volume(), uniform(1.0), classification="slab"), size)


def test_a_scene_without_transfer_function_takes_the_look_of_its_data():
    volume = ramp_volume()
    proposed = raycast(Scene(volume, look_for(volume), classification="slab"), (5, 5))
    np.testing.assert_array_equal(raycast(Scene(volume, classification="slab"), (5, 5)), proposed)
