"""Tiles of a picture are refined apart, each as far as an error needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.quick_stats import quick_stats

from texvol.ray_casting import raycast
from texvol.rendering.error_control import Begin, Choice
from texvol.rendering.renderer import Renderer
from texvol.rendering.tiles import Tiles, extrapolated, refined, slabs_foreseen, spread
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (256, 192)
z, y, x = np.mgrid[tuple(slice(-1, 1, 40j) for _ in range(3))]
# A ball whose edge is far steeper than the fog around it.
VOLUME = Volume((np.exp(-2 * (x**2 + y**2 + z**2)) + 1 / (1 + np.exp(30 * (x**2 + y**2 + z**2 - 0.2)))).astype("f4"))
STEEP = TransferFunction([0.2, 1.0, 1.4], [(0.9, 0.4, 0.1), (0.2, 0.5, 0.9), (1, 1, 1)], [0.0, 0.1, 0.9])
SCENE = Scene(VOLUME, STEEP, Camera.framing(VOLUME, aspect=4 / 3))


class Drawn:
    """Pictures that are off by (thickness / 3)^order in each pixel, times its own factor; notes what was drawn."""

    def __init__(self, off: np.ndarray, order: float) -> None:
        self.off, self.order = off[..., np.newaxis], order
        self.calls: list[tuple[float, object]] = []

    def __call__(self, thickness: float, regions: object) -> np.ndarray:
        self.calls.append((thickness, regions))
        return np.broadcast_to(0.5 + self.off * (thickness / 3.0) ** self.order, (*self.off.shape[:2], 4))


def found(drawn: Drawn, wanted: float, **how: object) -> Choice:
    """Return the choice of a picture of 40 by 24 pixels in 5 by 3 tiles, whose few rays say nothing unless told."""
    given = {"of_few": lambda rate: np.zeros((3, 5)), "known": lambda picture: 0.0, "most_order": 1.75, "finest": 64.0}
    return refined(drawn, Tiles((40, 24), (5, 3)), 3.0, Begin(), wanted=wanted, **{**given, **how})  # type: ignore[arg-type]


@pytest.mark.parametrize("order", [1.0, 1.3, 1.75, 2.5])
@pytest.mark.parametrize("wanted", [1e-2, 1e-3])
def test_each_tile_keeps_the_error_and_few_are_fine(order: float, wanted: float) -> None:
    off = np.full((24, 40), 1e-4)
    off[13, 30] = 0.01
    drawn = Drawn(off, order)
    choice = found(drawn, wanted)
    assert choice.reached and choice.estimated_error <= wanted
    assert np.abs(choice.picture - 0.5).max() <= choice.estimated_error
    assert choice.slab_thickness == min(thickness for thickness, _ in drawn.calls)
    thin, regions = choice.passes[-1]
    assert thin == choice.slab_thickness
    if len(choice.passes) > 1:
        one, with_those_beside = (24, 8, 8, 8), (16, 0, 24, 24)  # counted from below
        assert regions in ((one,), (with_those_beside,))


def test_passes_fill_the_picture_once() -> None:
    random = np.random.default_rng(5)
    off = 10 ** random.uniform(-4, -2, (24, 40)) * np.linspace(0, 1, 40) ** 4
    choice = found(Drawn(off, 1.5), 2e-3)
    counted = np.zeros((24, 40), int)
    assert len(choice.passes) > 1
    for _, regions in choice.passes:
        for left, low, width, height in regions or ():
            counted[24 - low - height : 24 - low, left : left + width] += 1
    assert (counted == 1).all()


def test_passes_are_foreseen_with_the_tiles_that_they_draw() -> None:
    """Progress knows what is left, else it would stand near its end while few tiles are drawn with many slabs."""
    off = 10 ** np.random.default_rng(5).uniform(-4, -2, (24, 40)) * np.linspace(0, 1, 40) ** 4
    drawn, told = Drawn(off, 1.0), []
    found(drawn, 1e-3, most_order=1.0, foreseen=lambda passes: told.append((len(drawn.calls), passes)))
    assert [count for count, _ in told] == [0, *range(2, len(drawn.calls))]
    assert [(3.0 / rate, share) for rate, share in told[0][1][:2]] == [
        (thickness, 1.0) for thickness, _ in drawn.calls[:2]
    ]
    assert len(told) > 2
    for count, passes in told[1:]:
        thickness, regions = drawn.calls[count]
        drawn_share = 1.0 if regions is None else sum(w * h for _, _, w, h in regions) / off.size  # type: ignore[attr-defined]
        assert passes[0] == pytest.approx((3.0 / thickness, drawn_share))
        shares = [share for _, share in passes]
        assert shares == sorted(shares, reverse=True)
        # Errors halve with the slabs: at the first look, as many passes are left as are drawn.
        assert len(passes) == len(drawn.calls) - count


@pytest.mark.parametrize("wanted", [3e-1, 3e-2, 3e-3, 3e-4])
def test_slabs_are_foreseen_from_one_ray_in_each_tile(wanted: float) -> None:
    in_tiles = 10.0 ** np.random.default_rng(5).uniform(-3, 0, (3, 5))
    drawn = Drawn(in_tiles.repeat(8, 0).repeat(8, 1), 2.0)
    found(drawn, wanted)
    areas = [960 if regions is None else sum(w * h for _, _, w, h in regions) for _, regions in drawn.calls]  # type: ignore[attr-defined]
    slabs = sum(3.0 / thickness * area / 960 for (thickness, _), area in zip(drawn.calls, areas, strict=True))
    assert 0.4 * slabs <= slabs_foreseen(in_tiles / 4, 2.0, wanted, 64.0) <= 2.5 * slabs


@pytest.mark.parametrize("wanted", [0.0, -1e-3])
def test_an_error_that_nothing_is_left_of_is_looked_for_to_the_finest_rate(wanted: float) -> None:
    told: list[list[tuple[float, float]]] = []
    choice = found(Drawn(np.full((24, 40), 1e-2), 1.0), wanted, foreseen=told.append)
    assert not choice.reached and choice.slab_thickness == 3.0 / 64
    assert told[1] == [(4.0 * 2**n, 1.0) for n in range(len(told[1]))] and told[1][-1][0] == 64.0


def test_what_a_ray_of_few_finds_counts_in_its_tile() -> None:
    """Pictures that agree with each other say nothing of what all their slabs pass over."""
    few = np.zeros((3, 5))
    few[2, 1] = 1.0
    choice = found(Drawn(np.zeros((24, 40)), 1.0), 1e-3, of_few=lambda rate: few / rate**3)
    assert choice.reached and choice.slab_thickness == 3 / 16
    assert choice.passes[-1] == (3 / 16, ((8, 0, 8, 8),))
    choice = found(Drawn(np.zeros((24, 40)), 1.0), 1e-3, of_few=lambda rate: few * 5e-3, finest=4.0)
    assert not choice.reached and choice.estimated_error == 5e-3


def test_what_is_known_of_all_pictures_counts() -> None:
    choice = found(Drawn(np.zeros((24, 40)), 1.0), 1e-3, known=lambda picture: 2e-5)
    assert choice.reached and choice.estimated_error == 2e-5


def test_an_order_that_pictures_do_not_show_is_not_believed() -> None:
    least = extrapolated(np.array([1e-3, 0.0, np.inf]), np.array([1e-3] * 3), 2.0)
    assert least[0] == least[1] == pytest.approx(3 * least[2])
    assert extrapolated(np.array([1e-3]), np.array([0.0]), 2.0) == 0.0
    assert extrapolated(np.array([1.0]), np.array([np.inf]), 2.0) == np.inf


def test_tiles_beside_a_rough_one_are_not_trusted() -> None:
    errors = np.zeros((3, 4))
    errors[1, 3] = 1.0
    shown = spread(errors)
    assert shown[1, 3] == 1.0 and (shown[:, :2] == 0.0).all()
    assert (shown[:, 2:] > 0.5).all()


@pytest.mark.parametrize(("size", "count"), [((257, 191), (48, 48)), ((96, 49), (48, 48)), ((5, 3), (5, 3))])
def test_tiles_and_their_regions_are_the_same_pixels(size: tuple[int, int], count: tuple[int, int]) -> None:
    tiles, random = Tiles(size, count), np.random.default_rng(1)
    for part in (0.0, 0.1, 0.5, 1.0):
        chosen = random.random(count[::-1]) < part
        drawn = np.zeros(size[::-1], int)
        for left, low, width, height in tiles.regions(chosen):
            drawn[size[1] - low - height : size[1] - low, left : left + width] += 1
        assert np.array_equal(drawn, tiles.pixels(chosen))
        different = np.where(tiles.pixels(chosen)[..., np.newaxis], 1.0, 0.0)
        assert np.array_equal(tiles.largest(different, np.zeros((*size[::-1], 1))) > 0, chosen)


@pytest.mark.parametrize("classification", CLASSIFICATIONS)
def test_a_picture_of_tiles_keeps_its_error_and_is_drawn_again(classification: str) -> None:
    scene, wanted = replace(SCENE, classification=classification), 2e-3  # type: ignore[arg-type]
    truth = raycast(scene, SIZE)
    with Renderer() as renderer:
        picture = renderer.render(scene, SIZE, max_error=wanted)
        settings, estimate = renderer.settings, renderer.estimate
        assert estimate is not None and np.abs(picture - truth).max() <= estimate <= wanted
        assert "slab_thickness" not in settings and settings["max_error"] == wanted
        stats = quick_stats(renderer, samples=True)
        samples, tiles = stats["samples"], stats["tiles"]
        assert sum(each["pixels"] for each in tiles) == SIZE[0] * SIZE[1] and len(tiles) > 1
        assert min(each["slab_thickness"] for each in tiles) == stats["slab_thickness"]
        again = renderer.render(scene, SIZE, **settings)
        assert np.array_equal(again, picture)
        uniform = renderer.render(scene, SIZE, **renderer.uniform_settings)
        assert np.abs(uniform - truth).max() <= wanted
        stats = quick_stats(renderer, samples=True)
        assert samples < 0.9 * stats["samples"] and "tiles" not in stats, "few tiles have thin slabs"
