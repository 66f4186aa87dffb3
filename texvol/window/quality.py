"""What to draw next: coarse enough to keep up while something changes, better and better at rest.

There is so much to do for a picture as it has samples, and some for each pixel; a small one takes longer than its
share, since setting up costs the same:

    work = pixels × (sampling rate + 1/2)        seconds ≈ speed × work^¾

The speed is learned from the last pictures: the middle one counts, so that a single one that had to wait for something
else changes nothing. The coarseness is the finest of a ladder that fits the wanted time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

from texvol.scene.scene import Scene

DEFAULT_FRAMES_PER_SECOND = 30.0
DEFAULT_ERROR = 1 / 255  # one step of the 8 bits that a screen shows
# While something moves a ray may end where less than this is left: half a step of 8 bits.
MOVING_TERMINATION = 1 / 512
SETTLED = 0.12  # seconds without a change, after which it is rest: less than a hand pauses for by itself
_BEGIN = 2e-6  # seconds for a work of 1, of a CPU with two cores; the first picture corrects it
# Of a quarter of the work, measured on two cores: between 0.35 and 0.47 of the time, for 200 x 150 to 800 x 600 pixels.
_EXPONENT = 0.75
_REMEMBERED = 5  # pictures
_FINER_BELOW = 0.75  # of the wanted time: else it would go back and forth between two


@dataclass(frozen=True)
class Coarseness:
    """`shrink` times fewer pixels along each side, so many slabs per smallest spacing."""

    shrink: float
    rate: float

    def size(self, full: tuple[int, int]) -> tuple[int, int]:
        """Pixels of the picture."""
        width, height = (max(1, round(side / self.shrink)) for side in full)
        return width, height

    def work(self, full: tuple[int, int]) -> float:
        """How much there is to do, in pixels times slabs per sample."""
        width, height = self.size(full)
        return width * height * (self.rate + 0.5)


def _ladder(*steps: tuple[float, float]) -> tuple[Coarseness, ...]:
    return tuple(Coarseness(*step) for step in steps)


# From fine to coarse. Pixels cost a CPU as much as samples do, and a graphics card nothing to speak of.
ON_CPU = _ladder(
    (1, 1), (1, 0.7), (1, 0.5), (1.5, 0.7), (1.5, 0.5), (2, 0.7), (2, 0.5), (2.5, 0.5), (3, 0.5), (4, 0.5), (4, 0.35),
)  # fmt: skip
ON_CARD = _ladder((1, 2), (1, 1), (1, 0.7), (1, 0.5), (1.5, 0.5), (2, 0.5), (3, 0.5), (4, 0.35))
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")


def is_software(renderer: str) -> bool:
    """Whether a driver of that name draws on the CPU."""
    return any(word in renderer.lower() for word in _SOFTWARE)


class Pace:
    """How coarse pictures have to be to come in time; learns from each."""

    def __init__(self, frames_per_second: float = DEFAULT_FRAMES_PER_SECOND) -> None:
        self.wanted = 1 / frames_per_second
        self.ladder = ON_CPU
        self._speeds: deque[float] = deque([_BEGIN], maxlen=_REMEMBERED)
        self._current: Coarseness | None = None

    def choose(self, full: tuple[int, int]) -> Coarseness:
        """For the next picture, of a place of so many pixels."""
        finest = next((each for each in self.ladder if self._seconds(each, full) <= self.wanted), self.ladder[-1])
        current = self._current
        if current is not None and current in self.ladder and finest.work(full) > current.work(full):
            # A finer one only where there is time to spare.
            spare = _FINER_BELOW * self.wanted
            finest = next((each for each in self.ladder if self._seconds(each, full) <= spare), self.ladder[-1])
            finest = max(finest, current, key=lambda each: each.work(full))
        self._current = finest
        return finest

    def learn(self, coarseness: Coarseness, full: tuple[int, int], seconds: float) -> None:
        """A picture of that coarseness took so long."""
        self._speeds.append(seconds / coarseness.work(full) ** _EXPONENT)

    def _seconds(self, coarseness: Coarseness, full: tuple[int, int]) -> float:
        return median(self._speeds) * coarseness.work(full) ** _EXPONENT


def moving_scene(scene: Scene) -> Scene:
    """What is drawn of a scene while something changes: whatever would have to be baked anew is left out.

    Values are classified after interpolation then, from one texture for every transfer function and light, where the
    scene bakes either into its texels, or interpolates in a table that costs five times as much. Shadows are kept out.
    """
    if scene.mode != "composite":
        return scene
    lighting = scene.lighting
    if lighting is not None and lighting.shadows:
        lighting = replace(lighting, shadows=False)
    plain = all(volume.colors is None and not volume.labels for volume in scene.volumes)
    return replace(scene, classification="post" if plain else scene.classification, lighting=lighting)


def moving_accuracy(coarseness: Coarseness) -> Mapping[str, Any]:
    """Arguments of `Renderer.render` while something changes."""
    return {"sampling_rate": coarseness.rate, "early_termination": MOVING_TERMINATION}


def error_text(metadata: Mapping[str, Any], *, numbers: bool = False) -> str:
    """What is said of the error of a picture at rest."""
    estimate, wanted = metadata.get("estimated_error"), metadata.get("wanted_error")
    if estimate is None:
        return "error not estimated"
    if metadata.get("reached") and wanted is not None and estimate <= wanted:
        return f"error ≤ {share_text(wanted)}" if not numbers else f"error ≤ {wanted:.3g}"
    return f"error ≈ {estimate:.2g}"


def share_text(error: float) -> str:
    """A share as steps of 8 bits where it is a whole number of them, else as a number."""
    steps = error * 255
    return f"{steps:.0f}/255" if abs(steps - round(steps)) < 1e-6 and round(steps) > 0 else f"{error:.2g}"
