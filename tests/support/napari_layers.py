"""Stand-ins for napari's layers, camera and dimensions: the public attributes that the plugin reads, and no others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np


class GreyMap:
    """Colour map from black to white, opaque."""

    def map(self, fractions: Any) -> np.ndarray:
        grey = np.asarray(fractions, np.float64)
        return np.stack([grey, grey, grey, np.ones_like(grey)], axis=-1)


@dataclass
class Placed:
    data: Any
    name: str = "cells"
    visible: bool = True
    opacity: float = 1.0
    blending: str = "translucent_no_depth"
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)
    translate: tuple[float, ...] = (0.0, 0.0, 0.0)
    depiction: str = "volume"
    multiscale: bool = False
    downsample_factors: Any = None

    @property
    def ndim(self) -> int:
        return len(self.scale)

    def data_to_world(self, position: Any) -> tuple[float, ...]:
        return tuple(np.asarray(position) * self.scale + self.translate)

    def world_to_data(self, position: Any) -> np.ndarray:
        return (np.asarray(position)[-self.ndim :] - self.translate) / self.scale


@dataclass
class Image(Placed):
    rgb: bool = False
    rendering: str = "mip"
    contrast_limits: tuple[float, float] = (0.0, 1.0)
    gamma: float = 1.0
    colormap: Any = field(default_factory=GreyMap)
    interpolation3d: str = "linear"
    iso_threshold: float = 0.5
    attenuation: float = 0.05


@dataclass
class Labels(Placed):
    rendering: str = "translucent"
    colors: dict[int, tuple[float, ...]] = field(default_factory=dict)

    def get_color(self, label: int) -> np.ndarray | None:
        return None if label == 0 else np.array(self.colors.get(label, (0.0, 0.0, 0.0, 0.0)))


@dataclass
class Points(Placed):
    pass


@dataclass
class Camera:
    """By default from the front: x to the right, y down, z to the eye."""

    center: tuple[float, float, float] = (8.0, 8.0, 8.0)
    zoom: float = 2.0
    perspective: float = 0.0
    orientation: tuple[str, str, str] = ("towards", "down", "right")
    view_direction: tuple[float, float, float] = (-1.0, 0.0, 0.0)
    up_direction: tuple[float, float, float] = (0.0, -1.0, 0.0)


@dataclass
class Dims:
    ndisplay: int = 3
    displayed: tuple[int, ...] = (0, 1, 2)
    point: tuple[float, ...] = (0.0, 0.0, 0.0)
