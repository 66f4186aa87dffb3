"""Positions of samples, and angles between directions."""

from __future__ import annotations

import numpy as np


def positions(dimensions: tuple[int, int, int]) -> np.ndarray:
    """Index x, y, z of every sample, shape (nz, ny, nx, 3)."""
    return np.stack(np.meshgrid(*map(np.arange, dimensions[::-1]), indexing="ij")[::-1], axis=-1)


def angles(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Degrees between vectors; by the tangent, as a cosine does not tell 0.02° from 0 in float32."""
    across = np.linalg.norm(np.cross(found.astype(np.float64), wanted), axis=-1)
    return np.degrees(np.arctan2(across, (found * wanted).sum(axis=-1)))
