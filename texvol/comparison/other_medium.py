"""Transfer functions as a renderer has them that is wrong about opacity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.optics import depth_from_opacity
from texvol.scene.transfer import Classified, TransferFunction


@dataclass(frozen=True, eq=False)
class OtherExtinction(TransferFunction):
    """Matter of the same colours, whose extinction is another function of the right one.

    Of matter that glows by itself the emission stays. It is for texels alone: what classifies values in a shader looks
    at the points.
    """

    change: Callable[[NDArray[np.float64]], NDArray[np.float64]] = np.asarray

    @property
    def _right(self) -> TransferFunction:
        return TransferFunction(**{each.name: getattr(self, each.name) for each in fields(TransferFunction)})

    def at(self, values: ArrayLike) -> NDArray[np.float64]:
        """Straight colour and extinction, see `TransferFunction.at`."""
        numbers = self._right.at(values)
        numbers[..., 3] = self.change(numbers[..., 3])
        return numbers

    def classify(self, values: ArrayLike, magnitudes: ArrayLike | None = None) -> Classified:
        """Emission and extinction, see `TransferFunction.classify`."""
        emission, right = self._right.classify(values, magnitudes)
        extinction = self.change(right)
        if self.emissive:
            return Classified(np.where(np.isinf(extinction)[..., np.newaxis], 0.0, emission), extinction)
        # q = cτ becomes cτ'; of opaque matter `emission` is c itself.
        of_color = np.where(np.isinf(right), 1.0, right)
        straight = np.divide(emission, of_color[..., np.newaxis], out=emission * 0, where=of_color[..., np.newaxis] > 0)
        weight = np.where(np.isinf(extinction), 1.0, extinction)
        return Classified(straight * weight[..., np.newaxis], extinction)


def linear_in_depth(medium: TransferFunction, slab_thickness: float) -> OtherExtinction:
    """Matter that has in a slab the opacity min(τL, 1), where it should be 1 - e^-τL."""

    def change(extinction: NDArray[np.float64]) -> NDArray[np.float64]:
        return depth_from_opacity(np.minimum(extinction * slab_thickness, 1.0)) / slab_thickness

    return OtherExtinction(**{each.name: getattr(medium, each.name) for each in fields(medium)}, change=change)


def times(medium: TransferFunction, factor: float) -> TransferFunction:
    """The same matter, so many times as dense: a slab of it shows what one so many times as thick did."""
    # Colours of points that glow are per length; those of others, and of opaque ones, are colours.
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
