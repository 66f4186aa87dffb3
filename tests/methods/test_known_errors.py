"""The error that each method is known for, and what removes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.method_scenes import OBLIQUE, bump, errors, fog, rms, seen_along, truth
from support.scenes import constant

from texvol.methods import draw, method_of
from texvol.methods.run_lengths import encoded
from texvol.methods.volume_transformation import passes, ways
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume


def spread(name: str, view: tuple[float, float, float]) -> float:
    """Mean squared distance, spacings², of the picture of one sample from its middle; 1/3 for trilinear tents."""
    values = np.zeros((9, 9, 9))
    values[4, 4, 4] = 1
    thin = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.01]))
    scene = Scene(Volume(values), thin, seen_along(Volume(values), view, height=6.0))
    picture = draw(name, scene, (60, 60))[..., 3]
    y, x = (np.mgrid[:60, :60] - 29.5) / 10
    return float(((x**2 + y**2) * picture).sum() / picture.sum())


def test_splatting_spreads_a_sample_by_its_gaussian() -> None:
    # Two axes of sigma² each; the table ends at 4 sigma, and takes 1e-3 of it away.
    for view in ((0, 1, 0), OBLIQUE):
        assert spread("splatting", view) == pytest.approx(2 * 0.65**2, rel=5e-3)


def test_shear_warp_and_volume_transformation_blur_oblique_views() -> None:
    """Bilinear in a slice and in the warp, or linear three times: more than trilinear. Along an axis all are that."""
    for name in ("shear-warp", "volume-transformation"):
        assert spread(name, (0, 1, 0)) == pytest.approx(1 / 3, abs=4e-3)
    warped, transformed = (spread(name, OBLIQUE) for name in ("shear-warp", "volume-transformation"))
    assert spread("v-buffer", OBLIQUE) < 0.36 < 0.39 < transformed < 0.45 < 0.48 < warped < 0.55


def test_splatting_bleeds_over_the_box_and_a_narrow_footprint_shows_the_grid() -> None:
    volume = Volume(np.zeros((20, 20, 20)))
    scene = Scene(volume, constant(0.05), seen_along(volume, (0, 1, 0), height=24.0))
    picture, exact = draw("splatting", scene, (96, 96))[..., 3], truth("splatting", scene, (96, 96))[..., 3]
    beside = (48, 7)  # 1/8 of a spacing outside the box: of depth 1, the Gaussian's integral from there on is 0.42
    assert exact[beside] == 0 and picture[beside] == pytest.approx(-np.expm1(-0.42), abs=0.02)
    flat = np.s_[24:72, 24:72]
    ripple = {sigma: np.ptp(draw("splatting", scene, (96, 96), sigma=sigma)[flat][..., 3]) for sigma in (0.4, 0.65)}
    # Depth 1 varies by ±4 e^(-2 π² sigma²), opacity by e^-1 of it; 1e-3 more for the table.
    assert ripple[0.65] < 2.5e-3
    assert 0.06 < ripple[0.4] < 0.13
    assert np.abs(picture[flat] - exact[flat]).max() < 1.5e-3


def test_shear_warp_samples_a_ray_once_per_slice() -> None:
    """A wave along x, seen along an axis and at 45°: slices are as far apart on the ray as its direction makes them."""
    x = np.arange(24)
    wave = Volume(np.broadcast_to((1 - np.cos(x * np.pi / 4)) / 2, (24, 24, 24)))
    found = []
    for view in ((1, 0.001, 0), (1, 1, 0.001)):
        camera = replace(seen_along(wave, view), height=6.0)
        found.append(rms(errors("shear-warp", Scene(wave, constant(0.1), camera), (24, 24))))
        tent = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.3]))
        found.append(rms(errors("shear-warp", Scene(wave, tent, camera), (24, 24))))
    assert found[0] < 1e-5 and found[2] < 2e-2
    assert found[3] > 2 * found[1]


@pytest.mark.parametrize("least, stored", [(1e-6, 0.3), (0.0, 0.3)])
def test_shear_warp_stores_what_shows_once_per_axis(least: float, stored: float) -> None:
    volume = bump(24)
    steep = TransferFunction(np.array([0.5, 0.7]), np.ones((2, 3)), np.array([0.0, 40.0]))
    scene = Scene(volume, steep, seen_along(volume, OBLIQUE)).completed((40, 30))
    method = method_of("shear-warp")(scene, least_opacity=least)
    assert method.memory < 3 * 24**3 * 16 * stored
    np.testing.assert_allclose(method.picture(scene.camera, (40, 30)), draw("shear-warp", scene, (40, 30)), atol=1e-4)


def test_runs_hold_every_sample_that_shows_with_its_neighbours() -> None:
    random = np.random.default_rng(3)
    seen = random.random((4, 5, 9)) > 0.8
    samples = np.where(seen[..., np.newaxis], random.random((4, 5, 9, 4)), 0).astype(np.float32)
    for axis in range(3):
        first, runs, media = encoded(samples, seen, axis)
        lines = np.moveaxis(samples, 2 - axis, 0)  # remaining axes in order z, y, x: the last is the scanline
        lines = lines.reshape(-1, lines.shape[2], 4)
        padded = np.pad(lines, ((0, 0), (1, 1), (0, 0)), mode="edge")
        found = np.zeros_like(padded)
        for line in range(len(lines)):
            for begin, end, place in runs[first[line] : first[line + 1]]:
                found[line, begin + 1 : end + 2] = media[place : place + end - begin + 1]
        np.testing.assert_array_equal(found, padded)
        assert first[-1] == len(runs)


def test_the_v_buffer_has_the_error_of_its_samples_only() -> None:
    scene = Scene(bump(12), fog(), seen_along(bump(12), OBLIQUE))
    found = [rms(errors("v-buffer", scene, sampling_rate=rate, least_transmittance=0.0)) for rate in (2, 4, 8)]
    assert 1.7 < np.log2(found[0] / found[2]) / 2 < 2.3
    step = TransferFunction(np.array([0.0, 0.4, 0.4, 1.0]), np.ones((4, 3)), np.array([0.0, 0.0, 20.0, 20.0]))
    found = [
        rms(errors("v-buffer", replace(scene, transfer_function=step), sampling_rate=rate, least_transmittance=0.0))
        for rate in (2, 16)
    ]
    assert 0.7 < np.log2(found[0] / found[1]) / 3 < 1.6  # a step is met by samples only


def test_coherent_projection_is_exact_where_the_medium_is_linear() -> None:
    z, y, x = np.mgrid[:9, :8, :7]
    linear = Volume(x + 2.0 * y + 3 * z, (1.0, 0.7, 1.3))
    ramp = TransferFunction(np.array([0.0, 44.0]), np.ones((2, 3)), np.array([0.0, 1.0]))
    found = np.abs(
        errors("coherent-projection", Scene(linear, ramp, seen_along(linear, OBLIQUE)), least_transmittance=0.0)
    )
    assert found[..., 3].max() < 1e-6  # the mean of both ends is the mean
    noise = Volume(np.random.default_rng(1).random((9, 8, 7)) * 44)
    found = np.abs(
        errors("coherent-projection", Scene(noise, ramp, seen_along(noise, OBLIQUE)), least_transmittance=0.0)
    )
    assert 1e-3 < found[..., 3].max() < 0.1


def test_three_passes_are_the_affine_map_and_the_best_of_36_ways_shrinks_least() -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        order = ways(turn)
        assert len(order) == 36
        targets, sources = order[0]
        matrix, base = turn[np.ix_(sources, targets)], random.normal(size=3)
        to_x, to_y, to_z = passes(matrix, base)
        a, b, c = random.normal(size=3)
        z = to_z @ (a, b, c, 1)
        y = to_y @ (a, b, z, 1)
        x = to_x @ (a, y, z, 1)
        np.testing.assert_allclose((x, y, z), matrix @ (a, b, c) + base, atol=1e-9)
        # The product of the scales is 1; a pass of a rotation's best way shrinks by less than 1.5.
        assert max(abs(to_x[0]), abs(to_y[1]), abs(to_z[2])) < 1.5


def test_more_planes_leave_the_blur_of_a_volume_transformation() -> None:
    scene = Scene(bump(12), fog(), seen_along(bump(12), OBLIQUE))
    found = [rms(errors("volume-transformation", scene, sampling_rate=rate)) for rate in (1, 2, 8)]
    assert found[0] > found[1] and found[2] > 0.9 * found[1]


def test_a_footprint_is_the_ellipse_of_its_sample() -> None:
    """The covariance of the picture is that of the kernel, sigma² along each axis of the grid, projected."""
    values = np.zeros((7, 7, 7))
    values[3, 3, 3] = 1
    sheared = np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]])
    volume = Volume(values, (1.0, 0.5, 2.0), (3, 1, 2), sheared)
    thin = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.01]))
    for view in ((0, 1, 0.2), OBLIQUE, (1, -1, 0.7)):
        camera = seen_along(volume, view, height=12.0)
        picture = draw("splatting", Scene(volume, thin, camera), (80, 80))[..., 3]
        y, x = (np.mgrid[:80, :80] - 39.5) * 12 / 80 * np.array([-1, 1])[:, np.newaxis, np.newaxis]
        moments = [float((a * b * picture).sum() / picture.sum()) for a, b in ((x, x), (x, y), (y, y))]
        axes = np.stack([camera.right, camera.upward]) @ volume.world_from_index
        covariance = 0.65**2 * axes @ axes.T
        # The table's end takes 3e-3 of the second moments away.
        np.testing.assert_allclose(moments, covariance[[0, 0, 1], [0, 1, 1]], atol=1e-2 * covariance.max())
