"""Gradients of a volume at its samples, in world directions; a scene that has no use for them computes none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from texvol.errors import InputError
from texvol.volume import Volume

EstimatorKind = Literal["central", "zucker-hummel", "gaussian"]
ESTIMATOR_KINDS: tuple[str, ...] = get_args(EstimatorKind)
Box = tuple[slice, slice, slice]  # of samples, along z, y, x


@dataclass(frozen=True)
class Estimator:
    """How gradients are estimated: "central" differences, "zucker-hummel" (26 neighbours) or "gaussian".

    `scale` is for "gaussian": the standard deviation of its weights, in samples along each axis.
    """

    kind: EstimatorKind = "central"
    scale: float = 1.0

    def __post_init__(self) -> None:
        if self.kind not in ESTIMATOR_KINDS:
            raise InputError(f"gradient: the estimator is one of {', '.join(ESTIMATOR_KINDS)}, and not {self.kind!r}")
        if not 0.1 <= self.scale <= 100:
            raise InputError(f"gradient: the scale is from 0.1 to 100 samples, and is {self.scale!r}")


CENTRAL = Estimator()


def gradients(volume: Volume, estimator: Estimator, box: Box = (slice(None),) * 3) -> NDArray[np.floating]:
    """Gradients at a box of samples, shape (nz, ny, nx, 3): x, y, z of the world, data units per smallest spacing."""
    raise NotImplementedError


def largest_component(volume: Volume, estimator: Estimator) -> float:
    """The largest absolute component of all gradients, data units per smallest spacing; 0 where none is finite."""
    raise NotImplementedError
