"""What a picture shows is told from its scene: the mistake, and of a dropped slab which one it was."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from support.benches import SIZE, MistakePictures, planted

from texvol.comparison import explaining
from texvol.comparison.explaining import mistakes_that_explain
from texvol.comparison.mistakes import CATALOGUE, MistakeTrial
from texvol.comparison.patience import Patience
from texvol.comparison.pictures import Picture
from texvol.comparison.planting import PlantedRenderer
from texvol.provenance.stored_scene import StoredScene
from texvol.scene.demo import demo_scene, demo_volume

COARSE_DEMO = replace(demo_scene(), volume=demo_volume(48))
Demo = tuple[MistakeTrial, MistakePictures]


@pytest.fixture(scope="module")
def renderer() -> Iterator[PlantedRenderer]:
    with PlantedRenderer() as opened:
        yield opened


@pytest.fixture(scope="module")
def demo(renderer: PlantedRenderer) -> Demo:
    return planted(renderer, COARSE_DEMO, slab_thickness=1 / 48)


@pytest.fixture
def drawn_once(demo: Demo, monkeypatch: pytest.MonkeyPatch) -> None:
    """The demo's mistakes are drawn for the first candidate only, and are the same pictures for all others."""
    _, pictures = demo
    monkeypatch.setattr(explaining, "drawn", lambda trial: ((each, pictures[each.name]) for each in CATALOGUE))


@pytest.mark.usefixtures("drawn_once")
@pytest.mark.parametrize("eight_bits", [False, True])
@pytest.mark.parametrize(
    "name", [each.name for each in CATALOGUE if each.name not in ("one wrong pixel", "unclipped end slabs")]
)
def test_a_planted_mistake_is_told_from_the_scene(name: str, eight_bits: bool, demo: Demo) -> None:
    bench, pictures = demo
    candidate, rounding = pictures[name], 0.0
    if eight_bits:
        if name in ("8-bit target", "missing cosine"):  # lost in what 8 bits round away
            return
        candidate, rounding = np.rint(np.clip(candidate, 0, 1) * 255) / 255, 0.5 / 255
    picture = replace(
        Picture.of_array(candidate), whole_numbers=eight_bits, rounding=np.full(candidate.shape, rounding, np.float32)
    )
    found, _ = mistakes_that_explain(picture, StoredScene(bench.scene, bench.settings))
    assert found[0].name == name
    assert found[0].explained > 0.9
    assert "the candidate equals the scene drawn with a mistake" in found[0].words


def test_any_dropped_slab_is_found_and_which(renderer: PlantedRenderer) -> None:
    bench, _ = planted(renderer, COARSE_DEMO, slab_thickness=1 / 48)
    renderer.render(bench.scene, SIZE, **bench.settings)
    first, end = renderer.slab_range()
    chosen = bench.slab[0] - 5
    assert np.abs(bench.without((chosen, chosen + 1)) - bench.right).max() > 1e-3
    candidate = Picture.of_array(bench.without((chosen, chosen + 1)))
    (found,), _ = mistakes_that_explain(candidate, StoredScene(bench.scene, bench.settings))
    assert found.name == "dropped slab"
    assert found.parameters == {"slab": chosen - first, "slabs": end - first}


@pytest.mark.usefixtures("drawn_once")
def test_what_no_mistake_explains_is_not_explained(demo: Demo) -> None:
    bench, _ = demo
    noise = np.random.default_rng(0).normal(0, 0.01, bench.right.shape)
    for candidate in (bench.right, bench.right + 1e-7, bench.right + noise, np.roll(bench.right, 1, axis=1)):
        assert mistakes_that_explain(Picture.of_array(candidate), StoredScene(bench.scene, bench.settings)) == ((), ())


def test_a_mistake_is_told_in_spite_of_a_pixel_that_is_not_finite(demo: Demo) -> None:
    bench, pictures = demo
    candidate = pictures["half a texel"].copy()
    candidate[3, 4] = np.nan
    found, _ = mistakes_that_explain(Picture.of_array(candidate), StoredScene(bench.scene, bench.settings))
    assert found[0].name == "half a texel"


def test_mistakes_that_take_too_long_are_left_out_and_said(demo: Demo) -> None:
    bench, pictures = demo
    candidate = Picture.of_array(pictures["half a texel"])
    found, notes = mistakes_that_explain(candidate, StoredScene(bench.scene, bench.settings), patience=Patience(0.0))
    assert found == ()
    assert len(notes) == 1
    assert f"0 of {len(CATALOGUE)} were drawn; --oracle draws all" in notes[0]
