"""Classification after interpolation: the value as a 3D texture, the transfer function as a table of segments.

    post         one value in the middle of each slab, looked up in the transfer function
    integrated   values at both ends and in the middle of each slab; the transfer function is integrated exactly along
                 the two lines between them

The value keeps the data's own type where the driver interpolates that exactly: 16 bits for integers of 8 and 16 (Mesa
interpolates 8-bit texels with 8-bit weights, 7e-3 off; 16-bit ones to 1e-7), half and single precision as they are.
What is wider, or would lose the digits that the transfer function looks at, is stored relative to an offset: see
`value_storage`.

Where light or the medium asks for gradients a texel is gradient and value together, so that one fetch gives both: 16
bits each where the value is an integer of at most that, single precision otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene import optics
from texvol.scene.gradient import Estimator, gradients, largest_component
from texvol.scene.mask import Mask
from texvol.scene.scene import Classification
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.slabs import SLABS_PER_STACK
from texvol.textures.graded_uniforms import graded_switches, graded_uniforms
from texvol.textures.slab_texture import Box
from texvol.textures.stored_function import StoredFunction, stored_function
from texvol.textures.value_storage import (
    Features,
    Storage,
    features_of_medium,
    other_storage,
    storage_of,
    stored_values,
)

_PAST_HUGE = 1e31  # what infinities are not mistaken for: there a missing neighbour needs a weight of 3e-8 to be seen
_PAST_ALL = 2.0  # times the largest stored value, if that is not 0
# 16 bits of a gradient's component: 0 is a number of its own, so that nothing leans anywhere in a flat region.
_NO_GRADIENT = 32767
_MOST_GRADIENTS = 128.0  # the largest gradient in features, of which 16 bits still tell directions by a 256th
_FARTHEST_GRADIENT = 1e12  # likewise, of which squares are still numbers
REFERENCE = "reference"  # a texel format: values rounded otherwise, to see what rounding does
Rounded = Literal["nothing", "gradients", "values"]  # what texels have too few digits of
_LARGEST: WeakKeyDictionary[Volume, dict[Estimator, float]] = WeakKeyDictionary()


@dataclass(frozen=True)
class ValueTexture:
    """Storage of values, shape (nz, ny, nx, 1), in a texture, and the transfer function in the same units.

    A fetched value v stands for `offset + scale * v` in data units. `length_unit` (world units) is what extinction and
    emission are counted per.
    """

    volume: Volume
    texel_format: str
    storage: Storage
    transfer_function: TransferFunction
    classification: Classification
    length_unit: float
    estimator: Estimator | None = None
    largest_component: float = 0.0  # of a gradient, data units per smallest spacing
    mask: Mask | None = None

    def texels(self, box: Box = (slice(None),) * 3) -> NDArray:
        """Texels of a box of samples, shape (nz, ny, nx, 1), or 4: gradient and value."""
        storage = replace(self.storage, texel_format="r32f") if self.texel_format == "rgba32f" else self.storage
        values = stored_values(self.volume.values[box], storage)
        if self.estimator is None:
            return values[..., np.newaxis]
        fractions = gradients(self.volume, self.estimator, box)
        fractions /= fractions.dtype.type(self.largest_component)
        texels = np.empty((*values.shape, 4), values.dtype)
        if values.dtype == np.uint16:
            fractions *= fractions.dtype.type(_NO_GRADIENT)
            texels[..., :3] = np.rint(fractions, out=fractions) + fractions.dtype.type(_NO_GRADIENT)
        else:
            texels[..., :3] = fractions
        texels[..., 3] = values
        return texels

    def all_texels(self, box: Box) -> dict[str, NDArray]:
        """Texels of a box of samples, and its mask weights, shape (nz, ny, nx, 1), by the names of the samplers."""
        texels = {"texels": self.texels(box)}
        if self.mask is not None:
            weights = self.mask.array[box][..., np.newaxis]
            texels["weights"] = weights.view(np.uint8) * np.uint8(255) if weights.dtype == np.bool_ else weights
        return texels

    @property
    def formats(self) -> dict[str, tuple[str, int]]:
        """Texel format and numbers in a texel of each texture, by the name of its sampler."""
        formats = {"texels": (self.texel_format, 1 if self.estimator is None else 4)}
        if self.mask is not None:
            formats["weights"] = ("r8" if self.mask.array.dtype == np.bool_ else "r32f"), 1
        return formats

    @property
    def steps(self) -> tuple[float, float] | None:
        """The first of the values that texels can hold, and how far apart they are; None where they hold them all."""
        rounds = self.texel_format in ("r16", "rgba16") and self.volume.dtype.itemsize > 2
        return (self.storage.offset, self.storage.scale / 65535) if rounds else None

    @property
    def missing_from(self) -> float:
        """Magnitude of stored values beyond which there is none."""
        if self.volume.value_range != self.volume.finite_range:
            return _PAST_HUGE
        largest = max(abs(float(end)) for end in self.storage.stored(np.array(self.volume.finite_range or (0.0, 0.0))))
        return _PAST_ALL * largest or 1.0

    @property
    def largest_gradient(self) -> float:
        """Gradient component that is 1 in the shader, in data units per world unit."""
        return self.largest_component / self.length_unit

    @property
    def slabs_per_stack(self) -> int:
        """Largest number of slabs that a fragment goes through."""
        if self.classification == "post":
            return SLABS_PER_STACK
        return SLABS_PER_STACK // 64 if self.transfer_function.glows else SLABS_PER_STACK // 8

    def switches(self, slab_thickness: float, obliquity: float) -> dict[str, int]:
        """Switches of the shader; between two planes at distance 1 the longest ray's length is `obliquity`."""
        post = self.classification == "post"
        deepest = float(self.transfer_function.extinctions.max()) * slab_thickness * obliquity
        return {
            "CLASSIFICATION": 2 if post else 3,
            "EMISSIVE": 2 if self.transfer_function.premultiplied else int(self.transfer_function.emissive),
            "MISSING": int(self.volume.has_missing),
            "RAMPS": self._function.number_of_ramps,
            "GRADIENT": self.gradient_switch,
            "WEIGHTS": int(self.mask is not None),
            "SHALLOW": int(optics.is_shallow(deepest) and not self.transfer_function.needs_gradient),
        } | graded_switches(self.transfer_function)

    def uniforms(self, slab_thickness: float) -> dict[str, Any]:
        """Uniforms of the shader."""
        length: dict[str, Any] = {"slab_length": slab_thickness / self.length_unit}
        if self.volume.has_missing:
            length["missing_from"] = self.missing_from
        if self.estimator is not None:
            length |= graded_uniforms(self.transfer_function, self.storage, self.length_unit, self.largest_gradient)
        return length | self._function_uniforms

    def classified(self, classification: Classification) -> ValueTexture:
        """Return the same texels for another classification."""
        return self if self.classification == classification else replace(self, classification=classification)

    @property
    def gradient_switch(self) -> int:
        """The shader's switch GRADIENT."""
        if self.estimator is None:
            return 0
        return 2 if self.texel_format == "rgba16" else 1

    @property
    def tables(self) -> dict[str, NDArray[np.float32]]:
        """Tables of the transfer function."""
        return self._function.tables

    @property
    def _function_uniforms(self) -> dict[str, Any]:
        return self._function.uniforms

    @property
    def _function(self) -> StoredFunction:
        return stored_function(self.transfer_function, self.storage, self.classification, self.length_unit)


def bake_values(
    volume: Volume,
    transfer_function: TransferFunction,
    classification: Classification,
    texel_format: str = "exact",
    estimator: Estimator | None = None,
    mask: Mask | None = None,
    features: Features | None = None,
) -> ValueTexture:
    """The volume's values as a texture, as they are or, in "r16" and "rgba16", rounded to 65536 steps of their range.

    Of the transfer function nothing but the tables and, where that matters, offset and scale depend; or these depend on
    other `features`. In `REFERENCE` values are rounded otherwise than they usually are. With an estimator its gradients
    are beside the values; a mask has a texture of its own.
    """
    features = features_of_medium(transfer_function, volume) if features is None else features
    storage = storage_for(volume, features, texel_format)
    kind, largest = storage.texel_format, 0.0
    if estimator is not None:
        largest = known_largest_component(volume, estimator) or 1.0
        fine = features.finest < largest / _MOST_GRADIENTS and volume.dtype.itemsize > 1
        kind = "rgba16" if kind == "r16" and texel_format not in ("rgba32f", REFERENCE) and not fine else "rgba32f"
        largest = _gradient_scale(largest, features.finest) if kind == "rgba32f" else largest
    elif kind == "r16" and volume.dtype.itemsize == 1:
        kind, storage = "r8", replace(storage, texel_format="r8")
    unit = volume.smallest_spacing
    return ValueTexture(volume, kind, storage, transfer_function, classification, unit, estimator, largest, mask)


def _gradient_scale(largest: float, finest: float) -> float:
    """Scale of stored gradients with which the squares of the features' and of the largest are numbers in float32."""
    if not largest > _FARTHEST_GRADIENT * finest:
        return largest
    return max(np.sqrt(largest) * np.sqrt(finest), largest / 1e18)


def storage_for(volume: Volume, features: Features, texel_format: str) -> Storage:
    """Return the storage of values in a texel format that was asked for."""
    storage = storage_of(volume, features)
    if texel_format == REFERENCE:
        return storage if storage.vouches_for_itself(volume) else other_storage(volume, features)
    if texel_format in ("r16", "rgba16") and storage.texel_format != "r16" and (span := span_in_16_bits(volume)):
        assert volume.finite_range is not None
        return Storage("r16", volume.finite_range[0], span)
    return storage


def known_largest_component(volume: Volume, estimator: Estimator) -> float:
    """`gradient.largest_component`, worked out once for as long as there is the volume."""
    known = _LARGEST.setdefault(volume, {})
    if estimator not in known:
        known[estimator] = largest_component(volume, estimator)
    return known[estimator]


def gradient_step(volume: Volume, estimator: Estimator) -> float:
    """Distance of the components that gradients of 16 bits can have, data units per smallest spacing."""
    return (known_largest_component(volume, estimator) or 1.0) / _NO_GRADIENT


def span_in_16_bits(volume: Volume) -> float | None:
    """The range of values of more than 16 bits that could be stored in those; None where there is none."""
    if volume.dtype.itemsize <= 2 or volume.has_missing or volume.value_range != volume.finite_range:
        return None
    low, high = volume.finite_range or (0.0, 0.0)
    return high - low if 0 < high - low < np.inf else None
