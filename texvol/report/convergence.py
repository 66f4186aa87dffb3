"""Speed against error, as data: one scene drawn with many settings, each timed and held against both oracles.

Three errors are kept apart. The *discretisation error* of a picture is its distance from the exact integral of the
medium that its classification means; thinner slabs remove it. The *model error* is the distance of the pre-classified
integral from the post-classified one; nothing but another classification removes it. The *total error* is a picture's
distance from the post-classified integral, so for `post` and `integrated` it is the discretisation error.

Seconds are those of a warm frame: the median draw, and reading the picture back. What comes before the first frame,
baking the texture and uploading it, is given beside them.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison import Difference, compare
from texvol.rendering.renderer import Renderer, Size
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.util.errors import AccuracyWarning, InputError, MissingExtraError

OURS = "texvol"
SAMPLING_RATES = (0.5, 1.0, 2.0, 4.0, 8.0)
PRECLASSIFIED = ("slab", "extinction")
# Post and integrated share texels: with another classification in between, each bakes and uploads from scratch.
_ORDER = ("slab", "post", "extinction", "integrated")
_TEXEL_RATES = (1.0, 4.0)
_TARGET_RATE = 1.0
_FORMATS = ("rgba8", "rgba16f", "rgba32f")
_FRACTIONS = {Fraction(1, 2): "½", Fraction(1, 4): "¼", Fraction(1, 8): "⅛"}

ErrorOf = Callable[["Measurement"], "float | None"]


@dataclass(frozen=True)
class Setting:
    """What a user may choose, and who draws: texvol or a mapper of VTK."""

    classification: str
    sampling_rate: float
    texture_format: str = "auto"
    target_format: str = "auto"
    renderer: str = OURS

    @property
    def rate(self) -> str:
        """The sampling rate in short: ½, 1, 2 …"""
        return _FRACTIONS.get(Fraction(self.sampling_rate).limit_denominator(64), f"{self.sampling_rate:g}")

    @property
    def name(self) -> str:
        """Who and which classification: "slab", "VTK GPU"."""
        return self.classification if self.renderer == OURS else self.renderer

    @property
    def formats(self) -> str:
        """The formats that were asked for, in short; empty where they are the default."""
        texels = "" if self.texture_format == "auto" else f"{self.texture_format} texels"
        target = "" if self.target_format == "auto" else f"{self.target_format} target"
        return ", ".join(filter(None, (texels, target)))

    @property
    def words(self) -> str:
        """The setting as a sentence names it."""
        return f"{self.name} at rate {self.rate}" + (f" with {self.formats}" if self.formats else "")


@dataclass(frozen=True)
class Measurement:
    """One setting's time and errors; None is what could not be measured, and `skipped` says why nothing was."""

    setting: Setting
    slab_thickness: float  # world units; VTK's sample distance
    texture_format: str = ""  # that were used
    target_format: str = ""
    slabs: int | None = None
    frames: int = 0  # warm frames that the median is of
    seconds: float | None = None  # of a warm frame: draw and read back
    bake_seconds: float | None = None
    upload_seconds: float | None = None
    discretisation: Difference | None = None
    total: Difference | None = None
    estimated_error: float | None = None  # what the renderer itself expects, maximum
    skipped: str = ""


Outcome = tuple[Measurement, NDArray[np.floating[Any]] | None]


@dataclass(frozen=True)
class Truths:
    """The exact pictures of a scene; None, and the reason, where there is no oracle."""

    preclassified: NDArray[np.float64] | None
    postclassified: NDArray[np.float64] | None
    seconds: float = 0.0  # of both together
    reason: str = ""

    @classmethod
    def of(cls, scene: Scene, size: Size) -> Truths:
        """Both integrals of `scene` in a picture of `size`."""
        start = time.perf_counter()
        try:
            from texvol.ray_casting import raycast
        except MissingExtraError as error:
            return cls(None, None, reason=str(error))
        before, after = (raycast(replace(scene, classification=each), size) for each in ("slab", "post"))
        return cls(before, after, time.perf_counter() - start)

    def of_classification(self, classification: str) -> NDArray[np.float64] | None:
        """The integral that thinner slabs of this classification tend to."""
        return self.preclassified if classification in PRECLASSIFIED else self.postclassified

    @property
    def model_error(self) -> Difference | None:
        """How far the pre-classified integral is from the post-classified one."""
        return _difference(self.preclassified, self.postclassified)


@dataclass
class Limits:
    """How long a sweep may take; what would take longer is left out, and its row says so."""

    setting_seconds: float = 30.0  # for the frames of one setting
    sweep_seconds: float = 600.0
    least_frames: int = 3
    most_frames: int = 9
    frames_seconds: float = 1.0  # as many frames as fit in here, within the two numbers above
    _started: float = field(default_factory=time.perf_counter)

    def frames(self, predicted: float | None) -> int:
        """How many warm frames to draw when one is expected to take `predicted` seconds."""
        if not predicted:
            return self.least_frames
        return int(np.clip(self.frames_seconds / predicted, self.least_frames, self.most_frames))

    def reason_to_skip(self, predicted: float | None) -> str:
        """Why a setting is left out; empty if it is not."""
        needed = (predicted or 0.0) * (self.least_frames + 1)  # the first frame is not warm
        if needed > self.setting_seconds:
            return f"about {predicted:.1f} s a frame: more than {self.setting_seconds:g} s for its frames"
        if time.perf_counter() - self._started + needed > self.sweep_seconds:
            return f"the sweep's {self.sweep_seconds:g} s were used up"
        return ""


def settings(rates: Iterable[float] = SAMPLING_RATES) -> list[Setting]:
    """The settings of a sweep, coarse to fine: every classification, at some rates every texel and target format."""
    chosen = []
    for rate in rates:
        for classification in _ORDER:
            chosen.append(Setting(classification, rate))
            if rate in _TEXEL_RATES and classification in PRECLASSIFIED:
                chosen += [Setting(classification, rate, texture_format=each) for each in _FORMATS]
            if rate == _TARGET_RATE:
                chosen += [Setting(classification, rate, target_format=each) for each in _FORMATS[:-1]]
    return chosen


def sweep(
    renderer: Renderer, scene: Scene, size: Size, chosen: Iterable[Setting], truths: Truths, limits: Limits
) -> Iterator[Outcome]:
    """Each setting's measurement and picture, as they come.

    A setting whose format is what `auto` chose already is passed over. One that is skipped has no picture.
    """
    done: list[Measurement] = []
    for setting in chosen:
        if any(_is_the_same(setting, measurement) for measurement in done):
            continue
        predicted = predicted_seconds(setting, done)
        reason = limits.reason_to_skip(predicted)
        thickness = scene.smallest_spacing / setting.sampling_rate
        picture = None
        measurement = Measurement(setting, thickness, skipped=reason)
        if not reason:
            try:
                measurement, picture = _measure(renderer, scene, size, setting, limits.frames(predicted))
                measurement = with_errors(measurement, picture, truths)
            except InputError as error:
                measurement = Measurement(setting, thickness, skipped=str(error))
        measurement = _with_seconds_from_scratch(measurement, done)
        done.append(measurement)
        yield measurement, picture


@dataclass(frozen=True)
class Asked:
    """What came of asking for an error: `--max-error`."""

    classification: str
    wanted: float
    seconds: float  # of it all: choosing the thickness by drawing, and the picture
    slab_thickness: float
    estimated_error: float
    true_error: float | None  # maximum, against the integral of the classification


def ask(renderer: Renderer, scene: Scene, size: Size, wanted: float, truths: Truths) -> Asked:
    """Draw the scene with the error that is wanted, and see whether it is kept."""
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)  # what was reached is in the answer
        picture = renderer.render(scene, size, max_error=wanted)
    seconds = time.perf_counter() - start
    stats = renderer.stats
    difference = _difference(picture, truths.of_classification(scene.classification))
    return Asked(
        scene.classification,
        wanted,
        seconds,
        stats["slab_thickness"],
        stats["estimated_error"],
        difference.max_error if difference else None,
    )


def with_errors(measurement: Measurement, picture: NDArray, truths: Truths) -> Measurement:
    """The measurement with the errors of its picture."""
    truth = truths.of_classification(measurement.setting.classification)
    return replace(
        measurement,
        discretisation=_difference(picture, truth),
        total=_difference(picture, truths.postclassified),
    )


def predicted_seconds(setting: Setting, done: Iterable[Measurement]) -> float | None:
    """How long a frame should take, from the same at the next rate: it grows at most with the number of slabs."""
    alike = [
        each
        for each in done
        if each.seconds and each.setting.name == setting.name and each.setting.sampling_rate <= setting.sampling_rate
    ]
    if not alike:
        return None
    nearest = max(alike, key=lambda each: (each.setting.sampling_rate, each.seconds))
    assert nearest.seconds is not None
    return nearest.seconds * setting.sampling_rate / nearest.setting.sampling_rate


def total_max(measurement: Measurement) -> float | None:
    """Largest distance from the post-classified integral."""
    return measurement.total.max_error if measurement.total else None


def total_rms(measurement: Measurement) -> float | None:
    """Root mean square distance from the post-classified integral."""
    return measurement.total.rms_error if measurement.total else None


def discretisation_max(measurement: Measurement) -> float | None:
    """Largest distance from the integral of the setting's own classification."""
    return measurement.discretisation.max_error if measurement.discretisation else None


def discretisation_rms(measurement: Measurement) -> float | None:
    """Root mean square distance from the integral of the setting's own classification."""
    return measurement.discretisation.rms_error if measurement.discretisation else None


def pareto_front(measurements: Iterable[Measurement], error_of: ErrorOf) -> list[Measurement]:
    """Those than which no other is both faster and better, fastest first."""
    front: list[Measurement] = []
    least = np.inf
    for measurement, error in sorted(_measured(measurements, error_of), key=lambda each: (each[0].seconds, each[1])):
        if error < least:
            front.append(measurement)
            least = error
    return front


def fastest_within(measurements: Iterable[Measurement], error_of: ErrorOf, limit: float) -> Measurement | None:
    """The fastest setting whose error is at most `limit`, or None."""
    within = [measurement for measurement, error in _measured(measurements, error_of) if error <= limit]
    return min(within, key=lambda each: each.seconds or 0.0, default=None)


def most_accurate(measurements: Iterable[Measurement], error_of: ErrorOf) -> Measurement | None:
    """The setting with the least error, or None where no error is known."""
    measured = list(_measured(measurements, error_of))
    return min(measured, key=lambda each: each[1])[0] if measured else None


def _measure(
    renderer: Renderer, scene: Scene, size: Size, setting: Setting, frames: int
) -> tuple[Measurement, NDArray]:
    """Time and facts of one setting, and its picture."""
    thickness = scene.smallest_spacing / setting.sampling_rate
    picture = renderer.render(
        replace(scene, classification=setting.classification),  # type: ignore[arg-type]
        size,
        slab_thickness=thickness,
        texture_format=setting.texture_format,
        target_format=setting.target_format,
        repeat=1 + frames,
    )
    stats = renderer.stats
    seconds = stats["seconds"]
    measurement = Measurement(
        setting,
        thickness,
        texture_format=stats["texture_format"],
        target_format=stats["target_format"],
        slabs=stats["slabs"],
        frames=frames,
        seconds=seconds["draw"] + seconds["read"],
        bake_seconds=seconds["bake"] if "upload" in seconds else None,
        upload_seconds=seconds.get("upload"),
        estimated_error=stats["estimated_error"],
    )
    return measurement, picture


def _with_seconds_from_scratch(measurement: Measurement, done: list[Measurement]) -> Measurement:
    """The measurement with the bake and upload of an earlier one, where the texture or a part of it was still there.

    It was if the target is all that the two differ in.
    """
    if measurement.skipped:
        return measurement
    base = replace(measurement.setting, target_format="auto")
    for earlier in done:
        same_texture = (
            earlier.setting.classification == base.classification
            and earlier.texture_format == measurement.texture_format
            and (base.classification != "slab" or earlier.slab_thickness == measurement.slab_thickness)
        )
        if earlier.setting == base or (same_texture and measurement.upload_seconds is None):
            return replace(measurement, bake_seconds=earlier.bake_seconds, upload_seconds=earlier.upload_seconds)
    return measurement


def _is_the_same(setting: Setting, measurement: Measurement) -> bool:
    """Whether `setting` asks by name for what `measurement` had by itself."""
    asked = replace(setting, texture_format="auto")
    return setting.texture_format == measurement.texture_format and asked == measurement.setting


def _measured(measurements: Iterable[Measurement], error_of: ErrorOf) -> Iterator[tuple[Measurement, float]]:
    """Those that have a time and a finite error, with the error."""
    for measurement in measurements:
        error = error_of(measurement)
        if measurement.seconds and error is not None and np.isfinite(error):
            yield measurement, error


def _difference(picture: NDArray | None, truth: NDArray | None) -> Difference | None:
    return None if picture is None or truth is None else compare(picture, truth)


assert set(_ORDER) == set(CLASSIFICATIONS)
