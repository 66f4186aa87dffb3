"""Scenes for the survey's other methods, and their errors against the oracle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from support.scenes import FOG
from texvol.methods import draw, method_of
from texvol.ray_casting import raycast
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

OBLIQUE = (-0.5, -1.0, -0.35)


def bump(samples: int) -> Volume:
    """Smooth hills between 0 and 1, of no symmetry and 0 at the sides, in a box of 1 × 1.2 × 0.8 whatever `samples`."""
    z, y, x = np.meshgrid(*[(np.arange(samples) + 0.5) / samples] * 3, indexing="ij")
    sides = (np.sin(np.pi * x) * np.sin(np.pi * y) * np.sin(np.pi * z)) ** 2
    values = sides * (0.6 + 0.4 * np.sin(5 * x + 2 * y) * np.cos(4 * z - 3 * y))
    return Volume(values, (1 / samples, 1.2 / samples, 0.8 / samples), name=f"bump {samples}")


def fog(factor: float = 1.0) -> TransferFunction:
    """Thin smooth medium for a box of edge 1; its optical depth is about 4 `factor` at the most."""
    return replace(FOG, extinctions=FOG.extinctions * 256 * factor)


def seen_along(volume: Volume, view: Sequence[float], up: Sequence[float] = (0.1, 0.2, 1), **height: float) -> Camera:
    """Orthographic camera outside the box that looks along `view` at its middle."""
    eye = volume.centre - 3 * volume.radius * np.array(view) / np.linalg.norm(view)
    return Camera.framing(volume, eye=eye, target=volume.centre, up=up, **height)


def truth(name: str, scene: Scene, size: tuple[int, int]) -> np.ndarray:
    """Return the oracle's picture of the medium that a method integrates."""
    before = method_of(name).order == "before"
    return raycast(replace(scene, classification="extinction" if before else "post"), size)


def errors(name: str, scene: Scene, size: tuple[int, int] = (40, 30), **settings: Any) -> np.ndarray:
    """Return the difference of a method's picture and the oracle's, shape (height, width, 4)."""
    return draw(name, scene, size, **settings) - truth(name, scene, size)


def rms(difference: np.ndarray) -> float:
    """Root mean square of all channels."""
    return float(np.sqrt(np.mean(difference**2)))
