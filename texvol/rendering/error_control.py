"""Slab thickness for a maximum error, found by drawing the scene itself.

Let I(d) be the picture at slab thickness d and e(d) = max |I(d) - I(0)| its error. A finer picture I(d / 2ⁿ) stands for
the integral, and is off by e(d / 2ⁿ) itself. If the error is at least of order p,

    e(d) <= max |I(d) - I(d / 2ⁿ)| / (1 - 2^-pn)

by the triangle inequality. p = 1 is used: the midpoint rule has order 2, interpolated opacities and steps have order 1.
The search starts with one and two slabs per voxel, so that no sample of the volume lies between two slabs. It halves
the slabs until the estimate is within the limit. Then it doubles them, with the finest picture as reference, as long as
the estimate stays within the limit.

A spike of the transfer function may lie between samples: under `post` all pictures may agree that nothing is there. So
a `post` scene is compared with J(d), the same scene drawn as `integrated`, which has the same integral and misses
nothing; and a `slab` scene with `extinction`, which has a higher order. J is mostly far better than I at the same
thickness. It is drawn just finely enough for its own error, known from its last two pictures, to be half of the limit:

    e(d) <= max |I(d) - J(f)| + max |J(f) - J(2f)| · 2^-p / (1 - 2^-p)

`ErrorSearch` (error_search.py) does so on few pixels, and extrapolates to all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.sampled_errors import beyond_sample
from texvol.rendering.settings import Settings
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.slabs import MOST_SLABS
from texvol.util.errors import NoRoomError

ORDER = 1.0
# For rounding, and for pictures in which steps break order 1 here and there: it keeps the error in 99 % of 200 random
# scenes (scripts/error_control.py).
SAFETY = 1.5
ROUNDING = 2e-6  # of a picture in float32, relative to its largest number, or 1
SURFACE_ROUNDING = 2e-5
EXTREME_ROUNDING = 4e-6
_USUAL_ORDER = 2.0
_NOT_HALVED = 1.05  # times as many slabs: with any power of two rays would stop at the same depths
_MOST_HALVINGS = 6  # of the slabs of an estimate, which then takes a few times as long as the picture
_LEAST_ESTIMATED = 48  # pixels along each side of a small picture: fewer may miss the largest error
_COARSEST_RATE, FINEST_RATE = 1 / 16, 64  # slabs per smallest spacing

AnyScene = TypeVar("AnyScene", bound=Scene)
Draw = Callable[[float], NDArray[np.float32]]  # slab thickness → picture
Size = tuple[int, int]
Region = tuple[int, int, int, int]  # x, y, width, height in pixels, from the lower left corner
Passes = tuple[tuple[float, tuple[Region, ...] | None], ...]  # thicknesses, and where they are
ByTiles = tuple[float | None, Passes]  # error that was asked for and passes, if tiles differ
DrawScene = Callable[[CompleteScene, Size, Settings], NDArray[np.float32]]


@dataclass(frozen=True)
class Choice:
    """Slab thickness, and the estimated maximum error of its picture."""

    slab_thickness: float
    estimated_error: float
    reached: bool  # True if the estimate is within the limit
    picture: NDArray[np.float32]
    begin: Begin  # rates for a picture of the same scene in another size
    # Thicknesses of parts of the picture, and the regions that have each (None: all), if they are not the same.
    passes: Passes = ()


@dataclass(frozen=True)
class Begin:
    """Rates at which a search begins, in slabs per smallest spacing: of the picture, and of its reference."""

    rate: float = 1.0
    reference: float = 2.0


def reference_for(scene: AnyScene) -> AnyScene:
    """Return the scene to draw for the finer picture of a pair."""
    if scene.mode != "composite" or scene.classification != "post":
        return scene
    # `integrated` has no medium that depends on the gradient, in any of the volumes.
    media = [scene.transfer_function, *(each.transfer_function for each in scene.added)]
    if any(medium is not None and (medium.graded or medium.contours) for medium in media):
        return scene
    return replace(scene, classification="integrated")


def converging(scene: AnyScene) -> AnyScene:
    """Return the scene with a classification of the same integral that converges faster.

    Interpolated opacities approach interpolated extinctions as slabs become thin, with order 1. The latter have
    order 2.
    """
    if scene.mode == "composite" and scene.classification == "slab":
        return replace(scene, classification="extinction")
    return reference_for(scene)


def thickness_for_error(
    draw: Draw,
    draw_reference: Draw,
    smallest_spacing: float,
    wanted: float,
    begin: Begin | None = None,
    *,
    converges_alone: bool = False,
    finest: float = FINEST_RATE,
    rounding: Callable[[], float] = lambda: 0.0,
    relative: float = ROUNDING,
    told: Callable[[float, float], None] = lambda rate, excess: None,
) -> Choice:
    """Find the coarsest slab thickness, a power of two of the spacing, with an estimated error of at most `wanted`.

    Parameters
    ----------
    draw, draw_reference : callable
        Draw the scene and its reference (see `converging`) at a slab thickness in world units.
    smallest_spacing : float
        World units.
    wanted : float
        Maximum absolute error of the linear picture.
    begin : Begin, optional
        Rates found for a smaller picture; they change the time of the search, not its result.
    converges_alone : bool
        True if the reference has another classification, which is better at the same thickness.
    finest : float
        Largest rate of a picture, see `finest_rate`; a reference may have twice that.
    rounding : callable, optional
        Returns the error that the rounding of values adds to the last picture, whatever its slabs.
    relative : float
        Error by all other rounding, relative to the largest number of the picture or 1, see `rounding_of`.
    told : callable
        Called with each rate that is not fine enough, and its error relative to `wanted`.
    """
    begin = begin or Begin()

    def reference_at(rate: float) -> NDArray[np.float32]:
        return draw_reference(smallest_spacing / rate)

    held: Held
    if converges_alone:
        held = _HeldAgainstAnother(reference_at, wanted, begin, 2 * finest, rounding)
    else:
        held = _HeldAgainstItsFiner(reference_at, rounding, relative)
    return coarsest(draw, held, smallest_spacing, wanted, begin, finest=finest, told=told)


def coarsest(
    draw: Draw,
    held: Held,
    smallest_spacing: float,
    wanted: float,
    begin: Begin,
    *,
    finest: float = FINEST_RATE,
    told: Callable[[float, float], None] = lambda rate, excess: None,
) -> Choice:
    """Find the coarsest slab thickness whose error, as `held` estimates it, is at most `wanted`.

    Other arguments as for `thickness_for_error`.
    """
    drawn: dict[float, NDArray[np.float32]] = {}  # by rate: the search for coarser slabs meets some again

    def at(rate: float) -> NDArray[np.float32]:
        if rate not in drawn:
            drawn[rate] = draw(smallest_spacing / rate)
        return drawn[rate]

    rate = max(begin.rate, 1.0)  # with thicker slabs, samples could lie between two of them
    while (error := held.error(at(rate), rate)) > wanted and rate < finest:
        told(rate, error / wanted)
        # Only the other part of the estimate depends on the slabs of the picture.
        rate = min(rate * 2 ** _fewest_halvings(error - held.own_error, wanted - held.own_error), finest)
    found = Choice(smallest_spacing / rate, error, error <= wanted, at(rate), Begin(rate, held.rate))
    # As long as a lower bound of the estimate at twice the thickness is within the limit.
    while found.reached and rate > _COARSEST_RATE and 2.0**ORDER * (error - held.own_error) + held.own_error <= wanted:
        rate /= 2
        try:
            picture = at(rate)
        except NoRoomError:  # thicker slabs need more margin around a brick
            break
        error = held.error_of_coarser(picture, rate)
        if not error <= wanted:
            break
        found = Choice(smallest_spacing / rate, error, True, at(rate), Begin(rate, held.rate))
    return found


def _fewest_halvings(error: float, wanted: float) -> int:
    """Least number of halvings: each leaves a quarter of the error at order 2, hardly ever less."""
    return max(int(np.log2(error / wanted) / 2), 1) if np.isfinite(error) and wanted > 0 else 1


class Held(Protocol):
    """Estimates of errors, from a finer picture."""

    own_error: float  # of the finer picture, as part of an estimate
    rate: float  # of the finer picture

    def error(self, picture: NDArray[np.float32], rate: float) -> float:
        """Return the estimate for a picture at any rate."""

    def error_of_coarser(self, picture: NDArray[np.float32], rate: float) -> float:
        """Return the estimate for a picture that is coarser than the last one."""


@dataclass
class HeldAgainstKnown:
    """Estimate from a picture whose own error is known."""

    picture: NDArray[np.float32]
    rate: float
    own_error: float

    def errors(self, picture: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the estimate in each pixel."""
        return differences(picture, self.picture) + self.own_error

    def error(self, picture: NDArray[np.float32], rate: float) -> float:
        """Return the estimate for a picture at any rate."""
        return float(self.errors(picture).max())

    error_of_coarser = error


class _HeldAgainstItsFiner:
    """Estimate from a reference of half the slab thickness."""

    own_error = 0.0  # of the reference, as part of an estimate

    def __init__(self, draw: Draw, rounding: Callable[[], float], relative: float) -> None:
        self._draw, self._rounding, self._relative = draw, rounding, relative
        self.rate = 0.0  # of the reference

    def error(self, picture: NDArray[np.float32], rate: float) -> float:
        """Draw the reference of a picture, and return the estimate."""
        self.rate = 2 * rate
        self._finer = self._draw(self.rate)
        return self.error_of_coarser(picture, rate)

    def error_of_coarser(self, picture: NDArray[np.float32], rate: float) -> float:
        """Return the estimate for a picture that is coarser than the last one."""
        return estimate(picture, self._finer, round(np.log2(self.rate / rate)), self._relative) + self._rounding()


class _HeldAgainstAnother:
    """Estimate from a reference of another classification, drawn as finely as its own error needs."""

    def __init__(self, draw: Draw, wanted: float, begin: Begin, finest: float, rounding: Callable[[], float]) -> None:
        self._draw, self._wanted, self._finest, self._rounding = draw, wanted, finest, rounding
        self.rate = max(begin.reference, 2.0) / 2  # one slab per voxel at least, in the coarser of the pair
        self._picture = draw(self.rate)
        self._refine()

    def error(self, picture: NDArray[np.float32], rate: float) -> float:
        """Return the estimate for a picture at any rate; refine the reference if its own error dominates."""
        error = self.error_of_coarser(picture, rate)
        # Finer slabs do not help while most of the estimate is the error of the reference.
        while error > self._wanted and error <= 3 * self.own_error and self.rate < self._finest:
            self._refine()
            error = self.error_of_coarser(picture, rate)
        return error

    def error_of_coarser(self, picture: NDArray[np.float32], rate: float) -> float:
        """Return the estimate from the reference as it is."""
        known = self.own_error + rounding_in(self._picture) + self._rounding()
        return largest_difference(picture, self._picture) + known

    def _refine(self) -> None:
        """Halve the slabs of the reference, at least once, until its error is at most half of the limit."""
        while True:
            self.rate, coarser = 2 * self.rate, self._picture
            self._picture = self._draw(self.rate)
            self.own_error = SAFETY * largest_difference(coarser, self._picture) * 2.0**-ORDER / (1 - 2.0**-ORDER)
            if self.own_error <= self._wanted / 2 or self.rate >= self._finest:
                return


def finest_rate(scene: Scene) -> float:
    """Largest rate, in slabs per smallest spacing, at which a reference of twice the rate can still be drawn."""
    return float(2 ** np.floor(np.log2(np.clip(scene.smallest_spacing / thinnest(scene) / 2, 1, FINEST_RATE))))


def thinnest(scene: Scene) -> float:
    """Least slab thickness: the largest number of slabs then fills the box from every view."""
    return 2 * scene.box.radius / MOST_SLABS


def rounding_of(scene: Scene) -> float:
    """Rounding of float32, relative to the largest number of a picture.

    On a surface the rounding of the position dominates, through gradient and highlight. An extreme is that of a cubic
    through four values, each of which is rounded.
    """
    if scene.mode in ("mip", "minip"):
        return EXTREME_ROUNDING
    return SURFACE_ROUNDING if scene.mode == "isosurface" else ROUNDING


def estimate(
    picture: NDArray[np.float32],
    finer: NDArray[np.float32],
    halvings: float,
    rounding: float = ROUNDING,
    pixels: int | None = None,
) -> float:
    """Estimate the maximum error from a finer picture: its slabs are halved `halvings` times; infinite means exact.

    The largest of `pixels` errors, of which those in the picture are a sample, is more than that of the sample: by
    `beyond_sample`, with the usual order; and at least what the sample has with the least order.
    """
    found = differences(picture, finer)
    of_sample = 1 / (1 - 2.0 ** (-ORDER * halvings))
    of_all = beyond_sample(found, pixels or found.size) / (1 - 2.0 ** (-_USUAL_ORDER * halvings))
    return SAFETY * float(found.max()) * max(of_sample, of_all) + rounding_in(finer, rounding)


def estimate_by_finer(
    scene: CompleteScene,
    picture: NDArray[np.float32],
    thickness: float,
    draw: Callable[[CompleteScene, float], NDArray[np.float32]],
    pixels: int,
    drawn_anyway: float = 0.0,
) -> float:
    """Estimate the maximum error of a picture of `pixels` pixels from two pictures of some of them.

    The finer picture has half the slab thickness, of `post` a quarter, or two slabs per voxel if that is thinner and
    affordable: samples may lie between thicker slabs, and pictures may agree that nothing is there. If there is no
    memory for the bricks of that picture, thinner slabs are tried, which need less margin. `draw` takes a scene and a
    thickness; a reference of the thickness `drawn_anyway` costs nothing. The estimate is infinite if no finer picture
    can be drawn.
    """
    reference = converging(scene)
    most = min(float(_MOST_HALVINGS), float(np.log2(thickness / thinnest(scene))))
    # Thin slabs of `post` miss as much as those of half their thickness find too much: a quarter leaves less margin.
    least = 2.0 if scene.mode == "composite" and scene.classification == "post" else 1.0
    first = max(min(max(float(np.log2(thickness / scene.smallest_spacing)) + 1, least), most), 1.0)
    # `extinction` is so much nearer to the integral than `slab` that its own error is within the safety factor.
    is_exact = (scene.classification, reference.classification) == ("slab", "extinction")
    for halvings in np.arange(first, most + 1e-9) + more_halvings(scene):
        thinner = thickness / 2**halvings
        if is_exact and 0 < drawn_anyway < thinner:
            thinner = drawn_anyway
        try:
            finer = draw(reference, thinner)
        except NoRoomError:
            continue
        return estimate(picture, finer, np.inf if is_exact else halvings, rounding_of(scene), pixels)
    return np.inf


def more_halvings(scene: Scene) -> float:
    """Return what is added to whole halvings: on isosurfaces positions that are halved exactly are rounded alike."""
    return float(np.log2(_NOT_HALVED)) if scene.mode == "isosurface" else 0.0


def differences(picture: NDArray[np.floating], other: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the largest absolute difference of two pictures in each pixel; equal infinities do not differ."""
    with np.errstate(invalid="ignore"):
        off = np.where(picture == other, 0.0, np.abs(picture.astype(np.float64) - other))
    return np.asarray(off.max(axis=-1))


def largest_difference(picture: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Largest absolute difference of two pictures; equal infinities do not differ."""
    return float(differences(picture, other).max())


def rounding_in(picture: NDArray[np.float32], rounding: float = ROUNDING) -> float:
    """Return the error by rounding, from the rounding relative to the largest number of a picture or 1."""
    numbers = np.abs(picture[..., :3])
    brightest = float(numbers[np.isfinite(numbers)].max(initial=0.0))
    return rounding * max(brightest, 1.0)


def if_finite(estimate: float | None) -> float | None:
    """Return the estimate, or None if it is not finite, for JSON."""
    return float(estimate) if estimate is not None and np.isfinite(estimate) else None


def smaller(size: Size) -> Size:
    """Return a size of a sixteenth of the pixels, with at least _LEAST_ESTIMATED along each side."""
    width, height = (max(side // 4, min(side, _LEAST_ESTIMATED)) for side in size)
    return width, height
