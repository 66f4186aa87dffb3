"""Mistakes planted in the renderer itself are named after what they do to the picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support import planted
from support.gallery import drawing as gallery
from support.gallery.entries import ENTRIES
from support.gallery.volumes import built_in
from support.real_data import every_other_sample, real_volume
from support.scenes import BONE, FOG, random_volume, smooth_volume

from texvol.comparison.kinds import kinds_of
from texvol.formats.pictures import image
from texvol.formats.readers import load
from texvol.rendering.renderer import Renderer
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction

SIZE = (160, 150)
THIN = TransferFunction(
    np.array([0, 0.2, 0.4]), np.array([(0.1, 0.2, 0.9), (0.9, 0.5, 0.2), (1, 1, 0.9)]), np.array([0, 0.02, 0.1])
)
SCENES = {
    "fog": lambda: Scene(smooth_volume(32), FOG, classification="post"),
    "bone": lambda: Scene(smooth_volume(32), BONE, classification="slab"),
    "noise": lambda: Scene(random_volume(3, (12, 11, 10)), FOG, classification="extinction"),
    "cloud": lambda: Scene(built_in("cloud"), THIN, classification="integrated"),
    "engine": lambda: Scene(
        every_other_sample(load(real_volume("engine/engine.nii.gz"))),
        TransferFunction(
            np.array([60.0, 90, 150, 180, 255]),
            np.array([(0.35, 0.5, 0.6)] * 2 + [(0.45, 0.55, 0.6), (0.9, 0.5, 0.12), (1, 0.75, 0.3)]),
            np.array([0, 0.01, 0.01, 0.2, 0.3]),
        ),
        classification="slab",
    ),
}


Draw = Callable[[str], np.ndarray]


@cache
def scene_of(name: str) -> Scene:
    scene = SCENES[name]()
    # Without a camera of its own a scene is framed by what shows of its medium, which is changed here.
    return replace(scene, camera=scene.completed(SIZE).camera)


def drawn(renderer: Renderer, scene: Scene, **options) -> np.ndarray:  # type: ignore[no-untyped-def]
    return renderer.render(scene, SIZE, **{"sampling_rate": 2, **options})


@pytest.fixture(scope="module")
def right(renderer: Renderer) -> Draw:
    """The right picture of a scene by its name, drawn once."""
    return cache(lambda name: drawn(renderer, scene_of(name)))


@pytest.mark.parametrize("name", SCENES)
def test_over_in_the_wrong_order(name: str, right: Draw) -> None:
    with planted.planted(*planted.SWAPPED_ORDER) as mistaken:
        candidate = drawn(mistaken, scene_of(name))
    assert kinds_of(candidate, right(name))[0].name == "swapped order"


@pytest.mark.parametrize("ratio", [0.5, 2])
@pytest.mark.parametrize("name", SCENES)
def test_slabs_of_another_thickness(name: str, ratio: float, renderer: Renderer, right: Draw) -> None:
    scene = scene_of(name)
    medium = scene.transfer_function
    assert medium is not None
    thicker = replace(medium, extinctions=medium.extinctions * ratio)
    first = kinds_of(drawn(renderer, replace(scene, transfer_function=thicker)), right(name))[0]
    assert first.name == "scaled opacity"
    # Texels of slabs mix opacities, and not depths: that is another 1e-2.
    assert first.parameters["ratio"] == pytest.approx(ratio, rel=0.02)


@pytest.mark.parametrize("name", ["fog", "bone", "noise", "engine"])  # the cloud does not reach its box
def test_end_slabs_that_are_not_clipped(name: str, right: Draw) -> None:
    with planted.planted(*planted.UNCLIPPED_END_SLABS) as mistaken:
        candidate = drawn(mistaken, scene_of(name))
    for one, two, side in ((candidate, right(name), "candidate"), (right(name), candidate, "reference")):
        first = kinds_of(one, two)[0]
        assert first.name == "edges only" and first.parameters["end_slabs"] == side
        assert "not clipped" in first.words


@pytest.mark.parametrize("target, words", [("rgba8", "255 steps"), ("rgba16f", "half floats")])
@pytest.mark.parametrize("name", SCENES)
def test_targets_of_few_digits(name: str, target: str, words: str, renderer: Renderer, right: Draw) -> None:
    first = kinds_of(drawn(renderer, scene_of(name), target_format=target), right(name))[0]
    assert first.name == "banding" and words in first.words


@pytest.mark.parametrize("name", SCENES)
def test_srgb_written_for_linear(name: str, right: Draw) -> None:
    picture = right(name)
    levels = image.eight_bits(picture).astype(np.float32) / 255
    opaque = np.ones((*picture.shape[:2], 1), np.float32)
    candidate, reference = (np.concatenate([each[..., :3], opaque], axis=2) for each in (levels, picture))
    first = kinds_of(candidate, reference, has_opacity=False)[0]
    assert (first.name, first.parameters["encoded"]) == ("gamma", "candidate")


NO_KIND = {
    "LINEAR_OPACITY": ("fog", "bone", "engine"),
    "BACKS_ALPHA_IN_REGISTERS": ("bone", "noise", "engine"),
    "SWAPPED_AXES": ("fog", "noise"),
}


@pytest.mark.parametrize("mistake, name", [(mistake, name) for mistake, names in NO_KIND.items() for name in names])
def test_what_no_kind_fits_is_not_called_by_a_name_that_lies(mistake: str, name: str, right: Draw) -> None:
    with planted.planted(*getattr(planted, mistake)) as mistaken:
        candidate = drawn(mistaken, scene_of(name))
    found = {kind.name for kind in kinds_of(candidate, right(name))}
    # A wrong opacity of thin slabs does look like a factor; all of these are no such thing.
    lies = {"gamma", "straight colour", "shifted", "swapped order", "noise", "banding", "channels swapped", "flipped"}
    assert found and not found & lies


def test_linear_opacity_of_thin_contours_is_no_wood_grain(renderer: Renderer) -> None:
    scene = gallery.scene_of(ENTRIES["orbital"], gallery.data_folder(), SIZE)
    assert scene is not None
    scene = replace(scene, background=(0.0, 0.0, 0.0))
    with planted.planted(*planted.LINEAR_OPACITY) as mistaken:
        candidate = drawn(mistaken, scene)
    # One-sided and jagged as wood grain is; but it bends where the contours do.
    assert not any("end_slabs" in kind.parameters for kind in kinds_of(candidate, drawn(renderer, scene)))
