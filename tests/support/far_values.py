"""A wave, its medium and a view of it, for samples far from the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol import Camera, TransferFunction

SIZE = (40, 40)
VIEW = Camera.perspective((40, -25, 30), (7.5, 7.5, 7.5), (0, 0, 1), fov=30)


def wave(high: float = 1.0, samples: int = 16) -> NDArray[np.float64]:
    """A smooth field from 0 to `high`, shape (samples, samples, samples)."""
    x = np.linspace(0, 1, samples)
    field = np.sin(6 * x)[:, None, None] * np.cos(5 * x)[:, None] * np.sin(4 * x + 1)
    return high * (field - field.min()) / np.ptp(field)


def medium_to(high: float) -> TransferFunction:
    return TransferFunction(np.array([0, 0.5, 1]) * high, np.eye(3), np.array([0, 0.1, 0.5]))
