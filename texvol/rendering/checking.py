"""Check of a picture: some pixels compared with the oracle, and a confidence bound for all others.

The picture is divided into as many strata as pixels are checked, of equal size to within a pixel, and one pixel is
chosen at random in each. Let p be the fraction of all pixels whose error is beyond a limit, and k the number of such
pixels among the n checked ones. Then p is at most p* with a confidence of 99 %, where

    P(k or fewer of n) = Σ_{i <= k} C(n, i) p*^i (1 - p*)^(n - i) = 1 %

(Clopper, Pearson 1934). The bound holds for one pixel of each stratum as well: below the mean, a sum of independent
events is most likely to be small when all are equally likely (Hoeffding 1956).

The oracle takes a second to load and longer to compile. Where a picture is checked in passing, a few rays of a plain
scene are marched here in numpy, by many short steps of values interpolated and classified in their middles:

    I = Σ T_k q_k (1 - exp(-τ_k h)) / τ_k,    T_k = exp(-Σ_{i<k} τ_i h)

Every other step alone, once the even and once the odd ones, gives two pictures that differ by more than this one is
off. Nothing of it is shared with what draws.
"""

from __future__ import annotations

import json
import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.visible_rays import visible_rays
from texvol.scene.large_volume import LargeVolume
from texvol.scene.lighting import casts_shadows
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.halving import is_plain
from texvol.textures.value_storage import HOPELESS, ULP, bulk_of
from texvol.util import progress
from texvol.util.errors import AccuracyWarning, InputError
from texvol.util.upward import upward

ALL = "all"
CONFIDENCE = 0.99
ATTRIBUTE = "texvol:check"  # of a picture's header
_FEW, _LITTLE = 64, 0.1  # pixels that are checked unasked, and the most seconds for them
_FEWER = 16  # pixels that are marched
_MARCHED = 4.0  # factor of the error that marching estimates for itself
_ORACLE = 1e-9  # error of the oracle
_STEPS = 2048  # along each ray; together with the rays that are asked for some 50 ms
_STEPS_BETWEEN = 2.0  # between two control points, where the value goes through most of its range in a voxel
# Seconds of the oracle for one of the cells across a volume, on two cores.
_OF_A_CELL, _OF_A_LIT_CELL, _OF_A_CELL_IN_SHADOW = 5e-8, 1e-7, 5e-6
_STEPS_BEFORE = 512  # where eight samples are classified for each step

Numbers = NDArray[np.float64]
Oracle = Callable[[Scene, tuple[int, int], NDArray[np.intp]], Numbers]


@dataclass(frozen=True)
class Check:
    """Findings of a check of a linear picture."""

    pixels: int  # that were checked
    of: int  # pixels of the picture
    largest_error: float  # largest absolute difference from the oracle of any channel
    limit: float  # requested maximum error; without one, the largest error that was found
    beyond: int  # number of checked pixels with an error beyond the limit
    at_most: float  # upper bound, with 99 % confidence, of the fraction of all pixels with an error beyond the limit

    @property
    def sentence(self) -> str:
        """Findings in a sentence."""
        if self.pixels == self.of:
            found = f"all {self.of} pixels checked: largest error {upward(self.largest_error)}"
            return f"{found}; {self.beyond} of them are beyond {self.limit:g}" if self.beyond else found
        pixels = "1 pixel" if self.pixels == 1 else f"{self.pixels} pixels"
        found = f"{pixels} checked: largest error {upward(self.largest_error)}"
        if self.beyond:
            found += f", {self.beyond} of them beyond {self.limit:g}"
        fraction = math.ceil(1000 * self.at_most) / 10  # never less than what is known
        return f"{found}; 99 % confident that at most {fraction:g} % of the pixels are beyond {upward(self.limit)}"

    @property
    def attributes(self) -> dict[str, str]:
        """Findings as an attribute of a picture's header."""
        return {ATTRIBUTE: json.dumps(self.metadata)}

    @property
    def metadata(self) -> dict[str, Any]:
        """Findings for `--stats` and headers, as JSON types; an error that is not finite is None."""
        found: dict[str, Any] = asdict(self) | {"confidence": CONFIDENCE, "sentence": self.sentence}
        unsaid = {key for key, each in found.items() if isinstance(each, float) and not math.isfinite(each)}
        return {key: None if key in unsaid else each for key, each in found.items()}


def checked_count(check: int | str | None) -> int | str | None:
    """Return the number of pixels to check, "all", or None for no check.

    Raises
    ------
    InputError
        If `check` is none of these.
    MissingExtraError
        If numba, which the oracle needs, is not installed.
    """
    if check is None:
        return None
    whole = not isinstance(check, bool) and isinstance(check, int | np.integer)
    if check != ALL and (not whole or int(check) < 1):
        raise InputError(f'check must be a number of pixels of at least 1, or "all", got {check!r}')
    import texvol.ray_casting  # noqa: F401

    return ALL if check == ALL else int(check)


def check_picture(
    picture: NDArray[np.float32],
    scene: Scene,
    count: int | str,
    limit: float | None = None,
    seed: int = 0,
    oracle: Oracle | None = None,
) -> Check:
    """Compare `count` random pixels of a picture, or all, with the oracle; the seed decides which.

    Parameters
    ----------
    picture : array of shape (height, width, 4)
        Linear and premultiplied, over the background.
    limit : float, optional
        Requested maximum error.
    oracle : callable, optional
        Returns some pixels of the exact picture, in place of `texvol.rendering.streaming.exact.raycast_pixels`.

    Raises
    ------
    MissingExtraError
        If numba is not installed.
    """
    height, width = picture.shape[:2]
    pixels_checked = width * height if count == ALL else min(int(count), width * height)
    with progress.part(lambda: seconds_of_oracle(scene, pixels_checked)):
        drawn, truth = _held(picture, scene, pixels_checked, seed, oracle)
    return _check_of(errors_of(drawn, truth), width * height, limit)


def seconds_of_oracle(scene: Scene, pixels: int) -> float:
    """Return about how long the oracle takes for so many pixels on two cores."""
    lit, across = scene.lighting is not None and scene.mode == "composite", np.linalg.norm(scene.volume.dimensions)
    of_a_lit_cell = _OF_A_CELL_IN_SHADOW if casts_shadows(scene.lighting) else _OF_A_LIT_CELL
    return float(pixels * across * (of_a_lit_cell if lit else _OF_A_CELL))


def _held(
    picture: NDArray[np.float32], scene: Scene, count: int, seed: int, oracle: Oracle | None
) -> tuple[NDArray[np.float32], Numbers]:
    """Return pixels of a picture and the oracle's in the same order; tell the progress."""
    from texvol.rendering.streaming.exact import raycast, raycast_pixels

    height, width = picture.shape[:2]
    tell = _Told()
    if oracle is not None:
        pixels = chosen_pixels((width, height), count, seed)
        return picture[pixels[:, 1], pixels[:, 0]], oracle(scene, (width, height), pixels)
    if count == width * height:
        return picture.reshape(-1, 4), raycast(scene, (width, height), tell=tell).reshape(-1, 4)
    pixels = chosen_pixels((width, height), count, seed)
    return picture[pixels[:, 1], pixels[:, 0]], raycast_pixels(scene, (width, height), pixels, tell)


class _Told:
    """Function that tells the progress what fraction of the pixels is there."""

    def __init__(self) -> None:
        self._before = 0.0

    def __call__(self, fraction: float) -> None:
        if fraction > self._before:  # a scene in parts begins several times
            before, self._before = self._before, fraction
            progress.within(fraction - before)


def check_in_passing(picture: NDArray[np.float32], scene: CompleteScene, limit: float) -> Check | None:
    """Check a few pixels if that takes under a tenth of a second; return None if it would take longer.

    The oracle is used if it has drawn the same kind of scene before: otherwise its functions have to be compiled.
    Other scenes are marched if they are plain. A marched pixel counts only if its error is beyond the limit and the
    error of marching together; there is no check if no pixel is.
    """
    if isinstance(scene.volume, LargeVolume):
        return None  # it would have to be read
    oracle = sys.modules.get("texvol.ray_casting")
    seconds = oracle.seconds_per_pixel(scene) if oracle else None
    if seconds is not None and seconds * _FEW < _LITTLE:
        return check_picture(picture, scene, _FEW, limit)
    if not can_march(scene):
        return None
    height, width = picture.shape[:2]
    pixels = chosen_pixels((width, height), min(_FEWER, width * height))
    truth, off = march_pixels(scene, (width, height), pixels)
    errors = errors_of(picture[pixels[:, 1], pixels[:, 0]], truth) - _MARCHED * off
    return _check_of(np.maximum(errors, 0.0), width * height, limit) if (errors > limit).any() else None


def _check_of(errors: NDArray[np.float64], total: int, limit: float | None) -> Check:
    """Return the findings for a picture of `total` pixels from the errors of some of them."""
    n, largest = len(errors), float(errors.max())
    limit = largest if limit is None else limit
    beyond = int(np.count_nonzero(~(errors <= limit + _ORACLE)))
    if n == total:
        return Check(n, total, largest, limit, beyond, beyond / n)
    # Strata are of equal size to within a pixel.
    at_most = min(fraction_at_most(beyond, n) * -(-total // n) * n / total, 1.0)
    return Check(n, total, largest, limit, beyond, at_most)


def errors_of(drawn: NDArray, truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest difference of each pixel's channels, shape (n,); infinite where only one of two is a number."""
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(drawn.astype(np.float64) - truth.astype(np.float64))
        # Numbers beyond the range of float32 are infinite in a picture.
        beyond = np.isinf(drawn) & (np.abs(truth) > np.finfo(np.float32).max) & (np.sign(drawn) == np.sign(truth))
    off[(drawn == truth) | (np.isnan(drawn) & np.isnan(truth)) | beyond] = 0.0
    return np.where(np.isnan(off), np.inf, off).max(axis=1)


def chosen_pixels(size: tuple[int, int], count: int, seed: int = 0) -> NDArray[np.intp]:
    """Choose a random pixel in each of `count` strata; return (column, row), shape (count, 2).

    A stratum is a run of pixels on a path that fills the picture in strips about as high as a stratum is wide.
    """
    width, height = size
    strips = max(1, round(math.sqrt(count * height / width)))
    rows = np.arange(height)
    strip = rows * strips // height
    # Column by column within each strip, in alternating directions, so that runs stay compact.
    order = np.concatenate([_through(rows[strip == each], width, each % 2 == 1) for each in range(strips)])
    edges = np.arange(count + 1) * (width * height) // count
    at = edges[:-1] + (np.random.default_rng(seed).random(count) * np.diff(edges)).astype(np.intp)
    return np.column_stack([order[at] % width, order[at] // width])


def fraction_at_most(beyond: int, count: int) -> float:
    """Upper confidence bound of a fraction of which `beyond` among `count` samples were found."""
    if beyond >= count:
        return 1.0
    low, high = beyond / count, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _so_few(beyond, count, middle) > 1 - CONFIDENCE:
            low = middle
        else:
            high = middle
    return high


def _so_few(most: int, count: int, fraction: float) -> float:
    """Probability of at most `most` of `count` independent events of probability `fraction`, between 0 and 1."""
    yes, no = math.log(fraction), math.log1p(-fraction)
    combinations = [math.lgamma(count + 1) - math.lgamma(i + 1) - math.lgamma(count - i + 1) for i in range(most + 1)]
    return math.fsum(math.exp(each + i * yes + (count - i) * no) for i, each in enumerate(combinations))


def _through(rows: NDArray[np.intp], width: int, backwards: bool) -> NDArray[np.intp]:
    """Indices of all pixels of some rows, column by column, alternately down and up."""
    columns = np.arange(width)[::-1] if backwards else np.arange(width)
    pixels = columns[:, np.newaxis] + rows * width
    pixels[1::2] = pixels[1::2, ::-1]
    return pixels.reshape(-1)


def warn_of_lost_digits(lost: float) -> None:
    """Warn of values that single precision cannot tell apart.

    `lost` is the rounding of values, as a fraction of the narrowest interval of the transfer function.
    """
    if lost >= HOPELESS * ULP:
        warnings.warn(
            "single precision cannot hold the values at which the transfer function changes: they are so far apart "
            f"that rounding moves values by up to {lost:.2g} of its narrowest interval",
            AccuracyWarning,
            stacklevel=3,
        )


def at_least(estimate: float | None, check: Check | None) -> float | None:
    """Return the estimate, or the largest error of a checked pixel if that is larger."""
    return estimate if check is None or estimate is None else max(estimate, check.largest_error)


def held_against_oracle(
    picture: NDArray[np.float32],
    scene: CompleteScene,
    count: int | str | None,
    wanted: float | None,
    estimate: float | None,
    oracle: Oracle | None = None,
) -> Check | None:
    """Check some pixels, and warn if their error is larger than requested.

    Without a `count` only few are checked, if that takes little time; `estimate` is that of the error, for the warning,
    and `oracle` that of `check_picture`.
    """
    if count is not None:
        found: Check | None = check_picture(picture, scene, count, wanted, oracle=oracle)
    else:
        found = None if wanted is None else check_in_passing(picture, scene, wanted)
    if wanted is not None and found is not None and found.beyond:
        said = "" if estimate is None else f", {upward(estimate)} estimated"
        warnings.warn(
            f"requested error of {wanted:g} not reached{said}: of {found.pixels} checked pixels {found.beyond} are "
            f"beyond, with errors of up to {upward(found.largest_error)}",
            AccuracyWarning,
            stacklevel=3,
        )
    return found


def can_march(scene: CompleteScene) -> bool:
    """True for one volume of finite values and a plain medium of finite extinction without narrow spikes."""
    return is_plain(scene) and not scene.added and scene.depth_cue is None and not _may_pass_over(scene)


def _may_pass_over(scene: CompleteScene) -> bool:
    """True if the value may go through all that lies between two control points within a step."""
    if scene.classification in ("slab", "extinction"):
        return False
    low, high = bulk_of(scene.volume)
    voxels = float(np.linalg.norm(scene.volume.dimensions)) / _STEPS
    gaps = np.diff(scene.medium.values)
    return bool(gaps[gaps > 0].min(initial=np.inf) < _STEPS_BETWEEN * voxels * (high - low))


def march_pixels(scene: CompleteScene, size: tuple[int, int], pixels: NDArray[np.intp]) -> tuple[Numbers, Numbers]:
    """Pixels of the linear picture over its background, shape (n, 4), and how far off each may be, shape (n,).

    Parameters
    ----------
    pixels : array of shape (n, 2)
        Column and row of each, from the top left.
    """
    columns, rows = pixels.T
    eyes, directions = (each[rows, columns] for each in scene.camera.rays(size))
    volume = scene.volume
    # A step across a face of the box would be off by up to half of itself, and the two estimates alike.
    nearest, directions, first, last = visible_rays(scene, eyes, directions)
    length = np.maximum(last - first, 0.0)
    before = scene.classification in ("slab", "extinction")
    steps = _STEPS_BEFORE if before else _STEPS
    middles = first[:, np.newaxis] + (np.arange(steps) + 0.5) / steps * length[:, np.newaxis]
    positions = nearest[:, np.newaxis] + middles[..., np.newaxis] * directions[:, np.newaxis]
    q, tau = _medium(volume, scene.medium, positions.reshape(-1, 3), before)
    q, tau = q.reshape(len(pixels), steps, 3), tau.reshape(len(pixels), steps)
    fine = _composited(q, tau, length / steps, scene.background)
    even, odd = (_composited(q[:, i::2], tau[:, i::2], 2 * length / steps, scene.background) for i in (0, 1))
    return fine, np.abs(even - odd).max(axis=1)


def _medium(
    volume: Volume, transfer_function: TransferFunction, positions: Numbers, before: bool
) -> tuple[Numbers, Numbers]:
    """Emission (n, 3) and extinction (n) at positions from the middle of the box, world units; 0 outside."""
    last = np.array(volume.dimensions) - 1
    index = positions @ volume.index_from_world.T + 0.5 * last
    outside = np.any((index < -0.5) | (index > last + 0.5), axis=1)
    index = np.clip(index, 0, last)
    low = np.minimum(index.astype(np.intp), np.maximum(last - 1, 0))
    fraction = index - low
    value, q, tau = np.zeros(len(positions)), np.zeros((len(positions), 3)), np.zeros(len(positions))
    for corner in range(8):
        far = corner >> np.arange(3) & 1
        weight = np.where(far, fraction, 1 - fraction).prod(axis=1)
        x, y, z = np.minimum(low + far, last).T
        samples = volume.values[z, y, x].astype(np.float64)
        if before:
            emission, extinction = transfer_function.classify(samples)
            q += weight[:, np.newaxis] * emission
            tau += weight * extinction
        else:
            value += weight * samples
    if not before:
        q, tau = transfer_function.classify(value)
    return np.where(outside[:, np.newaxis], 0.0, q), np.where(outside, 0.0, tau)


def _composited(q: Numbers, tau: Numbers, step: Numbers, background: tuple[float, float, float]) -> Numbers:
    """Premultiplied colour over the background, and opacity, of rays of steps, shape (n, 4)."""
    depth = tau * step[:, np.newaxis]
    behind = np.cumsum(depth, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(depth > 1e-8, -np.expm1(-depth) / depth, 1.0)
    seen = np.exp(-(behind - depth)) * mean * step[:, np.newaxis]
    left = np.exp(-behind[:, -1])
    color = (q * seen[..., np.newaxis]).sum(axis=1) + left[:, np.newaxis] * np.array(background)
    return np.column_stack([color, -np.expm1(-behind[:, -1])])
