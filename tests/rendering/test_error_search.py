"""A wanted error of a scene: foreseen by a small picture, which is drawn once; found by the picture itself."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from texvol.ray_casting import raycast
from texvol.rendering.error_control import smaller
from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import Settings
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour
from texvol.scene.volume import Volume
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
        super().__init__()

    def _draw(self, scene: Scene, size: tuple[int, int], settings: Settings, *rest: int) -> np.ndarray:  # type: ignore[override]
        self.drawn.append(size)
        return super()._draw(scene, size, settings, *rest)


@pytest.fixture
def renderer() -> Iterator[Counting]:
    with Counting() as made:
        yield made


def test_a_sixteenth_of_the_pixels_where_that_is_enough() -> None:
    assert smaller((800, 600)) == (200, 150)
    assert smaller((100, 60)) == (48, 48)
    assert smaller((20, 8)) == (20, 8)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_what_is_foreseen_is_drawn_once_and_changes_nothing(renderer: Counting, classification: str) -> None:
    scene = replace(SCENE, classification=classification)  # type: ignore[arg-type]
    foreseen = renderer.foresee(scene, SIZE, 1e-3)
    small = renderer.drawn.count(smaller(SIZE))
    assert small == len(renderer.drawn) >= 2
    picture, settings = renderer.render(scene, SIZE, max_error=1e-3), renderer.settings
    assert renderer.drawn.count(smaller(SIZE)) == small, "the small pictures are remembered"
    # From what was foreseen the search goes to coarser slabs until they won't do: that many pictures, and a reference,
    # or two or three where it has to know its own error.
    halvings = round(np.log2(settings["slab_thickness"] / foreseen.slab_thickness))
    assert 0 <= halvings <= 2
    assert renderer.drawn.count(SIZE) <= 4 + halvings + (classification == "post")
    with Renderer() as other:
        assert np.array_equal(other.render(scene, SIZE, max_error=1e-3), picture)
        assert other.settings == settings
    assert renderer.estimate is not None and renderer.estimate <= 1e-3


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
    assert np.array_equal(renderer.render(SCENE, SIZE, max_error=1e-3, repeat=2), picture)
    assert len(renderer.drawn) == once + 1
    assert np.array_equal(renderer.render(SCENE, SIZE, **renderer.settings), picture)


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
    assert renderer.stats["slabs"] > 2e5
    assert (renderer.stats["estimated_error"] is not None) == known
