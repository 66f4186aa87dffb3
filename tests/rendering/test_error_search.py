"""A wanted error of a scene: foreseen by a small picture, which is drawn once; found by the picture itself."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from support.quick_stats import quick_stats

from texvol.ray_casting import raycast
from texvol.rendering.error_control import smaller
from texvol.rendering.error_search import fewer
from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import Settings
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour
from texvol.scene.volume import Volume
from texvol.util import progress
from texvol.util.errors import AccuracyWarning

SIZE = (256, 192)
z, y, x = np.mgrid[tuple(slice(-1, 1, 32j) for _ in range(3))]
VOLUME = Volume(np.exp(-3 * (x**2 + y**2 + z**2)).astype(np.float32))
FOG = TransferFunction([0.2, 1.0], [(0.9, 0.4, 0.1), (0.2, 0.5, 0.9)], [0.0, 0.3])
SCENE = Scene(VOLUME, FOG, Camera.framing(VOLUME, aspect=4 / 3), classification="slab")


class Counting(Renderer):
    """Notes the pictures that it draws."""

    def __init__(self) -> None:
        self.drawn: list[tuple[int, int]] = []
        self.thicknesses: list[tuple[tuple[int, int], float]] = []
        self.kinds: list[tuple[tuple[int, int], str]] = []
        super().__init__()

    def _draw(self, scene: Scene, size: tuple[int, int], settings: Settings, *rest: int) -> np.ndarray:  # type: ignore[override]
        self.drawn.append(size)
        self.thicknesses.append((size, settings.slab_thickness))
        self.kinds.append((size, scene.classification))
        return super()._draw(scene, size, settings, *rest)


@pytest.fixture
def renderer() -> Iterator[Counting]:
    with Counting() as made:
        yield made


def test_a_sixteenth_of_the_pixels_where_that_is_enough() -> None:
    assert smaller((800, 600)) == (200, 150)
    assert smaller((100, 60)) == (48, 48)
    assert smaller((20, 8)) == (20, 8)
    assert fewer((800, 600)) == (100, 75)
    assert fewer((100, 60)) == (48, 48)
    assert fewer((20, 8)) == (20, 8)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_what_is_foreseen_is_drawn_once_and_changes_nothing(renderer: Counting, classification: str) -> None:
    scene = replace(SCENE, classification=classification)  # type: ignore[arg-type]
    foreseen = renderer.foresee(scene, SIZE, 1e-3)
    small = renderer.drawn.count(smaller(SIZE))
    assert small == len(renderer.drawn) >= 2
    renderer.foresee(scene, SIZE, 1e-3)
    assert len(renderer.drawn) == small, "the small pictures are remembered"
    picture, settings = renderer.render(scene, SIZE, max_error=1e-3), renderer.settings
    halvings = round(np.log2(renderer.uniform_settings["slab_thickness"] / foreseen.slab_thickness))
    assert -1 <= halvings <= 2
    with Renderer() as other:
        assert np.array_equal(other.render(scene, SIZE, max_error=1e-3), picture)
        assert other.settings == settings
    assert renderer.estimate is not None and renderer.estimate <= 1e-3


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_all_pixels_are_drawn_at_most_as_finely_as_the_picture(renderer: Counting, classification: str) -> None:
    """Its reference is one of few rays; pictures of thicker slabs take less than its time."""
    scene = replace(SCENE, classification=classification)  # type: ignore[arg-type]
    renderer.render(scene, SIZE, max_error=1e-3)
    large = [thickness for size, thickness in renderer.thicknesses if size == SIZE]
    own = renderer.uniform_settings["slab_thickness"]
    assert large[-1] == own == min(large) and large == sorted(large, reverse=True)
    assert sum(own / each for each in large) < 2
    assert {size for size, _ in renderer.thicknesses} == {SIZE, fewer(SIZE)}


@pytest.mark.parametrize(("width", "few"), [(0.0, False), (0.02, False), (0.1, True)])
def test_lonely_rays_are_held_against_a_reference(renderer: Counting, width: float, few: bool) -> None:
    """A ray that only just reaches a step or a spike may be off by far more than all rays around it."""
    steep = TransferFunction([0.2, 0.5, 0.5 + width], [(1, 1, 1)] * 3, [0.0, 0.01, 0.05])
    renderer.render(replace(SCENE, transfer_function=steep, classification="post"), SIZE, max_error=1e-3)
    assert ((SIZE, "integrated") in renderer.kinds) != few
    assert ((fewer(SIZE), "integrated") in renderer.kinds) == few


def test_thick_slabs_are_held_against_a_reference(renderer: Counting) -> None:
    """Their pictures take no time, and differ little while they pass over samples."""
    renderer.render(replace(SCENE, classification="post"), SIZE, max_error=0.1)
    assert renderer.settings["slab_thickness"] > VOLUME.smallest_spacing
    assert (SIZE, "integrated") in renderer.kinds


def test_where_rays_end_early_counts(renderer: Counting) -> None:
    """All pictures end them alike, and so do not tell by their differences. In this fog none ends, but one may."""
    scene = replace(SCENE, classification="extinction")
    renderer.render(scene, SIZE, max_error=3e-3, early_termination=0.0)
    whole, thickness = renderer.estimate, renderer.uniform_settings["slab_thickness"]
    renderer.render(scene, SIZE, max_error=3e-3, early_termination=2e-4)
    assert whole is not None and renderer.uniform_settings["slab_thickness"] == thickness
    assert renderer.estimate == pytest.approx(whole + 2e-4)


@pytest.mark.parametrize("how", [{"texture_format": "rgba8"}, {"target_format": "rgba16f"}, {"slicing": "wilson"}])
def test_what_all_pictures_round_alike_is_held_against_a_reference(renderer: Counting, how: dict[str, str]) -> None:
    renderer.render(SCENE, SIZE, max_error=0.03, **how)  # type: ignore[arg-type]
    assert fewer(SIZE) not in renderer.drawn and smaller(SIZE) in renderer.drawn


def test_another_scene_size_or_error_is_foreseen_anew(renderer: Counting) -> None:
    unseen = replace(SCENE, camera=None)
    asked = [
        (SCENE, SIZE, 1e-3),
        (unseen, SIZE, 1e-3),
        (SCENE, (200, 200), 1e-3),
        (SCENE, SIZE, 1e-2),
    ]
    for scene, size, wanted in asked:
        before = len(renderer.drawn)
        renderer.foresee(scene, size, wanted)
        assert len(renderer.drawn) > before
    before = len(renderer.drawn)
    renderer.foresee(*asked[-1])
    assert len(renderer.drawn) == before


def test_the_picture_that_was_found_is_not_drawn_again(renderer: Counting) -> None:
    renderer.foresee(SCENE, SIZE, 1e-3)
    renderer.drawn.clear()
    picture = renderer.render(SCENE, SIZE, max_error=1e-3)
    once = len(renderer.drawn)
    renderer.drawn.clear()
    assert np.array_equal(renderer.render(SCENE, SIZE, **renderer.settings), picture)
    renderer.drawn.clear()
    repeated = renderer.render(SCENE, SIZE, max_error=1e-3, repeat=2)
    assert len(renderer.drawn) == once + 1, "what is timed has slabs of one thickness"
    assert np.array_equal(renderer.render(SCENE, SIZE, **renderer.settings), repeated)
    assert np.abs(repeated - picture).max() <= 2e-3


@pytest.mark.parametrize("rate", [1.0, 8.0, None])
def test_what_opaque_matter_costs_is_known(renderer: Counting, rate: float | None) -> None:
    """Interpolated opacities reach a surface of infinite extinction late, at any thickness: finer slabs agree on it."""
    scene = replace(SCENE, transfer_function=replace(FOG, extinctions=np.array([0.1, np.inf])))
    how: dict[str, float] = {"max_error": 1e-3} if rate is None else {"sampling_rate": rate}
    with contextlib.nullcontext() if rate else pytest.warns(AccuracyWarning, match="not reached"):
        picture = renderer.render(scene, (96, 72), texture_format="rgba32f", **how)  # type: ignore[arg-type]
    error = float(np.abs(picture - raycast(scene, (96, 72))).max())
    estimated = renderer.stats["estimated_error"]
    assert 1e-3 < error <= estimated <= 4 * error


def test_contours_of_an_added_volume_are_held_against_finer_slabs(renderer: Counting) -> None:
    """`integrated`, which stands for the integral of plain matter, refuses them, whichever volume has them."""
    contours = replace(FOG, contours=(Contour(0.5, 2.0, (0.1, 0.2, 0.0), 0.2),))
    added = AddedVolume(VOLUME.moved(np.eye(4) + np.eye(4, k=3) * 5), contours)
    scene = replace(SCENE, classification="post", added=(added,))
    picture = renderer.render(scene, (48, 36), max_error=0.02)
    assert renderer.estimate is not None and renderer.estimate <= 0.02
    assert np.abs(picture - raycast(scene, (48, 36))).max() <= 0.02
    renderer.render(scene, (48, 36))
    assert renderer.stats["estimated_error"] > 0


@pytest.mark.parametrize(
    "classification, rate", [("slab", 1 / 64), ("extinction", 1 / 20), ("post", 1 / 64), ("integrated", 1 / 20)]
)
def test_two_slabs_through_everything_are_not_held_against_two(
    renderer: Counting, rate: float, classification: str
) -> None:
    """The box is cut in its middle however thick slabs are: so half as thick ones may give the same picture."""
    scene = replace(SCENE, classification=classification)  # type: ignore[arg-type]
    size = (48, 36)
    picture = renderer.render(scene, size, sampling_rate=rate)
    error = float(np.abs(picture - raycast(scene, size)).max())
    assert 0.05 < error <= renderer.stats["estimated_error"] <= 4 * error


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_what_would_take_too_many_slabs_is_not_reached(renderer: Counting, classification: str) -> None:
    """A grid a thousand times finer along one axis: a million slabs fill it at some 100 in one spacing."""
    values = np.random.default_rng(1).random((8, 8, 8)).astype(np.float32)
    steps = TransferFunction([0, 0.5, 0.5, 1], [(1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 1, 1)], [0, 0.1, 0.6, 0.9])
    volume = Volume(values, (5e-4, 1, 1))
    scene = Scene(volume, steps, Camera.framing(volume), classification=classification)  # type: ignore[arg-type]
    with pytest.warns(AccuracyWarning, match="not reached"):
        renderer.render(scene, (8, 8), max_error=1e-7)
    assert renderer.estimate is not None and renderer.estimate > 1e-7


@pytest.mark.parametrize(("slabs", "known"), [(1.0e6, False), (0.4e6, True)])
def test_an_estimate_is_left_out_where_slabs_would_be_too_many(renderer: Counting, slabs: float, known: bool) -> None:
    scene = replace(SCENE, camera=Camera.framing(VOLUME))
    renderer.render(scene, (2, 2), slab_thickness=2 * VOLUME.radius / slabs)
    assert quick_stats(renderer)["slabs"] > 2e5
    assert (renderer.stats["estimated_error"] is not None) == known


@pytest.mark.filterwarnings("ignore::texvol.util.errors.AccuracyWarning")
def test_textures_that_are_made_leave_progress_for_the_small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(7).random((160, 160, 160), np.float32)
    scene = replace(Scene(Volume(values), FOG).completed((64, 64)), lighting=Lighting(), classification="post")
    heard: list[float] = []
    of_textures: list[float] = []
    at_expected: list[float] = []
    advance, expect = progress.advance, progress.expect

    def advanced(seconds: float) -> None:
        advance(seconds)
        if seconds > 0:
            of_textures.append(heard[-1])

    def expected(seconds: progress.Seconds) -> None:
        at_expected.append(heard[-1])
        expect(seconds)

    monkeypatch.setattr(progress, "advance", advanced)
    monkeypatch.setattr(progress, "expect", expected)
    with Renderer() as renderer:
        for textures_made in (True, False):
            of_textures.clear()
            at_expected.clear()
            with progress.heard(heard.append):
                renderer.render(scene, (64, 64), max_error=1 / 8)
            assert bool(of_textures) == textures_made
            if textures_made:  # else the bar would stand still until they are drawn
                assert 0.1 < of_textures[-1] < 0.9 * at_expected[0]
            else:
                assert at_expected[0] <= 0.3, "small pictures alone"
