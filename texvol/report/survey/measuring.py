"""Measurement of the survey's methods, and of texvol's own slices, on one scene in one run.

A method's picture is compared with the oracle of its order, and with the post-classified one: pictures of a method that
classifies before interpolation have the model error in the latter. Projections are compared with the integral of the
value along each ray, as fractions of its maximum.

Preparation (classification, encoding, transforms) happens once, drawing for each view; seconds of a picture are the
median of a few. The methods' compiled code is loaded before, by a picture of a few samples.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison import Difference, compare
from texvol.methods import METHODS, method_of
from texvol.methods.method import Order
from texvol.rendering.renderer import Renderer, Size
from texvol.report.convergence import Truths
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, MissingExtraError
from texvol.util.statistics import median

Numbers = NDArray[np.float64]
# texvol's own ways: name, order, and what they change in scene and settings.
_OWN: tuple[tuple[str, Order, dict[str, Any], dict[str, Any]], ...] = (
    ("texvol slab", "before", {"classification": "slab"}, {}),
    ("texvol slab by Wilson", "before", {"classification": "slab"}, {"slicing": "wilson"}),
    ("texvol post", "after", {"classification": "post"}, {}),
    ("texvol xray", "projection", {}, {}),
)
OWN = tuple(each[0] for each in _OWN)
_OWN_SOURCE = "Wilson et al. 1994, section 6.3"
_LEAST_FRAMES, _MOST_FRAMES, _FRAMES_SECONDS = 1, 7, 2.0
_WARM_UP_SAMPLES, _WARM_UP_SIZE = 8, (8, 8)


@dataclass(frozen=True)
class MethodMeasurement:
    """Time, memory and errors of one method; None for unknown numbers; `skipped` is the reason if it was not drawn.

    Errors of projections are fractions of the largest integral; the post-classified oracle has no such.
    """

    name: str
    source: str
    order: Order
    prepare_seconds: float | None = None
    draw_seconds: float | None = None  # of a picture, the median
    frames: int = 0
    memory: int | None = None  # bytes of what was prepared
    sampling_rate: float | None = None  # samples or slabs per smallest spacing
    bits_per_voxel: float | None = None  # of compressing methods
    own: Difference | None = None  # against the oracle of its order
    before: Difference | None = None  # against the pre-classified oracle
    after: Difference | None = None  # against the post-classified oracle
    skipped: str = ""


@dataclass(frozen=True)
class Outcome:
    """A measurement with its picture, linear and premultiplied, and the largest error of each pixel's channels."""

    measurement: MethodMeasurement
    picture: NDArray | None = None
    errors: Numbers | None = None


@dataclass
class Survey:
    """Measurements of methods on one scene."""

    scene: CompleteScene
    size: Size
    truths: Truths
    projected: Numbers | None  # ∫ v ds, (height, width, 1); None if the scene has no such picture
    outcomes: list[Outcome] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def measurements(self) -> list[MethodMeasurement]:
        """All measurements, texvol's own first."""
        return [each.measurement for each in self.outcomes]

    def truth_of(self, order: Order) -> Numbers | None:
        """Return the oracle's picture for methods of an order."""
        if order == "projection":
            return self.projected
        return self.truths.preclassified if order == "before" else self.truths.postclassified


def checked_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names in the order of `METHODS`, or raise InputError if one is not a method's."""
    unknown = [each for each in names if each not in METHODS]
    if unknown or not names:
        raise InputError(f"methods must be of {', '.join(METHODS)}, got {unknown[0] if unknown else ''!r}")
    return tuple(each for each in METHODS if each in names)


def first_refusal(scene: CompleteScene) -> str:
    """Return why no method can draw a scene, in the words of the first; empty if one can."""
    reasons = []
    for name in METHODS:
        try:
            method = method_of(name)
            if method.order != "projection":
                method.check(scene)
                return ""
        except (InputError, MissingExtraError) as error:
            reasons.append(str(error))
    return reasons[0] if reasons else ""


def survey(
    renderer: Renderer,
    scene: Scene,
    size: Size,
    names: Sequence[str] = tuple(METHODS),
    truths: Truths | None = None,
    most_seconds: float = np.inf,
    tell: Callable[[str], None] = lambda words: None,
) -> Survey:
    """Draw a scene by several methods, and measure each.

    Parameters
    ----------
    truths : Truths, optional
        Both exact pictures, if they are known already.
    most_seconds : float
        Methods that have not begun after so long are left out, and listed as such.
    tell : function
        Called with a line on each method.
    """
    start = time.perf_counter()
    scene = scene.completed(size)
    tell("integrating the scene exactly")
    found = Survey(scene, size, truths or Truths.of(scene, size), _projected(scene, size))
    for outcome in _drawn(renderer, found, checked_names(names), start + most_seconds):
        found.outcomes.append(outcome)
        tell(in_words(outcome.measurement))
    found.seconds = time.perf_counter() - start
    return found


def _drawn(renderer: Renderer, found: Survey, names: Sequence[str], end: float) -> Iterator[Outcome]:
    for name, order, parts, settings in _OWN:
        empty = MethodMeasurement(name, _OWN_SOURCE, order, sampling_rate=1.0)
        yield _outcome(found, empty, lambda p=parts, s=settings, o=order: _own(renderer, found, o, p, s))  # type: ignore[misc]
    for name in names:
        try:
            method = method_of(name)
        except MissingExtraError as error:
            yield Outcome(MethodMeasurement(name, "", "before", skipped=str(error)))
            continue
        empty = MethodMeasurement(name, method.source, method.order)
        if time.perf_counter() > end:
            yield Outcome(replace(empty, skipped="the time for this section was used up"))
        else:
            yield _outcome(found, empty, lambda name=name: _method(found, name))  # type: ignore[misc]


def _outcome(found: Survey, empty: MethodMeasurement, draw: Callable[[], tuple[dict[str, Any], NDArray]]) -> Outcome:
    """Return what `draw` measures, with errors; or why it could not."""
    try:
        numbers, picture = draw()
    except (InputError, MissingExtraError) as error:
        return Outcome(replace(empty, skipped=str(error)))
    except MemoryError:
        return Outcome(replace(empty, skipped="not enough memory"))
    measurement = replace(empty, **numbers)
    truth = found.truth_of(empty.order)
    if truth is None:
        return Outcome(measurement, picture)
    if empty.order == "projection":
        most = max(float(np.abs(truth).max()), np.finfo(float).tiny)
        picture, truth = picture[..., :1] / most, truth / most
        shown = np.concatenate([np.repeat(picture, 3, axis=-1), np.ones_like(picture)], axis=-1)
        return Outcome(replace(measurement, own=compare(picture, truth)), shown, np.abs(picture - truth)[..., 0])
    before, after = (
        None if each is None else compare(picture, each)
        for each in (found.truths.preclassified, found.truths.postclassified)
    )
    measurement = replace(measurement, before=before, after=after, own=before if empty.order == "before" else after)
    return Outcome(measurement, picture, np.abs(picture - truth).max(axis=-1))


def _own(
    renderer: Renderer, found: Survey, order: Order, parts: dict[str, Any], settings: dict[str, Any]
) -> tuple[dict[str, Any], NDArray]:
    """Draw by slices: what is baked and uploaded is what the others prepare."""
    scene = _as_projection(found.scene) if order == "projection" else replace(_plain(found.scene), **parts)

    def draw() -> NDArray:
        return renderer.render(scene, found.size, sampling_rate=1.0, **settings)

    draw()
    spent = renderer.seconds
    # Nothing is baked where the texture is that of the way before.
    prepared = spent["bake"] + spent["upload"] if "upload" in spent else None
    picture, seconds, frames = _timed(draw)
    memory = renderer.stats["texture_bytes"]
    return {"prepare_seconds": prepared, "draw_seconds": seconds, "frames": frames, "memory": memory}, picture


def _method(found: Survey, name: str) -> tuple[dict[str, Any], NDArray]:
    method = method_of(name)
    scene = found.scene
    if method.order == "projection" and scene.mode == "composite":
        scene = _as_projection(scene).completed(found.size)
    method.check(scene)
    _warm_up(name, scene)
    start = time.perf_counter()
    prepared = method(scene)
    numbers: dict[str, Any] = {"prepare_seconds": time.perf_counter() - start}
    picture, numbers["draw_seconds"], numbers["frames"] = _timed(lambda: prepared.picture(scene.camera, found.size))
    numbers["memory"] = prepared.memory
    for known in ("sampling_rate", "bits_per_voxel"):
        numbers[known] = getattr(prepared, known, None)
    return numbers, picture if picture.ndim == 3 else picture[..., np.newaxis]


def _timed(draw: Callable[[], NDArray]) -> tuple[NDArray, float, int]:
    """Return a picture, the median of the seconds that it takes, and of how many pictures."""
    times: list[float] = []
    while len(times) < _LEAST_FRAMES or (sum(times) < _FRAMES_SECONDS and len(times) < _MOST_FRAMES):
        start = time.perf_counter()
        picture = draw()
        times.append(time.perf_counter() - start)
    return picture, median(times), len(times)


def _warm_up(name: str, scene: CompleteScene) -> None:
    """Draw a few samples, so that compiling and loading code is not measured."""
    few = (slice(None, _WARM_UP_SAMPLES),) * 3
    volume = Volume(scene.volume.values[few], tuple(scene.volume.spacing), direction=scene.volume.direction)
    small = replace(_plain(scene), volume=volume, camera=Camera.framing(volume, scene.camera.projection))
    complete = small.completed(_WARM_UP_SIZE)
    method_of(name)(complete).picture(complete.camera, _WARM_UP_SIZE)


def _plain(scene: CompleteScene) -> Scene:
    """Return the scene as one whose parts may be replaced."""
    return Scene(**{name: getattr(scene, name) for name in Scene.__dataclass_fields__})


def _as_projection(scene: CompleteScene) -> Scene:
    """Return the scene as an X-ray picture of the values."""
    return replace(_plain(scene), mode="xray", transfer_function=None, lighting=None, depth_cue=None, caps=False)


def _projected(scene: CompleteScene, size: Size) -> Numbers | None:
    """Return the exact integral along each ray, shape (height, width, 1); None if the scene has no such picture."""
    from texvol.rendering.streaming.exact import raycast

    try:
        return raycast(_as_projection(scene), size)[..., :1]
    except InputError:
        return None


def in_words(each: MethodMeasurement) -> str:
    """Return a line on one measurement."""
    if each.skipped:
        return f"{each.name}: left out, {each.skipped.removeprefix(f'{each.name}: ')}"
    error = "" if each.own is None else f", rms error {each.own.rms_error:.1e}"
    return f"{each.name}: {1e3 * (each.draw_seconds or 0):.0f} ms{error}"
