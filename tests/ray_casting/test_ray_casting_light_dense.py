"""The oracle of lit scenes against a dense sum that follows the definitions word by word, on fields of every kind."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.ndimage import map_coordinates
from support.scenes import random_volume

from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.gradient import CENTRAL, Estimator, gradients
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume

SIZE = (4, 3)
SAMPLES = 40_000


def lines(values, numbers, at):
    """`numbers` (n, k), piecewise linear in the value, at values of any shape; a step's right side holds."""
    values, numbers = np.asarray(values, float), np.asarray(numbers, float)
    right = np.searchsorted(values, at, side="right")
    left, right = np.maximum(right - 1, 0), np.minimum(right, len(values) - 1)
    width = values[right] - values[left]
    fraction = np.where(width > 0, (at - values[left]) / np.where(width > 0, width, 1), 0)[..., None]
    return numbers[left] * (1 - fraction) + numbers[right] * fraction


def medium(transfer, v, m):
    """q (…, 3) and τ (…) of finite matter of value v and gradient magnitude m."""
    numbers = lines(transfer.values, np.column_stack([transfer.colors, transfer.extinctions]), v)
    q, tau = numbers[..., :3], numbers[..., 3]
    if not (transfer.emissive or transfer.premultiplied):
        q = q * tau[..., None]
    if transfer.modulation is not None:
        factor = np.interp(m, *np.transpose(transfer.modulation))
        q, tau = q * factor[..., None], tau * factor
    for each in transfer.graded:
        if each.start < each.full:
            weight = np.clip((m - each.start) / (each.full - each.start), 0, 1)
        else:
            weight = np.where(m >= each.full, 1.0, 0.0)
        weight = weight * ((v >= each.values[0]) & (v <= each.values[-1]))
        numbers = weight[..., None] * lines(each.values, np.column_stack([each.emissions, each.extinctions]), v)
        q, tau = q + numbers[..., :3], tau + numbers[..., 3]
    for each in transfer.contours:
        weight = np.maximum(0, 1 - np.abs(v - each.value) / np.maximum(each.thickness * m, 1e-300))
        q, tau = q + weight[..., None] * np.array(each.emission), tau + weight * each.extinction
    return q, tau


def normalised(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def shaded(lighting, volume, q, tau, g, position, to_eye):
    """q D + τ S at places (…, 3) of the world, g per world unit."""
    m = np.linalg.norm(g, axis=-1)
    x = np.clip(m / lighting.fade_for(volume), 0, 1)
    w = (3 * x**2 - 2 * x**3)[..., None]
    normal = -normalised(g)
    if lighting.two_sided:
        normal = np.where((normal * to_eye).sum(-1, keepdims=True) < 0, -normal, normal)
    diffuse, specular = np.zeros(q.shape), np.zeros(q.shape)
    for light in lighting.lights:
        if light.kind == "head":
            to_light = to_eye
        elif light.kind == "directional":
            to_light = np.broadcast_to(normalised(np.array(light.vector)), g.shape)
        else:
            to_light = normalised(np.array(light.vector) - position)
        cosine = (normal * to_light).sum(-1, keepdims=True)
        halfway = np.maximum((normal * normalised(to_light + to_eye)).sum(-1, keepdims=True), 0)
        color = np.array(light.color)
        diffuse += color * ((1 - w) + w * np.maximum(cosine, 0))
        specular += color * w * np.where(cosine > 0, halfway**lighting.shininess, 0)
    return q * (lighting.ambient + lighting.diffuse * diffuse) + tau[..., None] * lighting.specular * specular


def lit(scene, q, tau, g, position, to_eye):
    return q if scene.lighting is None else shaded(scene.lighting, scene.volume, q, tau, g, position, to_eye)


def interpolated(fields, points):
    """Trilinear in fields (…, k) on the grid, at index points (3, n); shape (n, k)."""
    fields = np.moveaxis(fields.reshape(*fields.shape[:3], -1), -1, 0)
    return np.stack([map_coordinates(f, points[::-1], order=1, mode="nearest") for f in fields], axis=-1)


def dense_sum(scene, size=SIZE, samples=SAMPLES, pixels=None):
    """The integral by the midpoint rule; of some pixels only, the others 0."""
    volume, transfer, camera = scene.volume, scene.transfer_function, scene.completed(size).camera
    v = volume.values.astype(float)
    g = gradients(volume, scene.gradient).astype(float) / volume.smallest_spacing
    index = np.stack(np.meshgrid(*map(np.arange, v.shape), indexing="ij"), axis=-1)[..., ::-1]
    positions = index @ volume.world_from_index.T + volume.origin
    sample_to_eye = normalised(np.array(camera.eye) - positions)
    if camera.projection == "orthographic":
        sample_to_eye = np.broadcast_to(-camera.forward, positions.shape)
    q, tau = medium(transfer, v, np.linalg.norm(g, axis=-1))
    classified = np.concatenate([lit(scene, q, tau, g, positions, sample_to_eye), tau[..., None]], axis=-1)
    eyes, directions = camera.rays(size)
    picture = np.zeros((size[1], size[0], 4))
    for pixel in pixels or np.ndindex(size[1], size[0]):
        eye, line_of_sight = eyes[pixel], directions[pixel]
        start, step = volume.index_from_world @ (eye - volume.origin), volume.index_from_world @ line_of_sight
        with np.errstate(divide="ignore"):
            ends = np.sort([(-0.5 - start) / step, (np.array(volume.dimensions) - 0.5 - start) / step], axis=0)
        enter, leave = max(ends[0].max(), 0), ends[1].min()
        if leave > enter:
            h = (leave - enter) / samples
            s = enter + (np.arange(samples) + 0.5) * h
            points = start[:, None] + s * step[:, None]
            if scene.classification in ("slab", "extinction"):
                numbers = interpolated(classified, points)
                q, tau = numbers[:, :3], numbers[:, 3]
            else:
                value, slope = interpolated(v, points)[:, 0], interpolated(g, points)
                q, tau = medium(transfer, value, np.linalg.norm(slope, axis=-1))
                q = lit(
                    scene, q, tau, slope, eye + s[:, None] * line_of_sight, np.broadcast_to(-line_of_sight, slope.shape)
                )
            if scene.depth_cue is not None:
                near, far = scene.depth_cue.range_for(volume, camera)
                t = scene.depth_cue.strength * np.clip(
                    (s * (line_of_sight @ camera.forward) - near) / (far - near), 0, 1
                )
                q = q * (1 - t)[:, None] + (tau * t)[:, None] * np.array(scene.depth_cue.color)
            depth = np.cumsum(tau) * h
            reached = np.exp(-(depth - tau * h / 2))
            picture[pixel] = np.append((q * reached[:, None]).sum(axis=0) * h, -np.expm1(-depth[-1]))
            picture[pixel][:3] += np.exp(-depth[-1]) * np.array(scene.background)
        else:
            picture[pixel][:3] = scene.background
    return picture


def ball(samples=12, **position):
    """A soft ball, off the middle: no gradient is square to anything, but for the rim."""
    z, y, x = np.meshgrid(*[(np.arange(samples) + 0.5) / samples * 2 - 1] * 3, indexing="ij")
    return Volume(np.exp(-2 * ((x - 0.11) ** 2 + (y + 0.07) ** 2 + (z - 0.05) ** 2)), **position)


SHEARED = {"spacing": (0.3, 0.5, 0.4), "origin": (4, 5, 6), "direction": [[-1, 0.5, 0], [0.1, 1, 0.4], [0, 0, 1.0]]}
VOLUMES = {"ball": ball(), "sheared ball": ball(**SHEARED), "noise": random_volume(3, (5, 4, 6))}
COLORS = [[0.9, 0.2, 0.1], [0.1, 0.8, 0.3], [0.3, 0.3, 1.0], [1, 1, 0.4]]
SOFT = TransferFunction([0.1, 0.4, 0.7, 1.0], COLORS, [0, 0.6, 0.2, 1.5])
MIXED = TransferFunction([0.1, 0.4, 0.7, 1.0], np.multiply(COLORS, 2), [0.1, 0.6, 2.0, 1.5], premultiplied=True)
MODULATED = TransferFunction(
    [0.1, 0.4, 0.7, 1.0], COLORS, [0, 1.6, 0.2, 2.5], modulation=np.array([[0.05, 0], [0.2, 1.5], [0.6, 0.4]])
)
GRADED = TransferFunction(
    [0],
    [[0.5, 0.5, 0.5]],
    [0.05],
    graded=(
        Graded(np.array([0.2, 0.5, 0.9]), np.multiply(COLORS[:3], 0.9), np.array([1.5, 0.1, 0.8]), 0.05, 0.5),
        Graded(np.array([0.3, 0.6]), np.array(COLORS[2:]), np.array([1, 1]), 0.1, 0.11),
    ),
)
CONTOURS = TransferFunction(
    [0],
    [[0, 0, 0]],
    [0],
    contours=(Contour(0.5, 0.9, (1.0, 0.5, 0.2), 1.5), Contour(0.8, 0.25, (0.1, 0.2, 0.9), 4.0)),
)
GAS = TransferFunction([0.2, 0.5, 0.9], [[0, 1, 3], [2, 0, 0], [0.5, 0.5, 4]], [0, 1.5, 0.2], emissive=True)
MEDIUM = {"soft": SOFT, "mixed": MIXED, "modulated": MODULATED, "graded": GRADED, "contours": CONTOURS}
HEAD = Lighting(shininess=20.0)
ONE_SIDED = Lighting((Light("directional", (1.0, 2, -0.5), (0.9, 0.5, 0.3)),), 0.2, 0.8, 0.5, 3.0, two_sided=False)
SEVERAL = Lighting(
    (Light(), Light("directional", (1.0, 2, -0.5), (0.5, 0.9, 0.3)), Light("point", (3.0, 2, 9), (0.2, 0.3, 2))),
    **{"ambient": 0.1, "diffuse": 0.5, "specular": 0.4, "shininess": 8.0, "fade": 0.3},
)
LIGHTING = {"head": HEAD, "one-sided": ONE_SIDED, "several": SEVERAL}
CUE = DepthCue(0.7, (0.1, 0.2, 0.4))


# A dense sum has steps of h = path / samples, some 20 / 40000. A jump of J in the emission adds up to h J / 2, with J
# up to 1: 2.5e-4. A kink adds h² J' / 8, some hundred of them with J' up to 3, each with its own sign: 1e-8.
JUMPS, SMOOTH = 2.5e-4, 1e-8


def agree(scene, tolerance=SMOOTH):
    got, wanted = raycast(scene, SIZE), dense_sum(scene)
    assert wanted[..., 3].max() > 0.1
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


def jumps(scene):
    """Whether what is seen jumps, where a surface turns to another side of eye or light, or graded matter ends."""
    if scene.classification in ("slab", "extinction"):
        return False
    aside = scene.lighting is not None and any(light.kind != "head" for light in scene.lighting.lights)
    return aside or bool(scene.transfer_function.graded)


@pytest.mark.parametrize("classification", ["slab", "post"])
@pytest.mark.parametrize("light", [None, *LIGHTING])
@pytest.mark.parametrize("kind", MEDIUM)
def test_matter_under_light(kind, light, classification):
    volume = VOLUMES["sheared ball"]
    camera = Camera.framing(volume, "perspective" if light == "several" else "orthographic")
    cue = None if light == "head" else CUE
    scene = Scene(volume, MEDIUM[kind], camera, (0.1, 0.2, 0.3), classification, LIGHTING.get(light), depth_cue=cue)
    agree(scene, JUMPS if jumps(scene) else SMOOTH)


@pytest.mark.parametrize("classification", ["extinction", "integrated"])
@pytest.mark.parametrize("estimator", [Estimator("zucker-hummel"), Estimator("gaussian", 0.8)], ids=lambda e: e.kind)
def test_other_estimators_and_classifications(estimator, classification):
    volume = VOLUMES["noise"]
    camera = Camera.perspective(volume.centre + (0.5, 0.3, 0.1), volume.centre - (1, 2, 0.3), (0, 0, 1), 60)  # inside
    agree(Scene(volume, MODULATED, camera, (0, 0, 0), classification, HEAD, estimator))


@pytest.mark.parametrize("kind", ["graded", "contours"])
@pytest.mark.parametrize("classification", ["slab", "post"])
def test_matter_on_gradients_without_light(kind, classification):
    scene = Scene(VOLUMES["noise"], MEDIUM[kind], classification=classification)
    agree(scene, JUMPS if jumps(scene) else SMOOTH)


@pytest.mark.parametrize("classification", ["slab", "post"])
def test_a_gas_under_a_depth_cue(classification):
    agree(Scene(VOLUMES["noise"], GAS, classification=classification, depth_cue=CUE))


def test_a_highlight_that_shows_for_a_thousandth_of_a_cell():
    # One-sided and of exponent 1/2: on this ray, between the places where N·L and N·H pass 0, where no node need be.
    volume, pixel = random_volume(3, (12, 14, 13)), (17, 15)
    lighting = Lighting((Light("directional", (1.0, 2, -0.5)),), 0.3, 0.7, 1.0, 0.5, two_sided=False, fade=1e-3)
    camera = Camera.framing(volume, "perspective")
    scene = Scene(volume, SOFT, camera, (0, 0, 0), "post", lighting)
    wanted = dense_sum(scene, (24, 24), 400_000, [pixel])[pixel]
    # Steps a tenth of those above; without a cut there, 1.3e-4 is missed.
    np.testing.assert_allclose(raycast(scene, (24, 24))[pixel], wanted, rtol=0, atol=JUMPS / 10)


@pytest.mark.parametrize(
    ("aside", "diffuse", "specular", "shininess"),
    [(1e-2, 1, 0, 1), (1e-4, 1, 0, 1), (1e-6, 1, 0, 1), (1e-4, 1, 1, 1), (1.0, 0, 1, 1e5)],
)
def test_a_normal_that_turns_in_no_time(aside, diffuse, specular, shininess):
    # Where z is 0.13, g goes from -z to z within a distance of about `aside`; x alone says over which side.
    # The exponent 1e5 makes a highlight of 1/300 rad, while the normal turns by some tenths within a cell.
    z, _, x = np.meshgrid(*[np.arange(n) - (n - 1) / 2 for n in (8, 3, 3)], indexing="ij")
    volume = Volume(2 * (z - 0.13) ** 2 - aside * x)  # off the middle of a cell, where a node is
    lighting = Lighting(
        (Light("directional", (1.0, 0, 0)),), 0, diffuse, specular, shininess, two_sided=False, fade=0.0
    )
    camera = Camera.orthographic(volume.centre - (0, 0, 9), volume.centre, (0, 1, 0), 1)
    scene = Scene(volume, TransferFunction([0], [[1, 1, 1]], [0.1]), camera, (0, 0, 0), "post", lighting)
    heights, slopes = z[:, 1, 1], gradients(volume, CENTRAL)[:, 1, 1, 2].astype(float)

    def glow(z):
        # N = -g / |g| = (aside, 0, -g_z) / |g|, V = -z, L = x, and halfway is (1, 0, -1) / √2.
        g_z = np.interp(z, heights, slopes)
        m = np.hypot(aside, g_z)
        shine = max((aside + g_z) / m / np.sqrt(2), 0) ** shininess
        return 0.1 * np.exp(-0.1 * (z + 4)) * (diffuse * aside / m + specular * shine)

    near = 10.0 ** np.arange(min(np.log10(aside), -3), 0)  # a cut for every power of ten, so that quad sees it
    positions = 0.13 + aside / 4 * np.array([-1, 0, 1])
    cuts = sorted({-4, 4, *positions, *(positions[:, None] + near).flat, *(positions[:, None] - near).flat, *heights})
    wanted = sum(quad(glow, a, b, epsabs=1e-13, epsrel=1e-12)[0] for a, b in pairwise(cuts))
    assert raycast(scene, (1, 1))[0, 0, 0] == pytest.approx(wanted, abs=1e-9)
