"""Transfer functions of a renderer that is wrong about opacity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.optics import depth_from_opacity
from texvol.scene.transfer import Classified, TransferFunction


@dataclass(frozen=True, eq=False)
class OtherExtinction(TransferFunction):
    """Medium of the same colours whose extinction is a function of the right extinction.

    The emission of an emissive medium stays. The class works for texels only: shaders that classify values read the
    points.
    """

    change: Callable[[NDArray[np.float64]], NDArray[np.float64]] = np.asarray

    @property
    def _right(self) -> TransferFunction:
        return TransferFunction(**{each.name: getattr(self, each.name) for each in fields(TransferFunction)})

    def at(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return straight colour and extinction, see `TransferFunction.at`."""
        numbers = self._right.at(values)
        numbers[..., 3] = self.change(numbers[..., 3])
        return numbers

    def classify(self, values: ArrayLike, magnitudes: ArrayLike | None = None) -> Classified:
        """Return emission and extinction, see `TransferFunction.classify`."""
        emission, right = self._right.classify(values, magnitudes)
        extinction = self.change(right)
        if self.emissive:
            return Classified(np.where(np.isinf(extinction)[..., np.newaxis], 0.0, emission), extinction)
        # q = cτ becomes cτ'; `emission` of an opaque medium is c itself.
        of_color = np.where(np.isinf(right), 1.0, right)
        straight = np.divide(emission, of_color[..., np.newaxis], out=emission * 0, where=of_color[..., np.newaxis] > 0)
        weight = np.where(np.isinf(extinction), 1.0, extinction)
        return Classified(straight * weight[..., np.newaxis], extinction)


def linear_in_depth(medium: TransferFunction, slab_thickness: float) -> OtherExtinction:
    """Return a medium whose slabs have opacity min(τL, 1) instead of 1 - e^-τL."""

    def change(extinction: NDArray[np.float64]) -> NDArray[np.float64]:
        return depth_from_opacity(np.minimum(extinction * slab_thickness, 1.0)) / slab_thickness

    return OtherExtinction(**{each.name: getattr(medium, each.name) for each in fields(medium)}, change=change)


def times(medium: TransferFunction, factor: float) -> TransferFunction:
    """Return the medium with `factor` times the density: that of slabs `factor` times as thick."""
    # Colours of emissive points are per length; colours of other points, and of opaque ones, are not.
    glows = medium.emissive | (medium.premultiplied & np.isfinite(medium.extinctions))
    return replace(
        medium,
        colors=medium.colors * np.where(glows, factor, 1.0)[..., np.newaxis],
        extinctions=medium.extinctions * factor,
        graded=tuple(
            replace(each, emissions=each.emissions * factor, extinctions=each.extinctions * factor)
            for each in medium.graded
        ),
        contours=tuple(
            replace(each, emission=tuple(factor * np.array(each.emission)), extinction=each.extinction * factor)
            for each in medium.contours
        ),
    )
