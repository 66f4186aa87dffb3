"""Mistakes planted in the renderer: its own files with a line replaced, compiled and drawn with.

A renderer with a cure switched off, or with one of the usual mistakes, shows that a check can fail. The files stay as
they are; each replacement has to match exactly once, so that none goes stale unseen.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
import types
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from unittest.mock import patch

import texvol
from texvol.renderer import Renderer
from texvol.shaders import FOLDER, load_program
from texvol.slicing import slab_stacks

PACKAGE = Path(texvol.__file__).parent
Replacement = tuple[str, str, str]  # file, what stands there, what is to

# Where a module's planted twin has to be put for the renderer to use it.
_USERS = {
    "compositor.py": "texvol.renderer.Compositor",
    "optics.py": "texvol.slab_texture.optics",
    "slab_texture.py": "texvol.render.slab_texture",
}

LINEAR_OPACITY: tuple[Replacement, ...] = (
    ("optics.glsl", "return x < 0.5 ? series : 1.0 - exp(-x);", "return min(x, 1.0);"),
    (
        "optics.py",
        "return -np.expm1(-np.asarray(optical_depth, dtype=np.float64))",
        "return np.minimum(np.asarray(optical_depth, dtype=np.float64), 1.0)",
    ),
)
UNCLIPPED_END_SLABS: tuple[Replacement, ...] = (
    ("ray.glsl", "ray.first_share = float(inside.x - floor(inside.x));", "ray.first_share = 0.0;"),
    ("ray.glsl", "ray.last_share = float(inside.y - (ceil(inside.y) - 1.0));", "ray.last_share = 1.0;"),
)
# The uniform has to stay in use, or setting it is an error.
MISSING_COSINE: tuple[Replacement, ...] = (
    ("ray.glsl", "sqrt(1.0 + dot(tangent, tangent))", "sqrt(1.0 + 1e-20 * dot(tangent, tangent))"),
)
BACKS_ALPHA_IN_REGISTERS: tuple[Replacement, ...] = (
    ("optics.glsl", "return front + (1.0 - front.a) * back;", "return front + (1.0 - back.a) * back;"),
)
BACKS_ALPHA_IN_BLEND: tuple[Replacement, ...] = (
    ("compositor.py", "(moderngl.ONE_MINUS_DST_ALPHA if", "(moderngl.ONE_MINUS_SRC_ALPHA if"),
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
        "slab_texture.py",
        "return np.concatenate([glow, depth], axis=1)",
        "return np.concatenate([glow / np.maximum(depth, 1e-300), depth], axis=1)",
    ),
    (
        "slab_stack.frag",
        "vec4(texel.rgb * (length * mean_transmittance(depth, opacity)), opacity)",
        "vec4(texel.rgb * opacity, opacity)",
    ),
)


@contextmanager
def planted(*replacements: Replacement) -> Iterator[Renderer]:
    """A renderer of its own that has the mistakes in it."""
    shaders = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.iterdir() if path.is_file()}
    modules = {name: (PACKAGE / name).read_text(encoding="utf-8") for name in _USERS}
    touched = {file for file, _, _ in replacements}
    for file, old, new in replacements:
        texts = shaders if file in shaders else modules
        assert texts[file].count(old) == 1, f"{file} has {texts[file].count(old)} times, and not once: {old}"
        texts[file] = texts[file].replace(old, new)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in shaders.items():
            (folder / file).write_text(text, encoding="utf-8")
        load = partial(load_program, folder=folder)
        patches = [patch("texvol.compositor.load_program", load)]
        for file in touched & set(modules):
            twin = _module(file, modules[file])
            if file == "compositor.py":
                twin.load_program = load  # type: ignore[attr-defined]
            user = _USERS[file]
            patches.append(patch(user, getattr(twin, "Compositor", twin)))
        for each in patches:
            each.start()
        try:
            with Renderer() as renderer:
                yield renderer
        finally:
            for each in reversed(patches):
                each.stop()


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

    with patch("texvol.render.slicing.slab_stacks", stacks):
        yield


def _module(file: str, text: str) -> types.ModuleType:
    """A module of that text, which sees the same neighbours as the real one."""
    name = f"texvol.{file.removesuffix('.py')}"
    importlib.import_module(name)
    twin = types.ModuleType(f"{name}_planted")
    twin.__file__ = str(PACKAGE / file)
    sys.modules[twin.__name__] = twin
    exec(compile(text, twin.__file__, "exec"), twin.__dict__)
    return twin
