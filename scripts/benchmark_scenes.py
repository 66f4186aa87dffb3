"""The scenes that are measured: a built-in volume at several sizes, and real ones where they are.

The built-in scenes look alike at every size: extinctions are per voxel of 256³ and scale with the voxel.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import texvol
from texvol import Camera, Scene, TransferFunction, Volume
from texvol.scene import transfer

SIZE = (512, 512)
VIEW = np.array([0.6, 0.45, -0.66])  # along which the built-in scenes are seen
_EXTINCTIONS_OF = 256  # samples along an edge that the built-in extinctions are for

# Value, linear colour, extinction per voxel of 256³.
_POINTS: dict[str, list[tuple[float, tuple[float, float, float], float]]] = {
    "fog": [
        (0.0, (0.2, 0.3, 0.9), 0.0),
        (0.3, (0.4, 0.8, 0.5), 0.004),
        (0.6, (0.9, 0.6, 0.2), 0.012),
        (1.0, (1.0, 1.0, 0.9), 0.03),
    ],
    "bone": [
        (0.0, (0.5, 0.1, 0.05), 0.0),
        (0.45, (0.6, 0.3, 0.1), 0.0),
        (0.55, (0.9, 0.8, 0.6), 0.15),
        (0.8, (1.0, 1.0, 0.9), 0.5),
        (1.0, (1.0, 1.0, 1.0), 0.8),
    ],
    "spike": [
        (0.0, (0.9, 0.5, 0.1), 0.0),
        (0.49, (0.9, 0.5, 0.1), 0.0),
        (0.5, (1.0, 0.8, 0.3), 1.5),
        (0.51, (0.9, 0.5, 0.1), 0.0),
        (1.0, (0.9, 0.5, 0.1), 0.0),
    ],
    "dense": [
        (0.0, (0.4, 0.3, 0.3), 0.0),
        (0.2, (0.7, 0.5, 0.4), 1.0),
        (1.0, (1.0, 0.95, 0.9), 4.0),
    ],
    "balls": [
        (0.0, (0.2, 0.5, 0.9), 0.0),
        (0.05, (0.3, 0.6, 0.9), 0.02),
        (1.0, (1.0, 0.9, 0.7), 0.3),
    ],
}


@dataclass(frozen=True)
class File:
    """A real volume in a folder of data, and how it is seen."""

    name: str
    path: str
    preset: str | None  # None: the transfer function that is made from the histogram
    eye: tuple[float, float, float] | None = None
    up: tuple[float, float, float] | None = None
    shape: tuple[int, int, int] | None = None
    spacing: tuple[float, float, float] | None = None


FILES = (
    File("engine", "engine/engine.nii.gz", None, eye=(700, -500, 420)),
    File("lung", "lung/3DCT_lung.mha", "ct-bone"),
    File(
        "male",
        "male/male.raw.bz2",
        "ct-bone",
        eye=(260, -430, 180),
        up=(0, 0, -1),
        shape=(128, 256, 256),
        spacing=(1.5777, 0.99586, 1.008),
    ),
    File("phantom", "phantom", "ct-bone"),
)


def marschner_lobb(samples: int) -> NDArray[np.float64]:
    """The test signal of Marschner and Lobb (1994) on `samples`³, values 0 … 1."""
    axis = (np.arange(samples) + 0.5) / samples * 2 - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    rings = np.cos(2 * np.pi * 6 * np.cos(np.pi * np.hypot(x, y) / 2))
    return (1 - np.sin(np.pi * z / 2) + 0.25 * (1 + rings)) / 2.5


def balls(samples: int) -> NDArray[np.float64]:
    """Eight small balls, soft towards their edges, in an empty box: values 0 … 1, the same shapes at any size."""
    axis = (np.arange(samples) + 0.5) / samples
    # The nearest of 0.25 and 0.75 along each axis.
    squares = (np.abs(np.abs(axis - 0.5) - 0.25)) ** 2
    distance = np.sqrt(squares[:, np.newaxis, np.newaxis] + squares[:, np.newaxis] + squares)
    return np.clip(1 - distance / 0.07, 0, 1)


def of_type(values: NDArray[np.float64], dtype: str) -> NDArray:
    """Values from 0 to 1 as float32, or as integers over their whole range."""
    if dtype == "float32":
        return values.astype(np.float32)
    return np.rint(values * np.iinfo(dtype).max).astype(dtype)


def transfer_function(name: str, samples: int, most: float = 1.0) -> TransferFunction:
    """One of the built-in transfer functions, for a volume of `samples`³ whose values go up to `most`."""
    values, colors, extinctions = zip(*_POINTS[name], strict=True)
    scale = _EXTINCTIONS_OF / samples
    return TransferFunction(np.array(values) * most, np.array(colors), np.array(extinctions) * scale)


def built_in(name: str, samples: int, dtype: str = "float32", projection: str = "orthographic") -> Scene:
    """The built-in volume with one of its transfer functions, to be classified after interpolation."""
    values = of_type(balls(samples) if name == "balls" else marschner_lobb(samples), dtype)
    most = 1.0 if dtype == "float32" else float(np.iinfo(dtype).max)
    return _seen(Volume(values, name=f"{samples}³"), transfer_function(name, samples, most), projection)


def _seen(volume: Volume, chosen: TransferFunction, projection: str) -> Scene:
    eye = volume.centre - VIEW * max(volume.dimensions) * 2
    camera = Camera.framing(volume, projection, eye=eye, target=volume.centre)  # type: ignore[arg-type]
    return Scene(volume, chosen, camera, classification="post")


def real(file: File, data: Path, preset: str | None = None) -> Scene | None:
    """A real volume's scene, or None where the file is not there; `preset` instead of its own."""
    path = data / file.path
    if not path.exists():
        return None
    raw = {"shape": file.shape, "dtype": "uint8"} if file.shape else {}
    volume = texvol.load(path, spacing=file.spacing, **raw)
    name = preset or file.preset
    chosen = transfer.preset(name, volume) if name else transfer.proposed_for(volume)
    return Scene(volume, chosen, Camera.framing(volume, eye=file.eye, up=file.up), classification="post")


class Truths:
    """Exact pictures, worked out once each and kept in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def of(self, scene: Scene) -> NDArray[np.float64]:
        """The integral of the post-classified medium, shape (height, width, 4)."""
        from texvol.ray_casting import raycast

        scene = replace(scene, classification="post")
        path = self._folder / f"truth-{_name(scene)}.npy"
        if not path.exists():
            np.save(path, raycast(scene, SIZE))
        return np.load(path)


def rms(picture: NDArray, truth: NDArray) -> float:
    """Root mean square difference over all pixels and all four channels; infinite where a picture is not finite."""
    return texvol.compare(picture, truth).rms_error


def _name(scene: Scene) -> str:
    """A name that is different for different scenes."""
    volume, points = scene.volume, scene.transfer_function
    assert points is not None
    metadata = hashlib.sha256(repr((volume.dimensions, volume.spacing.tolist(), scene.camera)).encode())
    for numbers in (volume.values, points.values, points.colors, points.extinctions):
        metadata.update(np.ascontiguousarray(numbers).data)
    return metadata.hexdigest()[:16]
