"""Mistakes planted in the renderer: its own files with a line replaced, compiled and drawn with.

A renderer with a cure switched off, or with one of the usual mistakes, shows that a check can fail. Shaders are
replaced as `texvol.comparison.planting` does it; here modules can be, too.
"""

from __future__ import annotations

import importlib
import sys
import types
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from unittest.mock import patch

import texvol
from texvol.comparison.planting import Replacement, replaced, replaced_shaders
from texvol.opengl.compositor import Compositor
from texvol.rendering.renderer import Renderer
from texvol.slicing.slabs import slab_stacks

PACKAGE = Path(texvol.__file__).parent

# Where a module's planted twin has to be put for the renderer to use it.
_USERS = {
    "opengl/compositor.py": "texvol.rendering.renderer.Compositor",
    "scene/optics.py": "texvol.textures.slab_texture.optics",
    "textures/slab_texture.py": "texvol.rendering.render.slab_texture",
}

LINEAR_OPACITY: tuple[Replacement, ...] = (
    ("optics.glsl", "return x < 0.5 ? series : 1.0 - exp(-x);", "return min(x, 1.0);"),
    ("optics.glsl", "return opacity;", "return min(x, 1.0);"),
    (
        "scene/optics.py",
        "return -np.expm1(-np.asarray(optical_depth, dtype=np.float64))",
        "return np.minimum(np.asarray(optical_depth, dtype=np.float64), 1.0)",
    ),
)
UNCLIPPED_END_SLABS: tuple[Replacement, ...] = (
    ("box_walk.glsl", "walk.first_fraction = float(interval.x - floor(interval.x));", "walk.first_fraction = 0.0;"),
    (
        "box_walk.glsl",
        "walk.last_fraction = float(interval.y - (ceil(interval.y) - 1.0));",
        "walk.last_fraction = 1.0;",
    ),
)
# The uniform has to stay in use, or setting it is an error.
MISSING_COSINE: tuple[Replacement, ...] = (
    ("obliquity.glsl", "sqrt(1.0 + dot(tangent, tangent))", "sqrt(1.0 + 1e-20 * dot(tangent, tangent))"),
)
BACKS_ALPHA_IN_REGISTERS: tuple[Replacement, ...] = (
    ("optics.glsl", "return front + (1.0 - front.a) * back;", "return front + (1.0 - back.a) * back;"),
)
BACKS_ALPHA_IN_BLEND: tuple[Replacement, ...] = (
    ("opengl/compositor.py", "under = (moderngl.ONE_MINUS_DST_ALPHA,", "under = (moderngl.ONE_MINUS_SRC_ALPHA,"),
)
HALF_TEXEL_SHIFT: tuple[Replacement, ...] = (
    (
        "volume_texture.glsl",
        "textureLod(texels, position, 0.0)",
        "textureLod(texels, position + 0.5 / vec3(textureSize(texels, 0)), 0.0)",
    ),
)
SWAPPED_AXES: tuple[Replacement, ...] = (
    ("volume_texture.glsl", "textureLod(texels, position, 0.0)", "textureLod(texels, position.zyx, 0.0)"),
)
# Texels of `extinction` with the straight colour, weighted by opacity only after the fetch.
STRAIGHT_COLOUR: tuple[Replacement, ...] = (
    (
        "textures/slab_texture.py",
        "return np.concatenate([glow, depth], axis=1)",
        "return np.concatenate([glow / np.maximum(depth, 1e-300), depth], axis=1)",
    ),
    (
        "sampled_slabs.glsl",
        "vec4(texel.rgb * (length * mean_transmittance(depth, opacity)), opacity)",
        "vec4(texel.rgb * opacity, opacity)",
    ),
)


@contextmanager
def planted(*replacements: Replacement) -> Iterator[Renderer]:
    """A renderer of its own that has the mistakes in it."""
    modules = {name: (PACKAGE / name).read_text(encoding="utf-8") for name in _USERS}
    touched = {file for file, _, _ in replacements} & set(modules)
    for file, old, new in replacements:
        if file in modules:
            modules[file] = replaced(file, modules[file], old, new)
    in_shaders = [each for each in replacements if each[0] not in modules]
    with ExitStack() as stack:
        folder = stack.enter_context(replaced_shaders(*in_shaders))
        twins = {file: _module(file, modules[file]) for file in touched}
        compositor = twins.pop("opengl/compositor.py").Compositor if "opengl/compositor.py" in twins else Compositor
        stack.enter_context(patch("texvol.rendering.renderer.Compositor", partial(compositor, shaders=folder)))
        for file, twin in twins.items():
            stack.enter_context(patch(_USERS[file], twin))
        yield stack.enter_context(Renderer())


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


def _module(file: str, text: str) -> types.ModuleType:
    """A module of that text, which sees the same neighbours as the real one."""
    name = f"texvol.{file.removesuffix('.py').replace('/', '.')}"
    importlib.import_module(name)
    twin = types.ModuleType(f"{name}_planted")
    twin.__file__ = str(PACKAGE / file)
    sys.modules[twin.__name__] = twin
    exec(compile(text, twin.__file__, "exec"), twin.__dict__)
    return twin
