"""Angle errors and time of the gradient estimators, on surfaces whose normals are known."""

from __future__ import annotations

import time

import numpy as np
from benchmark_timing import Run, columns, heading, row
from numpy.typing import NDArray

from texvol import Volume
from texvol.scene.gradient import ESTIMATOR_KINDS, Estimator, gradients

_SAMPLES = 48
_NOISE = (0.0, 1.0, 2.0, 4.0, 8.0)  # standard deviation, where the step is 100
Numbers = NDArray[np.float64]


def gradient(run: Run) -> None:
    """Print the section on gradients."""
    heading(
        "Gradients",
        f"{_SAMPLES}³ samples; rms angle in degrees between gradients and normals at the samples beside a surface. "
        "Values step by 100 over 4 voxels; a shell has the profile of a bell, 1.2 voxels to a side.",
    )
    columns("surface", "noise", *(f"`{each}`" for each in ESTIMATOR_KINDS))
    for name, (values, normals, near) in surfaces().items():
        for noise in _NOISE:
            noisy = Volume(values + np.random.default_rng(1).normal(0, 1, values.shape) * noise)
            row(name, f"{noise:g}", *(f"{rms_angle(noisy, each, normals, near):.2f}" for each in ESTIMATOR_KINDS))
    volume = Volume(np.random.default_rng(1).random((160, 160, 160), np.float32))
    row("seconds for 160³ samples", "", *(f"{seconds(volume, each, run.rounds):.2f}" for each in ESTIMATOR_KINDS))


def surfaces() -> dict[str, tuple[Numbers, Numbers, NDArray[np.bool_]]]:
    """Values, normals that point to lower ones, and where they are compared."""
    place = np.moveaxis(np.indices((_SAMPLES,) * 3)[::-1], 0, -1) - (_SAMPLES - 1) / 2
    radius = np.linalg.norm(place, axis=-1)
    turned = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    in_cube = place @ turned
    farthest = np.abs(in_cube).max(axis=-1)
    faces = (np.abs(in_cube) == farthest[..., np.newaxis]) * np.sign(in_cube) @ turned.T
    outward = np.where(radius < 16, -1, 1)[..., np.newaxis] * place
    return {
        "ball": (_step(16 - radius), place, np.abs(radius - 16) < 0.7),
        "turned cube": (_step(13 - farthest), faces, np.abs(farthest - 13) < 0.7),
        "shell": (100 * np.exp(-(((radius - 16) / 1.2) ** 2)), outward, np.abs(np.abs(radius - 16) - 0.85) < 0.5),
    }


def _step(depth: Numbers) -> Numbers:
    return 100 * np.clip(depth / 4 + 0.5, 0, 1)


def rms_angle(volume: Volume, kind: str, normals: Numbers, near: NDArray[np.bool_]) -> float:
    """Root mean square angle, degrees."""
    found, wanted = -gradients(volume, Estimator(kind))[near], normals[near]  # type: ignore[arg-type]
    across = np.linalg.norm(np.cross(found, wanted), axis=-1)
    angles = np.degrees(np.arctan2(across, (found * wanted).sum(axis=-1)))
    return float(np.sqrt(np.mean(angles**2)))


def seconds(volume: Volume, kind: str, rounds: int) -> float:
    """Median seconds of all gradients of a volume."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        gradients(volume, Estimator(kind))  # type: ignore[arg-type]
        times.append(time.perf_counter() - start)
    return float(np.median(times))
