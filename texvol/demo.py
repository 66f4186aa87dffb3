"""The built-in volume: a ball of gyroid, in closed form, so that a first picture needs no file."""

from __future__ import annotations

import numpy as np

from texvol.camera import Camera
from texvol.scene import Scene
from texvol.transfer import TransferFunction
from texvol.volume import Volume


def demo_volume(samples: int = 96) -> Volume:
    """A gyroid sheet that fades out towards the surface of a ball; values 0 … 1 on `samples`³, box edge 1."""
    axis = (np.arange(samples, dtype=np.float32) + 0.5) / samples * 2 - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    a = np.float32(3.5 * np.pi)
    gyroid = np.sin(a * x) * np.cos(a * y) + np.sin(a * y) * np.cos(a * z) + np.sin(a * z) * np.cos(a * x)
    radius = np.sqrt(x * x + y * y + z * z)
    inside = 1 / (1 + np.exp((radius - 0.88) * 30))
    values = np.exp(-3 * gyroid**2) * inside * (0.35 + 0.65 * radius)
    return Volume(values.astype(np.float32), spacing=(1 / samples,) * 3, name="demo")


def demo_scene() -> Scene:
    """The demo volume in warm colours, seen in perspective."""
    volume = demo_volume()
    transfer_function = TransferFunction(
        np.array([0.12, 0.3, 0.5, 0.7, 1.0]),
        np.array([(0.02, 0.05, 0.3), (0.05, 0.25, 0.6), (0.9, 0.35, 0.08), (1.0, 0.75, 0.3), (1.0, 0.95, 0.85)]),
        np.array([0.0, 6.0, 40.0, 120.0, 300.0]),
    )
    camera = Camera.framing(volume, "perspective", fov=30)
    return Scene(volume, transfer_function, camera, background=(0.01, 0.012, 0.02))
