"""The gallery's built-in volumes: closed forms, and random fields whose numbers never change; no files.

All have samples at distance 1, so that a `.npy` of their values is the same volume.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

Axes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]  # x, y, z, to be broadcast to (z, y, x)


def orbital(samples: int = 112) -> NDArray[np.float64]:
    """The wave function of an electron of a hydrogen atom, 4f: x (5 z² - r²) exp(-r / 4), r in Bohr radii; -1 … 1."""
    x, y, z = _axes(samples, 34.0)
    r = np.sqrt(x * x + y * y + z * z)
    wave = x * (5 * z * z - r * r) * np.exp(-r / 4)
    return wave / np.abs(wave).max()


def trefoil(samples: int = 128) -> NDArray[np.float64]:
    """1 - |u³ - v²|, above 1/2 a knotted tube: Milnor's fibration (1968) of the trefoil, whose core is u³ = v²; 0 … 1.

    u and v are complex coordinates on the sphere in four dimensions, projected to space from its pole.
    """
    x, y, heights = _axes(samples, 3.4)
    knot = np.empty((samples,) * 3)
    for layer, z in enumerate(heights):  # complex numbers of all layers would take 200 MB
        square = x * x + y * y + z * z
        u = 2 * (x + 1j * y) / (square + 1)
        v = (2 * z + 1j * (square - 1)) / (square + 1)
        knot[layer] = np.maximum(1 - np.abs(u**3 - v**2), 0)
    return knot


def gyroid(samples: int = 112) -> NDArray[np.float64]:
    """Schoen's gyroid (1970): sin x cos y + sin y cos z + sin z cos x over four periods; -1.5 … 1.5."""
    x, y, z = _axes(samples, 4 * np.pi)
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def ripples(samples: int = 96) -> NDArray[np.float64]:
    """The signal of Marschner and Lobb (1994), z downwards where it is high; 0 … 1."""
    x, y, z = _axes(samples, 1.0)
    rings = np.cos(2 * np.pi * 4 * np.cos(np.pi * np.hypot(x, y) / 2))
    return (1 - np.sin(np.pi * z / 2) + 0.09 * (1 + rings)) / 2.2


def galaxy(samples: int = 192) -> NDArray[np.float64]:
    """A disk with two arms along logarithmic spirals, mottled by turbulence, and a bulge; a quarter as thick; 0 … 1."""
    x, y, _ = _axes(samples, 1.0)
    z = _axes(samples // 4, 0.25)[2]
    radius = np.hypot(x, y)
    arms = np.cos(np.arctan2(y, x) - 3.4 * np.log(radius + 0.06)) ** 4
    disk = (0.1 + arms) * np.exp(-1.9 * radius - (z / 0.05) ** 2) * np.clip(4 - 4 * radius, 0, 1) ** 2
    bulge = np.exp(-np.sqrt(radius**2 + 2.5 * z * z + 1e-4) / 0.07)
    mottled = disk * np.exp(0.6 * random_field((samples // 4, samples, samples), 1845, 40.0))
    return np.clip(np.sqrt(0.55 * mottled + 1.2 * bulge), 0, 1)


def cloud(samples: int = 112) -> NDArray[np.float64]:
    """A heap with a flat base, frayed by turbulence; 0 … 1."""
    x, y, z = _axes(samples, 1.0)
    above = z + 0.35
    height = np.where(above < 0, 2.2 * above, above)
    heap = 0.75 - np.sqrt((x / 1.05) ** 2 + (y / 0.9) ** 2 + height**2)
    return np.clip(heap + 0.2 * random_field((samples,) * 3, 1883, 24.0), 0, 1)


def random_field(shape: tuple[int, int, int], seed: int, waves: float) -> NDArray[np.float64]:
    """A periodic field of mean square 1, of power k^-11/3 as turbulence has (Kolmogorov 1941).

    k is in waves along the longest edge; from about `waves` on there are none.
    """
    # RandomState, because its numbers are promised to stay the same.
    noise = np.random.RandomState(seed).standard_normal(shape)
    z, y = (np.fft.fftfreq(count) * max(shape) for count in shape[:2])
    k2 = z[:, None, None] ** 2 + y[:, None] ** 2 + (np.fft.rfftfreq(shape[2]) * max(shape)) ** 2
    k2[0, 0, 0] = np.inf
    # Amplitudes are roots of powers.
    filtered = np.fft.rfftn(noise) * k2 ** (-11 / 12) * np.exp(-k2 / waves**2)
    field = np.fft.irfftn(filtered, shape, (0, 1, 2))
    return np.asarray(field / field.std())


BUILT_IN: dict[str, Callable[[], NDArray[np.float64]]] = {
    each.__name__: each for each in (orbital, trefoil, gyroid, ripples, galaxy, cloud)
}


def built_in(name: str) -> Volume:
    """A built-in volume by its name, float32."""
    return Volume(BUILT_IN[name]().astype(np.float32), name=name)


def _axes(samples: int, reach: float) -> Axes:
    """x, y and z of samples from -reach to reach, half a spacing inside."""
    axis = ((np.arange(samples) + 0.5) / samples * 2 - 1) * reach
    return axis, axis[:, np.newaxis], axis[:, np.newaxis, np.newaxis]
