"""Classification of coarse samples by the distribution of the values that they stand for: means, and how far they vary.

Both are interpolated, and looked up together in the smoothed transfer function: see `texvol.textures.distribution`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.gradient import Estimator
from texvol.scene.scene import Classification
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.distribution import NODES, ROWS, Spread
from texvol.textures.slab_texture import Box
from texvol.textures.value_texture import ValueTexture, bake_values

SMOOTHED = "smoothed"  # sampler of the table, which is interpolated

_EXACT = "exact"  # a texel format of values: as they are


@dataclass(frozen=True)
class SpreadTexture(ValueTexture):
    """Storage of means and of the table's rows, both of shape (nz, ny, nx, 1), in two textures.

    `spread` has no rows any more when these are on the device.
    """

    spread: Spread = field(kw_only=True)

    def classified(self, classification: Classification) -> SpreadTexture:
        """Return itself: a distribution is classified in one way for all classifications."""
        return self

    def all_texels(self, box: Box) -> dict[str, NDArray]:
        """Texels of a box of samples by the names of the samplers."""
        return super().all_texels(box) | {"rows": self.spread.rows[box][..., np.newaxis]}

    @property
    def formats(self) -> dict[str, tuple[str, int]]:
        """Texel format and numbers in a texel of each texture, by the name of its sampler."""
        return super().formats | {"rows": ("r16", 1)}

    def switches(self, slab_thickness: float, obliquity: float) -> dict[str, int]:
        """Switches of the shader; between two planes at distance 1 the longest ray's length is `obliquity`."""
        return super().switches(slab_thickness, obliquity) | {"SPREAD": 1, "EMISSIVE": 1, "RAMPS": 0}

    def uniforms(self, slab_thickness: float) -> dict[str, Any]:
        """Uniforms of the shader; lengths are in the finest level's smallest spacing."""
        return super().uniforms(slab_thickness) | {"slab_length": slab_thickness / self.spread.function.length_unit}

    @property
    def tables(self) -> dict[str, NDArray[np.float32]]:
        """The smoothed transfer function, shape (rows, columns, 4)."""
        return {SMOOTHED: self.spread.function.table}

    @property
    def _function_uniforms(self) -> dict[str, Any]:
        low, high = self.storage.stored(np.array(self.spread.function.ends))
        # From the middle of the first texel of the table to that of the last.
        columns, rows = ((count - 1) / count for count in (NODES, ROWS))
        return {
            "smoothed_low": float(low),
            "smoothed_columns": (float(columns / (high - low)), 0.5 / NODES),
            "smoothed_rows": (rows, 0.5 / ROWS),
        }


def bake_spread(
    volume: Volume, transfer_function: TransferFunction, spread: Spread, estimator: Estimator | None = None
) -> SpreadTexture:
    """Return the texture of a part of a coarse level, whose texels are made when they are asked for.

    Parameters
    ----------
    volume : Volume
        Samples of the part.
    transfer_function : TransferFunction
        Of which the medium depends on the value alone.
    spread : Spread
        What its samples stand for.
    estimator : Estimator, optional
        Of gradients, where light asks for them.
    """
    values = bake_values(volume, transfer_function, "post", _EXACT if estimator is None else "rgba32f", estimator)
    known = {each.name: getattr(values, each.name) for each in fields(values)}
    return SpreadTexture(**known, spread=spread)
