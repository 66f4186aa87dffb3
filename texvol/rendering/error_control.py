"""From a wanted maximum error to a slab thickness, by drawing the scene itself.

Let I(d) be the picture at slab thickness d and e(d) = max |I(d) - I(0)| its error. A finer picture I(d / 2ⁿ) stands for
the integral, and falls short of it by e(d / 2ⁿ). Where the error is of order p at least,

    e(d) <= max |I(d) - I(d / 2ⁿ)| / (1 - 2^-pn)

by the triangle inequality. p = 1 is taken: the midpoint rule has 2, interpolated opacities and steps have 1. Starting
with two pictures that no sample of the volume can slip through (one and two slabs per voxel), the search goes to finer
slabs until one is good enough, and then, with the finest picture at hand, to coarser ones as long as they are.

What samples can slip through is a spike of the transfer function: under `post` all pictures may agree that nothing is
there. So a `post` scene is held against J(d), the same drawn as `integrated`, which has the same integral and misses
nothing; and a `slab` scene against `extinction`, which has a higher order. J is mostly far better than I at the same
thickness, so it is drawn just finely enough to know its own error, from its last two pictures, as a half of what is
wanted:

    e(d) <= max |I(d) - J(f)| + max |J(f) - J(2f)| · 2^-p / (1 - 2^-p)

Where to begin is told by a picture of a sixteenth of the pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.slabs import MOST_SLABS
from texvol.util.errors import NoRoomError

ORDER = 1.0
# Rounding, and pictures in which steps leave order 1 here and there; in 200 random scenes it holds the error in 99 of
# a hundred (scripts/error_control.py).
SAFETY = 1.5
ROUNDING = 2e-6  # of a picture in float32, relative to its largest number, or 1
SURFACE_ROUNDING = 2e-5
EXTREME_ROUNDING = 4e-6
_MOST_HALVINGS = 6  # of slabs: what is drawn then takes a few times as long as the picture
_COARSEST_RATE, _FINEST_RATE = 1 / 16, 64  # slabs per smallest spacing

AnyScene = TypeVar("AnyScene", bound=Scene)
Draw = Callable[[float], NDArray[np.float32]]  # slab thickness → picture


@dataclass(frozen=True)
class Choice:
    """A slab thickness, and the maximum error that its picture has by estimate."""

    slab_thickness: float
    estimated_error: float
    reached: bool  # whether the estimate is within what was wanted
    picture: NDArray[np.float32]
    begin: Begin  # for a picture of the same in another size


@dataclass(frozen=True)
class Begin:
    """Slabs per smallest spacing, powers of two, at which a search begins: of the picture, and of its reference."""

    rate: float = 1.0
    reference: float = 2.0


def reference_for(scene: AnyScene) -> AnyScene:
    """The scene as it is to be drawn for the finer picture of a pair."""
    if scene.mode != "composite" or scene.classification != "post":
        return scene
    # Of any of the volumes: `integrated` knows no matter that depends on the gradient.
    media = [scene.transfer_function, *(each.transfer_function for each in scene.added)]
    if any(medium is not None and (medium.graded or medium.contours) for medium in media):
        return scene
    return replace(scene, classification="integrated")


def converging(scene: AnyScene) -> AnyScene:
    """The scene as it is to be drawn where another classification has the same integral and is nearer to it.

    Interpolated opacities go to interpolated extinctions as slabs become thin, with order 1; these have order 2.
    """
    if scene.mode == "composite" and scene.classification == "slab":
        return replace(scene, classification="extinction")
    return reference_for(scene)


def halvings_to(reference: Scene, scene: Scene) -> float:
    """What `estimate` is to take for a reference of half the slabs' thickness.

    `extinction` is so much nearer to the integral than `slab` that its own error hides in the margin for safety.
    """
    return np.inf if (scene.classification, reference.classification) == ("slab", "extinction") else 1.0


def thickness_for_error(
    draw: Draw,
    draw_reference: Draw,
    smallest_spacing: float,
    wanted: float,
    begin: Begin | None = None,
    *,
    converges_alone: bool = False,
    finest: float = _FINEST_RATE,
    rounding: Callable[[], float] = lambda: 0.0,
    relative: float = ROUNDING,
) -> Choice:
    """The coarsest slab thickness, among halvings of the spacing, whose picture is within `wanted` by estimate.

    Parameters
    ----------
    draw, draw_reference : callable
        Draw the scene, and what it is held against (`converging`), at a slab thickness in world units.
    smallest_spacing : float
        Of the volume, world units.
    wanted : float
        Maximum absolute error of the linear picture.
    begin : Begin, optional
        What was found for a smaller picture; the search ends in the same where that was right.
    converges_alone : bool
        Whether the reference is another scene than the picture's, better at the same thickness.
    finest : float
        Slabs per smallest spacing that a picture may have, see `finest_rate`; a reference may have twice as many.
    rounding : callable, optional
        Gives what the rounding of values adds to the error of what was drawn last, whatever its slabs.
    relative : float
        What all other rounding costs, relative to the largest number of a picture, or 1: see `rounding_of`.
    """
    begin = begin or Begin()
    drawn: dict[float, NDArray[np.float32]] = {}  # by rate: on the way back some come again

    def at(rate: float) -> NDArray[np.float32]:
        if rate not in drawn:
            drawn[rate] = draw(smallest_spacing / rate)
        return drawn[rate]

    def reference_at(rate: float) -> NDArray[np.float32]:
        return draw_reference(smallest_spacing / rate)

    held: _HeldAgainstItsFiner | _HeldAgainstAnother
    if converges_alone:
        held = _HeldAgainstAnother(reference_at, wanted, begin, 2 * finest, rounding)
    else:
        held = _HeldAgainstItsFiner(reference_at, rounding, relative)
    rate = max(begin.rate, 1.0)  # below, samples could slip through
    while (error := held.error(at(rate), rate)) > wanted and rate < finest:
        rate = min(rate * 2 ** _fewest_halvings(held.of_the_picture(error), held.of_the_picture(wanted)), finest)
    found = Choice(smallest_spacing / rate, error, error <= wanted, at(rate), Begin(rate, held.rate))
    while found.reached and rate > _COARSEST_RATE and held.least_of_coarser(error) <= wanted:
        rate /= 2
        try:
            picture = at(rate)
        except NoRoomError:  # the thicker the slabs, the more is needed around a brick
            break
        error = held.error_of_coarser(picture, rate)
        if not error <= wanted:
            break
        found = Choice(smallest_spacing / rate, error, True, at(rate), Begin(rate, held.rate))
    return found


def _fewest_halvings(error: float, wanted: float) -> int:
    """How often slabs have to be halved at least: each leaves a quarter of the error at order 2, hardly ever less."""
    return max(int(np.log2(error / wanted) / 2), 1) if np.isfinite(error) and wanted > 0 else 1


class _HeldAgainstItsFiner:
    """A picture is held against one of half its thickness."""

    def __init__(self, draw: Draw, rounding: Callable[[], float], relative: float) -> None:
        self._draw, self._rounding, self._relative = draw, rounding, relative
        self.rate = 0.0  # of the finer one

    def error(self, picture: NDArray[np.float32], rate: float) -> float:
        """The estimate for a picture at that rate."""
        self.rate = 2 * rate
        self._finer = self._draw(self.rate)
        return self.error_of_coarser(picture, rate)

    def error_of_coarser(self, picture: NDArray[np.float32], rate: float) -> float:
        """The same, for one that is coarser than the last."""
        return estimate(picture, self._finer, round(np.log2(self.rate / rate)), self._relative) + self._rounding()

    def least_of_coarser(self, error: float) -> float:
        """What the estimate will be for slabs of twice the thickness, at least, where that of these is `error`."""
        return 2.0**ORDER * error

    def of_the_picture(self, error: float) -> float:
        """What of an estimate depends on the picture's slabs."""
        return error


class _HeldAgainstAnother:
    """Pictures are held against one that converges by itself, and is drawn as finely as that takes."""

    def __init__(self, draw: Draw, wanted: float, begin: Begin, finest: float, rounding: Callable[[], float]) -> None:
        self._draw, self._wanted, self._finest, self._rounding = draw, wanted, finest, rounding
        self.rate = max(begin.reference, 2.0) / 2  # so that nothing slips through the coarser one of the pair either
        self._picture = draw(self.rate)
        self._refine()

    def error(self, picture: NDArray[np.float32], rate: float) -> float:
        """The estimate for a picture at any rate."""
        error = self.error_of_coarser(picture, rate)
        # Finer slabs won't do where most of it is what is not known of the reference.
        while error > self._wanted and error <= 3 * self._off and self.rate < self._finest:
            self._refine()
            error = self.error_of_coarser(picture, rate)
        return error

    def error_of_coarser(self, picture: NDArray[np.float32], rate: float) -> float:
        """The same, by the reference as it is."""
        known = self._off + _rounding_in(self._picture) + self._rounding()
        return largest_difference(picture, self._picture) + known

    def least_of_coarser(self, error: float) -> float:
        """What the estimate will be for slabs of twice the thickness, at least, where that of these is `error`."""
        return 2.0**ORDER * (error - self._off) + self._off

    def of_the_picture(self, error: float) -> float:
        """What of an estimate depends on the picture's slabs."""
        return error - self._off

    def _refine(self) -> None:
        """The reference at least twice as fine, and its error at most a half of what is wanted."""
        while True:
            self.rate, coarser = 2 * self.rate, self._picture
            self._picture = self._draw(self.rate)
            self._off = SAFETY * largest_difference(coarser, self._picture) * 2.0**-ORDER / (1 - 2.0**-ORDER)
            if self._off <= self._wanted / 2 or self.rate >= self._finest:
                return


def finest_rate(scene: Scene) -> float:
    """Slabs per smallest spacing of a scene's finest picture that another of twice as many can be held against."""
    return float(2 ** np.floor(np.log2(np.clip(scene.smallest_spacing / _thinnest(scene) / 2, 1, _FINEST_RATE))))


def _thinnest(scene: Scene) -> float:
    """The thickness of slabs of which no more than can be drawn fill the box, however it is seen."""
    return 2 * scene.box.radius / MOST_SLABS


def rounding_of(scene: Scene) -> float:
    """Rounding of float32, relative to the largest number of a picture.

    On a surface the place's rounding tells most, through gradient and highlight. Extremes are those of cubics through
    four values, each of which is rounded.
    """
    if scene.mode in ("mip", "minip"):
        return EXTREME_ROUNDING
    return SURFACE_ROUNDING if scene.mode == "isosurface" else ROUNDING


def estimate(
    picture: NDArray[np.float32], finer: NDArray[np.float32], halvings: float, rounding: float = ROUNDING
) -> float:
    """The maximum error of `picture` from one whose slabs are thinner by `halvings`; or, if infinite, that is exact."""
    off = SAFETY * largest_difference(picture, finer) / (1 - 2.0 ** (-ORDER * halvings))
    return off + _rounding_in(finer, rounding)


def estimate_by_finer(
    scene: CompleteScene,
    picture: NDArray[np.float32],
    thickness: float,
    draw: Callable[[CompleteScene, float], NDArray[np.float32]],
) -> float:
    """The maximum error of a scene's picture at a slab thickness, from another one of half of that, or less.

    It has two slabs per voxel where that is not too dear: samples slip through thicker ones, and pictures may agree
    that nothing is there. Where the volume is drawn in bricks thinner slabs ask for less around each. `draw` takes a
    scene and a thickness. The estimate is infinite where there is no room for any, or slabs would be too many.
    """
    reference = converging(scene)
    most = min(float(_MOST_HALVINGS), float(np.log2(thickness / _thinnest(scene))))
    first = max(min(float(np.log2(thickness / scene.smallest_spacing)) + 1, most), 1.0)
    for halvings in np.arange(first, most + 1e-9):
        try:
            finer = draw(reference, thickness / 2**halvings)
        except NoRoomError:
            continue
        return estimate(picture, finer, max(halvings, halvings_to(reference, scene)), rounding_of(scene))
    return np.inf


def largest_difference(picture: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Of two pictures; numbers may be infinite, and the same."""
    with np.errstate(invalid="ignore"):
        return float(np.where(picture == other, 0.0, np.abs(picture.astype(np.float64) - other)).max())


def _rounding_in(picture: NDArray[np.float32], rounding: float = ROUNDING) -> float:
    numbers = np.abs(picture[..., :3])
    brightest = float(numbers[np.isfinite(numbers)].max(initial=0.0))
    return rounding * max(brightest, 1.0)


def if_finite(estimate: float | None) -> float | None:
    """The estimate, or None where a picture holds numbers that are none: JSON has no other word for it."""
    return estimate if estimate is not None and np.isfinite(estimate) else None
