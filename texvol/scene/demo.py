"""The built-in volume: an orbital of the hydrogen atom, in closed form, so that a first picture needs no file."""

from __future__ import annotations

import numpy as np

from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume


def demo_volume(samples: int = 96) -> Volume:
    """Probability density |ψ|² of the electron in a 4f state, scaled to 0 … 1, on `samples`³ in a box of edge 1.

    With r in Bohr radii, ψ is proportional to x (5 z² - r²) exp(-r / 4).
    """
    axis = ((np.arange(samples, dtype=np.float32) + 0.5) / samples * 2 - 1) * 32
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    r = np.sqrt(x * x + y * y + z * z)
    source = {"built_in": "demo", "samples": samples}
    density = (x * (5 * z * z - r * r) * np.exp(-r / 4)) ** 2
    return Volume(density / density.max(), spacing=(1 / samples,) * 3, name="demo", source=source)


def demo_scene() -> Scene:
    """The demo volume, faint where the electron is rarely found, glowing where it often is."""
    volume = demo_volume()
    transfer_function = TransferFunction(
        np.array([0.01, 0.08, 0.25, 0.5, 1.0]),
        np.array([(0.01, 0.03, 0.30), (0.02, 0.15, 0.70), (0.70, 0.04, 0.20), (1.0, 0.40, 0.03), (1.0, 0.90, 0.55)]),
        np.array([0.0, 1.0, 6.0, 40.0, 200.0]),
    )
    camera = Camera.perspective((1.5, -1.35, 0.95), (0.49, 0.49, 0.49), (0, 0, 1), fov=26)
    return Scene(volume, transfer_function, camera)
