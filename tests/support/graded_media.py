"""Media that depend on the gradient, for smooth volumes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from support.lit_scenes import (
    FOG,
)
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded

RANGE = 1.0 / 0.8  # of `smooth`, per smallest spacing


def mixed(world: float = 1.0, low: float = 0.0, high: float = 1.0) -> dict[str, TransferFunction]:
    """Matter of each kind, and of all, for a smooth volume of values from `low` to `high`."""
    steep, per, span = RANGE * (high - low) / world, 1 / world, high - low
    modulation = np.array([(0.02, 0.1), (0.1, 0.4), (0.3, 1.5)]) * [steep, 1]
    emissions = 0.2 * per * np.array([(0.1, 0.2, 0.9), (0.9, 0.2, 0.1), (0.3, 0.9, 0.2)])
    values = low + span * np.array([0.3, 0.6, 0.9])
    graded = Graded(values, emissions, per * np.array([0.05, 0.2, 0.25]), 0.03 * steep, 0.2 * steep)
    contour = Contour(low + 0.62 * span, 1.5 * world, tuple(0.3 * per * np.array([1, 0.9, 0.6])), 0.35 * per)
    fog = TransferFunction(low + span * FOG.values, FOG.colors, FOG.extinctions * per)
    glowing = fog.colors * fog.extinctions[:, np.newaxis]
    premultiplied = TransferFunction(fog.values, glowing, fog.extinctions, premultiplied=True)
    return {
        "modulated": replace(fog, modulation=modulation),
        "modulated premultiplied": replace(premultiplied, modulation=modulation),
        "graded": replace(fog, graded=(graded,)),
        "contour": replace(fog, contours=(contour,)),
        "all": replace(premultiplied, modulation=modulation, graded=(graded,), contours=(contour,)),
    }
