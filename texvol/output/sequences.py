"""Sequences of pictures in numbered files or a film: an orbit or a tour of the camera, or steps of a time series.

The renderer's caches serve all pictures. The accuracy and the window of numbers that are chosen for the first picture
are used for all, so that nothing flickers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.films import film
from texvol.formats.readers import TimeSeries
from texvol.scene import orbit
from texvol.scene.label_counts import label_counts
from texvol.scene.orbit import Turn
from texvol.scene.scene import Scene
from texvol.scene.tour import Tour
from texvol.scene.volume import Volume
from texvol.util.terminal import status_line
from texvol.util.time_left import TimeLeft

if TYPE_CHECKING:
    from texvol.output.export import PictureExport
    from texvol.output.turn_page.writer import PageWriter
    from texvol.rendering.renderer import Renderer

_OF_FIRST = "estimated_error_of_first_view"
_STEPS = 32  # largest number of steps that represent a series


@dataclass(frozen=True)
class Frames:
    """Scenes of a sequence."""

    scenes: Iterator[Scene]
    count: int
    word: str  # noun for one of them: "view" or "time step"
    name: str  # file of the volume
    views: int = 1  # number of pictures of each scene, from different sides


def views(scene: Scene, count: int, name: str, turn: Turn | None = None) -> Frames:
    """Return an orbit of `count` views around the scene, all rows together; by default one turn about `up`."""
    assert scene.camera is not None
    cameras = orbit.cameras(scene.camera, count, turn or Turn(), scene.volume)
    return Frames((replace(scene, camera=each) for each in cameras), count, "view", name, views=count)


def tour(scene: Scene, path: Tour, count: int, name: str) -> Frames:
    """Return `count` views of the scene along a path through saved views.

    Raises
    ------
    InputError
        If there are fewer than two saved views.
    """
    cameras = path.cameras(count)
    return Frames((replace(scene, camera=each) for each in cameras), count, "view", name, views=count)


def steps(scene: Scene, series: TimeSeries, placed: Callable[[Volume], Volume] = lambda volume: volume) -> Frames:
    """Return scenes with the steps of a time series; `placed` moves each step to its position in the world."""
    scenes = (replace(scene, volume=placed(volume)) for volume in series)
    return Frames(scenes, len(series), "time step", series.name)


def representative_volume(series: TimeSeries) -> Volume:
    """Return a volume with values of all steps in the box of the first, for choices that depend on values.

    Diagonal planes of samples are taken from up to 32 steps in turn, so that every step is present everywhere. The
    first and the last sample are the least and the largest finite value of the series. For labels, the volume contains
    every label of any step.
    """
    first = series[0]
    if len(series) == 1:
        return first
    if first.labels:
        labels = np.unique(np.concatenate([label_counts(volume).labels for volume in series]))
        return _like(first, np.resize(labels, first.values.shape))
    values = first.values.copy()
    chosen = np.unique(np.linspace(0, len(series) - 1, _STEPS).round().astype(int))
    z, y, x = np.ogrid[tuple(slice(count) for count in values.shape)]
    for turn, step in enumerate(chosen):
        of_this_step = (x + y + z) % chosen.size == turn
        np.copyto(values, series[int(step)].values, where=of_this_step)
    if series.finite_range is not None:
        values.flat[0], values.flat[-1] = series.finite_range
    return _like(first, values)


def _like(first: Volume, values: NDArray) -> Volume:
    """Return a volume of the values with the first volume's box, unit and name."""
    return Volume(
        values,
        tuple(first.spacing),
        tuple(first.origin),
        first.direction,
        unit=first.unit,
        value_unit=first.value_unit,
        name=first.name,
        labels=first.labels,
        blocks=first.blocks,
        colors=first.colors,
    )


def draw_frames(
    frames: Frames,
    renderer: Renderer,
    size: tuple[int, int],
    accuracy: dict[str, Any],
    export: PictureExport,
    output: str,
    *,
    transparent: bool = False,
    fps: float | None = None,
    page: PageWriter | None = None,
) -> dict[str, Any]:
    """Draw and write all pictures, or a `page` of them; return their entries for `--stats`."""
    start = after_first = time.perf_counter()
    estimate: float | None = None
    rate, left = fps or film.default_rate(frames.count), TimeLeft()
    with (
        page or film.Writer(output, size, frames.count, transparent=transparent, fps=rate) as writer,
        status_line() as show,
        closing(renderer.frames(frames.scenes, size, count=frames.count, views=frames.views, **accuracy)) as drawn,
    ):
        for number, frame in enumerate(drawn):
            if number == 0:
                estimate = frame.kept.estimate.get(_OF_FIRST)
                # Slabs of another thickness would be baked, and then these again.
                if estimate is None and (page is not None or frame.kept.classification != "slab"):
                    estimate = renderer.quick_estimate()
                if page is not None:
                    page.show = show
                    page.describe(frame.scene, frames.name, estimate)
                after_first = time.perf_counter()
            shown = export.of(frame.picture, frame.scene, output)
            metadata = export.metadata(frames.name, frame.scene, output, frame.settings)
            writer.add(shown, frame.kept.attributes | metadata)
            left.learn((number + 1) / frames.count, now := time.perf_counter())
            shown_left = left.text(now)
            show(f"texvol: {frames.word} {number + 1} of {frames.count}" + (f", {shown_left}" if shown_left else ""))
        writer.finish()
    end = time.perf_counter()
    return {
        "views": frames.count,
        "seconds": end - start,
        "frames_per_second": (frames.count - 1) / (end - after_first) if frames.count > 1 else None,
        _OF_FIRST: estimate,
    } | (page.stats if page is not None else {})
