"""Protocol of a scene, for modules that `texvol.scene.scene` imports."""

from __future__ import annotations

from typing import Any, Protocol

from texvol.scene.camera import Camera
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import Lighting
from texvol.scene.mask import Mask
from texvol.scene.transfer.function import TransferFunction
from texvol.scene.volume import Volume


class SceneParts(Protocol):
    """Parts of a `Scene` that decide on what shows and in which look."""

    @property
    def volume(self) -> Volume:
        """First volume."""

    @property
    def box(self) -> Volume:
        """Box around all volumes."""

    @property
    def transfer_function(self) -> TransferFunction | None:
        """Transfer function of the first volume."""

    @property
    def camera(self) -> Camera | None:
        """Camera."""

    @property
    def lighting(self) -> Lighting | None:
        """Light."""

    @property
    def gradient(self) -> Estimator:
        """Gradient estimator."""

    @property
    def background(self) -> tuple[float, float, float]:
        """Light from behind."""

    @property
    def mode(self) -> str:
        """Projection mode."""

    @property
    def isovalues(self) -> tuple[float, ...]:
        """Values of all isosurfaces."""

    @property
    def mask(self) -> Mask | None:
        """Mask of the first volume."""

    @property
    def added(self) -> tuple[Any, ...]:
        """Further volumes."""

    @property
    def geometry(self) -> tuple[Any, ...]:
        """Meshes and lines."""

    @property
    def clip(self) -> tuple[Any, ...]:
        """Clip planes."""

    @property
    def crop(self) -> Any:
        """Crop box."""

    @property
    def cutting(self) -> Any:
        """Clip planes and crop box."""
