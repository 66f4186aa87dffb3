"""Scenes of the projection modes, and how near what is drawn of them comes to the oracle."""

from __future__ import annotations

import numpy as np
import pytest

from support.scenes import inside, path_lengths
from texvol.ray_casting.projection import project
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

NUMBERS = ("xray", "average", "mip", "minip")
MODES = (*NUMBERS, "isosurface")
SIZE = (23, 19)
OBLIQUE = np.array([[1, 0.4, 0], [0.2, 1, 0.3], [0, -0.3, -1]])  # and left-handed
GRIDS = {
    "plain": {},
    "anisotropic": {"spacing": (1, 2.5, 0.4)},
    "sheared": {"spacing": (1, 2, 3), "origin": (5, 6, 7), "direction": OBLIQUE},
    "thin": {"spacing": (1e-9, 1e-9, 3e-9), "origin": (1e-6, 0, 2e-6)},
    "wide": {"spacing": (1e9, 2e9, 1e9), "origin": (1e12, 1e10, -3e12)},
}
CAMERAS = {
    "orthographic": lambda volume: Camera.framing(volume, "orthographic"),
    "perspective": lambda volume: Camera.framing(volume, "perspective", fov=70),
    "inside": lambda volume: inside(volume, "perspective"),
    "inside, parallel": lambda volume: inside(volume, "orthographic"),
    "along an axis": lambda volume: Camera.framing(volume, eye=volume.centre - (3 * volume.radius, 0, 0)),
}
every_mode = pytest.mark.parametrize("mode", MODES)
every_number = pytest.mark.parametrize("mode", NUMBERS)
every_grid = pytest.mark.parametrize("grid", GRIDS)
every_view = pytest.mark.parametrize("view", CAMERAS)


def every_grid_and_view(*modes: str) -> pytest.MarkDecorator:
    """Every grid in every view, the modes in turns: each mode on every grid and in every view."""
    turns = [
        (grid, view, modes[(row + column) % len(modes)])
        for row, grid in enumerate(GRIDS)
        for column, view in enumerate(CAMERAS)
    ]
    return pytest.mark.parametrize("grid, view, mode", turns)


def noise(grid: str = "plain", dtype: type = np.float32, dimensions=(9, 8, 7), seed: int = 5) -> Volume:
    """Samples from 0 to 1, or of the whole range of an integer type but for an eighth."""
    samples = np.random.default_rng(seed).random(dimensions[::-1])
    if np.issubdtype(dtype, np.integer):
        info = np.iinfo(dtype)
        samples = np.rint(info.min + samples * 0.875 * (float(info.max) - info.min))
    return Volume(samples.astype(dtype), **GRIDS[grid])


def rounding(volume: Volume) -> float:
    """What float32 may make of an interpolated value.

    A place in the box is off by three roundings of 2^-24 or so at most (where the ray is at depth 0, the product with
    the depth, the sum), which is that times the number of samples along each axis; over one sample the value changes
    by the range at most. Interpolation itself takes seven roundings of the largest value.
    """
    low, high = volume.finite_range
    return 2.0**-24 * (3 * sum(volume.dimensions) * (high - low) + 8 * max(abs(low), abs(high)))


def scene_of(volume: Volume, mode: str, view: str = "orthographic", fraction: float = 0.6, **more) -> Scene:
    """A scene; an isosurface is at that share of the range."""
    low, high = volume.finite_range
    isovalue = low + fraction * (high - low) if mode == "isosurface" else None
    return Scene(volume, camera=CAMERAS[view](volume), mode=mode, isovalue=isovalue, **more)


def with_gaps(kind: str) -> Volume:
    """None begins one sample from the border: there drivers multiply that sample by 0, and NaN stays NaN."""
    values = noise(dimensions=(15, 14, 16)).values.copy()
    for z, y, x in [(2, 3, 4), (0, 9, 8), (9, 5, 0), (11, 2, 8), (6, 6, 11), (13, 9, 4)]:
        values[z : z + 3, y : y + 2, x : x + 2] = float(kind)
    return Volume(values, **GRIDS["sheared"])


def same_depths(depth: np.ndarray, expected: np.ndarray, volume: Volume, tolerance: float = 1e-4) -> None:
    """Nearly all depths the same to a share of the longest way through the box; a ray may graze a surface or miss it.

    A place is known to 2^-22 of the box, and so is the value times its slope: where the surface is steep the depth is
    as good, and where the ray runs along it as much worse as the slope along the ray is less than it could be.
    """
    assert (np.isfinite(depth) == np.isfinite(expected)).mean() > 0.995
    met = np.isfinite(depth) & np.isfinite(expected)
    if not met.any():
        return
    difference = np.abs(depth[met] - expected[met]) / volume.radius
    assert (difference < tolerance).mean() > 0.99
    assert np.median(difference) < 1e-6


def orders_of_sums(renderer, scene, size=(64, 64)):
    """Orders of convergence of a picture of sums, from rates 1, 2, 4 and 8, by the rms error.

    Through the silhouettes, where a ray's path is shorter than a slab, errors are no power of its thickness yet.
    """
    expected = project(scene, size)[..., 0]
    whole = path_lengths(scene.volume, scene.camera, size) > 8
    errors = []
    for rate in (1, 2, 4, 8):
        picture = renderer.render(scene, size, sampling_rate=rate)[..., 0]
        errors.append(np.sqrt(np.mean((picture - expected)[whole] ** 2)))
    return np.log2(np.array(errors[:-1]) / errors[1:])


def ct(seed: int = 0, padding: float | None = None) -> np.ndarray:
    """A body of water with bone in it, in noisy air, and what lies outside of the scanner's circle."""
    z, y, x = np.mgrid[tuple(slice(-1, 1, 24j) for _ in range(3))]
    r = np.sqrt(x**2 + y**2 + z**2)
    values = np.where(r < 0.25, 800.0, np.where(r < 0.7, 30.0, -1000.0))
    values += np.random.default_rng(seed).normal(0, 15, values.shape)
    if padding is not None:
        values[np.hypot(x, y) > 1.05] = padding
    return np.rint(values).astype(np.int16)
