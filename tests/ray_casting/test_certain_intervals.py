"""Intervals of lit media that need no halves: where that is said, the whole is exact."""

from __future__ import annotations

import numpy as np

from texvol.ray_casting.lit.collocation import NODE_COUNT, NODES, integrate, is_certain

AGREEMENT = 1e-10
PARTS = 32  # of the reference; each has an error 2^-80 times that of the whole


def integral(glow, length: float, parts: int = 1) -> np.ndarray:
    """Optical depth and light of an interval, over equal parts."""
    depth, light, result = 0.0, np.zeros(3), np.zeros(4)
    for part in range(parts):
        integrate(glow((part + NODES) / parts), length / parts, result)
        light += np.exp(-depth) * result[1:]
        depth += result[0]
    return np.array([depth, *light])


def random_glow(random: np.random.Generator):
    """Emission and extinction by a linear value under a highlight, or beside a pole as where a gradient vanishes."""
    low, high, width = random.random(), random.random(), 10 ** random.uniform(-0.5, 1.5)
    middle, power = random.uniform(-0.5, 1.5), random.choice([1.0, 10.0, 60.0])

    def glow(t: np.ndarray) -> np.ndarray:
        extinction = low + (high - low) * t
        cosine = width / np.hypot(t - middle, width)  # of a normal that turns on a ray past a pole
        light = 0.3 + 0.7 * cosine + 0.4 * cosine**power
        return np.stack([extinction * light, extinction * cosine, extinction**2, extinction])

    return glow


def test_a_whole_that_is_taken_for_certain_is_exact() -> None:
    random, certain = np.random.default_rng(3), 0
    for _ in range(2000):
        glow, length, depth = random_glow(random), 10 ** random.uniform(-3, 0), random.choice([0.0, 3.0])
        if is_certain(glow(NODES), length, depth):
            certain += 1
            off = np.exp(-depth) * np.abs(integral(glow, length) - integral(glow, length, PARTS)).max()
            assert off <= AGREEMENT
    assert 150 < certain < 2700  # it is of use, and not always said


def test_kinks_jumps_and_deep_intervals_are_never_certain() -> None:
    smooth = np.full((4, NODE_COUNT), 0.1)
    assert is_certain(smooth, 1.0, 0.0)
    assert not is_certain(21 * smooth, 1.0, 0.0)  # optical depth of 2.1
    for channel in range(4):
        for at in (0.1, 0.35, 0.5, 0.8):
            jump, kink = smooth.copy(), smooth.copy()
            jump[channel, at < NODES] += 0.1
            kink[channel] += np.maximum(NODES - at, 0.0)
            assert not is_certain(jump, 1.0, 0.0) and not is_certain(kink, 1.0, 0.0)
            assert is_certain(jump, 1.0, 40.0)  # behind an opaque medium
