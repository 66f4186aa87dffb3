"""Renderers with mistakes planted in them: wrong functions of shaders, wrong attributes of modules.

A renderer with a cure switched off, or with one of the usual mistakes, shows that a check can fail. A mistake names the
function that is wrong; if that is gone, planting it is an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any, NamedTuple
from unittest.mock import patch

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.comparison import mistakes
from texvol.comparison.wrong_functions import WrongFunction, wrong_shaders
from texvol.opengl.compositor import Compositor
from texvol.rendering.renderer import Renderer
from texvol.slicing.slabs import slab_stacks
from texvol.textures import slab_texture


class Attribute(NamedTuple):
    """An attribute of a module or class, by its full name, and what stands in its place."""

    name: str
    value: Any


Mistake = WrongFunction | Attribute


def _linear(optical_depth: ArrayLike) -> NDArray[np.float64]:
    return np.minimum(np.asarray(optical_depth, dtype=np.float64), 1.0)


_MEDIUM_ENCODER = slab_texture._medium_encoder


def _straight(*arguments: Any) -> slab_texture.OfMedium:
    encode = _MEDIUM_ENCODER(*arguments)

    def straight(emission: NDArray[np.float64], extinction: NDArray[np.float64]) -> NDArray[np.float64]:
        texels = encode(emission, extinction)
        return np.concatenate([texels[:, :3] / np.maximum(texels[:, 3:], 1e-300), texels[:, 3:]], axis=1)

    return straight


LINEAR_OPACITY: tuple[Mistake, ...] = (
    mistakes.LINEAR_OPACITY,
    mistakes.LINEAR_OPACITY_OF_INTERVALS,
    Attribute("texvol.scene.optics.opacity_from_depth", _linear),
)
UNCLIPPED_END_SLABS: tuple[Mistake, ...] = (mistakes.UNCLIPPED_END_SLABS,)
MISSING_COSINE: tuple[Mistake, ...] = (mistakes.MISSING_COSINE,)
BACKS_ALPHA_IN_REGISTERS: tuple[Mistake, ...] = (mistakes.ALPHA_OF_THE_BACK,)
BACKS_ALPHA_IN_BLEND: tuple[Mistake, ...] = (
    Attribute("texvol.opengl.compositor.Compositor.under", (moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ONE)),
)
SWAPPED_ORDER: tuple[Mistake, ...] = (("vec4 over(vec4 front, vec4 back)", "return over_right(back, front);"),)
HALF_TEXEL_SHIFT: tuple[Mistake, ...] = (mistakes.HALF_A_TEXEL,)
SWAPPED_AXES: tuple[Mistake, ...] = (mistakes.other_axes("zyx"),)
PLANES_HALF_A_SAMPLE_OFF: Mistake = (
    "SampleWalk sample_walk(vec3 start, vec3 step, vec3 samples)",
    "return sample_walk_right(start + 0.5 / samples, step, samples);",
)
NORMAL_TO_HIGHER_VALUES: Mistake = (
    "vec3 normal_of(vec3 gradient, float magnitude)",
    "return normal_of_right(-gradient, magnitude);",
)
# A driver whose weights have 8 bits behind the binary point, as those of graphics cards have.
_IN_EIGHT_BITS = """
#if !FETCHED
    position = (floor((position * size - 0.5) * 256.0 + 0.5) / 256.0 + 0.5) / size;
#endif
    return """
EIGHT_BIT_WEIGHTS: tuple[Mistake, ...] = (
    (
        "vec4 interpolated(sampler3D texels, vec3 position)",
        f"vec3 size = vec3(textureSize(texels, 0));{_IN_EIGHT_BITS}interpolated_right(texels, position);",
    ),
    (
        "vec4 interpolated_entry(sampler2D table, vec2 position)",
        f"vec2 size = vec2(textureSize(table, 0));{_IN_EIGHT_BITS}interpolated_entry_right(table, position);",
    ),
)
# Texels of `extinction` with the straight colour, weighted by opacity only after the fetch.
STRAIGHT_COLOUR: tuple[Mistake, ...] = (
    Attribute("texvol.textures.slab_texture._medium_encoder", _straight),
    (
        "vec4 slab_color(vec4 texel, float length, vec3 position)",
        "texel *= held_scale; float opacity = opacity_from_depth(texel.a * length); "
        "return vec4(texel.rgb * opacity, opacity);",
    ),
)


@contextmanager
def planted(*mistakes: Mistake) -> Iterator[Renderer]:
    """A renderer of its own that has the mistakes in it.

    Raises
    ------
    ShaderError, AttributeError
        If a function or attribute no longer exists.
    """
    functions = [mistake for mistake in mistakes if not isinstance(mistake, Attribute)]
    with ExitStack() as stack:
        folder = stack.enter_context(wrong_shaders(*functions))
        for mistake in mistakes:
            if isinstance(mistake, Attribute):
                stack.enter_context(patch(mistake.name, mistake.value))
        yield stack.enter_context(Renderer(compositor=partial(Compositor, shaders=folder)))


@contextmanager
def one_slab_per_blend() -> Iterator[None]:
    """Every slab blended by itself into the target, and none composited in registers."""
    with slabs_per_blend(1):
        yield


@contextmanager
def slabs_per_blend(count: int) -> Iterator[None]:
    """As many slabs composited in registers, and then blended into the target."""

    def stacks(volume, camera, slab_thickness, size, per_stack=count, *part):  # type: ignore[no-untyped-def]
        return slab_stacks(volume, camera, slab_thickness, size, count, *part)

    with patch("texvol.rendering.render.slab_stacks", stacks):
        yield
