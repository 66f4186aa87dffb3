"""Who draws a scene within an error: texvol, VTK's mappers and a plain marcher, each with every setting that it has.

Settings are tried from coarse to fine until the error is small enough, and then the one between the last two. Nothing
is interpolated.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from benchmark_scenes import SIZE, rms
from numpy.typing import NDArray
from plain_marcher import PlainMarcher

from texvol import Renderer, Scene
from texvol.report import vtk_mappers
from texvol.report.convergence import Limits
from texvol.report.convergence import Truths as BothTruths

Seconds = tuple[float, float]  # wall, processor
WANTED = (1e-2, 3e-3, 1e-3)
# Light that ends unseen behind this transmittance adds to the error, at most as much: it is a share of what is wanted.
TERMINATION_FRACTION = 1 / 4
RATES = tuple(2.0**power for power in range(-5, 6))  # samples per smallest spacing
_VTK_RATES = tuple(2.0 ** (power / 2) for power in range(-8, 7))  # distances of 16 voxels to an eighth
_CLASSIFICATIONS = ("post", "extinction", "slab", "integrated")
NEARLY_AS_FAST = 1.3  # times differ by as much from turn to turn
_SLOW = 2.0  # seconds of a frame beside which what the first of its kind prepares is nothing
_FLOOR = 0.9  # an error that a finer setting leaves above this share of itself has stopped falling
_FALLS_FROM = 5e-2  # errors above say little about the next


@dataclass(frozen=True)
class Trial:
    """One setting that was tried."""

    setting: Any
    words: str
    seconds: float
    rms: float
    processor_seconds: float = math.nan


@dataclass(frozen=True)
class Frame:
    """One frame: seconds until it is drawn and read back, those of all threads together, and the picture."""

    seconds: float
    processor_seconds: float
    picture: NDArray[np.float32]


class Competitor(Protocol):
    """Somebody who draws the scene."""

    name: str
    trials: list[Trial]
    out_of_time: bool  # not everything was tried
    problem: str  # why nothing could be

    def search(self) -> None:
        """Try settings until each error that is wanted is reached, or there is no hope."""

    def again(self, trials: Sequence[Trial]) -> dict[Trial, Seconds]:
        """Seconds of a warm frame of each, wall and processor, timed anew."""


@dataclass
class Walker:
    """One who is asked for one picture after the other."""

    name = ""
    rates = RATES  # of the settings of a family, from coarse to fine
    truth: NDArray[np.float64]
    time_limit: float
    trials: list[Trial] = field(default_factory=list)
    out_of_time: bool = False
    problem: str = ""

    def families(self) -> Iterable[str]:
        """Kinds of settings, each of which is walked through by its rate."""
        raise NotImplementedError

    def setting(self, family: str, rate: float, wanted: float) -> tuple[Any, str]:
        """A setting and its name."""
        raise NotImplementedError

    def frame(self, setting: Any) -> Frame:
        """One frame."""
        raise NotImplementedError

    def search(self) -> None:
        """Walk through every family, for one error after the other; each has so much time for all of them."""
        starts, left = dict.fromkeys(self.families(), 0), dict.fromkeys(self.families(), self.time_limit)
        for wanted in WANTED:
            for family, start in list(starts.items()):
                began = time.perf_counter()
                reached = self._walk(family, start, wanted, began + left[family])
                left[family] -= time.perf_counter() - began
                if reached is None:
                    del starts[family]  # what can't reach this error can't reach a smaller one
                else:
                    starts[family] = reached

    def again(self, trials: Sequence[Trial]) -> dict[Trial, Seconds]:
        """Two frames of each after one that isn't counted; of slow ones one."""
        times = {}
        for trial in trials:
            slow = trial.seconds > _SLOW
            if not slow:
                self.frame(trial.setting)
            times[trial] = median_seconds([self.frame(trial.setting) for _ in range(1 if slow else 2)])
        return times

    def _walk(self, family: str, start: int, wanted: float, deadline: float) -> int | None:
        """Try rates from the one of this number on; where to look for a smaller error, or None if there is no hope."""
        errors: list[float] = []
        for number, rate in enumerate(self.rates[start:], start):
            trial = self._tried(family, rate, wanted)
            if trial.rms <= wanted:
                if number:
                    self._tried(family, rate / np.sqrt(2), wanted)
                return number
            errors.append(trial.rms)
            if stopped_falling(errors):
                return None
            best = fastest(self.trials, wanted)
            if best is not None and trial.seconds > NEARLY_AS_FAST * best.seconds:
                return number
            if time.perf_counter() > deadline:
                self.out_of_time = True
                return None
        return None

    def _tried(self, family: str, rate: float, wanted: float) -> Trial:
        setting, words = self.setting(family, rate, wanted)
        known = next((trial for trial in self.trials if trial.setting == setting), None)
        if known is not None:
            return known
        first = self.frame(setting)
        more = int(np.clip(0.5 / max(first.seconds, 1e-3), 1, 3))
        seconds, of_processor = median_seconds([self.frame(setting) for _ in range(more)])
        trial = Trial(setting, words, seconds, rms(first.picture, self.truth), of_processor)
        self.trials.append(trial)
        return trial


class Texvol(Walker):
    """Every classification at every rate."""

    name = "texvol"

    def __init__(self, renderer: Renderer, scene: Scene, truth: NDArray[np.float64], time_limit: float) -> None:
        super().__init__(truth, time_limit)
        self._renderer, self._scene = renderer, scene

    def families(self) -> Iterable[str]:
        """The classifications."""
        return _CLASSIFICATIONS

    def setting(self, family: str, rate: float, wanted: float) -> tuple[Any, str]:
        """Classification, rate and where rays end."""
        return (family, rate, TERMINATION_FRACTION * wanted), f"{family}, {1 / rate:.3g}"

    def frame(self, setting: Any) -> Frame:
        """Draw and read back; the processor's seconds are those of the whole call."""
        classification, rate, termination = setting
        scene = replace(self._scene, classification=classification)
        start = time.process_time()
        picture = self._renderer.render(scene, SIZE, sampling_rate=rate, early_termination=termination)
        of_processor = time.process_time() - start
        return Frame(self._renderer.seconds["draw"] + self._renderer.seconds["read"], of_processor, picture)


class Marcher(Walker):
    """The plain marcher at every distance."""

    name = "numba marcher"

    def __init__(self, scene: Scene, truth: NDArray[np.float64], time_limit: float) -> None:
        super().__init__(truth, time_limit)
        self._marcher, self._spacing = PlainMarcher(scene, SIZE), scene.volume.smallest_spacing
        self._marcher.draw(8 * self._spacing)  # compiles it

    def families(self) -> Iterable[str]:
        """There is one."""
        return ("marcher",)

    def setting(self, family: str, rate: float, wanted: float) -> tuple[Any, str]:
        """Distance of samples and where rays end."""
        return (self._spacing / rate, TERMINATION_FRACTION * wanted), f"{1 / rate:.3g}"

    def frame(self, setting: Any) -> Frame:
        """March."""
        start, processor_start = time.perf_counter(), time.process_time()
        picture = self._marcher.draw(*setting)
        return Frame(time.perf_counter() - start, time.process_time() - processor_start, picture)


@dataclass
class Vtk:
    """One of VTK's mappers, in a process of its own."""

    renderer: Renderer
    scene: Scene
    mapper: str
    truth: NDArray[np.float64]
    time_limit: float
    trials: list[Trial] = field(default_factory=list)
    out_of_time: bool = False
    problem: str = ""

    @property
    def name(self) -> str:
        """The mapper's."""
        return self.mapper

    def search(self) -> None:
        """Every distance, until the smallest error is reached or errors have stopped falling."""
        limits = Limits(setting_seconds=self.time_limit / 4, sweep_seconds=self.time_limit, least_frames=2)
        errors: list[float] = []
        with closing(self._frames(_VTK_RATES, limits)) as frames:
            for trial in frames:
                self.trials.append(trial)
                errors.append(trial.rms)
                # Every other setting is half as fine.
                if trial.rms <= min(WANTED) or (stopped_falling(errors[::2]) and stopped_falling(errors[1::2])):
                    return
        self.out_of_time = len(self.trials) < len(_VTK_RATES)

    def again(self, trials: Sequence[Trial]) -> dict[Trial, Seconds]:
        """Three frames of each after one that isn't counted."""
        limits = Limits(sweep_seconds=10 * self.time_limit, least_frames=3, most_frames=3)
        rates = sorted(trial.setting for trial in trials)
        timed = {trial.setting: (trial.seconds, trial.processor_seconds) for trial in self._frames(rates, limits)}
        return {trial: timed[trial.setting] for trial in trials if trial.setting in timed}

    def _frames(self, rates: Sequence[float], limits: Limits) -> Iterator[Trial]:
        truths = BothTruths(None, self.truth)
        try:
            for measured, picture in vtk_mappers.sweep(
                self.renderer, self.scene, SIZE, self.mapper, rates, truths, limits
            ):
                if picture is not None and measured.seconds:
                    rate = measured.setting.sampling_rate
                    words, of_processor = f"{self.mapper}, {1 / rate:.3g}", measured.processor_seconds or math.nan
                    yield Trial(rate, words, measured.seconds, rms(picture, self.truth), of_processor)
        except vtk_mappers.VtkError as error:
            self.problem = str(error)  # what it measured before stays


def median_seconds(frames: Sequence[Frame]) -> Seconds:
    """Return the medians of the seconds of frames, wall and processor."""
    walls, of_processor = zip(*((frame.seconds, frame.processor_seconds) for frame in frames), strict=True)
    return statistics.median(walls), statistics.median(of_processor)


def stopped_falling(errors: Sequence[float]) -> bool:
    """Whether the last two errors of settings twice as fine each are hardly less than the one before them."""
    return len(errors) > 2 and errors[-3] < _FALLS_FROM and min(errors[-2:]) > _FLOOR * errors[-3]


def fastest(trials: Iterable[Trial], wanted: float) -> Trial | None:
    """The fastest that is within the error, or None."""
    return min((trial for trial in trials if trial.rms <= wanted), key=lambda trial: trial.seconds, default=None)
