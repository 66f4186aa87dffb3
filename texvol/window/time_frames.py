"""Scenes of a film over time, as a painting process draws them: one step after the other is read."""

from __future__ import annotations

from collections.abc import Iterator

from texvol.formats.readers import TimeSeries
from texvol.output.sequences import Frames
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window.ahead import Track
from texvol.window.stand_in import StandIn, stand_in
from texvol.window.stepped import Stepper


def frames(scene: Scene, count: int, name: str) -> Frames:
    """Return the scene at each of `count` time steps.

    Volumes that are steps of a series of another length stay as they are.
    """
    return Frames(_scenes(scene, count), count, "time step", name)


def _scenes(scene: Scene, count: int) -> Iterator[Scene]:
    opened: dict[str, tuple[Track, TimeSeries]] = {}
    tracks = {volume: track for volume in scene.volumes if (track := Track.of(volume)) is not None}
    try:
        for track in tracks.values():
            if track.key not in opened:
                opened[track.key] = track, track.series()
        going = {volume: track for volume, track in tracks.items() if len(opened[track.key][1]) == count}
        for number in range(count):
            read: dict[str, Volume] = {}
            for track in going.values():
                if track.key not in read:
                    read[track.key] = track.placed(opened[track.key][1][number])
            yield Stepper({volume: _like(volume, read[track.key]) for volume, track in going.items()}).scene(scene)
    finally:
        for _, series in opened.values():
            series.close()


def _like(volume: Volume, step: Volume) -> Volume:
    """Return a step in memory if the volume that it replaces is, or its stand-in."""
    if isinstance(volume, LargeVolume):
        return step
    return stand_in(step) if isinstance(volume, StandIn) else step.whole
