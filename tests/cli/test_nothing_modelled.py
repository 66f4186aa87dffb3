"""What a scene does without costs it nothing: no gradient, no bytes, no code; and what it has is said, and no more."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import cache
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from support.lit_scenes import FOG, KINDS, LIGHTS, SUN, framed, smooth

import texvol
from texvol.__main__ import main
from texvol.rendering.modelled import modelled
from texvol.rendering.renderer import Renderer
from texvol.scene import gradient
from texvol.scene.added_volume import AddedVolume
from texvol.scene.display import NUMBER_MODES
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import Classification, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume

SIZE = (12, 12)
kinds = pytest.mark.parametrize("kind", KINDS)
VOLUME = smooth()
CAMERA = framed(VOLUME)
OF_LIGHT = {"LIT", "HEAD_LIGHT", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "SPECULAR", "TWO_SIDED", "SHADOWS"}
OF_GRADIENTS = {"GRADIENT", "MODULATIONS", "GRADED", "CONTOURS"}
UNIFORMS = {
    *("ambient", "diffuse", "fade", "specular", "shininess", "head_color", "directions", "positions", "to_eye_middle"),
    *("light_transmittance", "cue", "modulation_base", "graded_positions", "contour_positions"),
}

MODULATED = replace(FOG, modulation=np.array([(0.0, 0.5), (1.0, 1.0)]))
GRADED = replace(FOG, graded=(Graded([0.2, 0.8], np.zeros((2, 3)), [0.1, 0.1], 0.0, 1.0),))
CONTOURED = replace(FOG, contours=(Contour(0.5, 1.0, (0, 0, 0), 0.1),))
GAS = TransferFunction(FOG.values, FOG.colors, FOG.extinctions, emissive=True)


def plain(kind: Classification = "slab", **further: Any) -> Scene:
    return Scene(VOLUME, FOG, CAMERA, classification=kind, **further)


class GradientComputed(Exception):
    pass


@cache
def users_of_gradients() -> list[tuple[ModuleType, str]]:
    """Modules of texvol, each with a name by which it can compute gradients; all modules are imported first."""
    for module in pkgutil.walk_packages(texvol.__path__, "texvol."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    originals = {gradient.gradients, gradient.largest_component, gradient._Field}
    own = [module for name, module in sys.modules.items() if name.startswith("texvol")]
    names = ((module, name, held) for module in own for name, held in vars(module).items() if callable(held))
    return [(module, name) for module, name, held in names if any(held is original for original in originals)]


@contextmanager
def no_gradients() -> Iterator[None]:
    """Whoever computes a gradient, by whatever name it has it, gets an error."""

    def refuse(*_: object, **__: object) -> None:
        raise GradientComputed

    with ExitStack() as stack:
        for module, name in users_of_gradients():
            stack.enter_context(patch.object(module, name, refuse))
        yield


PLAIN: dict[str, Scene] = {
    **{kind: plain(kind) for kind in KINDS},
    "perspective": replace(plain("post"), camera=framed(VOLUME, "perspective")),
    "background": replace(plain("post"), background=(0.1, 0.2, 0.3)),
    "emissive": replace(plain("integrated"), transfer_function=GAS),
    "proposed": replace(plain(), transfer_function=None, lighting="none"),
    "no camera": replace(plain(), camera=None),
    **{f"cue, {kind}": plain(kind, depth_cue=DepthCue()) for kind in KINDS},
    **{mode: plain(mode=mode, lighting=Lighting()) for mode in NUMBER_MODES},
    **{f"{mode}, modulated": replace(plain(mode=mode), transfer_function=MODULATED) for mode in NUMBER_MODES},
}
NEEDS = {
    "light": lambda kind: plain(kind, lighting=Lighting()),
    "modulation": lambda kind: replace(plain(kind), transfer_function=MODULATED),
}


@pytest.mark.parametrize("name", PLAIN)
def test_no_gradient_is_computed_and_no_code_of_light_compiled(name: str) -> None:
    scene = PLAIN[name]
    with no_gradients(), Renderer() as renderer:
        renderer.render(scene, SIZE)
        assert renderer.stats["estimated_error"] >= 0  # which draws another picture
        assert renderer.stats["samples"] > 0  # which compiles another program
        found = programs(renderer)
        assert not renderer._pictures.in_memory.cache._shadows._programs.kept
    assert found
    of_cue = {"CUE", "cue"} if scene.depth_cue else set()
    for switches, uniforms in found:
        assert {each for each in OF_LIGHT | OF_GRADIENTS | {"CUE"} if switches.get(each)} <= of_cue
        assert uniforms & UNIFORMS <= of_cue


@kinds
@pytest.mark.parametrize("name", NEEDS)
def test_the_refusal_finds_a_gradient(kind: Classification, name: str) -> None:
    # Another volume: of this one the largest gradient may be known.
    scene = replace(NEEDS[name](kind), volume=smooth())
    with no_gradients(), Renderer() as renderer, pytest.raises(GradientComputed):
        renderer.render(scene, SIZE)


def test_facts_about_a_volume_take_no_gradient(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "v.npy"
    np.save(path, VOLUME.values)
    with no_gradients():
        assert main(["info", str(path)]) == 0
        assert main(["info", str(path), "--json"]) == 0
    assert "dimensions" in capsys.readouterr().out


@pytest.mark.parametrize("dtype, alone, beside", [("u1", 1, 8), ("i2", 2, 8), ("f4", 4, 16), ("f2", 2, 16)])
@pytest.mark.parametrize("kind", ["post", "integrated"])
def test_a_texture_has_the_bytes_of_what_it_holds(
    renderer: Renderer, kind: Classification, dtype: str, alone: int, beside: int
) -> None:
    volume = smooth(dtype, 0, 100)
    medium = TransferFunction(100 * FOG.values, FOG.colors, FOG.extinctions)
    for lighting, cue, size in ((None, None, alone), (None, DepthCue(), alone), (Lighting(), None, beside)):
        scene = Scene(volume, medium, CAMERA, classification=kind, lighting=lighting, depth_cue=cue)
        renderer.render(scene, SIZE)
        # A smooth float32 volume may do with 16 bits, under `post`.
        fewer = {4: 2, 16: 8}.get(size, size) if kind == "post" and dtype == "f4" else size
        assert renderer._pictures.in_memory.cache.volumes[0].textures.bytes in (
            fewer * volume.values.size,
            size * volume.values.size,
        )


@pytest.mark.parametrize("kind", ["slab", "extinction"])
def test_lit_texels_are_as_large_as_others(renderer: Renderer, kind: Classification) -> None:
    sizes = []
    for lighting in (None, Lighting()):
        renderer.render(plain(kind, lighting=lighting), SIZE, texture_format="rgba16f")
        sizes.append(renderer._pictures.in_memory.cache.volumes[0].textures.bytes)
    assert sizes == [8 * VOLUME.values.size] * 2


def programs(renderer: Renderer) -> list[tuple[dict[str, int], set[str]]]:
    """Switches and uniforms of what has been compiled."""
    return [(dict(key[1:]), set(program)) for key, program in renderer._compositor._programs.kept.items()]


@kinds
def test_what_is_on_is_compiled(kind: Classification) -> None:
    lit_when_drawn = kind in ("post", "integrated")
    with Renderer() as renderer:
        renderer.render(plain(kind, lighting=Lighting(two_sided=False, specular=0), depth_cue=DepthCue()), SIZE)
        [(switches, uniforms)] = programs(renderer)
    wanted = {"LIT", "HEAD_LIGHT", "GRADIENT", "CUE"} if lit_when_drawn else {"CUE"}
    assert {name for name in OF_LIGHT | OF_GRADIENTS | {"CUE"} if switches.get(name)} == wanted
    assert {"cue", "cue_range"} <= uniforms
    assert ("ambient" in uniforms) == lit_when_drawn


LAMP = Light("point", (1.0, 9.0, 11.0))
MODELLED: dict[str, tuple[Scene, list[str]]] = {
    "nothing": (plain(), []),
    "perspective": (PLAIN["perspective"], ["perspective"]),
    "background": (PLAIN["background"], ["background"]),
    "emissive": (PLAIN["emissive"], ["emissive"]),
    "cue": (plain(depth_cue=DepthCue()), ["depth cue"]),
    "modulation": (NEEDS["modulation"]("post"), ["central gradient", "gradient modulation"]),
    "graded": (replace(plain("post"), transfer_function=GRADED), ["central gradient", "graded materials"]),
    "contours": (replace(plain("post"), transfer_function=CONTOURED), ["central gradient", "contours"]),
    "head": (plain(lighting=LIGHTS["head"]), ["central gradient", "head light", "highlights"]),
    "matt": (plain(lighting=Lighting(specular=0)), ["central gradient", "head light"]),
    "sun": (plain(lighting=Lighting((SUN,), specular=0)), ["central gradient", "directional lights"]),
    "lamp": (plain(lighting=Lighting((LAMP,), specular=0)), ["central gradient", "point lights"]),
    "ambient": (plain(lighting=Lighting(())), ["central gradient", "ambient light"]),
    "gaussian": (
        plain(lighting=Lighting(specular=0), gradient=gradient.Estimator("gaussian", 1.0)),
        ["gaussian gradient", "head light"],
    ),
    "shadows": (
        plain(lighting=Lighting((SUN,), specular=0, shadows=True)),
        ["central gradient", "directional lights", "shadows"],
    ),
    **{mode: (plain(mode=mode, lighting=Lighting()), [mode]) for mode in NUMBER_MODES},
    "isosurface": (
        plain(mode="isosurface", isovalue=0.5, lighting=Lighting(specular=0)),
        ["isosurface", "central gradient", "head light"],
    ),
    "mask": (plain(mask=Mask(VOLUME.values > 0)), ["mask"]),
    "labels": (Scene(Volume(np.ones((2, 2, 2)), labels=True), FOG, CAMERA, classification="slab"), ["labels"]),
    "colours": (
        Scene(Volume(np.ones((2, 2, 2)), colors=np.ones((2, 2, 2, 3))), FOG, CAMERA, classification="slab"),
        ["colours"],
    ),
    "several volumes": (
        plain(added=(AddedVolume(Volume(np.ones((2, 2, 2)), labels=True)), AddedVolume(VOLUME, GAS))),
        ["several volumes", "labels", "emissive"],
    ),
    "what only an added volume has": (
        plain("post", added=(AddedVolume(VOLUME, CONTOURED, Mask(VOLUME.values > 0)),)),
        ["several volumes", "mask", "contours", "central gradient"],
    ),
}


@pytest.mark.parametrize("name", MODELLED)
def test_what_is_modelled_is_said_and_no_more(name: str) -> None:
    scene, expected = MODELLED[name]
    assert sorted(modelled(scene.completed(SIZE))) == sorted(expected)


@pytest.mark.parametrize("name", ["nothing", "head"])
def test_the_stats_have_it(renderer: Renderer, name: str) -> None:
    scene, expected = MODELLED[name]
    renderer.render(scene, SIZE)
    assert renderer.stats["modelled"] == expected


@kinds
def test_light_that_is_taken_away_leaves_nothing_behind(renderer: Renderer, kind: Classification) -> None:
    """The picture and the bytes of a scene without light are the same before one with it and after."""
    pictures, sizes = [], []
    for lighting in (None, Lighting(), None):
        pictures.append(renderer.render(plain(kind, lighting=lighting), SIZE))
        sizes.append(renderer._pictures.in_memory.cache.volumes[0].textures.bytes)
    np.testing.assert_array_equal(pictures[0], pictures[2])
    assert sizes[0] == sizes[2]
    assert np.abs(pictures[1] - pictures[0]).max() > 0.01
