"""Choice of the coarseness of pictures: coarse enough to keep up with changes, finer at rest.

The work of a picture is its number of samples, plus a part for each pixel. Small pictures take more time for their
work, because setting up costs the same:

    work = pixels × (sampling rate + 1/2)        seconds ≈ speed × work^¾

The speed is the median over the last pictures, so that one delayed picture changes nothing. The chosen coarseness is
the finest step of a ladder that fits the wanted time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import starmap
from statistics import median
from typing import Any

from texvol.scene.scene import Scene
from texvol.util.upward import upward

DEFAULT_FRAMES_PER_SECOND = 30.0
DEFAULT_ERROR = 1 / 255  # one step of the 8 bits that a screen shows
# While the scene changes, a ray ends where less transmittance than half a step of 8 bits is left.
MOVING_TERMINATION = 1 / 512
SETTLED = 0.12  # seconds without a change after which the scene is at rest: less than most pauses of a drag
_BEGIN = 2e-6  # seconds for a work of 1 on a CPU with two cores; replaced by the first measurement
# Measured on two cores: a quarter of the work takes 0.35 to 0.47 of the time, for 200 x 150 to 800 x 600 pixels.
_EXPONENT = 0.75
_REMEMBERED = 5  # pictures
_COARSE, _LEAST_PIXELS = 7, 60_000  # pictures coarser than that are for wide screens, on which they have more pixels
_FINER_BELOW = 0.75  # fraction of the wanted time: without this margin the coarseness would alternate


@dataclass(frozen=True)
class Coarseness:
    """Coarseness of a picture: `shrink` divides its sides; `rate` is the number of slabs per smallest spacing."""

    shrink: float
    rate: float

    def size(self, full: tuple[int, int]) -> tuple[int, int]:
        """Return the size of the picture in pixels, of a window of `full` pixels."""
        width, height = (max(1, round(side / self.shrink)) for side in full)
        return width, height

    def work(self, full: tuple[int, int]) -> float:
        """Return the work of the picture, in pixels times slabs per sample."""
        width, height = self.size(full)
        return width * height * (self.rate + 0.5)


# From fine to coarse. A CPU needs as long for pixels as for samples; a graphics card needs hardly any time for pixels.
ON_CPU = tuple(starmap(Coarseness, (
    (1, 1), (1, 0.7), (1, 0.5), (1.5, 0.7), (1.5, 0.5), (2, 0.7), (2, 0.5), (2.5, 0.5), (3, 0.5), (4, 0.5), (4, 0.35),
    (5, 0.35), (6, 0.35), (7, 0.35), (8, 0.35), (10, 0.35),
)))  # fmt: skip
ON_CARD = tuple(starmap(Coarseness, ((1, 2), (1, 1), (1, 0.7), (1, 0.5), (1.5, 0.5), (2, 0.5), (3, 0.5), (4, 0.35))))
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")


def is_software(renderer: str) -> bool:
    """True if a driver of that name draws on the CPU."""
    return any(word in renderer.lower() for word in _SOFTWARE)


class Pace:
    """Choice of a coarseness by the time that pictures take; it learns from each picture."""

    def __init__(self, frames_per_second: float = DEFAULT_FRAMES_PER_SECOND) -> None:
        self.wanted = 1 / frames_per_second
        self.ladder = ON_CPU
        self._speeds: deque[float] = deque(maxlen=_REMEMBERED)
        self._current: Coarseness | None = None

    def choose(self, full: tuple[int, int]) -> Coarseness:
        """Return the coarseness of the next picture, for a window of `full` pixels."""
        ladder = [each for each in self.ladder if each.shrink <= _COARSE or math.prod(each.size(full)) >= _LEAST_PIXELS]
        finest = next((each for each in ladder if self._seconds(each, full) <= self.wanted), ladder[-1])
        current = self._current
        if current is not None and current in ladder and finest.work(full) > current.work(full):
            # Change to a finer picture only if there is time to spare.
            spare = _FINER_BELOW * self.wanted
            finest = next((each for each in ladder if self._seconds(each, full) <= spare), ladder[-1])
            finest = max(finest, current, key=lambda each: each.work(full))
        self._current = finest
        return finest

    def learn(self, coarseness: Coarseness, full: tuple[int, int], seconds: float) -> None:
        """Record the seconds that a picture took."""
        self._speeds.append(seconds / coarseness.work(full) ** _EXPONENT)

    def _seconds(self, coarseness: Coarseness, full: tuple[int, int]) -> float:
        return median(self._speeds or [_BEGIN]) * coarseness.work(full) ** _EXPONENT


def moving_scene(scene: Scene) -> Scene:
    """Return the scene to draw while something changes, without the parts that would have to be baked again.

    Values are classified after interpolation, because one texture then serves all transfer functions and lights. The
    classifications `slab` and `extinction` bake both into the texture, and the table of `integrated` costs five times
    as much. Shadows are left out.
    """
    if scene.mode != "composite":
        return scene
    lighting = scene.lighting
    if lighting is not None and lighting.shadows:
        lighting = replace(lighting, shadows=False)
    plain = all(volume.colors is None and not volume.labels for volume in scene.volumes)
    return replace(scene, classification="post" if plain else scene.classification, lighting=lighting)


def error_text(metadata: Mapping[str, Any], *, numbers: bool = False) -> str:
    """Return the displayed text about the error of a picture at rest."""
    estimate, wanted = metadata.get("estimated_error"), metadata.get("wanted_error")
    if estimate is None:
        return "error not estimated"
    if metadata.get("reached") and wanted is not None and estimate <= wanted:
        return f"error ≤ {limit_text(wanted, numbers=numbers)}"
    return f"error ≈ {upward(estimate)}"


def limit_text(error: float, *, numbers: bool) -> str:
    """Return an error as a fraction such as 2/255 if it is a whole number of 8-bit steps, else as a decimal number.

    The error of a picture of `numbers` is always a decimal number.
    """
    if numbers:
        return upward(error, 3)
    steps = error * 255
    return f"{steps:.0f}/255" if abs(steps - round(steps)) < 1e-6 and round(steps) > 0 else upward(error)
