"""Measurements of speed against error: one scene drawn with many settings, each timed and compared with both oracles.

Three errors are kept apart. The *discretisation error* of a picture is its distance from the exact integral of its
classification's medium; thinner slabs remove it. The *model error* is the distance of the pre-classified integral from
the post-classified one; only another classification removes it. The *total error* is a picture's distance from the
post-classified integral; for `post` and `integrated` the total error is the discretisation error.

Seconds are those of a warm frame: the median draw, and reading the picture back. Baking and uploading the texture come
before the first frame and are given separately.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison import Difference, compare
from texvol.rendering.renderer import Renderer, Size
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.slicing.slabs import SLICINGS, Slicing
from texvol.util.errors import AccuracyWarning, InputError, MissingExtraError

OURS = "texvol"
SAMPLING_RATES = (0.5, 1.0, 2.0, 4.0, 8.0)
PRECLASSIFIED = ("slab", "extinction")
# Post and integrated share texels: another classification between them makes each bake and upload from scratch.
_ORDER = ("slab", "post", "extinction", "integrated")
_TEXEL_RATES = (1.0, 4.0)
_TARGET_RATE = 1.0
_FORMATS = ("rgba8", "rgba16f", "rgba32f")
_FRACTIONS = {Fraction(1, 2): "½", Fraction(1, 4): "¼", Fraction(1, 8): "⅛"}

ErrorOf = Callable[["Measurement"], "float | None"]


@dataclass(frozen=True)
class Setting:
    """Settings that a user may choose, and the renderer: texvol or a mapper of VTK."""

    classification: str
    sampling_rate: float
    texture_format: str = "auto"
    target_format: str = "auto"
    renderer: str = OURS
    slicing: Slicing = "stacks"
    texture_refinement: int = 1

    @property
    def rate(self) -> str:
        """Sampling rate as a short text: ½, 1, 2 …"""
        return _FRACTIONS.get(Fraction(self.sampling_rate).limit_denominator(64), f"{self.sampling_rate:g}")

    @property
    def name(self) -> str:
        """Short name of renderer, classification and slicing: "slab", "slab by Wilson", "VTK GPU"."""
        if self.renderer != OURS:
            return self.renderer
        sliced = {"stacks": "", "polygons": " by polygons", "wilson": " by Wilson"}[self.slicing]
        return self.classification + (" refined" if self.texture_refinement > 1 else "") + sliced

    @property
    def formats(self) -> str:
        """Formats that were asked for, as a short text; empty for the default."""
        texels = "" if self.texture_format == "auto" else f"{self.texture_format} texels"
        target = "" if self.target_format == "auto" else f"{self.target_format} target"
        return ", ".join(filter(None, (texels, target)))

    @property
    def words(self) -> str:
        """Name of the setting in a sentence."""
        return f"{self.name} at rate {self.rate}" + (f" with {self.formats}" if self.formats else "")


@dataclass(frozen=True)
class Measurement:
    """Time and errors of one setting; None for unknown numbers; `skipped` is the reason if nothing was measured."""

    setting: Setting
    slab_thickness: float  # world units; VTK's sample distance
    texture_format: str = ""  # as used
    target_format: str = ""
    slabs: int | None = None
    frames: int = 0  # number of warm frames
    seconds: float | None = None  # of a warm frame: draw and read back
    processor_seconds: float | None = None  # the same of all threads together; VTK's only
    bake_seconds: float | None = None
    upload_seconds: float | None = None
    discretisation: Difference | None = None
    total: Difference | None = None
    estimated_error: float | None = None  # maximum error that the renderer expects
    estimated_model_error: float | None = None  # and the largest difference of its medium's integral from post's
    skipped: str = ""


Outcome = tuple[Measurement, NDArray[np.floating[Any]] | None]


@dataclass(frozen=True)
class Truths:
    """Exact pictures of a scene; None, with the reason, without an oracle."""

    preclassified: NDArray[np.float64] | None
    postclassified: NDArray[np.float64] | None
    seconds: float = 0.0  # of all together
    reason: str = ""
    refined: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)  # pre-classified, by texture refinement

    @classmethod
    def of(
        cls,
        scene: Scene,
        size: Size,
        refinements: Iterable[int] = (),
        tell: Callable[[float], None] = lambda fraction: None,
    ) -> Truths:
        """Return both integrals of `scene` in a picture of `size`, and those of refined textures.

        `tell` is told again and again what fraction of the picture that is being computed is there.
        """
        start = time.perf_counter()
        try:
            from texvol.ray_casting import raycast_progressively
        except MissingExtraError as error:
            return cls(None, None, reason=str(error))

        def truth(classification: Classification, refinement: int = 1) -> NDArray[np.float64]:
            of_kind = replace(scene, classification=classification)
            *_, (_, picture) = raycast_progressively(of_kind, size, texture_refinement=refinement, tell=tell)
            return picture

        before, after = truth("slab"), truth("post")
        refined = {each: truth("slab", each) for each in refinements}
        return cls(before, after, time.perf_counter() - start, refined=refined)

    def of_setting(self, setting: Setting) -> NDArray[np.float64] | None:
        """Return the integral that thinner slabs of a setting converge to."""
        if setting.texture_refinement > 1:
            return self.refined.get(setting.texture_refinement)
        return self.preclassified if setting.classification in PRECLASSIFIED else self.postclassified

    @property
    def model_error(self) -> Difference | None:
        """Difference of the pre-classified and the post-classified integral."""
        return _difference(self.preclassified, self.postclassified)


@dataclass
class Limits:
    """Limits of a sweep's time; settings that would take longer are skipped, and their rows say so."""

    setting_seconds: float = 30.0  # for the frames of one setting
    sweep_seconds: float = 600.0
    least_frames: int = 3
    most_frames: int = 9
    frames_seconds: float = 1.0  # as many frames as take this long, within the two numbers above
    _started: float = field(default_factory=time.perf_counter)

    def frames(self, predicted: float | None) -> int:
        """Return the number of warm frames to draw if one takes `predicted` seconds."""
        if not predicted:
            return self.least_frames
        return int(np.clip(self.frames_seconds / predicted, self.least_frames, self.most_frames))

    def reason_to_skip(self, predicted: float | None) -> str:
        """Return the reason to skip a setting; empty to draw it."""
        needed = (predicted or 0.0) * (self.least_frames + 1)  # the first frame is not warm
        if needed > self.setting_seconds:
            return f"about {predicted:.1f} s a frame: more than {self.setting_seconds:g} s for its frames"
        if time.perf_counter() - self._started + needed > self.sweep_seconds:
            return f"the sweep's {self.sweep_seconds:g} s were used up"
        return ""


def settings(rates: Iterable[float] = SAMPLING_RATES, texture_refinement: int = 1) -> list[Setting]:
    """Return the settings of a sweep, coarse to fine: all classifications, at some rates all formats.

    `texture_refinement` is another one that `slab` is drawn with, unless it is 1.
    """
    chosen = []
    for rate in rates:
        for classification in _ORDER:
            chosen.append(Setting(classification, rate))
            if classification == "slab":
                chosen += [Setting(classification, rate, slicing=each) for each in SLICINGS if each != "stacks"]
                if texture_refinement > 1:
                    chosen.append(Setting(classification, rate, texture_refinement=texture_refinement))
            if rate in _TEXEL_RATES and classification in PRECLASSIFIED:
                chosen += [Setting(classification, rate, texture_format=each) for each in _FORMATS]
            if rate == _TARGET_RATE:
                chosen += [Setting(classification, rate, target_format=each) for each in _FORMATS[:-1]]
    return chosen


def sweep(
    renderer: Renderer, scene: Scene, size: Size, chosen: Iterable[Setting], truths: Truths, limits: Limits
) -> Iterator[Outcome]:
    """Yield the measurement and the picture of each setting.

    A setting whose format `auto` has chosen already is left out. A skipped setting has no picture.
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
    """Result of asking for an error with `--max-error`."""

    classification: str
    wanted: float
    seconds: float  # choosing the thickness by drawing, and the picture
    slab_thickness: float
    estimated_error: float
    true_error: float | None  # maximum, against the integral of the classification


def ask(renderer: Renderer, scene: Scene, size: Size, wanted: float, truths: Truths) -> Asked:
    """Draw the scene with an error limit, and measure the error."""
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)  # the result holds the estimate
        picture = renderer.render(scene, size, max_error=wanted)
    seconds = time.perf_counter() - start
    stats = renderer.stats
    difference = _difference(picture, truths.of_setting(Setting(scene.classification, 1.0)))
    return Asked(
        scene.classification,
        wanted,
        seconds,
        stats["slab_thickness"],
        stats["estimated_error"],
        difference.max_error if difference else None,
    )


def with_errors(measurement: Measurement, picture: NDArray, truths: Truths) -> Measurement:
    """Return the measurement with the errors of its picture."""
    truth = truths.of_setting(measurement.setting)
    return replace(
        measurement,
        discretisation=_difference(picture, truth),
        total=_difference(picture, truths.postclassified),
    )


def predicted_seconds(setting: Setting, done: Iterable[Measurement]) -> float | None:
    """Return the expected time of a frame, from the same setting at a lower rate: time grows at most with the slabs."""
    alike = (
        each
        for each in done
        if each.seconds and each.setting.name == setting.name and each.setting.sampling_rate <= setting.sampling_rate
    )
    nearest = max(alike, key=lambda each: (each.setting.sampling_rate, each.seconds), default=None)
    if nearest is None or nearest.seconds is None:
        return None
    return nearest.seconds * setting.sampling_rate / nearest.setting.sampling_rate


def _error_of(against: str, name: str) -> ErrorOf:
    def error_of(measurement: Measurement) -> float | None:
        difference: Difference | None = getattr(measurement, against)
        return getattr(difference, name) if difference else None

    return error_of


# Largest and root mean square distance, from the post-classified integral, and from that of the own classification.
total_max, total_rms = _error_of("total", "max_error"), _error_of("total", "rms_error")
discretisation_max = _error_of("discretisation", "max_error")
discretisation_rms = _error_of("discretisation", "rms_error")


def pareto_front(measurements: Iterable[Measurement], error_of: ErrorOf) -> list[Measurement]:
    """Return the measurements for which no other is both faster and better, fastest first."""
    front: list[Measurement] = []
    least = np.inf
    for measurement, error in sorted(_measured(measurements, error_of), key=lambda each: (each[0].seconds, each[1])):
        if error < least:
            front.append(measurement)
            least = error
    return front


def fastest_within(measurements: Iterable[Measurement], error_of: ErrorOf, limit: float) -> Measurement | None:
    """Return the fastest setting whose error is at most `limit`; None if there is none."""
    within = [measurement for measurement, error in _measured(measurements, error_of) if error <= limit]
    return min(within, key=lambda each: each.seconds or 0.0, default=None)


def most_accurate(measurements: Iterable[Measurement], error_of: ErrorOf) -> Measurement | None:
    """Return the setting with the least error; None if no error is known."""
    measured = list(_measured(measurements, error_of))
    return min(measured, key=lambda each: each[1])[0] if measured else None


def _measure(
    renderer: Renderer, scene: Scene, size: Size, setting: Setting, frames: int
) -> tuple[Measurement, NDArray]:
    """Return the measurement of one setting without errors, and its picture."""
    thickness = scene.smallest_spacing / setting.sampling_rate
    picture = renderer.render(
        replace(scene, classification=setting.classification),  # type: ignore[arg-type]
        size,
        slab_thickness=thickness,
        texture_format=setting.texture_format,
        target_format=setting.target_format,
        slicing=setting.slicing,
        texture_refinement=setting.texture_refinement,
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
        estimated_model_error=stats["estimated_model_error"],
    )
    return measurement, picture


def _with_seconds_from_scratch(measurement: Measurement, done: list[Measurement]) -> Measurement:
    """Return the measurement with the bake and upload of an earlier one if it used that texture or a part of it.

    Measurements that differ only in the target use one texture, and so do most that differ only in the slicing.
    """
    if measurement.skipped:
        return measurement
    base = replace(measurement.setting, target_format="auto")
    for earlier in done:
        same_texture = (
            (earlier.setting.classification, earlier.setting.texture_refinement)
            == (base.classification, base.texture_refinement)
            and earlier.texture_format == measurement.texture_format
            and (base.classification != "slab" or earlier.slab_thickness == measurement.slab_thickness)
        )
        if earlier.setting == base or (same_texture and measurement.upload_seconds is None):
            return replace(measurement, bake_seconds=earlier.bake_seconds, upload_seconds=earlier.upload_seconds)
    return measurement


def _is_the_same(setting: Setting, measurement: Measurement) -> bool:
    """True if `setting` names the format that `auto` chose in `measurement`."""
    asked = replace(setting, texture_format="auto")
    return setting.texture_format == measurement.texture_format and asked == measurement.setting


def _measured(measurements: Iterable[Measurement], error_of: ErrorOf) -> Iterator[tuple[Measurement, float]]:
    """Yield the measurements with a time and a finite error, and the error."""
    for measurement in measurements:
        error = error_of(measurement)
        if measurement.seconds and error is not None and np.isfinite(error):
            yield measurement, error


def _difference(picture: NDArray | None, truth: NDArray | None) -> Difference | None:
    return None if picture is None or truth is None else compare(picture, truth)


assert set(_ORDER) == set(CLASSIFICATIONS)
