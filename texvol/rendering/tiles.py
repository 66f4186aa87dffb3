"""Picture whose tiles are refined apart: each has slabs as thin as its own pixels need for a maximum error.

Few pixels need thin slabs: those whose rays graze a surface. So tiles of some 8×8 pixels are drawn with slabs of four
times, twice and once a thickness, as long as their own pixels, or those of the tiles beside them, still change:

    p = log2(max |I(4d) - I(2d)| / max |I(2d) - I(d)|),    e(d) <= 3/2 SAFETY · max |I(2d) - I(d)| / (2^p - 1)

p is at least 1, as in `error_control`, and at most what pictures of a classification can be trusted with: thicker slabs
may lose what makes the error of thin ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.error_control import ORDER, SAFETY, Begin, Choice, Region, differences

DrawRegions = Callable[[float, "tuple[Region, ...] | None"], NDArray[np.float32]]
Grid = NDArray[np.float64]
Pass = tuple[float, float]  # a rate, and the share of the pixels that are drawn at it

# The largest of many errors: 1.5 times that of `error_control` keeps it in 99 % of random scenes.
_SAFETY = 1.5 * SAFETY
_BESIDE = 0.75  # part of the error of the tiles beside a tile that its own may have, unseen
LONELY = 0.25  # part of that of any tile, where the largest error may be that of one ray among thousands
_MOSTLY = 0.75  # fraction of the tiles above which the whole picture is drawn
_USUAL_SHARE = 0.25  # of the tiles that are drawn once more
_ESTIMATED = 6  # times the error of one ray in a tile is what is estimated for the tile, on lit volumes about
_COARSER = 16  # times the thickness that few pixels need: with that tiles begin


@dataclass
class Tiles:
    """Tiles of a picture of `size` pixels, in `count` columns and rows, from its upper left corner."""

    size: tuple[int, int]
    count: tuple[int, int]
    _edges: tuple[NDArray[np.intp], NDArray[np.intp]] = field(init=False)

    def __post_init__(self) -> None:
        (width, height), (columns, rows) = self.size, self.count
        across, down = np.linspace(0, width, columns + 1), np.linspace(0, height, rows + 1)
        self._edges = across.round().astype(np.intp), down.round().astype(np.intp)

    def largest(self, picture: NDArray[np.floating], other: NDArray[np.floating]) -> Grid:
        """Return the largest absolute difference of two pictures in each tile; equal infinities do not differ."""
        pixels = differences(picture, other)
        across, down = self._edges
        return np.asarray(np.maximum.reduceat(np.maximum.reduceat(pixels, down[:-1], 0), across[:-1], 1))

    def pixels(self, tiles: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which pixels are in some tiles."""
        across, down = self._edges
        return tiles.repeat(np.diff(down), 0).repeat(np.diff(across), 1)

    def regions(self, tiles: NDArray[np.bool_]) -> tuple[Region, ...]:
        """Return rectangles that are these tiles."""
        (across, down), height = self._edges, self.size[1]
        found: list[Region] = []
        open_runs: dict[tuple[int, int], int] = {}  # first row, by first and last column
        for row in range(len(tiles) + 1):
            runs = set(_runs(tiles[row])) if row < len(tiles) else set()
            for run in [each for each in open_runs if each not in runs]:
                left, right, top = across[run[0]], across[run[1]], down[open_runs.pop(run)]
                found.append((int(left), int(height - down[row]), int(right - left), int(down[row] - top)))
            for run in runs:
                open_runs.setdefault(run, row)
        return tuple(found)


def _runs(row: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first column of each run of True, and the column after it."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], row, [False])).astype(np.int8)))
    return [(int(first), int(end)) for first, end in changes.reshape(-1, 2)]


def refined(
    draw: DrawRegions,
    tiles: Tiles,
    spacing: float,
    begin: Begin,
    wanted: float,
    known: Callable[[NDArray[np.float32]], float],
    of_few: Callable[[float], Grid],
    most_order: float,
    finest: float,
    share: float = 0.0,
    foreseen: Callable[[list[Pass]], None] = lambda passes: None,
) -> Choice:
    """Halve the slabs of each tile until the error that coarser pictures show is at most `wanted`.

    Parameters
    ----------
    draw : callable
        Draws the scene at a slab thickness in world units, in regions or all of it.
    spacing : float
        Smallest spacing, world units.
    begin : Begin
        Rate at which slabs are thin enough for few pixels.
    known : callable
        Returns the part of a picture's error that does not depend on its slabs.
    of_few : callable
        Returns the error at a rate of one ray in each tile, all parts of it.
    most_order : float
        Largest order of the error that is believed.
    finest : float
        Largest rate.
    share : float
        Part of the largest error of all tiles that each may have, unseen.
    foreseen : callable, optional
        Is called with the passes that are likely to follow.
    """
    rate = min(max(2.0, 2 * begin.rate / _COARSER), finest)
    foreseen([(rate / 2, 1.0), (rate, 1.0), *_doubled(rate, begin.rate)])
    coarser = draw(2 * spacing / rate, None)
    picture = draw(spacing / rate, None)
    before = last = tiles.largest(coarser, picture)
    active, rates, errors = np.ones(last.shape, bool), np.full(last.shape, rate), np.zeros(last.shape)
    while True:
        least = share * np.array([before[active].max(), last[active].max()])
        around = np.maximum(spread(before), least[0]), np.maximum(spread(last), least[1])
        estimated = extrapolated(*around, most_order) + known(picture)
        errors[active] = np.maximum(estimated, of_few(rate))[active]
        active &= errors > wanted
        if not active.any() or rate >= finest:
            break
        foreseen(_left(errors, wanted, active, rate, finest))
        rate *= 2
        inside = tiles.pixels(active)
        regions = None if active.mean() > _MOSTLY else tiles.regions(active)
        finer = np.where(inside[..., np.newaxis], draw(spacing / rate, regions), picture)
        before, last, picture = last, tiles.largest(picture, finer), finer
        rates[active] = rate
    error = float(errors.max())
    passes = [(float(spacing / each), tiles.regions(rates == each)) for each in np.unique(rates)]
    return Choice(spacing / rate, error, error <= wanted, picture, Begin(rate, begin.reference), tuple(passes))


def _doubled(rate: float, last: float) -> list[Pass]:
    """Return the passes after one at a rate, up to the last rate, as long as nothing is known of the tiles."""
    return [(rate * 2**n, _USUAL_SHARE) for n in range(1, int(np.log2(max(last / rate, 1.0))) + 1)]


def _left(errors: Grid, wanted: float, active: NDArray[np.bool_], rate: float, finest: float) -> list[Pass]:
    """Return the passes after one at a rate, if each divides the errors of its tiles by 2."""
    passes: list[Pass] = []
    while rate < finest and (share := float((active & (errors > wanted)).mean())):
        rate, wanted = 2 * rate, 2 * wanted
        passes.append((rate, 1.0 if share > _MOSTLY else share))
    return passes


def slabs_foreseen(errors: Grid, rate: float, wanted: float, finest: float) -> float:
    """Return how many slabs per spacing `refined` draws in all, in the mean of the tiles, if the error is of order 2.

    `errors` are those of one ray in each tile at a rate.
    """
    around = _ESTIMATED * spread(errors)
    slabs, finer = 3.0, 4.0  # all tiles are drawn at rates 1 and 2
    while finer <= finest and (share := float((around * (2 * rate / finer) ** 2 > wanted).mean())):
        slabs += finer * share
        finer *= 2
    return slabs


def spread(errors: Grid) -> Grid:
    """Return the errors of tiles, at least a part of what those beside them have."""
    rows, columns = errors.shape
    around = np.pad(errors, 1)
    beside = [around[y : y + rows, x : x + columns] for y in range(3) for x in range(3)]
    return np.maximum(errors, _BESIDE * np.max(beside, axis=0))


def extrapolated(before: Grid, last: Grid, most_order: float) -> Grid:
    """Estimate the error of pictures from two differences of pictures.

    Parameters
    ----------
    before : array
        Largest difference of the pictures of four times and of twice the thickness.
    last : array
        Largest difference of the picture of twice the thickness and the picture itself.
    most_order : float
        Largest order of the error that is believed.
    """
    before, last = np.asarray(before, np.float64), np.asarray(last, np.float64)
    usual = (last > 0) & np.isfinite(last)
    with np.errstate(invalid="ignore", divide="ignore"):
        order = np.clip(np.log2(np.maximum(before, last) / last), ORDER, most_order)
        return np.where(usual, _SAFETY * last / (2.0**order - 1), last)
